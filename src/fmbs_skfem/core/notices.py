"""What a user should know but what stops nothing."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, TypeAlias

Progress: TypeAlias = Callable[[float], None]  #: is called with the finished part of some work, 0 to 1


class Notice(UserWarning):
    """A warning; the command prints it on stderr, `--json` lists it under `notices`.

    Where it is raised, `partial` is the trajectory up to it, None where there is none.
    """

    partial: Any = None


class Remark(Notice):
    """A warning of what is as it should be: `--strict` does not treat it as an error."""


def notify(text: str) -> None:
    """Show a warning to the caller of the library."""
    warnings.warn(text, Notice, stacklevel=3)


def remark(text: str) -> None:
    """Show a remark to the caller of the library."""
    warnings.warn(text, Remark, stacklevel=3)
