"""Frames: the exact displacement of a rolled-up beam, selection of instants, errors against another
model, checks.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.results import frames, series

from . import rollup


def test_tip_displacement_of_half_a_circle() -> None:
    """At k = pi the tip of the unit beam is at (0, 2/pi): u = (-1, 2/pi, 0)."""
    lines = rollup.planar().bodies["beam"]
    np.testing.assert_allclose(
        frames.displacement(lines)[-1, -1], [-1.0, 2 / np.pi, 0.0], atol=1e-15
    )
    np.testing.assert_allclose(
        frames.magnitude(lines, "displacement")[-1, -1], np.hypot(1, 2 / np.pi), rtol=1e-15
    )
    assert np.isnan(frames.magnitude(lines, "torsion")).all()


def test_planar_and_spatial() -> None:
    assert frames.planar(rollup.planar())
    assert not frames.planar(rollup.spatial())


def test_instants() -> None:
    some = rollup.planar()
    assert frames.choose(some.times, [0.99, 0.0, 0.51]).tolist() == [0, 3, 6]
    assert frames.spread(some.times, 3).tolist() == [0, 3, 6]
    assert frames.spread(some.times, 100).tolist() == list(range(7))
    chosen = frames.select(some, np.array([0, 6]))
    np.testing.assert_array_equal(chosen.times, [0.0, 1.0])
    np.testing.assert_array_equal(chosen.bodies["beam"].fields["curvature"][:, 0], [0.0, np.pi])
    assert chosen.marks["root"].points.shape == (2, 3)
    with pytest.raises(InputError, match=r"between 0 and 1 s"):
        frames.choose(some.times, [1.5])


def test_error_against_the_full_model() -> None:
    full = rollup.planar()
    shift = np.array([3e-3, 4e-3, 0.0])
    moved = replace(
        full,
        bodies={"beam": replace(full.bodies["beam"], points=full.bodies["beam"].points + shift)},
    )
    np.testing.assert_allclose(
        frames.with_error(moved, full).bodies["beam"].fields["error"], 5e-3, rtol=1e-12
    )
    with pytest.raises(InputError, match="body 'I'"):
        frames.with_error(rollup.spatial(), full)
    with pytest.raises(InputError, match="sample both at the same instants"):
        frames.with_error(frames.select(full, np.array([0, 1])), full)


def test_a_path_whose_load_factor_turns_is_shown_point_by_point(tmp_path: Path) -> None:
    """Behind a limit point the load falls: pictures take evenly spread points of the path, and a
    series numbers them.
    """
    path = replace(rollup.planar(), times=np.array([0.0, 0.5, 0.9, 0.4, 0.1, 0.6, 1.0]))
    assert frames.spread(path.times, 4).tolist() == [0, 2, 4, 6]
    assert frames.choose(path.times, [0.9]).tolist() == [2]
    listed = series.write(path, tmp_path, "path").read_text()
    assert re.findall(r'timestep="([^"]*)"', listed) == [f"{k}.0" for k in range(7)]


def test_bad_frames_are_refused_by_name() -> None:
    good = rollup.planar()
    lines = good.bodies["beam"]
    broken = lines.points.copy()
    broken[3, 5, 0] = np.nan
    with pytest.raises(InputError, match=r"body 'beam'\.points: expected finite numbers"):
        replace(good, bodies={"beam": replace(lines, points=broken)})
    with pytest.raises(InputError, match="field 'strain'"):
        replace(good, bodies={"beam": replace(lines, fields={"strain": np.zeros(3)})})
    with pytest.raises(InputError, match="did you mean 'clamp'"):
        replace(good, marks={"root": frames.joint("clmp", np.zeros((7, 3)))})
    with pytest.raises(InputError, match="each once"):
        replace(good, times=np.zeros(7))
    with pytest.raises(InputError, match="at least one body or joint"):
        replace(good, bodies={}, marks={})
    with pytest.raises(InputError, match="two reference points"):
        replace(good, bodies={"beam": replace(lines, reference=np.zeros((1, 3)))})
