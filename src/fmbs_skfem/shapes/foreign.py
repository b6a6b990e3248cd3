"""Meshes of other programs, read by meshio in a process of its own: Abaqus `.inp`, Salome `.med`, VTK `.vtk`.

meshio ends the process on bad files and may take all memory on worse ones: whatever happens to it is an InputError here. Groups are
named sets of nodes and elements (NSET, ELSET), the groups of MED, and integer arrays of zeros and ones of `.vtk`.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from ..core import errors
from . import vtu
from .msh import Raw

SUFFIXES = (".inp", ".med", ".vtk")
TIME_LIMIT = 300.0  #: for one file [s]


def read(path: Path, where: str) -> Raw:
    """The points, cells and groups of a file; `where` opens every error message."""
    with tempfile.TemporaryDirectory(prefix="fmbs-") as folder:
        target = Path(folder) / "mesh.vtu"
        call = [sys.executable, "-P", str(Path(__file__).with_name("foreign_child.py")), str(path.resolve()), str(target)]
        try:
            done = subprocess.run(call, stdin=subprocess.DEVNULL, capture_output=True, errors="replace", timeout=TIME_LIMIT)
        except subprocess.TimeoutExpired:
            got = f"one that took longer than {TIME_LIMIT:g} s"
            raise errors.InputError(errors.say(where, "a file that meshio reads", got, "export it as .msh 4.1")) from None
        if done.returncode or not target.is_file():
            said = (done.stderr.strip() or done.stdout.strip() or f"its end with code {done.returncode}").splitlines()[-1]
            raise errors.InputError(errors.say(where, "a file that meshio reads", said, "export it again, or as .msh 4.1"))
        return vtu.read(target, where)
