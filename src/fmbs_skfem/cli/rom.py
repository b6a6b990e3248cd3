"""`fmbs rom`: what a saved reduced model is, and its motion at wanted parameters; `fmbs run` of such a file is the same.

Two kinds of files: models at one set of parameters (`fmbs reduce`), and models of a whole box of parameters (`fmbs train`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .. import studies
from . import common


@click.group("rom", epilog="Both take --json and, for what they write, --out DIR.")
def command() -> None:
    """Saved reduced models: what one is, and its motion at wanted parameters, without meshes and full model."""


@common.command("info", scene=False)
@common.FILE
def info(path: Path, **options: Any) -> studies.Result:
    """Say what the reduced model in FILE is: parameters with their ranges, sizes, training, errors; --out writes info.json."""
    return studies.info(path, **options)


@common.command("run", scene=False, into="fmbs-{}")
@common.FILE
@common.SET(help="Value of a parameter, in SI units or with its unit; without it the nominal one.")
@click.option("--duration", type=float, metavar="SECONDS", help="Instead of the duration of the training.")
@click.option("--step", type=float, metavar="SECONDS", help="Instead of the step of the training.")
@common.PLOTS
@click.option("--picture", is_flag=True, help="Draw the bodies into picture.png, lifted to their centre lines and surfaces.")
def run(path: Path, **options: Any) -> studies.Run:
    """Run the reduced model in FILE at values of its parameters and state the error predicted there.

    Writes outputs.csv (time in column t), report.json and outputs.png into --out, or into ./fmbs-NAME where NAME.h5 is the file.
    """
    return studies.run_model(path, **options)


command.add_command(info)
command.add_command(run)
