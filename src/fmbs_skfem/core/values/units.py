"""Units and dimensions: a number with a unit, `210 GPa`, is 2.1e11 and a pressure.

    value [SI] = number * product_i (prefix_i unit_i)^n_i,    dimension = sum_i n_i dimension_i

Exponents of a dimension count kilogram, metre, second and radian. Hertz counts turns, which a
factor pi makes radians: 2 pi f is an angular velocity, f alone is refused as one, and so is 3000
1/min, which is meant as 3000 rpm.
"""

from __future__ import annotations

import math
import re
from fractions import Fraction
from typing import TypeAlias

from ..storage.records import dataclass
from . import synonyms
from .problems import Problem, shown

Exponents: TypeAlias = tuple[Fraction, ...]


@dataclass(frozen=True)
class Dimension:
    """A named dimension with its SI unit and the exponents of kg, m, s, rad."""

    name: str
    unit: str
    exponents: Exponents

    def __str__(self) -> str:
        article = "an" if self.name[0] in "aeiou" else "a"
        return f"{article} {self.name} [{self.unit}]" if self.unit else f"{article} {self.name}"


@dataclass(frozen=True)
class Quantity:
    """A value in SI units and the exponents of its dimension."""

    value: float
    exponents: Exponents
    cycles: int = 0  #: 1 for a count of turns, as that of hertz; -1 with a factor pi, which makes turns radians


def _dimension(
    name: str, unit: str, kg: int = 0, m: int = 0, s: int = 0, rad: int = 0
) -> Dimension:
    return Dimension(name, unit, tuple(Fraction(n) for n in (kg, m, s, rad)))


NUMBER = _dimension("number", "")
LENGTH = _dimension("length", "m", m=1)
AREA = _dimension("area", "m^2", m=2)
TIME = _dimension("time", "s", s=1)
MASS = _dimension("mass", "kg", kg=1)
ANGLE = _dimension("angle", "rad", rad=1)
VELOCITY = _dimension("velocity", "m/s", m=1, s=-1)
ANGULAR_VELOCITY = _dimension("angular velocity", "rad/s", s=-1, rad=1)
ACCELERATION = _dimension("acceleration", "m/s^2", m=1, s=-2)
RATE = _dimension("rate", "1/s", s=-1)
FORCE = _dimension("force", "N", kg=1, m=1, s=-2)
MOMENT = _dimension("moment", "N m", kg=1, m=2, s=-2)
PRESSURE = _dimension("pressure", "Pa", kg=1, m=-1, s=-2)
DENSITY = _dimension("density", "kg/m^3", kg=1, m=-3)
LINE_DENSITY = _dimension("mass per length", "kg/m", kg=1, m=-1)
BENDING_STIFFNESS = _dimension("bending stiffness", "N m^2", kg=1, m=3, s=-2)
LINE_FORCE = _dimension("force per length", "N/m", kg=1, s=-2)
INERTIA = _dimension("moment of inertia", "kg m^2", kg=1, m=2)
TORSIONAL_STIFFNESS = _dimension("torsional stiffness", "N m/rad", kg=1, m=2, s=-2, rad=-1)
TORSIONAL_DAMPING = _dimension("torsional damping", "N m s/rad", kg=1, m=2, s=-1, rad=-1)
PI = Quantity(math.pi, NUMBER.exponents, -1)
POWER = _dimension("power", "W", kg=1, m=2, s=-3)
DIMENSIONS = (
    NUMBER, LENGTH, AREA, TIME, MASS, ANGLE, VELOCITY, ANGULAR_VELOCITY, ACCELERATION, RATE, FORCE, MOMENT, PRESSURE, DENSITY,
    LINE_DENSITY, BENDING_STIFFNESS, LINE_FORCE, INERTIA, TORSIONAL_STIFFNESS, TORSIONAL_DAMPING, POWER,
)  # fmt: skip


def find_dimension(unit: str) -> Dimension:
    """The dimension of a unit such as `N m/rad`; one without a name of its own is a quantity, `1`
    is that of numbers.

        >>> from fmbs_skfem.core.values import units
        >>> units.find_dimension("N m/rad").name, units.find_dimension("N").unit
        ('torsional stiffness', 'N')
    """
    known = (
        NUMBER
        if unit == "1"
        else next((dimension for dimension in DIMENSIONS if dimension.unit == unit), None)
    )
    return known or Dimension("quantity", unit, measure(f"1 {unit}").exponents)


#: exact by definition: the international inch [m] and pound [kg] of 1959, the standard acceleration
#: of gravity [m/s^2] (BIPM, The International System of Units; NIST Special Publication 811,
#: appendix B)
INCH, POUND, STANDARD = Fraction("0.0254"), Fraction("0.45359237"), Fraction("9.80665")
#: power of ten
_PREFIXES = {
    "": 0,
    "n": -9,
    "u": -6,
    "µ": -6,
    "μ": -6,
    "m": -3,
    "k": 3,
    "M": 6,
    "G": 9,
}
_SCALED: dict[str, tuple[Fraction | int, Dimension]] = {
    "m": (1, LENGTH), "g": (Fraction(1, 1000), MASS), "s": (1, TIME), "N": (1, FORCE), "Pa": (1, PRESSURE), "J": (1, MOMENT),
    "W": (1, POWER), "Hz": (1, RATE), "rad": (1, ANGLE),
}  # fmt: skip
_OTHERS: dict[str, tuple[Fraction, Exponents]] = {
    "cm": (Fraction(1, 100), LENGTH.exponents),
    "t": (Fraction(1000), MASS.exponents),
    "bar": (Fraction(100_000), PRESSURE.exponents),
    "min": (Fraction(60), TIME.exponents),
    "h": (Fraction(3600), TIME.exponents),
    "deg": (Fraction(math.pi) / 180, ANGLE.exponents),
    "rpm": (Fraction(math.pi) / 30, ANGULAR_VELOCITY.exponents),
    "rev": (Fraction(math.pi) * 2, ANGLE.exponents),
    "U": (Fraction(math.pi) * 2, ANGLE.exponents),
    "in": (INCH, LENGTH.exponents),
    "ft": (12 * INCH, LENGTH.exponents),
    "lbm": (POUND, MASS.exponents),
    "lbf": (POUND * STANDARD, FORCE.exponents),
    "kgf": (STANDARD, FORCE.exponents),
    "psi": (POUND * STANDARD / INCH**2, PRESSURE.exponents),
    "ksi": (1000 * POUND * STANDARD / INCH**2, PRESSURE.exponents),
    "Nm": (Fraction(1), MOMENT.exponents),
    "kNm": (Fraction(1000), MOMENT.exponents),
    "1": (Fraction(1), NUMBER.exponents),
}
UNITS: dict[str, tuple[Fraction, Exponents]] = {
    prefix + name: (Fraction(10) ** power * scale, dimension.exponents)
    for name, (scale, dimension) in _SCALED.items()
    for prefix, power in _PREFIXES.items()
} | _OTHERS  #: scale to SI and exponents
KNOWN = f"{', '.join(_SCALED)}, these also with {', '.join(filter(str.isascii, filter(None, _PREFIXES)))} before; "
KNOWN += ", ".join(name for name in _OTHERS if name != "1")  #: all units, for messages
#: units that count turns, by the sign of their power
CYCLES = {prefix + "Hz": 1 for prefix in _PREFIXES} | {
    "min": -1,
    "h": -1,
}

_QUANTITY = re.compile(
    r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*((?:[A-Za-zµμ°]|1\s*/).*)?\s*",
    re.ASCII | re.DOTALL,
)
_FACTOR = re.compile(
    r"\s*([*·/]?)\s*([A-Za-zµμ]+|°|1(?=\s*/))\s*(?:(?:\^|\*\*)\s*([-+]?\d))?\s*", re.ASCII
)
LENGTH_LIMIT = 200  #: longest unit text [characters]
EXPONENT = 12  #: largest power of a base unit


def refuse_cycles(quantity: Quantity, dimension: Dimension, got: object) -> None:
    """Raises a Problem where turns stand for radians."""
    if quantity.cycles > 0 and dimension.exponents[3]:
        same = f"1 Hz is {2 * math.pi:.10g} rad/s or 60 rpm, 1 1/min is 1 rpm; a frequency f of parameters is written 2 * pi * f"
        raise Problem(str(dimension), f"{shown(got)}, which counts turns in 1/min or hertz", same)


def measure(text: str) -> Quantity:
    """A number with or without a unit as a quantity.

    A Problem where the text is none, or the unit is not known.

        >>> from fmbs_skfem.core.values.units import measure
        >>> measure("70 GPa").value, round(measure("60 rpm").value, 6)
        (70000000000.0, 6.283185)
    """
    match = _QUANTITY.fullmatch(text) if len(text) <= LENGTH_LIMIT else None
    if match is None:
        raise Problem("a number or a quantity", shown(text), "write for instance 0.01 or '10 mm'")
    scale, exponents, cycles = (
        _unit(match[2].rstrip(), text) if match[2] else (Fraction(1), NUMBER.exponents, 0)
    )
    return Quantity(finite(_scaled(float(match[1]), scale), text), exponents, cycles)


def unit_of_text(text: str) -> str:
    """The unit that a quantity is written with; empty for a plain number."""
    match = _QUANTITY.fullmatch(text)
    return (match[2] or "").strip() if match else ""


def starts_with_number(text: str) -> bool:
    """Whether a text begins as a number does."""
    return _QUANTITY.fullmatch(text) is not None


def describe(exponents: Exponents) -> str:
    """The name of a dimension, or its SI unit where it has no name."""
    known = _known(exponents)
    return known.name if known else _written(exponents)


def unit(exponents: Exponents) -> str:
    """The SI unit of a dimension, as in headers of tables; empty for numbers."""
    known = _known(exponents)
    return known.unit if known else _written(exponents)


def _known(exponents: Exponents) -> Dimension | None:
    """The dimension with a name of its own that has some exponents."""
    return next((dimension for dimension in DIMENSIONS if dimension.exponents == exponents), None)


def _written(exponents: Exponents) -> str:
    """An SI unit such as `N s/m`, in newtons where a mass is divided by times."""
    kg, m, s, rad = exponents
    force = Fraction(kg == 1 and s < 0)
    powers: dict[str, Fraction] = {
        "N": force,
        "kg": kg - force,
        "m": m - force,
        "s": s + 2 * force,
        "rad": rad,
    }
    above = [
        name if power == 1 else f"{name}^{power}" for name, power in powers.items() if power > 0
    ]
    below = [
        f"/{name}" if power == -1 else f"/{name}^{-power}"
        for name, power in powers.items()
        if power < 0
    ]
    return (" ".join(above) or "1") + "".join(below)


def add_unit(name: str, unit: str) -> str:
    """`E [Pa]`, as in heads of tables; a name alone where there is no unit."""
    return f"{name} [{unit}]" if unit else name


def finite(value: float, got: object) -> float:
    try:
        finite = math.isfinite(value)
    except OverflowError:
        finite = False
    if not finite:
        raise Problem("a finite number", shown(got))
    return float(value)


def _scaled(value: float, scale: Fraction) -> float:
    """value * scale with one rounding where the scale is a power of ten."""
    exact = max(scale.numerator, scale.denominator) < 2**53
    return value * scale.numerator / scale.denominator if exact else value * float(scale)


def _unit(text: str, whole: str) -> tuple[Fraction, Exponents, int]:
    """Scale and exponents of `kg/m^3`, `N m`, `1/s`, and whether it counts turns."""
    scale = Fraction(1)
    exponents = NUMBER.exponents
    cycles = 0
    position = 0
    while position < len(text):
        match = _FACTOR.match(text, position)
        if match is None:
            raise Problem(
                "a unit such as mm, kg/m^3 or N m",
                shown(whole),
                f"'{text[position:][:20]}' is not part of a unit",
            )
        if match[2] not in UNITS:
            hint = synonyms.meant(match[2], synonyms.UNITS, UNITS).removeprefix("; ")
            raise Problem(f"a known unit ({KNOWN})", shown(match[2]), hint)
        power = int(match[3] or 1) * (-1 if match[1] == "/" else 1)
        factor, own = UNITS[match[2]]
        scale = scale * factor**power
        exponents = tuple(n + power * m for n, m in zip(exponents, own, strict=True))
        cycles = max(cycles, int(CYCLES.get(match[2], 0) * power > 0))
        position = match.end()
        if abs(max(exponents, key=abs)) > EXPONENT:
            raise Problem("a unit with small powers", shown(whole))
    return scale, exponents, 0 if exponents[3] else cycles
