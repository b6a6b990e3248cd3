"""Laws of one's own, given by their energy in symbols.

    def energy(r, EA, EI, kappa0):                            r: vectors r,1 ... r,k; the numbers of its section
        eps = (r[0].dot(r[0]) - 1) / 2
        return EA / 2 * eps**2 * (1 + eps**2) + EI / 2 * r[1].dot(r[1])

    stiffening = own_laws.define("stiffening", 2, ("EA", "EI", "kappa0"), energy)
    rod = bodies.cable("rod", mesh, section, law=stiffening)

Its loops are written once into the cache folder, and compiled when a model uses them. Whoever loads
a model with such a law, or runs it in another process, defines the law first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from types import ModuleType
from typing import Any

from ..core import extras, own_words
from ..core.errors import InputError, say
from . import laws
from .laws import Law

MODULES: dict[str, str] = {}  #: modules of the energies of the laws that were defined, by name


def define(
    name: str,
    vectors: int,
    section: Sequence[str],
    energy: Callable[..., Any],
    dissipation: Callable[..., Any] | None = None,
    dims: Sequence[int] = (2, 3),
) -> Law:
    """The law `name` with the energy W(r, *section) per reference length or area [J/m, J/m2] of r =
    (r,1 ... r,k), k = `vectors`.

    `dissipation` R(r, rates, *section) makes it damped: half the power that a damping time of 1 s
    turns into heat. `section` names its numbers but the quadrature weight; `dims` are the numbers
    of components c that it serves. Nothing is compiled before a model uses it. `check_law` tests
    it; see `symbolic` for W and R. InputError for a name that is no word or that another law has,
    for `vectors` below 1, for names of the section that are no texts, and for an energy that is no
    function.
    """
    module = getattr(energy, "__module__", "")
    name = own_words.free(laws.KNOWN, name, module, module_of)
    if not name.isidentifier():
        raise InputError(
            say("own_laws.define: name", "a word of letters, digits and _", f"'{name}'")
        )
    place = f"own_laws.define: law '{name}'"
    if not isinstance(vectors, int) or vectors < 1:
        raise InputError(say(place, "a number of vectors of 1 or more", repr(vectors)))
    if not all(isinstance(one, str) for one in section):
        raise InputError(say(place, "a section of names", repr(section)))
    if not callable(energy) or not (dissipation is None or callable(dissipation)):
        raise InputError(
            say(place, "functions for energy and dissipation", f"{energy!r} and {dissipation!r}")
        )

    @cache
    def loops() -> ModuleType:
        extras.need("symbols", f"law '{name}'")
        from ..core.compiling import symbols
        from . import symbolic

        law = symbolic.LawSymbols(vectors, tuple(section), energy, dissipation)
        parts = dict[str, str]()
        for dim in dims:
            parts |= symbolic.loops(law, dim, f"own_{dim}_")
        return symbols.import_text(symbolic.source(f"The law '{name}'.", parts))

    def entry(dim: int, kind: str) -> int:
        return int(loops().FUNCTIONS[f"own_{dim}_{kind}"]())

    MODULES[name] = module
    return Law(name, vectors, (*section, "weight"), tuple(dims), entry)


def module_of(law: Law) -> str:
    """The module that has defined a law; nothing of one of the package."""
    return MODULES.get(law.name, "")
