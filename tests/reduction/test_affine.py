"""Polynomials of parameters: cases that are not assembled again are those that are, for reduced and
full models of every kind.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.core.algebra.linalg import is_sparse
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.dynamics.outputs import lifted
from fmbs_skfem.reduction import Level, affine, parameters
from fmbs_skfem.reduction.affine import ParametricCase
from fmbs_skfem.reduction.cases import Case, Family
from fmbs_skfem.reduction.hyper import polynomial, sampling
from fmbs_skfem.reduction.parameters import Parameter, Scale
from fmbs_skfem.reduction.spaces import component, galerkin
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import At, Rayleigh, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.terms.quartic import Quartic
from tests import models
from tests.reduction.test_files import same

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SCHEME, DURATION = GeneralizedAlpha(1e-3), 0.3
CRANK = """
schema: 1
name: crank
units: SI
dimension: 2
parameters: {E: 70 GPa, nu: 0.3, torque: 15 N m}
bodies:
  crank:
    type: plate
    mesh: ../meshes/plate_crank_coarse.msh
    interpolation: ancf
    thickness: 10 mm
    material: {young_modulus: E, density: 2700 kg/m^3, poisson_ratio: nu}
    rims: {A: A}
joints:
  A: {type: revolute, at: crank.A, to: ground}
loads:
  motor: {type: torque, at: crank.A, torque: torque}
analysis: {type: dynamic, duration: 1 ms, step: 2e-5 s}
"""
E = Parameter("E", 5e8, 2e9, value=1e9, unit="Pa")
D = Parameter("d", 5e-3, 2e-2, value=1e-2, unit="m")
G = Parameter("g", 5.0, 15.0, value=9.81, unit="m/s2")


def pendulum(values: Mapping[str, float]) -> System:
    """Example 2 with 8 cells a beam and a parameter for gravity."""
    text = (EXAMPLES / "double_pendulum.yaml").read_text()
    text = text.replace("-9.81 m/s^2", "-g").replace(
        "  d: 10 mm\n", "  d: 10 mm\n  g: 9.81 m/s^2\n"
    )
    return build.system(reading.loads(text, EXAMPLES, values), cells=8)


@pytest.fixture(scope="module")
def family() -> Family:
    """The double pendulum, reduced by component and sampled at points: a case of E, d and g."""
    raw = pendulum({})
    data = galerkin.snapshots(integrate(eliminate(raw), SCHEME, DURATION, Newton(1e-12), 5))
    components = component.body_level(raw)
    bases = galerkin.bases(raw, data, components, 1e-10)
    system = galerkin.reduce_system(raw, components, bases)
    selections = sampling.train([(system, component.projected(system, data.q))], 1e-3, Level.POINTS)

    def member(values: Mapping[str, float]) -> Case:
        reduced = galerkin.reduce_system(pendulum(values), components, bases)
        return Case(sampling.apply(reduced, selections), SCHEME, DURATION)

    return member


@pytest.fixture(scope="module")
def model(family: Family) -> ParametricCase:
    return affine.fit(family, (E, D, G))


def wrong(a: object, b: object) -> float:
    """Largest difference of two arrays relative to the largest number of the second."""
    x, y = (np.asarray(part.toarray() if is_sparse(part) else part) for part in (a, b))  # type: ignore[attr-defined]
    return float(np.abs(x - y).max() / np.abs(y).max())


def constant_parts(case: Case, of: Case) -> System:
    """The system of a case with the arrays of another where they depend on E, d and g; its lengths
    are measured as those.
    """
    mine, other = case.system, of.system
    elastic = tuple(
        replace(a, gather=replace(a.gather, section=b.gather.section))  # type: ignore[union-attr]
        for a, b in zip(mine.elastic, other.elastic, strict=True)
    )
    lines = tuple(
        replace(a, radius=b.radius, swept=b.swept)
        for a, b in zip(mine.lines, other.lines, strict=True)
    )
    lengths = {name: getattr(other, name) for name in ("mass", "metric", "weight", "scale")}
    sensors = replace(mine.sensors, offset=other.sensors.offset)
    loads = replace(mine.loads, constant=other.loads.constant)
    return replace(mine, loads=loads, elastic=elastic, lines=lines, sensors=sensors, **lengths)


@pytest.mark.parametrize(
    "values", [(7.3e8, 0.0123, 11.0), (5e8, 5e-3, 5.0), (2e9, 0.02, 15.0), (1.9e9, 5.1e-3, 9.81)]
)
def test_a_reduced_model_is_the_one_assembled_anew(
    family: Family, model: ParametricCase, values: tuple[float, ...]
) -> None:
    point = dict(zip(("E", "d", "g"), values, strict=True))
    fast, anew = model(point), family(point)
    assert wrong(fast.system.mass, anew.system.mass) < 1e-14
    assert wrong(fast.system.loads.constant, anew.system.loads.constant) < 1e-14
    for one, two in zip(fast.system.elastic, anew.system.elastic, strict=True):
        for row, exact in zip(one.gather.section, two.gather.section, strict=True):  # type: ignore[union-attr]
            assert np.abs(row - exact).max() <= 1e-13 * np.abs(exact).max()
    assert wrong(fast.system.sensors.offset, anew.system.sensors.offset) < 1e-14
    for one, two in zip(fast.system.lines, anew.system.lines, strict=True):
        assert one.radius == pytest.approx(two.radius, rel=1e-13)
        for name in ("stiffness", "known", "fibres"):
            mine, exact = (getattr(line.swept.sections, name) for line in (one, two))
            assert wrong(mine, exact) < 1e-13
    assert same(constant_parts(fast, anew), anew.system)
    assert (fast.scheme, fast.duration, fast.newton) == (anew.scheme, anew.duration, anew.newton)


def test_degrees_and_samples(model: ParametricCase) -> None:
    """EA, EI by E d^2 and E d^4, mass by d^2, weight by g d^2, drawn radius by d, drawn gravity by
    g.
    """
    assert affine.degrees(model) == {"E": 1, "d": 4, "g": 1}
    by_place = {part.place[1:]: part.order.degrees for part in model.varying}
    assert by_place == {
        **{("elastic", k, "gather", "section"): (1, 4, 0) for k in (0, 1)},
        **{("lines", k, "radius"): (0, 1, 0) for k in (0, 1)},
        **{
            ("lines", k, "swept", "sections", name): degrees
            for k in (0, 1)
            for name, degrees in {
                "stiffness": (1, 4, 0),
                "known": (1, 4, 0),
                "fibres": (1, 1, 0),
            }.items()
        },
        ("mass",): (0, 2, 0),
        ("loads", "constant"): (0, 2, 1),
        ("sensors", "offset"): (0, 0, 1),
    }
    # all masses go with d^2, all weights with g d^2: one array each is stored
    assert {part.place[1:]: len(part.values) for part in model.varying}[("mass",)] == 1
    assert model.error < 1e-14
    # 1 + 3 + 6 + 3 on the axes, 4 more of (E, d), 2 more of (d, g), 6 hold-out points
    assert model.evaluations == 25


def test_nominal_values_give_the_nominal_case(family: Family, model: ParametricCase) -> None:
    point = {"E": 1e9, "d": 1e-2, "g": 9.81}
    assert same(model(point), family(point))


def test_motions_agree(family: Family, model: ParametricCase) -> None:
    point = {"E": 7.3e8, "d": 0.0123, "g": 11.0}
    one, two = (
        integrate(case.system, case.scheme, case.duration, Newton(1e-12))
        for case in (model(point), family(point))
    )
    assert np.abs(two.x - two.x[0]).max() > 0.1
    assert np.abs(one.x - two.x).max() < 1e-10


def test_nothing_is_assembled(family: Family) -> None:
    calls = []

    def counted(values: Mapping[str, float]) -> Case:
        calls.append(dict(values))
        return family(values)

    found = affine.fit(counted, (E, Parameter("rho", 900.0, 2700.0)))
    assert len(calls) == found.evaluations
    found({"E": 6e8, "rho": 1000.0})
    assert len(calls) == found.evaluations


def test_a_parameter_without_influence_costs_nothing(family: Family) -> None:
    def indifferent(values: Mapping[str, float]) -> Case:
        return family({"E": values["E"]})

    two = affine.fit(indifferent, (E, Parameter("nothing", 0.0, 1.0)))
    assert affine.degrees(two) == {"E": 1, "nothing": 0}
    assert [len(nodes) for nodes in two.nodes] == [2, 1]
    one = affine.fit(lambda values: family(values), (E,))
    assert (
        [len(part.values) for part in two.varying]
        == [len(part.values) for part in one.varying]
        == [1] * 8
    )
    none = affine.fit(lambda values: family({}), (E,))
    assert none.varying == ()
    assert (
        none.evaluations == 1 + affine.CHECKS + 2
    )  # nominal, two on the axis, two random points; the corners are on the axis
    assert none({"E": 6e8}) == none.nominal


def test_small_numbers_of_a_wide_range_keep_their_digits(family: Family) -> None:
    """E and d over 100 : 1, EI = E pi d^4 / 64 over 10^10 : 1, in closed form."""
    wide = Parameter("E", 1e8, 1e10, Scale.LOG), Parameter("d", 1e-3, 1e-1, Scale.LOG)
    found = affine.fit(family, wide)
    assert affine.degrees(found) == {"E": 1, "d": 4}
    unit = np.concatenate(
        [
            parameters.grid(wide, 2),
            parameters.grid(wide, 5),
            parameters.latin_hypercube(wide, 30, 7),
        ]
    )
    worst = 0.0
    for young, diameter in unit:
        case = found({"E": young, "d": diameter})
        exact = np.array([young * math.pi * diameter**2 / 4, young * math.pi * diameter**4 / 64])
        got = np.array([e.gather.section[:2, 0] for e in case.system.elastic])  # type: ignore[union-attr]
        worst = max(worst, float(np.abs(got / exact[None, :, None] - 1.0).max()))
    assert worst < 1e-12


def test_driven_angles_are_numbers() -> None:
    """Example 1 with its rate and its time as parameters: constants of the program of the angle; 1
    / Ts is smooth.
    """
    text = (EXAMPLES / "spin_up.yaml").read_text()

    def spun(values: Mapping[str, float]) -> Case:
        return Case(build.system(reading.loads(text, EXAMPLES, values), cells=4), SCHEME, DURATION)

    found = affine.fit(spun, (Parameter("ws", 4.0, 8.0), Parameter("Ts", 1.2, 1.8)))
    assert affine.degrees(found)["ws"] == 1
    assert affine.degrees(found)["Ts"] > 2
    point = {"ws": 5.5, "Ts": 1.71}
    fast, anew = found(point), spun(point)
    times = np.linspace(0.0, 3.0, 301)
    assert len(anew.system.signals) > 0
    for one, two in zip(fast.system.signals, anew.system.signals, strict=True):
        assert np.abs(one(times) - two(times)).max() < 1e-10
    assert same(replace(fast.system, signals=()), replace(anew.system, signals=()))


def test_times_may_depend_on_a_parameter() -> None:
    """Step and duration by 1 / sqrt(E) over 100 : 1: polynomials of log E."""

    def member(values: Mapping[str, float]) -> Case:
        part = 1.0 / math.sqrt(values["E"] / 1e9)
        section = sections.Given(values["E"] * 1e-4, values["E"] * 1e-8, 1.0)
        return Case(models.cantilever(3, section=section), GeneralizedAlpha(1e-3 * part), 3 * part)

    found = affine.fit(member, (Parameter("E", 1e8, 1e10, Scale.LOG),))
    orders = {part.place[-1]: part.order for part in found.varying}
    assert orders["section"] == affine.Order((1,), (False,))
    assert orders["step"].logarithmic == (True,)
    for young in (1e8, 3.3e8, 6e9, 1e10):
        case = found({"E": young})
        assert case.scheme.step == pytest.approx(1e-3 / math.sqrt(young / 1e9), rel=1e-10)
        assert round(case.duration / case.scheme.step) == 3000


def test_full_models_with_sparse_arrays() -> None:
    """Density, Young's modulus and both times of Rayleigh damping, which is absent at the nominal
    values.
    """

    def member(values: Mapping[str, float]) -> Case:
        material = sections.Material(values["E"], values["rho"])
        system = models.double_pendulum(
            5, damping=Rayleigh(values["alpha"], values["beta"]), all_multipliers=True
        )
        section = sections.Circular(0.01).of_cable(material)
        ratio = section.rhoA / sections.Circular(0.01).of_cable(models.MATERIAL).rhoA
        mass = csr_array(system.mass * ratio)
        damping = csr_array(system.damping * ratio)
        damping.eliminate_zeros()
        return Case(replace(system, mass=mass, damping=damping), SCHEME, DURATION)

    box = (
        *(Parameter("E", 5e8, 2e9), Parameter("rho", 900.0, 2700.0)),
        *(Parameter("alpha", 0.0, 2.0, value=0.0), Parameter("beta", 0.0, 1e-3, value=0.0)),
    )
    assert member({"E": 1e9, "rho": 1800.0, "alpha": 0.0, "beta": 0.0}).system.damping.nnz == 0
    found = affine.fit(member, box)
    assert affine.degrees(found) == {"E": 0, "rho": 1, "alpha": 1, "beta": 1}
    for row in parameters.latin_hypercube(box, 4, seed=9):
        point = parameters.named(box, row)
        fast, anew = found(point).system, member(point).system
        assert wrong(fast.mass, anew.mass) < 1e-14
        assert wrong(fast.damping, anew.damping) < 1e-14
        assert [e.beta for e in fast.elastic] == pytest.approx(
            [e.beta for e in anew.elastic], rel=1e-14
        )
        elastic = anew.elastic
        assert same(replace(fast, mass=anew.mass, damping=anew.damping, elastic=elastic), anew)
    # at the nominal values every place of the damping matrix is there, and holds zero
    nominal = found({parameter.name: parameter.nominal for parameter in box}).system.damping
    assert nominal.nnz > 0
    assert not nominal.data.any()


@pytest.fixture(scope="module")
def plate() -> Family:
    """A crank, 1 ms of it, as exact polynomial of few modes."""

    def raw(values: Mapping[str, float]) -> System:
        return build.system(reading.loads(CRANK, EXAMPLES, values))

    full, components = raw({}), {"crank": ("crank",)}
    scheme = GeneralizedAlpha(2e-5)
    data = galerkin.snapshots(integrate(full, scheme, 1e-3, Newton(1e-12), 2))
    bases = galerkin.bases(full, data, components, modes=8)

    def member(values: Mapping[str, float]) -> Case:
        return Case(
            polynomial.exact(galerkin.reduce_system(raw(values), components, bases)), scheme, 1e-3
        )

    return member


def test_exact_polynomials(plate: Family) -> None:
    """Coefficients of strain energies are linear in E and smooth in nu: E / (1 - nu^2) and E nu /
    (1 - nu^2).
    """
    found = affine.fit(plate, (Parameter("E", 4e10, 7e10), Parameter("torque", 5.0, 15.0)))
    assert affine.degrees(found) == {"E": 1, "torque": 1}
    point = {"E": 5.1e10, "torque": 7.7}
    check_quartics(found(point), plate(point), 1e-14)
    smooth = affine.fit(plate, (Parameter("nu", 0.25, 0.35),))
    assert 4 <= affine.degrees(smooth)["nu"] <= 10
    energies = [part for part in smooth.varying if part.place[-1] == "coefficients"]
    assert [len(part.values) for part in energies] == [2]
    check_quartics(smooth({"nu": 0.271}), plate({"nu": 0.271}), 1e-11)


def check_quartics(fast: Case, anew: Case, tolerance: float) -> None:
    for one, two in zip(fast.system.elastic, anew.system.elastic, strict=True):
        assert isinstance(one.gather, Quartic)
        assert isinstance(two.gather, Quartic)
        assert wrong(one.gather.coefficients, two.gather.coefficients) < tolerance
        assert one.gather.coefficients.ctypes.data % 64 == 0
    for force, exact in zip(fast.system.loads.forces, anew.system.loads.forces, strict=True):
        assert force.numbers == pytest.approx(exact.numbers, rel=1e-14)
    rest = replace(
        fast.system, elastic=anew.system.elastic, loads=anew.system.loads, skins=anew.system.skins
    )
    assert same(rest, anew.system)


def loaded(force: float, cells: int = 3) -> Case:
    """A cantilever with a force at its tip."""
    tip = partial(lambda f, at: [loads.PointForce("tip", at, (0.0, f))], force)
    return Case(
        models.cantilever(
            cells, tip, material=models.MATERIAL, section=models.SECTION, all_multipliers=True
        ),
        SCHEME,
        DURATION,
    )


def test_a_dependence_that_vanishes_at_the_nominal_values_is_found() -> None:
    """f = F s^3 with F = 0 at the nominal values: the axes through them show nothing of s."""
    box = Parameter("F", -1.0, 1.0), Parameter("s", 0.5, 2.0)
    found = affine.fit(lambda values: loaded(values["F"] * values["s"] ** 3), box)
    assert affine.degrees(found) == {"F": 1, "s": 3}
    coefficients = found({"F": 0.7, "s": 1.3}).system.loads.forces[0].numbers
    assert coefficients == pytest.approx(
        loaded(0.7 * 1.3**3).system.loads.forces[0].numbers, rel=1e-14
    )


def leaning(values: Mapping[str, float]) -> Case:
    """A beam of six cells at an angle, its end on a slider across; at a = 0 constants and
    coefficients of joints vanish.
    """
    a = values["a"]
    tip = (math.cos(a), math.sin(a))
    beam = body.cable(
        "beam", models.segment(6, (0, 0, 0), (*tip, 0)), models.SECTION, models.MATERIAL, dim=2
    )
    hinge = joints.Pin("hinge", At("beam", "left"), (0.0, 0.0))
    rail = joints.Slider("rail", At("beam", "right"), (-tip[1], tip[0]))
    return Case(assemble([beam], [hinge, rail], [loads.Gravity((0, -9.81))]), SCHEME, DURATION)


def test_a_parameter_that_turns_the_geometry_is_a_polynomial() -> None:
    """Turned coordinates carry more round-off than their own size, and joints other terms at the
    nominal angle than elsewhere.
    """
    found = affine.fit(leaning, (Parameter("a", -1.4, 1.0, value=0.0),))
    assert 8 <= affine.degrees(found)["a"] <= 24
    for a in (-1.3, 0.0, 0.9):
        fast, anew = found({"a": a}).system, leaning({"a": a}).system
        assert np.abs(fast.x0 - anew.x0).max() < 1e-11
        assert wrong(fast.elastic[0].gather.table, anew.elastic[0].gather.table) < 1e-11  # type: ignore[union-attr]
        one, two = (
            integrate(eliminate(system), SCHEME, 0.1, Newton(1e-12)) for system in (fast, anew)
        )
        assert np.abs(lifted(one)[0] - lifted(two)[0]).max() < 1e-8
        assert fast.constraints.names == anew.constraints.names


def test_what_jumps_is_no_round_off() -> None:
    """A force that depends on the digits of a parameter is not taken for noise of the geometry."""
    with pytest.raises(InputError, match=r"system\.loads\.forces\[0\]\.numbers"):
        affine.fit(
            lambda values: loaded(1.0 + (math.frexp(values["F"])[0] * 2**53) % 2),
            (Parameter("F", 0.1, 1.0),),
        )


def test_what_is_not_smooth_is_refused() -> None:
    with pytest.raises(
        InputError,
        match=r"parameter 'F': expected numbers that are polynomials of it of degree 24 or less, to 1e-11",
    ):
        affine.fit(lambda values: loaded(abs(values["F"] - 0.3)), (Parameter("F", 0.0, 1.0),))
    with pytest.raises(
        InputError,
        match=r"others \(system\.loads\.forces\[0\]\.numbers, system\.sensors\.offset\); keep it out of the parameters",
    ):
        affine.fit(lambda values: loaded(math.sin(60.0 * values["F"])), (Parameter("F", 0.0, 1.0),))
    # along the axes nothing is wrong: min(a, b) has a kink on the diagonal of the box
    box = Parameter("a", 0.0, 1.0, value=0.0), Parameter("b", 0.0, 1.0, value=0.0)
    with pytest.raises(InputError, match="parameter 'a': expected numbers that are polynomials"):
        affine.fit(lambda values: loaded(min(values["a"], values["b"])), box)


def test_a_change_of_structure_names_its_parameter() -> None:
    box = Parameter("F", 0.0, 1.0), Parameter("cells", 3.0, 5.0)
    message = r"parameter 'cells' = 3: expected a case with other numbers, but of the same structure, got another system\."
    with pytest.raises(InputError, match=message):
        affine.fit(lambda values: loaded(values["F"], cells=round(values["cells"])), box)


def test_python_functions_of_time_cannot_be_compared() -> None:
    def member(values: Mapping[str, float]) -> Case:
        case = loaded(values["F"])
        return replace(case, system=replace(case.system, signals=(lambda t: values["F"] * t,)))

    with pytest.raises(InputError, match=r"got another system\.signals\[0\]"):
        affine.fit(member, (Parameter("F", 0.0, 1.0),))


@given(
    st.floats(0.0, 1.0),
    st.sampled_from([Scale.LINEAR, Scale.LOG]),
    st.integers(1, 8),
    st.floats(0.0, 1.0),
)
def test_nodes_carry_polynomials(start: float, scale: Scale, degree: int, place: float) -> None:
    low, high = 2.0, 10.0
    plain = Parameter("p", low, high, scale)
    parameter = replace(plain, value=float(parameters.from_box((plain,), [[start]])[0, 0]))
    nodes = affine.nodes_of(parameter, degree + 1)
    assert nodes[0] == parameter.nominal
    assert len(set(nodes)) == degree + 1
    assert low <= nodes.min() <= nodes.max() <= high
    x = float(parameters.from_box((parameter,), [[place]])[0, 0])
    weights = affine.basis(nodes, x, False)
    for power in range(degree + 1):
        size = float(np.abs(weights) @ nodes**power)
        assert weights @ nodes**power == pytest.approx(x**power, abs=1e-13 * size)
    assert affine.basis(nodes, float(nodes[-1]), False).tolist() == [0.0] * degree + [1.0]
