r"""Parameters with their ranges, and sets of points in the box that they span.

    linear    mu = (1 - u) low + u high          u in [0, 1]
    log       mu = low^(1 - u) high^u

Points are arrays (k, d) of values in SI units with a column for every parameter, in their order.

Sets: full grids, Latin hypercubes (M. McKay, R. Beckman, W. Conover, Technometrics 21, 1979, doi
10.1080/00401706.1979.10489755) and scrambled Sobol sequences (A. Owen, J. Complexity 14, 1998, doi
10.1006/jcom.1998.0487), both by scipy.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InputError, closest, say
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..core.values.arrays import finite
from ..core.values.ranges import Parameter, Scale

NEAR = 1e-9  #: part of the box that is round-off


def check(parameters: Sequence[Parameter]) -> None:
    """At least one parameter, every name once.

    InputError for none, and for a name that stands twice.
    """
    names = [parameter.name for parameter in parameters]
    if not names or len(set(names)) < len(names):
        raise InputError(
            say("parameters", "one or more, every name once", ", ".join(names) or "none")
        )


def to_box(parameters: Sequence[Parameter], points: ArrayLike) -> np.ndarray:
    """Values (k, d) [SI] as points u (k, d) of the unit box; those outside of the ranges lie
    outside of it.

        u = (mu - low) / (high - low)    or    log(mu / low) / log(high / low)

    the latter on a logarithmic scale. InputError as of `table`.
    """
    columns = []
    for parameter, column in zip(parameters, table(parameters, points).T, strict=True):
        if parameter.scale is Scale.LOG:
            columns.append(
                np.log(column / parameter.low) / math.log(parameter.high / parameter.low)
            )
        else:
            columns.append((column - parameter.low) / (parameter.high - parameter.low))
    return np.stack(columns, axis=1)


def from_box(parameters: Sequence[Parameter], unit: ArrayLike) -> np.ndarray:
    """Values (k, d) [SI] of points u (k, d) in the unit box; its faces are the ends of the ranges
    to the bit.

        mu = (1 - u) low + u high    or    low^(1 - u) high^u

    the latter on a logarithmic scale; d columns, one a parameter. InputError as of `table`.
    """
    columns = []
    for parameter, u in zip(parameters, table(parameters, unit).T, strict=True):
        if parameter.scale is Scale.LOG:
            columns.append(parameter.low ** (1.0 - u) * parameter.high**u)
        else:
            columns.append((1.0 - u) * parameter.low + u * parameter.high)
    return np.stack(columns, axis=1)


def table(parameters: Sequence[Parameter], points: ArrayLike) -> np.ndarray:
    """Points as an array (k, d); InputError for other shapes and numbers that are not finite.

    d is the number of parameters; there may be no points, (0, d).
    """
    check(parameters)
    d = len(parameters)
    names = ", ".join(parameter.name for parameter in parameters)
    return finite(
        points, "points", f"finite numbers in {d} column(s) ({names})", None, d, empty=True
    )


def grid(
    parameters: Sequence[Parameter], counts: int | Sequence[int] | Mapping[str, int]
) -> np.ndarray:
    """All combinations (k, d) of equally spaced values, ends included (one value: the middle); the
    last parameter changes first.

    `counts` is a number of values for all parameters, one a parameter in their order, or by name.
    """
    check(parameters)
    if isinstance(counts, Mapping):
        known(parameters, counts, complete=True)
        counts = [counts[parameter.name] for parameter in parameters]
    numbers = [counts] * len(parameters) if isinstance(counts, int) else list(counts)
    if len(numbers) != len(parameters) or min(numbers) < 1:
        raise InputError(say("grid", f"{len(parameters)} number(s) of values from 1 on", numbers))
    axes = [np.linspace(0.0, 1.0, n) if n > 1 else np.array([0.5]) for n in numbers]
    return from_box(
        parameters, np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    )


def latin_hypercube(parameters: Sequence[Parameter], count: int, seed: int = 0) -> np.ndarray:
    """Random points (count, d), one in each of `count` slices of every range.

    d parameters; slices are equal on the scale of each. The same `seed` gives the same points.
    InputError for a count below 1.

    Source: McKay, Beckman, Conover 1979, doi 10.1080/00401706.1979.10489755.
    """
    from scipy.stats import qmc

    check(parameters)
    return from_box(
        parameters,
        qmc.LatinHypercube(len(parameters), rng=seed).random(check_count("latin_hypercube", count)),
    )


def sobol(parameters: Sequence[Parameter], count: int, seed: int = 0) -> np.ndarray:
    """The first points (count, d) of a scrambled Sobol sequence; a larger count of the same seed
    begins with the same points.

    InputError for a count below 1. Source: Owen 1998, doi 10.1006/jcom.1998.0487.
    """
    from scipy.stats import qmc

    check(parameters)
    power = (check_count("sobol", count) - 1).bit_length()
    return from_box(
        parameters, qmc.Sobol(len(parameters), scramble=True, rng=seed).random_base2(power)[:count]
    )


def check_count(where: str, count: int) -> int:
    """A number of points.

    `where` names the caller in the InputError for a number below 1.
    """
    if count < 1:
        raise InputError(say(where, "a number of points from 1 on", count))
    return count


def listed(parameters: Sequence[Parameter], rows: Iterable[object]) -> np.ndarray:
    """Points (k, d) given one by one: mappings of names, sequences in the order of the parameters,
    or numbers of one parameter.

    InputError for a row with other names or another number of values.
    """
    found = []
    for row in rows:
        values = (
            row_of(parameters, row)
            if isinstance(row, Mapping)
            else np.atleast_1d(np.asarray(row, dtype=float))
        )
        if values.shape != (len(parameters),):
            raise InputError(say("points", f"{len(parameters)} value(s) in every row", f"{row}"))
        found.append(values)
    return table(parameters, np.reshape(found, (-1, len(parameters))))


def named(parameters: Sequence[Parameter], row: ArrayLike) -> dict[str, float]:
    """Values of one point by name.

    `row` (d,) has the values [SI] in the order of the parameters; InputError for another number of
    them.
    """
    values = table(parameters, np.atleast_2d(np.asarray(row, dtype=float)))[0]
    return {
        parameter.name: float(value) for parameter, value in zip(parameters, values, strict=True)
    }


def text(parameters: Sequence[Parameter], values: Mapping[str, float]) -> str:
    """One point as people read it, `E = 7e+10 Pa, d = 0.008 m`."""
    row = zip(parameters, row_of(parameters, values), strict=True)
    return ", ".join(
        f"{parameter.name} = {value:.6g} {parameter.unit}".strip() for parameter, value in row
    )


def described(parameters: Sequence[Parameter]) -> dict[str, dict[str, Any]]:
    """Ranges, nominal values and units by name, as plain numbers and texts.

    For reports and files: `low`, `high`, `nominal`, `unit` and `scale` of each.
    """
    return {
        p.name: {
            "low": p.low,
            "high": p.high,
            "nominal": p.nominal,
            "unit": p.unit,
            "scale": p.scale.value,
        }
        for p in parameters
    }


def row_of(parameters: Sequence[Parameter], values: Mapping[str, float]) -> np.ndarray:
    """Values (d,) in the order of the parameters; every parameter is named once and nothing else
    is.

    `values` by name, in SI units. InputError for an unknown name, a missing one, and for what is no
    finite number, or not positive on a logarithmic scale.
    """
    check(parameters)
    known(parameters, values, complete=True)
    for parameter in parameters:
        value: Any = values[parameter.name]
        if (
            not isinstance(value, int | float | np.number)
            or not math.isfinite(value)
            or (parameter.scale is Scale.LOG and value <= 0.0)
        ):
            expected = "a positive number" if parameter.scale is Scale.LOG else "a finite number"
            raise InputError(say(f"parameter '{parameter.name}'", expected, repr(value)))
    return np.array([float(values[parameter.name]) for parameter in parameters])


def completed(parameters: Sequence[Parameter], values: Mapping[str, float]) -> dict[str, float]:
    """Values of all parameters: the given ones, and nominal ones where none is given.

    InputError for a name that is no parameter.
    """
    known(parameters, values)
    return {parameter.name: parameter.nominal for parameter in parameters} | dict(values)


def require_sign(parameter: Parameter, value: float, where: str) -> None:
    """InputError where a number that is of one sign in all of its range, as a stiffness or a mass,
    is of another one.
    """
    if parameter.low * parameter.high > 0.0 and not value * parameter.low > 0.0:
        sign = "positive" if parameter.low > 0.0 else "negative"
        ranged = f"as all of its range, {parameter.low:g} to {parameter.high:g} {parameter.unit}"
        raise InputError(say(where, f"a {sign} number, {ranged}", f"{value:g}"))


def known(parameters: Sequence[Parameter], names: Iterable[str], complete: bool = False) -> None:
    """Refuse names that are no parameters; with `complete` also parameters without a name."""
    names = list(names)
    mine = [parameter.name for parameter in parameters]
    for name in names:
        if name not in mine:
            raise InputError(
                say("parameters", f"one of {', '.join(mine)}", f"'{name}'{closest(name, mine)}")
            )
    missing = [name for name in mine if name not in names]
    if complete and missing:
        raise InputError(
            say(
                "parameters",
                f"a value for each of {', '.join(mine)}",
                f"none for {', '.join(missing)}",
            )
        )


def outside(parameters: Sequence[Parameter], values: Mapping[str, float]) -> tuple[str, ...]:
    """Names of the parameters whose value lies outside of their range.

    InputError as of `row_of`; round-off at an end of a range is inside.
    """
    unit = to_box(parameters, [row_of(parameters, values)])[0]
    return tuple(
        p.name for p, u in zip(parameters, unit, strict=True) if not -NEAR <= u <= 1.0 + NEAR
    )


# ------------------------------------------------------------------------------------------------------- where runs may be made
@dataclass(frozen=True)
class Search:
    """Where runs may be made.

    Rows of `candidates` [SI] are where full runs may be made; `samples` and `first` are their
    numbers.
    """

    candidates: np.ndarray  #: (c, d) values of the parameters
    samples: tuple[int, ...]  #: candidates with a reduced run in every iteration
    first: int  #: candidate of the first full run


@checked
def search(
    parameters: Sequence[Parameter],
    candidates: ArrayLike,
    samples: ArrayLike,
    first: ArrayLike | None = None,
) -> Search:
    """Candidates (c, d), the samples (k, d) among them and the first point (d,), by default the
    candidate nearest to the middle.

    Samples and first point that are no candidates become some.
    """
    rows = table(parameters, candidates)
    wanted = table(parameters, samples)
    start = (
        None
        if first is None
        else table(parameters, np.reshape(np.asarray(first, dtype=float), (1, -1)))
    )
    for extra in (wanted, start):
        if extra is not None:
            away = distances(parameters, rows, extra).min(axis=1)
            rows = np.concatenate([rows, extra[away > NEAR]])
    if start is None:
        middle = np.full((1, len(parameters)), 0.5)
        start = rows[[int(np.argmin(np.linalg.norm(to_box(parameters, rows) - middle, axis=1)))]]
    numbers = distances(parameters, rows, wanted).argmin(axis=1)
    return Search(
        rows,
        tuple(dict.fromkeys(int(k) for k in numbers)),
        int(distances(parameters, rows, start).argmin(axis=1)[0]),
    )


def distances(parameters: Sequence[Parameter], rows: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distances (k, c) in the unit box."""
    from scipy.spatial.distance import cdist

    return np.asarray(cdist(to_box(parameters, points), to_box(parameters, rows)))
