"""Parts: reduced bodies with the record of their training, as files that are used without mesh and
full model.

    part = part_files.train(body, excite(body, Excitation()))        or the states of any runs
    part_files.save(part, "arm.part.h5")
    arm = parts.placed(part_files.load("arm.part.h5").body, "left arm", origin, rotation)

A file is a `container` of the body (shape functions at the weighted points and over the
interpolation, places, mass, law, section), of notes on its training, and of factors and a few
states of it, with which a training goes on:

    S from the left singular vectors of [S_1 L_1, Y],    L_1 L_1^T = sum of all z z^T of before                         (50)

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, equation (50), doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from dataclasses import field, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..bodies import stress_recovery as fields
from ..bodies.body import Body, ShapePoints
from ..bodies.finer import finer, knows_shapes
from ..core.algebra import ranks
from ..core.algebra.linalg import as_dense, evenly
from ..core.errors import CorruptFile, FmbsError, InputError, say
from ..core.notices import notify
from ..core.storage import container, validation
from ..core.storage.container import FileKind, storable
from ..core.storage.records import dataclass
from ..core.storage.validation import Misfit, Reals, require
from ..systems.places import directions
from . import bodies as parts
from . import departures, interface_shapes, missing_shapes
from .excitation import turns

KIND = FileKind(
    "fmbs_skfem part",
    "a part",
    "copy the file again, or train the part anew",
    "train and save the part anew",
)
USUAL = 1e-12  #: eps of the shape functions of a part
ETA = 3e-5  #: tolerance of its weighted points
LOOSE = 1e-2  #: largest that is chosen for them
LOOKED_AT = 300  #: states of a training whose strains are held against those of the shape functions
KINDS = 16  #: parts that are kept when they have been read to be used
AT_REST = 1e-11  #: strain that is round-off
LARGE = 0.5  #: functions of a part over those of its body, from which it pays no more: 0.5 takes 1 to 2 times as long, 0.9 1.4 to 3
#: distance of the reference of a training that goes on from that of before, over its size
SAME = 1e-6
#: axes of the arrays of a part, and those of its reference (b, c)
ARRAYS = {"constant": "b", "mass": "b b", "spread": "w b", "stiffness": "b b", "axes": "i b"}
KEPT = 120  #: states that a part keeps of its training, for the points of one that goes on


@storable
@dataclass(frozen=True)
class Memory:
    """What a part keeps of its training in place of the states.

    S (b, m) are the functions of the part, and L (m, m)

        L L^T = sum z z^T

    over all states and components of its training.
    """

    functions: Annotated[np.ndarray, Reals("b m")]  #: S
    factor: Annotated[np.ndarray, Reals("m m")]  #: L
    states: Annotated[np.ndarray, Reals("s m c")]  #: some z
    #: displacements that its functions hold, see `interface_shapes`
    shapes: Annotated[np.ndarray, Reals("* * *")] = field(
        default_factory=lambda: np.zeros((0, 0, 0))
    )


@dataclass(frozen=True)
class Part:
    """A reduced body and what is known of its training.

    `train` makes it, `save` and `load` keep it; `body` is placed by `parts.bodies.placed` and
    assembled as any other.
    """

    body: Body
    notes: dict[str, Any] = field(default_factory=dict)
    memory: Memory | None = None  #: None of parts that are read to be used


def train(
    body: Body,
    states: np.ndarray,
    tolerance: float = USUAL,
    modes: int | None = None,
    eta: float | None = ETA,
    before: Part | None = None,
    /,
    *,
    shapes: np.ndarray | None = None,
    small_strains: bool = False,
    **notes: Any,
) -> Part:
    """The part of a full body from states (s, b, c) of any of its motions; without `eta` its energy
    is that of all points. With `small_strains` it is that of a constant stiffness that turns with
    the body, of solids alone.

    What a part of `before` with its memory was trained on counts as well, and none of its states is
    needed. Its functions hold the displacements `shapes` (j, b, c), by default those of
    `interface_shapes`.
    """
    begun = clock.process_time()
    then = {} if before is None else before.notes
    factor, old = (
        (np.zeros((len(body.reference), 0)), states[:0])
        if before is None
        else remembered(recall(before, body))
    )
    every = np.concatenate([old, states])
    shapes = interface_shapes.find(body) if shapes is None else shapes
    S = parts.shape_functions(body, states, tolerance, modes, factor, shapes)
    warn_of_no_bending(body, S)
    warn_of_size(body, S)
    z = parts.coordinates(body, S, every)
    own = parts.coordinates(body, S, shapes)
    found = parts.reduced_body(body, S)
    found = parts.ranged(found, z) if eta is None else parts.sampled(found, z, eta, own)
    some = states[evenly(0, len(states) - 1, KEPT)]
    kept = evenly(0, len(z) - 1, KEPT)
    tables = body.stiffness is None and not missing_shapes.is_large(body, S)
    columns = np.hstack([factor, parts.as_columns(some)])
    T = missing_shapes.functions(body, S, columns) if tables or small_strains else S[:, :0]
    lacks = missing_shapes.find(body, S, T, every) if tables and T.shape[1] else None
    if lacks and not len(shapes):
        lacks = replace(lacks, unbent=unbent(body, notes.get("alone")))
    errors = parts.strain_errors(
        body, S, np.concatenate([old, states[evenly(0, len(states) - 1, LOOKED_AT)]])
    )
    assert found.shapes is not None
    points = replace(found.shapes, missing=lacks, strain_errors=errors)
    if before is not None and before.body.shapes is not None:
        points = of_both(points, before.body.shapes)
    (low, high) = points.trained
    largest = float(parts.largest_strains(body, states).max())
    warn_of_rest(body, max(largest, then.get("largest_strain", 0.0)))
    record = {
        "functions": S.shape[1],
        "functions_full": len(S),
        "points": points.table.shape[1],
        "points_full": 0 if body.cells is None else body.cells.shape[1] * body.cells.shape[3],
        "tolerance": None if modes else tolerance,
        "hyper_tolerance": eta,
        "energy": "small strains" if small_strains else "any strains",
        "states": len(states) + int(then.get("states", 0)),
        "states_kept": len(kept),
        "largest_strain": max(largest, then.get("largest_strain", 0.0)),
        "strains": {
            name: [float(a), float(b)]
            for name, a, b in zip(departures.kinds_of(points), low, high, strict=True)
        },
        "strain_errors": errors_by_name(points.strain_errors),
        "missing_shapes": "known" if lacks else missing_shapes.why_unknown(body, S),
        "training_s": clock.process_time() - begun,
    }
    columns = np.hstack([parts.projected(body, S, factor), parts.as_columns(z[len(old) :])])
    memory = Memory(S, np.asarray(np.linalg.qr(columns.T, mode="r")).T, z[kept], own)
    found = replace(found, shapes=points)
    if small_strains:
        linear = parts.elasticity(parts.reduced_body(body, S))
        more = parts.reduced_body(body, np.hstack([S, T])) if T.shape[1] else None
        found = parts.of_small_strains(found, linear, more)
    return Part(found, record | notes, memory)


def remembered(known: Memory) -> tuple[np.ndarray, np.ndarray]:
    """What stands for the columns of a training (b, m), and the states that are kept of it (s, b,
    c), of the full body.
    """
    return known.functions @ known.factor, np.einsum("bm,smc->sbc", known.functions, known.states)


def of_both(points: ShapePoints, before: ShapePoints) -> ShapePoints:
    """Points with what is known of two trainings: the strains of both, and the places that neither
    has bent.
    """
    (a, b) = points.trained
    (c, d) = before.trained
    lacks = points.missing
    known = before.missing
    if lacks is not None:
        bends = lacks.unbent[np.isin(lacks.unbent, () if known is None else known.unbent)]
        lacks = replace(lacks, unbent=bends)
    return replace(points, trained=np.stack([np.minimum(a, c), np.maximum(b, d)]), missing=lacks)


def errors_by_name(errors: np.ndarray) -> dict[str, float]:
    """Errors (2,) of strains and curvatures, over the largest ones of the training."""
    return dict(zip(("strain", "curvature"), errors.tolist(), strict=False))


def unbent(body: Body, alone: Any) -> np.ndarray:
    """Numbers (k,) of places with directions on which no moment acted in a training `alone`; none
    where unknown.
    """
    if not isinstance(alone, Mapping):
        return np.zeros(0, dtype=np.int64)
    names = [*body.places, *body.frames]
    still = [
        k
        for k, name in enumerate(names)
        if directions(body, name) and not (alone.get("moment") and turns(body, name))
    ]
    return np.array(still, dtype=np.int64)


def recall(before: Part, body: Body) -> Memory:
    """The memory of a part that goes on with the training of a full body; InputError where it is of
    another one.
    """
    known = before.memory
    if known is None:
        remedy = "read it with part_files.resume, or train the part anew"
        raise InputError(
            say(f"part of '{body.name}'", "one that keeps factors of its training", "none", remedy)
        )
    if (len(known.functions), known.states.shape[2]) != body.reference.shape:
        expected = f"a body of {len(known.functions)} functions in {known.states.shape[2]} dimensions, as that of the part"
        raise InputError(
            say(
                f"body '{body.name}'",
                expected,
                f"{len(body.reference)} in {body.dim}",
                "take the mesh of before",
            )
        )
    if not same_shape(body.constant, known.functions @ before.body.reference, body.reference):
        got = "one of another size or shape"
        raise InputError(
            say(
                f"body '{body.name}'",
                "the body of the part, moved and turned as it may be",
                got,
                "take the mesh of before",
            )
        )
    return known


def same_shape(one: np.ndarray, a: np.ndarray, b: np.ndarray) -> bool:
    """Whether a rigid motion, or that of the mirror image, takes a to b (b, c).

        a a^T = b b^T    about the mean

    `one` (b,) is the field 1.
    """
    a, b = (x - np.outer(one, one @ x / (one @ one)) for x in (a, b))
    own, both, other = (float(np.sum((x.T @ y) ** 2)) for x, y in ((a, a), (a, b), (b, b)))
    return own - 2.0 * both + other <= SAME**2 * other


def used(
    path: str | Path,
    tolerance: float | None = None,
    modes: int | None = None,
    eta: float | None = None,
) -> Part:
    """The part of a file, coarser where that is asked for, see `coarsen`.

    A file is read once as long as it stays what it is: copies of a part share its arrays, by which
    they are known as copies.
    """
    try:
        found = Path(path).stat()
    except OSError:
        return load(path)  # which says what is wrong
    return read_once(
        Path(path).resolve(),
        (found.st_ino, found.st_mtime_ns, found.st_size),
        tolerance,
        modes,
        eta,
    )


@lru_cache(maxsize=KINDS)
def read_once(
    path: Path, _: tuple[int, ...], tolerance: float | None, modes: int | None, eta: float | None
) -> Part:
    """As `used`, of a file that is known by these numbers."""
    whole = tolerance is None and modes is None and eta is None
    if whole:
        return load(path)
    part = resume(path)
    try:
        return coarsen(part, tolerance, modes, eta)
    except FmbsError:
        raise
    except ValueError as problem:  # of finite arrays of the right shapes that no training gives
        expected = "shape functions and states of a training"
        raise CorruptFile(say(f"{path}", expected, f"others ({problem})", KIND.remedy)) from problem


def coarsen(
    part: Part, tolerance: float | None = None, modes: int | None = None, eta: float | None = None
) -> Part:
    """A part with the leading shape functions of its training, as many as eps = `tolerance` or a
    number of `modes` says, or all.

    The points are chosen among those that it has, on the states that it keeps, to an `eta` that by
    default grows as the error does. InputError for a part that keeps no factors of its training.
    """
    body, known = replace(part.body, linear=None, spare=None), part.memory
    if known is None:
        remedy = "read it with part_files.resume, or train the part anew"
        raise InputError(
            say(f"part '{body.name}'", "one that keeps factors of its training", "none", remedy)
        )
    assert body.shapes is not None
    limit = tolerance if tolerance or modes else float(np.finfo(float).eps)
    found = parts.leading(body, known.factor, known.shapes, None if modes else limit, modes)
    S = parts.with_places(body, found.modes)
    warn_of_no_bending(body, S)
    z = parts.coordinates(body, S, known.states)
    eta = points_to(found.singular_values, S.shape[1]) if eta is None else eta
    shapes = parts.coordinates(body, S, known.shapes)
    small = parts.sampled(parts.reduced_body(body, S), z, eta, shapes)
    assert small.shapes is not None
    missing = missing_shapes.coarser(body, S, known.states, known.factor)
    errors = coarser_strains(body, S, known.states)
    points = replace(
        small.shapes, trained=body.shapes.trained, missing=missing, strain_errors=errors
    )
    factor = parts.projected(body, S, known.factor).T
    numbers = {
        "functions": S.shape[1],
        "points": points.table.shape[1],
        "tolerance": tolerance,
        "hyper_tolerance": eta,
    }
    numbers["strain_errors"] = errors_by_name(errors)
    small = replace(small, shapes=points)
    if part.body.linear is not None:
        linear = parts.reduced_body(part.body, S).linear
        assert linear is not None
        more = finer(small) if knows_shapes(points) else None
        small = parts.of_small_strains(small, linear, more)
    return Part(
        small,
        part.notes | numbers,
        Memory(known.functions @ S, np.asarray(np.linalg.qr(factor, mode="r")).T, z, shapes),
    )


def warn_of_no_bending(body: Body, S: np.ndarray) -> None:
    """Say that shape functions S (b, m) are no more than the field 1 and the reference, by which a
    part stretches evenly alone.

    Nothing that it lacks is seen in a run, as it is at rest.
    """
    if S.shape[1] <= np.linalg.matrix_rank(np.column_stack([body.constant, body.reference])):
        text = f"part '{body.name}': its {S.shape[1]} shape functions are rigid motions and even stretches, so that it cannot bend"
        notify(f"{text}; take more of them (a smaller tolerance)")


def warn_of_rest(body: Body, strain: float) -> None:
    """Say that states of a training strain a body by no more than round-off."""
    if strain < AT_REST:
        text = f"part '{body.name}': its training strains it by {strain:.2g}, which is round-off"
        means = "its points and the range of its strains mean nothing"
        notify(f"{text}: {means}; train it on a motion that bends it, or alone with `--strain`")


def warn_of_size(body: Body, S: np.ndarray) -> None:
    """Say that functions S (b, m) are so many that the dense matrices of a part cost as much as the
    sparse ones of its body.
    """
    if S.shape[1] > LARGE * len(S):
        text = f"part '{body.name}': it has {S.shape[1]} of the {len(S)} functions of its body and will not be faster than it"
        notify(f"{text}; use the full body, or take fewer of them (a larger tolerance, or modes)")


def coarser_strains(part: Body, S: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Errors of strains and curvatures (2,) with functions S (b, m) over those of a part, in its
    states (s, b, c).

    Those of the part itself are added. None of a part that does not know its functions at all
    quadrature points.
    """
    points = part.shapes
    if points is None or points.missing is None or not points.strain_errors.size:
        return np.zeros(0)
    table = points.missing.functions
    b = len(S)
    some = states[evenly(0, len(states) - 1, LOOKED_AT)]
    own = np.einsum("bm,smc->sbc", S, parts.coordinates(part, S, some))
    u, v = (
        np.einsum("kgb,sbc->kcgs", table[:, :, :b], z).reshape(-1, table.shape[1], len(z))
        for z in (some, own)
    )
    return points.strain_errors + parts.relative(
        fields.strain_errors(points.law, u, v, points.missing.section[:, 0])
    )


def points_to(singular_values: np.ndarray, functions: int) -> float:
    """Tolerance eta of the points of so many functions, singular values (i,), by the eps that these
    leave out.

        eta = ETA sqrt(eps / USUAL)

    at least ETA, at most LOOSE.
    """
    square = singular_values**2
    return float(
        np.clip(ETA * np.sqrt(square[functions - 1 :].sum() / square.sum() / USUAL), ETA, LOOSE)
    )


def save(part: Part, path: str | Path) -> Path:
    """Write a part; the file appears under its name when it is complete.

    Notes are numbers, texts, lists and dicts; a `memory` makes it possible that its training goes
    on.
    """
    kept = {} if part.memory is None else {"memory": part.memory}
    return container.write(path, KIND, bodies=(part.body,), notes=part.notes, **kept)


def resume(path: str | Path) -> Part:
    """As `load`, with what a training needs that goes on; InputError for a file that does not hold
    it.

    CorruptFile as of `load`.
    """
    part = load(path)
    if "states_kept" not in part.notes:
        expected = "a part that keeps factors of its training"
        raise InputError(say(f"{path}", expected, "one without", "train the part anew"))
    return replace(part, memory=container.read(path, KIND, memory=Memory)["memory"])


def load(path: str | Path) -> Part:
    """The part of a file; CorruptFile names what is wrong with one that is not as it was written.

    InputError where there is no file. Its training cannot go on: see `resume`.
    """
    content = container.read(path, KIND, bodies=tuple, notes=dict)
    with container.reading(Path(path), KIND):
        (body,) = content["bodies"]
        check(body)
    return Part(body, content["notes"])


def check(body: Body) -> None:
    """Refuse a body whose numbers do not fit each other."""
    validation.types(body, "body")
    points = body.shapes
    functions = len(body.reference)
    if points is None or body.cells is None or body.spread is None:
        raise Misfit("body", "a reduced body", "a full one")
    sizes = {"b": functions}
    Reals("b c").check(body.reference, "body.reference", sizes)
    dim = body.dim
    require(
        dim in (2, 3) and points.dim == dim,
        "body.reference",
        "vectors of two or three components",
        body.reference.shape,
    )
    for name, axes in ARRAYS.items():
        if (value := getattr(body, name)) is not None:
            Reals(axes).check(value, f"body.{name}", sizes)
    apart = np.ptp(body.shape_reference, axis=0).max() > 0.0
    require(bool(apart), "body.spread", "shape functions over a body of some size", "others")
    # stretches of rims have none, but for round-off
    sizes_of_mass = np.linalg.eigvalsh(as_dense(body.mass))
    positive = sizes_of_mass[-1] > 0.0 and sizes_of_mass[0] >= -ranks.NOISE * sizes_of_mass[-1]
    require(bool(positive), "body.mass", "a positive definite matrix", "another one")
    require(
        points.table.shape[2] == functions,
        "body.shapes.table",
        f"{functions} functions",
        points.table.shape,
    )
    count = int(getattr(body.space, "count", -1))
    require(
        count == body.spread.shape[0],
        "body.spread",
        f"{count} rows, as its interpolation has functions",
        body.spread.shape,
    )
    validation.fit(points, "body.shapes", {"q": body.reference.size})
    require(
        (body.directors is None) == (points.law.fields == 1),
        "body.directors",
        f"those that {points.law} reads",
        "others",
    )
    if body.directors is not None:
        Reals("j b").check(
            body.directors, "body.directors", sizes | {"j": (points.law.fields - 1) * count}
        )
    validation.fit(body.cells, "body.cells", {"q": count * dim * points.law.fields})
    rows = 0 if body.axes is None else body.axes.shape[0]
    require(
        rows == len(body.frames) * (1 + dim),
        "body.axes",
        f"{len(body.frames) * (1 + dim)} rows of frames",
        rows,
    )
