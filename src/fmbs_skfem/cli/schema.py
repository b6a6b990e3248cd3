"""`fmbs schema`: the JSON schema of scene files."""

from __future__ import annotations

from . import common, reports
from .common import Result, Session

NAME = "scene.schema.json"


@common.command("schema", scene=False)
def command(session: Session) -> Result:
    """Print the JSON schema of scene files; --out also writes it into a folder, for editors that complete YAML by it."""
    from .. import scenes

    found = scenes.json_schema()
    if session.out is not None:
        reports.write_json(reports.folder(session, session.out, [NAME], "schema", record=NAME) / NAME, found)
    return Result(found, [reports.dumps(found)])
