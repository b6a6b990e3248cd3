"""The linear system about an equilibrium, from inputs to outputs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ... import dynamics
from ...core.storage.records import dataclass
from ...core.values.fields import Count, Names
from ...dynamics import Linear
from ...dynamics.near_state.modes import without_round_off
from ...dynamics.near_state.statespace import StateSpace
from ...parts import finer_parts
from .analysis import StateTable, Work
from .near_state import NearState

if TYPE_CHECKING:
    from ...systems import System
    from ..schema import Scene

SOLUTIONS = 200.0  #: of an eigenproblem of all modes, in solutions of one right-hand side
LISTED = 12  #: eigenvalues in the table
SLOW = 0.5  #: frequency of slow inputs, over that of the slowest motion
STILL = 1e-6  #: of the largest one, up to which an eigenvalue is that of a free motion, and an answer none


@dataclass(frozen=True, kw_only=True)
class Linearise(NearState):
    """The linear system about the equilibrium of the loads, or about the reference as if it were
    one.

        x' = A x + B u,    y = C x + D u

    Its states are amplitudes of vibration modes and their rates, of all modes unless `modes` says
    how many, the lowest. Inputs are those of the section `inputs`, outputs the columns of the
    section `outputs`; both count from the equilibrium. With `static` D has the static bending of
    the modes that are left out.

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
        space = self.space(reduced, linear, time)
        doubts = [*self.hold_against_finer(space, reduced, about, time)]
        return StateTable(
            raw,
            reduced,
            f"{len(space.A)} states, {', '.join(space.inputs)} -> {', '.join(space.outputs)}",
            f"the {LISTED} slowest eigenvalues about the {about}",
            ("", "frequency [Hz]", "damping ratio", "growth [1/s]"),
            eigenvalues(space),
            {
                "about": about,
                "inputs": list(space.inputs),
                "columns": list(space.outputs),
                "states": len(space.A),
            },
            linear=space,
            doubts=doubts,
        )

    def space(self, system: System, linear: Linear, time: float) -> StateSpace:
        """The linear system."""
        return dynamics.state_space(
            system, linear, time, self.inputs, self.outputs, self.modes, self.static
        )

    def hold_against_finer(
        self, space: StateSpace, system: System, about: str, time: float
    ) -> Iterator[str]:
        """Where parts make listed eigenvalues, or the answer to slow inputs, others than those of
        their bodies.
        """
        finer_parts.warn_unknown(system)
        known: list[StateSpace] = []

        def again(finer: System) -> np.ndarray:
            known.append(self.space(finer, self.equations(finer, about), time))
            return sizes(known[0])

        wanted = finer_parts.of_finer(system, again)
        if wanted is not None:
            own = sizes(space)
            high = finer_parts.by_mode(finer_parts.too_high(own, wanted))
            yield from finer_parts.find_off("eigenvalues", high)
            slow = [SLOW * float(min(own[own > STILL * own.max(initial=0.0)], default=1.0))]
            gain, other = (
                np.abs(one) for one in (space.transfer(slow)[0], known[0].transfer(slow)[0])
            )
            off = np.abs(gain - other).max(axis=1), other.max(axis=1)
            moves = off[1] > STILL * off[1].max(initial=0.0)
            errors = {
                name: float(a / b)
                for name, a, b, moved in zip(space.outputs, *off, moves, strict=True)
                if moved
            }
            yield from finer_parts.find_off("answers to slow inputs", errors)


def sizes(space: StateSpace) -> np.ndarray:
    """Sizes (i,) of the listed eigenvalues s [rad/s].

        |s|

    each of a conjugate pair once.
    """
    found = eigenvalues(space)
    return np.asarray(np.hypot(2.0 * np.pi * found["frequency_hz"], found["growth_per_s"]))


def eigenvalues(space: StateSpace) -> dict[str, np.ndarray]:
    """The slowest eigenvalues of A, each of a conjugate pair once."""
    found = without_round_off(np.linalg.eigvals(space.A))
    found = found[found.imag >= 0.0]
    found = found[np.argsort(np.abs(found), kind="stable")][:LISTED]
    size = np.where(np.abs(found) > 0.0, np.abs(found), 1.0)
    frequency = found.imag / (2.0 * np.pi)
    number = np.arange(1, len(found) + 1)
    return {
        "mode": number,
        "frequency_hz": frequency,
        "damping_ratio": (0.0 - found.real) / size,
        "growth_per_s": found.real,
    }
