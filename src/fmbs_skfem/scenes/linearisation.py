"""The linear system about an equilibrium, from inputs to outputs."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from .. import dynamics
from ..core.fields import Count, Names
from ..core.records import dataclass
from ..dynamics.modes import without_round_off
from ..dynamics.statespace import StateSpace
from .analyses import StateTable, Work
from .near_state import NearState

if TYPE_CHECKING:
    from .schema import Scene

SOLUTIONS = 200.0  #: of an eigenproblem of all modes, in solutions of one right-hand side
LISTED = 12  #: eigenvalues in the table


@dataclass(frozen=True, kw_only=True)
class Linearise(NearState):
    """The linear system x' = A x + B u, y = C x + D u about the equilibrium of the loads, or about the reference as if it were one.

    Its states are amplitudes of vibration modes and their rates, of all modes unless `modes` says how many, the lowest. Inputs are
    those of the section `inputs`, outputs the columns of the section `outputs`; both count from the equilibrium. With `static` D
    has the static bending of the modes that are left out.

    {type: linearise, inputs: u, outputs: tip, modes: 4}
    """

    inputs: Names | None = None
    outputs: Names | None = None
    modes: Count | None = None
    static: bool = False
    table: ClassVar[str] = "eigenvalues.csv"
    files: ClassVar[tuple[str, ...]] = ("linear.npz", "linear.mat")
    has_outputs: ClassVar[bool] = True

    def work(self) -> Work:
        return Work(4.0, 1.0, SOLUTIONS)

    def find(self, scene: Scene, allow_outside: bool = False) -> StateTable:
        raw, reduced, about = self.model(scene, allow_outside, kept=True)
        linear = self.equations(reduced, about)
        time = self.time if about == "equilibrium" else 0.0
        space = dynamics.state_space(reduced, linear, time, self.inputs, self.outputs, self.modes, self.static)
        return StateTable(
            raw,
            reduced,
            f"{len(space.A)} states, {', '.join(space.inputs)} -> {', '.join(space.outputs)}",
            f"the {LISTED} slowest eigenvalues about the {about}",
            ("", "frequency [Hz]", "damping ratio", "growth [1/s]"),
            eigenvalues(space),
            {"about": about, "inputs": list(space.inputs), "columns": list(space.outputs), "states": len(space.A)},
            linear=space,
        )


def eigenvalues(space: StateSpace) -> dict[str, np.ndarray]:
    """The slowest eigenvalues of A, each of a conjugate pair once."""
    found = without_round_off(np.linalg.eigvals(space.A))
    found = found[found.imag >= 0.0]
    found = found[np.argsort(np.abs(found), kind="stable")][:LISTED]
    size = np.where(np.abs(found) > 0.0, np.abs(found), 1.0)
    frequency, number = found.imag / (2.0 * np.pi), np.arange(1, len(found) + 1)
    return {"mode": number, "frequency_hz": frequency, "damping_ratio": (0.0 - found.real) / size, "growth_per_s": found.real}
