"""What may stand in a scene file, as a JSON schema and as a page."""

from __future__ import annotations

from typing import Unpack

from ..scenes import json_schema, reference
from . import job as jobs
from . import reports
from .job import Shared
from .result import Result

NAME = "scene.schema.json"


def describe_scenes(*, page: bool = False, **shared: Unpack[Shared]) -> Result:
    """The JSON schema of scene files, for editors that complete YAML by it, also in the folder `out`.

    Printed, it is the schema, or the `page` for people: every key with what it takes.
    """
    with jobs.begin(**shared) as job:
        found = json_schema()
        out = jobs.settle_folder(job, [NAME], "schema", NAME)
        if out is not None:
            reports.write_json(out / NAME, found)
        text = reference.page(found).rstrip("\n") if page else reports.dumps(found)
        return Result(about="JSON schema of scene files", report=found, view=[text])
