"""A small reduced model in a file, made once."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.calls import fmbs
from tests.cli.test_train import REDUCTION, written

from .inputs import BEAM, beam


@pytest.fixture(scope="session")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The beam of five cells, reduced without loss of a mode."""
    folder = tmp_path_factory.mktemp("model")
    path = beam(folder, BEAM + "reduction: {snapshots: 1 ms, hyper_reduction: null}\n")
    done = fmbs("reduce", path, "--out", folder / "model.h5")
    assert done.code == 0, done.err
    return folder / "model.h5"


@pytest.fixture(scope="session")
def ranged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A beam of ten cells for Young's moduli from 0.5 to 1.5 GPa."""
    folder = tmp_path_factory.mktemp("ranged")
    training = "training: {candidates: 11, samples: 3, iterations: 1, max_samples: 4}"
    done = fmbs(
        "train", written(folder, REDUCTION + training), "--no-plots", "--out", folder / "out"
    )
    assert done.code == 0, done.err
    return folder / "out" / "model.h5"
