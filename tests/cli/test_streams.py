"""Standard streams that are closed, full or have lost their reader, and an environment that switches compilation off."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ..robustness.inputs import BEAM, beam

FMBS = [sys.executable, "-c", "from fmbs_skfem.cli.main import main; main()"]

pytestmark = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return beam(tmp_path_factory.mktemp("streams"), BEAM)


def shell(command: str, path: Path) -> subprocess.CompletedProcess[str]:
    """A line of a shell in which `$FMBS` is the command and `$SCENE` a right scene."""
    variables = {**os.environ, "SCENE": str(path), "OUT": str(path.parent / "out")}
    variables.pop("PYTHONUNBUFFERED", None)  # streams as users have them
    text = command.replace("$FMBS", " ".join(f"'{part}'" for part in FMBS))
    text = text.replace("$SCENE", '"$SCENE"').replace("$OUT", '"$OUT"')  # folders of temporary files may have spaces
    return subprocess.run(["bash", "-c", text], env=variables, cwd=path.parent, capture_output=True, text=True, timeout=900)


@pytest.mark.parametrize(
    ("command", "code", "words"),
    [
        ("$FMBS check $SCENE --json > /dev/full", 6, "stdout: expected an output that takes what is printed, got no space left"),
        ("$FMBS check $SCENE > /dev/full", 6, "stdout: expected"),
        ("$FMBS check $SCENE >&-", 3, "stdout: expected an output that takes what is printed, got bad file descriptor"),
        ("$FMBS check nowhere.yaml --json > /dev/full", 3, "nowhere.yaml"),
        ("$FMBS check nowhere.yaml --json >&-", 3, "nowhere.yaml"),
        ("$FMBS check $SCENE | true; exit ${PIPESTATUS[0]}", 3, "got broken pipe"),
        ("$FMBS --help > /dev/full", 6, "No space left"),
        ("NUMBA_DISABLE_JIT=1 $FMBS run $SCENE --out $OUT", 3, "NUMBA_DISABLE_JIT: expected 0"),
        ("$FMBS check $SCENE 2>&-", 0, ""),
        ("$FMBS check $SCENE --set nothing=1 2> /dev/full", 3, ""),
    ],
)
def test_streams_that_take_nothing(command: str, code: int, words: str, path: Path) -> None:
    done = shell(command, path)
    assert done.returncode == code, done.stderr
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert not (path.parent / "internal_error.json").exists()


def test_results_are_kept_where_nobody_reads_the_summary(path: Path) -> None:
    """Files get no number of a closed stream, so that what is printed cannot reach them."""
    assert shell("$FMBS run $SCENE --out $OUT >&- 2>&- <&-", path).returncode == 3
    assert {"outputs.csv", "report.json", "outputs.png"} <= {file.name for file in (path.parent / "out").iterdir()}
    assert shell("$FMBS check $OUT", path).returncode == 0
