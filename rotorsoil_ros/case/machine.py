"""What does a machine on its soil answer? A case with its models, asked in plant units."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, Numbers, numbers
from rotorsoil_ros.case import cache, config, document, models
from rotorsoil_ros.case.answers.modal import ModalAnswers
from rotorsoil_ros.case.journal_entries import bearing_states, BearingStates
from rotorsoil_ros.channel import across, Channel
from rotorsoil_ros.errors import InputError, NotSolvedError
from rotorsoil_ros.machine.band import Envelope
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.machine.transient.state import Transient
from rotorsoil_ros.machine.transmissibility import MovingGround, Transmissibility
from rotorsoil_ros.prediction import Bounds, columns_of, Response
from rotorsoil_ros.profile import Profile
from rotorsoil_ros.units import hz_to_rad_s, rpm_to_rad_s

if TYPE_CHECKING:
    from rotorsoil_ros.case.design.report import DesignReport


@dataclass(frozen=True)
class Machine(ModalAnswers):
    """
    A machine on its soil, as its case file describes it.

    Models and tables are computed when something asks for them, and come out of the cache
    where they have been computed before.

    Attributes
    ----------
    case : Case
        What the file says.
    directory : Path
        Of the cache.

    """

    case: config.Case
    directory: Path

    @classmethod
    def load(
        cls, case_file: Path, *, cache_directory: str | Path | None = None,
        overrides: Sequence[str] = (),
    ) -> 'Machine':
        """Read a case; settings `key.path=value` replace or add to what the file says."""
        case = config.load(case_file, overrides, cache_directory=cache_directory)
        return cls(case, cache.directory(cache_directory))

    def others(self, known: Mapping[str, 'Machine'] | None = None) -> Iterator['Machine']:
        """Yield the machines of the same plant that run beside it, as known or from its file."""
        berth = self.case.berth
        for name in () if berth is None else berth.running_beside:
            yield (known or {}).get(name) or Machine(
                self.case.changed([f'source={name}']), self.directory)

    @cached_property
    def model(self) -> CoupledModel:
        """Rotor, blocks and soil as one system of equations."""
        return models.coupled_model(self.case, self.directory)

    @cached_property
    def table(self) -> ResponseTable:
        """The response over the whole speed range, which a running machine is looked up in."""
        return models.response_table(self.case, self.model, self.directory)

    @cached_property
    def oils(self) -> dict[float, ResponseTable]:
        """The same by mean temperature of the oil films [deg C], for those that the case names."""
        return {celsius: Machine(self.case.with_oil_of(celsius), self.directory).table
                for celsius in self.case.oil_temperatures}

    @cached_property
    def ground(self) -> MovingGround | None:
        """What it does of ground that moves; None where no sensor of the case stands there."""
        if not self.case.sensors.ground:
            return None
        return models.moving_ground(self.case, self.model, self.directory)

    def response(self, *, rpm: Numbers) -> Response:
        """
        Solve for the response to the unbalance of the case, exactly at every speed.

        Parameters
        ----------
        rpm : float or (n,) floats
            Rotor speeds [rpm]; within the tables of bearings and ground, where there are any.

        Returns
        -------
        Response
            Over n speeds and all channels [m, rad, N, N m]; NaN where the machine is unstable,
            as `stability` tells.

        Raises
        ------
        OutOfTableError
            If a speed is beyond a table of the case.
        NotSolvedError
            If an undamped resonance is hit.

        """
        speed = rpm_to_rad_s(numbers('rpm', rpm))
        found = Response.of(self.model.channels,
                            self.model.unbalance_response(speed, self.case.unbalance))
        return found.where(self._growth(speed).holds(speed))

    @property
    def seats(self) -> tuple[Channel, ...]:
        """What `seat_receptance` is over: x and z of every bearing, in this order."""
        return tuple(channel for bearing in self.case.rotor.bearings
                     for channel in across(bearing.name))

    def seat_receptance(self, *, hz: Numbers) -> ComplexArray:
        """
        Solve for the motion of what the bearings stand on, without the rotor.

        Foundation, ground and pedestals: what an impact test on the empty foundation shows.

        Parameters
        ----------
        hz : float or (n,) floats
            Frequencies [Hz].

        Returns
        -------
        (n, 2 b, 2 b) complex array
            Displacement per force over `seats`, response first [m/N].

        Raises
        ------
        OutOfTableError
            If a frequency is beyond a table of the ground.
        NotSolvedError
            If an undamped resonance is hit.

        """
        own = self.model.own_seats
        return seats_moved(self.model.support, hz)[:, own, own]

    def bearings(self, *, rpm: Numbers) -> tuple[BearingStates, ...]:
        """
        Return what every bearing is to the rotor, and where each journal floats in its film.

        Parameters
        ----------
        rpm : float or (n,) floats
            Rotor speeds [rpm].

        Raises
        ------
        OutOfTableError
            If a speed is beyond a table of the case.
        RotorSoilError
            If a film carries its load at no place, or is too thin to be known.

        """
        return bearing_states(self.case.rotor, self.case.journals,
                              rpm_to_rad_s(numbers('rpm', rpm)))

    def frf(self, *, force: str, hz: Numbers, rpm: float = 0.0) -> Response:
        """
        Solve for the response to a harmonic force of 1 N while the rotor turns steadily.

        Parameters
        ----------
        force : str
            Channel at and along which the force acts; a rotation of a block takes 1 N m.
        hz : float or (n,) floats
            Frequencies of the force [Hz].
        rpm : float
            Rotor speed [rpm]; at 0 an impact test at rest.

        Returns
        -------
        Response
            Over n frequencies and all channels, per newton or newton metre.

        Raises
        ------
        RotorSoilError
            If there is no such channel.
        OutOfTableError, NotSolvedError
            As `response`.

        """
        columns_of(self.model.channels, force)
        omega, speed = hz_to_rad_s(numbers('hz', hz)), rpm_to_rad_s(numbers('rpm', rpm))
        found = self.model.frequency_response(omega, speed=float(speed[0]), channel=force)
        return found.where(np.repeat(self._growth(speed).holds(speed[:1]), len(omega)))

    def transmissibility(self, *, hz: Numbers, rpm: float = 0.0) -> Transmissibility:
        """
        Solve for the motion of every channel per motion of the ground.

        Parameters
        ----------
        hz : float or (n,) floats
            Frequencies at which the ground moves [Hz].
        rpm : float
            Rotor speed [rpm].

        Returns
        -------
        Transmissibility
            Over n frequencies, all channels and the ground's x, y, z; NaN where the machine is
            unstable.

        Raises
        ------
        OutOfTableError, NotSolvedError
            As `response`.

        """
        omega, speed = hz_to_rad_s(numbers('hz', hz)), rpm_to_rad_s(numbers('rpm', rpm))
        found = Transmissibility.of(self.model, omega, speed=float(speed[0]))
        holds = bool(self._growth(speed).holds(speed[:1])[0])
        return found if holds else replace(found, ratio=np.full_like(
            found.ratio, complex(math.nan, math.nan)))

    def order_response(self, *, order: float, force: str, rpm: Numbers) -> Response:
        """
        Solve for the response to a force of 1 N at a multiple of the speed.

        Parameters
        ----------
        order : float
            Frequency of the force over the speed, as 2 of a two-bladed fan or 0.5 of a belt.
        force : str
            As in `frf`.
        rpm : float or (n,) floats
            Rotor speeds [rpm].

        """
        columns_of(self.model.channels, force)
        speed = rpm_to_rad_s(numbers('rpm', rpm))
        found = self.model.harmonic_response(speed, order=order, channel=force)
        return found.where(self._growth(speed).holds(speed))

    def band(self, *, rpm: Numbers) -> Bounds:
        """
        Return between which amplitudes the response lies, as far as the case is known.

        Parameters
        ----------
        rpm : float or (n,) floats
            Rotor speeds [rpm].

        Returns
        -------
        Bounds
            Of every channel; NaN outside the speed range of the case.

        Raises
        ------
        InputError
            If nothing of the case is uncertain, so that there is no band.

        """
        if self.envelope is None:
            raise InputError(f'{self.case.path}: support.model: {self.case.support.model} knows '
                             'of no soil and uncertainty says nothing else: there is no band')
        return self.bounds(rpm=rpm)

    @cached_property
    def envelope(self) -> Envelope | None:
        """Between which responses the machine lies over its speed range; None without a band."""
        found = models.response_band(self.case, self.model, self.table, self.directory)
        return None if found is None else found.envelope(self.case.unbalance)

    def bounds(self, *, rpm: Numbers) -> Bounds:
        """Return the same as `band`; without a band NaN on both sides of the response."""
        speed = rpm_to_rad_s(numbers('rpm', rpm))
        nominal = self.table.predictor(self.case.unbalance).answer(speed).displacement
        if self.envelope is None:
            none = np.full(nominal.shape, math.nan)
            return Bounds(self.table.channels, speed, none, np.abs(nominal), none)
        found = self.envelope.at(speed).around(nominal)
        return Bounds(self.table.channels, speed, found.low, np.abs(nominal), found.high)

    def report(self, *, rpm: float) -> 'DesignReport':
        """
        Judge whether the foundation is right for this machine at a speed.

        Parameters
        ----------
        rpm : float
            Running speed [rpm], within the speed range of the case.

        Returns
        -------
        DesignReport
            Verdict, housings, margins, what decides and what to do next.

        Raises
        ------
        InputError
            If the speed is beyond the speed range of the case.

        """
        from rotorsoil_ros.case.design.study import design_report  # half of it is words

        return design_report(self, float(numbers('rpm', rpm)[0]))

    def predict(self, profile: Profile) -> Response:
        """
        Look up what the node would answer to the speeds of a profile, bit by bit the same.

        Parameters
        ----------
        profile : Profile
            Stamps and speeds, as `read_profile` finds them in a bag.

        Returns
        -------
        Response
            With the stamps of the profile and what its changes of speed strike; NaN where the
            table does not cover a speed.

        """
        predictor = self.table.predictor(self.case.unbalance)
        steady = predictor.answer(profile.speed)
        told = np.where(predictor.covers(profile.speed), profile.speed, np.nan)
        answered = predictor.moved(
            steady, Transient(self.table.poles).follow(profile.stamp_ns, told))
        return Response.of(self.table.channels, answered, profile.stamp_ns)

    def description(self, name: str, unbalance: ComplexArray) -> Mapping[str, object]:
        """Return what the predictions under this name and this unbalance, (p,), rest on."""
        return models.description(self.case, self.model, self.table, name, unbalance)



def seats_moved(support: Support, hz: Numbers) -> ComplexArray:
    """Return how all seats of a support move by forces on them, as `seat_receptance` does."""
    found = support.standing(hz_to_rad_s(numbers('hz', hz))).receptance
    if not np.all(np.isfinite(found)):
        raise NotSolvedError('the foundation has no finite receptance: a resonance without '
                             'damping is hit, or nothing holds it')
    return found


def load(
    case: str | Path, *, cache_directory: str | Path | None = None, **overrides: object,
) -> Machine:
    """
    Read the case file of a machine.

    Parameters
    ----------
    case : str or Path
        The YAML file; `FILE#NAME` is one of its machines.
    cache_directory : str, Path or None
        Where computed tables lie; None for $ROTORSOIL_CACHE, else the user's cache directory.
    **overrides
        Keys of the case to replace or to add: `soil={'shear_modulus': 30e6}`, or by their path,
        `**{'rotor.bearings.0.stiffness.xx': 1e8}`. What a mapping does not name stays.

    Returns
    -------
    Machine
        Nothing is solved before it is asked.

    Raises
    ------
    InputError
        If the file is wrong, one line for each fault: file, key path, rule, unit and value.

    """
    path, own = document.chosen(Path(case))
    content = document.read(path)
    document.override(content, own)
    document.replace_keys(content, overrides)
    return Machine(config.case_of(path, content, cache_directory=cache_directory),
                   cache.directory(cache_directory))
