"""Bodies by the matrices of other programs: what is checked of them, their interfaces, and their
few shape functions.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import block_diag, csr_array, eye_array, kron
from scipy.sparse.linalg import eigsh
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Body, Material, Rectangular
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.from_matrices import Coupling, from_matrices, rigidity
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    integrate,
    outputs,
    solve_statics,
    vibration_modes,
)
from fmbs_skfem.parts.condensation import condense, damp
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, Motion, assemble, check_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes, recovered
from verification import solids

MASS = 2700.0 * 0.05**2


@cache
def matrices() -> tuple[np.ndarray, csr_array, csr_array]:
    """A bar of 1 m x 50 x 50 mm of aluminium."""
    return solids.bar()


def ends(left: bool = True, right: bool = True) -> dict[str, Coupling]:
    """Both ends as interfaces, rigid or averages."""
    nodes = matrices()[0]
    return {
        "left": Coupling(solids.at(nodes, 0.0), left),
        "right": Coupling(solids.at(nodes, 1.0), right),
    }


@cache
def rod(modes: int = 6, right: bool = True) -> Body:
    return condense(from_matrices("rod", *matrices(), interfaces=ends(right=right)), modes)


@cache
def hertz() -> np.ndarray:
    """Elastic frequencies of the free bar, by the solver of SciPy."""
    _, K, M = matrices()
    found = eigsh(K, 14, M=M, sigma=-1e5, return_eigenvectors=False)
    return np.asarray(np.sqrt(np.sort(found)[6:]) / (2.0 * np.pi))


def test_mass_centre_and_inertia_are_those_of_a_bar() -> None:
    body = from_matrices("rod", *matrices(), interfaces=ends())
    center, inertia = rigidity(body)
    assert body.total_mass == pytest.approx(MASS, rel=1e-12)
    assert_allclose(center, [0.5, 0.0, 0.0], atol=1e-12)
    J = MASS / 12.0 * np.array([2 * 0.05**2, 1.0 + 0.05**2, 1.0 + 0.05**2])
    assert_allclose(inertia, np.diag(J), atol=1e-12)
    for one in (rod(), rod(right=False)):
        assert one.total_mass == pytest.approx(MASS, rel=1e-12)
        assert_allclose(rigidity(one)[1], np.diag(J), atol=1e-9)


@pytest.mark.parametrize("right", [True, False])
def test_few_modes_vibrate_as_the_whole_body(right: bool) -> None:
    found = vibration_modes(assemble([rod(10, right)], pictures=False), 12).angular_frequencies
    ratio = found[6:] / (2.0 * np.pi) / hertz()[:6]
    assert (ratio > 1.0 - 1e-9).all()
    # rigid ends are stiffer than those of the bar, more so where it bends more often
    assert_allclose(ratio, 1.0, atol=8e-3)
    assert ratio[0] < 1.0005


def test_all_nodes_vibrate_as_the_matrices_do() -> None:
    """To 1e-6 of the frequencies of SciPy, turned and moved, too."""
    turn = Rotation.from_rotvec([0.3, -1.0, 2.0]).as_matrix()
    moved: dict[str, Any] = {"origin": np.array([10.0, -5.0, 3.0]), "rotation": turn}
    nodes, K, M = solids.bar((3, 1, 1))
    wanted = np.sqrt(np.sort(eigsh(K, 10, M=M, sigma=-1e5, return_eigenvectors=False))[6:])
    for where in ({}, moved):
        body = from_matrices("rod", nodes, K, M, places={"tip": 0}, **where)
        found = vibration_modes(assemble([body], pictures=False), 10).angular_frequencies[6:]
        assert_allclose(found, wanted, rtol=1e-6)


@pytest.mark.parametrize("right", [True, False])
def test_equations_of_rigid_and_average_interfaces_keep_their_contract(right: bool) -> None:
    check_system(assemble([damp(rod(2, right), 0.02)], pictures=False))


def axes_of(body: Body, frame: str, q: np.ndarray) -> np.ndarray:
    """e_1, e_2, e_3 of a frame as columns (s, 3, 3), of body coordinates (s, q)."""
    assert body.axes is not None
    rows = body.axes.toarray()[body.frames[frame] + 1 : body.frames[frame] + 4]
    return np.einsum("kb,sbc->sck", rows, q.reshape(len(q), -1, 3))


def test_an_average_turns_with_its_face_by_a_full_turn() -> None:
    """A free bar that spins about its long axis: its frame is orthonormal, and turns at 5 rad/s."""
    given = {"rod": Motion(angular_velocity=(5.0, 0.0, 0.0), center=(0.5, 0.0, 0.0))}
    body = rod(0, right=False)
    system = assemble([body], initial=given, pictures=False)
    motion = integrate(system, GeneralizedAlpha(2e-3), 1.5, Newton(tolerance=1e-11))
    turn = axes_of(body, "right", motion.x)
    assert_allclose(
        np.einsum("sci,scj->sij", turn, turn), np.broadcast_to(np.eye(3), turn.shape), atol=1e-9
    )
    angle = np.unwrap(np.arctan2(turn[:, 2, 1], turn[:, 1, 1]))
    assert_allclose(angle, 5.0 * motion.times, atol=2e-3)
    assert angle[-1] > 2.0 * np.pi


def test_a_static_cantilever_is_that_of_its_matrices() -> None:
    """Interface functions are exact at rest: against a solution of K by hand; P L^3 / 3 E I with
    shear and M L / G J with J = 0.140577 a^4 (Saint-Venant) to 5 % of coarse cells and rigid ends.
    """
    nodes, K, M = solids.bar((8, 2, 2))
    left, right = solids.at(nodes, 0.0), solids.at(nodes, 1.0)
    faces = {"left": Coupling(left), "right": Coupling(right)}
    body = condense(from_matrices("rod", nodes, K, M, interfaces=faces), 0)
    push = loads.PointForce("P", At("rod", "right"), (0.0, 0.0, 1.0))
    twist = loads.Moment("T", At("rod", "right"), (1.0, 0.0, 0.0))
    seen = {"tip": probes.Position(At("rod", "right"))}
    root = joints.Weld("root", At("rod", "left"))
    system = eliminate(assemble([body], [root], [push, twist], outputs=seen, pictures=False))
    path = solve_statics(system)
    turned = axes_of(body, "right", path.system.lift(path.x[-1])[None])[0, 2, 1]
    # by hand: free nodes, and six motions of the right face
    free = np.setdiff1d(np.arange(len(nodes)), [*left, *right])
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    rigid = np.zeros((3 * len(nodes), 6))
    for node in right:
        rigid[3 * node : 3 * node + 3, :3] = np.eye(3)
        rigid[3 * node : 3 * node + 3, 3:] = np.cross(np.eye(3), nodes[node] - [1.0, 0, 0]).T
    T = np.zeros((3 * len(nodes), len(unknowns) + 6))
    T[unknowns, np.arange(len(unknowns))] = 1.0
    T[:, len(unknowns) :] = rigid
    force = np.zeros(T.shape[1])
    force[len(unknowns) + 2], force[len(unknowns) + 3] = 1.0, 1.0
    exact = np.linalg.solve(T.T @ (K @ T), force)[len(unknowns) :]
    assert outputs(path)["tip_z"][-1] == pytest.approx(exact[2], rel=1e-4)
    assert turned == pytest.approx(exact[3], rel=1e-4)
    E, a = 70e9, 0.05
    assert exact[2] == pytest.approx(4.0 / (E * a**4) + 3.12 / (E * a**2), rel=0.03)
    assert exact[3] == pytest.approx(2.6 / (E * 0.140577 * a**4), rel=0.06)


@pytest.mark.parametrize("tip", ["rigid", "average", "node"])
def test_a_cantilever_bends_far_without_locking(tip: str) -> None:
    """Its end deflected by 9 % of its length, as the elastica to 1 % of that, with the mesh's own
    stiffness: ends that rotate by finite angles strain nothing. No mode and all nodes say the same.
    """
    nodes, K, M = matrices()
    middle = int(np.argmin(np.linalg.norm(nodes - [1.0, 0.0, 0.0], axis=1)))
    faces = {"left": ends()["left"]} | (
        {"tip": ends(right=tip == "rigid")["right"]} if tip != "node" else {}
    )
    points = {"tip": middle} if tip == "node" else {}
    whole = from_matrices("rod", nodes, K, M, interfaces=faces, places=points)
    ratio = {}
    for part in (0.001, 0.09):
        push = loads.PointForce("P", At("rod", "tip"), (0.0, 0.0, part * 3 * 70e9 * 0.05**4 / 12))
        root = joints.Weld("root", At("rod", "left"))
        for body in (whole, condense(whole, 0, checked=False)):
            seen = {"t": probes.Position(At("rod", "tip"))}
            system = eliminate(assemble([body], [root], [push], outputs=seen, pictures=False))
            found = outputs(solve_statics(system))
            ratio[part, body is whole] = found["t_z"][-1] / part
    elastica = 0.08926163 / 0.09  # P L^2 / E I = 0.27
    for one in (True, False):
        assert ratio[0.09, one] / ratio[0.001, one] == pytest.approx(elastica, rel=0.012)
    assert ratio[0.09, False] == pytest.approx(ratio[0.09, True], rel=1e-5)


@pytest.mark.parametrize("right", [True, False])
def test_a_swinging_rod_moves_as_a_beam(right: bool) -> None:
    """A pendulum of matrices against `type: beam`: 1 % of the range, of what it bends."""
    weight = loads.Gravity((0.0, 0.0, -9.81))
    line = beam("rod", segment(8), Rectangular(0.05, 0.05), Material(70e9, 2700.0, 0.3))
    tips = []
    for body in (rod(4, right), line):
        hinge = joints.Revolute("hinge", At("rod", "left"), axis=(0.0, 1.0, 0.0))
        seen = {"tip": probes.Position(At("rod", "right"))}
        system = eliminate(assemble([body], [hinge], [weight], outputs=seen, pictures=False))
        found = outputs(integrate(system, GeneralizedAlpha(2e-3), 0.4, Newton(tolerance=1e-10)))
        tips.append(np.stack([found[f"tip_{axis}"] for axis in "xyz"]))
    assert np.abs(tips[0] - tips[1]).max() < 1e-4


def test_a_body_knows_what_its_modes_leave_out() -> None:
    """Without modes a hinged bar vibrates too fast, by as much as the reserve says."""
    body = rod(0)
    assert body.spare is not None
    whole, few = (
        vibration_modes(assemble([one], pictures=False), 8).angular_frequencies[6:]
        for one in (rod(12), body)
    )
    said = vibration_modes(assemble([body.spare], pictures=False), 8).angular_frequencies[6:]
    assert (few / whole > 1.01).all()
    assert_allclose(few / said, few / whole, rtol=2e-3)


def test_stresses_are_those_of_the_whole_body() -> None:
    """A cantilever, bent and turned with its wall: M z / I at centroids, the same in any direction;
    of all of them the largest von Mises stress.
    """
    cells = (8, 2, 2)
    nodes, K, M = solids.bar(cells)
    where, rows = solids.stresses(cells)
    near = int(np.argmin(np.linalg.norm(where - [0.5, 0.0, 0.02], axis=1)))
    faces = {"left": Coupling(solids.at(nodes, 0.0)), "right": Coupling(solids.at(nodes, 1.0))}
    recovery = {"one": rows[near], "all": rows.reshape(-1, K.shape[0])}
    found = []
    for turn in (np.eye(3), Rotation.from_rotvec([0.5, 1.0, -2.0]).as_matrix()):
        body = condense(
            from_matrices("rod", nodes, K, M, interfaces=faces, recovery=recovery, rotation=turn), 2
        )
        push = loads.PointForce("P", At("rod", "right"), tuple(turn @ [0.0, 0.0, 100.0]))
        seen = {
            "s": recovered.RecoveredStress("rod", "one"),
            "v": recovered.RecoveredStress("rod", "all"),
        }
        root = joints.Weld("root", At("rod", "left"))
        system = assemble([body], [root], [push], outputs=seen, pictures=False)
        found.append({k: v[-1] for k, v in outputs(solve_statics(eliminate(system))).items()})
    x, z = where[near, 0], where[near, 2]
    exact = -100.0 * (1.0 - x) * z / (0.05**4 / 12.0)
    assert found[0]["s_xx"] == pytest.approx(exact, rel=0.05)
    for key, value in found[0].items():
        assert found[1][key] == pytest.approx(value, rel=1e-6, abs=1e-6 * abs(exact))
    # at the wall nearly twice of what it is in the middle
    assert found[0]["v_von_mises"] > 1.5 * found[0]["s_von_mises"]
    u = np.zeros(K.shape[0])
    with pytest.raises(InputError, match="six rows a point"):
        from_matrices("rod", nodes, K, M, recovery={"one": u[None]})


def with_one(K: csr_array, row: int) -> csr_array:
    """A held unknown: zeros in its row and column, a number on the diagonal."""
    kept = np.ones(K.shape[0])
    kept[row] = 0.0
    held = np.zeros(K.shape[0])
    held[row] = 1.0
    size = K.shape[0]
    k = np.arange(size)
    D, one = (csr_array((v, (k, k)), shape=(size, size)) for v in (kept, held))
    return csr_array(D @ K @ D + one)


def local(A: csr_array, node: int, angle: float) -> csr_array:
    """A matrix in which one node has axes of its own."""
    turn = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
    n = A.shape[0] // 3
    Q = csr_array(block_diag([turn if k == node else np.eye(3) for k in range(n)]))
    return csr_array(Q.T @ A @ Q)


def test_matrices_that_are_none_of_a_free_body_are_refused() -> None:
    nodes, K, M = matrices()
    n = len(nodes)
    order = np.random.default_rng(0).permutation(n)
    rotations = kron(eye_array(2), K)
    uneven = K.copy()
    uneven[0, 5] = 1.1 * uneven[0, 5]
    lower = csr_array(np.tril(K.toarray()))
    for what, given in {
        "nodes may be in another order": (nodes[order], K, M),
        "1 unknowns that nothing couples, the first at node 3, y": (nodes, with_one(K, 7), M),
        "held or in local axes at": (nodes, local(K, 5, 0.3), M),
        "rotations are left in": (nodes, csr_array(rotations), M),
        "expected a symmetric matrix": (nodes, uneven, M),
        "has one half alone": (nodes, lower, M),
        "alike for x, y and z": (nodes, K, with_one(M, 3)),
        "in another order than x, y, z of every node": (
            nodes,
            csr_array(K.toarray()[np.ix_(*[np.arange(3 * n).reshape(3, n).T.ravel()] * 2)]),
            M,
        ),
    }.items():
        with pytest.raises(InputError, match=what):
            from_matrices("rod", *given)


def test_a_stiffness_that_is_not_symmetric_by_its_digits_is_told() -> None:
    nodes, K, M = matrices()
    rough = K.copy()
    rough.data = rough.data * (1.0 + 1e-6 * np.sin(np.arange(len(rough.data))))
    with pytest.warns(Notice, match="stiffness is not symmetric"):
        body = from_matrices("rod", nodes, rough, M, interfaces=ends())
    with pytest.warns(Notice, match="frequencies may be off by 0.02; write it with more digits"):
        few = condense(body, 4)
    found = vibration_modes(assemble([few], pictures=False), 8).angular_frequencies
    assert np.abs(found[:6]).max() < 1e-2
    wanted = vibration_modes(assemble([rod(4)], pictures=False), 8).angular_frequencies
    assert_allclose(found[6:], wanted[6:], rtol=0.02)


def test_interfaces_on_a_line_or_with_shared_nodes_are_refused() -> None:
    nodes, K, M = matrices()
    edge = np.flatnonzero(
        (np.abs(nodes[:, 1] - 0.025) < 1e-9) & (np.abs(nodes[:, 2] - 0.025) < 1e-9)
    )
    line = tuple(edge.tolist())
    left = solids.at(nodes, 0.0)
    for rigid in (True, False):
        with pytest.raises(InputError, match="on a line"):
            from_matrices("rod", nodes, K, M, interfaces={"edge": Coupling(line, rigid)})
    both = {"a": Coupling(left), "b": Coupling((*left[:3], 50))}
    with pytest.raises(InputError, match="of them in another one"):
        from_matrices("rod", nodes, K, M, interfaces=both)
    with pytest.raises(InputError, match="2 nodes"):
        from_matrices("rod", nodes, K, M, interfaces={"a": Coupling(left[:2])})
    with pytest.raises(InputError, match="places between which it has shapes"):
        condense(from_matrices("rod", nodes, K, M), 2)


def test_two_bodies_are_joined_by_a_point_and_an_average_of_many_nodes() -> None:
    """A single node of one and the mean of a face of the other: they stay together in a swing."""
    nodes, K, M = matrices()
    middle = int(np.argmin(np.linalg.norm(nodes - [1.0, 0.0, 0.0], axis=1)))
    first = condense(
        from_matrices(
            "one", nodes, K, M, interfaces={"left": ends()["left"]}, places={"tip": middle}
        ),
        2,
    )
    second = condense(
        from_matrices(
            "two",
            nodes,
            K,
            M,
            interfaces={"left": ends(left=False)["left"]},
            origin=np.array([1.0, 0, 0]),
        ),
        2,
    )
    held = [
        joints.Revolute("hinge", At("one", "left"), axis=(0.0, 1.0, 0.0)),
        joints.Pin("ball", At("one", "tip"), At("two", "left")),
    ]
    seen = {"a": probes.Position(At("one", "tip")), "b": probes.Position(At("two", "left"))}
    system = assemble(
        [first, second], held, [loads.Gravity((0.0, 0.0, -9.81))], outputs=seen, pictures=False
    )
    found = outputs(
        integrate(eliminate(system), GeneralizedAlpha(2e-3), 0.2, Newton(tolerance=1e-10))
    )
    for axis in "xyz":
        assert_allclose(found[f"a_{axis}"], found[f"b_{axis}"], atol=1e-9)
    assert found["b_z"][-1] < -0.05


def test_nodes_without_mass_follow_at_rest() -> None:
    """Mid-side nodes of a lumped mass weigh nothing: the first frequencies are those of the corners'
    mass, and a motion runs.
    """
    nodes, K, _ = matrices()
    corners = 28
    m = np.zeros(len(nodes))
    m[:corners] = MASS / corners
    lumped = csr_array((m, (np.arange(len(m)), np.arange(len(m)))), shape=(len(m),) * 2)
    body = condense(from_matrices("rod", nodes, K, lumped, interfaces=ends()), 3)
    assert body.total_mass == pytest.approx(MASS)
    found = vibration_modes(assemble([body], pictures=False), 8).angular_frequencies[6:]
    assert 0.8 < found[0] / (2.0 * np.pi) / hertz()[0] < 1.2
    hinge = joints.Revolute("hinge", At("rod", "left"), axis=(0.0, 1.0, 0.0))
    system = eliminate(
        assemble([body], [hinge], [loads.Gravity((0.0, 0.0, -9.81))], pictures=False)
    )
    motion = integrate(system, GeneralizedAlpha(2e-3), 0.1, Newton(tolerance=1e-10))
    assert np.isfinite(motion.x).all()


@pytest.mark.parametrize("rigid", [True, False])
def test_neither_centres_of_interfaces_nor_the_origin_change_a_body(rigid: bool) -> None:
    nodes, K, M = solids.bar((4, 1, 1), (0.3, 0.01, 0.02), 210e9)
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])

    def tip(center: tuple[float, float, float] | None, shift: np.ndarray) -> np.ndarray:
        left = Coupling(solids.at(nodes, 0.0), rigid, center)
        ends = {"A": left, "B": Coupling(solids.at(nodes, 0.3))}
        bar = from_matrices("bar", nodes, K, M, interfaces=ends, origin=shift, rotation=turn)
        force = tuple(turn @ [100.0, 30.0, -50.0])
        system = assemble(
            [condense(bar, 2)],
            [joints.Clamp("clamp", At("bar", "A"))],
            [loads.PointForce("push", At("bar", "B"), force)],
            outputs={"tip": probes.Position(At("bar", "B"))},
        )
        found = outputs(solve_statics(eliminate(system)))
        place = np.array([found[f"tip_{c}"][-1] for c in "xyz"])
        return turn.T @ (place - shift) - [0.3, 0.0, 0.0]

    once = tip(None, np.zeros(3))
    assert_allclose(tip((-0.02, 0.01, 0.03), np.zeros(3)), once, rtol=0.0, atol=1e-11)
    assert_allclose(tip(None, np.array([1000.0, -200.0, 70.0])), once, rtol=0.0, atol=1e-9)
