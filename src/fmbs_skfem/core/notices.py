"""What a user should know but what stops nothing."""

from __future__ import annotations

import warnings


class Notice(UserWarning):
    """A notice; the command prints it on stderr, `--json` lists it under `notices`."""


def notify(text: str) -> None:
    """Give a notice to the caller of the library."""
    warnings.warn(text, Notice, stacklevel=3)
