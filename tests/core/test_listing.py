"""`dir()` of the modules of the package."""

from __future__ import annotations

import importlib
from types import ModuleType

import pytest

import fmbs_skfem

PLAIN = [
    "core.values.units",
    "shapes.curves",
    "bodies.sections",
    "systems.forces.loads",
    "systems.measures.probes",
    "reduction.spaces.pod",
    "studies.job",
]


@pytest.mark.parametrize("name", fmbs_skfem.__all__)
def test_a_floor_lists_what_it_exports(name: str) -> None:
    module = importlib.import_module(f"fmbs_skfem.{name}")
    assert dir(module) == sorted(module.__all__)


@pytest.mark.parametrize("name", PLAIN)
def test_a_module_lists_what_it_defines(name: str) -> None:
    module = importlib.import_module(f"fmbs_skfem.{name}")
    found = {key: getattr(module, key) for key in dir(module)}
    assert not {
        "np",
        "annotations",
        "Any",
        "dataclass",
        "say",
        "InputError",
        "TYPE_CHECKING",
    } & set(found)
    assert not [
        key for key, value in found.items() if key.startswith("_") or isinstance(value, ModuleType)
    ]
    own = {
        key
        for key, value in vars(module).items()
        if getattr(value, "__module__", "") == module.__name__ and key[0] != "_"
    }
    assert own <= set(found)
