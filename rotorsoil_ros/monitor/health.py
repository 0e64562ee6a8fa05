"""How is a machine's data: fresh, answered, or missing, and since when."""

from collections import Counter
import math

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.events import Diagnostics, Level, NANOSECONDS
from rotorsoil_ros.units import rad_s_to_rpm

# Its speed is told and lies below the table, so near to nothing that the machine stands.
STANDING, STANDSTILL = 'standing', 1e-3
GAPS = ('nan', 'infinite', 'negative', 'below_table', 'above_table', 'unstable',
        'unresolved')
FAULTS = (*GAPS, 'malformed', 'velocity_missing', 'stamp_missing', 'dropped')
REDATED = ('stamp_not_set', 'stamp_far_off')  # answered at the time of reception
STAMPS = ('repeated_stamp', 'backward_stamp')  # answered all the same
COUNTED = ('received', 'answered', STANDING, *FAULTS, 'joint_missing', *REDATED, *STAMPS,
           'measured', 'samples', 'measurements_dropped')


MOST_SAID = 16
EXPLAINED = {
    'negative': 'the speed is negative: of a drive that counts backwards the ratio is -1',
    'stamp_not_set': 'header.stamp is zero: whoever sends the speed does not set it',
    'stamp_far_off': 'header.stamp jumps by years: the clock of whoever sends is not set'}


class Health:
    """Counts of one machine, and the level that they mean at each tick of the caller's clock."""

    def __init__(self, machine: str, speed_range: tuple[float, float]) -> None:
        self.machine = machine
        self.speed_range = speed_range
        self.counts = Counter(dict.fromkeys(COUNTED, 0))
        self.level = Level.STALE
        self.last_speed = math.nan
        self.publishers = 1
        self.standing = ''  # an error of the case itself, whatever comes in
        self.misfit = ''  # what somebody sends that nobody can read
        self.slips: tuple[str, ...] = ()  # of whoever has set this up, whatever comes in
        self.speed_unit = 'rad_s'
        self.explanations = dict(EXPLAINED)
        self._said: set[str] = set()
        self._last_ns: int | None = None
        self._faults = 0
        self._at_tick = self.counts.copy()
        self._tick_ns: int | None = None
        self._heard_ns: int | None = None
        self._silent_s = 0.0
        self._rate_hz = 0.0

    def note(self, reason: str, count: int = 1) -> None:
        """Count something that happened."""
        self.counts[reason] += count
        if reason in FAULTS or reason in REDATED:
            self._faults += count

    def explain(self, reason: str, text: str) -> None:
        """Say more of a reason: what the reader should know to mend it."""
        self.explanations[reason] = text

    def complaints(self) -> list[str]:
        """Return what somebody has to mend, from the last tick to now."""
        deaf = self.misfit and not self._since_tick('received')
        missing = not self.counts['received'] and self.counts['joint_missing']
        found = [self.misfit if deaf else '',
                 self.explanations.get('joint_missing', '') if missing else '',
                 *(self.explanations.get(reason, '') for reason in (*FAULTS, *REDATED)
                   if self._since_tick(reason)), *self.slips]
        return [text for text in dict.fromkeys(found) if text]

    def news(self) -> list[str]:
        """Return the complaints that were not told before."""
        found = [text for text in self.complaints() if text not in self._said]
        self._said |= set(found[:MOST_SAID - len(self._said)])
        return [text for text in found if text in self._said]

    def receive(self, stamp_ns: IntArray, speed: FloatArray) -> None:
        """Count speeds [rad/s] and look whether their stamps [ns] go forward."""
        self.last_speed = float(speed[-1])
        self.counts['received'] += len(speed)
        for stamp in stamp_ns.tolist():
            if self._last_ns is not None and stamp <= self._last_ns:
                self.counts[STAMPS[stamp < self._last_ns]] += 1
            self._last_ns = stamp

    @property
    def has_news(self) -> bool:
        """Whether the last speed must not wait for the next tick: a fault, or a return."""
        if self.standing:
            return False
        return self.level is not Level.WARN if self._faults else self.level is Level.STALE

    def begin(self, now_ns: int) -> None:
        """Begin to count time; nobody has been silent before."""
        self._tick_ns = self._heard_ns = now_ns

    def announce(self, now_ns: int) -> Diagnostics:
        """Tell a change between two ticks; rate and silence are still those of the last one."""
        self.level = self._raised(Level.WARN if self._faults else Level.OK)
        return self._report(now_ns)

    def _raised(self, level: Level) -> Level:
        """Return a level, or ERROR where the case itself has one."""
        return Level.ERROR if self.standing else level

    def tick(self, now_ns: int, *, stale_after_s: float) -> Diagnostics:
        """Close the period that began at the last tick, judge it and report it."""
        received = self._since_tick('received')
        if self._tick_ns is not None and now_ns > self._tick_ns:
            self._rate_hz = received * NANOSECONDS / (now_ns - self._tick_ns)
        if received or self._heard_ns is None or now_ns < self._heard_ns:
            self._heard_ns = now_ns
        self._silent_s = (now_ns - self._heard_ns) / NANOSECONDS
        if not self.counts['received'] or self._silent_s > stale_after_s:
            self.level = Level.STALE
        else:
            is_well = not self._faults and self.publishers < 2 and not self.slips
            self.level = Level.OK if is_well else Level.WARN
        self.level = self._raised(self.level)
        report = self._report(now_ns)
        self._tick_ns, self._at_tick, self._faults = now_ns, self.counts.copy(), 0
        return report

    def _since_tick(self, reason: str) -> int:
        return self.counts[reason] - self._at_tick[reason]

    def _report(self, now_ns: int) -> Diagnostics:
        lowest, highest = self.speed_range
        values = {
            'speed_rad_s': self.last_speed, 'speed_rpm': rad_s_to_rpm(self.last_speed),
            'table_from_rad_s': lowest, 'table_to_rad_s': highest,
            'rate_hz': self._rate_hz, 'silent_s': self._silent_s,
            'publishers': self.publishers,
            **{reason: self.counts[reason] for reason in COUNTED}}
        return Diagnostics(self.machine, now_ns, self.level, self._summary(), values)

    def _summary(self) -> str:
        """Say in one sentence what the level rests on."""
        if self.standing:
            return self.standing
        if self.level is Level.STALE:
            waiting = ('waiting for the first speed' if not self.counts['received'] else
                       f'no speed for {self._silent_s:.1f} s')
            return '; '.join([waiting, *self.complaints()])
        if self.level is Level.OK:
            if self._since_tick(STANDING) == self._since_tick('received') > 0:
                return 'the machine stands still'
            rate = f', {self._rate_hz:.1f} per second' if self._rate_hz else ''
            return f'every speed is answered{rate}'
        said = ''
        if unanswered := self._told(FAULTS):
            said = f'without an answer: {unanswered}'
        elif redated := self._told(REDATED):
            said = f'dated on reception: {redated}'
        elif self.publishers > 1:
            said = f'{self.publishers} publishers tell the speed'
        return '; '.join(filter(None, [said, *self.complaints()]))

    def _told(self, reasons: tuple[str, ...]) -> str:
        """Return how often each of some reasons was noted since the last tick."""
        return ', '.join(f'{count} {reason.replace("_", " ")}' for reason in reasons
                         if (count := self._since_tick(reason)))
