"""Buckling loads."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ... import dynamics
from ...core.storage.records import dataclass
from ...core.values.fields import Count, Time
from ...parts import finer_parts
from .. import build
from ..yamlfile import Oddity
from .analysis import Form, States, StateTable, Work, motion_only, refuse_swings
from .vibration import LANCZOS

if TYPE_CHECKING:
    from ..schema import Scene


@dataclass(frozen=True, kw_only=True)
class Buckling(States):
    """Load factors k at which the loads take the stiffness away, predicted from small ones; the
    factor 1 stands for t = `time`.

        (K0 + k K1) v = 0

    {type: buckling, count: 3}
    """

    constraints: Form = None
    count: Count = 3
    time: Time = 1.0
    table: ClassVar[str] = "factors.csv"

    def instants(self) -> np.ndarray:
        return np.array([self.time])

    def work(self) -> Work:
        return Work(4.0, 1.0, LANCZOS, counts={"modes": self.count})

    def find(self, scene: Scene, allow_outside: bool = False) -> StateTable:
        raw = build.system(scene, allow_outside=allow_outside)
        refuse_swings(scene, raw, self.time)
        reduced = build.chosen_form(scene, raw)
        found = dynamics.buckling(reduced, self.count, self.time)
        factors = found.factors
        columns = {"mode": np.arange(1, len(factors) + 1), "load_factor": factors}
        facts = {"load_factors": factors}
        heads = ["mode", "load factor"]
        doubts = []
        if not found.conservative:
            told = "some loads turn with the structure and have no potential: it may flutter before its stiffness is lost"
            doubts = [
                f"{told}; look at modes under growing loads, analysis: {{type: modes, damped: true}}"
            ]
        finer_parts.warn_unknown(reduced)
        wanted = finer_parts.of_finer(
            reduced, lambda finer: dynamics.buckling(finer, self.count, self.time).factors
        )
        if wanted is not None:
            high = finer_parts.too_high(np.abs(factors), np.abs(wanted))
            doubts += finer_parts.find_off("load factors", finer_parts.by_mode(high))
            facts |= {"too_high_by": high}
            columns |= {"too_high_by": high}
            heads += ["too high by"]
        captions = tuple(f"load factor {value:.4g}" for value in factors)
        shapes = dynamics.Shapes(reduced, reduced.x0, found.shapes, captions)
        about = f"{len(factors)} load factors"
        return StateTable(
            raw, reduced, about, "buckling", heads, columns, facts, shapes=shapes, doubts=doubts
        )

    def idle(self, scene: Scene) -> Iterator[Oddity]:
        return motion_only(scene, "a buckling load")
