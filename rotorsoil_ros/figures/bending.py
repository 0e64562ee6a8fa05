"""How foundations that bend move: at critical speeds, and while the machine runs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.figures.response import COLOURS
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.flexible.body import FlexibleBody
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.modes.names import ModeNames
from rotorsoil_ros.units import rad_s_to_rpm

# Modes that are drawn, those of less damping first met; what they move at most, of the extent.
_MOST_MODES = 3
_FELT = 0.2
_SHARE = 0.08
# Two places with a third within the ball between them are no neighbours.
_BALL = 1.0 + 1e-6


@dataclass(frozen=True)
class _Shape:
    """What is drawn once: a title and the motion of all points of the support."""

    title: str
    motion: ComplexArray


def bending_figure(case: Case, model: CoupledModel) -> Figure:
    """Draw the places of every foundation that bends, at rest and where they move."""
    shapes = [*_modes(case, model), _operating(case, model)]
    bodies = [(index, block.body) for index, block in enumerate(model.foundations)
              if block.body is not None]
    figure = Figure(figsize=(4.4 * len(shapes), 4.2 * len(bodies)), layout='constrained')
    for row, (index, body) in enumerate(bodies):
        for column, shape in enumerate(shapes):
            axes = figure.add_subplot(len(bodies), len(shapes), row * len(shapes) + column + 1,
                                      projection='3d')
            _draw(axes, model, index, body, shape)
    figure.suptitle(f'{case.name}: foundations that bend; grey at rest, motion magnified',
                    fontsize=10)
    return figure


def _modes(case: Case, model: CoupledModel) -> Iterator[_Shape]:
    names = ModeNames(model)
    try:
        found = critical_speeds(model, case.speed_range)
    except RotorSoilError:  # `check` says why modes are not known
        return
    felt = [one for one in found if 0.0 < one.damping_ratio < _FELT]
    for one in felt[:_MOST_MODES]:
        yield _Shape(f'{names.of_critical(one)}\n{one.speed_rpm:.0f} rpm, damping '
                     f'{one.damping_ratio:.2g}', model.support.point_motion @ one.support)


def _operating(case: Case, model: CoupledModel) -> _Shape:
    """Return how it moves under its unbalance at the highest speed."""
    support, speed = model.support, case.speed_range[1]
    found = model.unbalance_response(np.array([speed]), case.unbalance)
    channels = list(model.channels)
    housings = [channels.index(channel) for channel in model.rotor.channels
                if channel.is_housing]
    below = [channels.index(channel) for part in support.members for channel in part.contacts]
    below += [channels.index(channel) for part in support.members for channel in part.probes]
    return _Shape(f'running\n{rad_s_to_rpm(speed):.0f} rpm',
                  found.displacement[0, [*housings, *below]])


def _draw(
    axes: object, model: CoupledModel, index: int, body: FlexibleBody, shape: _Shape,
) -> None:
    places, moved = _places(model, index, body, shape.motion)
    extent = float(np.ptp(places, axis=0).max())
    largest = float(np.abs(moved).max(initial=0.0))
    scale = _SHARE * extent / largest if largest > 0.0 else 0.0
    # At the moment at which it is bent most.
    turn = np.exp(-0.5j * np.angle((moved**2).sum()))
    bent = places + scale * (moved * turn).real
    for one, other in _neighbours(places):
        for where, style in ((places, {'color': '0.75', 'linewidth': 0.8}),
                             (bent, {'color': COLOURS[0], 'linewidth': 1.4})):
            axes.plot(*where[[one, other]].T, **style)  # type: ignore[attr-defined]
    axes.set_title(shape.title, fontsize=8)  # type: ignore[attr-defined]
    axes.set_aspect('equal')  # type: ignore[attr-defined]
    axes.tick_params(labelsize=6)  # type: ignore[attr-defined]
    for name in 'xyz':
        getattr(axes, f'set_{name}label')(f'{name} [m]', fontsize=7)


def _places(
    model: CoupledModel, index: int, body: FlexibleBody, motion: ComplexArray,
) -> tuple[FloatArray, ComplexArray]:
    """Return where the places of a body are, and how they move along x, y, z, (k, 3) each."""
    support = model.support
    part = support.members[index]
    known = {dof.station: dof.place for dof in body.dofs}
    found: dict[str, ComplexArray] = {}

    def put(station: str, axis: str, value: complex) -> None:
        if station in known and axis in DOFS[:3]:
            found.setdefault(station, np.zeros(3, dtype=complex))[DOFS.index(axis)] = value

    for row in part.seats:
        bearing = support.bearings[row // 2]
        put(bearing.seat or bearing.name, 'xz'[row % 2], complex(motion[row]))
    _, contact, probe = part.places
    own = support.point_indices[index]
    dofs = [body.dofs[row] for row in (*body.contacts.tolist(), *body.of_kind('probe'))]
    for dof, row in zip(dofs, [*own[contact], *own[probe]], strict=True):
        put(dof.station, dof.axis, complex(motion[row]))
    return (np.array([known[station] for station in found]),
            np.array([*found.values()]))


def _neighbours(places: FloatArray) -> Sequence[tuple[int, int]]:
    """Return pairs of places between which no other lies (Gabriel's graph)."""
    found = []
    for one in range(len(places)):
        for other in range(one):
            middle = 0.5 * (places[one] + places[other])
            ball = _BALL * np.linalg.norm(places[one] - middle)
            inside = np.linalg.norm(places - middle, axis=1) < ball
            inside[[one, other]] = False
            if not inside.any():
                found.append((one, other))
    return found
