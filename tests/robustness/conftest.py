"""A small reduced model in a file, made once."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.calls import fmbs

from .inputs import BEAM, beam


@pytest.fixture(scope="session")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The beam of five cells, reduced without loss of a mode."""
    folder = tmp_path_factory.mktemp("model")
    path = beam(folder, BEAM + "reduction: {snapshots: 1 ms, hyper_reduction: null}\n")
    done = fmbs("reduce", path, "--out", folder / "model.h5")
    assert done.code == 0, done.err
    return folder / "model.h5"
