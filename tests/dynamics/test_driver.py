"""The driver and the assembly name no feature: what a run meets comes to it as an observer, or as
an addition.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import fmbs_skfem

SOURCE = Path(fmbs_skfem.__file__).parent
WORDS = re.compile(r"contact|controller|departure|wheel|feed|gear|latch", re.IGNORECASE)


@pytest.mark.parametrize(
    "module",
    [
        "dynamics/integration.py",
        "dynamics/run.py",
        "dynamics/equilibria/statics.py",
        "systems/assembly.py",
    ],
)
def test_no_feature_is_named(module: str) -> None:
    lines = (SOURCE / module).read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if WORDS.search(line)] == []
