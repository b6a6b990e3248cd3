"""Numbers of a model in C: constants, or polynomials of the parameters, evaluated at the start.

a(mu) = a_0 + sum_q w_q(mu) a_q,    w = P(mu)^T mixture,    P the Lagrange polynomials of `reduction.affine`
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ..core.compiling import structs
from ..core.errors import InputError, say
from ..core.printing.memory import PackedMemory
from ..core.printing.program import array
from ..core.storage.records import dataclass
from ..reduction import cases
from ..reduction.affine import Order, ParametricCase, Varying, lagrange
from ..reduction.cases import Case, Place
from ..systems.system import driving
from .packing import PackedCase
from .text import number, replaced, template

SHARES = 0.35, 0.8  #: of the ranges of parameters, at which arrays are compared
ROUND = 1e-9  #: of the largest number of an array, that is round-off

#: leaves of a system that a step reads; all others are for pictures, or fixed
READ = (
    "elastic",
    "mass",
    "damping",
    "stiffness",
    "probes",
    "constraints",
    "loads",
    "signals",
    "readings",
    "sensors",
    "x0",
    "v0",
)
UNREAD = ("loads", "springs"), ("near",)
#: leaves of a system whose numbers may change while it moves: forces of its laws and loads; inertia,
#: joints and places would change the motion itself. The start is that of a motion alone
TUNABLE = "elastic", "damping", "stiffness", "loads", "signals"
AT_START = "x0", "v0"


@dataclass(frozen=True)
class Numbers:
    """A case, and which of its leaves depend on parameters."""

    case: Case
    model: ParametricCase | None = None

    @property
    def varying(self) -> dict[Place, Varying]:
        """The leaves that the step reads and parameters change."""
        if self.model is None:
            return {}
        return {one.place: one for one in self.model.varying if is_read(one.place)}

    def varies(self, place: Sequence[str | int]) -> bool:
        """Whether a leaf, or one below it, depends on parameters."""
        return any(one[: len(place)] == tuple(place) for one in self.varying)


def is_read(place: Place) -> bool:
    """Whether a step reads a leaf of a case."""
    if place[0] == "scheme":
        return True
    return (
        place[0] == "system"
        and place[1] in READ
        and not any(place[1 : 1 + len(one)] == one for one in UNREAD)
    )


def tunable_of(numbers: Numbers) -> tuple[str, ...]:
    """Names of the parameters that change nothing but forces, and so may change in a motion."""
    if numbers.model is None:
        return ()
    drives = {signal for _, signal in driving(numbers.case.system.constraints)}
    fixed = {
        p
        for part in numbers.varying.values()
        if not may_change(part.place, drives)
        for p, degree in enumerate(part.order.degrees)
        if degree > 0
    }
    return tuple(one.name for p, one in enumerate(numbers.model.parameters) if p not in fixed)


def may_change(place: Place, drives: set[int]) -> bool:
    """Whether a leaf may change in a motion; functions of time that drive joints (`drives`) may not."""
    if place[0] != "system" or place[1] not in (*TUNABLE, *AT_START):
        return False
    return place[1] != "signals" or place[2] not in drives


class LeafChange(NamedTuple):
    """How an array of a packed step follows one leaf of the case."""

    part: Varying
    values: np.ndarray  #: (q, n) what each of its values changes


LeafChanges: TypeAlias = dict[tuple[Any, ...], list[LeafChange]]


def changes_of(
    base: PackedCase, numbers: Numbers, repack: Callable[[Case], PackedCase], where: str
) -> LeafChanges:
    """What parameters change in the arrays of a packed step, which are linear in the leaves.

    InputError, after `where`, where they are not.
    """
    found: LeafChanges = {}
    for part in numbers.varying.values():
        leaf = cases.leaf_at(base.case, part.place)
        followed = False
        before = cases.numbers_of(leaf, leaf)[part.positions]
        for k, values in enumerate(part.values):
            other = repack(
                changed(base.case, {part.place: cases.fill(leaf, part.positions, before + values)})
            )
            for place, one in base.numbers.items():
                difference = flat(other.numbers.get(place), one, part.place, where) - np.ravel(one)
                if not difference.any():
                    continue
                followed = True
                known = found.setdefault(place, [])
                if not known or known[-1].part is not part:
                    known.append(LeafChange(part, np.zeros((len(part.values), difference.size))))
                known[-1].values[k] = difference
        if not followed:
            raise InputError(lost(part.place, where))
    prove(base, numbers, found, repack, where)
    return found


def changed(case: Case, leaves: Mapping[Place, Any]) -> Case:
    """A case with other leaves."""
    tree: dict[str | int, Any] = {}
    for place, leaf in leaves.items():
        cases.insert(tree, place, leaf)
    found: Case = cases.rebuild(case, tree)
    return found


def flat(other: Any, one: Any, place: Place, where: str) -> np.ndarray:
    """The numbers of an array of another case; InputError where it has another size."""
    if np.shape(other) != np.shape(one):
        raise InputError(lost(place, where))
    return np.ravel(other)


def lost(place: Place, where: str) -> str:
    """What is said where numbers of C files cannot follow a leaf."""
    expected = "parameters that change numbers of C files"
    return say(where, expected, cases.label(place), "fix it with --set")


def weights_of(model: ParametricCase, part: Varying, row: np.ndarray) -> np.ndarray:
    """Factors (q,) of the values of a leaf."""
    return np.asarray(lagrange(model.nodes, part.order, row) @ part.mixture)


def unchanged_part(
    base: PackedCase, numbers: Numbers, place: tuple[Any, ...], changes: Sequence[LeafChange]
) -> np.ndarray:
    """An array without all that parameters change (n,)."""
    assert numbers.model is not None
    nominal = np.array([one.nominal for one in numbers.model.parameters])
    found = np.ravel(base.numbers[place]).astype(float)
    for one in changes:
        found = found - weights_of(numbers.model, one.part, nominal) @ one.values
    return found


def prove(
    base: PackedCase,
    numbers: Numbers,
    changes: LeafChanges,
    repack: Callable[[Case], PackedCase],
    where: str,
) -> None:
    """Compare all arrays with those of cases within the ranges."""
    model = numbers.model
    if model is None or not numbers.varying:
        return
    low = np.array([one.low for one in model.parameters])
    high = np.array([one.high for one in model.parameters])
    for share in SHARES:
        row = low + share * (high - low)
        leaves = {}
        for part in numbers.varying.values():
            leaf = cases.leaf_at(base.case, part.place)
            found = weights_of(model, part, row) @ part.values
            leaves[part.place] = cases.fill(leaf, part.positions, found)
        other = repack(changed(base.case, leaves))
        for place, one in base.numbers.items():
            known = changes.get(place, [])
            expected = unchanged_part(base, numbers, place, known)
            for change in known:
                expected = expected + weights_of(model, change.part, row) @ change.values
            got = flat(other.numbers.get(place), one, next(iter(numbers.varying)), where)
            size = np.abs(got).max(initial=0.0)
            if np.abs(got - expected).max(initial=0.0) > ROUND * size:
                part_of = known[0].part.place if known else next(iter(numbers.varying))
                raise InputError(lost(part_of, where))


def places_of(base: PackedCase, changes: LeafChanges) -> tuple[dict[int, str], list[int]]:
    """Names of numbers in records that parameters change, by their addresses, and addresses of
    arrays.
    """
    scalars: dict[int, str] = {}
    arrays: list[int] = []
    for place in changes:
        one = base.numbers[place]
        if isinstance(one, np.ndarray):
            arrays.append(structs.address_of(one))
        else:
            scalars[base.address_of_number(place)] = "_".join(map(str, place))
    return scalars, arrays


def write(
    base: PackedCase, numbers: Numbers, changes: LeafChanges, memory: PackedMemory
) -> tuple[str, str]:
    """Constants of C, and the function `set_numbers`, which leaves the state as it is but at the
    start.
    """
    text = []
    starts: list[str] = []
    mixed: dict[Order, list[str]] = {}
    longest = 1
    written = set[str]()
    for k, (place, known) in enumerate(changes.items()):
        one = base.numbers[place]
        if isinstance(one, np.ndarray):
            found = memory.at(structs.address_of(one))
            if found is None:  # nothing reads it
                continue
            target = f"@{found[0].name}@ + {found[1]}"
        else:
            target = f"m->{'_'.join(map(str, place))}"
        # records of laws that are kept and that act share their numbers
        if target in written:
            continue
        written.add(target)
        when = "if (starting)\n        " if place[0] == "state" else ""
        start = unchanged_part(base, numbers, place, known)
        text.append(array(f"BASE_{k}", "double", start))
        starts.append(f"    {when}EACH (i, {start.size})\n        ({target})[i] = BASE_{k}[i];")
        for n, change in enumerate(known):
            t, q = change.part.mixture.shape
            longest = max(longest, t)
            text += [
                array(f"CHANGES_{k}_{n}", "double", change.values),
                array(f"MIXTURE_{k}_{n}", "double", change.part.mixture),
            ]
            mixed.setdefault(change.part.order, []).append(
                f"    {when}mix(weights, {t}, {q}, {start.size}, CHANGES_{k}_{n}, MIXTURE_{k}_{n}, {target});"
            )
    # polynomials of one order are evaluated once for all that have it
    lines = [
        line
        for k, found_of in enumerate(mixed.values())
        for line in (f"    weigh(m, {k}, weights);", *found_of)
    ]
    constants = "\n".join([*text, *tables(numbers, list(mixed))])
    return constants, function([*starts, *lines], longest)


def tables(numbers: Numbers, orders: Sequence[Order]) -> list[str]:
    """Nodes of the parameters, and degrees of the polynomials."""
    if numbers.model is None or not orders:
        return []
    count = len(numbers.model.parameters)
    nodes = numbers.model.nodes
    most = max(len(one) for one in nodes)
    degrees = [[*one.degrees, *map(int, one.logarithmic)] for one in orders]
    listed = ",\n    ".join("{" + ", ".join(map(str, row)) + "}" for row in degrees)
    padded = [[*one, *([0.0] * (most - len(one)))] for one in nodes]
    return [
        f"#define NODES {most}",
        array("NODE", "double", padded),
        f"static const int ORDER[{len(orders)}][{2 * count}] = {{\n    {listed}}};",
    ]


def function(lines: Sequence[str], longest: int) -> str:
    """`set_numbers`, with what it calls."""
    if not lines:
        return "static void set_numbers(NAME_memory *m, int starting)\n{\n    (void)m;\n    (void)starting;\n}\n"
    return replaced(template("numbers.c"), {"LONGEST": longest, "    LINES": "\n".join(lines)})


def parameters_of(numbers: Numbers) -> dict[str, tuple[str, float, float, float]]:
    """Unit, least, largest and nominal value of all parameters by name."""
    known = () if numbers.model is None else numbers.model.parameters
    return {one.name: (one.unit, one.low, one.high, one.nominal) for one in known}


def table_of(numbers: Numbers) -> str:
    """The ranges of the parameters as a table of C: least, largest, nominal."""
    rows = [", ".join(map(number, values[1:])) for values in parameters_of(numbers).values()] or [
        "0.0, 0.0, 0.0"
    ]
    return f"static const double PARAMETER[{len(rows)}][3] = {{{', '.join('{' + row + '}' for row in rows)}}};"
