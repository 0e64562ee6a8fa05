"""From what a plant knows to a case: a dialogue on a terminal, or options."""

from argparse import Namespace
from collections.abc import Iterator
import shlex
import sys
from typing import Any

from rotorsoil_ros.case import document
from rotorsoil_ros.case.authoring import new_case, questions
from rotorsoil_ros.case.authoring.questions import Inquiry, QUESTIONS
from rotorsoil_ros.cli.table import opened
from rotorsoil_ros.errors import InputError


def new(arguments: Namespace) -> int:
    """Write the case of a machine, and say what of it was guessed."""
    if arguments.questions:
        print('\n'.join(_listed()))
        return 0
    given = questions.parsed(arguments.answers)
    if arguments.kind is not None:
        if 'kind' in given:
            raise InputError(f'{questions.SOURCE}: kind: stands twice, as {arguments.kind} too')
        given = {'kind': arguments.kind, **given}
    # Who gives answers as options wants to be asked nothing.
    if not arguments.answers and sys.stdin.isatty():
        given = _asked(given)
    answers = questions.checked(given)
    told = [word for key, value in given.items() if key != 'kind'
            for word in (questions.SOURCE, f'{key}={value}')]
    text = new_case.text_of(answers, command=shlex.join(
        ['rotorsoil', 'new', answers.kind, *told]))
    with opened(arguments.output) as stream:
        stream.write(text)
    guesses = text.count(new_case.MARK) - 1  # its head explains the mark
    where = 'the case' if arguments.output == '-' else arguments.output
    print(f'{where}: {guesses} numbers are guesses, each marked {new_case.MARK}', file=sys.stderr)
    if arguments.output != '-':
        print(f'next: rotorsoil report {arguments.output} --rpm {answers.rpm:g}', file=sys.stderr)
    return 0


def _listed() -> Iterator[str]:
    """Yield a line for every key that can be answered."""
    for question in QUESTIONS:
        unit = f' [{question.unit}]' if question.unit else ''
        yield (f'{question.key + unit:28s} {question.text}'
               + (f': {", ".join(question.choices)}' if question.choices else '')
               + (f'; else {question.otherwise}' if question.otherwise else '; has to be told'))


def _asked(given: dict[str, Any]) -> dict[str, Any]:
    """Return answers that somebody types; an empty one leaves a number to a guess."""
    print('Enter alone: not known, a guess is taken.', file=sys.stderr)
    found = dict(given)
    for question in QUESTIONS:
        if question.key in found:
            continue
        value = _answer(question)
        if value is not None:
            found[question.key] = value
    return found


def _answer(question: Inquiry) -> Any:
    """Ask until an answer can be one; None where it is not known."""
    unit = f' [{question.unit}]' if question.unit else ''
    choices = f' ({", ".join(question.choices)})' if question.choices else ''
    guess = f' <{question.otherwise}>' if question.otherwise else ''
    while True:
        print(f'{question.text}{choices}{unit}{guess}: ', end='', file=sys.stderr, flush=True)
        line = sys.stdin.readline()
        if not line:
            raise InputError(f'{question.key}: the answers ended before it')
        if not line.strip():
            if question.otherwise:
                return None
            wrong = [f'{question.key}: has to be told']
        else:
            try:
                value = document.parse(line.strip(), source=question.key)
                wrong = questions.faults_of(question, value)
            except InputError as error:
                wrong = [str(error)]
            if not wrong:
                return value
        print('\n'.join(wrong), file=sys.stderr)
