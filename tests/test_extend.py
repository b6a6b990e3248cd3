"""What extensions import stays: the list of `fmbs_skfem.extend`, and modules under the names by
which scripts know them.
"""

import importlib

import pytest

import fmbs_skfem
from fmbs_skfem import extend, wings

FROZEN = """
Analysis At Body Count Declared Draft Dynamic Form GeneralizedAlpha History HyperReduction InputError Joint Level Load
Monitor Observer Output OwnForce OwnJoint Parent Position Probe Problem Rule Scene SceneBody Sensed SolverError
StateTable States Surface System Time Work check_table ecsw fields force joints loads norm notify of_time own_laws
probes quantity register rigid sampling surface
"""


def test_the_list_of_extensions_stays() -> None:
    assert set(FROZEN.split()) <= set(extend.__all__)
    assert all(hasattr(extend, name) for name in extend.__all__)


@pytest.mark.parametrize("name", wings.NAMES)
def test_a_module_is_found_under_the_name_that_scripts_know(name: str) -> None:
    place, _, attribute = wings.NAMES[name].partition(":")
    found = importlib.import_module(f"fmbs_skfem.{place}")
    package, _, last = name.rpartition(".")
    if attribute:
        assert getattr(importlib.import_module(f"fmbs_skfem.{package}"), last) is getattr(
            found, attribute
        )
    else:
        assert importlib.import_module(f"fmbs_skfem.{name}") is found
        assert found.__spec__ is not None
        assert found.__spec__.name == found.__name__ == f"fmbs_skfem.{place}"


def test_what_is_nowhere_is_said() -> None:
    with pytest.raises(ModuleNotFoundError, match=r"fmbs_skfem\.systems\.nowhere"):
        importlib.import_module("fmbs_skfem.systems.nowhere")
    with pytest.raises(AttributeError, match="nowhere"):
        fmbs_skfem.systems.nowhere  # noqa: B018
