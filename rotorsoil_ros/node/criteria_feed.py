"""Who computes, while a node runs, what its machines are judged by? One process after another."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.background import Child, Children
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.monitor.criteria import compute_aside, Criteria, stored_criteria

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
        self._children = Children()

    def ask(
        self, name: str, machine: Machine, unbalance: ComplexArray,
        take: Callable[[Criteria], None],
    ) -> None:
        """Answer at once if the cache can, else some time later, in `step`."""
        self._children.forget(name)
        question = Question(machine, unbalance, take)
        if not self._answer(question):
            self._children.ask(name, partial(self._start, question),
                               partial(self._finish, name, question))

    def step(self) -> None:
        """Look after the process; start the next one. Called once a second."""
        self._children.step()

    def close(self) -> None:
        """Forget every question."""
        self._children.close()

    def _start(self, question: Question) -> Child | None:
        if self._answer(question):  # another machine of the same case was first
            return None
        return compute_aside(question.machine.case.file, question.unbalance, self._directory)

    def _finish(self, name: str, question: Question, child: Child) -> None:
        if not self._answer(question):
            why = child.failure or f'nothing was left in {self._directory}'
            self._complain(f'{name}: no band and no zones: {why}')

    def _answer(self, question: Question) -> bool:
        machine = question.machine
        found = stored_criteria(machine.case, machine.model, question.unbalance, self._directory)
        if found is not None:
            question.take(found)
        return found is not None
