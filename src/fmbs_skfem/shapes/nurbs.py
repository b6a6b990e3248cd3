r"""NURBS surfaces of any degree and continuity, of one or several patches.

    r(xi) = sum_b R_b(xi) c_b,    R_b = w_b N_b / W,    W = sum_b w_b N_b,    N_b = N_i(xi1) N_j(xi2)

A cell is a non-empty pair of knot spans, xi in [0, 1]^2 its parameters divided by the lengths of
the spans. The polynomials of a span hold beyond it too. Functions, cells and the functions of a
cell are numbered with direction 1 running fastest, patch after patch.

Piegl and Tiller, The NURBS Book, 2nd ed., doi:10.1007/978-3-642-59223-2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..core.errors import InputError, closest, say
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.values.arguments import blamed
from . import line, seams, table
from . import surface as surfaces
from .surface import DERIVATIVES, ORDERS, Parent, Surface
from .table import Floats, Ints

SAME = 1e-9  #: relative difference up to which knots and weights are the same
#: in the order of the sides of the parent square
SIDES = (
    "xi2_min",
    "xi1_max",
    "xi2_max",
    "xi1_min",
)


@storable
@dataclass(frozen=True, eq=False)
class Patch(line.Keeping):
    """Tensor product of B-splines over two open knot vectors; NURBS when `weights` (n1, n2) are
    given.
    """

    knots1: Floats
    knots2: Floats
    degree1: int
    degree2: int
    weights: Floats | None = None

    def __post_init__(self) -> None:
        for i in (1, 2):
            try:
                spline = line.BSpline(getattr(self, f"degree{i}"), getattr(self, f"knots{i}"))
            except InputError as error:
                raise InputError(f"Patch, direction {i}: {error}") from error
            ends = spline.knots[[spline.degree, -spline.degree - 1]]
            if not np.array_equal(ends, spline.knots[[0, -1]]):
                remedy = "insert the end knots until they repeat degree + 1 times"
                raise InputError(
                    say(
                        f"Patch.knots{i}",
                        "open knots, which start and end in degree + 1 equal ones",
                        "others",
                        remedy,
                    )
                )
            object.__setattr__(self, f"knots{i}", spline.knots)
        if self.weights is not None:
            object.__setattr__(self, "weights", _weights(self.weights, self.shape))

    @property
    def lines(self) -> tuple[line.BSpline, line.BSpline]:
        """The B-splines of both directions."""
        return self.keep(
            "lines",
            lambda patch: (
                line.BSpline(patch.degree1, patch.knots1),
                line.BSpline(patch.degree2, patch.knots2),
            ),
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Number of functions (n1, n2)."""
        return len(self.knots1) - self.degree1 - 1, len(self.knots2) - self.degree2 - 1

    @property
    def cells(self) -> tuple[int, int]:
        """Number of cells of both directions."""
        first, second = (len(line.breaks(spline)) - 1 for spline in self.lines)
        return first, second


#: of both directions: function k -> share t in c_k = t c_k-1 + (1 - t) c_k+1
Ties: TypeAlias = tuple[dict[int, float], ...]


@storable
@dataclass(frozen=True, eq=False)
class Nurbs:
    """The interpolation of a surface of NURBS patches."""

    patches: dict[str, Patch]
    #: (n1, n2) functions of each patch; patches share those of a common edge; -1 where they are
    #: tied
    numbers: dict[str, Ints]
    joined: tuple[tuple[str, str], ...] = ()  #: pairs of edges that share their functions
    join: bool | None = None  #: whether edges were asked to do so; None: by default
    #: functions of patches that follow from their neighbours, see `smoothing`
    ties: dict[str, Ties] = field(default_factory=dict)
    #: pairs of edges that lie on one another with functions of their own, see `seams`
    seams: tuple[tuple[str, str], ...] = ()


def full_name(patch: str, name: str) -> str:
    """Name of a place of a patch; a patch without a name adds none."""
    return f"{patch}.{name}" if patch else name


def _weights(values: ArrayLike, shape: tuple[int, int]) -> Floats:
    weights = np.array(values, dtype=float)
    if weights.shape != shape:
        remedy = "there are len(knots) - degree - 1 functions a direction"
        raise InputError(
            say("Patch.weights", f"shape {shape}, one for each function", weights.shape, remedy)
        )
    wrong = ~(np.isfinite(weights) & (weights > 0.0))
    if wrong.any():
        i, j = np.argwhere(wrong)[0]
        raise InputError(
            say(
                f"Patch.weights[{i}, {j}]",
                "a positive number",
                weights[i, j],
                "a plain B-spline has weights 1",
            )
        )
    weights.setflags(write=False)
    return weights


# ------------------------------------------------------------------------------------------------------------- evaluation
@surfaces.basis.register
def _(space: Nurbs, cell: Ints, xi: Floats) -> Floats:
    cell = np.asarray(cell)
    begin = 0
    first = next(iter(space.patches.values()))
    values = np.zeros((len(cell), DERIVATIVES, (first.degree1 + 1) * (first.degree2 + 1)))
    for name, patch in space.patches.items():
        end = begin + patch.cells[0] * patch.cells[1]
        here = (cell >= begin) & (cell < end)
        if here.any():
            values[here] = _evaluate(patch, cell[here] - begin, np.asarray(xi, dtype=float)[here])
            if name in space.ties:
                values[here] = _tied(patch, space.ties[name], cell[here] - begin, values[here])
        begin = end
    return values


def _evaluate(patch: Patch, cell: Ints, xi: Floats) -> Floats:
    """Functions and derivatives (x, 6, b) of a patch, the functions of a cell with direction 1
    running fastest.
    """
    span2, span1 = np.divmod(cell, patch.cells[0])
    one = _pieces(patch.lines[0], span1, xi[:, 0])
    two = _pieces(patch.lines[1], span2, xi[:, 1])
    values = np.stack([two[:, j, :, None] * one[:, i, None, :] for i, j in ORDERS], axis=1).reshape(
        len(cell), DERIVATIVES, -1
    )
    if patch.weights is None:
        return values
    values *= patch.weights.T.ravel()[_local(patch)[cell]][:, None, :]
    return table.quotient(values, values.sum(axis=2), ORDERS)


def _pieces(spline: line.BSpline, span: Ints, s: Floats) -> Floats:
    """B-splines and two derivatives in s (x, 3, p+1) on the polynomial pieces of the spans (x,), s
    = 0..1 along a span.
    """
    ends = line.breaks(spline)
    length = np.diff(ends)[span]
    return (
        line.in_cells(spline, span, s * length, 2, ends[span])
        * length[:, None, None] ** np.arange(3)[:, None]
    )


def _tied(patch: Patch, ties: Ties, cell: Ints, values: Floats) -> Floats:
    """Values (x, 6, b) of the functions that are left where others follow from them."""
    one, two = (
        local_functions(spline, found)[1] for spline, found in zip(patch.lines, ties, strict=True)
    )
    span2, span1 = np.divmod(cell, patch.cells[0])
    parts = values.reshape(*values.shape[:2], patch.degree2 + 1, -1)
    return np.einsum("xkji,xjl,xim->xklm", parts, two[span2], one[span1], optimize=True).reshape(
        values.shape
    )


def local_functions(spline: line.BSpline, ties: Mapping[int, float]) -> tuple[Ints, Floats]:
    """Functions (e, b) of the spans of one direction, and what they are of the B-splines there (e,
    b, b).

        c_k = t c_k-1 + (1 - t) c_k+1

    In place of such a tied function a span before it has c_k+1, one after it c_k-1; ends of a
    closed direction, both tied, go round.
    """
    p = spline.degree
    last = spline.count - 1
    functions = line.functions(spline).copy()  # which is kept, and read-only
    shares = np.tile(np.eye(p + 1), (len(functions), 1, 1))
    begins = functions[:, 0].copy()
    finishes = functions[:, -1].copy()
    for k, t in ties.items():
        before = finishes == k
        after = begins == k
        functions[before, p], functions[after, 0] = (
            (k + 1 if k < last else 1),
            (k - 1 if k > 0 else last - 1),
        )
        shares[before, p, p], shares[before, p, p - 1] = 1.0 - t, t
        shares[after, 0, 0], shares[after, 0, 1] = t, 1.0 - t
    return functions, shares


def control_points(shape: Surface, name: str) -> Floats:
    """Control points (n1, n2, c) of a patch, those of tied functions from their neighbours."""
    found = shape.reference[shape.space.numbers[name]]
    for axis, ties in enumerate(shape.space.ties.get(name, ())):
        rows = np.moveaxis(found, axis, 0)
        last = len(rows) - 1
        for k, t in ties.items():
            rows[k] = (
                t * rows[k - 1 if k > 0 else last - 1] + (1.0 - t) * rows[k + 1 if k < last else 1]
            )
    return found


def _local(patch: Patch) -> Ints:
    """Functions (e, b) of the cells, numbered within the patch."""
    one, two = map(line.functions, patch.lines)
    return (one[None, :, None, :] + patch.shape[0] * two[:, None, :, None]).reshape(
        patch.cells[0] * patch.cells[1], -1
    )


# ---------------------------------------------------------------------------------------------------------------- surface
@blamed
def surface(
    patches: Patch | Mapping[str, Patch],
    control: ArrayLike | Mapping[str, ArrayLike],
    *,
    order: int | None = None,
    join: bool | None = None,
) -> Surface:
    """The surface of one patch, or of several named ones, over control points (n1, n2, 2 or 3) [m].

    Named places: points `corner_00`, `corner_10`, `corner_01`, `corner_11` (ends of xi1, xi2),
    edges `xi1_min`, `xi1_max`, `xi2_min`, `xi2_max`; with several patches `name.corner_00` ... and
    the face `name`. Sides whose control points coincide, of two patches or of one that closes on
    itself, share their functions unless `join` is false: they are tied in position, free to fold.
    Sides that lie on one another with other functions, or in part, are pairs in `seams`, which
    plates tie weakly. Where nobody asked (None), plates of a patch that closes on itself say so,
    and refuse supports and loads on joined sides.
    """
    if isinstance(patches, Patch):
        patches = {"": patches}
        control = {"": np.asarray(control, dtype=float)}
    points = _control(patches, control)
    numbers, reference = _numbered(points) if join is False else _join(patches, points)
    nodes = []
    begin = 0
    places: dict[str, tuple[int, float, float]] = {}
    edges: dict[str, Ints] = {}
    faces: dict[str, Ints] = {}
    for name, patch in patches.items():
        cell = begin + np.arange(patch.cells[0] * patch.cells[1]).reshape(patch.cells[::-1])
        nodes.append(numbers[name].T.ravel()[_local(patch)])
        for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
            places[full_name(name, f"corner_{i}{j}")] = (int(cell[-j, -i]), float(i), float(j))
        for side, along in enumerate((cell[0], cell[:, -1], cell[-1], cell[:, 0])):
            edges[full_name(name, SIDES[side])] = np.stack(
                [along, np.full_like(along, side)], axis=1
            )
        faces |= {name: cell.ravel()} if name else {}
        begin += cell.size
    space = Nurbs(dict(patches), numbers, _joined(numbers), join)
    shape = Surface(
        space,
        Parent.SQUARE,
        np.concatenate(nodes),
        reference,
        np.ones(len(reference)),
        order or _order(patches),
        places,
        edges,
        faces,
    )
    found = () if join is False else seams.find(shape, space.joined, list(edges))
    return replace(shape, space=replace(space, seams=found)) if found else shape


def _order(patches: Mapping[str, Patch]) -> int:
    """Gauss points a direction: the highest degree over C1 splines of two cells or more, else one
    more (no spurious modes).
    """
    splines = [spline for patch in patches.values() for spline in patch.lines]
    times = [
        np.unique(s.knots[s.degree + 1 : -s.degree - 1], return_counts=True)[1] for s in splines
    ]
    smooth = all(len(t) > 0 and t.max() < s.degree for s, t in zip(splines, times, strict=True))
    return max(s.degree for s in splines) + (not smooth)


def _control(
    patches: Mapping[str, Patch], control: ArrayLike | Mapping[str, ArrayLike]
) -> dict[str, Floats]:
    """Checked control points of every patch."""
    if not isinstance(control, Mapping) or set(control) != set(patches) or not patches:
        got = sorted(control) if isinstance(control, Mapping) else type(control).__name__
        raise InputError(
            say(
                "nurbs.surface",
                f"control points for the patches {sorted(patches)}",
                got,
                "use the same names",
            )
        )
    points = {name: np.asarray(control[name], dtype=float) for name in patches}
    for name, patch in patches.items():
        where = f"nurbs.surface, control points of patch '{name}'"
        shape = points[name].shape
        if shape not in ((*patch.shape, 2), (*patch.shape, 3)):
            expected = f"shape {(*patch.shape, '2 or 3')}, one for each function"
            raise InputError(
                say(
                    where,
                    expected,
                    shape,
                    "there are len(knots) - degree - 1 functions a direction",
                )
            )
        if not np.isfinite(points[name]).all():
            raise InputError(
                say(
                    where,
                    "finite numbers",
                    points[name][~np.isfinite(points[name])][0],
                    "look for NaN",
                )
            )
    degrees = {(patch.degree1, patch.degree2) for patch in patches.values()}
    dims = {array.shape[2] for array in points.values()}
    if len(degrees) > 1 or len(dims) > 1:
        got = f"degrees {sorted(degrees)}, {sorted(dims)} coordinates"
        raise InputError(
            say(
                "nurbs.surface",
                "patches of the same degrees and dimension",
                got,
                "raise degrees with nurbs.refine",
            )
        )
    return points


def _numbered(points: Mapping[str, Floats]) -> tuple[dict[str, Ints], Floats]:
    """Numbers (n1, n2) of the functions of every patch and all control points (n, c), nothing
    shared.
    """
    numbers = {}
    begin = 0
    for name, array in points.items():
        numbers[name] = (
            begin + np.arange(array[..., 0].size).reshape(array.shape[1], array.shape[0]).T
        )
        begin += array[..., 0].size
    return numbers, np.concatenate(
        [array.swapaxes(0, 1).reshape(-1, array.shape[2]) for array in points.values()]
    )


# ---------------------------------------------------------------------------------------------------------- common edges
def side_rows(array: Floats | Ints) -> tuple[Floats | Ints, ...]:
    """Rows of an array (n1, n2, ...) along the sides of a patch, in the order of `SIDES`, xi
    increasing.
    """
    return array[:, 0], array[-1], array[:, -1], array[0]


def _join(
    patches: Mapping[str, Patch], points: Mapping[str, Floats]
) -> tuple[dict[str, Ints], Floats]:
    """As `_numbered`, with one function where two sides have the same control points and functions."""
    from scipy.spatial import cKDTree

    numbers, reference = _numbered(points)
    size = float(np.ptp(reference, axis=0).max())
    touch = seams.CLOSE * size
    sides = [(name, i, rows) for name in patches for i, rows in enumerate(side_rows(numbers[name]))]
    sides = [side for side in sides if np.ptp(reference[side[2]], axis=0).max() > touch]
    middles = np.array([reference[rows].mean(axis=0) for _, _, rows in sides]).reshape(
        -1, reference.shape[1]
    )
    pairs = [np.empty((0, 2), np.int64)]
    for a, b in sorted(cKDTree(middles).query_pairs(touch)):
        one = sides[a][2]
        two = sides[b][2]
        if len(one) != len(two):
            continue
        for step in (1, -1):
            gap = float(np.abs(reference[one] - reference[two[::step]]).max())
            if gap <= touch and _alike(
                [(i, patches[name]) for name, i, _ in (sides[a], sides[b])], step
            ):
                pairs.append(np.stack([one, two[::step]], axis=1))
                seams.tell_closed(
                    [full_name(name, SIDES[i]) for name, i, _ in (sides[a], sides[b])], gap, size
                )
                break
    links = np.concatenate(pairs)
    graph = coo_array((np.ones(len(links)), links.T), shape=(len(reference),) * 2)
    _, first, merged = np.unique(
        connected_components(graph, directed=False)[1], return_index=True, return_inverse=True
    )
    rank = np.argsort(np.argsort(first))[merged]
    shared = {name: rank[array] for name, array in numbers.items()}
    return shared, seams.follow(points, shared, reference[np.sort(first)])


def _joined(numbers: Mapping[str, Ints]) -> tuple[tuple[str, str], ...]:
    """Pairs of edges whose functions are shared by two patches, or by two sides of one that closes
    on itself.
    """
    found: dict[frozenset[int], list[str]] = {}
    for name, array in numbers.items():
        for side, rows in zip(SIDES, side_rows(array), strict=True):
            found.setdefault(frozenset(rows.tolist()), []).append(full_name(name, side))
    return tuple((names[0], other) for names in found.values() for other in names[1:])


def _alike(sides: Sequence[tuple[int, Patch]], step: int) -> bool:
    """Whether the functions of two sides with the same control points are the same: degree, knots,
    ratio of the weights.
    """
    splines, weights = [], []
    for i, patch in sides:
        splines.append(patch.lines[i % 2])
        weights.append(
            np.ones(splines[-1].count) if patch.weights is None else side_rows(patch.weights)[i]
        )
    knots = [(s.knots - s.knots[0]) / np.ptp(s.knots) for s in splines]
    knots[1] = knots[1] if step == 1 else 1.0 - knots[1][::-1]
    ratio = weights[0] / weights[1][::step]
    same = len(knots[0]) == len(knots[1]) and bool(np.abs(knots[0] - knots[1]).max() <= SAME)
    return same and bool(np.ptp(ratio) <= SAME * ratio.max())


# ----------------------------------------------------------------------------------------------------- shapes, refinement
@blamed
def refine(
    patch: Patch,
    control: ArrayLike,
    cells1: int = 1,
    cells2: int = 1,
    degree: int | None = None,
    continuity: int | None = None,
) -> tuple[Patch, Floats]:
    """The same surface with both degrees raised to `degree`, then every span split into equal ones
    of the given continuity.

    `control` (n1, n2, c) becomes the control points of the refined patch. The continuity across new
    knots is degree - 1 unless given; across old ones it stays.
    """
    array = _control({"": patch}, {"": control})[""]
    if patch.weights is not None:
        array = np.concatenate([array * patch.weights[..., None], patch.weights[..., None]], axis=2)
    splines = []
    for axis, (spline, cells) in enumerate(zip(patch.lines, (cells1, cells2), strict=True)):
        moved = np.moveaxis(array, axis, 0)
        spline, flat = _refine_line(
            spline, moved.reshape(len(moved), -1), cells, degree, continuity
        )
        array = np.moveaxis(flat.reshape(-1, *moved.shape[1:]), 0, axis)
        splines.append(spline)
    one, two = splines
    weights = None if patch.weights is None else array[..., -1]
    points = array if weights is None else array[..., :-1] / weights[..., None]
    return Patch(one.knots, two.knots, one.degree, two.degree, weights), points


def _refine_line(
    spline: line.BSpline,
    coefficients: Floats,
    cells: int,
    degree: int | None,
    continuity: int | None,
) -> tuple[line.BSpline, Floats]:
    if not isinstance(cells, int | np.integer) or cells < 1:
        raise InputError(
            say("nurbs.refine", "a whole number of cells of at least 1", cells, "1 keeps the spans")
        )
    spline, coefficients = line.elevate(
        spline, coefficients, (degree or spline.degree) - spline.degree
    )
    smooth = spline.degree - 1 if continuity is None else continuity
    if not 0 <= smooth < spline.degree:
        raise InputError(
            say(
                "nurbs.refine",
                f"a continuity from 0 to degree - 1 = {spline.degree - 1}",
                smooth,
                "raise the degree",
            )
        )
    ends = line.breaks(spline)
    inner = (ends[:-1, None] + np.diff(ends)[:, None] * np.arange(1, cells) / cells).ravel()
    return line.insert_knots(spline, coefficients, np.repeat(inner, spline.degree - smooth))


@blamed
def rectangle(
    length: float,
    width: float,
    cells1: int,
    cells2: int,
    degree: int = 3,
    continuity: int | None = None,
    origin: Sequence[float] = (0.0, 0.0, 0.0),
) -> tuple[Patch, Floats]:
    """A rectangle, xi1 along x, xi2 along y; its corner `origin` of 2 or 3 coordinates says how
    many control points have.

        >>> from fmbs_skfem.shapes import nurbs
        >>> sheet = nurbs.surface(*nurbs.rectangle(2.0, 1.0, cells1=4, cells2=2))
        >>> sheet.count, sorted(sheet.edges)
        (35, ['xi1_max', 'xi1_min', 'xi2_max', 'xi2_min'])
    """
    if not (np.isfinite([length, width]).all() and min(length, width) > 0.0):
        raise InputError(
            say("nurbs.rectangle", "positive length and width [m]", f"{length}, {width}")
        )
    control = np.tile(np.asarray(origin, dtype=float), (2, 2, 1))
    control[1, :, 0] += length
    control[:, 1, 1] += width
    return refine(Patch(_OPEN, _OPEN, 1, 1), control, cells1, cells2, degree, continuity)


@blamed
def cylinder_panel(
    radius: float,
    length: float,
    angle0: float,
    angle1: float,
    cells1: int,
    cells2: int,
    degree: int = 3,
    continuity: int | None = None,
) -> tuple[Patch, Floats]:
    """A part of a circular cylinder about the y-axis, exactly, with its normal outwards.

        r = (radius sin phi, y, radius cos phi)

    xi1 runs from phi = angle0 to angle1 [rad], less than half a turn (weights 1, cos((angle1 -
    angle0) / 2), 1), xi2 along y.
    """
    if not (np.isfinite([radius, length]).all() and min(radius, length) > 0.0):
        raise InputError(
            say("nurbs.cylinder_panel", "positive radius and length [m]", f"{radius}, {length}")
        )
    if not 0.0 < angle1 - angle0 < np.pi:
        remedy = "join several panels for a larger one"
        raise InputError(
            say(
                "nurbs.cylinder_panel",
                "an opening angle between 0 and pi",
                f"{angle1 - angle0:g} rad",
                remedy,
            )
        )
    if degree < 2:
        raise InputError(
            say(
                "nurbs.cylinder_panel",
                "a degree of at least 2",
                degree,
                "an arc is a quadratic NURBS",
            )
        )
    half = 0.5 * (angle1 - angle0)
    phi = np.array([angle0, angle0 + half, angle1])
    radii = radius / np.cos([0.0, half, 0.0])
    control = np.zeros((3, 2, 3))
    control[..., 0], control[..., 2] = (
        (radii * np.sin(phi))[:, None],
        (radii * np.cos(phi))[:, None],
    )
    control[:, 1, 1] = length
    weights = np.repeat([[1.0], [np.cos(half)], [1.0]], 2, axis=1)
    patch = Patch(np.repeat([0.0, 1.0], 3), _OPEN, 2, 1, weights)
    return refine(patch, control, cells1, cells2, degree, continuity)


_OPEN = np.array([0.0, 0.0, 1.0, 1.0])


def place(shape: Surface, xi1: float, xi2: float, patch: str = "") -> tuple[int, float, float]:
    """Cell and parent coordinates of the knot parameters (xi1, xi2) of a patch: a named point of a
    surface.

    InputError for an unknown patch and for parameters outside of its knots.
    """
    names = list(shape.space.patches)
    if patch not in names:
        raise InputError(
            say("nurbs.place", f"a patch of {names}", f"'{patch}'{closest(patch, names)}")
        )
    begin = sum(
        int(np.prod(shape.space.patches[name].cells)) for name in names[: names.index(patch)]
    )
    spans, fractions = [], []
    for i, (spline, xi) in enumerate(
        zip(shape.space.patches[patch].lines, (xi1, xi2), strict=True)
    ):
        ends = line.breaks(spline)
        inside = float(table.inside(f"nurbs.place, xi{i + 1}", xi, ends[0], ends[-1])[0])
        span = min(int(np.searchsorted(ends, inside, side="right")) - 1, len(ends) - 2)
        spans.append(span)
        fractions.append((inside - ends[span]) / (ends[span + 1] - ends[span]))
    return (
        begin + spans[0] + shape.space.patches[patch].cells[0] * spans[1],
        fractions[0],
        fractions[1],
    )
