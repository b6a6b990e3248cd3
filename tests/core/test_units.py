"""Quantities: values, dimensions, refusals."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values import expressions, functions, quantities, units
from fmbs_skfem.core.values.problems import Problem
from fmbs_skfem.core.values.responses import of_state, require
from fmbs_skfem.core.values.units import Dimension, Quantity


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("210 GPa", units.PRESSURE, 2.1e11),
        ("10 mm", units.LENGTH, 0.01),
        ("10mm", units.LENGTH, 0.01),
        ("1800 kg/m^3", units.DENSITY, 1800.0),
        ("1.8 g/cm^3", units.DENSITY, 1800.0),
        ("3 s", units.TIME, 3.0),
        ("5e-4 s", units.TIME, 5e-4),
        ("5 ms", units.TIME, 0.005),
        ("20 µs", units.TIME, 2e-5),
        ("9.81 m/s^2", units.ACCELERATION, 9.81),
        ("9.81 m s**-2", units.ACCELERATION, 9.81),
        ("-9.81 m/s/s", units.ACCELERATION, -9.81),
        ("90 deg", units.ANGLE, math.pi / 2),
        ("60 rpm", units.ANGULAR_VELOCITY, 2 * math.pi),
        ("60 U/min", units.ANGULAR_VELOCITY, 2 * math.pi),
        ("1 rev/s", units.ANGULAR_VELOCITY, 2 * math.pi),
        ("6 deg/min", units.ANGULAR_VELOCITY, math.pi / 1800),
        ("60 1/min", units.RATE, 1.0),
        ("1 in", units.LENGTH, 0.0254),
        ("3 in^2", units.AREA, 0.00193548),
        ("3 in * 2", units.LENGTH, 0.1524),
        ("1 ft", units.LENGTH, 0.3048),
        ("1 lbm", units.MASS, 0.45359237),
        ("1 lbf", units.FORCE, 4.4482216152605),
        ("1 lbf s^2/ft", units.MASS, 14.593902937206364),
        ("1 psi", units.PRESSURE, 6894.757293168362),
        ("30e3 ksi", units.PRESSURE, 206842718795.05086),
        ("2 kgf", units.FORCE, 19.6133),
        ("5 kNm", units.MOMENT, 5000.0),
        ("2 1/s", units.ANGULAR_VELOCITY, 2.0),
        ("1 1/s", units.RATE, 1.0),
        ("50 Hz", units.RATE, 50.0),
        ("15 N m", units.MOMENT, 15.0),
        ("15 N*m", units.MOMENT, 15.0),
        ("15 kN*mm", units.MOMENT, 15.0),
        ("4 N m^2", units.BENDING_STIFFNESS, 4.0),
        ("0.14 kg/m", units.LINE_DENSITY, 0.14),
        ("2 t", units.MASS, 2000.0),
        (0.25, units.LENGTH, 0.25),
        (3, units.PRESSURE, 3.0),
        ("1e3", units.PRESSURE, 1000.0),
    ],
)
def test_values(text: str | float, dimension: Dimension, value: float) -> None:
    assert quantities.convert(text, dimension) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("number", "unit", "value"),
    [("0.3", "mm", 0.3e-3), ("7", "mm", 0.007), ("90", "deg", math.pi / 2), ("1.1", "GPa", 1.1e9)],
)
def test_round_numbers_stay_round(number: str, unit: str, value: float) -> None:
    assert quantities.read(f"{number} {unit}").value == value


@pytest.mark.parametrize(
    ("text", "dimension", "message"),
    [
        ("210 GPa", units.LENGTH, r"expected a length \[m\], got '210 GPa' \(pressure\)"),
        ("10 mm", units.PRESSURE, r"expected a pressure \[Pa\], got '10 mm' \(length\)"),
        ("5 deg", units.LENGTH, r"expected a length \[m\], got '5 deg' \(angle\)"),
        ("1 rad/s", units.RATE, r"expected a rate \[1/s\], got '1 rad/s' \(angular velocity\)"),
        ("3 m", units.NUMBER, r"expected a number, got '3 m' \(length\)"),
        ("3 kg s", units.LENGTH, r"got '3 kg s' \(kg s\)"),
        ("3 mmm", units.LENGTH, r"did you mean 'mm'\?"),
        ("90°", units.ANGLE, r"known unit .* got '°'; did you mean 'deg'\?"),
        ("3 inch", units.LENGTH, r"known unit .* did you mean 'in'\?"),
        (
            "3000 1/min",
            units.ANGULAR_VELOCITY,
            "which counts turns in 1/min or hertz; .* 1 1/min is 1 rpm",
        ),
        ("1 g", units.ACCELERATION, "g is a gram"),
        ("10 mm + 2", units.LENGTH, "not part of a unit"),
        ("1e999 m", units.LENGTH, "finite"),
        ("3 m^9^9", units.LENGTH, "not part of a unit"),
        ("3 m^9 m^9", units.LENGTH, "small powers"),
        (math.nan, units.LENGTH, "finite"),
        (10**400, units.LENGTH, "finite"),
        (True, units.LENGTH, "a number or a quantity, got True"),
        (None, units.LENGTH, "got nothing"),
        ("", units.LENGTH, "expected"),
    ],
)
def test_refused(text: object, dimension: Dimension, message: str) -> None:
    with pytest.raises(InputError, match=message):
        quantities.convert(text, dimension)


PARAMETERS = {
    "E": quantities.read("1 GPa"),
    "d": quantities.read("10 mm"),
    "n": quantities.read(3),
    "T": quantities.read("2 s"),
}


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("E", units.PRESSURE, 1e9),
        ("2 * E / n", units.PRESSURE, 2e9 / 3),
        ("pi * d**2 / 4 * E", units.FORCE, math.pi * 1e-4 / 4 * 1e9),
        ("d / T**2", units.ACCELERATION, 0.0025),
        ("sqrt(d * d)", units.LENGTH, 0.01),
        ("max(d, 2 * d)", units.LENGTH, 0.02),
        ("where(d < 2 * d, d, 0 * d)", units.LENGTH, 0.01),
        ("-abs(-d)", units.LENGTH, -0.01),
        ("2 * pi / T", units.ANGULAR_VELOCITY, math.pi),
        ("n", units.LENGTH, 3.0),
    ],
)
def test_expressions_carry_dimensions(text: str, dimension: Dimension, value: float) -> None:
    assert quantities.convert(text, dimension, PARAMETERS) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("E", r"expected a length \[m\], got 'E' \(pressure\)"),
        ("d + E", r"all parts of '\+' of one dimension, got length and pressure"),
        ("d + 1", "length and number"),
        ("sin(d)", r"a number or an angle in sin\(...\), got length"),
        ("2**d", "exponent"),
        ("d**1e9", "at most 12"),
        ("D", r"did you mean 'd'\?|one of the names E, T, d, n, pi"),
        ("d / (n - n)", "expected"),
        ("t", "one of the names"),
    ],
)
def test_expressions_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        quantities.convert(text, units.LENGTH, PARAMETERS)


@given(
    st.one_of(
        st.text(max_size=60),
        st.text("0123456789.eE+-*/^ mkgsNPadr1µEdnT()", max_size=40),
        st.floats(),
        st.integers(),
        st.booleans(),
    )
)
@settings(max_examples=300, deadline=None)
def test_anything_is_a_quantity_or_an_input_error(value: object) -> None:
    try:
        quantity = quantities.read(value, PARAMETERS)
    except InputError:
        return
    assert isinstance(quantity, Quantity)
    assert math.isfinite(quantity.value)


def test_the_message_about_an_unknown_unit_lists_all_that_there_are() -> None:
    with pytest.raises(Problem) as caught:
        quantities.read("3 inch")
    named = set(re.findall(r"[A-Za-z]+", str(caught.value)))
    alone = {name for name in units.UNITS if name.isalpha() and name.isascii()}
    known = alone - {
        prefix + name for prefix in units._PREFIXES if prefix for name in units._SCALED
    }
    assert known <= named
    assert {"n", "u", "m", "k", "M", "G"} <= named


@pytest.mark.parametrize(
    "text, value",
    [
        ("2 N/m * 3 m", 6.0),
        ("5 N / 2 mm", 2500.0),
        ("3 kg * 2 m/s**2", 6.0),
        ("2 N m + 1 J", 3.0),
        ("3 N * min(2, n)", 6.0),
        ("(1 m + d) * 2 rad/s", 2.02),
        ("0.1 m * d", 0.001),
        ("-10 mm * n", -0.03),
        ("d / n * 3 rad/s", 0.01),
    ],
)
def test_numbers_with_units_stand_in_every_expression(text: str, value: float) -> None:
    assert quantities.read(text, PARAMETERS).value == pytest.approx(value, rel=1e-14)
    values = {name: one.value for name, one in PARAMETERS.items()}
    assert expressions.of_time(text, values)(0.0) == pytest.approx(value, rel=1e-14)
    found = of_state(text, parameters=PARAMETERS)
    names = values | {
        step: one.value for step, one in expressions.quantities(found.program).items()
    }
    assert expressions.evaluate(found.program, names, expressions.SCALAR) == pytest.approx(
        value, rel=1e-14
    )


def test_radians_of_an_expression_are_numbers() -> None:
    assert quantities.convert("0.1 m * 3 rad/s", units.VELOCITY) == pytest.approx(0.3)
    with pytest.raises(Problem, match="angular velocity"):
        quantities.convert("3 rad/s", units.RATE)


def test_dimensions_of_numbers_with_units_are_checked_in_functions_of_time() -> None:
    functions.check("0.1 m * sin(2 rad/s * t)", units.LENGTH, {})
    functions.check("where(t < 100 ms, 2 m/s * t, 0.2 m)", units.LENGTH, PARAMETERS)
    for text in ("0.1 m * t", "0.1 m + 2 rad/s", "where(t < 1 m, 1, 2)", "sin(2 m)"):
        with pytest.raises(Problem):
            functions.check(text, units.LENGTH, {})


def test_a_name_that_may_be_a_unit_or_a_parameter_is_refused() -> None:
    """3 m / s is 15 m/s where s is 0.2 s, and 3 m/s; what follows a number directly is its unit,
    and t is the time.
    """
    known = PARAMETERS | {"s": quantities.read("0.2 s"), "m": quantities.read("3 kg")}
    for text in ("2 * 3 m/s", "3 m / s", "3 m/s"):
        with pytest.raises(Problem, match="which is both; rename"):
            quantities.read(text, known)
        with pytest.raises(Problem, match="which is both; rename"):
            of_state(text, parameters=known)
    for text in ("1 N - 3 N/m * m", "3 N m / m", "2 N/m * s"):
        with pytest.raises(Problem, match="which is both; rename"):
            require(of_state(text), {"m": "m", "s": "m"})
    with pytest.raises(Problem, match="'m' is a unit, and cannot be the name"):
        of_state("-3 N/m * (m - 0.2 m)")
    require(of_state("1 N - 3 N/m * x"), {"x": "m", "s": "m"})
    assert quantities.read("4 N/m", known) == units.Quantity(
        4.0, units.LINE_FORCE.exponents
    )  # m is a mass
    assert quantities.read("3 m", known) == units.Quantity(3.0, units.LENGTH.exponents)
    assert expressions.of_time("2 m/s * t", {})(3.0) == 6.0


@pytest.mark.parametrize(
    "text",
    ["N s/m", "N s", "1/m", "N/m^3", "kg/m^4", "rad/m", "kg m", "m s^2/kg", "kg^2/s", "N s/m^2"],
)
def test_units_without_a_name_are_written_as_people_write_them(text: str) -> None:
    assert units.unit(units.measure(f"1 {text}").exponents) == text
