r"""Which events happen where their values g are what they are: the side of zero on which every
value was, and where it leaves zero.

    side s = +-1      happens where  s g <= 0                         the value comes to zero, or jumps over it
    at rest, g = 0    happens where  g leaves zero                    a comparison that becomes true, max(g, 0) that rises
    unguarded         happens nowhere until g is clearly not zero     what has just happened, and what it holds at zero

A value is zero where round-off of unknowns alone may have made it so (`noise_of`). It is at rest
where it is zero at the start, and where it is exactly zero at the end of a step in which its event
has not happened, unless the lock of that event may hold it there: a rate that an event has stopped
leaves zero when the joint is released, which is no event.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..dynamics.measuring import Reader
from ..systems import compiled as compilation
from ..systems.connections.redundancy import scale_of
from ..systems.system import Trigger

if TYPE_CHECKING:
    from ..dynamics.run import OpenRun

NOISY = 3.0  #: on the change of a value by a change of all unknowns with arbitrary signs
NOISE = 1e-10  #: change of unknowns, over changes that count as large, which values do not show
SMOOTH = 0.9  #: of the change by twice as much, above which a value jumps there: a comparison has no noise (1/2 where it is smooth)
LEAVING = 1e-14  #: of a value at the other end of a step, beyond which it is not zero there
#: may come to rest at zero, is at rest there, may be held there by what it locked
FREE, RESTING, HELD = (
    0,
    1,
    -1,
)


class Crossings:
    """Sides of zero of the values of events (t,).

    t events, their values g in the unit of the expression; `noise` is what round-off of the
    unknowns makes of each.
    """

    def __init__(self, triggers: Sequence[Trigger], noise: np.ndarray) -> None:
        self.triggers, self.noise = triggers, noise  #: noise (t,): values below it are zero
        #: signs of values; 0 where an event is not on guard
        self.sides = np.zeros(len(triggers), np.int64)
        self.rests = np.zeros(len(triggers), np.int64)  #: FREE, RESTING or HELD

    def signs(self, values: np.ndarray) -> np.ndarray:
        """Signs of values (t,), 0 for those that are noise."""
        return np.asarray(
            np.where(np.abs(values) > self.noise, np.sign(values), 0.0).astype(np.int64)
        )

    def fits(self, change: np.ndarray) -> np.ndarray:
        """Whether changes (t,) of values have the direction of their events."""
        return np.array(
            [
                one.direction in (0, int(sign))
                for one, sign in zip(self.triggers, change, strict=True)
            ],
            dtype=bool,
        )

    def left(self, values: np.ndarray) -> np.ndarray:
        """Which events were at rest at zero and have happened where their values are these (t,)."""
        signs = self.signs(values)
        return np.asarray((self.rests == RESTING) & (signs != 0) & self.fits(signs))

    def crossed(self, values: np.ndarray) -> np.ndarray:
        """Which events have happened where their values are these (t,)."""
        return np.asarray(
            (self.sides != 0) & (self.sides * values <= 0.0) & self.fits(-self.sides)
        ) | self.left(values)

    def begin(self, values: np.ndarray) -> None:
        """Take values (t,) for those at the start, where those that are zero are at rest."""
        self.sides = self.signs(values)
        self.rests[self.sides == 0] = RESTING

    def remember(
        self, values: np.ndarray, but: Collection[int] = (), lately: Collection[int] = ()
    ) -> None:
        """Remember the sides of values (t,), those that are exactly zero as at rest; `but` those of
        some events.

        What has happened `lately`, in the same step, is not at rest.
        """
        signs = self.signs(values)
        some = np.ones(len(values), dtype=bool)
        some[list(but)] = False
        clear, still = some & (signs != 0), some & (values == 0.0) & (self.rests != HELD)
        still[list(lately)] = False
        self.sides = np.where(clear, signs, np.where(still, 0, self.sides))
        self.rests = np.where(clear, FREE, np.where(still, RESTING, self.rests))

    def happen(self, due: np.ndarray, jumped: np.ndarray) -> None:
        """Take events `due` off guard; those that lock are held at zero where they have come there
        without a jump.
        """
        self.sides[due] = 0
        self.rests[due] = [
            HELD if self.triggers[k].lock and not jump else FREE
            for k, jump in zip(due, jumped, strict=True)
        ]

    def gap(self, k: int, first: float, last: float, value: float) -> float:
        """What falls through zero where an event happens between values `first` and `last`, at a
        value between them.

            2 |first| + LEAVING |last| - sign(last) value

        A value that jumps to zero and stays there, a comparison that ends, is below zero there.
        """
        if self.sides[k] != 0:
            return float(self.sides[k] * value) - LEAVING * abs(first)
        return 2.0 * abs(first) + LEAVING * abs(last) - float(np.sign(last) * value)


def noise_of(run: OpenRun, numbers: Sequence[int]) -> np.ndarray:
    """Values (t,) that are zero: what round-off of unknowns changes, and of columns of outputs that
    are read, of their size.

    What changes by as much for half of that jumps there, `tip.y < 0` where tip.y is zero: it has no
    noise. What is no number beside the start, as a root of zero, tells none.
    """
    system = run.model.system
    random = np.random.default_rng(0)
    d = NOISE * scale_of(system) * random.choice([-1.0, 1.0], system.size)
    reader = run.find(Reader)
    reader.read(run, numbers, 0.0)
    columns = reader.last[1] if reader.last else {}
    signs = dict(zip(columns, random.choice([-1.0, 1.0], len(columns)), strict=True))

    def values(part: float) -> np.ndarray:
        memory = compilation.accepted(
            run.model, system.x0 + part * d, system.v0 + part * d / run.scheme.step
        )
        near = {
            name: value + part * NOISE * reader.size * signs[name]
            for name, value in columns.items()
        }
        return np.array([reader.value(run, k, memory, near) for k in numbers])

    here = values(0.0)
    with np.errstate(invalid="ignore"):
        whole, half = (
            np.fmax(*(np.abs(values(sign * part) - here) for sign in (1.0, -1.0)))
            for part in (1.0, 0.5)
        )
        return NOISY * np.where((half <= SMOOTH * whole) & np.isfinite(whole), whole, 0.0)
