"""Whether an input that is given step by step rises as that of an unstable loop: by the same factor
again and again.

    m_1, m_2, m_3, m_4   largest sizes in four equal spans:    m_k+1 > 2 m_k,   m_4 > 1000 m_1,   ln(m_4/m_3) > 0.7 ln(m_2/m_1)

An unstable linear loop grows as exp(s t), whose factors are equal from span to span; those of t^p
fall, as ln 2 to ln 4/3.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

FEW = 2  #: levels of a span, at least
TWICE = 2.0  #: times as much from span to span
GROWN = 1e3  #: times as much from the first span to the last
# 0.41 of a power of time, 1 of an exponential function
STEADY = 0.7  #: of the first factor that the last one is, in logarithms
MOST = 64  #: levels that are kept, of which two become one then
LAST = 4, 8, 12, 16  #: levels before a step that failed
EVERY = 16  #: levels after which they are looked at


class Rising:
    """Largest sizes of a number in equal spans of steps, at most MOST of them, however long it is
    given.
    """

    def __init__(self) -> None:
        self.levels: list[float] = []
        self.span = 1
        self.count = 0
        self.largest = 0.0

    def add(self, value: float) -> bool:
        """One more value; whether it is time to look."""
        self.largest = max(self.largest, abs(value))
        self.count = self.count + 1
        if self.count < self.span:
            return False
        self.levels.append(self.largest)
        self.largest = 0.0
        self.count = 0
        look = len(self.levels) % EVERY == 0
        if len(self.levels) == MOST:
            self.levels = [
                max(pair) for pair in zip(self.levels[::2], self.levels[1::2], strict=True)
            ]
            self.span = 2 * self.span
        return look

    def found(self) -> tuple[float, float, int] | None:
        """What it rose from and to, and in how many steps: of all, or of the last half or quarter;
        None where it did not.
        """
        for part in (1, 2, 4):
            levels = self.levels[-(len(self.levels) // part) :]
            if rises(most := spans(levels), steady=True):
                return most[0], most[3], self.span * len(levels)
        return None

    def before_failure(self) -> tuple[float, float, int] | None:
        """The same before a step that failed, where a tenth of the growth is enough: it may have
        taken five steps.
        """
        for count in LAST:
            levels = self.levels[-count:]
            if len(levels) == count and rises(most := spans(levels, 1), GROWN / 10.0):
                return most[0], most[3], self.span * count
        return self.found()


def spans(sizes: Sequence[float], few: int = FEW) -> list[float]:
    """Largest sizes in four equal spans; none of fewer than `few` in each."""
    count = len(sizes) // 4
    return [max(sizes[k * count : (k + 1) * count]) for k in range(4)] if count >= few else []


def rises(most: Sequence[float], factor: float = GROWN, steady: bool = False) -> bool:
    """Whether the largest sizes of four spans rise as written above, by a `factor`; `steady` asks
    for the last condition too.
    """
    grown = bool(most) and most[3] > factor * most[0]
    if not grown or not all(behind > TWICE * before for before, behind in itertools.pairwise(most)):
        return False
    return not steady or (
        most[0] > 0.0 and math.log(most[3] / most[2]) > STEADY * math.log(most[1] / most[0])
    )
