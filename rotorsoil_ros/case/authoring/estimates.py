"""The numbers of a machine, as a plant told them or as such machines usually are."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
import math

from scipy.optimize import brentq

from rotorsoil_ros.case.authoring import library
from rotorsoil_ros.case.authoring.library import BearingKind, MachineKind, PedestalKind, SoilClass
from rotorsoil_ros.case.authoring.questions import Answers, SOURCE
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.units import GRAVITY, rpm_to_rad_s

# Bearings stand at least so far inside the ends of a block that nobody told.
_LENGTH_OVER_SPAN = 1.25
# Of a block that nobody told: length and height over its width, and the least height [m].
_LENGTH, _HEIGHT, _LEAST_HEIGHT = 1.5, 0.4, 0.6
# Soil softer by more than this leaves the reach of a table that was solved for one soil.
_WIDEST_SOIL = 4.0
# Concrete is known to this factor, and what is put on a block is never weighed better.
_BLOCK_MASS_FACTOR = 1.05
# Between which a shaft is looked for [m], and the share of a told rotor that is no shaft.
_DIAMETERS, _LEAST_DISC = (1e-4, 30.0), 0.05
# Of a shaft on films, over its overhang.
_SPAN_ON_FILMS = 4.0
# Below and beyond the shaft's outer stations, over its diameter.
_COUPLING_SEAT, _END = 1.5, 1.0


@dataclass(frozen=True, slots=True)
class Known:
    """A number, and why it was guessed; empty where somebody told it."""

    value: float
    why: str = ''


def told_or(told: float | None, guess: float, why: str) -> Known:
    """Return what was told, else a guess rounded to what a guess is worth."""
    return Known(told) if told is not None else Known(float(f'{guess:.2g}'), why)


def cylinder(mass: float, diameter: float, width: float) -> tuple[float, float]:
    """Return the polar and the diametral inertia of a cylinder [kg m^2]."""
    polar = mass * diameter**2 / 8.0
    return polar, 0.5 * polar + mass * width**2 / 12.0


@dataclass(frozen=True)
class Estimates:
    """
    Everything that a case needs, of what a plant knows.

    Attributes
    ----------
    answers : Answers
        What it knows.

    """

    answers: Answers

    @cached_property
    def kind(self) -> MachineKind:
        """Rules of thumb for this kind of machine."""
        return MachineKind.named(self.answers.kind)

    @cached_property
    def rules(self) -> dict[str, float]:
        """Rules of thumb for every machine."""
        return dict(library.common())

    @property
    def speed(self) -> float:
        """Rated speed [rad/s]."""
        return float(rpm_to_rad_s(self.answers.rpm))

    @property
    def torque(self) -> float:
        """Rated torque [N m]."""
        return 1e3 * self.answers.power_kw / self.speed

    @cached_property
    def disc_diameter(self) -> float:
        """Diameter of what turns [m]."""
        return self.kind.diameter(torque=self.torque, speed=self.speed)

    @property
    def disc_width(self) -> float:
        """Width of what turns [m]."""
        return self.kind.width * self.disc_diameter

    @cached_property
    def span(self) -> Known:
        """Distance of the bearings [m]."""
        usual = max(self.kind.span * self.disc_diameter, 0.15)
        if self.bearing.film:  # a journal must not be lifted by what hangs over the other
            usual = max(usual, _SPAN_ON_FILMS * self.overhang.value)
        if self.answers.block_length is not None:
            usual = min(usual, self.answers.block_length / _LENGTH_OVER_SPAN)
        return told_or(self.answers.bearing_span, usual,
                       f'{self.kind.span:g} times the diameter of the {self.kind.disc}')

    @cached_property
    def overhang(self) -> Known:
        """From the last bearing to an overhung disc [m]; 0 between bearings."""
        if not self.kind.is_overhung:
            return Known(0.0)
        return told_or(self.answers.overhang, max(self.kind.overhang * self.disc_diameter, 0.08),
                       f'{self.kind.overhang:g} times the diameter of the {self.kind.disc}')

    @property
    def _usual_disc_mass(self) -> float:
        return float(self.kind.mass_constant * self.disc_diameter ** self.kind.mass_power)

    @cached_property
    def shaft_diameter(self) -> Known:
        """Diameter of the shaft [m]."""
        wanted = self.rules['stiff_shaft'] * self.speed
        by_bending = brentq(lambda diameter: self._first_bending(diameter) - wanted, *_DIAMETERS,
                            rtol=1e-6)
        by_torque = (16.0 * self.torque / (math.pi * self.rules['shear_stress'])) ** (1.0 / 3.0)
        return told_or(self.answers.shaft_diameter, max(by_bending, by_torque),
                       'carries the torque, and first bending at '
                       f'{self.rules["stiff_shaft"]:g} times the speed')

    def _first_bending(self, diameter: float) -> float:
        """
        Return the first bending frequency on bearings that do not give way [rad/s].

        References
        ----------
        A load in the middle of a beam, which itself moves as 17/35 of its mass there (Rayleigh);
        a force and a couple at the end of an overhang, with the mass and the diametral inertia of
        the disc, the shaft being light.

        """
        steel, span, out = library.material('steel'), self.span.value, self.overhang.value
        section = math.pi / 4.0 * diameter**2
        stiffness = steel.young_modulus * section * diameter**2 / 16.0
        disc = self._disc_mass_on(diameter)
        if not self.kind.is_overhung:
            moved = disc + 17.0 / 35.0 * steel.density * section * span
            return math.sqrt(48.0 * stiffness / (span**3 * moved))
        _, inertia = cylinder(disc, self.disc_diameter, self.disc_width)
        force, both, couple = (out**2 * (span + out) / 3.0, out * (2.0 * span + 3.0 * out) / 6.0,
                               (span + 3.0 * out) / 3.0)
        trace = force * disc + couple * inertia
        determinant = (force * couple - both**2) * disc * inertia
        give = 0.5 * (trace + math.sqrt(trace**2 - 4.0 * determinant))
        return math.sqrt(stiffness / give)

    def _disc_mass_on(self, diameter: float) -> float:
        """Return the mass of what turns on a shaft [kg]: of a told rotor, what this leaves."""
        told = self.answers.rotor_mass
        if told is None:
            return self._usual_disc_mass
        others = (library.material('steel').density * math.pi / 4.0 * diameter**2
                  * self._length_on(diameter) + self.rules['coupling_constant'] * diameter**3)
        return max(told - others, _LEAST_DISC * told)

    def _length_on(self, diameter: float) -> float:
        """Return the length of a shaft of a diameter [m]."""
        beyond = (self.overhang.value + 0.5 * self.disc_width if self.kind.is_overhung
                  else _END * diameter)
        return _COUPLING_SEAT * diameter + self.span.value + beyond

    @property
    def coupling_seat(self) -> float:
        """From the end of the shaft to the first bearing [m]."""
        return _COUPLING_SEAT * self.shaft_diameter.value

    @property
    def disc_position(self) -> float:
        """Along the shaft [m]."""
        if self.kind.is_overhung:
            return self.coupling_seat + self.span.value + self.overhang.value
        return self.coupling_seat + 0.5 * self.span.value

    @property
    def shaft_length(self) -> float:
        """Length of the shaft [m]."""
        return self._length_on(self.shaft_diameter.value)

    @property
    def shaft_mass(self) -> float:
        """Mass of the shaft [kg]."""
        density = library.material('steel').density
        return density * math.pi / 4.0 * self.shaft_diameter.value**2 * self.shaft_length

    @property
    def coupling_mass(self) -> float:
        """Mass of the half of the coupling that is on the shaft [kg]."""
        return self.rules['coupling_constant'] * self.shaft_diameter.value**3

    @cached_property
    def disc_mass(self) -> Known:
        """
        Mass of what turns, without shaft and coupling [kg].

        Raises
        ------
        InputError
            If the rotor is told to weigh less than its own shaft.

        """
        others = self.shaft_mass + self.coupling_mass
        told = self.answers.rotor_mass
        if told is None:
            return told_or(None, self._usual_disc_mass, f'usual for a {self.answers.kind} of this '
                                                        'speed and power')
        if not told > others:
            raise InputError(
                f'{SOURCE}: rotor_mass: must be more than that of its shaft and coupling, '
                f'{others:.3g} kg of {self.shaft_diameter.value:g} m x {self.shaft_length:.3g} m, '
                f'got {told:g} kg')
        return Known(told - others)

    @property
    def rotor_mass(self) -> float:
        """Mass of all that turns [kg]."""
        return self.disc_mass.value + self.shaft_mass + self.coupling_mass

    @property
    def machine_mass(self) -> Known:
        """Mass of what stands on the block and does not turn [kg]."""
        motor = self.rules['motor_constant'] * self.torque ** self.rules['motor_power']
        return told_or(self.answers.machine_mass, motor + self.kind.casing * self.rotor_mass,
                       'motor of this torque, and a casing of '
                       f'{self.kind.casing:g} times the rotor')

    @property
    def carried(self) -> float:
        """Mass that each bearing carries [kg]."""
        return 0.5 * self.rotor_mass

    @cached_property
    def bearing(self) -> BearingKind:
        """What the bearings are like."""
        return BearingKind.named(self.answers.bearing or self.kind.bearing)

    @property
    def bearing_load(self) -> float:
        """Weight on each bearing, evenly [N]."""
        return GRAVITY * self.carried

    @property
    def pedestal(self) -> PedestalKind | None:
        """What carries each bearing; None is the block itself."""
        name = self.answers.pedestal or self.kind.pedestal
        return None if name == 'none' else PedestalKind.named(name)

    @cached_property
    def block(self) -> tuple[Known, Known, Known]:
        """Width, length and height of the block [m]."""
        ratio = self.rules['block_over_machine']
        volume = ratio * (self.machine_mass.value + self.rotor_mass) / self.rules['concrete']
        width = float((volume / (_LENGTH * _HEIGHT)) ** (1.0 / 3.0))
        why = f'a block of {ratio:g} times the mass of the machine'
        answers = self.answers
        return (told_or(answers.block_width, width, why),
                told_or(answers.block_length,
                        max(_LENGTH * width, _LENGTH_OVER_SPAN * self.span.value), why),
                told_or(answers.block_height, max(_HEIGHT * width, _LEAST_HEIGHT), why))

    @property
    def concrete_mass(self) -> float:
        """Mass of the block alone [kg]."""
        return self.rules['concrete'] * math.prod(side.value for side in self.block)

    @property
    def shaft_height(self) -> Known:
        """Height of the shaft above the block [m]."""
        return told_or(self.answers.shaft_height, self.kind.shaft_height * self.disc_diameter,
                       f'{self.kind.shaft_height:g} times the diameter of the {self.kind.disc}')

    @property
    def grade(self) -> tuple[str, str]:
        """Balance grade, and why it was guessed."""
        told = self.answers.balance_grade
        if told is None:
            return self.kind.grade, f'usual for a {self.answers.kind}, ISO 21940-11'
        return f'G{1e3 * told:g}', ''

    @cached_property
    def soil_class(self) -> SoilClass:
        """Which class the soil is of, as far as anybody knows."""
        return SoilClass.named(self.answers.soil or 'unknown')

    @property
    def wave_velocity(self) -> Known:
        """Velocity of shear waves [m/s]."""
        low, high = self.soil_class.shear_wave_velocity
        return told_or(self.answers.shear_wave_velocity, math.sqrt(low * high),
                       f'{self.soil_class.means}: {low:g} to {high:g} m/s')

    @property
    def soil_density(self) -> Known:
        """Density of the soil [kg/m^3]."""
        low, high = self.soil_class.density
        told = self.answers.density
        return Known(told) if told is not None else Known(
            0.5 * (low + high), f'{self.soil_class.means}: {low:g} to {high:g} kg/m^3')

    def spreads(self) -> Iterator[tuple[str, float, str]]:
        """Yield every key of `uncertainty`, its value, and what it stands for."""
        yield from self._of_soil()
        bearing, pedestal = self.bearing, self.pedestal
        yield 'bearing_stiffness_factor', bearing.stiffness_factor, 'bearings by type and size'
        yield 'bearing_damping_factor', bearing.damping_factor, 'bearings by type and size'
        if pedestal is not None:
            yield 'pedestal_stiffness_factor', pedestal.stiffness_factor, 'pedestals by type'
        yield 'foundation_mass_factor', self._block_mass_factor, 'concrete, and what stands on it'
        if self.answers.rotor_mass is None:
            yield 'rotor_mass_factor', self.rules['rotor_mass_factor'], 'rotor by kind and size'
        if any(length.why for length in (self.shaft_diameter, self.span, self.overhang)):
            yield ('shaft_stiffness_factor', self.rules['shaft_stiffness_factor'],
                   'diameter or lengths of the shaft')
        if self.shaft_height.why:
            yield 'shaft_height_factor', self.rules['shaft_height_factor'], 'height of the shaft'
        if self.grade[1]:
            yield 'unbalance_factor', self.rules['unbalance_factor'], 'one step of the grades'

    def _of_soil(self) -> Iterator[tuple[str, float, str]]:
        soil, size = self.soil_class, any(side.why for side in self.block)
        low, high = soil.shear_wave_velocity
        factor, why = (high / low, f'{low:g} to {high:g} m/s: G goes with the square')
        if self.answers.shear_wave_velocity is not None:
            factor, why = self.rules['shear_modulus_factor'], 'a measured velocity, ASCE 4'
        if size:
            factor *= self.rules['block_size_factor']
            why += ', and the size of the block'
        yield 'shear_modulus_factor', round(min(factor, _WIDEST_SOIL), 2), why
        low, high = soil.poisson_ratio
        yield 'poisson_ratio', round(0.5 * (high - low), 4), f'{low:g} to {high:g}'
        low, high = soil.damping_ratio
        yield 'loss_factor', round(high - low, 4), f'damping ratio {low:g} to {high:g}'
        if self.soil_density.why:
            low, high = soil.density
            yield ('soil_density_factor', round(math.sqrt(high / low), 2),
                   f'{low:g} to {high:g} kg/m^3')

    @property
    def _block_mass_factor(self) -> float:
        """Return how badly the mass on the soil is known: that of machine and block together."""
        if any(side.why for side in self.block):
            return 1.5
        if not self.machine_mass.why:
            return _BLOCK_MASS_FACTOR
        share = self.machine_mass.value / (self.machine_mass.value + self.concrete_mass)
        return round(_BLOCK_MASS_FACTOR + (self.rules['machine_mass_factor'] - 1.0) * share, 2)
