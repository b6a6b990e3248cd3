"""Units in which people read numbers: the rule, prefixes, heads and tables."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fmbs_skfem.core.values import display
from fmbs_skfem.core.values.display import SI, DisplayUnits

TYPED = DisplayUnits((), ("mm", "s", "GPa", "ms", "rpm", "deg", "kN", "kJ"))
IMPERIAL = DisplayUnits((), ("psi", "in", "lbf"))


@pytest.mark.parametrize(
    ("unit", "largest", "wanted"),
    [
        ("m", 0.5, ("mm", 1e-3)),  # the first unit that was typed
        ("m", 1.0, ("mm", 1e-3)),  # 1000 mm are read as easily
        ("m", 25.0, ("m", 1.0)),  # 25 000 mm are too many
        ("m", 1e-5, ("µm", 1e-6)),  # and 0.01 mm too few
        ("s", 0.5, ("ms", 1e-3)),  # 500 ms go before 0.5 s
        ("s", 3.0, ("s", 1.0)),
        ("s", 9000.0, ("s", 1.0)),  # nobody reads kiloseconds
        ("Pa", 3e9, ("GPa", 1e9)),
        ("Pa", 2e6, ("MPa", 1e6)),  # 0.002 GPa is not read
        ("rad/s", 30.0, ("rpm", math.pi / 30)),
        ("rad/s", 1e-6, ("rpm", math.pi / 30)),  # no prefix, and no SI unit where none was typed
        ("rad", 0.0, ("deg", math.pi / 180)),
        ("J", 2500.0, ("kJ", 1e3)),
        ("N m", 2500.0, ("kN m", 1e3)),  # a moment is no energy
        ("", 1e6, ("", 1.0)),
        ("-", 1e6, ("-", 1.0)),
        ("%", 12.0, ("%", 1.0)),
        ("rpm", 3e5, ("rpm", 1.0)),  # what is not in SI stays
    ],
)
def test_one_rule(unit: str, largest: float, wanted: tuple[str, float]) -> None:
    name, size = TYPED.find(unit, largest)
    assert (name, size) == (wanted[0], pytest.approx(wanted[1], rel=1e-15, abs=0.0))


def test_units_that_are_not_metric_stay() -> None:
    """A prefix would lead from pounds to newtons."""
    for largest in (1e-9, 1.0, 1e12):
        assert IMPERIAL.find("Pa", largest)[0] == "psi"
        assert IMPERIAL.find("m", largest)[0] == "in"
        assert IMPERIAL.find("N", largest)[0] == "lbf"
    assert IMPERIAL.find("m", 1.0)[1] == pytest.approx(0.0254, rel=1e-15, abs=0.0)


@pytest.mark.parametrize(
    ("unit", "largest", "wanted"),
    [
        ("N", 25e3, "kN"),
        ("m", 0.0123, "mm"),
        ("s", 4.2e-5, "µs"),
        ("Pa", 3.1e6, "MPa"),
        ("N m", 0.02, "mN m"),
        ("N/m", 5e4, "kN/m"),
        ("N m^2", 2e4, "kN m^2"),
        ("m/s^2", 9.81, "m/s^2"),
        ("m", 999.99, "m"),
        ("m", 1e-16, "m"),  # round-off
        ("m^2", 1e-6, "m^2"),  # 1e-6 m^2 is 1 mm^2, and not 1 um^2
        ("1/m", 1e5, "1/m"),
        ("kg", 1e-3, "kg"),
        ("kg m^2", 1e-5, "kg m^2"),
        ("rad", 1e-3, "rad"),
        ("rad/s", 1e4, "rad/s"),
        ("m", 0.0, "m"),
        ("m", math.inf, "m"),
    ],
)
def test_prefixes_put_the_largest_number_between_1_and_1000(
    unit: str, largest: float, wanted: str
) -> None:
    name, size = SI.find(unit, largest)
    assert name == wanted
    if name != unit:
        assert 1.0 <= largest / size < 1000.0
        assert size == pytest.approx(
            display.describe(name)[1], rel=1e-15, abs=0.0
        )  # the prefix means what it says


def test_what_is_asked_for_goes_first() -> None:
    asked = DisplayUnits(("m", "MPa"), TYPED.typed)
    assert asked.find("m", 1e-3) == ("m", 1.0)
    assert asked.find("Pa", 5e12) == ("MPa", 1e6)
    assert asked.find("s", 3.0) == ("s", 1.0)


def test_units_are_those_of_quantities_in_their_order() -> None:
    scene = {
        "name": "a rod of 3 ft",
        "speed": {"value": "300 rpm", "range": ["100 rpm", 60.0]},
        "angle": "300 rpm * t + 5 deg * (1 - exp(-t / 2 ms))",
        "mesh": "meshes/beam_20.msh",
        "at": ["rod.left", "10 mm", "7.85 t/m^3"],
        "count": 3,
    }
    assert list(dict.fromkeys(display.typed_in(scene))) == ["rpm", "deg", "ms", "mm", "t/m^3"]


def test_heads_rows_and_columns() -> None:
    assert TYPED.head("tip_x: x [m], round-off", [0.2, np.nan]) == (
        "tip_x: x [mm], round-off",
        1e-3,
    )
    assert TYPED.head("a name", [0.2]) == ("a name", 1.0)
    head, values = TYPED.row("motor [rad/s]", [10 * math.pi, -math.pi])
    assert (head, values) == ("motor [rpm]", pytest.approx([300.0, -30.0], rel=1e-15))
    heads, rows = TYPED.columns(
        ("", "W [rad/s]", "F [N]", "way [m]", "x [m]"),
        [("a", math.pi, 50.0, "1.0", 0.5), ("b", 0.0, 0.0, 2.0, None)],
    )
    assert heads == [
        "",
        "W [rpm]",
        "F [N]",
        "way [m]",
        "x [mm]",
    ]  # texts are in the unit of their head; columns take no prefix
    assert rows == [["a", pytest.approx(30.0), 50.0, "1.0", 500.0], ["b", 0.0, 0.0, 2.0, None]]


def test_reports_keep_them() -> None:
    assert DisplayUnits.of({display.KEY: {"asked": ["mm"], "typed": ["s", "rpm"]}}) == DisplayUnits(
        ("mm",), ("s", "rpm")
    )
    for other in ({}, {display.KEY: None}, {display.KEY: {"asked": 3}}):
        assert DisplayUnits.of(other) == SI
