"""`fmbs sweep`: many members of a scene or of a saved reduced model, on all cores or on a cluster."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import click

from .. import studies
from . import common


def limits(context: click.Context, option: click.Parameter, values: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """NAME=LOW:HIGH[:log] of --range."""
    found = {}
    for text in values:
        match = re.fullmatch(r"\s*(\w+)\s*=([^:]+):([^:]+?)(:\s*(?:log|linear)\s*)?", text)
        if match is None:
            raise click.BadParameter(f"expected NAME=LOW:HIGH or NAME=LOW:HIGH:log, got '{text}'", context, option)
        found[match[1]] = (match[2].strip(), match[3].strip(), *(["log"] if "log" in (match[4] or "") else []))
    return found


@common.command("sweep", into="fmbs-{}-sweep")
@click.option("--samples", metavar="N", help="Number of members; of a grid also N1xN2x...: values of each parameter.")
@click.option("--design", type=click.Choice(["sobol", "lhs", "grid", "list"]), help="How they are spread (default: sobol).")
@click.option("--list", "table", type=common.PATH, metavar="FILE.csv", help="Members from a table.")
@click.option("--seed", type=click.IntRange(0), default=0, help="Of sobol and lhs (default: 0).")
@click.option("--range", "ranges", metavar="NAME=LOW:HIGH[:log]", multiple=True, callback=limits, help="Range of a parameter.")
@click.option("--scheduler", metavar="ADDRESS", help="Run on a dask cluster (tcp://host:port) that sees the same files.")
@click.option("--workers", type=click.IntRange(1), help="Processes on this machine (default: one a core).")
@click.option("--timeout", type=float, metavar="SECONDS", help="Give up a member that takes longer.")
@click.option("--resume", is_flag=True, help="Go on with a sweep that was stopped: missing members only.")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of a scene.")
@click.option("--instants", type=click.IntRange(2), default=601, help="Stored instants of a history, at most (default: 601).")
@click.option("--plots/--no-plots", default=True, help="Draw response, scatter matrix and histories (default: yes).")
def command(path: Path, **options: Any) -> studies.SweepResult:
    """Run many members of SCENE, a scene whose parameters have ranges or a reduced model (NAME.h5) saved by `fmbs train`.

    Every member is stored when it is done, in members/ of the folder --out (default: fmbs-NAME-sweep). At the end the results stand
    in sweep.csv and sweep.h5, with plots. Members that fail, hang or lose their process are listed, the others finish, and the exit
    code is 5. Extremes of outputs are those at the stored instants.
    """
    return studies.sweep(path, **options)
