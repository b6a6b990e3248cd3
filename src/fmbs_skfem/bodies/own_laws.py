"""Laws of one's own, given by their energy in symbols.

    def energy(r, EA, EI, kappa0):                            r: vectors r,1 ... r,k; the numbers of its section
        eps = (r[0].dot(r[0]) - 1) / 2
        return EA / 2 * eps**2 * (1 + eps**2) + EI / 2 * r[1].dot(r[1])

    stiffening = own_laws.define("stiffening", 2, ("EA", "EI", "kappa0"), energy)
    rod = bodies.cable("rod", mesh, section, law=stiffening)

Its loops are written once into the cache folder, and compiled when a model uses them. Whoever loads a model with such a law, or
runs it in another process, defines the law first.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from ..core.errors import InputError, say
from ..core.jit import cache_folder
from .laws import Law

PREFIX = "own"


def define(
    name: str,
    vectors: int,
    section: Sequence[str],
    energy: Callable[..., Any],
    dissipation: Callable[..., Any] | None = None,
    dims: Sequence[int] = (2, 3),
) -> Law:
    """The law `name` with the energy W(r, *section) per reference length or area and, where it is damped, R(r, rates, *section).

    `section` names its numbers but the quadrature weight. `check_law` tests it. See `symbolic` for W and R.
    """
    if not name.isidentifier():
        raise InputError(say("own_laws.define: name", "a word of letters, digits and _", f"'{name}'"))

    @cache
    def loops() -> ModuleType:
        from . import symbolic

        law = symbolic.Symbols(vectors, tuple(section), energy, dissipation)
        return import_text(symbolic.source([(PREFIX, law, tuple(dims))], f"The law '{name}'."))

    def entry(dim: int, kind: str) -> int:
        return int(getattr(loops(), f"{PREFIX}_{dim}_{kind}")())

    return Law(name, vectors, (*section, "weight"), tuple(dims), entry)


def import_text(text: str) -> ModuleType:
    """The module of a text, kept in the cache folder under its hash, so that its compiled functions are found again."""
    folder = cache_folder() or Path(tempfile.mkdtemp(prefix="fmbs_laws_"))
    name = f"law_{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    path = folder / f"{name}.py"
    if not path.exists():
        part = path.with_suffix(f".{os.getpid()}.part")
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)  # where numba looks for what it has cached
    spec.loader.exec_module(module)
    return module
