r"""All that the next step reads, taken between two steps and put back bit for bit.

    (x, v, a, q'', lambda, earlier q'', order of the predictor, factors)_n  ->  the same at n + 1

Factors serve many steps, so they are part of it: a run that is taken up again with other factors
would stop its iterations at other digits. Band and dense factors are kept as they are. Sparse
factors of large models are made again at the configuration where they were made, which gives the
same numbers. What has to be equal for that, the model and the method, is kept as facts, and a
difference is named.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from ..core.errors import CorruptFile, say
from ..core.storage.records import dataclass
from ..systems.compiled import Compiled, signal_table
from .compiled_step.large import Large
from .compiled_step.step import Method, Step
from .trajectory import Trace

#: what `solve` reads, by the kind of the factors
FACTORS = {
    0: (),
    1: ("W", "schur", "schur_pivots", "spread", "J"),
    2: ("general", "pivots", "schur", "schur_pivots", "spread", "J"),
    3: (
        "kkt",
        "ends",
        "pivots",
        "schur",
        "schur_pivots",
        "spread",
        "J",
        "updates",
        "shares",
        "secants",
    ),
    4: (
        "lower",
        "diagonal",
        "schur",
        "schur_pivots",
        "spread",
        "J",
        "updates",
        "shares",
        "secants",
    ),
    5: ("W", "ends", "schur", "schur_pivots", "spread", "J", "updates", "shares", "secants"),
}
#: of `step.Rotations`
ROTATED = (
    "start",
    "turns",
    "reach",
    "shares",
    "rest",
    "border",
    "pivots",
    "lives",
    "on",
)
#: arrays of a model that differ from process to process
ADDRESSES = (
    "elastic",
    "lift",
    "laws",
    "forces",
    "calls",
    "act",
)
PLACES = ("kept", "turned", "gram")  #: in a space, and what follows from other numbers
LOW = "terms of low rank"  #: in the factors
INSTANTS = 65  #: at which the signals of two models are compared


@dataclass(frozen=True)
class Rows:
    """Stored states of a run, in the unknowns of its system.

    n unknowns and m multipliers as `integrate` gives them; times in seconds, positions in metres,
    multipliers as forces on joint rows.
    """

    times: np.ndarray  #: (s,) [s]
    x: np.ndarray  #: (s, n)
    v: np.ndarray  #: (s, n)
    a: np.ndarray  #: (s, n)
    multipliers: np.ndarray  #: (s, m), physical
    memory: np.ndarray  #: (s, l) what forces keep, (s, 0) where that is not known
    work: np.ndarray  #: (s,) of all that has no potential [J], not a number where that is not known
    trace: Trace | None = None  #: what was read of the states, where few are kept
    #: (k,) which have states then: x, v, a, multipliers and memory have k rows
    kept: np.ndarray | None = None


@dataclass(frozen=True)
class Checkpoint:
    """A run between two steps.

    `arrays` has what `arrays` of this module gives: motion, counters and factors by name, so that
    the next step is the same bit for bit.
    """

    done: int  #: steps
    kept: int  #: states stored so far
    facts: dict[str, str]  #: what the model and the method are
    arrays: dict[str, np.ndarray]
    cpu_s: float  #: up to here [s]
    wall_s: float


@dataclass(frozen=True)
class RunState:
    """What a run shows after some steps to who keeps it; rows and checkpoint are made when they are
    called for.

    A `Record` gets one after some steps. Calling `rows` and `checkpoint` copies arrays; both are
    those of the moment.
    """

    done: int  #: steps
    steps: int  #: of the whole run
    time: float  #: [s]
    kept: int  #: states stored so far
    bytes_a_state: int  #: of `rows`
    rows: Callable[[int, int], Rows]  #: stored states from the first up to the second number
    checkpoint: Callable[[], Checkpoint]
    halved: int = 0  #: steps that failed, and were divided
    factorisations: int = 0  #: so far


@dataclass(frozen=True)
class Resumed:
    """Where a run goes on, with the states stored before.

    `integrate` goes on behind it; CorruptFile where model or method are not those of the
    checkpoint.
    """

    checkpoint: Checkpoint
    rows: Rows


Record: TypeAlias = Callable[[RunState], None]


def facts(model: Compiled, method: Method, steps: int, kept: np.ndarray) -> dict[str, str]:
    """Model and method in names and texts; numbers are written so that different ones read
    differently.
    """
    times = method.h * np.linspace(0.0, steps, INSTANTS)
    return {
        "unknowns": str(model.system.size),
        "multipliers": str(model.constraints),
        "step": repr(method.h),
        "gamma (by rho_inf)": repr(method.gamma),
        "tolerance of Newton's iteration [m]": repr(method.tolerance),
        "iterations at most": str(method.iterations),
        "contraction for new factors": repr(method.slow),
        **({"local error of a step [m]": repr(method.local)} if method.local else {}),
        "steps": str(steps),
        "states to keep": f"{len(kept)}, {digest(kept)[:16]}",
        "arrays of the model": digest(
            np.array([digest(model.arrays), *(digest(piece.record) for piece in model.pieces)])
        )[:16],
        "signals of joints and loads": digest(signal_table(model.system, times))[:16],
    }


def digest(value: Any) -> str:
    """SHA-256 of an array, a number, or a named tuple of such; addresses and places are left out."""
    found = hashlib.sha256()
    if hasattr(value, "_asdict"):
        for name, part in value._asdict().items():
            if name not in ADDRESSES + PLACES:
                found.update(f"{name} {digest(part)}".encode())
    else:
        array = np.ascontiguousarray(value)
        found.update(f"{array.dtype.str} {array.shape}".encode())
        found.update(array.data if array.size else b"")
    return found.hexdigest()


def differences(then: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """`name: then ..., now ...` for every fact that is not the same.

    Both are what `facts` gives of a model and its method; nothing where they are the same.
    """
    names = [*then, *(name for name in now if name not in then)]
    return [
        f"{k}: {then.get(k, 'nothing')} then, {now.get(k, 'nothing')} now"
        for k in names
        if then.get(k) != now.get(k)
    ]


def arrays(step: Step, large: Large | None) -> dict[str, np.ndarray]:
    """Copies of motion, counters and factors, by name."""
    found = {name: array.copy() for name, array in kept(step).items()}
    if large is None:
        return found | {
            f"factors {name}": array.copy()
            for name, array in factors(step, int(step.work.kind[0])).items()
        }
    return found | (
        {"factored at": large.place.copy(), "contraction": step.work.rate.copy()}
        if step.work.kind[0]
        else {}
    )


def kept(step: Step) -> dict[str, np.ndarray]:
    """Motion and counters by name."""
    found = {f"state {name}": array for name, array in step.state._asdict().items()}
    found |= {"counters": step.job.counters, "kind": step.work.kind}
    found |= {"turned tangents": step.space.turned} if step.space.turned.size else {}
    found |= (
        {f"rotated {name}": getattr(step.rotations, name) for name in ROTATED}
        if step.doors.follow
        else {}
    )
    return found | ({LOW: step.space.low.used} if step.doors.fill else {})


def factors(step: Step, kind: int) -> dict[str, np.ndarray]:
    """Factors of a kind by name, with as many columns of low rank as there are."""
    found = {
        name: step.space.W if name == "W" else getattr(step.work, name) for name in FACTORS[kind]
    }
    if kind == 0 or step.doors.fill == 0:
        return found
    low = step.space.low
    work = step.work
    count = int(step.space.low.used[0])
    rank = count * low.left.shape[1]
    size = min(rank, len(step.space.x))
    found |= {
        "lows": work.lows[:rank],
        "inner": work.inner[: size * size],
        "inner_pivots": work.inner_pivots[:size],
    }
    return found | {"low_rows": low.rows[:count], "low_right": low.right[:count]}


def restore(
    checkpoint: Checkpoint, now: Mapping[str, str], step: Step, large: Large | None
) -> None:
    """Put a checkpoint back into the arrays of a run whose facts are `now`.

    CorruptFile where the facts differ, or an array has another shape or kind of numbers than the
    model asks for.
    """
    other = differences(checkpoint.facts, now)
    if other:
        remedy = "run the scene anew, or restore what has changed"
        raise CorruptFile(
            say("checkpoint", "the model and the method it was taken of", "; ".join(other), remedy)
        )
    held = checkpoint.arrays
    kind = int(fitting(held, "kind", step.work.kind)[0])
    if step.doors.fill:
        step.space.low.used[:] = fitting(held, LOW, step.space.low.used)
    targets = kept(step)
    if large is None:
        targets |= {f"factors {name}": array for name, array in factors(step, kind).items()}
    for name, target in targets.items():
        target[:] = fitting(held, name, target)
    if large is not None and kind:
        step.space.x[:] = fitting(held, "factored at", step.space.x)
        large.factorise(step)
        step.work.rate[:] = fitting(held, "contraction", step.work.rate)
        step.work.kind[0] = kind


def fitting(held: Mapping[str, np.ndarray], name: str, target: np.ndarray) -> np.ndarray:
    """The array of a name, which has the shape and kind of numbers of its target."""
    found = held.get(name)
    if found is None or found.shape != target.shape or found.dtype != target.dtype:
        got = "none" if found is None else f"{found.dtype} {found.shape}"
        raise CorruptFile(
            say(f"checkpoint: {name}", f"{target.dtype} {target.shape}", got, "run the scene anew")
        )
    return found
