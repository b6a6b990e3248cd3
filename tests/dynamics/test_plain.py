"""Time steps of kernels that are not compiled (FMBS_PLAIN=1): motions of all storages and factors
are those of compiled ones.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import FrameType, MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pytest

from fmbs_skfem.bodies import Material, cable
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.contact.contacts import ContactSphere
from fmbs_skfem.core.compiling.plain import opener
from fmbs_skfem.core.compiling.structs import packed
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, integrate
from fmbs_skfem.dynamics.compiled_step.step import Method
from fmbs_skfem.parts.bodies import placed, reduced_body
from fmbs_skfem.reduction.hyper import polynomial
from fmbs_skfem.systems import At, System, assemble, compile_system, eliminate, layouts
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads, springs
from fmbs_skfem.systems.layouts import Storage
from fmbs_skfem.systems.system import change_coordinates
from tests import models
from verification.plates import rectangle

STEP, STEPS = 4e-3, 3
# abrupt starts move much
pytestmark = pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
TIMEOUT = 300  #: of the process that is not compiled, of some seconds [s]


def modes(system: System, count: int) -> System:
    """The system in some modes, as a reduced model."""
    random = np.random.default_rng(3).normal(size=(system.size, count))
    return change_coordinates(system, np.linalg.qr(random)[0], system.x0)


def sheet() -> System:
    """A sheet in the plane, hung at a corner and pulled at another."""
    body = plate("sheet", rectangle("ancf", 2, 2), 0.01, Material(1e6, 1000.0, 0.3), dim=2)
    forces = [loads.Gravity((0.0, -9.81)), loads.PointForce("pull", At("sheet", "c"), (30.0, 0.0))]
    return eliminate(assemble([body], [joints.Pin("A", At("sheet", "a"))], forces))


def arms() -> System:
    """Three reduced beams at one hub, with a spring between two tips."""
    full = cable("arm", models.segment(4), models.SECTION, models.MATERIAL)
    random = np.random.default_rng(1).normal(size=(len(full.reference), 2))
    shapes = np.linalg.qr(np.column_stack([full.constant, full.reference[:, :1], random]))[0]
    one = reduced_body(full, shapes)
    turns = [
        np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        for c, s in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))
    ]
    bodies = [placed(one, f"arm{k}", rotation=R) for k, R in enumerate(turns)]
    held = [
        joints.Pin("hub", At("arm0", "left")),
        *(joints.Pin(f"p{k}", At("arm0", "left"), At(f"arm{k}", "left")) for k in (1, 2)),
    ]
    pull = springs.SpringDamper("spring", At("arm0", "right"), At("arm1", "right"), 50.0, 1.0, 0.5)
    return assemble(bodies, held, [loads.Gravity((0.0, 0.0, -9.81)), pull])


def touching() -> System:
    """A beam that hangs at one end, is pulled, and lies on a ball with friction."""
    beam = cable("beam", models.segment(8), models.SECTION, models.MATERIAL, dim=2)
    under = ContactSphere(
        "ball",
        body="beam",
        points=33,
        center=(0.5, -0.1),
        diameter=0.2,
        stiffness=1e3,
        friction=0.3,
    )
    # so much that a step is divided
    pull = loads.PointForce("pull", At("beam", "right"), (4.0, -8.0))
    return eliminate(
        assemble(
            [beam],
            [joints.Pin("a", At("beam", "left"))],
            [loads.Gravity((0.0, -9.81)), under, pull],
        )
    )


#: functions that are called by name, by address from the step, from terms and from laws, and those
#: of all factors
ENTERED = {
    *(
        "stepping.advance",
        "stepping.iterate",
        "evaluation.evaluate",
        "settling.settle",
        "kernels.add_operator",
    ),
    *("parts.divide", "parts.join"),
    *(
        "law_loops.curved_3_stress",
        "law_loops.membrane_stress",
        "quartic.add_tangent",
        "points.add_product",
        "lapack.pbtrf",
    ),
    *(
        "factors.substitute",
        "factors.mirror_band",
        "factors.factor_cholesky",
        "factors.factor_lu",
        "factors.apply_blocks",
    ),
    *("direct.eliminate", "law.normal_force", "large.solve"),
}


class Kind(NamedTuple):
    """A system, how it is stored, and what of `layouts` makes it be stored so."""

    build: Callable[[], System]
    storage: Storage
    terms: str  #: class of its elastic storage
    layout: Mapping[str, float] = MappingProxyType({})


KINDS = {
    "band": Kind(lambda: models.spin_up(14), Storage.BAND, "Cells"),
    "band in space": Kind(
        lambda: models.double_pendulum(6, all_multipliers=True), Storage.BAND, "Cells", {"DENSE": 1}
    ),
    "dense": Kind(lambda: models.double_pendulum(2, all_multipliers=True), Storage.DENSE, "Cells"),
    "dense modes": Kind(lambda: modes(models.double_pendulum(2), 24), Storage.DENSE, "Cells"),
    "sampled points": Kind(lambda: modes(models.double_pendulum(6), 5), Storage.DENSE, "Sampled"),
    "polynomial": Kind(lambda: polynomial.exact(modes(sheet(), 5)), Storage.DENSE, "Quartic"),
    "blocks": Kind(arms, Storage.BLOCKS, "ShapePoints", {"WORTH": 10.0, "DENSE": 1}),
    "sparse": Kind(sheet, Storage.SPARSE, "Cells", {"BAND": 1, "DENSE": 1}),
    "contact with friction": Kind(touching, Storage.BAND, "Cells", {"DENSE": 1}),
    "dense modes with friction": Kind(lambda: modes(touching(), 34), Storage.DENSE, "Cells"),
}


def run(kind: Kind) -> tuple[System, Trajectory]:
    """Some steps of a system, stored as its kind says."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in kind.layout.items():
            patch.setattr(layouts, name, value)
        system = kind.build()
        motion = integrate(system, GeneralizedAlpha(STEP), STEPS * STEP)
        assert compile_system(system).layout.storage is kind.storage
        assert {type(one.gather).__name__ for one in system.elastic} == {kind.terms}
    return system, motion


def results() -> dict[str, tuple[Any, ...]]:
    """Columns and counts of all motions."""
    found = {}
    for name, kind in KINDS.items():
        motion = run(kind)[1]
        cost = motion.statistics
        found[name] = (
            motion.x,
            motion.v,
            motion.a,
            motion.multipliers,
            cost.iterations,
            cost.factorisations,
        )
    return found


def main(path: str) -> None:
    """All motions, and which functions of kernels Python has entered."""
    entered: set[str] = set()

    def trace(frame: FrameType, event: str, _: Any) -> None:
        if event == "call":
            entered.add(f"{Path(frame.f_code.co_filename).stem}.{frame.f_code.co_name}")

    sys.setprofile(trace)
    found = results()
    sys.setprofile(None)
    Path(path).write_bytes(pickle.dumps((found, entered, "numba" in sys.modules)))


@pytest.fixture(scope="module")
def plain(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[dict[str, tuple[Any, ...]], set[str], bool]:
    """What a process finds in which nothing is compiled."""
    path = tmp_path_factory.mktemp("plain") / "found"
    command = [
        sys.executable,
        "-c",
        f"from tests.dynamics import test_plain; test_plain.main({str(path)!r})",
    ]
    root = Path(__file__).parents[2]
    settings = {
        "env": os.environ | {"FMBS_PLAIN": "1", "PYTHONPATH": str(root)},
        "cwd": root,
        "timeout": TIMEOUT,
    }
    done = subprocess.run(command, text=True, capture_output=True, **settings)
    assert done.returncode == 0, done.stderr
    found: tuple[dict[str, tuple[Any, ...]], set[str], bool] = pickle.loads(path.read_bytes())
    return found


@pytest.mark.parametrize("name", KINDS)
def test_steps_that_are_not_compiled_are_those_that_are(name: str, plain: Any) -> None:
    """To 1e-12 m, of bodies of about a metre, q'' as a second difference of that; with as many
    corrections and factors.
    """
    motion = run(KINDS[name])[1]
    x, v, a, multipliers, *counts = plain[0][name]
    assert counts == [motion.statistics.iterations, motion.statistics.factorisations]
    assert np.abs(motion.x - motion.x[0]).max() > 1e-9
    for found, compiled, span in ((x, motion.x, 1.0), (v, motion.v, STEP), (a, motion.a, STEP**2)):
        np.testing.assert_allclose(span * found, span * compiled, rtol=0, atol=1e-12)
    reactions = np.abs(motion.multipliers).max(initial=0.0)
    np.testing.assert_allclose(multipliers, motion.multipliers, rtol=0, atol=1e-11 * reactions)


def test_a_debugger_enters_the_step_and_what_it_calls_by_address(plain: Any) -> None:
    _, entered, numba = plain
    assert not numba
    assert ENTERED - entered == set()


def test_where_nothing_is_compiled_an_unknown_field_is_named() -> None:
    table = packed(Method(*range(len(Method._fields))))
    struct = opener(Method)(table.ctypes.data)
    assert (struct.am, struct.iterations, struct.trusting) == (1.0, 9, True)
    with np.errstate(divide="ignore"):
        assert 1.0 / struct.h == np.inf
    with pytest.raises(AttributeError, match=r"Method has no field step, but h, am, af"):
        struct.step  # noqa: B018
