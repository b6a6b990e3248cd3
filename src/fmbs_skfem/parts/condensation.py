r"""Bodies of matrices with few shape functions, by Craig and Bampton, which move by large rotations.

    u = sum_j Psi_j b_j + sum_i Phi_i a_i        interface functions of the places, fixed-interface modes: see `interface_shapes`
    r(X_n) = sum_s N_s(n) p_s,    N = [1, X, x-, y- and z-components of all Psi_j and Phi_i],    p_s vectors of the scene

Every component of a shape is a function of its own, so that the space holds with a shape its
rotations of any size: mass and stiffness are constant, and the stiffness turns with the body, see
`systems.terms.corotated`.

Sources: R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313-1319, doi 10.2514/3.4741; A. Pechstein,
D. Reischl, J. Gerstmayr, J. Comput. Nonlinear Dynam. 8 (2013) 031019, doi 10.1115/1.4007191.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from ..bodies.body import Body
from ..bodies.from_matrices import about_center
from ..core.algebra.linalg import alike, as_dense
from ..core.errors import InputError, say
from ..core.notices import notify
from ..dynamics.near_state.linear import linearise
from ..dynamics.near_state.modes import real_modes
from ..systems import assemble
from . import bodies as parts
from . import interface_shapes

DIGITS = 1e-3  #: square of the frequency of a rigid motion, over that of the lowest vibration, that is told
LEAST = 4  #: modes in reserve


def condense(body: Body, modes: int, checked: bool = True) -> Body:
    """A body of matrices with the functions of its interfaces and `modes` fixed-interface modes,
    and where it is to be `checked` one with as many again in reserve, LEAST at least.

    InputError where it has no places, or moves without energy by more than rigid motions.
    """
    where = f"body '{body.name}'"
    assert body.linear is not None
    if not body.frames and not body.places:
        remedy = "name interfaces or points, at which joints and loads act"
        raise InputError(say(where, "places between which it has shapes", "none", remedy))
    more = max(LEAST, modes) if checked else 0
    shapes = interface_shapes.of_interfaces(body, modes + more)
    S, T = functions(body, shapes, len(shapes) - more)
    found = judged(with_functions(body, S), body)
    return replace(found, spare=with_functions(body, np.hstack([S, T]))) if T.shape[1] else found


def judged(few: Body, whole: Body) -> Body:
    """A body of matrices that knows its lowest frequency, as few functions of a whole one have it.

        max |Q^T K Q v| / |Q^T M Q v|  over  omega_1^2,    Q the rigid motions

    Where rigid motions of the whole cost so much energy that the digits of its stiffness may change
    frequencies, that is said.
    """
    linear = few.linear
    assert linear is not None
    assert whole.linear is not None
    Q = interface_shapes.rigid_motions(whole)
    stiff, heavy = Q.T @ (whole.linear.stiffness @ Q), Q.T @ (alike(whole.mass, whole.dim) @ Q)
    noise = float(np.abs(eigh(stiff, heavy, eigvals_only=True)).max())
    found = real_modes(linearise(assemble([few], pictures=False)), Q.shape[1] + 1).squares
    if len(found) == Q.shape[1]:
        return few
    if noise > DIGITS * found[-1]:
        hertz = np.sqrt([noise, found[-1]]) / (2.0 * np.pi)
        text = f"body '{few.name}': rigid motions of its stiffness vibrate at {hertz[0]:.3g} Hz, the lowest other one at {hertz[1]:.3g} Hz"
        off = f"frequencies may be off by {noise / found[-1]:.1g}; write it with more digits"
        notify(f"{text}: {off}")
    return replace(few, linear=replace(linear, slowest=float(np.sqrt(found[-1]))))


def with_functions(body: Body, S: np.ndarray) -> Body:
    """A body of matrices with functions S (b, m) over its own."""
    linear = body.linear
    assert linear is not None
    wide = alike(csr_array(S), body.dim)
    center, about = about_center(body)
    found = parts.projected(body, S, np.column_stack([body.constant, about]))
    return replace(
        body,
        reference=found[:, 1:] + np.outer(found[:, 0], center),
        constant=np.ascontiguousarray(found[:, 0]),
        mass=parts.symmetric(body.mass, S),
        spread=csr_array(S if body.spread is None else body.spread @ S),
        axes=None if body.axes is None else csr_array(body.axes @ S),
        outline=None if body.outline is None else body.outline @ S,
        recovery={name: as_dense(rows @ wide) for name, rows in body.recovery.items()},
        linear=parts.transformed(linear, wide),
    )


def functions(body: Body, shapes: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Functions of displacements (j, b, c) of a body: S (b, m), of the first ones, and T (b, t) of
    the rest.

    S are the field 1, the reference, the components of the first `count` of them, and one for each
    axis of a frame: its change of second order in a rotation moves nothing else.
    """
    W = parts.metric(body)
    loose = np.zeros(len(body.reference), dtype=bool)
    if body.axes is not None:
        loose[[k for k in body.axes.indices if body.constant[k] == 0.0]] = True
    kept = np.where(loose[:, None], 0.0, np.column_stack([body.constant, about_center(body)[1]]))
    moved = np.where(loose[None, :, None], 0.0, shapes)
    affine = parts.orthonormal(W, kept)
    own = np.hstack([affine, parts.functions_of(body, W, affine, moved[:count])])
    beside = parts.functions_of(body, W, own, moved[count:])
    return parts.with_places(body, np.hstack([own, np.eye(len(loose))[:, loose]])), beside


def damp(body: Body, ratio: float) -> Body:
    """The body with all of its free vibrations damped by a ratio.

    C = sum_i 2 ratio w_i M v_i v_i^T M,    K v_i = w_i^2 M v_i,    v_i^T M v_i = 1
    """
    linear = linearise(assemble([body], pictures=False))
    modes = real_modes(linear, len(linear.x))
    w = modes.angular_frequencies
    MV = np.asarray(linear.mass @ modes.shapes) * np.sqrt(2.0 * ratio * w)
    assert body.linear is not None
    own = body.linear.damping
    C = MV @ MV.T + (0.0 if own is None else as_dense(own))
    spare = None if body.spare is None else damp(body.spare, ratio)
    return replace(body, linear=replace(body.linear, damping=C), spare=spare)
