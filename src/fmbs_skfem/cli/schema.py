"""`fmbs schema`: what may stand in a scene file, as a JSON schema and as a page."""

from __future__ import annotations

from typing import Any

import click

from .. import studies
from . import common


@common.command("schema", scene=False)
@click.option("--page", is_flag=True, help="Print a page for people (Markdown) instead: every key with what it takes.")
def command(**options: Any) -> studies.Result:
    """Print the JSON schema of scene files; --out also writes it into a folder, for editors that complete YAML by it."""
    return studies.describe_scenes(**options)
