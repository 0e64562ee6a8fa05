"""What does a cell say? Numbers as people write them, times, units of a plant."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta, tzinfo, UTC
import math
import re
from typing import Any
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.units import SECONDS_PER_MINUTE, STANDARD_GRAVITY

NOTHING_SAID = frozenset({
    '', '-', '--', '---', '\u2013', '\u2014', '?', 'nan', 'n/a', 'na', 'n.a.', 'n. a.', 'nd',
    'n.d.', 'k.a.', 'k. a.', 'null', 'none', '#n/a', '#nv', '#div/0!', '#value!', '#wert!',
    '#ref!', '#bezug!', '#num!', '#zahl!'})
GROUPED = re.compile(r'[-+]?\d{1,3}(?P<sign>[., \u00a0\u202f\'])\d{3}(?:(?P=sign)\d{3})*(?![\d])')
PLAIN = re.compile(r'[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?')
# Digits and what may stand between those of numbers, dates and times, but no word.
NUMERIC = re.compile(r"[-+\u2212]?[.,]?\d[-+\d.,:/'\s\u00a0\u202f\u2212eETZ]*")
DECIMAL_COMMA = re.compile(r'[-+]?\d*,\d+([eE][-+]?\d+)?')
DECIMAL_POINT = re.compile(r'[-+]?\d*\.\d+([eE][-+]?\d+)?')
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
DAY_NS = 86_400 * NANOSECONDS
MOST_DAYS = 1e5  # since 1900
EARLIEST_NS = 365 * DAY_NS  # a time since 1970 that is later is a date, else it is a duration
TIME_UNITS = {'ns': 1, 'us': 1_000, 'ms': 1_000_000, 's': NANOSECONDS,
              'min': round(SECONDS_PER_MINUTE) * NANOSECONDS, 'h': DAY_NS // 24, 'day': DAY_NS}
ISO, EXCEL, ELAPSED = 'iso', 'excel', 'elapsed'
BEFORE_EXCEL = datetime(1899, 12, 30, tzinfo=UTC)  # its day 0, with the day that 1900 had not
SINCE_START = re.compile(r'(?:(\d+) )?(?:(\d+):)?(\d+):(\d+(?:[.,]\d+)?)')

COUNTED_AS = {'p-p': 0.5, '0-p': 1.0, 'rms': math.sqrt(2.0)}  # zero-to-peak of one
SPELLINGS = {
    **dict.fromkeys(('pp', 'p-p', 'pk-pk', 'pkpk', 'p2p', 'peak-to-peak', 'peak to peak', 's-s',
                     'spitze-spitze', 'spitze spitze', 'c-c', 'cc', 'cr\u00eate-cr\u00eate',
                     'cr\u00eate \u00e0 cr\u00eate', 'crete-crete', 'crete a crete'), 'p-p'),
    **dict.fromkeys(('0p', '0-p', 'pk', 'peak', 'zero-to-peak', 'zero to peak', '0-pk', 'spitze',
                     'scheitel', 'cr\u00eate', 'crete'), '0-p'),
    **dict.fromkeys(('rms', 'eff', 'effektiv', 'efficace'), 'rms')}
# How often the motion is derived in time, and the SI value of one.
MOTIONS = {
    'm': (0, 1.0), 'mm': (0, 1e-3), 'um': (0, 1e-6), 'micron': (0, 1e-6), 'nm': (0, 1e-9),
    'mil': (0, 25.4e-6), 'mils': (0, 25.4e-6), 'in': (0, 25.4e-3),
    'm/s': (1, 1.0), 'mm/s': (1, 1e-3), 'um/s': (1, 1e-6), 'in/s': (1, 25.4e-3),
    'ips': (1, 25.4e-3),
    'm/s^2': (2, 1.0), 'mm/s^2': (2, 1e-3), 'g': (2, STANDARD_GRAVITY),
    'rad': (0, 1.0), 'mrad': (0, 1e-3), 'urad': (0, 1e-6), 'deg': (0, math.radians(1.0)),
    'rad/s': (1, 1.0), 'mrad/s': (1, 1e-3), 'deg/s': (1, math.radians(1.0)),
    'rad/s^2': (2, 1.0)}
OURS = frozenset({'m', 'm/s', 'm/s^2', 'rad', 'rad/s', 'rad/s^2'})  # 0-p where nobody says
SPEED_SPELLINGS = {
    **dict.fromkeys(('rpm', '1/min', 'r/min', 'u/min', 'min^-1', 'min-1', 'upm', 'rev/min',
                     'tr/min', 't/min', 'tours/min', 'giri/min'), 'rpm'),
    **dict.fromkeys(('hz', '1/s', 'rps', 'r/s'), 'hz'),
    **dict.fromkeys(('rad/s', 'rad_s'), 'rad_s'), **dict.fromkeys(('deg/s', 'deg_s'), 'deg_s')}
PHASE_UNITS = {
    'rad': 1.0, **dict.fromkeys(
        ('deg', 'degree', 'degrees', 'degr\u00e9', 'degr\u00e9s', 'degre', 'degres'),
        math.radians(1.0))}


@dataclass(frozen=True, slots=True)
class AmplitudeUnit:
    """Unit of an amplitude: how often derived in time, and SI zero-to-peak of one."""

    derived: int
    factor: float
    turns: bool


def plain_unit(text: str) -> str:
    """Return a unit as the tables of this room spell it."""
    text = text.strip().lower()
    for spelled, ours in (('\u00b5', 'u'), ('\u03bc', 'u'), ('\u00b0', 'deg'), ('\u00b2', '^2'),
                          ('s2', 's^2'), ('**', '^'), ('sec', 's')):
        text = text.replace(spelled, ours)
    return text


def amplitude_unit(text: str) -> AmplitudeUnit:
    """Return what a unit such as `um p-p`, `mm/s rms` or `m` means."""
    plain = plain_unit(text)
    found = re.fullmatch(r'([a-z/^2]+)(?:[ _,]*[(]?([-\w ]+?)[)]?)?', plain)
    motion, size = (found[1], (found[2] or '').strip()) if found else ('', '')
    if motion not in MOTIONS:
        raise InputError('must be a displacement, velocity or acceleration such as um p-p, um '
                         f'0-p, mm/s rms, mil p-p, g 0-p or m, got {text!r}')
    if size not in SPELLINGS and not (motion in OURS and not size):
        raise InputError(f'must say p-p (peak-to-peak), 0-p (zero-to-peak) or rms, as in '
                         f'{motion} p-p, got {text!r}')
    derived, factor = MOTIONS[motion]
    return AmplitudeUnit(derived, factor * COUNTED_AS[SPELLINGS.get(size, '0-p')],
                         motion.startswith(('rad', 'mrad', 'urad', 'deg')))


def contradict(one: str, other: str) -> bool:
    """Return whether two units, as `plain_unit` has them, are both known and not the same."""
    try:
        return amplitude_unit(one) != amplitude_unit(other)
    except InputError:  # one of them may leave open how it counts
        first, second = one.split()[0], other.split()[0]
    for known in (MOTIONS, SPEED_SPELLINGS, PHASE_UNITS):
        if first in known and second in known:
            return known[first] != known[second]
    return all(any(unit in known for known in (MOTIONS, SPEED_SPELLINGS, PHASE_UNITS))
               for unit in (first, second))


def holds_numbers(cells: Iterable[Any]) -> bool:
    """Return whether a cell of a row is a number or a time; those of names and units are not."""
    return any(isinstance(cell, (int, float, datetime)) or NUMERIC.fullmatch(str(cell).strip())
               for cell in cells if cell is not None)


def decimal_sign(texts: Iterable[str], delimiter: str) -> str:
    """Return the decimal sign of a table: a comma if most of its cells say so."""
    if delimiter == ',':
        return '.'  # a comma in quotes groups thousands
    votes = Counter(',' if DECIMAL_COMMA.fullmatch(text) else '.' for text in texts
                    if DECIMAL_COMMA.fullmatch(text) or DECIMAL_POINT.fullmatch(text))
    return ',' if votes[','] > votes['.'] else '.'


def number(cell: Any, sign: str = '.') -> float:
    """Return the number in a cell, NaN where it says that there is none."""
    if isinstance(cell, (bool, datetime)):
        raise InputError(f'must be a number, got {cell}')
    if isinstance(cell, (int, float)):
        return float(cell)
    text = str(cell if cell is not None else '').strip().replace('\u2212', '-')
    if text.lower() in NOTHING_SAID:
        return math.nan
    if (found := GROUPED.match(text)) and found['sign'] != sign:
        head = found[0].replace(found['sign'], '')
        text = head + text[found.end():]
    plain = text.replace(',', '.') if sign == ',' and '.' not in text else text
    if not PLAIN.fullmatch(plain):
        raise InputError(f'must be a number, got {text!r}'
                         + (' (decimal sign here: a comma)' if sign == ',' else ''))
    return float(plain)


class Clock:
    """
    Reads the times of a column as nanoseconds since 1970.

    Parameters
    ----------
    unit : str
        Of numbers: ns, us, ms, s, min, h or day; empty: times are dates.
    form : str
        Of dates: `iso`, or as `strptime` has it; a time of day alone counts from midnight.
        `excel` are days as its cells count them, `elapsed` is [[days ]hours:]minutes:seconds.
    zone : str
        In which dates without one are; UTC by default.

    """

    def __init__(self, *, unit: str = '', form: str = '', zone: str = '') -> None:
        self._scale = TIME_UNITS[unit] if unit else 0
        self._form = form or ISO
        try:
            self._zone: tzinfo = ZoneInfo(zone) if zone else UTC
        except (ZoneInfoNotFoundError, ValueError, OSError) as error:
            raise InputError(f'must be a zone such as Europe/Berlin, got {zone!r}') from error
        self._last = -1

    @property
    def is_of_day(self) -> bool:
        """Whether times are those of a day, without its date."""
        return self._form not in (ISO, EXCEL, ELAPSED) and not any(sign in self._form for sign in (
            '%d', '%j', '%c', '%x', '%D', '%F', '%s'))

    def read(self, cell: Any, sign: str = '.') -> int:
        """Return the time in a cell [ns]."""
        if isinstance(cell, datetime):
            return self._since_epoch(cell)
        if self._scale:
            value = number(cell, sign)
            if not math.isfinite(value):
                raise InputError('has no time')
            return round(value * self._scale)
        if self._form == EXCEL:
            return self._serial(cell, sign)
        text = str(cell if cell is not None else '').strip()
        if self._form == ELAPSED:
            return _elapsed(text)
        try:
            found = (datetime.fromisoformat(text) if self._form == ISO
                     else datetime.strptime(_to_microseconds(text), self._form))
        except ValueError as error:
            raise InputError(f'must be a time of the format {self._form}, got {text!r}') from error
        if not self.is_of_day:
            return self._since_epoch(found)
        since = found - found.replace(hour=0, minute=0, second=0, microsecond=0)
        time = round(since / timedelta(microseconds=1)) * 1_000
        while time < self._last - DAY_NS // 2:  # past midnight
            time += DAY_NS
        self._last = time
        return time

    def _serial(self, cell: Any, sign: str) -> int:
        days = number(cell, sign)
        if not 0.0 <= days < MOST_DAYS:
            raise InputError(f'must be days as Excel counts them, got {cell!r}')
        # Its days have no zone; a tick of a double is 0.6 us here.
        return self._since_epoch((BEFORE_EXCEL + timedelta(days=days)).replace(tzinfo=None))

    def _since_epoch(self, date: datetime) -> int:
        if date.tzinfo is None:
            date = date.replace(tzinfo=self._zone)
        return ((date - EPOCH) // timedelta(microseconds=1)) * 1_000


def _elapsed(text: str) -> int:
    """Return a time since the start [ns]."""
    found = SINCE_START.fullmatch(text)
    if found is None:
        raise InputError(f'must be [[days ]hours:]minutes:seconds, got {text!r}')
    days, hours, minutes = (int(part or 0) for part in found.groups()[:3])
    seconds = round(float(found[4].replace(',', '.')) * NANOSECONDS)
    return (days * DAY_NS + hours * TIME_UNITS['h'] + minutes * TIME_UNITS['min'] + seconds)


def _to_microseconds(text: str) -> str:
    """Cut fractions of a second to the six digits that `strptime` takes; a comma is a point."""
    return re.sub(r'(:\d\d)[.,](\d{1,6})\d*', r'\1.\2', text)


def start_of(text: str) -> int:
    """Return the date at which a duration begins [ns]."""
    return Clock().read(text)
