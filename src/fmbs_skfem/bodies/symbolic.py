r"""Laws written as their energy in symbols: stress, modulus and damping follow and become compiled
loops.

    S = w (dW/du + beta dR/dv),     D = w (d2W/du2 + b d2R/dv2),     v = du/dt,     b = gh beta

with an energy W of the gradients u and, for damping of Kelvin-Voigt type, a dissipation R, half the
power that a damping time beta of 1 s turns into heat. A law may say them of its strains e(u) and of
their rates, and name steps on the way there (`DerivativeChain.keep`). Of all quantities q_n that are named
so, of q_a before them and the derivatives g_n = dq_n/du,

    f_n = dW/dq_n + beta dR/dq'_n + sum_m f_m dq_m/dq_n                         S = sum_n f_n dq_n/du
    K_ab = d2W/dq_a dq_b + b d2R/dq'_a dq'_b + sum_n f_n d2q_n/dq_a dq_b        D = sum_ab g_a K_ab g_b^T

each once, the former from the last quantity to the first one. SymPy takes derivatives by what stands
before alone, and finds common subexpressions; the loop runs over all points, so that it becomes
vector instructions.

Source (D): R. Gower and M. Mello, Optim. Methods Softw. 27 (2012) 251-269, doi
10.1080/10556788.2011.580098.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import sympy

from ..core.compiling.symbols import Expression, module, scalar, statements
from ..core.storage.records import dataclass
from .laws import KINDS
from .vectors import ALL, AXIAL, LINEAR

Vectors: TypeAlias = list[sympy.Matrix]  #: r,1 ... r,k
#: W of strains, or of vectors, and of the numbers of a section but the weight
Energy: TypeAlias = Callable[..., Expression]
Dissipation: TypeAlias = Callable[..., Expression]  #: R of those, their rates and those numbers
Named: TypeAlias = list[tuple[Any, Expression]]  #: symbols and their values, in this order
Row: TypeAlias = dict[Any, Expression]  #: what is not zero of a row, by its columns

HEAD = "(u, v, s, out, way, points, cells, n, beta):"
#: arrays that are others under a name of their own
SOURCES = {"h": "v", "m": "v"}
SMALL = 12  #: results of a loop that need no room of their own to become vector instructions


def gradients(keep: Callable[[Expression], Any], r: Vectors, *section: Expression) -> Vectors:
    """The strains of a law whose energy is one of its vectors."""
    return r


@dataclass(frozen=True)
class LawSymbols:
    """An energy [J/m or J/m2] of `vectors` derivatives of r, with the `section` numbers but the
    weight, and its dissipation.

    `energy(e, *section)` and `dissipation(e, rates, *section)` take and give symbols, of strains
    e that `strains(keep, r, *section)` gives: r itself, k matrices (c,), or what it has kept.
    """

    vectors: int
    section: tuple[str, ...]
    energy: Energy
    dissipation: Dissipation | None = None
    strains: Callable[..., Sequence[Any]] = gradients
    held: int = 0  #: first strains whose stresses a modulus takes from other gradients
    plane: bool = False  #: whether it does so but for AXIAL forces, see `laws.call_modulus`
    #: strains whose stresses it takes from there where it takes ALL, behind the `held` ones
    bending: LawSymbols | None = None


class linear_part(sympy.Function):
    """What a modulus adds to a strain of the gradients held where it takes what is LINEAR."""

    def _pythoncode(self, printer: Any) -> str:
        # a branch that is the same for all points, of which the compiler makes two loops: by a
        # factor 1 or 0 a modulus of a membrane takes 1.3 times as long
        return f"({printer.doprint(self.args[0])} if way == {LINEAR} else 0.0)"


class DerivativeChain:
    """A law at one point in `dim` components, from its gradients to its energy."""

    def __init__(self, law: LawSymbols, dim: int) -> None:
        count = law.vectors * dim
        self.law = law
        self.dim = dim
        self.u, self.v, self.before, self.bent = (
            sympy.symbols(f"{name}:{count}", real=True) for name in ("u", "v", "h", "m")
        )
        # names of a user could be those of other variables
        *self.section, self.weight = sympy.symbols(f"s:{len(law.section) + 1}", real=True)
        self.beta = sympy.Symbol("beta", real=True)
        self.steps: dict[Any, Expression] = {}  #: q_n by their symbols
        self.rate = dict(zip(self.u, self.v, strict=True))  #: symbols of q'_n
        r = [sympy.Matrix(self.u[k * dim : (k + 1) * dim]) for k in range(law.vectors)]
        self.strains = law.strains(self.keep, r, *self.section)
        rates = [sympy.sympify(one).subs(self.rate, simultaneous=True) for one in self.strains]
        self.W = scalar("energy of a law", law.energy(self.strains, *self.section))
        self.R = scalar(
            "dissipation of a law",
            law.dissipation(self.strains, rates, *self.section) if law.dissipation else 0,
        )
        self.all = [*self.u, *self.steps]

    def keep(self, value: Expression) -> Any:
        """The symbol of a quantity, by which derivatives are taken in steps; those of several."""
        if isinstance(value, Sequence | sympy.MatrixBase):
            return [self.keep(one) for one in value]
        symbol = sympy.Symbol(f"e{len(self.steps)}", real=True)
        self.steps[symbol] = sympy.sympify(value)
        self.rate[symbol] = sympy.Symbol(f"d{len(self.rate)}", real=True)
        return symbol

    def slopes(self, symbol: Any) -> Row:
        """dq_n/dq_a of all q_a that it is made of."""
        value = self.steps[symbol]
        return {one: sympy.diff(value, one) for one in self.all if value.has(one)}

    def rates(self) -> Named:
        """q'_n."""
        zero = sympy.Integer(0)
        return [
            (self.rate[one], sum((by * self.rate[a] for a, by in self.slopes(one).items()), zero))
            for one in self.steps
        ]

    def energy_slope(self, one: Any, damped: bool) -> Expression:
        """w (dW/dq + beta dR/dq')."""
        own = sympy.diff(self.W, one)
        pull = self.beta * sympy.diff(self.R, self.rate[one]) if damped else 0
        return self.weight * (own + pull)

    def pulls(self, direct: Callable[[Any], Expression], named: Named) -> Row:
        """f_n of all quantities, of their slopes of the energy alone; those that are no symbols go
        to `named`.
        """
        found = {one: direct(one) for one in self.all}
        for symbol in reversed(self.steps):
            found[symbol] = name(found[symbol], f"f{symbol}", named)
            for one, by in self.slopes(symbol).items():
                found[one] += found[symbol] * by
        return found

    def stress(self, damped: bool) -> tuple[Named, list[Expression]]:
        """S of all gradients."""
        named = [*self.steps.items(), *(self.rates() if damped else [])]
        found = self.pulls(lambda one: self.energy_slope(one, damped), named)
        return named, [found[one] for one in self.u]

    def at_held(self, strain: Any) -> Expression:
        """A strain of the gradients `before`, or what is linear from there to u."""
        value = strain
        for symbol, step in reversed(self.steps.items()):
            value = value.subs(symbol, step)
        held = value.subs(dict(zip(self.u, self.before, strict=True)), simultaneous=True)
        change = sum(
            sympy.diff(held, a) * (one - a) for one, a in zip(self.u, self.before, strict=True)
        )
        return held + linear_part(change)

    def modulus(self) -> tuple[Named, list[Expression]]:
        """D, its lower triangle, with the stresses of strains from gradients that are held."""
        named = list(self.steps.items())
        there: Row = {}
        if self.law.held and not self.law.bending:
            there = self.elsewhere(self.bent, "m", named)
        for one in self.strains[: self.law.held]:
            there[one] = name(self.at_held(one), f"a{one}", named)
        found = self.pulls(lambda one: self.energy_slope(one, False).subs(there), named)
        return named, self.second(found, self.energy_curvature, named)

    def elsewhere(self, gradients: Sequence[Any], letter: str, named: Named) -> Row:
        """Symbols of all quantities at other gradients, by their own."""
        found = dict(zip(self.u, gradients, strict=True))
        for one, value in self.steps.items():
            found[one] = name(value.subs(found, simultaneous=True), f"{letter}{one}", named)
        return found

    def energy_curvature(self, a: Any, b: Any) -> Expression:
        """w (d2W/dq_a dq_b + b d2R/dq'_a dq'_b)."""
        damping = sympy.diff(self.R, self.rate[a], self.rate[b])
        return self.weight * (sympy.diff(self.W, a, b) + self.beta * damping)

    def held_bending(self) -> tuple[Named, list[Expression]]:
        """What the stresses of strains behind the first ones add to D, where those of the gradients
        `before` stand for their own.
        """
        named = list(self.steps.items())
        there = self.elsewhere(self.before, "h", named)
        changes = {}
        for one in self.strains[self.law.held :]:
            own = self.energy_slope(one, False)
            changes[one] = own.subs(there, simultaneous=True) - own
        found = self.pulls(lambda one: changes.get(one, sympy.Integer(0)), named)
        return named, self.second(found, lambda a, b: sympy.Integer(0), named)

    def second(
        self, pulls: Row, curvature: Callable[[Any, Any], Expression], named: Named
    ) -> list[Expression]:
        """sum_ab g_a K_ab g_b^T, its lower triangle, of f_n and of the second derivatives of the
        energy alone.
        """
        g: dict[Any, Row] = {one: {one: sympy.Integer(1)} for one in self.u}
        for symbol in self.steps:
            slopes = self.slopes(symbol)
            g[symbol] = {}
            for i in self.u:
                value = sum(by * g[one].get(i, 0) for one, by in slopes.items())
                if value != 0:
                    g[symbol][i] = name(value, f"g{symbol}{i}", named)
        K: dict[Any, Row] = {one: {} for one in self.all}
        for place, a in enumerate(self.all):
            for b in self.all[: place + 1]:
                own = (
                    f * sympy.diff(self.steps[one], a, b)
                    for one, f in pulls.items()
                    if one in self.steps
                )
                value = sum(own, curvature(a, b))
                if value != 0:
                    K[a][b] = K[b][a] = name(value, f"k{a}{b}", named)
        products: dict[Any, Row] = {}
        for a, row in K.items():
            products[a] = {}
            for i in self.u:
                value = sum(by * g[b].get(i, 0) for b, by in row.items())
                if value != 0:
                    products[a][i] = name(value, f"p{a}{i}", named) if len(row) > 1 else value
        return [
            sum((g[a].get(i, 0) * products[a].get(j, 0) for a in self.all), sympy.Integer(0))
            for place, i in enumerate(self.u)
            for j in self.u[: place + 1]
        ]


def name(value: Expression, word: str, named: Named) -> Expression:
    """A symbol for a value that `named` gets behind the others; a symbol, with a factor or not,
    stands for itself.
    """
    value = sympy.sympify(value)
    _, rest = value.as_coeff_Mul()
    if rest.is_Atom:
        return value
    symbol = sympy.Symbol(word, real=True)
    named.append((symbol, value))
    return symbol


def point(
    chain: DerivativeChain, found: tuple[Named, list[Expression]], target: str
) -> tuple[list[str], list[str]]:
    """Views of the arrays that one point reads, and lines that write its results to `target`."""
    count = len(chain.u)
    numbers = len(chain.section) + 1
    sizes = {"u": count, "v": count, "h": count, "m": count, "s": numbers}
    symbols = (*chain.u, *chain.v, *chain.before, *chain.bent, *chain.section, chain.weight)
    places = [f"{array}[{i}, q]" for array, size in sizes.items() for i in range(size)]
    lines, texts = statements(*found, dict(zip(symbols, places, strict=True)))
    used = [array for array in sizes if lines and f" {array}[" in lines[0]]
    views = [
        f"{array} = carray({SOURCES.get(array, array)}, ({sizes[array]}, count))" for array in used
    ]
    views += [f"h = u if way == {AXIAL} else h"] if chain.law.plane and "h" in used else []
    views += [f"m = m if way == {ALL} else u"] if "m" in used else []
    pairs = [(i, j) for i in range(count) for j in range(i + 1)]
    return views, lines + [
        f"{target.format(k, *pair)} {text}"
        for k, (text, pair) in enumerate(zip(texts, pairs, strict=False))
    ]


def loop(chain: DerivativeChain, kind: str, word: str) -> str:
    """Source of the entry `word` for one kind but the modulus."""
    steps = list(chain.steps.items())
    end: list[str] = []
    if kind == "energy":
        views, lines = point(chain, (steps, [chain.weight * chain.W]), "total +=")
        begin, end = ["total = 0.0"], ["carray(out, 1)[0] = total"]
    elif kind == "dissipation":
        heat = 2 * chain.weight * chain.R
        views, lines = point(chain, (steps + chain.rates(), [heat]), "W[q] =")
        begin = ["W = carray(out, count)"]
    else:
        views, lines = point(chain, chain.stress(kind.startswith("damped")), "S[{0}, q] =")
        begin = [f"S = carray(out, ({len(chain.u)}, count))"]
    body = ["count = points * cells", *views, *begin, *over_points("count", lines), *end]
    return entry(word, body)


def modulus_loops(chain: DerivativeChain, word: str) -> str:
    """Source of the entry `word` of a modulus: all points, and those of held bending once more."""
    rows = len(chain.u)
    size = rows * (rows + 1) // 2
    small = size <= SMALL
    views, lines = point(
        chain, chain.modulus(), "D[{1}, {2}, q] = D[{2}, {1}, q] =" if small else "T[{0}, k] ="
    )
    begin = [f"D = carray(out, ({rows}, {rows}, count))"]
    begin += [] if small else [f"T = np.empty(({size}, LANES))"]
    body = over_points("count", lines) if small else over_lanes("count", lines, False)
    if chain.law.bending:
        bending = DerivativeChain(chain.law.bending, chain.dim)
        more, lines = point(
            bending,
            bending.held_bending(),
            "D[{1}, {2}, q] = D[{2}, {1}, q] = D[{1}, {2}, q] +" if small else "T[{0}, k] =",
        )
        views += [one for one in more if one not in views]
        where = f"count if way == {ALL} else 0"
        body += over_points(where, lines) if small else over_lanes(where, lines, True)
    return entry(word, ["count = points * cells", *views, *begin, *body])


def over_points(count: str, lines: Sequence[str]) -> list[str]:
    """A loop over points q."""
    return [f"for q in range({count}):", *(f"    {line}" for line in lines)]


def over_lanes(count: str, lines: Sequence[str], onto: bool) -> list[str]:
    """The same, LANES points at a time by way of T, see `unfold`."""
    return [
        f"for first in range(0, {count}, LANES):",
        "    for k in range(min(LANES, count - first)):",
        "        q = first + k",
        *(f"        {line}" for line in lines),
        f"    unfold(T, first, D, {onto})",
    ]


def entry(word: str, body: Sequence[str]) -> str:
    """Source of an entry of these lines."""
    return "\n".join([f"@entry\ndef {word}{HEAD}", *(f"    {line}" for line in body)])


def loops(law: LawSymbols, dim: int, word: str) -> dict[str, str]:
    """Sources of the entries of a law in `dim` components, by their names, `word` and a kind of
    `laws.KINDS`.
    """
    chain = DerivativeChain(law, dim)
    return {
        f"{word}{kind}": modulus_loops(chain, f"{word}{kind}")
        if kind == "modulus"
        else loop(chain, kind, f"{word}{kind}")
        for kind in KINDS
    }


def source(about: str, parts: Mapping[str, str], needed: Sequence[str] = ()) -> str:
    """Source of a module with entries, and FUNCTIONS by their names, with what they need beside
    what all do; `about` is its docstring.
    """
    imports = [
        "import numpy as np",
        "from fmbs_skfem.core.compiling.entries import LANES, entry, unfold",
        "from fmbs_skfem.core.compiling.jit import carray",
        *needed,
    ]
    names = ", ".join(f'"{word}": {word}' for word in parts)
    return module(about, imports, [*parts.values(), f"FUNCTIONS = {{{names}}}"])
