"""Exact hyper-reduction of membranes: the polynomial against all points, closed forms, rigid
rotations.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem.bodies import laws
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.reduction.hyper import polynomial
from fmbs_skfem.systems.terms import quartic
from fmbs_skfem.systems.terms.points import Sampled
from fmbs_skfem.systems.terms.quartic import Quartic

#: sides of the plate [m], E t / (1 - nu^2) [N/m] of 10 mm of aluminium
LENGTH, HEIGHT, A = (
    0.2,
    0.07,
    7.7e8,
)
CELLS = (24, 8)


def floor(model: Quartic, x: np.ndarray) -> np.ndarray:
    """Eight roundings (three in z z z, five in a coefficient) of the sum of all magnitudes in the
    force at x (r,), (r,) [N].
    """
    out, work = np.zeros(model.modes), np.zeros(quartic.work_length(model.modes))
    quartic.add_force(np.abs(model.coefficients), np.abs(x), work, out)
    return 4.0 * np.finfo(float).eps * out


def gradients(field: np.ndarray) -> np.ndarray:
    """d/dX1 and d/dX2 at 2 x 2 Gauss points of bilinear cells (2, p), of nodal values (24 + 1, 8 +
    1).
    """
    (nx, ny), g = CELLS, 0.5 + np.array([-1.0, 1.0]) / np.sqrt(12.0)
    s, t = g[:, None, None, None], g[None, :, None, None]
    a, b, c, d = field[:-1, :-1], field[1:, :-1], field[1:, 1:], field[:-1, 1:]
    first, second = (1 - t) * (b - a) + t * (c - d) + 0 * s, (1 - s) * (d - a) + s * (c - b) + 0 * t
    return np.stack([first.ravel() * nx / LENGTH, second.ravel() * ny / HEIGHT])


def gradients_of(position: np.ndarray) -> np.ndarray:
    """Rows r,1x r,1y r,2x r,2y of the points, (4 p,), of complex nodal positions x + i y."""
    return np.stack([gradients(position.real), gradients(position.imag)], axis=1).ravel()


def turning_plate(strain: float, modes: int = 9) -> tuple[Sampled, np.ndarray, np.ndarray]:
    """A plate that deforms while it makes two turns, reduced by POD: points, states (s, r), and a
    rigid state (r,).
    """
    X, Y = np.meshgrid(
        np.linspace(0, LENGTH, CELLS[0] + 1),
        np.linspace(-0.5, 0.5, CELLS[1] + 1) * HEIGHT,
        indexing="ij",
    )
    Z, t = X + 1j * Y, np.linspace(0.0, 1.0, 101)[:, None, None]
    shapes = [1j * X**2 / LENGTH, Z**2 / LENGTH, X * np.exp(3j * Y / LENGTH)]
    bent = Z + strain * sum(np.sin((3 + 2 * k) * t + k) * shape for k, shape in enumerate(shapes))
    states = (np.exp(4j * np.pi * t) * bent).reshape(len(t), -1)
    q = np.concatenate([states.real, states.imag], axis=1)
    mean = q.mean(axis=0)
    rigid = np.concatenate([Z.real.ravel(), Z.imag.ravel()]) - mean
    U = np.linalg.svd(np.vstack([100.0 * rigid, q - mean]).T, full_matrices=False)[0][:, :modes]

    def gradients(row: np.ndarray) -> np.ndarray:
        real, imaginary = row.reshape(2, *Z.shape)
        return gradients_of(real + 1j * imaginary)

    points = 4 * CELLS[0] * CELLS[1]
    weight = np.full(points, LENGTH * HEIGHT / points)
    section = np.stack([A * np.linspace(1.0, 2.0, points), np.linspace(0.1, 0.4, points), weight])[
        :, None
    ]
    rows = np.ascontiguousarray(np.array([gradients(mode) for mode in U.T]).T)
    return (
        Sampled(
            Law.MEMBRANE, rows, gradients(mean), section, slice(3, 3 + modes), np.arange(points)
        ),
        (q - mean) @ U,
        rigid @ U,
    )


def all_points(sampled: Sampled, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Energy, force and tangent as the sum over all points."""
    points = sampled.section.shape[2]
    u = (sampled.rows @ x + sampled.offset).reshape(4, 1, points)
    S, D = np.zeros_like(u), np.zeros((4, 4, 1, points))
    laws.stress(Law.MEMBRANE, u, u, 0.0, sampled.section, S)
    laws.modulus(Law.MEMBRANE, u, 0.0, sampled.section, D)
    J = sampled.rows.reshape(4, points, -1)
    tangent = np.einsum("ipr,ijp,jps->rs", J, D[:, :, 0], J, optimize=True)
    return laws.energy(Law.MEMBRANE, u, sampled.section), sampled.rows.T @ S.ravel(), tangent


def evaluate(model: Quartic, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    r = model.modes
    work, f, W = np.zeros(quartic.work_length(r)), np.zeros(r), np.zeros((r, r))
    quartic.add_force(model.coefficients, x, work, f)
    quartic.add_tangent(model.coefficients, x, work, W)
    return quartic.energy(model.coefficients, x, work), f, W


def test_force_energy_and_tangent_of_large_strains_are_those_of_all_points() -> None:
    sampled, states, _ = turning_plate(strain=0.3)
    model = polynomial.build(sampled)
    assert (model.columns, model.modes) == (slice(3, 12), 9)
    for x in states[::10]:
        (W, f, K), (energy, force, tangent) = evaluate(model, x), all_points(sampled, x)
        assert pytest.approx(energy, rel=1e-13) == W
        assert np.linalg.norm(f - force) < 1e-13 * np.linalg.norm(force)
        assert np.linalg.norm(K - tangent) < 1e-13 * np.linalg.norm(tangent)


def test_force_of_small_strains_agrees_to_the_floor() -> None:
    """At strains of 1e-3 rotations cancel between monomials; the error stays that of round-off,
    about 1e-16 A.
    """
    sampled, states, _ = turning_plate(strain=1e-3)
    model = polynomial.build(sampled)
    for x in states[::10]:
        difference = np.linalg.norm(evaluate(model, x)[1] - all_points(sampled, x)[1])
        assert difference < np.linalg.norm(floor(model, x))
        assert difference < 1e-11 * np.linalg.norm(all_points(sampled, x)[1])


def test_states_outside_the_training_are_exact_too() -> None:
    sampled, states, _ = turning_plate(strain=0.3)
    model = polynomial.build(sampled)
    for x in np.random.default_rng(0).normal(size=(5, 9)) * np.abs(states).max():
        force = all_points(sampled, x)[1]
        assert np.linalg.norm(evaluate(model, x)[1] - force) < 1e-13 * np.linalg.norm(force)


def test_rigid_positions_are_as_stiff_as_all_points() -> None:
    sampled, _, rigid = turning_plate(strain=0.3)
    model = polynomial.build(sampled)
    (W, f, K), (energy, force, tangent) = evaluate(model, rigid), all_points(sampled, rigid)
    least = floor(model, rigid)
    assert abs(W - energy) < np.abs(rigid) @ least
    assert np.linalg.norm(f - force) < np.linalg.norm(least)
    assert np.linalg.norm(K - tangent) < 1e-13 * np.linalg.norm(tangent)


@pytest.mark.parametrize("angle", np.linspace(0.0, 6.0, 7))
def test_rotations_cost_nothing(angle: float) -> None:
    """r,1 = (1 + x1, x2), r,2 = (-x2, 1 + x1) is a rotation for x = (cos - 1, sin)."""
    section, modes = (
        np.array([[[A]], [[0.3]], [[1.0]]]),
        np.array([[1.0, 0], [0, 1], [0, -1], [1, 0]]),
    )
    turn = Sampled(
        Law.MEMBRANE, modes, np.array([1.0, 0, 0, 1]), section, slice(0, 2), np.zeros(1, np.int64)
    )
    W, f, _ = evaluate(polynomial.build(turn), np.array([np.cos(angle) - 1.0, np.sin(angle)]))
    assert abs(W) < 1e-14 * A
    assert np.abs(f).max() < 1e-14 * A


@pytest.mark.parametrize("x", (-0.5, 1e-3, 0.5, 3.0))
def test_uniaxial_stretch(x: float) -> None:
    """r = X + x X1 e1: E11 = x + x^2/2, W = A E11^2/2, f = A E11 (1 + x), K = A ((1 + x)^2 + E11)
    on a unit area.
    """
    section = np.array([[[A]], [[0.3]], [[1.0]]])
    stretch = Sampled(
        Law.MEMBRANE,
        np.array([[1.0], [0], [0], [0]]),
        np.array([1.0, 0, 0, 1]),
        section,
        slice(0, 1),
        np.zeros(1, np.int64),
    )
    W, f, K = evaluate(polynomial.build(stretch), np.array([x]))
    E, size = x + 0.5 * x * x, A * (1 + abs(x)) ** 4
    assert pytest.approx(0.5 * A * E * E, abs=1e-15 * size) == W
    assert f[0] == pytest.approx(A * E * (1 + x), abs=1e-15 * size)
    assert K[0, 0] == pytest.approx(A * ((1 + x) ** 2 + E), abs=1e-15 * size)


def test_simple_shear() -> None:
    """r,2 = e2 + x e1: E12 = x/2, E22 = x^2/2, W = A/2 (E22^2 + 2 (1 - nu) E12^2) = A (x^4/8 + (1 -
    nu) x^2/4).
    """
    section = np.array([[[2.0]], [[0.5]], [[1.0]]])
    shear = Sampled(
        Law.MEMBRANE,
        np.array([[0.0], [0], [1], [0]]),
        np.array([1.0, 0, 0, 1]),
        section,
        slice(0, 1),
        np.zeros(1, np.int64),
    )
    W, f, K = evaluate(polynomial.build(shear), np.array([2.0]))
    assert (W, f[0], K[0, 0]) == pytest.approx((5.0, 9.0, 12.5), abs=1e-14)


def test_energy_is_proportional_to_stiffness() -> None:
    sampled, states, _ = turning_plate(strain=0.3)
    model = polynomial.build(sampled)
    half = polynomial.scale(model, 0.5)
    assert np.array_equal(evaluate(half, states[3])[1], 0.5 * evaluate(model, states[3])[1])
    assert half.coefficients.ctypes.data % 64 == 0


def test_blocks_of_points_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    sampled, states, _ = turning_plate(strain=0.3)
    force = evaluate(polynomial.build(sampled), states[7])[1]
    monkeypatch.setattr(polynomial, "BLOCK", 100)
    assert np.linalg.norm(
        evaluate(polynomial.build(sampled), states[7])[1] - force
    ) < 1e-13 * np.linalg.norm(force)


def test_other_laws_and_damping_are_refused() -> None:
    sampled, _, _ = turning_plate(strain=0.3)
    with pytest.raises(
        InputError,
        match=r"body 'crank': expected no stiffness-proportional damping, got beta = 0\.01 s; take ECSW",
    ):
        polynomial.build(sampled, 0.01, "crank")
    with pytest.raises(InputError, match="expected the planar membrane law, got the law SHELL"):
        polynomial.build(replace(sampled, law=Law.SHELL))
    with pytest.raises(InputError, match="expected 4 rows a point"):
        polynomial.build(replace(sampled, section=sampled.section[:, :, 1:]))
    with pytest.raises(InputError, match="weights not negative"):
        polynomial.build(replace(sampled, section=-sampled.section))
