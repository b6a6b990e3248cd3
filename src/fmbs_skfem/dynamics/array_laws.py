r"""Elastic laws over an array namespace `xp`: stress and modulus of `bodies.cable_law` and `bodies.membrane_law`, for many members.

    S = w dW/du,   D = w d2W/du2,   u (b, k, c, p),  S (b, k, c, p),  D (b, k c, k c, p),  section (b, i, p)

Only functions that NumPy, CuPy and jax.numpy share, and no assignment to parts of arrays. Letters: b member, k derivative of r,
c component, p point. Laws are without damping.
"""

from __future__ import annotations

from typing import Any

from ..bodies.laws import Law
from ..core.errors import InputError, say
from ..systems.system import Sampled

SMALL = 1e-12  #: keeps 1 - kappa0 / kappa finite [1/m2], as in `cable_law`


def check(gather: Sampled, name: str) -> None:
    """Refuse laws that are not written over arrays."""
    if gather.law not in (Law.QUADRATIC, Law.MATERIAL, Law.EXACT, Law.MEMBRANE):
        raise InputError(say(f"body '{name}'", "a cable or a membrane", gather.law.name.lower(), "use integrate_many"))


def stress(xp: Any, law: Law, u: Any, section: Any) -> Any:
    """S = w dW/du, the shape of u."""
    if law is Law.MEMBRANE:
        return membrane_stress(xp, u, section)
    if u.shape[2] == 2 and law > 0:
        return planar_stress(xp, int(law), u, section)
    return spatial_stress(xp, int(law), u, section)


def modulus(xp: Any, law: Law, u: Any, section: Any) -> Any:
    """D = w d2W/du2."""
    if law is Law.MEMBRANE:
        blocks = membrane_modulus(xp, u, section)
    elif u.shape[2] == 2 and law > 0:
        blocks = planar_modulus(xp, int(law), u, section)
    else:
        blocks = spatial_modulus(xp, int(law), u, section)
    first, mixed, second = blocks
    above = xp.concatenate([first, mixed], axis=2)
    below = xp.concatenate([xp.swapaxes(mixed, 1, 2), second], axis=2)
    return xp.concatenate([above, below], axis=1)


def outer(xp: Any, a: Any, b: Any) -> Any:
    """a b^T a point, (b, c, c, p)."""
    return a[:, :, None, :] * b[:, None, :, :]


def identity(xp: Any, factor: Any, dim: int) -> Any:
    """factor (b, p) times the unit matrix, (b, c, c, p)."""
    return factor[:, None, None, :] * xp.eye(dim)[None, :, :, None]


def times(factor: Any, matrix: Any) -> Any:
    """A number a point times a matrix a point."""
    return factor[:, None, None, :] * matrix


def invariants(xp: Any, n: int, u: Any) -> tuple[Any, ...]:
    """a = r'.r', b = r'.r'', d = r''.r'', H = kappa^2 and h = a^-n."""
    r, s = u[:, 0], u[:, 1]
    a, b, d = (r * r).sum(axis=1), (r * s).sum(axis=1), (s * s).sum(axis=1)
    if n == 0:
        return a, b, d, d, xp.ones_like(a)
    h = a ** (-n)
    return a, b, d, h * xp.maximum(a * d - b * b, 0.0), h


def gradient(xp: Any, n: int, a: Any, b: Any, d: Any, H: Any, h: Any) -> tuple[Any, Any, Any]:
    """dH/dr' = p1 r' + p2 r'',  dH/dr'' = p2 r' + q2 r''."""
    if n == 0:
        return xp.zeros_like(a), xp.zeros_like(a), 2.0 * xp.ones_like(a)
    return -2.0 * n * H / a + 2.0 * h * d, -2.0 * h * b, 2.0 * h * a


def bending(xp: Any, H: Any, section: Any) -> tuple[Any, Any]:
    """phi = dW/dH and d phi/dH, times the weight; zero natural curvature keeps them finite where the line is straight."""
    EI, k0 = section[:, 3] * section[:, 1], xp.maximum(section[:, 2], 0.0)
    kappa = xp.sqrt(H + SMALL)
    return 0.5 * EI * (1.0 - k0 / kappa), 0.25 * EI * k0 / kappa**3


def spatial_stress(xp: Any, n: int, u: Any, section: Any) -> Any:
    """S = N r' + phi dH/du with phi = dW/dH."""
    a, b, d, H, h = invariants(xp, n, u)
    p1, p2, q2 = gradient(xp, n, a, b, d, H, h)
    N, (phi, _) = section[:, 3] * section[:, 0] * 0.5 * (a - 1.0), bending(xp, H, section)
    r, s = u[:, 0], u[:, 1]
    first = (N + phi * p1)[:, None] * r + (phi * p2)[:, None] * s
    return xp.stack([first, (phi * p2)[:, None] * r + (phi * q2)[:, None] * s], axis=1)


def spatial_modulus(xp: Any, n: int, u: Any, section: Any) -> tuple[Any, Any, Any]:
    """Blocks D11, D12, D22 as combinations of the identity and of r' r''."""
    a, b, d, H, h = invariants(xp, n, u)
    p1, p2, q2 = gradient(xp, n, a, b, d, H, h)
    phi, slope = bending(xp, H, section)
    EA, dim = section[:, 3] * section[:, 0], u.shape[2]
    r, s = u[:, 0], u[:, 1]
    g1 = p1[:, None] * r + p2[:, None] * s
    g2 = p2[:, None] * r + q2[:, None] * s
    first = identity(xp, EA * 0.5 * (a - 1.0), dim) + times(EA, outer(xp, r, r)) + times(slope, outer(xp, g1, g1))
    mixed, second = times(slope, outer(xp, g1, g2)), identity(xp, phi * q2, dim) + times(slope, outer(xp, g2, g2))
    if n == 0:
        return first, mixed, second
    rr, rs, ss = outer(xp, r, r), outer(xp, r, s), outer(xp, s, s)
    sr, fall = xp.swapaxes(rs, 1, 2), phi * 4.0 * n * h * b / a
    first = first + identity(xp, phi * p1, dim) + times(phi * (4.0 * n * (n + 1) * H / (a * a) - 8.0 * n * h * d / a), rr)
    first = first + times(fall, rs + sr) - times(2.0 * phi * h, ss)
    mixed = mixed + identity(xp, phi * p2, dim) + times(fall, rr) + times(phi * 4.0 * h * (1.0 - n), rs) - times(2.0 * phi * h, sr)
    return first, mixed, second - times(2.0 * phi * h, rr)


def turned(xp: Any, r: Any) -> Any:
    """(y, -x) of vectors (b, 2, p)."""
    return xp.stack([r[:, 1], -r[:, 0]], axis=1)


def planar_terms(xp: Any, n: int, u: Any, section: Any) -> tuple[Any, ...]:
    """a, g = a^(-n/2), kappa, N, M and the gradients of kappa (b, c, p), with N and M times the weight."""
    r, s = u[:, 0], u[:, 1]
    a = (r * r).sum(axis=1)
    g = a ** (-0.5 * n)
    kappa = (r[:, 0] * s[:, 1] - r[:, 1] * s[:, 0]) * g
    N = section[:, 3] * section[:, 0] * 0.5 * (a - 1.0)
    M = section[:, 3] * section[:, 1] * (kappa - section[:, 2])
    return a, g, N, M, g[:, None] * turned(xp, s) - (n * kappa / a)[:, None] * r, -g[:, None] * turned(xp, r)


def planar_stress(xp: Any, n: int, u: Any, section: Any) -> Any:
    """S = N r' + M dkappa/du with the signed curvature."""
    _, _, N, M, k1, k2 = planar_terms(xp, n, u, section)
    return xp.stack([N[:, None] * u[:, 0] + M[:, None] * k1, M[:, None] * k2], axis=1)


def planar_modulus(xp: Any, n: int, u: Any, section: Any) -> tuple[Any, Any, Any]:
    """EA eps_u eps_u' + N eps_uu + EI kappa_u kappa_u' + M kappa_uu with the signed curvature."""
    a, g, N, M, k1, k2 = planar_terms(xp, n, u, section)
    r, t, normal = u[:, 0], turned(xp, u[:, 1]), -turned(xp, u[:, 0])
    kappa = (r * t).sum(axis=1) * g
    EA, EI, cross = section[:, 3] * section[:, 0], section[:, 3] * section[:, 1], -n * M * g / a
    first = times(EI, outer(xp, k1, k1)) + identity(xp, N - n * M * kappa / a, 2)
    first = first + times(EA + M * kappa * n * (n + 2) / (a * a), outer(xp, r, r)) + times(cross, outer(xp, r, t) + outer(xp, t, r))
    quarter = xp.asarray([[0.0, 1.0], [-1.0, 0.0]])[None, :, :, None]
    mixed = times(EI, outer(xp, k1, k2)) + times(cross, outer(xp, r, normal)) + times(M * g, quarter)
    return first, mixed, times(EI, outer(xp, k2, k2))


def membrane_forces(u: Any, section: Any) -> tuple[Any, Any, Any]:
    """N11, N22, N12 in plane stress, times the weight."""
    first, second = u[:, 0], u[:, 1]
    e11, e22 = 0.5 * ((first * first).sum(axis=1) - 1.0), 0.5 * ((second * second).sum(axis=1) - 1.0)
    A, nu = section[:, 2] * section[:, 0], section[:, 1]
    return A * (e11 + nu * e22), A * (e22 + nu * e11), A * (1.0 - nu) * 0.5 * (first * second).sum(axis=1)


def membrane_stress(xp: Any, u: Any, section: Any) -> Any:
    """dW/dr,a = N_ab r,b."""
    N11, N22, N12 = membrane_forces(u, section)
    first, second = u[:, 0], u[:, 1]
    return xp.stack([N11[:, None] * first + N12[:, None] * second, N12[:, None] * first + N22[:, None] * second], axis=1)


def membrane_modulus(xp: Any, u: Any, section: Any) -> tuple[Any, Any, Any]:
    """D11 = N11 I + A r,1 r,1 + G r,2 r,2,  D12 = N12 I + A nu r,1 r,2 + G r,2 r,1,  D22 like D11,  G = A (1 - nu)/2."""
    N11, N22, N12 = membrane_forces(u, section)
    A, nu = section[:, 2] * section[:, 0], section[:, 1]
    G = 0.5 * A * (1.0 - nu)
    aa, bb, ab = outer(xp, u[:, 0], u[:, 0]), outer(xp, u[:, 1], u[:, 1]), outer(xp, u[:, 0], u[:, 1])
    mixed = identity(xp, N12, 2) + times(A * nu, ab) + times(G, xp.swapaxes(ab, 1, 2))
    return identity(xp, N11, 2) + times(A, aa) + times(G, bb), mixed, identity(xp, N22, 2) + times(A, bb) + times(G, aa)
