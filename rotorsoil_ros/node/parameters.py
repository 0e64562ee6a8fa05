"""Which parameters does the node have, and what may they be."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
import math
import re
from typing import Any, TypeAlias

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from rotorsoil_ros.errors import InputError
from rotorsoil_ros.monitor.rules import Judging, Matching
from rotorsoil_ros.units import SPEED_UNITS
from rotorsoil_ros.wire.speeds import ROTOR_JOINT, USUAL

Rule: TypeAlias = Callable[[Any], str]

LARGEST_MOMENT = 1e3  # [kg m]


def number(*, unit: str, lowest: float = -math.inf, highest: float = math.inf) -> Rule:
    """Return a rule that says what is wrong with a number; nothing where it holds."""
    def fault(value: Any) -> str:
        if isinstance(value, bool) or not isinstance(value, int | float):
            return f'must be a number in {unit}, got {value!r}'
        if not (math.isfinite(value) and lowest <= value <= highest):
            return f'must be finite and {lowest:g} to {highest:g} {unit}, got {value:g}'
        return ''
    return fault


def choice(*allowed: str) -> Rule:
    """Return a rule that holds for a few words."""
    return lambda value: '' if value in allowed else (
        f'must be one of {", ".join(allowed)}, got {value!r}')


def pattern(expression: str, meaning: str) -> Rule:
    """Return a rule that holds for strings of a form, or for lists of different ones."""
    def fault(value: Any) -> str:
        words = [value] if isinstance(value, str) else list(value)
        bad = [word for word in words if not re.fullmatch(expression, word)]
        if bad or len(set(words)) < len(words):
            return f'must be {meaning}, got {bad[0] if bad else words!r}'
        return ''
    return fault


def anything(value: Any) -> str:
    """Hold for every value of the declared type."""
    del value
    return ''


@dataclass(frozen=True, slots=True)
class Setting:
    """One parameter: default, what it is (with its unit), its rule, and when it acts."""

    default: Any
    meaning: str
    fault: Rule = anything
    span: tuple[float, float] | None = None
    acts_at_once: bool = False

    def declare(self, node: Node, name: str) -> None:
        """Declare the parameter; a value from the command line or a file wins."""
        descriptor = ParameterDescriptor(description=self.meaning)
        if isinstance(self.default, float):
            # Statically typed, a double would refuse `-p stale_after_s:=3`.
            descriptor.dynamic_typing = True
        if self.span and isinstance(self.default, float):
            descriptor.floating_point_range = [FloatingPointRange(
                from_value=self.span[0], to_value=self.span[1])]
        elif self.span:
            descriptor.integer_range = [IntegerRange(
                from_value=int(self.span[0]), to_value=int(self.span[1]), step=1)]
        default = self.default
        if default == []:
            default = Parameter.Type.STRING_ARRAY
        try:
            node.declare_parameter(name, default, descriptor)
        except ParameterException as error:
            raise InputError(f'parameter {name}: {error}') from error


def quantity(
    default: float, meaning: str, unit: str, *, span: tuple[float, float],
    acts_at_once: bool = False,
) -> Setting:
    """Return a parameter that is a number with a unit and a range."""
    return Setting(
        default, f'{meaning} [{unit}].', number(unit=unit, lowest=span[0], highest=span[1]), span,
        acts_at_once)


OWN = {
    'machines': Setting(
        [], 'Names of the machines and plants, each the first part of its topics.',
        pattern('[a-z][a-z0-9_]*', 'different names of a-z, 0-9 and _ that begin with a letter')),
    'speed_reliability': Setting(
        'best_effort', 'Reliability asked of speed topics: best_effort or reliable.',
        choice('best_effort', 'reliable')),
    'speed_depth': Setting(
        10, 'Speeds kept while the node is busy [messages].',
        number(unit='messages', lowest=1, highest=100_000), (1, 100_000)),
    'stale_after_s': quantity(
        3.0, 'Silence of a speed topic after which a machine counts as stale', 's',
        span=(0.1, 86400.0), acts_at_once=True),
    'executor': Setting(
        'events', 'What runs the callbacks: events or single. Read at the start only.',
        choice('events', 'single')),
    'autostart': Setting(
        True, 'Whether to configure and activate without being asked. Read at the start only.'),
    'cache': Setting(
        '', 'Directory of computed tables; empty: $ROTORSOIL_CACHE or the cache of the user.'),
    'match_tolerance_s': quantity(
        Matching().tolerance, 'Largest distance between the stamps of a measurement and of the '
        'speed that it belongs to', 's', span=(0.0, 60.0)),
    'vector_turns': quantity(
        Judging().turns, 'Turns of the rotor that make one vector of raw samples', 'turns',
        span=(2.0, 1000.0)),
    'band_period_s': quantity(
        Judging().band_period_s, 'Message time between two bands while the speed changes (else '
        'a second), zero: one with every speed', 's', span=(0.0, 3600.0)),
    'log.directory': Setting('', 'Directory for logs; empty: no logs.'),
    'log.name': Setting(
        'run', 'Name of the log; where it is taken, name_2, name_3...',
        pattern('[A-Za-z0-9][A-Za-z0-9_.-]*', 'a name of letters, digits and _ . -')),
    'log.mcap': Setting(True, 'Whether to record messages as a rosbag2 bag of MCAP files.'),
    'log.rerun': Setting(
        find_spec('rerun') is not None, 'Whether to record what the rerun viewer shows.'),
    'log.rerun_url': Setting(
        '', 'Address of a rerun viewer to show the run live, such as '
        'rerun+http://127.0.0.1:9876/proxy; empty: none.'),
    'log.split_mib': quantity(
        0.0, 'Size at which a new MCAP file begins, zero: when its index takes 4 MiB of memory',
        'MiB', span=(0.0, 1e6)),
    'log.split_s': quantity(
        0.0, 'Message time after which a new MCAP file begins, zero: as log.split_mib', 's',
        span=(0.0, 1e7)),
    'log.budget_mib': quantity(
        0.0, 'Disk space for all logs of this name in the directory; the oldest make room for '
        'new ones, zero: they never do', 'MiB', span=(0.0, 1e9)),
}
OF_MACHINE = {
    'case': Setting('', 'Case file (YAML), or the name of a shipped case: of one machine, or of a '
                    'plant, all running machines of which are <machine>/<one of them>.'),
    'rotor_joint': Setting(
        ROTOR_JOINT, 'Joint of joint_states whose velocity is the rotor speed.'),
    'speed.topic': Setting(
        USUAL.topic, 'Topic of the speed; empty: joint_states and rotor/speed of the machine.'),
    'speed.type': Setting(
        USUAL.type, 'Type of its messages, as in std_msgs/msg/Int32; empty: whatever is '
        'published there.'),
    'speed.field': Setting(
        USUAL.field, 'Number in the message that is the speed, as in twist.angular.z or '
        'velocity[2]; empty: the velocity of the joint, or the only number.'),
    'speed.unit': Setting(
        USUAL.unit, f'Unit of the number: {", ".join(SPEED_UNITS)}.', choice(*SPEED_UNITS)),
    'speed.ratio': Setting(
        USUAL.ratio, 'Turns of the rotor for one turn of what is told; negative where it counts '
        'backwards.', number(unit='turns per turn')),
    'slow_roll_rpm': quantity(
        0.0, 'Speed whose measured vector is runout and is subtracted, zero: none', 'rpm',
        span=(0.0, 1e6)),
}

# Of a machine of a plant, whose file is the plant's.
OF_PLANT_MACHINE = {name: setting for name, setting in OF_MACHINE.items() if name != 'case'} | {
    'rotor_joint': replace(OF_MACHINE['rotor_joint'], default='', meaning=(
        'The same in a plant; empty: rotor in joint_states of the machine, its name in those of '
        'the plant.'))}


def of_unbalance(value: complex) -> dict[str, Setting]:
    """Return the parameters of the unbalance of one disc, as its case has it."""
    return {
        'moment': quantity(
            abs(value), 'Unbalance moment; the next message uses it', 'kg m',
            span=(0.0, LARGEST_MOMENT), acts_at_once=True),
        'phase': Setting(
            math.atan2(value.imag, value.real),
            'Phase of the unbalance; the next message uses it [rad].', number(unit='rad'),
            acts_at_once=True),
    }


def described() -> str:
    """Return every parameter with its default and what it is, for a terminal."""
    lines = []
    joint = {'rotor_joint': OF_PLANT_MACHINE['rotor_joint']}
    for prefix, settings in (('', OWN), ('<machine>.', OF_MACHINE), (
            '<machine>.unbalance.<disc>.', of_unbalance(0j)), ('<plant>.<machine>.', joint)):
        for name, setting in settings.items():
            default = 'as in the case' if 'unbalance' in prefix else repr(setting.default)
            lines.append(f'  {prefix}{name} ({default})\n      {setting.meaning}')
    lines.append('  <plant>.<machine>.speed..., .slow_roll_rpm, .unbalance...\n'
                 '      As of a machine of its own.')
    return '\n'.join(lines)
