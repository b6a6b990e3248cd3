"""What keeps a model from being exported, in the words of its scene, before it is trained; the
rules are those of exports.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...core import extras
from ...core.errors import InputError
from ...scenes import build, where, yamlfile

if TYPE_CHECKING:
    from ...core.values.problems import Problem
    from ...scenes import Scene
    from ...systems import System
    from ..job import Job


def find(scene: Scene, raw: System, ranged: bool) -> Iterator[tuple[str, Problem]]:
    """What a model of a scene cannot have in C, as messages name it, and why; `raw` is the full
    system as it was assembled.
    """
    from ...exports import (
        refusals,  # with SymPy, an extra, which nothing else of a check has a use for
    )

    return refusals.find(raw, build.stepped(scene).scheme, ranged)


def require(scene: Scene, raw: System, option: str) -> None:
    """InputError with all that a model of a scene cannot have in C, each with file, line and keys;
    MissingFeature without SymPy.
    """
    extras.need("symbols", option)
    if told := [
        problem.at(where(scene, *keys_of(scene, subject)))
        for subject, problem in find(scene, raw, scene.training is not None)
    ]:
        raise InputError("\n".join(told))


def announce(job: Job, scene: Scene, raw: System, ranged: bool = False) -> None:
    """Say before a training, in one line, what of a scene keeps its model from being exported."""
    if extras.there("symbols"):
        tell(
            job,
            [
                in_words(scene, subject)
                for subject in dict.fromkeys(subject for subject, _ in find(scene, raw, ranged))
            ],
        )


def tell(job: Job, found: list[str]) -> None:
    """Say what keeps a model from being exported, where there is anything."""
    if found:
        job.listener.tell(
            f"this model cannot be exported to C, as an FMU or into a page: {', '.join(found)}"
        )


def in_words(scene: Scene, subject: str) -> str:
    """What a subject is in the scene, such as "contact_plane 'floor' (line 34)"."""
    keys = keys_of(scene, subject)
    line = "" if scene.node is None else f" (line {yamlfile.line(scene.node, keys)})"
    if keys[0] in ("joints", "loads"):
        return f"{getattr(scene, keys[0])[keys[1]].word} '{keys[1]}'{line}"
    return f"{subject}{line}"


def keys_of(scene: Scene, subject: str) -> tuple[str, ...]:
    """The keys of a subject; of one that is nothing of the scene its words."""
    return build.subject(scene, subject) or (subject,)
