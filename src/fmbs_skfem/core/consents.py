"""Consent to the Python files of scenes, which are programs: they are run where whoever reads the
scene allows it.

    fmbs run scene.yaml --allow-extensions      scenes.read(path, extensions="allow")      FMBS_EXTENSIONS=allow

`allow` runs them, `refuse` does not. `ask`, the default, is a question on a terminal, whose answer
is remembered by the SHA-256 of the files, elsewhere a refusal that names them and the call that
allows them. What a call says goes before the environment.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator, Mapping
from contextvars import ContextVar
from pathlib import Path

from .errors import InputError, closest, say
from .values.problems import Problem

SWITCH = "FMBS_EXTENSIONS"
WORDS = ("allow", "ask", "refuse")
REMEDY = f"read what it would run, then call with --allow-extensions (in Python extensions='allow'), or set {SWITCH}=allow"
_GIVEN: ContextVar[str | None] = ContextVar("consent", default=None)  #: what the call says


@contextlib.contextmanager
def given(word: str | None) -> Iterator[None]:
    """What is read inside has this consent, one of WORDS; None says nothing.

    InputError for another word.
    """
    if word is None:
        yield
        return
    token = _GIVEN.set(checked("extensions", word))
    try:
        yield
    finally:
        _GIVEN.reset(token)


def checked(place: str, word: str) -> str:
    """A word of WORDS."""
    if word not in WORDS:
        raise InputError(
            say(place, "one of " + ", ".join(WORDS), f"{word!r}{closest(word, WORDS)}")
        )
    return word


def current() -> str:
    """What the call says, or the environment; InputError where that is none of WORDS."""
    return _GIVEN.get() or checked(f"environment: {SWITCH}", os.environ.get(SWITCH, "ask"))


def require(files: Mapping[Path, str]) -> None:
    """Problem where files may not be run, of which the SHA-256 is given."""
    word = current()
    if word == "allow":
        return
    known = set() if word == "refuse" else remembered()
    new = {path: digest for path, digest in files.items() if digest not in known}
    if new and (word == "refuse" or not ask(new)):
        raise Problem("consent to run Python files", f"none for {', '.join(map(str, new))}", REMEDY)


def store() -> Path:
    """The file of what was allowed on a terminal: SHA-256 and path in lines."""
    import platformdirs

    return Path(platformdirs.user_config_dir("fmbs_skfem", appauthor=False)) / "allowed_extensions"


def remembered() -> set[str]:
    """SHA-256 of the files that were allowed on a terminal."""
    with contextlib.suppress(OSError):
        return {
            line.split(" ", 1)[0]
            for line in store().read_text(encoding="utf-8", errors="replace").splitlines()
            if line
        }
    return set()


def ask(files: Mapping[Path, str]) -> bool:
    """Whether a person at the terminal allows files, which is remembered; False where nobody sits
    there.
    """
    if not all(stream is not None and stream.isatty() for stream in (sys.stdin, sys.stderr)):
        return False
    listed = "".join(f"  {path}\n" for path in files)
    sys.stderr.write(
        f"The scene would run these Python files with all your rights:\n{listed}Run them, now and later? [y/N] "
    )
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        return False
    with contextlib.suppress(OSError):  # it is asked again
        store().parent.mkdir(parents=True, exist_ok=True)
        with store().open("a", encoding="utf-8") as file:
            file.writelines(f"{digest} {str(path)!r}\n" for path, digest in files.items())
    return True
