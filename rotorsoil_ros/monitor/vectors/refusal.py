"""Why was a stretch of raw samples refused? In words, counted for each channel."""

from collections import Counter, deque
from collections.abc import Iterator
from enum import StrEnum
from typing import NamedTuple

_LATEST = 20  # stretches of which the share that was refused is told while the machine runs
_FEWEST = 3  # one refused stretch is no news
_TOLD_SHARE = 0.2


# What gravity, in the mean of three axes, says of them.
SEEN = 'gravity seen: unit and vertical are right, a turn about z cannot be seen'
NOT_SEEN = 'gravity not seen: units and axes cannot be checked'


class Flaw(StrEnum):
    """What keeps a stretch of samples, or an order in it, from becoming a vector."""

    PACKETS = 'packets'
    MISSING = 'missing'
    STAMPS = 'stamps'
    STILL = 'still'
    CLIPPED = 'clipped'
    HELD = 'held'
    NYQUIST = 'nyquist'
    ALIAS = 'alias'
    SPIKES = 'spikes'
    JUMP = 'jump'
    TURNED = 'turned'
    AXES = 'axes'
    UNITS = 'units'
    UNSOLVED = 'unsolved'
    NOISE = 'below_noise'


# A machine that hardly moves is no fault of its sensor.
_NO_FAULTS = (Flaw.NOISE,)


class Refusal(NamedTuple):
    """A flaw, and what it amounts to in this stretch."""

    flaw: Flaw
    text: str


class Refusals:
    """Stretches of one channel: how many were refused, and why; what was left out of others."""

    def __init__(self) -> None:
        self.stretches = 0
        self.counts: Counter[Flaw] = Counter()
        self.left_out: Counter[str] = Counter()
        self.gravity = ''  # what it says, once it is known
        self._texts: dict[Flaw, str] = {}
        self._latest: deque[Flaw | None] = deque(maxlen=_LATEST)
        self._told: Flaw | None = None

    def note(self, refusal: Refusal | None) -> None:
        """Count a stretch, refused or not."""
        self.stretches += 1
        self._latest.append(refusal.flaw if refusal else None)
        if refusal:
            self.counts[refusal.flaw] += 1
            self._texts[refusal.flaw] = refusal.text

    def lines(self) -> Iterator[str]:
        """Yield for each reason how many stretches were refused; then what was left out."""
        for flaw, count in self.counts.most_common():
            yield f'{count} of {self.stretches} stretches refused: {self._texts[flaw]}'
        for text, count in sorted(self.left_out.items()):
            yield f'{text} ({count} times)'
        if self.gravity == NOT_SEEN:
            yield self.gravity

    def prevailing(self) -> str:
        """Return why more than a fifth of the latest stretches were refused; empty if not."""
        flaw = self._prevailing()
        return '' if flaw is None else (
            f'{self._latest.count(flaw)} of the last {len(self._latest)} stretches refused: '
            f'{self._texts[flaw]}')

    def news(self) -> str | None:
        """Return what has changed since this was asked: a reason, empty for none any more."""
        flaw = self._prevailing()
        if flaw is self._told:
            return None
        self._told = flaw
        return self.prevailing()

    def values(self) -> dict[str, float | str]:
        """Return counts by flaw, and the reason that prevails, for the diagnostics."""
        found: dict[str, float | str] = {
            'stretches': self.stretches, 'refused': sum(self.counts.values())}
        found |= {f'refused_{flaw}': count for flaw, count in sorted(self.counts.items())}
        if self.counts:
            found['refused_because'] = self._texts[self.counts.most_common(1)[0][0]]
        if self.gravity:
            found['gravity'] = self.gravity
        return found

    def _prevailing(self) -> Flaw | None:
        flaws = Counter(flaw for flaw in self._latest if flaw and flaw not in _NO_FAULTS)
        if not flaws:
            return None
        flaw, count = flaws.most_common(1)[0]
        is_news = count >= _FEWEST and count > _TOLD_SHARE * len(self._latest)
        return flaw if is_news else None
