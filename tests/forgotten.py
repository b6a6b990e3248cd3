"""Classes that a test declares, and modules of extensions that it runs, are forgotten after it."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest

from fmbs_skfem.core.declared import Declared
from fmbs_skfem.scenes import extensions


def forget(monkeypatch: pytest.MonkeyPatch, *families: type[Declared]) -> Iterator[None]:
    """What a fixture yields from, for families of which classes are declared."""
    for family in families:
        monkeypatch.setattr(family, "known", dict(family.known))
    monkeypatch.setattr(extensions, "RUN", {})
    before = set(sys.modules)
    yield
    for name in set(sys.modules) - before:
        if name.startswith(("fmbs_extension_", "my_")):
            del sys.modules[name]
