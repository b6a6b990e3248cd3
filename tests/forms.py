"""The reduced, hyper-reduced and saved form of a system, for what has to be alike in all of them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from fmbs_skfem.dynamics import Trajectory
from fmbs_skfem.reduction import files
from fmbs_skfem.reduction.hyper import sampling
from fmbs_skfem.reduction.spaces import component, galerkin
from fmbs_skfem.systems import System


class Forms(NamedTuple):
    """Forms of one system."""

    reduced: System
    hyper_reduced: System
    saved: System  #: the hyper-reduced one, from its file


def forms(raw: System, full: Trajectory, tolerance: float, path: Path) -> Forms:
    """Forms of a system with all multipliers, trained on a motion of it; every body a component of
    its own.
    """
    data, level = galerkin.snapshots(full), component.body_level(raw)
    bases = galerkin.bases(raw, data, level, tolerance)
    reduced = galerkin.reduce_system(raw, level, bases)
    hyper_reduced = sampling.apply(
        reduced, sampling.train([(reduced, component.projected(reduced, data.q))], 1e-8)
    )
    return Forms(reduced, hyper_reduced, files.load(files.save(hyper_reduced, path)))
