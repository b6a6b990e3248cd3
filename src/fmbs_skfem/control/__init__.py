"""What acts on a run while it goes on: inputs, controllers, events, monitors; live runs."""

from . import controllers, events, feed, line_ends, monitors  # which offer observers  # noqa: F401
from .live import LiveRun, start

__all__ = ["LiveRun", "controllers", "environments", "events", "monitors", "start"]
