r"""Laws of what happens at a point, behind one door: an energy W(u) of gradients u (k c, p, e),
derivatives of the position.

    S = dW/du,   D = d2W/du2,   u = (r,1, ... r,k)

    law                            vectors                    section rows
    QUADRATIC, MATERIAL, EXACT     r' r''                     EA, EI, kappa0, weight                       `cable_law`
    MEMBRANE                       r,1 r,2                    A, nu, weight                                `law_symbols`
    SHELL                          r,1 r,2 r,11 r,22 r,12     A, B, nu, b0_11, b0_22, b0_12, weight        `law_symbols`
    BEAM                           r d_i r' d_i'              C_ij (i <= j), E, e0_k, weight               `strain_law`
    WARPED_BEAM                    r d_i r' d_i' r'' d_i''    C_ij (i <= j), E, e0_k, weight               `strain_law`
    PLANAR_BEAM                    r d r' d'                  C_ij (i <= j), E, e0_k, weight               `law_symbols`
    SOLID                          r,1 r,2 r,3                C_ij (i <= j), E, e0_k, weight               `solids.solid_law`
    PRESSURE, EDGE_PRESSURE        r r,1 r,2 | r r,1          p, v0, weight                                `pressure_law`

The last two are loads that follow a surface, not elastic. `own_laws.define` makes a law of an
energy in symbols. Laws are called by address, so that a model compiles only its own;
`checks.check_law` tests any law.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any, ClassVar

import numpy as np

from ..core.compiling.entries import call, call_now
from ..core.compiling.jit import jit
from ..core.errors import InputError, closest, listed, say
from ..core.storage.container import ENUMS, Arrays, encode
from ..core.values.arguments import blamed

#: functions of a law
KINDS = (
    "energy",
    "stress",
    "modulus",
    "damped_stress",
    "dissipation",
)
ENERGY, STRESS, MODULUS, DISSIPATION, OPTION, DIM = range(6)  #: columns of `addresses`
KNOWN: dict[str, Law] = {}  #: laws by name


class Law:
    """A law W(u) of gradients u (k c, p, e), known by its name; `find` gives it back, and copies
    and pickles are made by it.

    `entry(dim, kind)` is the address of its compiled function of a kind (`KINDS`) in `dim`
    components. InputError where another law has that name.
    """

    QUADRATIC: ClassVar[Law]
    MATERIAL: ClassVar[Law]
    EXACT: ClassVar[Law]
    MEMBRANE: ClassVar[Law]
    SHELL: ClassVar[Law]
    PRESSURE: ClassVar[Law]
    EDGE_PRESSURE: ClassVar[Law]
    BEAM: ClassVar[Law]
    WARPED_BEAM: ClassVar[Law]
    PLANAR_BEAM: ClassVar[Law]
    SOLID: ClassVar[Law]
    LINEAR: ClassVar[Law]

    @blamed
    def __init__(
        self,
        name: str,
        vectors: int,
        section: tuple[str, ...],
        dims: tuple[int, ...],
        entry: Callable[[int, str], int],
        option: int = 0,
        follows: bool = False,
        holds: bool = False,
        fields: int = 1,
    ) -> None:
        self.name = name
        self.vectors = vectors  #: derivatives of r that it reads, or of all its fields
        self.fields = fields  #: vectors that a function of a full body stands for: r alone, or r and directors
        self.section = section  #: rows of its section, the last one the quadrature weight
        self.dims = dims  #: numbers of components c that it serves
        self.entry = cache(entry)  #: address of its function of a kind in c components
        self.option = option  #: what its functions take beside the numbers
        self.follows = follows  #: whether it is a load that follows a surface or an edge
        self.holds = holds  #: whether its modulus takes the stresses of other gradients
        if KNOWN.setdefault(name, self) is not self:
            raise InputError(say("law", "a name of its own", f"a second '{name}'"))

    def __repr__(self) -> str:
        return f"Law.{self.name}"

    def __reduce__(self) -> Any:
        return find, (self.name,)

    @property
    def orders(self) -> int:
        """Derivatives of each field that it reads."""
        return self.vectors // self.fields

    @property
    def rows(self) -> int:
        """Number of rows of its section."""
        return len(self.section)

    @property
    def tangents(self) -> int:
        """How many of its vectors, the first ones, are tangents of a surface or directions in a
        solid, by which a body shows how it has turned; 0 of a line.
        """
        solid = self.vectors == 3 and not self.follows
        return 3 if solid else 2 if self in (Law.MEMBRANE, Law.SHELL) else 0

    @property
    def bends(self) -> bool:
        """Whether it is that of a cable, whose bending depends on the size of the curvature in
        space.
        """
        return self.section == CABLE


def find(name: str) -> Law:
    """The law of this name; InputError where none has been defined, with the nearest known name."""
    if name not in KNOWN:
        raise InputError(
            say("law", f"one of {listed(KNOWN, name)}", f"'{name}'", "define it first")
            + closest(name, KNOWN)
        )
    return KNOWN[name]


def compiled(module: str, name: str = "") -> Callable[[int, str], int]:
    """Addresses of the FUNCTIONS of a module, by `name` and kind (perhaps one for both stresses)."""

    def entry(dim: int, kind: str) -> int:
        functions = import_module(module, __package__).FUNCTIONS
        name_of = f"{name}{kind}".format(dim)
        return int((functions.get(name_of) or functions[name_of.replace("damped_", "")])())

    return entry


CABLE = ("EA", "EI", "kappa0", "weight")
PRESSED = ("p", "v0", "weight")
Law.QUADRATIC = Law(
    "QUADRATIC", 2, CABLE, (2, 3), compiled(".law_loops", "quadratic_{}_"), holds=True
)
Law.MATERIAL = Law(
    "MATERIAL", 2, CABLE, (2, 3), compiled(".law_loops", "curved_{}_"), option=2, holds=True
)
Law.EXACT = Law(
    "EXACT", 2, CABLE, (2, 3), compiled(".law_loops", "curved_{}_"), option=3, holds=True
)
CABLES = (Law.QUADRATIC, Law.MATERIAL, Law.EXACT)
Law.MEMBRANE = Law(
    "MEMBRANE", 2, ("A", "nu", "weight"), (2,), compiled(".law_loops", "membrane_"), holds=True
)
Law.SHELL = Law(
    "SHELL",
    5,
    ("A", "B", "nu", "b0_11", "b0_22", "b0_12", "weight"),
    (3,),
    compiled(".law_loops", "shell_"),
    holds=True,
)
Law.PRESSURE = Law("PRESSURE", 3, PRESSED, (3,), compiled(".pressure_law"), follows=True)
Law.EDGE_PRESSURE = Law(
    "EDGE_PRESSURE", 2, PRESSED, (2,), compiled(".pressure_law", "edge_"), follows=True
)
STRAINS = ("gamma1", "gamma2", "gamma3", "kappa1", "kappa2", "kappa3")  #: of a beam
STIFFNESS = tuple(f"C{i + 1}{j + 1}" for i in range(6) for j in range(i, 6))
BEAM = (*STIFFNESS, "E", *STRAINS, *(f"E{k + 1}" for k in range(6)), "weight")
Law.BEAM = Law("BEAM", 8, BEAM, (3,), compiled(".strain_law", "beam_"), holds=True, fields=4)
WARPED = ("warping", "trapeze")  #: strains behind those of a beam that warps
WARPED_BEAM = (
    *(f"C{i + 1}{j + 1}" for i in range(8) for j in range(i, 8)),
    "E",
    *STRAINS,
    *WARPED,
    *(f"E{k + 1}" for k in range(6)),
    "weight",
)
Law.WARPED_BEAM = Law(
    "WARPED_BEAM",
    12,
    WARPED_BEAM,
    (3,),
    compiled(".strain_law", "warped_beam_"),
    holds=True,
    fields=4,
)
PLANAR_BEAM = ("C11", "C12", "C13", "C22", "C23", "C33", "E", "gamma1", "gamma2", "kappa", "E1")
Law.PLANAR_BEAM = Law(
    "PLANAR_BEAM",
    4,
    (*PLANAR_BEAM, "weight"),
    (2,),
    compiled(".law_loops", "planar_beam_"),
    holds=True,
    fields=2,
)
SOLID = (*STIFFNESS, "E", *(f"e{k + 1}" for k in range(6)), "weight")
Law.SOLID = Law("SOLID", 3, SOLID, (3,), compiled(".solids.solid_law", "solid_"), holds=True)
#: small strains of a whole body by its stiffness matrix, see `systems.terms.corotated`: no points
Law.LINEAR = Law("LINEAR", 0, (), (3,), lambda dim, kind: 0)
#: numbers of laws in outputs and files
NUMBERS = {
    0: Law.QUADRATIC,
    2: Law.MATERIAL,
    3: Law.EXACT,
    4: Law.MEMBRANE,
    5: Law.SHELL,
    6: Law.PRESSURE,
    7: Law.EDGE_PRESSURE,
    8: Law.BEAM,
    9: Law.LINEAR,
    10: Law.SOLID,
    11: Law.PLANAR_BEAM,
    12: Law.WARPED_BEAM,
}


def number(law: Law) -> int:
    """The number of a law of this package, see `NUMBERS`, which outputs and files know it by.

    Laws of one's own have names alone, and no number.
    """
    return next(k for k, one in NUMBERS.items() if one is law)


@encode.register
def _(law: Law, arrays: Arrays, where: str) -> Any:
    return {"enum": "Law", "value": number(law) if law in NUMBERS.values() else law.name}


ENUMS["Law"] = lambda value: find(value) if isinstance(value, str) else NUMBERS[value]


def addresses(law: Law, dim: int, damped: bool) -> np.ndarray:
    """Where the functions of a law in `dim` components are, as one row of integers (6,): see the
    columns ENERGY to DIM.

        energy, stress, modulus, dissipation, option, dim

    With `damped` the stress takes any damping time; without, none alone, and there is no
    dissipation (0).
    """
    kinds = (
        ("energy", "damped_stress", "modulus", "dissipation")
        if damped
        else ("energy", "stress", "modulus")
    )
    found = [*(law.entry(dim, kind) for kind in kinds), 0][:OPTION]
    return np.array([*found, law.option, dim], dtype=np.int64)


@jit
def components(calls: np.ndarray) -> int:
    """The number of components c of the `addresses` (6,) of a law, in compiled code."""
    return calls[DIM]


@jit
def call_energy(calls: np.ndarray, u: np.ndarray, section: np.ndarray) -> float:
    """Energy W [J] summed over all points in compiled code, as `energy`, with the `addresses` of
    the law.

    u (k c, p, e) and section (i, p, e) are contiguous.
    """
    W = np.zeros(1)
    call(calls[ENERGY], (u, u, section, W), (0, u.shape[1], u.shape[2], calls[OPTION]), 0.0)
    return W[0]


@jit
def call_stress(
    calls: np.ndarray,
    u: np.ndarray,
    rate: np.ndarray,
    beta: float,
    section: np.ndarray,
    S: np.ndarray,
) -> None:
    """Stress of a law in compiled code, as `stress`, with the `addresses` of the law.

        S = weight dW/du (+ damping)

    u, `rate` and S (k c, p, e), section (i, p, e), all contiguous; beta [s]. S is overwritten.
    """
    call(calls[STRESS], (u, rate, section, S), (0, u.shape[1], u.shape[2], calls[OPTION]), beta)


@jit
def call_dissipation(
    calls: np.ndarray, u: np.ndarray, rate: np.ndarray, section: np.ndarray, room: np.ndarray
) -> float:
    """Heat [W] of a damping time of 1 s in compiled code, as `dissipation`, with the `addresses` of
    a law that is damped.

        sum_pe weight v . dR/dv

    u and `rate` (k c, p, e), section (i, p, e), `room` for one number a point, (p e,) or more.
    """
    call(
        calls[DISSIPATION],
        (u, rate, section, room),
        (0, u.shape[1], u.shape[2], calls[OPTION]),
        0.0,
    )
    total = 0.0
    for q in range(
        u.shape[1] * u.shape[2]
    ):  # apart from the law, whose loop becomes vector instructions so
        total += room[q]
    return total


@jit
def call_modulus(
    calls: np.ndarray,
    u: np.ndarray,
    held: np.ndarray,
    way: int,
    beta: float,
    section: np.ndarray,
    D: np.ndarray,
) -> None:
    """Modulus of a law in compiled code, as `modulus`, with the `addresses` of the law.

        D = weight (d2W/du2 + beta d2R/dv2)

    Laws that hold stresses, `Law.holds`, take those of the gradients `held`: `way` says whether
    AXIAL forces (and those of shells), those of strains that are LINEAR from there to u,

        e(held) + de/du (u - held),

    or ALL. u and `held` (k c, p, e), section (i, p, e), D (k c, k c, p, e), all contiguous; `beta`
    [-]. D is overwritten.
    """
    call(calls[MODULUS], (u, held, section, D), (way, u.shape[1], u.shape[2], calls[OPTION]), beta)


def energy(law: Law, u: np.ndarray, section: np.ndarray) -> float:
    """Strain energy [J] of gradients u (k c, p, e) and a section (i, p, e), summed over all points.

        sum_pe weight W(u)

    A pressure that follows gives -p (V - V0), see `pressure_law`.
    """
    return float(call_energy(addresses(law, len(u) // law.vectors, False), u, section))


def stress(
    law: Law, u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray
) -> None:
    """Stress S (k c, p, e) of gradients u (k c, p, e), and of their rates with the damping time
    `beta` [s].

        S = weight (dW/du + beta dR/dv)

    S is written in place; section (i, p, e), its last row the weight. Where beta is 0 the rates
    have no effect. TypeError for an S that is not contiguous.
    """
    calls = addresses(law, len(u) // law.vectors, beta > 0.0)
    given = (np.ascontiguousarray(part, np.float64) for part in (u, rate, section))
    call_now(int(calls[STRESS]), (*given, S), (0, *u.shape[1:], int(calls[OPTION])), beta)


def dissipation(law: Law, u: np.ndarray, rate: np.ndarray, section: np.ndarray) -> float:
    """What a damping time of 1 s turns into heat [W] at gradients (k c, p, e) with their rates v,
    summed over all points.

        sum_pe weight v . dR/dv

    R is half of it: with a damping time beta the power is beta times that. Section (i, p, e).
    """
    return float(
        call_dissipation(
            addresses(law, len(u) // law.vectors, True), u, rate, section, np.zeros(u[0].size)
        )
    )


def modulus(law: Law, u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray) -> None:
    """Modulus D (k c, k c, p, e) of gradients u (k c, p, e), symmetric.

        D = weight (d2W/du2 + beta d2R/dv2)

    `beta` [-] is the damping time times gh [1/s], the factor of derivatives by rates in the
    iteration matrix, see `systems.evaluation`. D is written in place; section (i, p, e).
    """
    call_modulus(addresses(law, len(u) // law.vectors, beta > 0.0), u, u, 0, beta, section, D)
