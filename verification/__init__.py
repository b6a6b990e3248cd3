"""Verification: cases held against published and exact results; `registry` says what a case is."""

from . import beams, dynamics, integrator, plates, pressure, rigid, shells_large, statics, statics_shells, vibration
from .registry import CASES, GROUPS, OUTSIDE, CheckedNumber, Outcome, VerificationCase, case, farthest, find, order, run, slope

__all__ = [
    "GROUPS",
    "CheckedNumber",
    "VerificationCase",
    "Outcome",
    "CASES",
    "OUTSIDE",
    "case",
    "find",
    "run",
    "farthest",
    "order",
    "slope",
    "statics",
    "statics_shells",
    "shells_large",
    "pressure",
    "vibration",
    "dynamics",
    "rigid",
    "integrator",
    "beams",
    "plates",
]
