"""What turns: shaft and discs, as the matrices of Lalanne and Ferraris."""

from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.channel import across, Channel, HOUSING, JOURNAL
from rotorsoil_ros.errors import require, RotorSoilError
from rotorsoil_ros.rotor.beam import BeamElements, element_matrices, ElementMatrices
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.losses import Losses
from rotorsoil_ros.rotor.shaft import crossed, Orbit, Probe, ShaftSection

# Stations closer than this share of the shaft length to a node are that node.
_SAME_NODE = 1e-9


@dataclass(frozen=True)
class Rotor:
    """
    Shaft with its stations, meshed.

    Attributes
    ----------
    shaft_height : float
        Height of the shaft axis above the contact plane [m].
    shaft : tuple of ShaftSection
        From left to right, y = 0 at the left end.
    discs, bearings, probes
        Stations; each becomes a node of the mesh.
    drag : float
        Damping of the discs that does not turn, proportional to their mass [1/s].
    is_upright : bool
        Whether the shaft points up: its weight then is along it.

    """

    shaft_height: float
    shaft: tuple[ShaftSection, ...]
    discs: tuple[Disc, ...]
    bearings: tuple[Bearing, ...]
    probes: tuple[Probe, ...] = ()
    drag: float = 0.0
    is_upright: bool = False

    def __post_init__(self) -> None:
        require(math.isfinite(self.shaft_height), 'shaft_height', 'finite, in m',
                self.shaft_height)
        require(len(self.shaft) > 0, 'shaft', 'one section or more', 0)
        require(0.0 <= self.drag < math.inf, 'drag', '>= 0 1/s and finite', self.drag)
        places = {bearing.position for bearing in self.bearings}
        require(len(places) >= 2, 'bearings', 'at two places or more', len(places))
        length = self.length
        for station in self.stations:
            if not -_SAME_NODE * length <= station.position <= length * (1.0 + _SAME_NODE):
                raise RotorSoilError(f'position of {station.name} must be on the shaft, '
                                     f'0 to {length:g} m, got {station.position:g}')

        names = [bearing.name for bearing in self.bearings]
        for probe in self.probes:
            if probe.relative_to and probe.relative_to not in names:
                raise RotorSoilError(f'relative_to of {probe.name} must be one of '
                                     f'{", ".join(names)}, got {probe.relative_to}')
        if any(section.axial_force < 0.0 for section in self.shaft):
            factor = self.buckling_factor
            if not factor > 1.0:
                raise RotorSoilError('axial_force must stay below the load that buckles the '
                                     f'shaft, 1 times it, got {1.0 / factor:.4g}')

    @property
    def buckling_factor(self) -> float:
        """Times its axial force at which the shaft buckles on rigid bearings; may be infinite."""
        parts = self._parts
        elastic, tension = self._assembled(parts.elastic), self._assembled(parts.tension)
        held = [2 * self.node_of(bearing.position) for bearing in self.bearings]
        free = np.setdiff1d(np.arange(len(elastic)), held)
        inside = np.ix_(free, free)
        most = float(scipy.linalg.eigh(-tension[inside], elastic[inside], eigvals_only=True,
                                       subset_by_index=[len(free) - 1, len(free) - 1])[0])
        return 1.0 / most if most > 0.0 else math.inf

    @property
    def stations(self) -> tuple[Disc | Bearing | Probe, ...]:
        """Bearings, discs and probes: what is a node of the mesh."""
        return (*self.bearings, *self.discs, *self.probes)

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """Motions of journals and housings, bearing by bearing, then of discs and probes."""
        return (*(channel for bearing in self.bearings for part in (JOURNAL, HOUSING)
                  for channel in across(bearing.name, part)),
                *(channel for disc in self.discs for channel in across(disc.name)),
                *(channel for probe in self.probes for channel in probe.channels))

    @property
    def orbits(self) -> tuple[Orbit, ...]:
        """Places of the shaft of which both directions are known."""
        return (*(Orbit.of(bearing.name, bearing.position, JOURNAL) for bearing in self.bearings),
                *(Orbit.of(disc.name, disc.position) for disc in self.discs),
                *(Orbit.of(probe.name, probe.position) for probe in self.probes
                  if probe.angle is None), *crossed(self.probes))

    @cached_property
    def view(self) -> FloatArray | None:
        """
        What its channels are of the motions over (x, z) of all stations, (c, d).

        Of journal and housing of each bearing, then of discs and probes. None where they are
        just these.
        """
        if all(probe.angle is None and not probe.relative_to for probe in self.probes):
            return None
        plain = 4 * len(self.bearings) + 2 * len(self.discs)
        whole = np.zeros((len(self.channels), plain + 2 * len(self.probes)))
        whole[:plain, :plain] = np.eye(plain)
        names, row = [bearing.name for bearing in self.bearings], plain
        for index, probe in enumerate(self.probes):
            rows = slice(row, row + len(probe.channels))
            own = plain + 2 * index
            whole[rows, own:own + 2] = probe.directions
            if probe.relative_to:
                housing = 4 * names.index(probe.relative_to) + 2
                whole[rows, housing:housing + 2] = -probe.directions
            row = rows.stop
        return whole

    @property
    def length(self) -> float:
        """Total length of the shaft [m]."""
        return math.fsum(section.length for section in self.shaft)

    @cached_property
    def node_positions(self) -> FloatArray:
        """Positions of the mesh nodes along the shaft [m], ascending."""
        ends = np.concatenate([[0.0], np.cumsum([section.length for section in self.shaft])])
        grid = [np.linspace(left, right, section.elements + 1) for left, right, section
                in zip(ends[:-1], ends[1:], self.shaft, strict=True)]
        # Divisions first: a station that falls on one takes its exact place, not the reverse.
        nodes = list(np.concatenate(grid))
        for station in self.stations:
            if np.abs(np.asarray(nodes) - station.position).min() > _SAME_NODE * self.length:
                nodes.append(station.position)
        positions = np.sort(nodes)
        apart = np.diff(positions, prepend=-math.inf) > _SAME_NODE * self.length
        return positions[apart]

    def node_of(self, position: float) -> int:
        """Return the index of the mesh node at a station's position [m]."""
        return int(np.argmin(np.abs(self.node_positions - position)))

    @cached_property
    def _owner(self) -> IntArray:
        """Which section each element is of."""
        ends = np.cumsum([section.length for section in self.shaft])
        return np.searchsorted(ends, 0.5 * (self.node_positions[:-1] + self.node_positions[1:]))

    @property
    def elements(self) -> BeamElements:
        """The shaft's finite elements, one between each two neighbouring nodes."""
        ends = np.cumsum([section.length for section in self.shaft])
        left, right = self.node_positions[:-1], self.node_positions[1:]
        owner = self._owner
        sections = [self.shaft[i] for i in owner]
        start = (ends - np.array([section.length for section in self.shaft]))[owner]
        share = np.stack([left - start, right - start], axis=1)
        share /= np.array([section.length for section in sections])[:, None]

        def linear(values: list[tuple[float, float]]) -> FloatArray:
            pairs = np.array(values)
            return np.asarray(pairs[:, :1] * (1.0 - share) + pairs[:, 1:] * share)

        materials = [section.material for section in sections]
        return BeamElements(
            length=right - left,
            outer_diameter=linear([section.outer_diameter for section in sections]),
            inner_diameter=linear([section.inner_diameter for section in sections]),
            young_modulus=np.array([material.young_modulus for material in materials]),
            poisson_ratio=np.array([material.poisson_ratio for material in materials]),
            density=np.array([material.density for material in materials]),
            added_mass=np.array([section.added_mass for section in sections]),
            axial_force=np.array([section.axial_force for section in sections]),
            torque=np.array([section.torque for section in sections]),
        )

    @cached_property
    def _parts(self) -> ElementMatrices:
        return element_matrices(self.elements)

    def _assembled(self, parts: FloatArray) -> FloatArray:
        """Add up matrices of the elements, (e, 4, 4), over all nodes."""
        count = 2 * len(self.node_positions)
        total = np.zeros((count, count))
        for node, part in enumerate(parts):
            total[2 * node:2 * node + 4, 2 * node:2 * node + 4] += part
        return total

    @cached_property
    def plane_matrices(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Stiffness, mass and polar inertia of shaft and discs in one plane.

        Returns
        -------
        three (2 k, 2 k) float arrays
            Over (deflection, slope) of the k nodes. In the z plane the slope is rx, in the
            x plane it is -rz. Axial forces are in it, bearings are not.

        """
        parts = self._parts
        stiffness = self._assembled(parts.elastic + parts.tension)
        mass, polar = self._assembled(parts.mass), self._assembled(parts.polar)
        for disc in self.discs:
            deflection = 2 * self.node_of(disc.position)
            slope = deflection + 1
            mass[deflection, deflection] += disc.mass
            mass[slope, slope] += disc.diametral_inertia
            polar[slope, slope] += disc.polar_inertia
        return stiffness, mass, polar

    @cached_property
    def nominal_springs(self) -> FloatArray:
        """Isotropic stiffness that stands in for each bearing in the rotor's modes [N/m]."""
        own = [bearing.nominal_stiffness for bearing in self.bearings]
        # A bearing that is only a damper still has to hold the shaft in the modes.
        stiffness, _, _ = self.plane_matrices
        least = 1e-3 * stiffness.diagonal()[::2].max()
        return np.array([spring if spring > 0.0 else least for spring in own])

    @cached_property
    def losses(self) -> Losses | None:
        """What shaft and discs do beside bending and swinging; None where they do nothing."""
        parts = self._parts
        damping = [self.shaft[owner].damping for owner in self._owner]
        viscous, hysteretic, heavy, stiff = (
            np.array([getattr(one, name) for one in damping])[:, None, None]
            for name in ('viscous', 'loss_factor', 'fixed_mass', 'fixed_stiffness'))
        fixed = self._assembled(heavy * parts.mass + stiff * (parts.elastic + parts.tension))
        for disc in self.discs:
            row = 2 * self.node_of(disc.position)
            fixed[row, row] += self.drag * disc.mass
            fixed[row + 1, row + 1] += self.drag * disc.diametral_inertia
        found = Losses(self._assembled(viscous * parts.elastic),
                       self._assembled(hysteretic * parts.elastic), fixed,
                       self._assembled(parts.torsion), self._assembled(stiff * parts.torsion))
        return found if any(found.does) else None

    @property
    def mass(self) -> float:
        """Mass of shaft and discs [kg]."""
        _, mass, _ = self.plane_matrices
        return float(mass[::2, ::2].sum())
