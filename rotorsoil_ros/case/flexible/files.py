"""Which body that bends some files describe: matrices of finite elements, or modes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import os
from pathlib import Path
from typing import Any

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.entries.cells import at_once
from rotorsoil_ros.case.flexible import matrices, tables, universal
from rotorsoil_ros.case.flexible.foreign import reading, text_of
from rotorsoil_ros.case.flexible.interface import Interface
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.machine.flexible.body import FlexibleBody, massless, SEAT
from rotorsoil_ros.machine.flexible.reduction import FiniteElements
from rotorsoil_ros.units import hz_to_rad_s


@dataclass(frozen=True, slots=True)
class Loss:
    """
    What is known of the damping of a body: one of both.

    Attributes
    ----------
    factor : float or None
        Loss factor of its material [-].
    ratios : float, sequence of float or None
        Damping ratio of all modes, or of each [-].

    """

    factor: float | None
    ratios: float | Sequence[float] | None = None

    def of(self, count: int) -> tuple[FloatArray, float]:
        """Return the loss factor of each mode, and of the rest."""
        if self.ratios is None:
            assert self.factor is not None
            loss: FloatArray = np.full(count, self.factor)
        else:
            ratios = np.array(self.ratios, dtype=float)
            if ratios.ndim and len(ratios) != count:
                raise RotorSoilError(f'damping_ratios must be one number or {count}, one for each '
                                     f'mode, got {len(ratios)}')
            loss = 2.0 * np.broadcast_to(ratios, count)
        wrong = loss[~((loss >= 0.0) & (loss < 1.0))]
        if wrong.size:
            raise RotorSoilError(
                f'loss_factor must be in [0, 1), got {wrong[0]:g}' if self.ratios is None else
                f'damping_ratios must be in [0, 0.5), got {0.5 * wrong[0]:g}')
        return loss.copy(), float(loss.mean()) if count else 0.0


def read_flexible(
    *, loss_factor: float, dofs: str | os.PathLike[str] | None = None,
    stiffness: str | os.PathLike[str] | None = None, mass: str | os.PathLike[str] | None = None,
    up_to_hz: float | None = None, modes: str | os.PathLike[str] | None = None,
    residual: str | os.PathLike[str] | None = None, rigid: str | os.PathLike[str] | None = None,
) -> FlexibleBody:
    """
    Read a body that bends from the files that `foundations[].flexible` of a case names.

    Parameters
    ----------
    loss_factor : float
        Of its material [-].
    dofs : path or None
        What its motions are; of modes it may be left out.
    stiffness, mass : path
        Matrices of a body that nothing holds, with `up_to_hz`.
    up_to_hz : float
        Up to which its modes are kept [Hz]; the rest is its residual.
    modes, residual, rigid : path
        Instead of matrices.

    Raises
    ------
    InputError
        With everything that is wrong with these files.
    RotorSoilError
        If they do not describe such a body.

    """
    loss = Loss(loss_factor)
    if modes is not None and residual is not None and rigid is not None:
        return of_modes(Path(modes), residual=Path(residual), rigid=Path(rigid),
                        dofs=None if dofs is None else Path(dofs), loss=loss)
    if stiffness is None or mass is None or dofs is None or up_to_hz is None:
        raise RotorSoilError('files must be modes, residual and rigid, or stiffness, mass and '
                             'dofs with up_to_hz')
    return of_matrices(Path(stiffness), mass=Path(mass), dofs=Path(dofs),
                       highest=float(hz_to_rad_s(up_to_hz)), loss=loss)


def of_modes(
    modes: Path, *, residual: Path, rigid: Path, dofs: Path | None, loss: Loss,
) -> FlexibleBody:
    """Return the body of modes, of what they leave out and of its rigid motion."""
    reads: tuple[Callable[[], Any], ...] = (
        lambda: _modes(modes), lambda: _numbers(rigid, 6), lambda: _numbers(residual),
        lambda: None if dofs is None else _motions(dofs))
    (names, frequency, shapes), table, flexibility, rows = at_once(reads)
    checks: tuple[Callable[[], Any], ...] = (
        lambda: tables.rigid_of(rigid, table, names),
        lambda: tables.flexibility_of(residual, flexibility, names))
    (mass, rigid_rows), flexibility = at_once(checks)
    own = (tables.dofs_of(modes, names, rigid_rows) if dofs is None
           else tables.dofs_among(dofs, rows, names, rigid_rows))
    each, rest = loss.of(len(frequency))
    if not flexibility.any() and len(frequency) < len(names) - len(DOFS):
        raise RotorSoilError(f'residual must not be zero where {len(frequency)} modes tell of '
                             f'{len(names)} motions: they leave something out')
    body = FlexibleBody(tuple(own), mass, rigid_rows, shapes, hz_to_rad_s(frequency) ** 2,
                        flexibility, each, rest, reach=float(hz_to_rad_s(frequency.max())))
    loaded = [*body.of_kind(SEAT), *body.contacts.tolist()]
    massless(body.residual[np.ix_(loaded, loaded)], body.static_size[loaded])
    return body


def of_matrices(
    stiffness: Path, *, mass: Path, dofs: Path, highest: float, loss: Loss,
    grounded: bool = False,
) -> FlexibleBody:
    """Return the body of matrices with its modes up to a frequency [rad/s]."""
    reads: tuple[Callable[[], Any], ...] = (
        lambda: matrices.read(stiffness), lambda: matrices.read(mass), lambda: _motions(dofs))
    elastic, carried, rows = at_once(reads)
    order = None
    if stiffness.suffix.lower() == matrices.STIFFNESS:
        order = matrices.order_of_calculix(
            stiffness.with_suffix(matrices.ORDER), elastic.shape[0])
    wanted = Interface.of(dofs, rows, elastic.shape[0], order)
    elements = FiniteElements.of(elastic, carried, wanted.dofs, wanted.pick, wanted.known)
    [own], rest = loss.of(1)
    if grounded:
        return elements.grounded(highest, loss=rest)
    return elements.body(highest, loss=float(own))


def _modes(path: Path) -> tuple[list[str], FloatArray, FloatArray]:
    """Return names, frequencies [Hz] and shapes, of a table or a universal file."""
    text = text_of(path)
    if universal.is_universal(path, text):
        return universal.modes(path)
    with reading(path):
        return tables.modes(path, text)


def _numbers(path: Path, columns: int | None = None) -> FloatArray:
    text = text_of(path)
    with reading(path):
        return tables.numbers_of(path, text, columns=columns)


def _motions(path: Path) -> list[tables.Row]:
    text = text_of(path)
    with reading(path):
        return tables.motions(path, text)
