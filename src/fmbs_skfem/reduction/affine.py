r"""Cases whose numbers are polynomials of the parameters: a new value of a parameter assembles
nothing.

    a(mu) = sum_t P_t(mu) a(mu_t),    P_t(mu) = prod_p l_{t_p}(mu_p),    l_j(x) = prod_{k != j} (x - x_k) / (x_j - x_k)

for every array and every number of a case that depends on parameters, each with degrees of its own:
Young's modulus, density and loads are degree 1, the diameter of a beam 2 and 4, Poisson's ratio is
smooth. mu_t is the tensor grid of these degrees. The nodes of a parameter are the nominal value
x_0, then Leja points, each of which maximises prod_k |u - u_k| over the range on its scale: degree
n takes the first n + 1 of them, so that arrays of different degrees share samples. Numbers that do
not change are those of the nominal case to the bit; of the a(mu_t) only as many are stored as are
independent. A parameter on a logarithmic scale enters as mu, or as log mu where that needs a lower
degree.

Degrees are found along the axes through the nominal case and verified at hold-out points. An error
counts relative to the number itself, down to the round-off of its row, or to what round-off of the
geometry makes of it (`family_samples`).

Leja points: A. Chkifa, A. Cohen, C. Schwab, Found. Comput. Math. 14 (2014) 601-633, doi
10.1007/s10208-013-9154-z.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np
import scipy.linalg

from ..core.errors import InputError, say
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.storage.validation import Indices, Reals
from ..core.values.ranges import Parameter, Scale
from ..systems.prepared import alike, prepare
from . import cases, family_samples
from . import parameters as boxes
from .cases import Case, Family, Place
from .family_samples import HARD, ROUND, FamilySamples, sample, sizes_of, stack

CHECKS = 2  #: nodes beyond those of a degree at which it is checked
FINE = 2000  #: candidates for a Leja point
MANY = 5000  #: most cases that are made for one leaf


@storable
@dataclass(frozen=True)
class Order:
    """How one leaf depends on the parameters.

    For every parameter a degree, and whether the polynomial is one of log mu in place of mu.
    """

    degrees: tuple[int, ...]  #: by parameter
    logarithmic: tuple[bool, ...]  #: whether the polynomial is one of log mu


@storable
@dataclass(frozen=True)
class Varying:
    """The numbers of one leaf that depend on parameters.

        a(mu)[positions] = P(mu)^T mixture values

    with P (t,) the Lagrange polynomials of the t nodes of its grid, `values` (q, n).
    """

    place: Place
    order: Order
    positions: Annotated[np.ndarray, Indices("n")]  #: in the order of the memory
    values: Annotated[np.ndarray, Reals("q n")]  #: at some nodes of the grid
    #: the values at all nodes, of which the last parameter changes first, are mixture @ values
    mixture: Annotated[np.ndarray, Reals("t q")]


@storable
@dataclass(frozen=True)
class ParametricCase:
    """A family whose cases are polynomials of the parameters: nothing is assembled for another
    value.

    `rom(values)` is the case at other values, in milliseconds: no mesh, no assembly and no
    projection are needed. Numbers that do not depend on parameters are those of the nominal case to
    the bit.
    """

    parameters: tuple[Parameter, ...]
    nominal: Case  #: sparse arrays with all places that any sample fills
    nodes: Annotated[tuple[np.ndarray, ...], Reals("*")]  #: by parameter
    varying: tuple[Varying, ...]
    evaluations: int  #: cases that were made
    error: (
        float  #: at the hold-out points, the largest of a number relative to the largest in its row
    )

    def __call__(self, values: Mapping[str, float]) -> Case:
        """The case sum_t P_t(mu) a(mu_t) at a value [SI] for every parameter; outside of the ranges
        the polynomials go on.

        InputError where a name is no parameter, a parameter has no value, or a value is no finite
        number.
        """
        row = boxes.row_of(self.parameters, values)
        weights: dict[Order, np.ndarray] = {}
        tree: dict[str | int, Any] = {}
        for part in self.varying:
            if part.order not in weights:
                weights[part.order] = lagrange(self.nodes, part.order, row)
            numbers = weights[part.order] @ part.mixture @ part.values
            cases.insert(
                tree,
                part.place,
                cases.fill(cases.leaf_at(self.nominal, part.place), part.positions, numbers),
            )
        case: Case = cases.rebuild(self.nominal, tree)
        alike(prepare(self.nominal.system), case.system)
        return case


def degrees(model: ParametricCase) -> dict[str, int]:
    """The highest degree of any number in every parameter.

    By name of the parameter; 0 where nothing depends on it.
    """
    highest = [
        max((part.order.degrees[p] for part in model.varying), default=0)
        for p in range(len(model.parameters))
    ]
    return {
        parameter.name: degree for parameter, degree in zip(model.parameters, highest, strict=True)
    }


def fit(
    family: Family, parameters: Sequence[Parameter], tolerance: float = 1e-11, max_degree: int = 24
) -> ParametricCase:
    """The polynomials of a family, each of degree `max_degree` or less in every parameter.

    They hold at all hold-out points to `tolerance`, relative to a number and down to the round-off
    of its row. Where numbers are no polynomials to that, the round-off of the geometry is measured
    and they are tried again. InputError names the parameter where a dependence is not smooth or the
    structure of the case changes.
    """
    boxes.check(parameters)
    nodes = tuple(nodes_of(parameter, max_degree + 1 + CHECKS) for parameter in parameters)
    known = family_samples.sample_nominal(family, parameters, nodes)
    try:
        return fit_samples(known, tolerance, max_degree)
    except InputError as problem:
        try:
            again = family_samples.measure_noise(known, inner_points(known.parameters))
        except InputError:
            raise problem from None
        return fit_samples(again, tolerance, max_degree)


def fit_samples(known: FamilySamples, tolerance: float, max_degree: int) -> ParametricCase:
    """The polynomials of samples.

    Where the hold-out points show what the axes through the nominal case do not, degrees are looked
    for through those points too.
    """
    orders = scan_axes(known, family_samples.nominal_row(known.parameters), tolerance, max_degree)
    holdout = holdout_points(known.parameters)
    while True:
        place, point, excess, error = worst_error(known, orders, holdout, tolerance)
        if excess <= 1.0:
            return tabulate(known, orders, error)
        wider = widen(orders, scan_axes(known, holdout[point], tolerance, max_degree))
        if wider == orders:
            values = boxes.text(known.parameters, boxes.named(known.parameters, holdout[point]))
            expected = f"polynomials that hold to {tolerance:.0e}"
            raise InputError(
                say(
                    f"{cases.label(place)} at {values}", expected, f"{excess * tolerance:.1e}", HARD
                )
            )
        orders = wider


def nodes_of(parameter: Parameter, count: int) -> np.ndarray:
    """The nominal value and Leja points after it (j,)."""
    fine = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, FINE + 1))
    unit = [float(boxes.to_box((parameter,), [[parameter.nominal]])[0, 0])]
    product = np.abs(fine - unit[0])
    for _ in range(count - 1):
        unit.append(float(fine[product.argmax()]))
        product *= np.abs(fine - unit[-1])
    nodes = boxes.from_box((parameter,), np.array(unit)[:, None])[:, 0]
    nodes[0] = parameter.nominal
    return nodes


def holdout_points(parameters: Sequence[Parameter]) -> np.ndarray:
    """Both corners of the box, for the relative accuracy over wide ranges, and random points (k,
    d).
    """
    corners = [
        [parameter.low for parameter in parameters],
        [parameter.high for parameter in parameters],
    ]
    return np.concatenate([inner_points(parameters), corners])


def inner_points(parameters: Sequence[Parameter]) -> np.ndarray:
    """Random points (d + 1, d) inside the box of d parameters, in SI units."""
    return boxes.latin_hypercube(parameters, len(parameters) + 1, seed=1)


def misfit(
    weights: np.ndarray,
    values: np.ndarray,
    sizes: np.ndarray,
    got: np.ndarray,
    size: np.ndarray,
    tolerance: float,
) -> tuple[float, float]:
    """Largest error of weights (q,) @ values (q, n) against sampled numbers `got` (n,): over what
    is allowed, and over the row.

    `sizes` (q, n) and `size` (n,) are those of the rows in which the numbers stand.
    """
    error = np.abs(weights @ values - got)
    allowed = tolerance * np.abs(got) + ROUND * (np.abs(weights) @ sizes + size)
    wrong = ~((error == 0.0) | np.isnan(got) & np.isnan(values).all(axis=0))
    if not wrong.any():
        return 0.0, 0.0
    excess, relative = (
        error[wrong] / allowed[wrong],
        error[wrong] / np.maximum(size[wrong], np.finfo(float).tiny),
    )
    return float(np.nan_to_num(excess, nan=np.inf).max()), float(
        np.nan_to_num(relative, nan=np.inf).max()
    )


def basis(nodes: np.ndarray, x: float, logarithmic: bool) -> np.ndarray:
    """Lagrange polynomials of all nodes (j,) at x.

        l_j(x) = prod_{i != j} (x - x_i) / (x_j - x_i)

    of one parameter, or of its logarithm.
    """
    if logarithmic:
        nodes = np.log(nodes)
        x = float(np.log(x))
    apart = nodes[:, None] - nodes[None, :]
    ratio = np.divide(
        x - nodes[None, :], apart, out=np.ones_like(apart), where=~np.eye(len(nodes), dtype=bool)
    )
    return np.asarray(ratio.prod(axis=1))


def lagrange(nodes: Sequence[np.ndarray], order: Order, row: np.ndarray) -> np.ndarray:
    """Lagrange polynomials P (t,) of all nodes of the grid at values x (d,).

        P_t = prod_d l_j(x_d),    t = (j_1, .., j_d)

    see `basis`, by the nodes of every parameter.
    """
    weights = np.ones(1)
    for points, degree, logarithmic, x in zip(
        nodes, order.degrees, order.logarithmic, row, strict=True
    ):
        if degree:
            weights = np.outer(weights, basis(points[: degree + 1], float(x), logarithmic)).ravel()
    return weights


def grid_of(known: FamilySamples, order: Order) -> np.ndarray:
    """Values (t, d) at the nodes of a tensor grid; the first are the nominal ones.

    InputError where they are more than MANY.
    """
    count = math.prod(degree + 1 for degree in order.degrees)
    if count > MANY:
        raise InputError(
            say(
                "polynomials of the parameters",
                f"at most {MANY} cases to be made",
                f"{count}",
                HARD,
            )
        )
    axes = [nodes[: degree + 1] for nodes, degree in zip(known.nodes, order.degrees, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def scan_axes(
    known: FamilySamples, row: np.ndarray, tolerance: float, max_degree: int
) -> dict[Place, Order]:
    """Degrees of all leaves along the axes through values (d,)."""
    found: dict[Place, list[tuple[int, bool]]] = {}
    for p in range(len(known.parameters)):
        for place, axis in scan(known, p, row, tolerance, max_degree).items():
            found.setdefault(place, [(0, False)] * len(known.parameters))[p] = axis
    return {place: Order(*map(tuple, zip(*axes, strict=True))) for place, axes in found.items()}


def scan(
    known: FamilySamples, p: int, row: np.ndarray, tolerance: float, max_degree: int
) -> dict[Place, tuple[int, bool]]:
    """Degree in parameter p, and whether in its logarithm, of all leaves that depend on it along
    its axis through values (d,).
    """
    rows = np.tile(row, (len(known.nodes[p]), 1))
    rows[:, p] = known.nodes[p]
    variables = (False, True) if known.parameters[p].scale is Scale.LOG else (False,)
    axes: dict[Place, tuple[int, bool] | None] = {}
    lowest: dict[Place, int] = {}  # what has not held at fewer points does not hold at more
    for count in range(1 + CHECKS, max_degree + 2 + CHECKS):
        seen = [sample(known, point) for point in rows[:count]]
        places = list(dict.fromkeys(place for leaves in seen for place in leaves))
        unsure = [place for place in places if axes.get(place) is None]
        for some in (unsure, [place for place in places if place not in unsure]):
            for place in some:
                axes[place] = axis_of(
                    known, p, place, rows[:count], variables, tolerance, lowest.get(place, 0)
                )
                lowest[place] = count - CHECKS if (axis := axes[place]) is None else axis[0]
            if None in axes.values():
                break
        else:
            return {place: axis for place, axis in axes.items() if axis is not None and axis[0] > 0}
    open_ = ", ".join(cases.label(place) for place, axis in axes.items() if axis is None)
    expected = (
        f"numbers that are polynomials of it of degree {max_degree} or less, to {tolerance:.0e}"
    )
    raise InputError(
        say(f"parameter '{known.parameters[p].name}'", expected, f"others ({open_})", HARD)
    )


def axis_of(
    known: FamilySamples,
    p: int,
    place: Place,
    rows: np.ndarray,
    variables: Sequence[bool],
    tolerance: float,
    lowest: int,
) -> tuple[int, bool] | None:
    """The degree of a leaf in parameter p from `lowest` on that holds at all further points of an
    axis (k, d), at two at least.
    """
    base, values = stack(known, place, rows)
    sizes = sizes_of(known, place, base, values)
    moving = (values != values[0]).any(axis=0)
    values = values[:, moving]
    sizes = sizes[:, moving]
    nodes = rows[:, p]
    for degree in range(lowest, len(rows) - CHECKS):
        used = slice(degree + 1)
        for logarithmic in variables if degree else (False,):
            weights = (basis(nodes[used], float(x), logarithmic) for x in nodes[degree + 1 :])
            further = zip(weights, values[degree + 1 :], sizes[degree + 1 :], strict=True)
            if all(
                misfit(w, values[used], sizes[used], got, size, tolerance)[0] <= 1.0
                for w, got, size in further
            ):
                return degree, logarithmic
    return None


def widen(one: Mapping[Place, Order], two: Mapping[Place, Order]) -> dict[Place, Order]:
    """The higher degree in every parameter, with its variable."""
    merged = dict(one)
    for place, order in two.items():
        axes = list(zip(order.degrees, order.logarithmic, strict=True))
        if place in one:
            axes = list(
                map(max, axes, zip(one[place].degrees, one[place].logarithmic, strict=True))
            )
        merged[place] = Order(*map(tuple, zip(*axes, strict=True)))
    return merged


def worst_error(
    known: FamilySamples, orders: Mapping[Place, Order], holdout: np.ndarray, tolerance: float
) -> tuple[Place, int, float, float]:
    """Leaf and number of the hold-out point (k, d) of the largest error over what is allowed, and
    the largest of all over a row.
    """
    constant = Order((0,) * len(known.parameters), (False,) * len(known.parameters))
    worst: tuple[Place, int, float] = ((), 0, 0.0)
    largest = 0.0
    for row in (*holdout, *(node for order in orders.values() for node in grid_of(known, order))):
        sample(known, row)
    for place in dict.fromkeys(place for leaves in known.found.values() for place in leaves):
        order = orders.get(place, constant)
        base, values = stack(known, place, np.concatenate([grid_of(known, order), holdout]))
        sizes = sizes_of(known, place, base, values)
        first = len(values) - len(holdout)
        for k, row in enumerate(holdout):
            weights = lagrange(known.nodes, order, row)
            excess, relative = misfit(
                weights,
                values[:first],
                sizes[:first],
                values[first + k],
                sizes[first + k],
                tolerance,
            )
            largest = max(largest, relative)
            worst = max(worst, (place, k, excess), key=lambda found: found[2])
    return *worst, largest


def decompose_rows(values: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows j (q,) of values (t, n), the first among them, and X (t, q) by which all follow to
    round-off.

        values = X values[j]

    Interpolative decomposition: H. Cheng, Z. Gimbutas, P. Martinsson, V. Rokhlin, SIAM J. Sci.
    Comput. 26 (2005) 1389-1404, doi 10.1137/030602678.
    """
    count = len(values)
    scale = sizes.max(axis=0)
    R = np.asarray(np.linalg.qr((values / np.where(scale > 0.0, scale, 1.0)).T, mode="r"))
    length = np.linalg.norm(R, axis=0)
    length[length == 0.0] = 1.0
    R = R / length
    order = scipy.linalg.qr(R - np.outer(R[:, 0], R[:, 0] @ R), mode="r", pivoting=True)[1]
    order = np.concatenate([[0], order[order != 0]])
    for q in range(1, count):
        rows = order[:q]
        mixture = np.linalg.lstsq(R[:, rows], R, rcond=None)[0].T * (length[:, None] / length[rows])
        mixture[rows] = np.eye(q)
        found = zip(mixture, values, sizes, strict=True)
        if all(
            misfit(weights, values[rows], 0.0 * sizes[rows], got, size, 0.0)[0] <= 1.0
            for weights, got, size in found
        ):
            return rows, mixture
    return np.arange(count), np.eye(count)


def tabulate(known: FamilySamples, orders: Mapping[Place, Order], error: float) -> ParametricCase:
    """The polynomials of all leaves that depend on parameters."""
    tree: dict[str | int, Any] = {}
    varying = []
    for place, order in orders.items():
        base, values = stack(known, place, grid_of(known, order))
        positions = np.flatnonzero((values != values[0]).any(axis=0))
        rows, mixture = decompose_rows(
            values[:, positions], sizes_of(known, place, base, values)[:, positions]
        )
        cases.insert(tree, place, base)
        varying.append(Varying(place, order, positions, values[np.ix_(rows, positions)], mixture))
    highest = [
        max((order.degrees[p] for order in orders.values()), default=0)
        for p in range(len(known.parameters))
    ]
    nodes = tuple(points[: degree + 1] for points, degree in zip(known.nodes, highest, strict=True))
    nominal: Case = cases.rebuild(known.nominal, tree)
    return ParametricCase(known.parameters, nominal, nodes, tuple(varying), len(known.found), error)
