"""Analyses of linear equations about a state: the equilibrium of the loads, also in a rotating
frame, or the reference.
"""

from __future__ import annotations

import dataclasses
from abc import ABC
from typing import TYPE_CHECKING, Literal

import numpy as np

from ... import dynamics
from ...core.storage.records import dataclass
from ...core.values.fields import Count, Time
from ...dynamics import Linear, Newton
from ...dynamics.near_state.linear import Spin, is_left
from ...systems import free_motions
from ...systems.connections import hinged_rims, mechanism
from .. import build
from .. import field_kinds as fields
from ..yamlfile import where
from .analysis import Form, States, refuse_free

if TYPE_CHECKING:
    from ...systems import System
    from ..schema import Scene

DRAWN = "draw what weight holds as it hangs"
CONTACT = "let contact that holds them overlap from the start (friction holds nothing here)"


@dataclass(frozen=True, kw_only=True)
class NearState(States, ABC):
    """What is found of linear equations about a state."""

    constraints: Form = None
    about: Literal["equilibrium", "reference"] = "equilibrium"
    spin: Spin | None = None
    load_steps: Count = 10
    time: Time = 1.0
    tolerance: fields.NewtonTolerance = 1e-10

    def instants(self) -> np.ndarray:
        return np.array([self.time])

    def examine(self, scene: Scene, raw: System) -> None:
        free_motions.refuse_limp(where(scene, "analysis"), raw)

    def model(
        self, scene: Scene, allow_outside: bool, kept: bool = False
    ) -> tuple[System, System, str]:
        """The system with all coordinates, the one that is solved, and what it is linearised about:
        `equilibrium` or `reference`.

        The equilibrium of a scene without loads, spin, and joints that have left it is the
        reference, about which loads do nothing unless they are `kept`.
        """
        about = self.about
        loaded = self.spin is not None or not all(load.rests for load in scene.loads.values())
        if about == "reference" and not kept:
            scene = dataclasses.replace(
                scene, loads={name: load for name, load in scene.loads.items() if load.resists}
            )
        raw = build.system(scene, allow_outside=allow_outside)
        if not loaded and not is_left(raw, self.time):
            about = "reference"
        mechanism.refuse_held_drives(raw)
        turned = raw if self.spin is None else dynamics.in_rotating_frame(raw, self.spin)
        if about == "reference":
            self.examine(scene, raw)
        elif free := [*free_motions.pushed(turned, self.time), *hinged_rims.pushed(raw, self.time)]:
            got = f"free motions: {'; '.join(map(str, free))}"
            refuse_free(
                scene,
                got,
                f"hold them by joints, {DRAWN}, {CONTACT}, or take the modes about the reference",
            )
        return raw, build.chosen_form(scene, turned), about

    def equations(self, system: System, about: str) -> Linear:
        """The equations about the equilibrium or the reference."""
        if about == "reference":
            return dynamics.linearise(system)
        path = dynamics.solve_statics(system, self.load_steps, Newton(self.tolerance), self.time)
        kept = None if path.memory is None else path.memory[-1]
        return dynamics.linearise(path.system, path.x[-1], path.multipliers[-1], 1.0, kept)
