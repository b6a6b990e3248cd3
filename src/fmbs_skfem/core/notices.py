"""What a user should know but what stops nothing."""

from __future__ import annotations

import warnings


class Notice(UserWarning):
    """A notice; the command prints it on stderr, `--json` lists it under `notices`."""


class Remark(Notice):
    """A notice of what is as it should be: `--strict` does not take it for an error."""


def notify(text: str) -> None:
    """Give a notice to the caller of the library."""
    warnings.warn(text, Notice, stacklevel=3)


def remark(text: str) -> None:
    """Give a remark to the caller of the library."""
    warnings.warn(text, Remark, stacklevel=3)
