r"""Numbers of a body in which its energy and mass are monomials: another value scales what there
is, and nothing is made anew.

    circular section:   E A = E pi d^2 / 4,   E I = E pi d^4 / 64,   rho A = rho pi d^2 / 4
    plate:              E t / (1 - nu^2),     E t^3 / (12 (1 - nu^2)),    rho t

A reduced part keeps those of its training, and takes others where it is used.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from ..core.errors import InputError, say
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from .sections import Material, Section

#: of powers, beside rows of sections: M, constant springs, thickness or radius
MASS, SPRINGS, SIZE = (
    "mass",
    "springs",
    "size",
)
EXACT = 1e-12  #: relative distance from a monomial


@storable
@dataclass(frozen=True)
class Value:
    """A number of a body in which its energy and mass are monomials: rows of its section are
    proportional to number^power.
    """

    number: float  #: [SI]
    #: of it in the rows of the section, by name, and in MASS, SPRINGS, SIZE; 0 in what is not there
    powers: dict[str, float]


def monomials(
    make: Callable[[Mapping[str, float]], dict[str, float]], numbers: Mapping[str, float]
) -> dict[str, Value]:
    """Those of some positive numbers in which all that `make` makes of them is a monomial, and not
    all of it the same.

    `make` takes numbers by name and gives rows by name. Each number is doubled and tripled: exact
    powers fit both to 1e-12. Numbers for which `make` raises InputError are left out.
    """
    now = make(numbers)
    found = dict[str, Value]()
    for name, number in numbers.items():
        try:
            double, triple = (make({**numbers, name: k * number}) for k in (2.0, 3.0))
        except InputError:
            continue  # of a section that cannot grow so
        powers = {row: float(np.log2(double[row] / now[row]).round(9)) for row in now}
        exact = all(
            abs(triple[row] / (now[row] * 3.0**power) - 1.0) < EXACT
            for row, power in powers.items()
        )
        if exact and any(powers.values()):
            found[name] = Value(number, {row: power for row, power in powers.items() if power})
    return found


def of_line(section: Section, material: Material | None, dim: int, locks: bool) -> dict[str, Value]:
    """Of a cable: the numbers of its section, Young's modulus and density.

    Where its cubics lock, EA / EI decides on the quadrature: what changes it is not among them, see
    `shapes.locking`. Nor is what makes a section that bends differently about its axes, in space.
    """
    numbers = section, material, dim, locks
    return dict((known_of_line if is_hashable(section) else find_of_line)(*numbers))


def is_hashable(value: object) -> bool:
    """Whether a value may be a key: one that holds a dictionary may not."""
    try:
        hash(value)
    except TypeError:
        return False
    return True


def find_of_line(
    section: Section, material: Material | None, dim: int, locks: bool
) -> dict[str, Value]:
    """As `of_line`."""
    kept: Any = section
    shape = {one.name: getattr(section, one.name) for one in fields(kept)}
    shape = {
        name: float(number)
        for name, number in shape.items()
        if isinstance(number, float | int) and number > 0
    }
    bulk = (
        {}
        if material is None
        else {"young_modulus": material.young_modulus, "density": material.density}
    )

    def make(numbers: Mapping[str, float]) -> dict[str, float]:
        made = (
            None
            if material is None
            else replace(material, **{name: numbers[name] for name in bulk})
        )
        other: Section = replace(kept, **{name: numbers[name] for name in shape})
        if dim == 3 and not other.bends_alike:
            raise InputError(
                say("section", "one of the same bending stiffness about all its axes", other)
            )
        given = other.of_cable(made)
        return {"EA": given.EA, "EI": given.EI, MASS: given.rhoA, SIZE: given.radius}

    found = monomials(make, shape | bulk)
    return {
        name: one
        for name, one in found.items()
        if not locks or one.powers.get("EA", 0) == one.powers.get("EI", 0)
    }


#: other meshes of a line ask for the same
known_of_line = functools.lru_cache(maxsize=64)(find_of_line)


def of_plate(material: Material, thickness: float | np.ndarray) -> dict[str, Value]:
    """Of a plate or shell: Young's modulus [Pa], density [kg/m3] and, where it is one number,
    thickness [m], each with its powers.

        A ~ E t,   B ~ E t^3,   mass ~ rho t,   springs between patches ~ E t^3

    A thickness that differs from cell to cell is not among them.
    """
    even = {"thickness": float(thickness)} if np.ndim(thickness) == 0 else {}

    def make(numbers: Mapping[str, float]) -> dict[str, float]:
        E = numbers["young_modulus"]
        rho = numbers["density"]
        t = numbers.get("thickness", 1.0)
        return {"A": E * t, "B": E * t**3, MASS: rho * t, SPRINGS: E * t**3, SIZE: t}

    return monomials(
        make, {"young_modulus": material.young_modulus, "density": material.density, **even}
    )
