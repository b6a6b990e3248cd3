"""Copies of the example scenes; a first project, a folder with a copy of one and of the files that
it reads.
"""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

from ..core.errors import InputError, closest, say
from ..scenes import examples
from . import reports
from .job import Job
from .result import Result, list_files

FILE = re.compile(r"[\w./-]+\.\w+")  #: what may be the name of a file in a scene
NAME = re.compile(r"^name:.*$", re.MULTILINE)


def copy_examples(job: Job) -> Result:
    """The example scenes and their meshes, copied into the folder of a job."""
    if job.out is None:
        raise InputError(say("copy", "a folder for the examples", "none", "give one: out"))
    source = examples.folder()
    out = reports.make_folder(job.out)
    if (out / source.name).exists() and not job.force:
        raise InputError(
            say(
                f"--out {out}",
                "a folder without examples",
                f"one with {source.name}",
                "choose another one, or --force",
            )
        )
    for one in (source, source.parent / "meshes"):
        shutil.copytree(
            one, out / one.name, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True
        )
    files = sorted((out / source.name).glob(f"*{examples.SCENES}"))
    first = shlex.quote(str(out / source.name / examples.DEMO))
    text = f"copied {len(files)} scenes into {out / source.name}; look at one: fmbs check {first}"
    return Result(
        about=text, report={"status": "ok", "files": files, "notices": job.notices}, lines=[text]
    )


def copy_example(job: Job, like: str | None) -> Result:
    """The scene NAME/NAME.yaml, where NAME is the name of the folder of a job, and what it reads
    beside it.

    It is like the example NAME where there is one, and nothing else is asked for: who names an
    example wants that.
    """
    known = examples.names()
    out = job.path if job.out is None else job.out
    like = like or (job.path.name if job.path.name in known else Path(examples.DEMO).stem)
    if like not in known:
        raise InputError(
            say("like", f"one of the examples {', '.join(known)}", f"'{like}'")
            + closest(like, known)
        )
    scene = out / f"{out.name}{examples.SCENES}"
    if scene.exists() and not job.force:
        raise InputError(
            say(
                f"{out}",
                "a new folder",
                f"one with {scene.name}",
                "choose another name, or --force",
            )
        )
    source = examples.folder() / f"{like}{examples.SCENES}"
    text = source.read_text(encoding="utf-8")
    files = []
    for name in dict.fromkeys(files_in(source, text)):
        inside = Path(name).relative_to("..") if name.startswith("../") else Path(name)
        target = out / inside
        reports.make_folder(target.parent)
        files.append(Path(shutil.copy(source.parent / name, target)))
        text = text.replace(name, inside.as_posix())
    reports.make_folder(out)
    scene.write_text(NAME.sub(f"name: {out.name}", text), encoding="utf-8")
    written = [scene, *files]
    typed = shlex.quote(str(scene))
    lines = [
        f"look at it: fmbs check {typed}",
        f"solve it: fmbs run {typed}",
        *list_files({"files": written}),
    ]
    report = {
        "status": "ok",
        "scene": scene,
        "like": like,
        "files": written,
        "notices": job.notices,
    }
    return Result(about=f"{scene} like {like}", report=report, lines=lines)


def files_in(source: Path, text: str) -> Iterator[str]:
    """Names in a scene of files that are there."""
    yield from (
        name
        for name in FILE.findall(text)
        if (source.parent / name).is_file() and name != source.name
    )
