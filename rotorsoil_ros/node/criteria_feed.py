"""Who computes, while a node runs, what its machines are judged by? One process after another."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
import subprocess

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.monitor.criteria import Criteria, start_aside, stored_criteria

Tell = Callable[[str], object]


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """What is wanted, and who is to be told."""

    machine: Machine
    unbalance: ComplexArray
    take: Callable[[Criteria], None]


class Bench:
    """
    Answers questions for criteria out of the cache, or by a process of low priority.

    A new question of the same name replaces the last one: nobody waits for what a parameter
    no longer says.
    """

    def __init__(self, directory: Path, *, complain: Tell) -> None:
        self._directory = directory
        self._complain = complain
        self._questions: dict[str, Question] = {}
        self._process: subprocess.Popen[str] | None = None
        self._asked: tuple[str, Question] | None = None

    def ask(
        self, name: str, machine: Machine, unbalance: ComplexArray,
        take: Callable[[Criteria], None],
    ) -> None:
        """Answer at once if the cache can, else some time later, in `step`."""
        self._questions.pop(name, None)
        question = Question(machine, unbalance, take)
        if not self._answer(question):
            self._questions[name] = question

    def step(self) -> None:
        """Look after the process; start the next one. Called once a second."""
        if self._process is not None and self._process.poll() is not None:
            self._finish(self._process)
        while self._process is None and self._questions:
            name, question = next(iter(self._questions.items()))
            if self._answer(question):  # another machine of the same case was first
                del self._questions[name]
                continue
            self._asked = name, question
            self._process = start_aside(
                question.machine.case.path, question.unbalance, self._directory)

    def close(self) -> None:
        """Forget every question."""
        self._questions = {}
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _finish(self, process: 'subprocess.Popen[str]') -> None:
        _, said = process.communicate()
        assert self._asked is not None
        (name, question), self._asked, self._process = self._asked, None, None
        if self._questions.get(name) is not question:
            return
        del self._questions[name]
        if not self._answer(question):
            why = said.strip().splitlines()[-1] if said.strip() else (
                f'nothing was left in {self._directory}')
            self._complain(f'{name}: no band and no zones: {why}')

    def _answer(self, question: Question) -> bool:
        machine = question.machine
        found = stored_criteria(machine.case, machine.model, question.unbalance, self._directory)
        if found is not None:
            question.take(found)
        return found is not None
