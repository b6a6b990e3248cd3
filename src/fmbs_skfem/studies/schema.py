"""What may stand in a scene file, as a JSON schema and as a page."""

from __future__ import annotations

from ..scenes import json_schema, reference
from . import job as jobs
from . import reports
from .job import Job
from .result import Result

NAME = "scene.schema.json"


def describe(job: Job, page: bool) -> Result:
    """The JSON schema, also in the folder of a job; printed, it is the schema, or the `page` for people."""
    found = json_schema()
    out = jobs.settle_folder(job, [NAME], "schema", NAME)
    if out is not None:
        reports.write_json(out / NAME, found)
    text = reference.page(found).rstrip("\n") if page else reports.dumps(found)
    return Result(about="JSON schema of scene files", report=found, lines=[text])
