"""The one door for files of other programs: a child process reads them, within `TIME_LIMIT` and
`MEMORY_LIMIT`.

Whatever a file does to its reader (an error of any kind, a crash of native code, an endless loop,
all memory) is an InputError. The child is started with the interpreter that runs, and finds this
package where it was found here.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..core import errors
from ..core.notices import notify

TIME_LIMIT = 300.0  #: for one file [s]
#: of address space of the child [bytes]; Abaqus text of a million nodes takes 1.3 GiB
MEMORY_LIMIT = 4 * 2**30
BAD_INPUT, MISSING = 3, 7  #: exit codes of the child whose last line is the whole message

_START = "import sys; sys.path.append(sys.argv[1]); from fmbs_skfem.foreign import child; child.main(*sys.argv[2:])"
_ROOT = Path(__file__).resolve().parents[2]


@contextlib.contextmanager
def converted(path: Path, where: str, remedy: str) -> Iterator[Path]:
    """The path of what the child made of a file; `where` opens every error message, `remedy` ends
    those without one.
    """
    with tempfile.TemporaryDirectory(prefix="fmbs-") as folder:
        target = Path(folder) / "read"
        # Threads of BLAS would reserve address space by the core, which the limit counts.
        threads = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
        call = [
            sys.executable,
            "-P",
            "-c",
            _START,
            str(_ROOT),
            str(path.resolve()),
            str(target),
            where,
            str(MEMORY_LIMIT),
        ]
        try:
            done = subprocess.run(
                call,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                encoding="utf-8",
                errors="replace",
                timeout=TIME_LIMIT,
                env=os.environ | threads | {"PYTHONIOENCODING": "utf-8"},
            )
        except subprocess.TimeoutExpired:
            got = f"one that takes longer than {TIME_LIMIT:g} s"
            raise errors.InputError(
                errors.say(where, "a file that can be read", got, remedy)
            ) from None
        if done.returncode or not target.is_file():
            raise _failure(done, where, remedy)
        notify(*json.loads(done.stdout or "[]"))
        yield target


def _failure(done: subprocess.CompletedProcess[str], where: str, remedy: str) -> errors.FmbsError:
    """The error that the end of the child stands for."""
    said = (
        done.stderr.strip() or f"the end of its reader with code {done.returncode}"
    ).splitlines()[-1]
    if done.returncode == BAD_INPUT:
        return errors.InputError(json.loads(said))
    if done.returncode == MISSING:
        return errors.MissingFeature(json.loads(said))
    if "MemoryError" in said or "bad_alloc" in said or done.returncode < 0:
        said = f"one that needs more than {MEMORY_LIMIT / 2**30:g} GiB of memory, or ends its reader (code {done.returncode})"
    return errors.InputError(errors.say(where, "a file that can be read", said, remedy))
