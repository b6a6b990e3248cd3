"""Libraries of other machines, run where wine and qemu run them: the numbers of Windows and of ARM
are those of this machine.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem.core import extras
from fmbs_skfem.exports import binaries, c_files, fmu
from fmbs_skfem.exports.binaries import ZIG
from fmbs_skfem.exports.text import template
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.systems import System
from tests.exports.test_c_files import STEP
from tests.exports.test_fmu import plant  # noqa: F401  (a fixture)

LIBRARIES = Path("/usr/aarch64-linux-gnu")  #: of Linux on ARM, Debian's libc6-arm64-cross
HERE = sys.platform == "linux" and platform.machine() == "x86_64"
pytestmark = pytest.mark.skipif(
    not extras.there("fmu") or not HERE, reason="needs zig (extra fmu) on Linux, x86-64"
)


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """The environment of wine, with a Windows of its own (0.7 GB), which goes when the tests are
    done.
    """
    place = tmp_path_factory.mktemp("wine")
    known = os.environ | {
        "WINEPREFIX": str(place),
        "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree,mshtml=",
    }
    yield known
    subprocess.run(["wineserver", "--kill"], env=known, check=False, capture_output=True)
    shutil.rmtree(place, ignore_errors=True)


def said(
    unit: fmu.FMU,
    folder: Path,
    machine: str,
    command: list[str],
    environment: dict[str, str] | None = None,
) -> np.ndarray:
    """All variables (s, v) of 100 steps of the library of a machine, under its own loader."""
    one, place = (
        next(each for each in binaries.MACHINES if each.folder == machine),
        folder / machine,
    )
    place.mkdir()
    sources = []
    for path, text in {**unit.files, "windows.c": template("windows.c")}.items():
        (place / Path(path).name).write_text(text)
        sources += [Path(path)] if path.endswith(".c") else []
    made = binaries.compile_for(one, *binaries.find_compiler(), sources, place)
    assert isinstance(made, bytes), made
    (place / f"model.{one.ending}").write_bytes(made)
    step = next(k for k, each in enumerate(unit.variables) if each.causality == "input")
    words = {
        "VERSION": unit.version,
        "TOKEN": f'"{unit.token}"',
        "VARIABLES": len(unit.variables),
        "INPUT": step,
        "STEP": STEP.step,
    }
    defined = [f"-D{key}={value}" for key, value in words.items()]
    ends = (
        ["-nostdlib", "-fno-builtin", "-lkernel32", "-Wl,-e,start"]
        if one.ending == "dll"
        else ["-ldl"]
    )
    program = place / ("driver.exe" if one.ending == "dll" else "driver")
    driver = Path(__file__).with_name("driver.c")
    line = [
        *ZIG,
        "-target",
        one.target,
        "-std=c99",
        "-O1",
        "-fno-sanitize=all",
        *defined,
        str(driver),
        *ends,
        "-o",
        str(program),
    ]
    subprocess.run(line, check=True, capture_output=True)
    run = subprocess.run(
        [*command, str(program)],
        cwd=place,
        env=environment,
        capture_output=True,
        check=True,
        timeout=300,
    )
    rows = [line.split() for line in run.stdout.decode().split("\n") if line]
    return np.array([[int(word, 16) for word in row] for row in rows], dtype=np.uint64)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("machine", ["x86_64-windows", "aarch64-linux"])
def test_other_machines_find_the_same_numbers_to_the_bit(
    machine: str,
    version: int,
    plant: System,  # noqa: F811
    tmp_path: Path,
    request: pytest.FixtureRequest,
) -> None:
    unit = fmu.write(c_files.write(Case(plant, STEP, 0.3), "plant", "a plant"), version, "a plant")
    if machine == "x86_64-windows":
        if not shutil.which("wine"):
            pytest.skip("wine is not installed")
        found = said(unit, tmp_path, machine, ["wine"], request.getfixturevalue("prefix"))
    else:
        if not shutil.which("qemu-aarch64") or not LIBRARIES.exists():
            pytest.skip("qemu-aarch64 (qemu-user) and libc6-arm64-cross are not installed")
        found = said(unit, tmp_path, machine, ["qemu-aarch64", "-L", str(LIBRARIES)])
    own = said(unit, tmp_path, "x86_64-linux", [])
    assert own.shape == (101, len(unit.variables))
    values = own.view(np.float64)
    assert np.ptp(values[:, 2:], axis=0).min() > 0.0
    np.testing.assert_array_equal(found, own)
