"""Standard streams that are closed, full or have lost their reader, and an environment that
switches compilation off.
"""

from __future__ import annotations

import os
import re
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
    # folders of temporary files may have spaces
    text = text.replace("$SCENE", '"$SCENE"').replace("$OUT", '"$OUT"')
    return subprocess.run(
        ["bash", "-c", text],
        env=variables,
        cwd=path.parent,
        capture_output=True,
        text=True,
        timeout=900,
    )


@pytest.mark.parametrize(
    ("command", "code", "words"),
    [
        (
            "$FMBS check $SCENE --json > /dev/full",
            6,
            "stdout: expected an output that takes what is printed, got no space left",
        ),
        ("$FMBS check $SCENE > /dev/full", 6, "stdout: expected"),
        (
            "$FMBS check $SCENE >&-",
            3,
            "stdout: expected an output that takes what is printed, got bad file descriptor",
        ),
        ("$FMBS check nowhere.yaml --json > /dev/full", 3, "nowhere.yaml"),
        ("$FMBS check nowhere.yaml --json >&-", 3, "nowhere.yaml"),
        ("$FMBS check nowhere.yaml --json | true; exit ${PIPESTATUS[0]}", 3, "nowhere.yaml"),
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
    assert {"outputs.csv", "report.json", "outputs.png"} <= {
        file.name for file in (path.parent / "out").iterdir()
    }
    assert shell("$FMBS check $OUT", path).returncode == 0


TERMINAL = """
import fcntl, os, pty, struct, sys, termios
child, terminal = pty.fork()
if child == 0:
    os.execvp(sys.argv[1], sys.argv[1:])
fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 80, 0, 0))
said = b""
try:
    while found := os.read(terminal, 65536):
        said += found
except OSError:
    pass
sys.stdout.buffer.write(said)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.mark.parametrize("arguments", [["check"], ["run", "--no-plots"]])
def test_a_terminal_of_80_columns_cuts_no_word_and_no_number(
    path: Path, arguments: list[str]
) -> None:
    """All words that a file gets are there, in lines that fit, and only a word that is longer alone
    makes a longer one.
    """
    command = [*FMBS, *arguments, str(path), "--force", "--out", "out"]
    wide = subprocess.run(command, cwd=path.parent, capture_output=True, text=True, timeout=300)
    narrow = subprocess.run(
        [sys.executable, "-c", TERMINAL, *command],
        cwd=path.parent,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert (wide.returncode, narrow.returncode) == (0, 0)
    said = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", narrow.stdout)
    assert max(len(line) for line in said.splitlines() if len(line.split()) > 1) <= 80
    unlike = {word for word in wide.stdout.split() if not set(word) <= set("─")} - set(said.split())
    assert all(re.fullmatch(r"[-+.e\d]+s?", word) for word in unlike), (
        unlike
    )  # times and memory differ from run to run


@pytest.mark.parametrize("options", ["", "--json"])
def test_a_reader_that_leaves_is_no_error(options: str, path: Path) -> None:
    """As `| head` does: nothing is printed, and the exit code is that of a process which SIGPIPE
    ends.
    """
    done = shell(f"$FMBS check $SCENE {options} | true; exit ${{PIPESTATUS[0]}}", path)
    assert (done.returncode, done.stderr) == (141, "")
