"""`fmbs schema`: what may stand in a scene file, as a JSON schema and as a page."""

from __future__ import annotations

import click

from . import common, reports
from .common import Result, Session

NAME = "scene.schema.json"


@common.command("schema", scene=False)
@click.option("--page", is_flag=True, help="Print a page for people (Markdown) instead: every key with what it takes.")
def command(session: Session, page: bool) -> Result:
    """Print the JSON schema of scene files; --out also writes it into a folder, for editors that complete YAML by it."""
    from .. import scenes
    from ..scenes import reference

    found = scenes.json_schema()
    if session.out is not None:
        reports.write_json(reports.folder(session, session.out, [NAME], "schema", record=NAME) / NAME, found)
    return Result(found, [reference.page(found).rstrip("\n") if page else reports.dumps(found)])
