"""Files of reduced models: the same bits back, in a process that knows nothing else, and damage of
every kind.
"""

from __future__ import annotations

import hashlib
import os
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from fmbs_skfem import reduction
from fmbs_skfem.core.errors import CorruptFile, InputError, NoRoom
from fmbs_skfem.core.storage import container
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import integrate, outputs
from fmbs_skfem.dynamics.outputs import centre_lines, lifted
from fmbs_skfem.reduction import Level, files
from fmbs_skfem.systems import System
from fmbs_skfem.systems.forces import force_laws, loads
from fmbs_skfem.systems.signals import Cosine, Sine
from tests.hard_cases import check_damage_is_found
from tests.reduction.conftest import SCHEME, Full, Reduced, full_of, hyper_reduced, reduced
from tests.reduction.test_ffrf import spun

CHILD = """
import sys
import numpy as np
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.dynamics.outputs import centre_lines, lifted
from fmbs_skfem.reduction import files

system = files.load(sys.argv[1])
run = integrate(system, GeneralizedAlpha(5e-4), 0.1)
lines = centre_lines(system, lifted(run)[0])
np.savez(sys.argv[2], x=run.x, multipliers=run.multipliers, **lines, **outputs(run))
"""


@pytest.fixture(scope="module")
def sampled(small: Reduced) -> System:
    return hyper_reduced(small, Level.POINTS)[0]


@pytest.fixture
def saved(sampled: System, tmp_path: Path) -> Path:
    return files.save(sampled, tmp_path / "model.rom", training={"E": 1e9})


def same(a: object, b: object) -> bool:
    """Equal values of equal types, arrays bit for bit."""
    if isinstance(a, np.ndarray):
        layout = (
            isinstance(b, np.ndarray)
            and a.dtype == b.dtype
            and a.flags.c_contiguous == b.flags.c_contiguous
        )
        return layout and np.array_equal(a, b)
    if hasattr(a, "indptr"):
        return (
            type(a) is type(b)
            and a.shape == b.shape
            and all(same(getattr(a, k), getattr(b, k)) for k in ("data", "indices", "indptr"))
        )
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(
            same(getattr(a, k), getattr(b, k)) for k in a.__dataclass_fields__
        )
    if isinstance(a, tuple | list):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return isinstance(b, dict) and list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    return type(a) is type(b) and a == b


def test_a_model_runs_again_in_another_process(
    sampled: System, saved: Path, tmp_path: Path
) -> None:
    run = integrate(sampled, SCHEME, 0.1)
    result = tmp_path / "child.npz"
    command = [sys.executable, "-c", CHILD, str(saved), str(result)]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, env=dict(os.environ)
    )
    assert done.returncode == 0, done.stderr
    with np.load(result) as child:
        assert np.array_equal(child["x"], run.x)
        assert np.array_equal(child["multipliers"], run.multipliers)
        for name, values in {**outputs(run), **centre_lines(sampled, lifted(run)[0])}.items():
            assert np.array_equal(child[name], values, equal_nan=True)


def test_everything_comes_back(
    sampled: System, coarse: Full, small: Reduced, tmp_path: Path
) -> None:
    _, selections = hyper_reduced(small)
    force = force_laws.one("moment_3", (0, 1, 2), (0.0, 0.0, 1.0), (0,))
    signals = (of_time("a*sin(t)", {"a": 0.1}), Cosine(of_time("t**2")), Sine(of_time(2.0)))
    loaded = replace(sampled, signals=signals, loads=replace(sampled.loads, forces=(force,)))
    notes = {
        "training": {"E": (5e8, 1e9), "name": "double pendulum"},
        "errors": [1e-4, None, True, np.float64(0.1), np.int64(3)],
        "table": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        "selections": selections,
    }
    found = files.read(files.save(loaded, tmp_path / "model.rom", **notes))
    assert same(found.system, loaded)
    assert same(found.notes, {**notes, "errors": [1e-4, None, True, 0.1, 3]})
    assert found.system.signals[0](2.0) == signals[0](2.0)
    # full models too, without the form with all multipliers
    full = coarse.run.system
    assert full.full is not None
    assert same(files.load(files.save(full, tmp_path / "full.rom")), replace(full, full=None))


def test_driven_models_keep_their_drive(tmp_path: Path) -> None:
    full = full_of(spun(6.0, 8), duration=0.5)
    system = reduced(full, reduction.system_level(full.raw)).system
    again = files.load(files.save(system, tmp_path / "spun.rom"))
    one, two = (integrate(s, SCHEME, 0.5) for s in (system, again))
    assert np.array_equal(one.x, two.x)
    assert np.abs(one.x - one.x[0]).max() > 0.01


def test_python_functions_are_refused(sampled: System, tmp_path: Path) -> None:
    for signal in (np.sin, Cosine(lambda t: t)):
        with pytest.raises(
            InputError,
            match=r"system\.signals\[0\].*a function of time that a file can hold.*core\.expressions",
        ):
            files.save(replace(sampled, signals=(signal,)), tmp_path / "model.rom")
    with pytest.raises(
        InputError,
        match=r"notes\.load: expected numbers, texts, arrays, tuples, lists or dicts, got Gravity",
    ):
        files.save(sampled, tmp_path / "model.rom", load=loads.Gravity((0, 0, -1)))
    assert not list(tmp_path.iterdir())


def test_a_file_appears_when_it_is_complete(sampled: System, saved: Path, tmp_path: Path) -> None:
    before = saved.read_bytes()
    with pytest.raises(InputError):
        files.save(sampled, saved, bad=object())
    assert saved.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["model.rom"]
    with pytest.raises(InputError, match="a place that can be written"):
        files.save(sampled, tmp_path / "nowhere" / "model.rom")
    with pytest.raises(InputError, match="a file of a reduced model, got no file"):
        files.load(tmp_path / "absent.rom")


@pytest.mark.parametrize("part", [0.1, 0.5, 0.99])
def test_a_full_disk_is_an_error_wherever_the_file_meets_it(
    part: float, sampled: System, saved: Path
) -> None:
    """The largest size of a file stands for the room that is left; the file that is there stays."""
    before, (soft, hard) = saved.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(part * len(before)), hard))
    try:
        with pytest.raises(
            NoRoom, match=r"model\.rom: expected room on the disk, got file too large; make room"
        ):
            files.save(sampled, saved, training={"E": 2e9})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert saved.read_bytes() == before
    assert [path.name for path in saved.parent.iterdir()] == ["model.rom"]


def test_any_damage_is_found(saved: Path) -> None:
    size = len(saved.read_bytes())
    check_damage_is_found(saved, files.load)
    with pytest.raises(
        CorruptFile, match=f"bytes {size - container.HEADER}, got {size // 2 - container.HEADER}"
    ):
        files.load(saved)


def test_foreign_and_newer_files_are_named(saved: Path, tmp_path: Path) -> None:
    foreign = tmp_path / "foreign.h5"
    with h5py.File(foreign, "w") as file:
        file["x"] = np.zeros(3)
    with pytest.raises(CorruptFile, match="'fmbs_skfem reduced model' in its first line"):
        files.load(foreign)
    whole = saved.read_bytes()
    saved.write_bytes(whole.replace(b"version 4\n", b"version 3\n", 1))
    with pytest.raises(
        CorruptFile,
        match=r"got version 3; it was written before release 0\.2\.0: train and save the model anew",
    ):
        files.load(saved)
    saved.write_bytes(whole.replace(b"version 4\n", b"version 5\n", 1))
    with pytest.raises(
        CorruptFile,
        match="expected version 4 of the format, got version 5; it was written by a newer release",
    ):
        files.load(saved)


@pytest.mark.parametrize(
    "old, new, message",
    [
        (b'"type": "Affine"', b'"type": "Popen0"', "the unknown type Popen0"),
        (
            b'"beta": ',
            b'"bela": ',
            r"other fields of Elastic .* missing \['beta'\], unknown \['bela'\]",
        ),
        (b'"order": "C"', b'"ardar": "C"', "order"),
        (b'{"tuple"', b'{"tuplx"', "an unknown kind of value"),
        (b'"array": 0,', b'"array":-0x', "Expecting"),
    ],
)
def test_content_of_another_shape_is_named(
    saved: Path, old: bytes, new: bytes, message: str
) -> None:
    # changed on purpose, with a checksum that fits
    data = saved.read_bytes()
    assert old in data
    body = data[container.HEADER :].replace(old, new, 1)
    assert hashlib.sha256(body).digest() != hashlib.sha256(data[container.HEADER :]).digest()
    saved.write_bytes(container.header(body, files.KIND) + body)
    with pytest.raises(CorruptFile, match=message):
        files.load(saved)


def test_notes_come_back(saved: Path) -> None:
    assert files.read(saved).notes == {"training": {"E": 1e9}}
