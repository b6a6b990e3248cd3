"""Bodies with other numbers: what is proportional to a power of one is scaled, and nothing is made
anew, see `bodies.values`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..bodies.body import Body, LinearElasticity, ShapePoints
from ..bodies.values import MASS, SIZE, SPRINGS
from ..core.errors import InputError, closest, listed, require_positive, say


def rescale(part: Body, numbers: Mapping[str, float]) -> Body:
    """The body with other numbers by name [SI], full or reduced: rows of its section, mass and
    sizes are scaled.

    InputError for names that it does not have, numbers that are not positive, and those so far from
    the old ones that a factor is no finite positive number. A body without cells stays as it is.
    """
    factors = dict[str, float]()
    known = dict(part.values)
    for name, number in numbers.items():
        where = f"body '{part.name}'"
        require_positive(where, **{name: number})
        if name not in known:
            remedy = "train the part of a body that is made of it" if not known else ""
            expected = f"a number that scales it ({listed(known, name, 'none is known')})"
            raise InputError(say(where, expected, f"'{name}'", remedy) + closest(name, known))
        trained = known[name].number
        for row, power in known[name].powers.items():
            factors[row] = factors.get(row, 1.0) * raised(number / trained, power)
            if not 0.0 < factors[row] < math.inf:
                expected = f"a number like that of its training, {trained:g}"
                raise InputError(
                    say(f"{where}: {name}", expected, f"{number:g}", "look at its unit")
                )
        known[name] = replace(known[name], number=float(number))
    if not factors or part.cells is None:
        return part
    rows = np.array([factors.get(row, 1.0) for row in part.cells.law.section])[:, None, None]
    return replace(
        part,
        mass=factors.get(MASS, 1.0) * part.mass,
        stiffness=None if part.stiffness is None else factors.get(SPRINGS, 1.0) * part.stiffness,
        cells=replace(part.cells, section=rows * part.cells.section),
        shapes=None if part.shapes is None else of_points(part.shapes, rows),
        linear=None
        if part.linear is None
        else of_linear(part.linear, float(rows.flat[0]), factors.get(MASS, 1.0)),
        # a section that changes along the line has no numbers but those of its material
        profile=part.profile
        and replace(part.profile, stiffness=factors.get("EA", 1.0) * part.profile.stiffness),
        fibre_modulus=known["young_modulus"].number
        if part.fibre_modulus and "young_modulus" in known
        else part.fibre_modulus,
        radius=factors.get(SIZE, 1.0) * part.radius,
        thickness=factors.get(SIZE, 1.0) * part.thickness,
        values=known,
        spare=part.spare and rescale(part.spare, numbers),
    )


def of_linear(linear: LinearElasticity, factor: float, mass: float) -> LinearElasticity:
    """A stiffness times a factor, of a body whose mass has another one."""
    slowest = linear.slowest * math.sqrt(factor / mass)
    return replace(linear, stiffness=factor * linear.stiffness, slowest=slowest)


def raised(factor: float, power: float) -> float:
    """A power of a number; infinity where it is too large, as a product of floats has it."""
    with np.errstate(over="ignore", under="ignore"):
        return float(np.float64(factor) ** power)


def of_points(points: ShapePoints, factors: np.ndarray) -> ShapePoints:
    """Points with the rows of their section times factors (i, 1, 1)."""
    missing = points.missing and replace(points.missing, section=factors * points.missing.section)
    return replace(points, section=factors * points.section, missing=missing)
