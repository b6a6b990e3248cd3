"""Vibration modes: about the equilibrium of the loads, in a rotating frame, or about the reference."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ... import dynamics
from ...core.notices import remark
from ...core.storage.records import dataclass
from ...core.values.fields import Count
from ...dynamics import Linear
from ...dynamics.near_state import shapes
from ...dynamics.near_state.modes import GROWS, STILL, fastest, grows, whole_pairs
from ...dynamics.near_state.shapes import Free
from ...parts import finer_parts
from ..yamlfile import Oddity, where
from .analysis import StateTable, Work, motion_only
from .near_state import NearState

if TYPE_CHECKING:
    from ...systems import System
    from ..schema import Scene

LANCZOS = 60.0  #: solutions of an eigenproblem, usually


@dataclass(frozen=True)
class Motions:
    """What is listed of modes, slowest first."""

    omega: np.ndarray  #: (i,) angular frequencies [rad/s]
    growth: np.ndarray  #: (i,) real parts of the eigenvalues [1/s]
    damping: np.ndarray | None  #: (i,) damping ratios, None of undamped modes
    vectors: np.ndarray  #: (n, i)
    #: (i,) which rigid motion it is that nothing resists, empty for others
    free: tuple[str, ...] = ()
    #: (j,) eigenvalues of motions that grow beside these [1/s]
    beyond: np.ndarray = field(default_factory=lambda: np.empty(0))
    unknown: int = 0  #: faster motions of which nothing says whether they grow


@dataclass(frozen=True, kw_only=True)
class Modes(NearState):
    """Vibration modes about the equilibrium of the loads, which is found as in statics, or about
    the unloaded reference.

        K v = omega^2 M v,    where `damped` or with `spin`    (s^2 M + s C + K) v = 0

    About the reference, of the loads only springs act. `damped` modes have a damping ratio each;
    follower forces and `spin`, with which joints and loads turn, need complex modes, too. A motion
    that grows is named: flutter or divergence.

    {type: modes, count: 6}
    """

    count: Count = 10
    damped: bool = False
    table: ClassVar[str] = "modes.csv"

    def work(self) -> Work:
        return Work(4.0, 1.0, LANCZOS, counts={"modes": self.count})

    def find(self, scene: Scene, allow_outside: bool = False) -> StateTable:
        """Frequencies, and where they are complex damping ratios and growth."""
        raw, reduced, about = self.model(scene, allow_outside)
        linear = self.equations(reduced, about)
        found = self.motions(reduced, linear)
        doubts = [*find_growing(found, about)]
        if found.unknown and not doubts:
            text = f"whether {found.unknown} faster motions grow is not known; ask for more modes"
            remark(
                f"{where(scene, 'analysis', 'count')}: {text}, or see whether a run stays where it begins"
            )
        hertz = found.omega / (2 * np.pi)
        columns = {
            "mode": np.arange(1, len(hertz) + 1),
            "frequency_hz": hertz,
            "omega_rad_per_s": found.omega,
        }
        facts = {"about": about, "frequencies_hz": hertz}
        heads = ["mode", "frequency [Hz]", "omega [rad/s]"]
        if found.damping is not None:
            facts |= {"damping_ratios": found.damping, "growth_per_s": found.growth}
            columns |= {"damping_ratio": found.damping, "growth_per_s": found.growth}
            heads += ["damping ratio", "growth [1/s]"]
        finer_parts.warn_unknown(reduced)
        high = self.too_high(found, reduced, about)
        if high is not None:
            doubts += finer_parts.find_off("frequencies", finer_parts.by_mode(high))
            facts |= {"too_high_by": high}
            columns |= {"too_high_by": high}
            heads += ["too high by"]
        title = f"vibration modes about the {about}"
        captions = tuple(f"mode {k + 1}: {value:.4g} Hz" for k, value in enumerate(hertz))
        moving = dynamics.Shapes(reduced, linear.x, found.vectors, captions)
        about = f"{len(hertz)} vibration modes"
        known = raw, reduced, about, title, heads, columns, facts, hertz, moving, found.free
        return StateTable(*known, doubts=doubts)

    def too_high(self, found: Motions, system: System, about: str) -> np.ndarray | None:
        """By what part of themselves (i,) parts make the sizes of eigenvalues too large, see
        `finer_parts`; None without parts.
        """

        def again(finer: System) -> np.ndarray:
            return size(self.motions(finer, self.equations(finer, about)))

        wanted = finer_parts.of_finer(system, again)
        return None if wanted is None else finer_parts.too_high(size(found), wanted)

    def motions(self, system: System, linear: Linear) -> Motions:
        """Modes of linear equations, those that nothing resists by name."""
        free = dynamics.find_free(system, linear)
        if self.damped or self.spin is not None or not dynamics.is_symmetric(linear):
            return complex_motions(linear, free, self.count, system)
        return real_motions(linear, free, self.count)

    def idle(self, scene: Scene) -> Iterator[Oddity]:
        """What modes do not read: undamped ones no damping, those about the reference no loads."""
        if not self.damped and self.spin is None:
            yield from motion_only(scene, "a vibration mode", "damped: true counts damping")
        elif scene.initial.bodies:
            yield ("initial",), "does nothing, a vibration mode has no initial motion"
        unread = [name for name, load in scene.loads.items() if not load.resists]
        if self.about == "reference" and unread:
            yield (
                ("loads",),
                f"modes are those of the unloaded reference, in which these do nothing: {', '.join(unread)}",
            )
        if self.about == "reference" and self.spin is not None:
            yield (
                ("analysis", "about"),
                "the reference is no equilibrium in a rotating frame, whose pull stretches the bodies",
            )


def size(found: Motions) -> np.ndarray:
    """Sizes (i,) of eigenvalues [rad/s].

        |growth + i omega|

    of all motions that are listed.
    """
    return np.asarray(np.hypot(found.omega, found.growth))


def find_growing(found: Motions, about: str) -> Iterator[str]:
    """Motions that grow."""
    if growing := np.flatnonzero(grows(found.omega, found.growth)).tolist():
        listed = ", ".join(f"mode {k + 1} by {found.growth[k]:.3g} 1/s" for k in growing[:3])
        kind = (
            "flutter"
            if (found.omega[growing] > GROWS * np.hypot(found.omega, found.growth).max()).any()
            else "divergence"
        )
        yield f"the {about} is unstable ({kind}): {listed}{' ...' if len(growing) > 3 else ''}"
    if len(found.beyond):
        fastest = found.beyond[np.argmax(found.beyond.real)]
        kind = "flutter" if abs(fastest.imag) > GROWS * abs(fastest) else "divergence"
        text = f"{len(found.beyond)} of the motions that are not listed grow ({kind}), most by {fastest.real:.3g} 1/s"
        at = f" at {abs(fastest.imag) / (2 * np.pi):.4g} Hz" if kind == "flutter" else ""
        yield f"the {about} is unstable: {text}{at}; ask for more modes to see them"


def real_motions(linear: Linear, free: Free, count: int) -> Motions:
    """Undamped modes: the free motions, and those orthogonal to them."""
    idle = min(len(free.names), count)
    others = shapes.apart_from(linear, free)
    resisted = count > idle and (not idle or len(others.x) > len(others.rows))
    rest = dynamics.real_modes(others, count - idle) if resisted else None
    squares = np.concatenate([np.zeros(idle), *([rest.squares] if rest else [])])
    vectors = np.concatenate([free.vectors[:, :idle], *([rest.shapes] if rest else [])], axis=1)
    order = np.argsort(squares, kind="stable")
    squares, names = squares[order], [*free.names[:idle], *[""] * (len(squares) - idle)]
    omega, growth = np.sqrt(np.maximum(squares, 0.0)), np.sqrt(np.maximum(-squares, 0.0))
    return Motions(omega, growth, None, vectors[:, order], tuple(names[k] for k in order))


def complex_motions(linear: Linear, free: Free, count: int, system: System) -> Motions:
    """Complex modes; zeros of free motions, which come twice, each once."""
    idle = len(free.names)
    wanted = count + idle
    if idle < len(linear.x) - len(linear.rows) and shapes.stands_alone(linear, free):
        linear = shapes.apart_from(linear, free)
        wanted = max(count - idle, 1)
    modes = dynamics.complex_modes(linear, wanted)
    slow = np.abs(modes.eigenvalues) <= STILL * fastest(linear)
    kept = np.flatnonzero(~(slow & shapes.are_free(modes.shapes, free, system.metric)))
    kept, rest = np.split(kept, [whole_pairs(modes.eigenvalues[kept], max(count - idle, 0))])
    others = np.append(modes.eigenvalues[rest], modes.beyond)
    idle = min(idle, count)
    vectors = np.concatenate(
        [free.vectors[:, :idle], shapes.in_phase(modes.shapes[:, kept], system.metric)], axis=1
    )
    none = np.zeros(idle)
    omega, growth, damping = (
        np.concatenate([none, part[kept]])
        for part in (modes.angular_frequencies, modes.eigenvalues.real, modes.damping_ratios)
    )
    beyond = others[grows(others.imag, others.real)] if len(others) else others
    return Motions(
        omega,
        growth,
        damping,
        vectors,
        (*free.names[:idle], *[""] * len(kept)),
        beyond,
        modes.unknown,
    )
