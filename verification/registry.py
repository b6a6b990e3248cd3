"""Cases held against published or exact numbers.

    difference = |value - reference| / max(|reference|, scale),    a quantity holds where difference <= tolerance

    @case("rollup", group="statics", source="Sze, Liu, Lo (2004), doi 10.1016/j.finel.2003.11.001, 3.2")
    def rollup() -> list[Quantity]:
        'A strip is rolled up into a circle by an end moment.'        its first line is the case's line in the page

A case is a function without arguments. Where it takes several meshes or steps, the errors give the
observed order p of e ~ C h^p, the slope of log e over log h.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fmbs_skfem.core.errors import FmbsError, InputError, closest, say
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.storage.records import dataclass

from .plots import Curve, LoadPath

GROUPS = ("statics", "vibration", "dynamics", "rigid", "integrator", "manufactured")


@dataclass(frozen=True)
class CheckedNumber:
    """One number of a case beside its reference."""

    name: str
    reference: float
    value: float
    tolerance: float  #: relative, asserted
    unit: str = ""
    order: float | None = None  #: observed order of convergence
    #: published or exact number | stored figure of this package
    kind: Literal["external", "own"] = "external"
    #: size that the difference is relative to where the reference is smaller, in its unit
    scale: float = 0.0
    #: (mesh size or step, error), largest first, or a path of equilibria; drawn
    curve: Curve | LoadPath = ()

    @property
    def difference(self) -> float:
        """|value - reference| / max(|reference|, scale); inf where it is no number."""
        size = max(abs(self.reference), self.scale)
        gap = abs(self.value - self.reference)
        ratio = gap / size if size else gap
        return ratio if math.isfinite(ratio) else math.inf

    @property
    def holds(self) -> bool:
        return self.difference <= self.tolerance


Function = Callable[[], list[CheckedNumber]]


@dataclass(frozen=True)
class VerificationCase:
    """A problem with a source."""

    name: str
    group: str
    source: str
    about: str  #: one line
    solve: Function


@dataclass(frozen=True)
class Outcome:
    """What a case gave."""

    case: VerificationCase
    quantities: tuple[CheckedNumber, ...]
    seconds: float  #: CPU
    error: str = ""  #: why it gave nothing

    @property
    def holds(self) -> bool:
        return not self.error and all(quantity.holds for quantity in self.quantities)


CASES: dict[str, VerificationCase] = {}

#: published cases that this formulation does not cover: case, source, reason
OUTSIDE = (
    (
        "Cantilever bend of 45 degrees",
        "Bathe, Bolourchi, Int. J. Numer. Meth. Engng 14 (1979) 961-986, doi 10.1002/nme.1620140703",
        "it twists; cables carry no torsion",
    ),
    (
        "Princeton beam experiment",
        "validation case of Kynema, https://github.com/kynema/kynema, and of the ANCF beams of Project Chrono",
        "bending in two directions couples with torsion; sections here have one bending stiffness and no torsion",
    ),
    (
        "Flying rod with rotary inertia",
        "Simo, Vu-Quoc, J. Appl. Mech. 53 (1986) 855-863, doi 10.1115/1.3171871",
        "transverse shear and rotary inertia of 10 kg m; the case flying-rod is the same rod without them",
    ),
    (
        "Pinched cylinder on diaphragms beyond 0.075 of its load",
        "Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, doi 10.1016/j.finel.2003.11.001, 3.6",
        "folds travel over the mesh and catch on its cells: 20 x 20 quartic ones agree up to 0.075 (case pinched-cylinder-large), "
        "are 3 % short at 0.1, and reach 79.4 instead of 83.1 at the full load after 90 s; the table is that of 48 x 48 elements",
    ),
    (
        "Laminated semi-cylinder, layers 0/90/0 and 90/0/90",
        "Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, doi 10.1016/j.finel.2003.11.001, 3.7",
        "layers stretch and bend differently along and across their fibres; a plate here is of one isotropic material (case "
        "semi-cylinder-large)",
    ),
    (
        "Timoshenko beams and Reissner-Mindlin shells",
        "Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, doi 10.1016/j.finel.2003.11.001 (figures with shear)",
        "no transverse shear: cases are held against the thin limit",
    ),
)


def case(name: str, *, group: str, source: str, about: str = "") -> Callable[[Function], Function]:
    """Register a function as the case `name`; `about` or the first line of its docstring says what
    the problem is.
    """
    where = f"case '{name}'"
    if group not in GROUPS:
        raise InputError(say(where, f"one of the groups {', '.join(GROUPS)}", repr(group)))
    if name in CASES:
        raise InputError(say(where, "a name that no other case has", "a second one", "rename it"))

    def register(function: Function) -> Function:
        line = about or " ".join((function.__doc__ or "").strip().split("\n\n")[0].split())
        if not line:
            raise InputError(say(where, "a docstring whose first line states the problem", "none"))
        CASES[name] = VerificationCase(name, group, source, line, function)
        return function

    return register


def find(names: Sequence[str] = (), groups: Sequence[str] = ()) -> list[VerificationCase]:
    """Cases of these names and of these groups, all where both are empty; group by group."""
    for name in names:
        if name not in CASES:
            raise InputError(
                say(
                    "case",
                    "one of the names that `fmbs verify --list` prints",
                    f"'{name}'" + closest(name, CASES),
                )
            )
    for group in groups:
        if group not in GROUPS:
            raise InputError(
                say("group", f"one of {', '.join(GROUPS)}", f"'{group}'" + closest(group, GROUPS))
            )
    wanted = [
        found
        for found in CASES.values()
        if found.name in names or found.group in groups or not (names or groups)
    ]
    return sorted(wanted, key=lambda found: GROUPS.index(found.group))


def run(found: VerificationCase) -> Outcome:
    """Solve a case; a solver that fails is an outcome. Notices (a corner belongs to two edges) say
    nothing new about a case.
    """
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        try:
            quantities = tuple(found.solve())
        except FmbsError as error:
            return Outcome(found, (), time.process_time() - start, str(error))
    return Outcome(found, quantities, time.process_time() - start)


def slope(curve: Curve) -> float:
    """Observed order: d log e / d log h between the two finest of a convergence study."""
    (h0, e0), (h1, e1) = curve[-2:]
    return math.log(e0 / e1) / math.log(h0 / h1)


def pairs(x: Sequence[float] | np.ndarray, y: Sequence[float] | np.ndarray) -> Curve:
    """Points (x, y)."""
    return tuple((float(a), float(b)) for a, b in zip(x, y, strict=True))


def order(
    name: str,
    sizes: Sequence[float],
    errors: Sequence[float] | np.ndarray | Callable[[float], float],
    expected: float,
    tolerance: float,
) -> CheckedNumber:
    """The observed order beside the expected one, with the errors (k,) of the sizes (k,), which
    fall.
    """
    curve = pairs(sizes, [errors(size) for size in sizes] if callable(errors) else errors)
    observed = slope(curve)
    return CheckedNumber(name, expected, observed, tolerance, "", observed, curve=curve)


def refined(
    name: str,
    meshes: Sequence[int],
    error: Callable[[int], float],
    expected: float,
    tolerance: float,
) -> CheckedNumber:
    """The order of an error over meshes of these numbers of cells."""
    return order(
        name,
        [1 / cells for cells in meshes],
        [error(cells) for cells in meshes],
        expected,
        tolerance,
    )


def farthest(
    name: str,
    references: ArrayLike,
    values: ArrayLike,
    tolerance: float,
    unit: str = "",
    kind: Literal["external", "own"] = "external",
    order: float | None = None,
    curve: Curve | LoadPath = (),
    each: bool = False,
) -> CheckedNumber:
    """The entry of a table that is farthest from its reference, relative to the table's largest, or
    with `each` to its own.
    """
    wanted, found = np.broadcast_arrays(
        np.asarray(references, dtype=float), np.asarray(values, dtype=float)
    )
    size = np.abs(wanted) if each else np.full(wanted.shape, float(np.abs(wanted).max()))
    gap = np.abs(found - wanted) / size
    worst = int(np.argmax(np.where(np.isnan(gap), np.inf, gap)))
    scale = float(size.flat[worst])
    return CheckedNumber(
        name,
        float(wanted.flat[worst]),
        float(found.flat[worst]),
        tolerance,
        unit,
        order,
        kind,
        scale,
        curve,
    )
