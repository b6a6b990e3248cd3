"""Errors of outputs: in their unit and as parts of their ranges, for a known difference of two
motions.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.reduction.accuracy import output_errors
from fmbs_skfem.reduction.spaces import component, galerkin
from fmbs_skfem.systems import eliminate
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.system import Output
from tests import models

T = np.linspace(0.0, 1.0, 201)
KNOWN = {
    "tip": Output("position", (), ("tip_x", "tip_y", "tip_z")),
    "clamp": Output("reaction", (), ("clamp_x", "clamp_slope_x"), "clamp"),
    "still": Output("position", (), ("still",)),
}


def reference() -> dict[str, np.ndarray]:
    return {
        "tip_x": 200.0 + 2.0 * T,
        "tip_y": 1e-6 * T,
        "tip_z": 0.0 * T,
        "clamp_x": 10.0 * np.sin(2 * np.pi * T),
        "clamp_slope_x": 0.5 * T,
        "still": 200.0 + 0.0 * T,
    }


def changed(**by: float) -> Mapping[str, np.ndarray]:
    return {name: values + by.get(name, 0.0) * T**2 for name, values in reference().items()}


def test_errors_stand_in_their_unit_and_as_parts_of_their_range() -> None:
    found = output_errors.between(
        reference(), changed(tip_x=1e-3, clamp_x=0.2, clamp_slope_x=0.01), KNOWN
    )
    assert found["tip_x"].error == pytest.approx(1e-3, rel=1e-9)
    assert found["tip_x"].relative == pytest.approx(5e-4, rel=1e-9)
    assert (found["clamp_x"].range, found["clamp_x"].relative) == pytest.approx(
        (20.0, 0.01), rel=1e-12
    )
    assert found["clamp_slope_x"].relative == pytest.approx(0.02)
    assert [found[name].unit for name in ("tip_x", "clamp_x", "clamp_slope_x")] == ["m", "N", "N m"]
    assert output_errors.measure(found) == pytest.approx(0.02)


@pytest.mark.parametrize("unit,least", [("m", 0.02), ("rad", 0.02), ("N", 0.1), ("m/s", 0.1)])
def test_positions_and_angles_that_are_lost_are_named(unit: str, least: float) -> None:
    """A small turn of what swings far, lost by a tenth in a model whose motion errs by 1e-4; forces
    err by ten times more.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        output_errors.warn_of_wrong({"a": 0.9 * least}, {"a": unit})
    with pytest.warns(Notice, match="a is off by"):
        output_errors.warn_of_wrong({"a": 1.1 * least}, {"a": unit})


def test_a_column_that_hardly_moves_counts_relative_to_its_output() -> None:
    """1e-9 m of a component that moves by 1e-6 m beside one that moves by 2 m is 5e-8 of what
    counts, a hundredth of 2 m.
    """
    found = output_errors.between(reference(), changed(tip_y=1e-9, tip_z=1e-9), KNOWN)
    assert [found[name].relative for name in ("tip_y", "tip_z")] == pytest.approx(
        [5e-8, 5e-8], rel=1e-6
    )
    assert found["tip_y"].range == pytest.approx(1e-6)


def test_how_fast_a_contact_slides_counts_where_both_motions_touch() -> None:
    """It is 0 where nothing touches and jumps there: motions that touch a little sooner or later
    are not wrong by all of it.
    """
    sliding, forces = np.where(T > 0.5, 1.0 + T, 0.0), np.maximum(T - 0.5, 0.0)
    ours = {"c_force": forces, "c_friction": 0.3 * forces, "c_gap": 0.5 - T, "c_slip": sliding}
    known = {"c": Output("contact", (), tuple(ours))}
    late = ours | {"c_slip": np.where(T > 0.52, 1.01 + T, 0.0)}
    found = output_errors.between(ours, late, known)
    assert found["c_slip"].error == pytest.approx(0.01)
    shifted = ours | {"c_gap": np.where(T > 0.52, 0.5 - T, 0.0)}
    assert output_errors.between(ours, shifted, known)["c_gap"].error == pytest.approx(0.5)


def test_the_energy_balance_counts_relative_to_the_energies() -> None:
    """A balance that drifts by 1e-6 J beside an exchange of 2 J."""
    parts = ("kinetic", "strain", "potential", "balance")
    known = {"energy": Output("energy", (), tuple(f"energy_{part}" for part in parts))}
    mine = dict(zip(known["energy"].columns, (2.0 * T, T**2, -3.0 * T, 1e-6 * T), strict=True))
    found = output_errors.between(mine, {**mine, "energy_balance": 3e-6 * T}, known)
    assert found["energy_balance"].range == pytest.approx(1e-6)
    assert found["energy_balance"].relative == pytest.approx(2e-6 / 3.0)


def test_what_stands_still_has_no_part_of_a_range_and_what_is_unknown_no_error() -> None:
    only = {"still": KNOWN["still"], "clamp": KNOWN["clamp"]}
    found = output_errors.between(
        reference(), {**changed(), "clamp_x": np.full(len(T), np.nan)}, only
    )
    assert math.isnan(found["still"].relative)
    assert found["still"].error == 0.0
    assert math.isnan(found["clamp_x"].error)
    assert output_errors.measure(found) == 0.0
    assert math.isnan(output_errors.measure({"still": found["still"]}))


def test_what_is_zero_up_to_round_off_counts_with_what_moves_elsewhere() -> None:
    """A force of 1e-9 N beside one of 20 N: other round-off is no error, 2 N in its place are ten
    times a hundredth of the 20 N.
    """
    known = {**KNOWN, "link": Output("reaction", (), ("link_x",), "link")}
    mine = {**reference(), "link_x": 1e-9 * np.sin(9.0 * T)}
    found = output_errors.between(mine, {**mine, "link_x": 2e-9 * np.cos(7.0 * T)}, known)
    assert found["link_x"].relative < 2e-8
    assert output_errors.between(mine, {**mine, "link_x": 2.0 * T}, known)[
        "link_x"
    ].relative == pytest.approx(10.0, rel=1e-6)
    assert output_errors.between(mine, {**mine, "still": 200.0 + 2.0 * T}, known)[
        "still"
    ].relative == pytest.approx(100.0)


def test_round_off_of_the_only_force_is_known_by_the_mechanism() -> None:
    """2 kg that cross 1 m in 0.1 ms take 2e8 N: 1 N is round-off of it."""
    system = replace(models.cantilever(2), scale=1.0, weight=2.0)
    nothing = output_errors.round_off(system, np.array([0.0, 1e-4]))
    assert nothing["N"] == pytest.approx(2.0, rel=1e-9)
    assert (nothing["m"], nothing["J"]) == pytest.approx((1e-8, 2.0), rel=1e-9)
    known = {"link": Output("reaction", (), ("link_x",), "link")}
    found = output_errors.between({"link_x": T}, {"link_x": 0.0 * T}, known, nothing=nothing)
    assert math.isnan(found["link_x"].relative)


def test_motions_that_events_end_are_compared_at_their_ends() -> None:
    times = np.array([0.0, 0.1, 0.2, 0.27]), np.array([0.0, 0.2, 0.26])
    pairs = np.array([0, 2]), np.array([0, 1])
    found = output_errors.with_ends(pairs, *times)
    assert [one.tolist() for one in found] == [[0, 2, 3], [0, 1, 2]]
    assert output_errors.with_ends(found, *times) is found


def test_tolerances_are_met_in_their_unit() -> None:
    found = output_errors.between(reference(), changed(tip_x=1e-3, clamp_x=5.0), KNOWN)
    assert output_errors.measure(found, {"tip": 1e-4}) == pytest.approx(10.0, rel=1e-9)
    assert output_errors.measure(found, {"tip": 1e-2, "clamp": 10.0}) == pytest.approx(
        0.5, rel=1e-9
    )


def test_a_reduced_cantilever_in_all_its_outputs() -> None:
    """A beam that is pushed: the errors are those that the two motions show, as far as the reduced
    one knows the output.
    """
    full = models.cantilever(
        6, lambda tip: [loads.PointForce("tip", tip, (0.0, -1.0))], all_multipliers=True
    )
    scheme, sharp = GeneralizedAlpha(2e-3), Newton(1e-12)
    motion = integrate(eliminate(full), scheme, 0.2, sharp)
    components = component.system_level(full)
    bases = galerkin.bases(full, galerkin.snapshots(motion), components, 1e-8)
    other = integrate(galerkin.reduce_system(full, components, bases), scheme, 0.2, sharp, 2)
    found = output_errors.compare(motion, other)
    mine, theirs = output_errors.columns(motion), output_errors.columns(other)
    assert set(found) == set(mine)
    for name, one in found.items():
        assert one.error == pytest.approx(
            float(np.abs(mine[name][::2] - theirs[name]).max()), nan_ok=True
        )
        assert one.range == float(np.ptp(mine[name][::2]))
    assert 1e-4 < found["tip_y"].relative < 1e-2 < output_errors.measure(found)
    assert all(math.isnan(one.error) for one in found.values() if one.output == "clamp"), (
        "its constraint is in the basis"
    )
    # at the start reactions and accelerations are those of a mesh or a basis alone
    waves = np.zeros_like(motion.a)
    waves[0] = 1e3
    found = output_errors.compare(motion, replace(motion, a=motion.a + waves))
    assert all(one.error == 0.0 for one in found.values())
    found = output_errors.compare(motion, replace(motion, a=motion.a + np.roll(waves, 1, axis=0)))
    assert found["clamp_y"].error > 0.1
    with pytest.raises(InputError, match="two trajectories with common times"):
        output_errors.compare(motion, replace(other, times=other.times + 1e-3))
