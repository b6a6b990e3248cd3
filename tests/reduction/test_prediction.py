"""What speaks against the predicted error of a training, one reason after the other."""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.families import prediction

TRUE, HIGH = np.full(10, 1e-4), np.full(10, 1e-3)
PREDICTED = (1e-4, 1e-5, 5e-4)


def test_nothing_speaks_against_a_good_training() -> None:
    assert prediction.doubts(3, PREDICTED, TRUE, HIGH, 1e-3) == []
    assert prediction.doubts(2, PREDICTED, [], []) == []
    assert prediction.doubts(3, PREDICTED, TRUE, HIGH, 1e-3, part_error=1e-4) == []
    (parts,) = prediction.doubts(3, PREDICTED, TRUE, HIGH, 1e-3, part_error=0.6)
    assert (
        parts
        == "it is one against the mechanism with its parts, which err by up to 0.6 of an output: train these"
    )


def test_hold_out_points_say_more_than_a_wide_band() -> None:
    """Four of them that keep what was aimed at; three are too few, and so are ten of which one does
    not.
    """
    wide = 1e-4, 1e-5, 2e-3
    assert prediction.doubts(3, wide, TRUE[:4], HIGH[:4], 1e-3, aim=0.5) == []
    (few,) = prediction.doubts(3, wide, TRUE[:3], HIGH[:3], 1e-3, aim=0.5)
    (off,) = prediction.doubts(3, wide, np.append(TRUE[:9], 6e-4), HIGH, 1e-3, aim=0.5)
    assert few == off == "the predicted error reaches 0.002 with its band, the wanted one is 0.001"


def test_one_point_in_ten_may_lie_above_its_band() -> None:
    one = np.where(np.arange(10) < 1, 2e-3, TRUE)
    two = np.where(np.arange(10) < 2, 2e-3, TRUE)
    assert prediction.doubts(3, PREDICTED, one, HIGH) == []
    assert prediction.doubts(3, PREDICTED, two, HIGH) == [
        "2 of 10 hold-out points lie above the predicted band"
    ]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (
            {"unresolved": 2},
            "2 of 3 full motions are not resolved by their steps: take a smaller time step",
        ),
        ({"full_runs": 1}, "there is one full run only"),
        (
            {"true": np.append(TRUE[:9], np.nan)},
            "the full model has no motion at 1 of 10 hold-out points",
        ),
        (
            {"predicted": (1e-4, 1e-5, 2e-3), "true": TRUE[:3], "high": HIGH[:3]},
            "the predicted error reaches 0.002 with its band",
        ),
        (
            {"predicted": (1e-4, 1e-5, 2e-3), "true": 6 * TRUE},
            "the predicted error reaches 0.002 with its band, the wanted one is",
        ),
        (
            {"true": np.append(TRUE[:9], 1.5e-3), "high": 10 * HIGH},
            "1 of 10 hold-out points are above the wanted error 0.001",
        ),
        ({"predicted": (2.0, 1.0, 4.0), "tolerance": None}, "errors reach 2 of what is predicted"),
        ({"predicted": (1e-5, 1e-7, 9e-4)}, "it is uncertain by a factor of 9e+03"),
    ],
)
def test_every_reason(change: dict[str, object], told: str) -> None:
    given = {
        "full_runs": 3,
        "predicted": PREDICTED,
        "true": TRUE,
        "high": HIGH,
        "tolerance": 1e-3,
        "aim": 0.5,
    }
    (found,) = prediction.doubts(**{**given, **change})  # type: ignore[arg-type]
    assert found.startswith(told)
