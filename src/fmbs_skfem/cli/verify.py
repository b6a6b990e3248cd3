"""`fmbs verify`: the registered cases beside their published and exact references, as a table, a page, JSON and pictures."""

from __future__ import annotations

from typing import Any

import click

from .. import studies
from . import common


@common.command("verify", scene=False)
@click.option("--case", "names", metavar="NAME", multiple=True, help="A case; may be given several times.")
@click.option("--group", "groups", metavar="GROUP", multiple=True, help="A group of cases; may be given several times.")
@click.option("--list", "listed", is_flag=True, help="List the cases and solve nothing.")
def command(names: tuple[str, ...], groups: tuple[str, ...], listed: bool, **options: Any) -> studies.Result:
    """Solve the cases of the verification suite (all by default) and hold them against their references.

    --out writes verification.md, verification.json and a picture a group. The exit code is 4 when a quantity is off.
    """
    return studies.cases(names, groups) if listed else studies.verify(names, groups, **options)
