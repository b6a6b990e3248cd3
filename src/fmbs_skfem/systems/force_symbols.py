r"""Forces on probe rows in symbols: their values and derivatives become compiled functions. Run it to write `force_loops`.

    F(y, v, p, h),     - c (dF/dy + gh dF/dv)     for rows y, their rates v, numbers p, histories h

    dead                F = p                         whatever the state
    moment              F = m x y / |y|^2             on a slope or an axis y
    follower            F = f_t t + f_n n             on a position, t = y/|y| and, in the plane, n = t turned by 90 degrees
    torsion spring      F = tau dtheta/dy,            tau = - k (theta - theta0) - d dtheta/dt,   theta = arg(y0 + i y1) [- other]
    spring, one-sided   F = - N y / |y|               on the vector y between two places, see `springs`

`turned(angle)` is an angle that counts its turns: arg gives it but for whole ones, and its value is the one nearest to that of the
last accepted state, so that it may change by up to half a turn in a step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

import sympy

from ..core.records import dataclass
from ..core.symbols import Expression, constant, function, module, statements

SMALLEST = 1e-60  #: of the square of a length
RATE = sympy.Symbol("gh", real=True)  #: factor of derivatives by rates
SIGN = {sympy.Heaviside: lambda x, *_: sympy.Piecewise((0.0, x < 0), (1.0, True)), sympy.DiracDelta: lambda *_: sympy.Integer(0)}
HEADS = {  #: of the routines of a law
    "force": "    s, F = evaluation(table).space, opened(record)",
    "slopes": "    s, F = evaluation(table).space, opened(record)\n    c, gh = -s.c[0], s.gh[0]",
    "accept": "    s, F = evaluation(table).space, opened(record)",
    "energy": "    s, F = evaluation(table).space, opened(record)",
}
IMPORTS = (
    "from fmbs_skfem.core.choices import chosen, floor_of, less, not_more, sign_of",
    "from fmbs_skfem.core.structs import routine",
    "from fmbs_skfem.systems.evaluation import evaluation",
    "from fmbs_skfem.systems.force_laws import ForceLaw, continued, opened",
    "from fmbs_skfem.systems.kernels import factor",
    "from fmbs_skfem.systems.one_sided import closing, keeps, kept, lift, ramp, touch",
)

CURVES = ("from fmbs_skfem.core.curves import beyond, lookup, lookup_slope",)  #: of laws that read tables


def norm(vector: sympy.Matrix) -> Expression:
    """|vector|, whose derivatives are numbers where it is zero, too."""
    return sympy.sqrt(vector.dot(vector) + SMALLEST)


turned = function("turned", lambda *_: sympy.Integer(1))  #: an angle that counts its turns
continued = function("continued")  #: its value, the one nearest to its last one
lookup_slope = function("lookup_slope", constant)  #: slope of a curve through points, see `core.curves`
lookup = function("lookup", lookup_slope)  #: its value at the first argument; the second one stands for its numbers
beyond = function("beyond")  #: how far the argument is beyond its ends
closing = function("closing")  #: with those below: functions of `one_sided`
touch = function("touch", closing)
ramp = function("ramp", touch)
lift = function("lift", ramp)
keeps = function("keeps", constant)
kept = function("kept", keeps)


def rows(count: int, first: int = 0) -> sympy.Matrix:
    """Probe rows (count,)."""
    return sympy.Matrix(sympy.symbols(f"y{first}:{first + count}", real=True))


def rates(count: int, first: int = 0) -> sympy.Matrix:
    """Their rates."""
    return sympy.Matrix(sympy.symbols(f"v{first}:{first + count}", real=True))


def numbers(count: int, first: int = 0) -> sympy.Matrix:
    """Numbers of a law."""
    return sympy.Matrix(sympy.symbols(f"p{first}:{first + count}", real=True))


def table(number: int) -> Expression:
    """The numbers of a curve that a law reads."""
    return sympy.Symbol(f"T{number}", real=True)


def history(number: int = 0) -> Expression:
    """A function of time, 1 where there is none."""
    return sympy.Symbol(f"h{number}", real=True)


@dataclass(frozen=True)
class Symbols:
    """Forces on all rows in symbols."""

    force: Sequence[Expression]  #: (r,)
    numbers: int
    histories: int = 0
    energy: Expression = 0  #: potential [J] whose negative gradient is in the force
    kept: Sequence[Expression] = ()  #: values of accepted states that are kept beside angles
    tables: Mapping[str, tuple[int, int]] = field(default_factory=dict)  #: first number and end of every curve by its name

    def unknown(self) -> set[Expression]:
        """Symbols in the forces that are none of the law's."""
        count = len(self.force)
        own = {*rows(count), *rates(count), *numbers(self.numbers), *(history(k) for k in range(self.histories))}
        return set().union(*(sympy.sympify(value).free_symbols for value in self.force)) - own


def pruned(law: Symbols) -> tuple[Symbols, tuple[int, ...]]:
    """The same forces on those rows alone that they read or push, and the numbers of these."""
    count = len(law.force)
    read = set().union(*(sympy.sympify(value).free_symbols for value in (*law.force, *law.kept)))
    y, v = rows(count), rates(count)
    used = tuple(k for k in range(count) if law.force[k] != 0 or y[k] in read or v[k] in read)
    fewer = {old: new for full in (rows, rates) for old, new in zip([full(count)[k] for k in used], full(len(used)), strict=True)}
    found, kept = (
        [sympy.sympify(value).subs(fewer, simultaneous=True) for value in values]
        for values in ([law.force[k] for k in used], law.kept)
    )
    return Symbols(
        found, law.numbers, law.histories, sympy.sympify(law.energy).subs(fewer, simultaneous=True), kept, law.tables
    ), used


def text(name: str, law: Symbols) -> str:
    """Routines of a law, and the law itself as an entry of LAWS."""
    count, F = len(law.force), [plain(value) for value in law.force]
    y, v = rows(count), rates(count)
    pairs, slopes = [], []
    for i in range(count):
        for j in range(count):
            slope = plain(sympy.diff(F[i], y[j]) + RATE * sympy.diff(F[i], v[j]))
            if slope != 0:
                pairs.append((i, j))
                slopes.append(slope)
    potential = plain(law.energy)
    kept = [plain(value) for value in law.kept]
    angles = sorted(set().union(*(value.atoms(turned) for value in (*F, *kept, potential))), key=str)
    curves = sorted(set().union(*(value.atoms(lookup) for value in (*F, *kept))), key=str)
    outside = [beyond(*one.args) for one in curves]  # after what is kept, the largest one so far
    size = len(angles) + len(kept) + len(outside)
    held = [f"s.memory[F.memory + {size} * k + {n}]" for n in range(size)]
    accepted = [f"{one} = {{}}" if n < size - len(outside) else f"{one} = max({one}, {{}})" for n, one in enumerate(held)]
    last = sympy.symbols(f"m0:{len(angles)}", real=True)
    known = {angle: continued(angle.args[0], m) for angle, m in zip(angles, last, strict=True)}
    places = {
        **{y[k]: f"s.y[F.rows[k, {k}]]" for k in range(count)},
        **{v[k]: f"s.rates[F.rows[k, {k}]]" for k in range(count)},
        **{p: f"F.numbers[k, {k}]" for k, p in enumerate(numbers(law.numbers))},
        **{history(k): f"factor(s.signals, F.signals[k, {k}])" for k in range(law.histories)},
        **{table(k): f"F.numbers[k, {first}:{last}]" for k, (first, last) in enumerate(law.tables.values())},
        **dict(zip(last, held, strict=False)),
    }
    parts = {
        "force": (F, [f"s.g[F.rows[k, {k}]] += {{}}" for k in range(count)]),
        "slopes": (slopes, [f"s.H[F.pair + {len(pairs)} * k + {n}] += c * ({{}})" for n in range(len(pairs))]),
        "accept": ([*angles, *kept, *outside], accepted),
        "energy": (
            [potential, *(plain(sympy.diff(potential, one)) for one in y)] if potential != 0 else [],
            ["s.energy[0] += {}", *(f"s.g[F.rows[k, {k}]] += {{}}" for k in range(count))],
        ),
    }
    routines = [
        routine(f"{name}_{part}", HEADS[part], [value.xreplace(known) for value in values], targets, places)
        for part, (values, targets) in parts.items()
        if values or part in ("force", "slopes")
    ]
    damped = bool(set(v) & set().union(*(value.free_symbols for value in (*F, *kept))))
    given = [part for part in ("accept", "energy") if parts[part][0]]
    more = [*(f"{part}={name}_{part}" for part in given), *([f"kept={len(kept)}"] if kept else [])]
    if curves:
        names = list(law.tables)
        more.append(f"tables={tuple(names[int(str(one.args[1])[1:])] for one in curves)}")
    functions = ", ".join([f"{name}_force, {name}_slopes", *more])
    facts = f"{count}, {law.numbers}, {law.histories}, {tuple(pairs)}, {len(angles)}, {damped}"
    return "\n\n\n".join([*routines, f'LAWS["{name}"] = ForceLaw("{name}", {facts}, {functions})'])


def plain(value: Any) -> Expression:
    """An expression without what only exists as a derivative of a jump."""
    value = sympy.sympify(value)
    for kind, other in SIGN.items():
        value = value.replace(kind, other)
    return value


def routine(name: str, head: str, values: Sequence[Expression], targets: Sequence[str], places: Mapping[Any, str]) -> str:
    """A routine that gives values to targets, for all groups of rows."""
    lines, found = statements(values, places)
    body = [*lines, *(target.format(value) for target, value in zip(targets, found, strict=True) if value != "0.0")] or ["pass"]
    start = f"@routine\ndef {name}(table: Any, record: Any) -> int:\n{head}\n    for k in range(len(F.rows)):"
    return "\n        ".join([start, *body]) + "\n    return 0"


def source(laws: Mapping[str, Symbols], about: str) -> str:
    """A module with LAWS of these names."""
    more = () if not any(law.tables for law in laws.values()) else CURVES
    return module(about, (*IMPORTS, *more), ["LAWS = {}", *(text(name, law) for name, law in laws.items())])


def moment(dim: int) -> Symbols:
    y, m = rows(dim), numbers(1 if dim == 2 else 3)
    F = m[0] * sympy.Matrix([-y[1], y[0]]) if dim == 2 else m.cross(y)
    return Symbols(list(history() * F / y.dot(y)), len(m), 1)


def follower(dim: int) -> Symbols:
    """Rows of the slope, then of the position."""
    y, f = rows(dim), numbers(2 if dim == 2 else 1)
    F = f[0] * y + (f[1] * sympy.Matrix([-y[1], y[0]]) if dim == 2 else sympy.zeros(dim, 1))
    return Symbols([0] * dim + list(history() * F / sympy.sqrt(y.dot(y))), len(f), 1)


def torsion_spring(arms: int) -> Symbols:
    """Between an arm (2,) and the ground, or two arms."""
    y, v, (k, d, rest) = rows(2 * arms), rates(2 * arms), numbers(3)
    theta = sum((1 - 2 * arm) * sympy.atan2(y[2 * arm + 1], y[2 * arm]) for arm in range(arms))
    along = [sympy.diff(theta, one) for one in y]
    torque = -k * (turned(theta) - rest) - d * sum(a * b for a, b in zip(along, v, strict=True))
    return Symbols([torque * one for one in along], 3, energy=k * (turned(theta) - rest) ** 2 / 2)


def pulled(pull: Callable[..., tuple[Expression, Expression]], count: int, histories: int = 0) -> Symbols:
    """A force N and its potential of a distance d, its rate and numbers, between two places in space that are y apart."""
    y, v = rows(3), rates(3)
    d = norm(y)
    N, energy = pull(d, y.dot(v) / d, *numbers(count))
    return Symbols(list(-N * y / d), count, histories, energy)


def spring(d: Expression, rate: Expression, k: Expression, c: Expression, free: Expression) -> tuple[Expression, Expression]:
    return k * (d - free) + c * rate, k * (d - free) ** 2 / 2


def one_sided(
    d: Expression,
    rate: Expression,
    sign: Expression,
    k: Expression,
    c: Expression,
    free: Expression,
    e: Expression,
    cut: Expression,
) -> tuple[Expression, Expression]:
    """A rope, or with the sign -1 a stop."""
    s = sign * (d - free)
    return sign * kept(k * ramp(s, e) + c * touch(s, e) * sign * rate, cut), k * lift(s, e)


def one_sided_plane() -> Symbols:
    """A stop along one row."""
    (y,), (v,), (k, c, gap, e, cut) = rows(1), rates(1), numbers(5)
    s = gap - y
    return Symbols([kept(k * ramp(s, e) - c * touch(s, e) * v, cut)], 5, energy=k * lift(s, e))


KNOWN = {
    "dead": Symbols([history() * numbers(1)[0]], 1, 1),
    "moment_2": moment(2),
    "moment_3": moment(3),
    "follower_2": follower(2),
    "follower_3": follower(3),
    "torsion_spring": torsion_spring(1),
    "relative_torsion_spring": torsion_spring(2),
    "spring": pulled(spring, 3),
    "one_sided": pulled(one_sided, 6),
    "one_sided_plane": one_sided_plane(),
    "constant_pull": pulled(lambda d, rate, f: (history() * f, history() * f * d), 1, 1),
}
LOOPS = Path(__file__).with_name("force_loops.py")


def written() -> str:
    """The text of `force_loops`."""
    return source(KNOWN, "Forces of loads and their derivatives, written by `force_symbols` and not to be edited.")


if __name__ == "__main__":
    LOOPS.write_text(written(), encoding="utf-8")
