r"""Closest points of a surface of cubic triangles to a point.

    X(u, v) = sum_i P_i x_i + sum_i (H_ij D_ij + H_ik D_ik),    D_ij = (xi_j - xi_i) . (dx_i/dxi1, dx_i/dxi2)
    P_i = l_i^2 (3 - 2 l_i) + 2 l_1 l_2 l_3,    H_ij = l_i^2 l_j + l_1 l_2 l_3 / 2,    l = (1 - u - v, u, v)

with the places x_i and the tangents of the vertices i of a triangle, j and k the two others, at xi
in the parent of its cell. Such a triangle holds all parabolas; its sides are cubics that the
triangles on both sides share, its normals at vertices are those of the surface. On a cylinder of
radius R sides of length h make an error of 0.0026 h^4 / R^3, of flat triangles it is 0.12 h^2 / R.

    |p - X(u, v)|^2 -> min    on every triangle, so that l_i >= 0: inside, on a side, or at a vertex                          (7)

Source: Bazeley, Cheung, Irons and Zienkiewicz, Proc. 1st Conf. Matrix Methods in Structural
Mechanics, AFFDL-TR-66-80 (1965) 547-576 (the triangle).
"""

from __future__ import annotations

import numpy as np

from ..core.compiling.jit import jit
from .law import Scalar

LIMIT = 40  #: corrections of a closest point
# as in `curves`: one more would be less than round-off
NEAR = 1e-11  #: correction that is the last but one
SIDE = 1e-13  #: of a coordinate l that is 0
#: where a closest point is; 1, 2 and 3 are the sides opposite of the vertices
INSIDE, VERTEX = (
    0,
    4,
)
ALONG = np.array([[-1.0, 1.0], [0.0, 1.0], [1.0, 0.0]])  #: directions in (u, v) of these sides
NINE = 9  #: numbers of a vertex, and vectors of a triangle


@jit
def weigh_vectors(u: Scalar, v: Scalar, at: np.ndarray, W: np.ndarray) -> None:
    """Weights of x, x,1, x,2 of three vertices at parent points (3, 2).

        N, N,u, N,v, N,uu, N,uv, N,vv

    in W (6, 9), row by row.
    """
    l = (1.0 - u - v, u, v)
    zero = 0.0 * (u + v)
    by = ((-1.0, 1.0, 0.0), (-1.0, 0.0, 1.0))
    for m in range(6):
        d, e = by[1 if m in (2, 5) else 0], by[1 if m in (4, 5) else 0]
        order = 0 if m == 0 else (1 if m < 3 else 2)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            a, b, c = l[i], l[j], l[k]
            if order == 0:
                all_three, own, one, other = (
                    a * b * c,
                    a * a * (3.0 - 2.0 * a),
                    a * a * b,
                    a * a * c,
                )
            elif order == 1:
                all_three = d[i] * b * c + a * (d[j] * c + b * d[k])
                own, one, other = (
                    6.0 * a * (1.0 - a) * d[i],
                    a * (2.0 * d[i] * b + a * d[j]),
                    a * (2.0 * d[i] * c + a * d[k]),
                )
            else:
                all_three = (
                    d[i] * (e[j] * c + e[k] * b)
                    + d[j] * (e[i] * c + e[k] * a)
                    + d[k] * (e[i] * b + e[j] * a)
                )
                own = 6.0 * (1.0 - 2.0 * a) * d[i] * e[i]
                one = 2.0 * (d[i] * e[i] * b + a * (d[i] * e[j] + d[j] * e[i])) + zero
                other = 2.0 * (d[i] * e[i] * c + a * (d[i] * e[k] + d[k] * e[i])) + zero
            W[m, 3 * i] = own + 2.0 * all_three
            for q in range(2):
                W[m, 3 * i + 1 + q] = (at[j, q] - at[i, q]) * (one + 0.5 * all_three)
                W[m, 3 * i + 1 + q] += (at[k, q] - at[i, q]) * (other + 0.5 * all_three)


@jit
def trace(
    y: np.ndarray, corners: np.ndarray, W: np.ndarray, many: int, w: np.ndarray, row: int
) -> None:
    """w[row + m] = derivatives m < `many` of a triangle of vertices (3,), of which each has NINE
    numbers in y.
    """
    for m in range(many):
        for c in range(3):
            w[row + m, c] = 0.0 * W[0, 0]
            for j in range(NINE):
                w[row + m, c] += W[m, j] * y[NINE * corners[j // 3] + 3 * (j % 3) + c]


@jit
def dot(a: np.ndarray, b: np.ndarray) -> Scalar:
    """a . b in space."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def curve(w: np.ndarray) -> tuple[Scalar, Scalar, Scalar, Scalar, Scalar]:
    """Derivatives by u, v, uu, uv, vv of half the square of the distance d = w[6], from those of X
    in w[0:6].

        -d.X,u,  -d.X,v,  X,u.X,u - d.X,uu,  X,u.X,v - d.X,uv,  X,v.X,v - d.X,vv
    """
    d = w[6]
    return (
        -dot(d, w[1]),
        -dot(d, w[2]),
        dot(w[1], w[1]) - dot(d, w[3]),
        dot(w[1], w[2]) - dot(d, w[4]),
        dot(w[2], w[2]) - dot(d, w[5]),
    )


@jit
def along_side(
    held: int, found: tuple[Scalar, Scalar, Scalar, Scalar, Scalar]
) -> tuple[Scalar, Scalar]:
    """Newton's step along the side (t, r) that is `held`, and by how much it lowers what `curve`
    has found, if that is convex there.

        step = -f' / f'',    f'^2 / f'',    f' = t f,u + r f,v,    f'' = t^2 f,uu + 2 t r f,uv + r^2 f,vv
    """
    one, other, uu, uv, vv = found
    t, r = ALONG[held - 1, 0], ALONG[held - 1, 1]
    bent, slope = t * t * uu + 2.0 * t * r * uv + r * r * vv, t * one + r * other
    return -slope / bent, slope * slope / bent


@jit
def correction(w: np.ndarray, held: int) -> tuple[Scalar, Scalar]:
    """Newton's correction of (u, v) for half the square f of the distance.

        (f,uu f,uv; f,uv f,vv) (du, dv) = -(f,u, f,v)

    Along a side alone where it is `held` there, none at a vertex.
    """
    found = curve(w)
    one, other, uu, uv, vv = found
    if held == VERTEX:
        return 0.0 * one, 0.0 * one
    if held != INSIDE:
        step, _ = along_side(held, found)
        return ALONG[held - 1, 0] * step, ALONG[held - 1, 1] * step
    det = uu * vv - uv * uv
    return (uv * other - vv * one) / det, (uv * one - uu * other) / det


@jit
def step_within(u: float, v: float, w: np.ndarray) -> tuple[float, float, int, bool]:
    """The step of (u, v) that stays in the triangle, where it is held, and whether the border has
    cut it off.

    It is Newton's, or Gauss's where it is no minimum.
    """
    one, other, uu, uv, vv = curve(w)
    if not (uu > 0.0 and uu * vv - uv * uv > 1e-12 * dot(w[1], w[1]) * dot(w[2], w[2])):
        uu, uv, vv = dot(w[1], w[1]), dot(w[1], w[2]), dot(w[2], w[2])
    det = uu * vv - uv * uv
    du = (uv * other - vv * one) / det
    dv = (uv * one - uu * other) / det
    held = INSIDE
    l = (1.0 - u - v, u, v)
    steps = (-du - dv, du, dv)
    blocked = False
    for i in range(3):
        blocked = blocked or (l[i] <= SIDE and steps[i] < 0.0)
    # at a border the step goes along that side which lowers the distance most
    if blocked:
        du = 0.0
        dv = 0.0
        held = VERTEX
        most = -1.0
        for i in range(3):
            if l[i] > SIDE:
                continue
            step, gain = along_side(i + 1, (one, other, uu, uv, vv))
            p, q = ALONG[i, 0] * step, ALONG[i, 1] * step
            inside = True
            for j in range(3):
                change = -p - q if j == 0 else (p if j == 1 else q)
                inside = inside and (j == i or l[j] > SIDE or change >= 0.0)
            if inside and gain > most:
                du = p
                dv = q
                held = i + 1
                most = gain
    part = 1.0
    steps = (-du - dv, du, dv)
    for i in range(3):
        if steps[i] < 0.0 and l[i] > SIDE:
            part = min(part, -l[i] / steps[i])
    return part * du, part * dv, held, part < 1.0


@jit
def meet_triangle(
    y: np.ndarray,
    corners: np.ndarray,
    at: np.ndarray,
    p: np.ndarray,
    u: float,
    v: float,
    w: np.ndarray,
    W: np.ndarray,
) -> tuple[float, float, int]:
    """u, v of (7) on one triangle from a start, and where it is held; w[0:7] are X, its derivatives
    and p - X, W its weights.
    """
    held = INSIDE
    last = False
    for _ in range(LIMIT):
        weigh_vectors(u, v, at, W)
        trace(y, corners, W, 6, w, 0)
        for c in range(3):
            w[6, c] = p[c] - w[0, c]
        if last:
            break
        du, dv, held, cut = step_within(u, v, w)
        # a step that ends at a border, however short, goes on along it
        last = not cut and max(abs(du), abs(dv)) < NEAR
        u, v = min(max(u + du, 0.0), 1.0), min(max(v + dv, 0.0), 1.0)
        if u + v > 1.0:
            u = 1.0 - v
    return u, v, held


@jit
def meet_flat(y: np.ndarray, corners: np.ndarray, p: np.ndarray) -> tuple[float, float, float]:
    """Distance of p from the flat triangle of three vertices, and its closest u and v."""
    a, b, c = NINE * corners[0], NINE * corners[1], NINE * corners[2]
    bb, bc, cc, pb, pc, pp = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        one, other, d = y[b + i] - y[a + i], y[c + i] - y[a + i], p[i] - y[a + i]
        bb, bc, cc = bb + one * one, bc + one * other, cc + other * other
        pb, pc, pp = pb + d * one, pc + d * other, pp + d * d
    det = bb * cc - bc * bc
    u, v = (cc * pb - bc * pc) / det, (bb * pc - bc * pb) / det
    # the foot on the plane is outside: the nearest point is on one of the sides
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        least = np.inf
        for side in range(3):  # x_b to x_c, x_a to x_c, x_a to x_b
            if side == 0:
                t = (pc - pb - bc + bb) / (bb - 2.0 * bc + cc)
            else:
                t = pc / cc if side == 1 else pb / bb
            t = min(max(t, 0.0), 1.0)
            q, r = (1.0 - t, t) if side == 0 else ((0.0, t) if side == 1 else (t, 0.0))
            square = pp - 2.0 * (q * pb + r * pc) + q * q * bb + 2.0 * q * r * bc + r * r * cc
            if square < least:
                least, u, v = square, q, r
    return (
        np.sqrt(
            max(pp - 2.0 * (u * pb + v * pc) + u * u * bb + 2.0 * u * v * bc + v * v * cc, 0.0)
        ),
        u,
        v,
    )


@jit
def extents(y: np.ndarray, corners: np.ndarray, at: np.ndarray) -> tuple[float, float]:
    """Longest side of all flat triangles, and how far the cubic ones can be away.

        max |x_j - x_i|,    1/3 max |D_ij - (x_j - x_i)|

    of vertices i and j of triangles (h, 3).
    """
    long, bulge = 0.0, 0.0
    for f in range(len(corners)):
        for i in range(3):
            a = NINE * corners[f, i]
            for k in range(1, 3):
                j = (i + k) % 3
                b = NINE * corners[f, j]
                square = 0.0
                off = 0.0
                x, z = (
                    at[corners[f, j], 0] - at[corners[f, i], 0],
                    at[corners[f, j], 1] - at[corners[f, i], 1],
                )
                for c in range(3):
                    side = y[b + c] - y[a + c]
                    square += side * side
                    off += (x * y[a + 3 + c] + z * y[a + 6 + c] - side) ** 2
                long, bulge = max(long, square), max(bulge, off)
    return np.sqrt(long), np.sqrt(bulge) / 3.0
