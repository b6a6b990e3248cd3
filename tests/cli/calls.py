"""Calls of `fmbs` in this process, and small scenes for them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from fmbs_skfem.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"

#: a cantilever of 20 cells; what a test wants of it is filled in
CANTILEVER = """\
schema: 1
name: cantilever
dimension: 2
parameters: {{load: 0.5 N}}
bodies:
  beam:
    type: cable
    mesh: {mesh}
    line: beam
    section: {{shape: circular, diameter: 10 mm}}
    material: {{young_modulus: 1 GPa, density: 1800 kg/m^3}}
joints:
  clamp: {{type: clamp, at: beam.left}}
loads:
  tip: {{type: point_force, at: beam.right, force: [0, load], history: "{history}"}}
analysis: {analysis}
outputs:
  tip: {{type: position, at: beam.right}}
  clamp: {{type: reaction, joint: clamp}}
"""


@dataclass(frozen=True)
class Call:
    """How a call ended and what it said."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """The one object on stdout."""
        found = json.loads(self.out)
        assert isinstance(found, dict)
        return found


def fmbs(*arguments: str | Path) -> Call:
    """Call `fmbs` with these arguments."""
    done = CliRunner().invoke(main, [str(argument) for argument in arguments])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return Call(done.exit_code, done.stdout, done.stderr)


def scene(folder: Path, analysis: str, history: str = "1", text: str = CANTILEVER) -> Path:
    """A scene file with its mesh beside it."""
    mesh = folder / "beam_20.msh"
    mesh.write_bytes((ROOT / "meshes" / mesh.name).read_bytes())
    path = folder / "cantilever.yaml"
    path.write_text(text.format(mesh=mesh.name, analysis=analysis, history=history))
    return path
