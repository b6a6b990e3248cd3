"""Numbers that scale a body: another Young's modulus, density, diameter or thickness gives the body
that is made of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csr_array

from fmbs_skfem.bodies import Body, Circular, Given, Material, Rectangular, cable
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.parts import rescaling
from tests import models
from verification.plates import rectangle

from ..shapes.test_nurbs import halves

BULK = {"young_modulus": 1e9, "density": 1800.0}
KINDS: dict[str, tuple[Callable[..., Body], dict[str, float]]] = {}


def kind(**numbers: float) -> Callable[[Callable[..., Body]], Callable[..., Body]]:
    def register(make: Callable[..., Body]) -> Callable[..., Body]:
        KINDS[make.__name__] = make, BULK | numbers
        return make

    return register


@kind(diameter=0.01)
def line(young_modulus: float, density: float, diameter: float) -> Body:
    return cable("body", models.segment(6), Circular(diameter), Material(young_modulus, density))


@kind(width=0.02, height=0.01)
def strip(young_modulus: float, density: float, **sides: float) -> Body:
    return cable(
        "body", models.segment(6), Rectangular(**sides), Material(young_modulus, density), dim=2
    )


@kind(thickness=2e-3)
def patches(young_modulus: float, density: float, thickness: float) -> Body:
    """Two patches with springs along their common edge."""
    return plate("body", halves(2, 0.15), thickness, Material(young_modulus, density, 0.3))


@kind(thickness=2e-3)
def membrane(young_modulus: float, density: float, thickness: float) -> Body:
    return plate(
        "body", rectangle("bfs", 2, 2), thickness, Material(young_modulus, density, 0.3), dim=2
    )


def assert_alike(one: Body, other: Body) -> None:
    for first, second in ((one.cells, other.cells), (one.shapes, other.shapes)):
        assert (first is None) == (second is None)
        if first is not None and second is not None:
            assert_allclose(first.section, second.section, rtol=1e-14)
    assert abs(csr_array(one.mass - other.mass)).max() <= 1e-14 * abs(other.mass).max()
    if other.stiffness is not None:
        assert (
            abs(csr_array(one.stiffness - other.stiffness)).max()
            <= 1e-12 * abs(other.stiffness).max()
        )
    assert_allclose([one.radius, one.thickness], [other.radius, other.thickness], rtol=1e-14)
    assert {name: value.number for name, value in one.values.items()} == pytest.approx(
        {name: value.number for name, value in other.values.items()}
    )


@pytest.mark.parametrize(
    ("name", "number"),
    [(name, number) for name, (_, numbers) in KINDS.items() for number in numbers],
)
def test_another_number_is_the_body_that_is_made_of_it(name: str, number: str) -> None:
    """In full, and reduced to any functions, where all quadrature points are there."""
    make, numbers = KINDS[name]
    body, other = make(**numbers), make(**(numbers | {number: 1.7 * numbers[number]}))
    assert set(body.values) == set(numbers)
    assert_alike(rescaling.rescale(body, {number: 1.7 * numbers[number]}), other)
    random = np.random.default_rng(0).normal(size=(len(body.reference), 3))
    S = np.column_stack([body.constant, body.reference, random])
    S = np.linalg.qr(S)[0][:, : np.linalg.matrix_rank(S)]
    small, made = parts.reduced_body(body, S), parts.reduced_body(other, S)
    assert_alike(rescaling.rescale(small, {number: 1.7 * numbers[number]}), made)


def test_numbers_act_together() -> None:
    make, numbers = KINDS["strip"]
    more = {name: (1.0 + 0.2 * k) * number for k, (name, number) in enumerate(numbers.items())}
    assert_alike(rescaling.rescale(make(**numbers), more), make(**more))


@pytest.mark.parametrize(
    ("body", "numbers", "message"),
    [
        (
            lambda: line(**BULK, diameter=0.01),
            {"thickness": 1.0},
            r"\(diameter, young_modulus, density\), got 'thickness'",
        ),
        (
            lambda: line(**BULK, diameter=0.01),
            {"density": 0.0},
            "a positive and finite number, got 0.0",
        ),
        (
            lambda: cable("body", models.segment(6), Given(1e3, 1.0, 1.0)),
            {"young_modulus": 1e9},
            r"got 'young_modulus'",
        ),
        (
            lambda: cable(
                "body", models.segment(6), Circular(0.01), Material(1e9, 1800.0), continuity=2
            ),
            {"diameter": 0.02},
            r"\(young_modulus, density\), got 'diameter'",
        ),
        (
            lambda: patches(**BULK, thickness=np.full(16, 1e-3)),
            {"thickness": 1e-3},
            "got 'thickness'",
        ),  # type: ignore[arg-type]
    ],
)
def test_what_does_not_scale_a_body_is_refused(
    body: Callable[[], Body], numbers: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        rescaling.rescale(body(), numbers)
