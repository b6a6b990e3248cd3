"""Loops of the laws of cables, membranes, shells and planar beams, which `python -m fmbs_skfem.bodies.law_symbols` writes."""

# fmt: off
# ruff: noqa
# mypy: ignore-errors
from __future__ import annotations
import math
from typing import Any
import numpy as np
from fmbs_skfem.core.compiling.entries import LANES, entry, unfold
from fmbs_skfem.core.compiling.jit import carray
from fmbs_skfem.bodies.cable_law import fall


@entry
def quadratic_2_energy(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    s = carray(s, (4, count))
    total = 0.0
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        e0 = 0.5*((u0 * u0) + (u1 * u1) - 1.0)
        x0 = (s2 * s2)
        e1 = u2
        e2 = u3
        x1 = (e1 * e1) + (e2 * e2)
        total += 0.5*s3*((e0 * e0)*s0 + s1*(-2.0*s2*(math.sqrt(1.0e-12*x0 + x1 + 1.0e-60)) + x0 + x1))
    carray(out, 1)[0] = total


@entry
def quadratic_2_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    s = carray(s, (4, count))
    S = carray(out, (4, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        e0 = 0.5*((u0 * u0) + (u1 * u1) - 1.0)
        fe0 = e0*s0*s3
        e1 = u2
        e2 = u3
        x0 = s1*s3*(s2/(math.sqrt((e1 * e1) + (e2 * e2) + 1.0e-12*(s2 * s2) + 1.0e-60)) - 1.0)
        fe1 = -e1*x0
        fe2 = -e2*x0
        S[0, q] = fe0*u0
        S[1, q] = fe0*u1
        S[2, q] = fe1
        S[3, q] = fe2


@entry
def quadratic_2_modulus(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    h = carray(v, (4, count))
    s = carray(s, (4, count))
    D = carray(out, (4, 4, count))
    for q in range(count):
        u0, u1, u2, u3, h0, h1, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], h[0, q], h[1, q], s[0, q], s[1, q], s[2, q], s[3, q]
        ae0 = 0.5*(h0 * h0) + 0.5*(h1 * h1) + (-h0*(h0 - u0) - h1*(h1 - u1) if way == 1 else 0.0) - 0.5
        x5 = s0*s3
        fe0 = ae0*x5
        ke0e0 = x5*(beta + 1.0)
        x0 = (u0 * u0)
        x1 = (u1 * u1)
        x2 = 1.0e-12*(s2 * s2) + 1.0e-60
        e1 = u2
        x6 = (e1 * e1)
        e2 = u3
        x7 = (e2 * e2)
        x8 = x6 + x7
        x9 = x2 + x8
        x10 = s2/(x9 * math.sqrt(x9))
        x11 = s0/s1
        x12 = 1.25e-7*x11
        x13 = beta/(6.25e-8*x11 + x8)
        x14 = 0.5*x13
        x15 = -s2/(math.sqrt(x9)) + 1.0
        x3 = s1*s3
        ke1e1 = x3*(x10*x6 + x14*(x12 + 2.0*x6) + x15)
        ke2e1 = e1*e2*x3*(x10 + x13)
        ke2e2 = x3*(x10*x7 + x14*(x12 + 2.0*x7) + x15)
        D[0, 0, q] = D[0, 0, q] = fe0 + ke0e0*x0
        D[1, 0, q] = D[0, 1, q] = ke0e0*u0*u1
        D[1, 1, q] = D[1, 1, q] = fe0 + ke0e0*x1
        D[2, 0, q] = D[0, 2, q] = 0.0
        D[2, 1, q] = D[1, 2, q] = 0.0
        D[2, 2, q] = D[2, 2, q] = ke1e1
        D[3, 0, q] = D[0, 3, q] = 0.0
        D[3, 1, q] = D[1, 3, q] = 0.0
        D[3, 2, q] = D[2, 3, q] = ke2e1
        D[3, 3, q] = D[3, 3, q] = ke2e2


@entry
def quadratic_2_damped_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    v = carray(v, (4, count))
    s = carray(s, (4, count))
    S = carray(out, (4, count))
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        d4 = u0*v0 + u1*v1
        e0 = 0.5*((u0 * u0) + (u1 * u1) - 1.0)
        fe0 = s0*s3*(beta*d4 + e0)
        d5 = v2
        e1 = u2
        e2 = u3
        x0 = (e1 * e1) + (e2 * e2)
        x1 = s2/(math.sqrt(1.0e-12*(s2 * s2) + x0 + 1.0e-60)) - 1.0
        x2 = s0/s1
        x3 = 1.25e-7*x2
        d6 = v3
        x4 = 2.0*d5*e1 + 2.0*d6*e2
        x5 = 0.5*beta/(x0 + 6.25e-8*x2)
        x6 = s1*s3
        fe1 = x6*(-e1*x1 + x5*(d5*x3 + e1*x4))
        fe2 = x6*(-e2*x1 + x5*(d6*x3 + e2*x4))
        S[0, q] = fe0*u0
        S[1, q] = fe0*u1
        S[2, q] = fe1
        S[3, q] = fe2


@entry
def quadratic_2_dissipation(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    v = carray(v, (4, count))
    s = carray(s, (4, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[3, q]
        d4 = u0*v0 + u1*v1
        d5 = v2
        d6 = v3
        e1 = u2
        e2 = u3
        x0 = 6.25e-8*s0/s1
        W[q] = s3*((d4 * d4)*s0 + s1*(x0*((d5 * d5) + (d6 * d6)) + ((d5*e1 + d6*e2) * (d5*e1 + d6*e2)))/((e1 * e1) + (e2 * e2) + x0))


@entry
def quadratic_3_energy(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (6, count))
    s = carray(s, (4, count))
    total = 0.0
    for q in range(count):
        u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        e0 = 0.5*((u0 * u0) + (u1 * u1) + (u2 * u2) - 1.0)
        x0 = (s2 * s2)
        e1 = u3
        e2 = u4
        e3 = u5
        x1 = (e1 * e1) + (e2 * e2) + (e3 * e3)
        total += 0.5*s3*((e0 * e0)*s0 + s1*(-2.0*s2*(math.sqrt(1.0e-12*x0 + x1 + 1.0e-60)) + x0 + x1))
    carray(out, 1)[0] = total


@entry
def quadratic_3_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (6, count))
    s = carray(s, (4, count))
    S = carray(out, (6, count))
    for q in range(count):
        u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        e0 = 0.5*((u0 * u0) + (u1 * u1) + (u2 * u2) - 1.0)
        fe0 = e0*s0*s3
        e1 = u3
        e2 = u4
        e3 = u5
        x0 = s1*s3*(s2/(math.sqrt((e1 * e1) + (e2 * e2) + (e3 * e3) + 1.0e-12*(s2 * s2) + 1.0e-60)) - 1.0)
        fe1 = -e1*x0
        fe2 = -e2*x0
        fe3 = -e3*x0
        S[0, q] = fe0*u0
        S[1, q] = fe0*u1
        S[2, q] = fe0*u2
        S[3, q] = fe1
        S[4, q] = fe2
        S[5, q] = fe3


@entry
def quadratic_3_modulus(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (6, count))
    h = carray(v, (6, count))
    s = carray(s, (4, count))
    D = carray(out, (6, 6, count))
    T = np.empty((21, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u0, u1, u2, u3, u4, u5, h0, h1, h2, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], h[0, q], h[1, q], h[2, q], s[0, q], s[1, q], s[2, q], s[3, q]
            ae0 = 0.5*(h0 * h0) + 0.5*(h1 * h1) + 0.5*(h2 * h2) + (-h0*(h0 - u0) - h1*(h1 - u1) - h2*(h2 - u2) if way == 1 else 0.0) - 0.5
            x6 = s0*s3
            fe0 = ae0*x6
            ke0e0 = x6*(beta + 1.0)
            x0 = (u0 * u0)
            x20 = ke0e0*u0
            x1 = (u1 * u1)
            x2 = (u2 * u2)
            e1 = u3
            x7 = (e1 * e1)
            e2 = u4
            x8 = (e2 * e2)
            e3 = u5
            x9 = (e3 * e3)
            x10 = x7 + x8 + x9
            x3 = 1.0e-12*(s2 * s2) + 1.0e-60
            x11 = x10 + x3
            x12 = s2/(x11 * math.sqrt(x11))
            x13 = s0/s1
            x14 = 1.25e-7*x13
            x15 = beta/(x10 + 6.25e-8*x13)
            x16 = 0.5*x15
            x17 = -s2/(math.sqrt(x11)) + 1.0
            x4 = s1*s3
            ke1e1 = x4*(x12*x7 + x16*(x14 + 2.0*x7) + x17)
            x18 = x12 + x15
            x19 = e1*x18*x4
            ke2e1 = e2*x19
            ke2e2 = x4*(x12*x8 + x16*(x14 + 2.0*x8) + x17)
            ke3e1 = e3*x19
            ke3e2 = e2*e3*x18*x4
            ke3e3 = x4*(x12*x9 + x16*(x14 + 2.0*x9) + x17)
            T[0, k] = fe0 + ke0e0*x0
            T[1, k] = u1*x20
            T[2, k] = fe0 + ke0e0*x1
            T[3, k] = u2*x20
            T[4, k] = ke0e0*u1*u2
            T[5, k] = fe0 + ke0e0*x2
            T[6, k] = 0.0
            T[7, k] = 0.0
            T[8, k] = 0.0
            T[9, k] = ke1e1
            T[10, k] = 0.0
            T[11, k] = 0.0
            T[12, k] = 0.0
            T[13, k] = ke2e1
            T[14, k] = ke2e2
            T[15, k] = 0.0
            T[16, k] = 0.0
            T[17, k] = 0.0
            T[18, k] = ke3e1
            T[19, k] = ke3e2
            T[20, k] = ke3e3
        unfold(T, first, D, False)


@entry
def quadratic_3_damped_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (6, count))
    v = carray(v, (6, count))
    s = carray(s, (4, count))
    S = carray(out, (6, count))
    for q in range(count):
        u0, u1, u2, u3, u4, u5, v0, v1, v2, v3, v4, v5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], v[0, q], v[1, q], v[2, q], v[3, q], v[4, q], v[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        d6 = u0*v0 + u1*v1 + u2*v2
        e0 = 0.5*((u0 * u0) + (u1 * u1) + (u2 * u2) - 1.0)
        fe0 = s0*s3*(beta*d6 + e0)
        d7 = v3
        e1 = u3
        e2 = u4
        e3 = u5
        x0 = (e1 * e1) + (e2 * e2) + (e3 * e3)
        x1 = s2/(math.sqrt(1.0e-12*(s2 * s2) + x0 + 1.0e-60)) - 1.0
        x2 = s0/s1
        x3 = 1.25e-7*x2
        d8 = v4
        d9 = v5
        x4 = 2.0*d7*e1 + 2.0*d8*e2 + 2.0*d9*e3
        x5 = 0.5*beta/(x0 + 6.25e-8*x2)
        x6 = s1*s3
        fe1 = x6*(-e1*x1 + x5*(d7*x3 + e1*x4))
        fe2 = x6*(-e2*x1 + x5*(d8*x3 + e2*x4))
        fe3 = x6*(-e3*x1 + x5*(d9*x3 + e3*x4))
        S[0, q] = fe0*u0
        S[1, q] = fe0*u1
        S[2, q] = fe0*u2
        S[3, q] = fe1
        S[4, q] = fe2
        S[5, q] = fe3


@entry
def quadratic_3_dissipation(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (6, count))
    v = carray(v, (6, count))
    s = carray(s, (4, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, u4, u5, v0, v1, v2, v3, v4, v5, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], v[0, q], v[1, q], v[2, q], v[3, q], v[4, q], v[5, q], s[0, q], s[1, q], s[3, q]
        d6 = u0*v0 + u1*v1 + u2*v2
        d7 = v3
        d8 = v4
        d9 = v5
        e1 = u3
        e2 = u4
        e3 = u5
        x0 = 6.25e-8*s0/s1
        W[q] = s3*((d6 * d6)*s0 + s1*(x0*((d7 * d7) + (d8 * d8) + (d9 * d9)) + ((d7*e1 + d8*e2 + d9*e3) * (d7*e1 + d8*e2 + d9*e3)))/((e1 * e1) + (e2 * e2) + (e3 * e3) + x0))


@entry
def curved_2_energy(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    s = carray(s, (4, count))
    total = 0.0
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0) + (u1 * u1)
        e0 = 0.5*x0 - 0.5
        e1 = (u0*u3 - u1*u2)*fall(x0, n)
        total += 0.5*s3*((e0 * e0)*s0 + s1*((e1 - s2) * (e1 - s2)))
    carray(out, 1)[0] = total


@entry
def curved_2_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    s = carray(s, (4, count))
    S = carray(out, (4, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0) + (u1 * u1)
        e0 = 0.5*x0 - 0.5
        fe0 = e0*s0*s3
        x1 = u0*u3 - u1*u2
        x3 = n*x1/x0
        x2 = fall(x0, n)
        e1 = x1*x2
        fe1 = s1*s3*(e1 - s2)
        x4 = fe1*x2
        S[0, q] = fe0*u0 - x4*(u0*x3 - u3)
        S[1, q] = fe0*u1 - x4*(u1*x3 + u2)
        S[2, q] = -u1*x4
        S[3, q] = u0*x4


@entry
def curved_2_modulus(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    h = carray(v, (4, count))
    m = carray(v, (4, count))
    s = carray(s, (4, count))
    m = m if way == 2 else u
    D = carray(out, (4, 4, count))
    for q in range(count):
        u0, u1, u2, u3, h0, h1, m0, m1, m2, m3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], h[0, q], h[1, q], m[0, q], m[1, q], m[2, q], m[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0)
        x1 = (u1 * u1)
        x2 = x0 + x1
        x10 = (1.0 / (x2))
        x11 = n*x10
        x3 = u0*u3
        x4 = u1*u2
        x5 = x3 - x4
        x12 = x11*x5
        x6 = fall(x2, n)
        ge1u0 = x6*(-u0*x12 + u3)
        x22 = beta + 1.0
        x9 = s0*s3
        ke0e0 = x22*x9
        x8 = s1*s3
        ke1e1 = x22*x8
        ae0 = 0.5*(h0 * h0) + 0.5*(h1 * h1) + (-h0*(h0 - u0) - h1*(h1 - u1) if way == 1 else 0.0) - 0.5
        fe0 = ae0*x9
        x14 = x0*x10
        x15 = n*x14 - 1.0
        x7 = (m0 * m0) + (m1 * m1)
        me1 = (m0*m3 - m1*m2)*fall(x7, n)
        fe1 = x8*(me1 - s2)
        x16 = fe1*x6
        x17 = x11*x16
        ku0u0 = fe0 - x17*(2.0*x3 - x5*(2.0*x14 + x15))
        ge1u1 = -x6*(u1*x12 + u2)
        x18 = u0*u1
        ku1u0 = x17*(u0*u2 - u1*u3 + 2.0*x10*x18*x5 + x12*x18)
        x23 = ge1u0*ke1e1
        x19 = x1*x10
        x20 = n*x19 - 1.0
        ku1u1 = fe0 + x17*(2.0*x4 + x5*(2.0*x19 + x20))
        x13 = u1*x6
        ge1u2 = -x13
        x21 = fe1*u0*x11*x13
        ku2u0 = x21
        ku2u1 = x16*x20
        x24 = ge1u1*ke1e1
        ge1u3 = u0*x6
        ku3u0 = -x15*x16
        ku3u1 = -x21
        D[0, 0, q] = D[0, 0, q] = (ge1u0 * ge1u0)*ke1e1 + ke0e0*x0 + ku0u0
        D[1, 0, q] = D[0, 1, q] = ge1u1*x23 + ke0e0*x18 + ku1u0
        D[1, 1, q] = D[1, 1, q] = (ge1u1 * ge1u1)*ke1e1 + ke0e0*x1 + ku1u1
        D[2, 0, q] = D[0, 2, q] = ge1u2*x23 + ku2u0
        D[2, 1, q] = D[1, 2, q] = ge1u2*x24 + ku2u1
        D[2, 2, q] = D[2, 2, q] = (ge1u2 * ge1u2)*ke1e1
        D[3, 0, q] = D[0, 3, q] = ge1u3*x23 + ku3u0
        D[3, 1, q] = D[1, 3, q] = ge1u3*x24 + ku3u1
        D[3, 2, q] = D[2, 3, q] = ge1u2*ge1u3*ke1e1
        D[3, 3, q] = D[3, 3, q] = (ge1u3 * ge1u3)*ke1e1


@entry
def curved_2_damped_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    v = carray(v, (4, count))
    s = carray(s, (4, count))
    S = carray(out, (4, count))
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        d4 = u0*v0 + u1*v1
        x0 = (u0 * u0) + (u1 * u1)
        e0 = 0.5*x0 - 0.5
        fe0 = s0*s3*(beta*d4 + e0)
        x1 = u0*u3 - u1*u2
        x3 = n*x1/x0
        x5 = u0*x3 - u3
        x2 = fall(x0, n)
        x4 = u1*x3 + u2
        d5 = x2*(u0*v3 - u1*v2 - v0*x5 - v1*x4)
        e1 = x1*x2
        fe1 = s1*s3*(beta*d5 + e1 - s2)
        x6 = fe1*x2
        S[0, q] = fe0*u0 - x5*x6
        S[1, q] = fe0*u1 - x4*x6
        S[2, q] = -u1*x6
        S[3, q] = u0*x6


@entry
def curved_2_dissipation(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    v = carray(v, (4, count))
    s = carray(s, (4, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[3, q]
        d4 = u0*v0 + u1*v1
        x0 = (u0 * u0) + (u1 * u1)
        x2 = fall(x0, n)
        x1 = u0*u3 - u1*u2
        x3 = n*x1/x0
        d5 = x2*(u0*v3 - u1*v2 - v0*(u0*x3 - u3) - v1*(u1*x3 + u2))
        W[q] = s3*((d4 * d4)*s0 + (d5 * d5)*s1)


@entry
def curved_3_energy(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (6, count))
    s = carray(s, (4, count))
    total = 0.0
    for q in range(count):
        u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0) + (u1 * u1) + (u2 * u2)
        e5 = 0.5*x0 - 0.5
        x1 = (s2 * s2)
        e0 = x0
        e1 = fall(e0, n)
        e2 = u1*u5 - u2*u4
        e3 = -u0*u5 + u2*u3
        e4 = u0*u4 - u1*u3
        e6 = (e2 * e2) + (e3 * e3) + (e4 * e4)
        x2 = (e1 * e1)*e6
        total += 0.5*s3*((e5 * e5)*s0 + s1*(-2.0*s2*(math.sqrt(1.0e-12*x1 + x2 + 1.0e-60)) + x1 + x2))
    carray(out, 1)[0] = total


@entry
def curved_3_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (6, count))
    s = carray(s, (4, count))
    S = carray(out, (6, count))
    for q in range(count):
        u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        e3 = -u0*u5 + u2*u3
        x0 = (u0 * u0) + (u1 * u1) + (u2 * u2)
        e0 = x0
        x1 = fall(e0, n)
        e1 = x1
        x2 = (e1 * e1)
        e2 = u1*u5 - u2*u4
        e4 = u0*u4 - u1*u3
        e6 = (e2 * e2) + (e3 * e3) + (e4 * e4)
        x3 = s1*s3*(s2/(math.sqrt(e6*x2 + 1.0e-12*(s2 * s2) + 1.0e-60)) - 1.0)
        fe6 = -0.5*x2*x3
        x4 = 2.0*fe6
        fe3 = e3*x4
        fe4 = e4*x4
        e5 = 0.5*x0 - 0.5
        fe5 = e5*s0*s3
        fe1 = -e1*e6*x3
        fe0 = -0.5*fe1*n*x1/e0
        x5 = 2.0*fe0
        fe2 = e2*x4
        S[0, q] = -fe3*u5 + fe4*u4 + fe5*u0 + u0*x5
        S[1, q] = fe2*u5 - fe4*u3 + fe5*u1 + u1*x5
        S[2, q] = -fe2*u4 + fe3*u3 + fe5*u2 + u2*x5
        S[3, q] = fe3*u2 - fe4*u1
        S[4, q] = -fe2*u2 + fe4*u0
        S[5, q] = fe2*u1 - fe3*u0


@entry
def curved_3_modulus(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (6, count))
    h = carray(v, (6, count))
    s = carray(s, (4, count))
    D = carray(out, (6, 6, count))
    T = np.empty((21, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u0, u1, u2, u3, u4, u5, h0, h1, h2, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], h[0, q], h[1, q], h[2, q], s[0, q], s[1, q], s[2, q], s[3, q]
            x0 = (u0 * u0)
            x1 = (u1 * u1)
            x2 = (u2 * u2)
            x3 = x0 + x1 + x2
            e0 = x3
            x4 = fall(e0, n)
            x20 = n*x4
            x21 = x20/e0
            ge1u0 = -u0*x21
            x7 = u0*u5
            e3 = u2*u3 - x7
            x8 = u0*u4
            x9 = u1*u3
            e4 = x8 - x9
            ge6u0 = 2.0*(-e3*u5 + e4*u4)
            e1 = x4
            x10 = (e1 * e1)
            x17 = s0*s3
            x5 = u1*u5
            x6 = u2*u4
            e2 = x5 - x6
            e6 = (e2 * e2) + (e3 * e3) + (e4 * e4)
            x11 = e6*x10
            x12 = 1.0e-12*(s2 * s2) + x11 + 1.0e-60
            x13 = s2/(math.sqrt(x12))
            x14 = x13 - 1.0
            x15 = s1*s3
            x16 = 0.5*x15
            fe6 = -x10*x14*x16
            x18 = 2.0*fe6
            x25 = s0/s1
            x26 = beta/(x11 + 6.25e-8*x25)
            x27 = 6.25e-8*x10*x17*x26 + x18
            ke3e3 = x27
            ke4e4 = x27
            ke5e5 = x17*(beta + 1.0)
            x19 = e6*x15
            fe1 = -e1*x14*x19
            fe0 = -0.5*fe1*x21
            ae5 = 0.5*(h0 * h0) + 0.5*(h1 * h1) + 0.5*(h2 * h2) + (-h0*(h0 - u0) - h1*(h1 - u1) - h2*(h2 - u2) if way == 1 else 0.0) - 0.5
            fe5 = ae5*x17
            x22 = 2.0*fe0 + fe5
            ku0u0 = x22
            x23 = s2/(x12 * math.sqrt(x12))
            x24 = x11*x23
            ke1e1 = x19*(-x13 + x24 + 0.5*x26*(2.0*x11 + 1.25e-7*x25) + 1.0)
            ke6e1 = e1*x16*(beta - 2.0*x13 + x24 + 2.0)
            pe1u0 = ge1u0*ke1e1 + ge6u0*ke6e1
            ke6e6 = 0.25*(e1 * e1 * e1 * e1)*x15*(x23 + x26)
            pe6u0 = ge1u0*ke6e1 + ge6u0*ke6e6
            x28 = (u5 * u5)
            x29 = (u4 * u4)
            ke0e0 = 0.25*fe1*x20*(n + 2.0)/(e0 * e0)
            x30 = 4.0*ke0e0
            ge1u1 = -u1*x21
            ge6u1 = 2.0*(e2*u5 - e4*u3)
            x31 = ke5e5*u0
            x32 = u0*x30
            x33 = ke4e4*u4
            ke2e2 = x27
            ku1u1 = x22
            pe1u1 = ge1u1*ke1e1 + ge6u1*ke6e1
            pe6u1 = ge1u1*ke6e1 + ge6u1*ke6e6
            x34 = (u3 * u3)
            ge1u2 = -u2*x21
            ge6u2 = 2.0*(-e2*u4 + e3*u3)
            x35 = ke3e3*u5
            x36 = u1*u2
            x37 = ke2e2*u5
            ku2u2 = x22
            pe1u2 = ge1u2*ke1e1 + ge6u2*ke6e1
            pe6u2 = ge1u2*ke6e1 + ge6u2*ke6e6
            ge6u3 = 2.0*(e3*u2 - e4*u1)
            fe4 = e4*x18
            fe3 = e3*x18
            pe6u3 = ge6u3*ke6e6
            ge6u4 = 2.0*(-e2*u2 + e4*u0)
            x38 = ke4e4*u0
            fe2 = e2*x18
            pe6u4 = ge6u4*ke6e6
            ge6u5 = 2.0*(e2*u1 - e3*u0)
            x39 = ke3e3*u0
            pe6u5 = ge6u5*ke6e6
            T[0, k] = ge1u0*pe1u0 + ge6u0*pe6u0 + ke3e3*x28 + ke4e4*x29 + ke5e5*x0 + ku0u0 + x0*x30
            T[1, k] = ge1u1*pe1u0 + ge6u1*pe6u0 + u1*x31 + u1*x32 - u3*x33
            T[2, k] = ge1u1*pe1u1 + ge6u1*pe6u1 + ke2e2*x28 + ke4e4*x34 + ke5e5*x1 + ku1u1 + x1*x30
            T[3, k] = ge1u2*pe1u0 + ge6u2*pe6u0 + u2*x31 + u2*x32 - u3*x35
            T[4, k] = ge1u2*pe1u1 + ge6u2*pe6u1 + ke5e5*x36 - u4*x37 + x30*x36
            T[5, k] = ge1u2*pe1u2 + ge6u2*pe6u2 + ke2e2*x29 + ke3e3*x34 + ke5e5*x2 + ku2u2 + x2*x30
            T[6, k] = ge6u3*pe6u0 - u1*x33 - u2*x35
            T[7, k] = -fe4 + ge6u3*pe6u1 + ke4e4*x9
            T[8, k] = fe3 + ge6u3*pe6u2 + ke3e3*u2*u3
            T[9, k] = ge6u3*pe6u3 + ke3e3*x2 + ke4e4*x1
            T[10, k] = fe4 + ge6u4*pe6u0 + ke4e4*x8
            T[11, k] = ge6u4*pe6u1 - u2*x37 - u3*x38
            T[12, k] = -fe2 + ge6u4*pe6u2 + ke2e2*x6
            T[13, k] = ge6u4*pe6u3 - u1*x38
            T[14, k] = ge6u4*pe6u4 + ke2e2*x2 + ke4e4*x0
            T[15, k] = -fe3 + ge6u5*pe6u0 + ke3e3*x7
            T[16, k] = fe2 + ge6u5*pe6u1 + ke2e2*x5
            T[17, k] = ge6u5*pe6u2 - ke2e2*u1*u4 - u3*x39
            T[18, k] = ge6u5*pe6u3 - u2*x39
            T[19, k] = ge6u5*pe6u4 - ke2e2*x36
            T[20, k] = ge6u5*pe6u5 + ke2e2*x1 + ke3e3*x0
        unfold(T, first, D, False)
    for first in range(0, count if way == 2 else 0, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u0, u1, u2, u3, u4, u5, h0, h1, h2, h3, h4, h5, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], h[0, q], h[1, q], h[2, q], h[3, q], h[4, q], h[5, q], s[1, q], s[2, q], s[3, q]
            x4 = u1*u5
            x5 = u2*u4
            x6 = x4 - x5
            x0 = (u0 * u0)
            x1 = (u1 * u1)
            x2 = (u2 * u2)
            x3 = x0 + x1 + x2
            x7 = fall(x3, n)
            x8 = x6*x7
            e1 = x8
            x17 = (h0 * h0) + (h1 * h1) + (h2 * h2)
            x18 = fall(x17, n)
            he1 = x18*(h1*h5 - h2*h4)
            x10 = u2*u3
            x9 = u0*u5
            x11 = -x10 + x9
            x12 = x11*x7
            e2 = -x12
            x13 = u0*u4
            x14 = u1*u3
            x15 = x13 - x14
            x16 = x15*x7
            e3 = x16
            x19 = 1.0e-12*(s2 * s2) + 1.0e-60
            x20 = s2/(math.sqrt((e1 * e1) + (e2 * e2) + (e3 * e3) + x19)) - 1.0
            he2 = -x18*(h0*h5 - h2*h3)
            he3 = x18*(h0*h4 - h1*h3)
            x21 = s2/(math.sqrt((he1 * he1) + (he2 * he2) + (he3 * he3) + x19)) - 1.0
            x22 = s1*s3
            fe1 = x22*(e1*x20 - he1*x21)
            fe2 = x22*(e2*x20 - he2*x21)
            fe3 = x22*(e3*x20 - he3*x21)
            x23 = (1.0 / (x3))
            x44 = x0*x23
            x45 = n*x44 - 1.0
            x46 = 2.0*x44 + x45
            x24 = n*x23
            x47 = x24*x7
            ku0u0 = x47*(fe1*x46*x6 + fe2*(-x11*x46 + 2.0*x9) - fe3*(2.0*x13 - x15*x46))
            x26 = -u5
            x27 = x24*x6
            x28 = u1*x27
            x29 = x26 + x28
            x33 = x11*x24
            x34 = u0*x33
            x35 = x26 + x34
            x39 = x15*x24
            x40 = u0*x39
            x48 = 2.0*x23
            x49 = x48*x6
            x50 = u1*x49
            x51 = fe1*u0
            x52 = u0*x48
            x53 = x11*x52
            x54 = fe2*u1
            x55 = u0*u3
            x56 = u1*u4
            x57 = x15*x52
            ku1u0 = x47*(fe3*(u1*x40 + u1*x57 + x55 - x56) + x51*(x29 + x50) - x54*(x35 + x53))
            x58 = x1*x23
            x59 = n*x58 - 1.0
            x60 = 2.0*x58 + x59
            ku1u1 = x47*(-fe1*(2.0*x4 - x6*x60) - fe2*x11*x60 + fe3*(2.0*x14 + x15*x60))
            x30 = u2*x27 + u4
            x41 = -u4 + x40
            x61 = fe3*u2
            x62 = -u2*u5
            ku2u0 = x47*(-fe2*(u2*x34 + u2*x53 + x55 + x62) + x51*(u2*x49 + x30) + x61*(x41 + x57))
            x37 = u2*x33 + u3
            x42 = u1*x39 + u3
            ku2u1 = x47*(fe1*(u2*x28 + u2*x50 + x56 + x62) - x54*(u2*x11*x48 + x37) + x61*(u1*x15*x48 + x42))
            x63 = x2*x23
            x64 = n*x63 - 1.0
            x65 = 2.0*x63 + x64
            ku2u2 = x47*(fe1*(2.0*x5 + x6*x65) - fe2*(2.0*x10 + x11*x65) + fe3*x15*x65)
            x38 = u0*x7
            x66 = fe2*u2
            ku3u0 = x24*x38*(fe3*u1 - x66)
            x36 = u1*x24
            ku3u1 = x7*(fe3*x59 - x36*x66)
            ku3u2 = x7*(-fe2*x64 + fe3*n*u1*u2*x23)
            x25 = u0*x24
            x67 = fe1*u2
            ku4u0 = x7*(-fe3*x45 + x25*x67)
            x32 = u1*x7
            x68 = fe3*u0
            ku4u1 = x24*x32*(x67 - x68)
            x43 = u2*x24
            ku4u2 = x7*(fe1*x64 - x43*x68)
            x69 = fe1*u1
            ku5u0 = x7*(fe2*x45 - x25*x69)
            ku5u1 = x7*(-fe1*x59 + fe2*n*u0*u1*x23)
            x31 = u2*x7
            ku5u2 = x24*x31*(fe2*u0 - x69)
            T[0, k] = ku0u0
            T[1, k] = ku1u0
            T[2, k] = ku1u1
            T[3, k] = ku2u0
            T[4, k] = ku2u1
            T[5, k] = ku2u2
            T[6, k] = ku3u0
            T[7, k] = ku3u1
            T[8, k] = ku3u2
            T[9, k] = 0.0
            T[10, k] = ku4u0
            T[11, k] = ku4u1
            T[12, k] = ku4u2
            T[13, k] = 0.0
            T[14, k] = 0.0
            T[15, k] = ku5u0
            T[16, k] = ku5u1
            T[17, k] = ku5u2
            T[18, k] = 0.0
            T[19, k] = 0.0
            T[20, k] = 0.0
        unfold(T, first, D, True)


@entry
def curved_3_damped_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (6, count))
    v = carray(v, (6, count))
    s = carray(s, (4, count))
    S = carray(out, (6, count))
    for q in range(count):
        u0, u1, u2, u3, u4, u5, v0, v1, v2, v3, v4, v5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], v[0, q], v[1, q], v[2, q], v[3, q], v[4, q], v[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        d9 = -u0*v5 + u2*v3 + u3*v2 - u5*v0
        e3 = -u0*u5 + u2*u3
        x2 = u0*v0 + u1*v1 + u2*v2
        d6 = 2.0*x2
        x0 = (u0 * u0) + (u1 * u1) + (u2 * u2)
        e0 = x0
        x1 = fall(e0, n)
        x3 = 0.5*n*x1/e0
        d7 = -d6*x3
        e1 = x1
        x10 = 0.5*beta
        x11 = s1*s3
        x4 = (e1 * e1)
        e2 = u1*u5 - u2*u4
        e4 = u0*u4 - u1*u3
        e6 = (e2 * e2) + (e3 * e3) + (e4 * e4)
        x5 = e6*x4
        x6 = e1*(s2/(math.sqrt(1.0e-12*(s2 * s2) + x5 + 1.0e-60)) - 1.0)
        x7 = s0/s1
        x8 = (1.0 / ((x5 + 6.25e-8*x7)))
        d10 = u0*v4 - u1*v3 - u3*v1 + u4*v0
        d8 = u1*v5 - u2*v4 - u4*v2 + u5*v1
        d12 = 2.0*(d10*e4 + d8*e2 + d9*e3)
        x9 = d12*e1 + 2.0*d7*e6
        fe6 = 0.5*e1*x11*(x10*x8*(1.25e-7*d7*x7 + x4*x9) - x6)
        x13 = 2.0*fe6
        x12 = s0*s3
        x14 = 6.25e-8*beta*x12*x4*x8
        fe3 = d9*x14 + e3*x13
        fe4 = d10*x14 + e4*x13
        d11 = x2
        e5 = 0.5*x0 - 0.5
        fe5 = x12*(beta*d11 + e5)
        fe1 = x11*(-e6*x6 + x10*x9)
        fe0 = -fe1*x3
        x15 = 2.0*fe0
        fe2 = d8*x14 + e2*x13
        S[0, q] = -fe3*u5 + fe4*u4 + fe5*u0 + u0*x15
        S[1, q] = fe2*u5 - fe4*u3 + fe5*u1 + u1*x15
        S[2, q] = -fe2*u4 + fe3*u3 + fe5*u2 + u2*x15
        S[3, q] = fe3*u2 - fe4*u1
        S[4, q] = -fe2*u2 + fe4*u0
        S[5, q] = fe2*u1 - fe3*u0


@entry
def curved_3_dissipation(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (6, count))
    v = carray(v, (6, count))
    s = carray(s, (4, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, u4, u5, v0, v1, v2, v3, v4, v5, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], v[0, q], v[1, q], v[2, q], v[3, q], v[4, q], v[5, q], s[0, q], s[1, q], s[3, q]
        d10 = u0*v4 - u1*v3 - u3*v1 + u4*v0
        x2 = u0*v0 + u1*v1 + u2*v2
        d11 = x2
        d6 = 2.0*x2
        x0 = (u0 * u0) + (u1 * u1) + (u2 * u2)
        e0 = x0
        x1 = fall(e0, n)
        d7 = -0.5*d6*n*x1/e0
        d8 = u1*v5 - u2*v4 - u4*v2 + u5*v1
        d9 = -u0*v5 + u2*v3 + u3*v2 - u5*v0
        e2 = u1*u5 - u2*u4
        e3 = -u0*u5 + u2*u3
        e4 = u0*u4 - u1*u3
        e6 = (e2 * e2) + (e3 * e3) + (e4 * e4)
        e1 = x1
        x3 = (e1 * e1)
        x4 = s0/s1
        d12 = 2.0*(d10*e4 + d8*e2 + d9*e3)
        x5 = d12*e1
        W[q] = s3*((d11 * d11)*s0 + 0.25*s1*(x3*((2.0*d7*e6 + x5) * (2.0*d7*e6 + x5)) + 2.5e-7*x4*((d7 * d7)*e6 + d7*x5 + x3*((d10 * d10) + (d8 * d8) + (d9 * d9))))/(e6*x3 + 6.25e-8*x4))


@entry
def membrane_energy(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    s = carray(s, (3, count))
    total = 0.0
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q]
        e0 = 0.5*((u0 * u0) + (u1 * u1) - 1.0)
        e1 = 0.5*((u2 * u2) + (u3 * u3) - 1.0)
        e2 = u0*u2 + u1*u3
        e3 = 0.5*(1.0 - s1)
        total += 0.5*s0*s2*((e0 * e0) + 2.0*e0*e1*s1 + (e1 * e1) + (e2 * e2)*e3)
    carray(out, 1)[0] = total


@entry
def membrane_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    s = carray(s, (3, count))
    S = carray(out, (4, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q]
        e0 = 0.5*((u0 * u0) + (u1 * u1) - 1.0)
        e1 = 0.5*((u2 * u2) + (u3 * u3) - 1.0)
        x0 = s0*s2
        fe0 = x0*(e0 + e1*s1)
        e2 = u0*u2 + u1*u3
        e3 = 0.5*(1.0 - s1)
        fe2 = e2*e3*x0
        fe1 = x0*(e0*s1 + e1)
        S[0, q] = fe0*u0 + fe2*u2
        S[1, q] = fe0*u1 + fe2*u3
        S[2, q] = fe1*u2 + fe2*u0
        S[3, q] = fe1*u3 + fe2*u1


@entry
def membrane_modulus(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    h = carray(v, (4, count))
    s = carray(s, (3, count))
    h = u if way == 0 else h
    D = carray(out, (4, 4, count))
    for q in range(count):
        u0, u1, u2, u3, h0, h1, h2, h3, s0, s1, s2 = u[0, q], u[1, q], u[2, q], u[3, q], h[0, q], h[1, q], h[2, q], h[3, q], s[0, q], s[1, q], s[2, q]
        x1 = h0 - u0
        x2 = h1 - u1
        ae0 = 0.5*(h0 * h0) + 0.5*(h1 * h1) + (-h0*x1 - h1*x2 if way == 1 else 0.0) - 0.5
        x3 = h2 - u2
        x4 = h3 - u3
        ae1 = 0.5*(h2 * h2) + 0.5*(h3 * h3) + (-h2*x3 - h3*x4 if way == 1 else 0.0) - 0.5
        x5 = s0*s2
        fe0 = x5*(ae0 + ae1*s1)
        x6 = x5*(beta + 1.0)
        ke0e0 = x6
        pe0u0 = ke0e0*u0
        x0 = 0.5*(1.0 - s1)
        e3 = x0
        ke2e2 = e3*x6
        pe2u0 = ke2e2*u2
        pe0u1 = ke0e0*u1
        pe2u1 = ke2e2*u3
        ae2 = h0*h2 + h1*h3 + (-h0*x3 - h1*x4 - h2*x1 - h3*x2 if way == 1 else 0.0)
        me3 = x0
        fe2 = ae2*me3*x5
        ke1e0 = s1*x6
        pe1u0 = ke1e0*u0
        pe1u1 = ke1e0*u1
        fe1 = x5*(ae0*s1 + ae1)
        ke1e1 = x6
        pe1u2 = ke1e1*u2
        pe2u2 = ke2e2*u0
        pe1u3 = ke1e1*u3
        pe2u3 = ke2e2*u1
        D[0, 0, q] = D[0, 0, q] = fe0 + pe0u0*u0 + pe2u0*u2
        D[1, 0, q] = D[0, 1, q] = pe0u0*u1 + pe2u0*u3
        D[1, 1, q] = D[1, 1, q] = fe0 + pe0u1*u1 + pe2u1*u3
        D[2, 0, q] = D[0, 2, q] = fe2 + pe1u0*u2 + pe2u0*u0
        D[2, 1, q] = D[1, 2, q] = pe1u1*u2 + pe2u1*u0
        D[2, 2, q] = D[2, 2, q] = fe1 + pe1u2*u2 + pe2u2*u0
        D[3, 0, q] = D[0, 3, q] = pe1u0*u3 + pe2u0*u1
        D[3, 1, q] = D[1, 3, q] = fe2 + pe1u1*u3 + pe2u1*u1
        D[3, 2, q] = D[2, 3, q] = pe1u2*u3 + pe2u2*u1
        D[3, 3, q] = D[3, 3, q] = fe1 + pe1u3*u3 + pe2u3*u1


@entry
def membrane_damped_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    v = carray(v, (4, count))
    s = carray(s, (3, count))
    S = carray(out, (4, count))
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s2 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[2, q]
        d4 = u0*v0 + u1*v1
        d5 = u2*v2 + u3*v3
        e0 = 0.5*((u0 * u0) + (u1 * u1) - 1.0)
        e1 = 0.5*((u2 * u2) + (u3 * u3) - 1.0)
        x0 = s0*s2
        fe0 = x0*(beta*(d4 + d5*s1) + e0 + e1*s1)
        d6 = u0*v2 + u1*v3 + u2*v0 + u3*v1
        e2 = u0*u2 + u1*u3
        e3 = 0.5*(1.0 - s1)
        fe2 = e3*x0*(beta*d6 + e2)
        fe1 = x0*(beta*(d4*s1 + d5) + e0*s1 + e1)
        S[0, q] = fe0*u0 + fe2*u2
        S[1, q] = fe0*u1 + fe2*u3
        S[2, q] = fe1*u2 + fe2*u0
        S[3, q] = fe1*u3 + fe2*u1


@entry
def membrane_dissipation(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (4, count))
    v = carray(v, (4, count))
    s = carray(s, (3, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s2 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[2, q]
        d4 = u0*v0 + u1*v1
        d5 = u2*v2 + u3*v3
        d6 = u0*v2 + u1*v3 + u2*v0 + u3*v1
        e3 = 0.5*(1.0 - s1)
        W[q] = s0*s2*((d4 * d4) + 2.0*d4*d5*s1 + (d5 * d5) + (d6 * d6)*e3)


@entry
def shell_energy(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (15, count))
    s = carray(s, (7, count))
    total = 0.0
    for q in range(count):
        u0, u1, u2, u3, u4, u5, u6, u7, u8, u9, u10, u11, u12, u13, u14, s0, s1, s2, s3, s4, s5, s6 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], u[6, q], u[7, q], u[8, q], u[9, q], u[10, q], u[11, q], u[12, q], u[13, q], u[14, q], s[0, q], s[1, q], s[2, q], s[3, q], s[4, q], s[5, q], s[6, q]
        e10 = 0.5*(1.0 - s2)
        e0 = u1*u5 - u2*u4
        e1 = -u0*u5 + u2*u3
        e2 = u0*u4 - u1*u3
        e3 = (1.0 / (math.sqrt((e0 * e0) + (e1 * e1) + (e2 * e2))))
        e4 = e0*e3
        e5 = e1*e3
        e6 = e2*e3
        e11 = e4*u6 + e5*u7 + e6*u8 - s3
        e12 = e4*u9 + e5*u10 + e6*u11 - s4
        e13 = e4*u12 + e5*u13 + e6*u14 - s5
        e7 = 0.5*((u0 * u0) + (u1 * u1) + (u2 * u2) - 1.0)
        e8 = 0.5*((u3 * u3) + (u4 * u4) + (u5 * u5) - 1.0)
        e9 = u0*u3 + u1*u4 + u2*u5
        x0 = 2.0*s2
        total += 0.5*s6*(s0*(e10*(e9 * e9) + (e7 * e7) + e7*e8*x0 + (e8 * e8)) + s1*(4.0*e10*(e13 * e13) + (e11 * e11) + e11*e12*x0 + (e12 * e12)))
    carray(out, 1)[0] = total


@entry
def shell_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (15, count))
    s = carray(s, (7, count))
    S = carray(out, (15, count))
    for q in range(count):
        u0, u1, u2, u3, u4, u5, u6, u7, u8, u9, u10, u11, u12, u13, u14, s0, s1, s2, s3, s4, s5, s6 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], u[6, q], u[7, q], u[8, q], u[9, q], u[10, q], u[11, q], u[12, q], u[13, q], u[14, q], s[0, q], s[1, q], s[2, q], s[3, q], s[4, q], s[5, q], s[6, q]
        e1 = -u0*u5 + u2*u3
        e0 = u1*u5 - u2*u4
        e2 = u0*u4 - u1*u3
        x0 = (e0 * e0) + (e1 * e1) + (e2 * e2)
        e3 = (1.0 / (math.sqrt(x0)))
        e4 = e0*e3
        e5 = e1*e3
        e6 = e2*e3
        e11 = e4*u6 + e5*u7 + e6*u8 - s3
        e12 = e4*u9 + e5*u10 + e6*u11 - s4
        x1 = s1*s6
        fe11 = x1*(e11 + e12*s2)
        fe12 = x1*(e11*s2 + e12)
        e10 = 0.5*(1.0 - s2)
        e13 = e4*u12 + e5*u13 + e6*u14 - s5
        fe13 = 4.0*e10*e13*x1
        fe5 = fe11*u7 + fe12*u10 + fe13*u13
        fe4 = fe11*u6 + fe12*u9 + fe13*u12
        fe6 = fe11*u8 + fe12*u11 + fe13*u14
        fe3 = e0*fe4 + e1*fe5 + e2*fe6
        x3 = fe3/(x0 * math.sqrt(x0))
        fe1 = -e1*x3 + e3*fe5
        fe2 = -e2*x3 + e3*fe6
        e7 = 0.5*((u0 * u0) + (u1 * u1) + (u2 * u2) - 1.0)
        e8 = 0.5*((u3 * u3) + (u4 * u4) + (u5 * u5) - 1.0)
        x2 = s0*s6
        fe7 = x2*(e7 + e8*s2)
        e9 = u0*u3 + u1*u4 + u2*u5
        fe9 = e10*e9*x2
        fe0 = -e0*x3 + e3*fe4
        fe8 = x2*(e7*s2 + e8)
        S[0, q] = -fe1*u5 + fe2*u4 + fe7*u0 + fe9*u3
        S[1, q] = fe0*u5 - fe2*u3 + fe7*u1 + fe9*u4
        S[2, q] = -fe0*u4 + fe1*u3 + fe7*u2 + fe9*u5
        S[3, q] = fe1*u2 - fe2*u1 + fe8*u3 + fe9*u0
        S[4, q] = -fe0*u2 + fe2*u0 + fe8*u4 + fe9*u1
        S[5, q] = fe0*u1 - fe1*u0 + fe8*u5 + fe9*u2
        S[6, q] = e4*fe11
        S[7, q] = e5*fe11
        S[8, q] = e6*fe11
        S[9, q] = e4*fe12
        S[10, q] = e5*fe12
        S[11, q] = e6*fe12
        S[12, q] = e4*fe13
        S[13, q] = e5*fe13
        S[14, q] = e6*fe13


@entry
def shell_modulus(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (15, count))
    h = carray(v, (15, count))
    m = carray(v, (15, count))
    s = carray(s, (7, count))
    m = m if way == 2 else u
    D = carray(out, (15, 15, count))
    T = np.empty((120, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u0, u1, u2, u3, u4, u5, u6, u7, u8, u9, u10, u11, u12, u13, u14, h0, h1, h2, h3, h4, h5, m0, m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14, s0, s1, s2, s3, s4, s5, s6 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], u[6, q], u[7, q], u[8, q], u[9, q], u[10, q], u[11, q], u[12, q], u[13, q], u[14, q], h[0, q], h[1, q], h[2, q], h[3, q], h[4, q], h[5, q], m[0, q], m[1, q], m[2, q], m[3, q], m[4, q], m[5, q], m[6, q], m[7, q], m[8, q], m[9, q], m[10, q], m[11, q], m[12, q], m[13, q], m[14, q], s[0, q], s[1, q], s[2, q], s[3, q], s[4, q], s[5, q], s[6, q]
            x10 = h2 - u2
            x8 = h0 - u0
            x9 = h1 - u1
            ae7 = 0.5*(h0 * h0) + 0.5*(h1 * h1) + 0.5*(h2 * h2) + (-h0*x8 - h1*x9 - h2*x10 if way == 1 else 0.0) - 0.5
            x11 = h3 - u3
            x12 = h4 - u4
            x13 = h5 - u5
            ae8 = 0.5*(h3 * h3) + 0.5*(h4 * h4) + 0.5*(h5 * h5) + (-h3*x11 - h4*x12 - h5*x13 if way == 1 else 0.0) - 0.5
            x16 = s0*s6
            fe7 = x16*(ae7 + ae8*s2)
            e0 = u1*u5 - u2*u4
            e1 = -u0*u5 + u2*u3
            e2 = u0*u4 - u1*u3
            x0 = (e0 * e0)
            x1 = (e1 * e1)
            x2 = (e2 * e2)
            x3 = x0 + x1 + x2
            x17 = (1.0 / (x3 * math.sqrt(x3)))
            ge3u0 = x17*(e1*u5 - e2*u4)
            ge4u0 = e0*ge3u0
            e3 = (1.0 / (math.sqrt(x3)))
            x19 = e3*u5
            ge5u0 = e1*ge3u0 - x19
            x20 = e3*u4
            ge6u0 = e2*ge3u0 + x20
            ge11u0 = ge4u0*u6 + ge5u0*u7 + ge6u0*u8
            ge12u0 = ge4u0*u9 + ge5u0*u10 + ge6u0*u11
            ge13u0 = ge4u0*u12 + ge5u0*u13 + ge6u0*u14
            x14 = s1*s6
            x28 = beta + 1.0
            x30 = x14*x28
            ke11e11 = x30
            ke12e11 = s2*x30
            pe11u0 = ge11u0*ke11e11 + ge12u0*ke12e11
            ke12e12 = x30
            pe12u0 = ge11u0*ke12e11 + ge12u0*ke12e12
            x4 = 0.5*(1.0 - s2)
            e10 = x4
            ke13e13 = 4.0*e10*x30
            pe13u0 = ge13u0*ke13e13
            me0 = m1*m5 - m2*m4
            me1 = -m0*m5 + m2*m3
            me2 = m0*m4 - m1*m3
            me3 = (1.0 / (math.sqrt((me0 * me0) + (me1 * me1) + (me2 * me2))))
            me4 = me0*me3
            me5 = me1*me3
            me6 = me2*me3
            x5 = -s3
            me11 = m6*me4 + m7*me5 + m8*me6 + x5
            x6 = -s4
            me12 = m10*me5 + m11*me6 + m9*me4 + x6
            fe11 = x14*(me11 + me12*s2)
            fe12 = x14*(me11*s2 + me12)
            me10 = x4
            x7 = -s5
            me13 = m12*me4 + m13*me5 + m14*me6 + x7
            x15 = 4.0*x14
            fe13 = me10*me13*x15
            fe5 = fe11*u7 + fe12*u10 + fe13*u13
            fe4 = fe11*u6 + fe12*u9 + fe13*u12
            fe6 = fe11*u8 + fe12*u11 + fe13*u14
            fe3 = e0*fe4 + e1*fe5 + e2*fe6
            x18 = fe3*x17
            x25 = 3.0/x3
            ke1e1 = x18*(x1*x25 - 1.0)
            x26 = (1.0 / (x3 * x3 * math.sqrt(x3)))
            ke2e1 = 3.0*e1*e2*fe3*x26
            pe1u0 = fe5*ge3u0 - ke1e1*u5 + ke2e1*u4
            ke2e2 = x18*(x2*x25 - 1.0)
            pe2u0 = fe6*ge3u0 - ke2e1*u5 + ke2e2*u4
            pe3u0 = -fe5*u5 + fe6*u4
            x29 = x16*x28
            ke7e7 = x29
            pe7u0 = ke7e7*u0
            ke9e9 = e10*x29
            pe9u0 = ke9e9*u3
            ge3u1 = x17*(-e0*u5 + e2*u3)
            ge4u1 = e0*ge3u1 + x19
            ge5u1 = e1*ge3u1
            x23 = e3*u3
            ge6u1 = e2*ge3u1 - x23
            ge11u1 = ge4u1*u6 + ge5u1*u7 + ge6u1*u8
            ge12u1 = ge4u1*u9 + ge5u1*u10 + ge6u1*u11
            ge13u1 = ge4u1*u12 + ge5u1*u13 + ge6u1*u14
            x27 = 3.0*e0*fe3*x26
            ke2e0 = e2*x27
            x31 = ke2e0*u4
            ke1e0 = e1*x27
            x32 = ke1e0*u5
            pe0u0 = fe4*ge3u0 + x31 - x32
            ke0e0 = x18*(x0*x25 - 1.0)
            pe0u1 = fe4*ge3u1 + ke0e0*u5 - ke2e0*u3
            pe11u1 = ge11u1*ke11e11 + ge12u1*ke12e11
            pe12u1 = ge11u1*ke12e11 + ge12u1*ke12e12
            pe13u1 = ge13u1*ke13e13
            pe2u1 = fe6*ge3u1 + ke2e0*u5 - ke2e2*u3
            pe3u1 = fe4*u5 - fe6*u3
            pe7u1 = ke7e7*u1
            pe9u1 = ke9e9*u4
            ge3u2 = x17*(e0*u4 - e1*u3)
            ge4u2 = e0*ge3u2 - x20
            ge5u2 = e1*ge3u2 + x23
            ge6u2 = e2*ge3u2
            ge11u2 = ge4u2*u6 + ge5u2*u7 + ge6u2*u8
            ge12u2 = ge4u2*u9 + ge5u2*u10 + ge6u2*u11
            ge13u2 = ge4u2*u12 + ge5u2*u13 + ge6u2*u14
            x35 = ke2e1*u3
            pe1u1 = fe5*ge3u1 + x32 - x35
            pe0u2 = fe4*ge3u2 - ke0e0*u4 + ke1e0*u3
            pe11u2 = ge11u2*ke11e11 + ge12u2*ke12e11
            pe12u2 = ge11u2*ke12e11 + ge12u2*ke12e12
            pe13u2 = ge13u2*ke13e13
            pe1u2 = fe5*ge3u2 - ke1e0*u4 + ke1e1*u3
            pe3u2 = -fe4*u4 + fe5*u3
            pe7u2 = ke7e7*u2
            pe9u2 = ke9e9*u5
            ae9 = h0*h3 + h1*h4 + h2*h5 + (-h0*x11 - h1*x12 - h2*x13 - h3*x8 - h4*x9 - h5*x10 if way == 1 else 0.0)
            fe9 = ae9*me10*x16
            ge3u3 = x17*(-e1*u2 + e2*u1)
            ge4u3 = e0*ge3u3
            x21 = e3*u2
            ge5u3 = e1*ge3u3 + x21
            x22 = e3*u1
            ge6u3 = e2*ge3u3 - x22
            ge11u3 = ge4u3*u6 + ge5u3*u7 + ge6u3*u8
            ge12u3 = ge4u3*u9 + ge5u3*u10 + ge6u3*u11
            ge13u3 = ge4u3*u12 + ge5u3*u13 + ge6u3*u14
            ke8e7 = s2*x29
            pe8u0 = ke8e7*u0
            fe2 = -e2*x18 + e3*fe6
            pe8u1 = ke8e7*u1
            fe1 = -e1*x18 + e3*fe5
            pe2u2 = fe6*ge3u2 - x31 + x35
            pe8u2 = ke8e7*u2
            fe8 = x16*(ae7*s2 + ae8)
            pe11u3 = ge11u3*ke11e11 + ge12u3*ke12e11
            pe12u3 = ge11u3*ke12e11 + ge12u3*ke12e12
            pe13u3 = ge13u3*ke13e13
            pe1u3 = fe5*ge3u3 + ke1e1*u2 - ke2e1*u1
            pe2u3 = fe6*ge3u3 + ke2e1*u2 - ke2e2*u1
            pe3u3 = fe5*u2 - fe6*u1
            ke8e8 = x29
            pe8u3 = ke8e8*u3
            pe9u3 = ke9e9*u0
            ge3u4 = x17*(e0*u2 - e2*u0)
            ge4u4 = e0*ge3u4 - x21
            ge5u4 = e1*ge3u4
            x24 = e3*u0
            ge6u4 = e2*ge3u4 + x24
            ge11u4 = ge4u4*u6 + ge5u4*u7 + ge6u4*u8
            ge12u4 = ge4u4*u9 + ge5u4*u10 + ge6u4*u11
            ge13u4 = ge4u4*u12 + ge5u4*u13 + ge6u4*u14
            fe0 = -e0*x18 + e3*fe4
            x33 = ke1e0*u2
            x34 = ke2e0*u1
            pe0u3 = fe4*ge3u3 + x33 - x34
            pe0u4 = fe4*ge3u4 - ke0e0*u2 + ke2e0*u0
            pe11u4 = ge11u4*ke11e11 + ge12u4*ke12e11
            pe12u4 = ge11u4*ke12e11 + ge12u4*ke12e12
            pe13u4 = ge13u4*ke13e13
            pe2u4 = fe6*ge3u4 - ke2e0*u2 + ke2e2*u0
            pe3u4 = -fe4*u2 + fe6*u0
            pe8u4 = ke8e8*u4
            pe9u4 = ke9e9*u1
            ge3u5 = x17*(-e0*u1 + e1*u0)
            ge4u5 = e0*ge3u5 + x22
            ge5u5 = e1*ge3u5 - x24
            ge6u5 = e2*ge3u5
            ge11u5 = ge4u5*u6 + ge5u5*u7 + ge6u5*u8
            ge12u5 = ge4u5*u9 + ge5u5*u10 + ge6u5*u11
            ge13u5 = ge4u5*u12 + ge5u5*u13 + ge6u5*u14
            x36 = ke2e1*u0
            pe1u4 = fe5*ge3u4 - x33 + x36
            pe0u5 = fe4*ge3u5 + ke0e0*u1 - ke1e0*u0
            pe11u5 = ge11u5*ke11e11 + ge12u5*ke12e11
            pe12u5 = ge11u5*ke12e11 + ge12u5*ke12e12
            pe13u5 = ge13u5*ke13e13
            pe1u5 = fe5*ge3u5 + ke1e0*u1 - ke1e1*u0
            pe3u5 = fe4*u1 - fe5*u0
            pe8u5 = ke8e8*u5
            pe9u5 = ke9e9*u2
            e4 = e0*e3
            pe11u6 = e4*ke11e11
            e5 = e1*e3
            pe11u7 = e5*ke11e11
            e6 = e2*e3
            pe11u8 = e6*ke11e11
            x37 = e4*ke12e11
            pe12u6 = x37
            x38 = e5*ke12e11
            pe12u7 = x38
            x39 = e6*ke12e11
            pe12u8 = x39
            pe12u9 = e4*ke12e12
            pe12u10 = e5*ke12e12
            pe12u11 = e6*ke12e12
            pe13u12 = e4*ke13e13
            pe13u13 = e5*ke13e13
            pe13u14 = e6*ke13e13
            T[0, k] = fe7 + ge11u0*pe11u0 + ge12u0*pe12u0 + ge13u0*pe13u0 + ge3u0*pe3u0 - pe1u0*u5 + pe2u0*u4 + pe7u0*u0 + pe9u0*u3
            T[1, k] = ge11u1*pe11u0 + ge12u1*pe12u0 + ge13u1*pe13u0 + ge3u1*pe3u0 + pe0u0*u5 - pe2u0*u3 + pe7u0*u1 + pe9u0*u4
            T[2, k] = fe7 + ge11u1*pe11u1 + ge12u1*pe12u1 + ge13u1*pe13u1 + ge3u1*pe3u1 + pe0u1*u5 - pe2u1*u3 + pe7u1*u1 + pe9u1*u4
            T[3, k] = ge11u2*pe11u0 + ge12u2*pe12u0 + ge13u2*pe13u0 + ge3u2*pe3u0 - pe0u0*u4 + pe1u0*u3 + pe7u0*u2 + pe9u0*u5
            T[4, k] = ge11u2*pe11u1 + ge12u2*pe12u1 + ge13u2*pe13u1 + ge3u2*pe3u1 - pe0u1*u4 + pe1u1*u3 + pe7u1*u2 + pe9u1*u5
            T[5, k] = fe7 + ge11u2*pe11u2 + ge12u2*pe12u2 + ge13u2*pe13u2 + ge3u2*pe3u2 - pe0u2*u4 + pe1u2*u3 + pe7u2*u2 + pe9u2*u5
            T[6, k] = fe9 + ge11u3*pe11u0 + ge12u3*pe12u0 + ge13u3*pe13u0 + ge3u3*pe3u0 + pe1u0*u2 - pe2u0*u1 + pe8u0*u3 + pe9u0*u0
            T[7, k] = -fe2 + ge11u3*pe11u1 + ge12u3*pe12u1 + ge13u3*pe13u1 + ge3u3*pe3u1 + pe1u1*u2 - pe2u1*u1 + pe8u1*u3 + pe9u1*u0
            T[8, k] = fe1 + ge11u3*pe11u2 + ge12u3*pe12u2 + ge13u3*pe13u2 + ge3u3*pe3u2 + pe1u2*u2 - pe2u2*u1 + pe8u2*u3 + pe9u2*u0
            T[9, k] = fe8 + ge11u3*pe11u3 + ge12u3*pe12u3 + ge13u3*pe13u3 + ge3u3*pe3u3 + pe1u3*u2 - pe2u3*u1 + pe8u3*u3 + pe9u3*u0
            T[10, k] = fe2 + ge11u4*pe11u0 + ge12u4*pe12u0 + ge13u4*pe13u0 + ge3u4*pe3u0 - pe0u0*u2 + pe2u0*u0 + pe8u0*u4 + pe9u0*u1
            T[11, k] = fe9 + ge11u4*pe11u1 + ge12u4*pe12u1 + ge13u4*pe13u1 + ge3u4*pe3u1 - pe0u1*u2 + pe2u1*u0 + pe8u1*u4 + pe9u1*u1
            T[12, k] = -fe0 + ge11u4*pe11u2 + ge12u4*pe12u2 + ge13u4*pe13u2 + ge3u4*pe3u2 - pe0u2*u2 + pe2u2*u0 + pe8u2*u4 + pe9u2*u1
            T[13, k] = ge11u4*pe11u3 + ge12u4*pe12u3 + ge13u4*pe13u3 + ge3u4*pe3u3 - pe0u3*u2 + pe2u3*u0 + pe8u3*u4 + pe9u3*u1
            T[14, k] = fe8 + ge11u4*pe11u4 + ge12u4*pe12u4 + ge13u4*pe13u4 + ge3u4*pe3u4 - pe0u4*u2 + pe2u4*u0 + pe8u4*u4 + pe9u4*u1
            T[15, k] = -fe1 + ge11u5*pe11u0 + ge12u5*pe12u0 + ge13u5*pe13u0 + ge3u5*pe3u0 + pe0u0*u1 - pe1u0*u0 + pe8u0*u5 + pe9u0*u2
            T[16, k] = fe0 + ge11u5*pe11u1 + ge12u5*pe12u1 + ge13u5*pe13u1 + ge3u5*pe3u1 + pe0u1*u1 - pe1u1*u0 + pe8u1*u5 + pe9u1*u2
            T[17, k] = fe9 + ge11u5*pe11u2 + ge12u5*pe12u2 + ge13u5*pe13u2 + ge3u5*pe3u2 + pe0u2*u1 - pe1u2*u0 + pe8u2*u5 + pe9u2*u2
            T[18, k] = ge11u5*pe11u3 + ge12u5*pe12u3 + ge13u5*pe13u3 + ge3u5*pe3u3 + pe0u3*u1 - pe1u3*u0 + pe8u3*u5 + pe9u3*u2
            T[19, k] = ge11u5*pe11u4 + ge12u5*pe12u4 + ge13u5*pe13u4 + ge3u5*pe3u4 + pe0u4*u1 - pe1u4*u0 + pe8u4*u5 + pe9u4*u2
            T[20, k] = fe8 + ge11u5*pe11u5 + ge12u5*pe12u5 + ge13u5*pe13u5 + ge3u5*pe3u5 + pe0u5*u1 - pe1u5*u0 + pe8u5*u5 + pe9u5*u2
            T[21, k] = e4*pe11u0 + fe11*ge4u0
            T[22, k] = e4*pe11u1 + fe11*ge4u1
            T[23, k] = e4*pe11u2 + fe11*ge4u2
            T[24, k] = e4*pe11u3 + fe11*ge4u3
            T[25, k] = e4*pe11u4 + fe11*ge4u4
            T[26, k] = e4*pe11u5 + fe11*ge4u5
            T[27, k] = e4*pe11u6
            T[28, k] = e5*pe11u0 + fe11*ge5u0
            T[29, k] = e5*pe11u1 + fe11*ge5u1
            T[30, k] = e5*pe11u2 + fe11*ge5u2
            T[31, k] = e5*pe11u3 + fe11*ge5u3
            T[32, k] = e5*pe11u4 + fe11*ge5u4
            T[33, k] = e5*pe11u5 + fe11*ge5u5
            T[34, k] = e5*pe11u6
            T[35, k] = e5*pe11u7
            T[36, k] = e6*pe11u0 + fe11*ge6u0
            T[37, k] = e6*pe11u1 + fe11*ge6u1
            T[38, k] = e6*pe11u2 + fe11*ge6u2
            T[39, k] = e6*pe11u3 + fe11*ge6u3
            T[40, k] = e6*pe11u4 + fe11*ge6u4
            T[41, k] = e6*pe11u5 + fe11*ge6u5
            T[42, k] = e6*pe11u6
            T[43, k] = e6*pe11u7
            T[44, k] = e6*pe11u8
            T[45, k] = e4*pe12u0 + fe12*ge4u0
            T[46, k] = e4*pe12u1 + fe12*ge4u1
            T[47, k] = e4*pe12u2 + fe12*ge4u2
            T[48, k] = e4*pe12u3 + fe12*ge4u3
            T[49, k] = e4*pe12u4 + fe12*ge4u4
            T[50, k] = e4*pe12u5 + fe12*ge4u5
            T[51, k] = e4*pe12u6
            T[52, k] = e4*pe12u7
            T[53, k] = e4*pe12u8
            T[54, k] = e4*pe12u9
            T[55, k] = e5*pe12u0 + fe12*ge5u0
            T[56, k] = e5*pe12u1 + fe12*ge5u1
            T[57, k] = e5*pe12u2 + fe12*ge5u2
            T[58, k] = e5*pe12u3 + fe12*ge5u3
            T[59, k] = e5*pe12u4 + fe12*ge5u4
            T[60, k] = e5*pe12u5 + fe12*ge5u5
            T[61, k] = e5*pe12u6
            T[62, k] = e5*pe12u7
            T[63, k] = e5*pe12u8
            T[64, k] = e5*pe12u9
            T[65, k] = e5*pe12u10
            T[66, k] = e6*pe12u0 + fe12*ge6u0
            T[67, k] = e6*pe12u1 + fe12*ge6u1
            T[68, k] = e6*pe12u2 + fe12*ge6u2
            T[69, k] = e6*pe12u3 + fe12*ge6u3
            T[70, k] = e6*pe12u4 + fe12*ge6u4
            T[71, k] = e6*pe12u5 + fe12*ge6u5
            T[72, k] = e6*pe12u6
            T[73, k] = e6*pe12u7
            T[74, k] = e6*pe12u8
            T[75, k] = e6*pe12u9
            T[76, k] = e6*pe12u10
            T[77, k] = e6*pe12u11
            T[78, k] = e4*pe13u0 + fe13*ge4u0
            T[79, k] = e4*pe13u1 + fe13*ge4u1
            T[80, k] = e4*pe13u2 + fe13*ge4u2
            T[81, k] = e4*pe13u3 + fe13*ge4u3
            T[82, k] = e4*pe13u4 + fe13*ge4u4
            T[83, k] = e4*pe13u5 + fe13*ge4u5
            T[84, k] = 0.0
            T[85, k] = 0.0
            T[86, k] = 0.0
            T[87, k] = 0.0
            T[88, k] = 0.0
            T[89, k] = 0.0
            T[90, k] = e4*pe13u12
            T[91, k] = e5*pe13u0 + fe13*ge5u0
            T[92, k] = e5*pe13u1 + fe13*ge5u1
            T[93, k] = e5*pe13u2 + fe13*ge5u2
            T[94, k] = e5*pe13u3 + fe13*ge5u3
            T[95, k] = e5*pe13u4 + fe13*ge5u4
            T[96, k] = e5*pe13u5 + fe13*ge5u5
            T[97, k] = 0.0
            T[98, k] = 0.0
            T[99, k] = 0.0
            T[100, k] = 0.0
            T[101, k] = 0.0
            T[102, k] = 0.0
            T[103, k] = e5*pe13u12
            T[104, k] = e5*pe13u13
            T[105, k] = e6*pe13u0 + fe13*ge6u0
            T[106, k] = e6*pe13u1 + fe13*ge6u1
            T[107, k] = e6*pe13u2 + fe13*ge6u2
            T[108, k] = e6*pe13u3 + fe13*ge6u3
            T[109, k] = e6*pe13u4 + fe13*ge6u4
            T[110, k] = e6*pe13u5 + fe13*ge6u5
            T[111, k] = 0.0
            T[112, k] = 0.0
            T[113, k] = 0.0
            T[114, k] = 0.0
            T[115, k] = 0.0
            T[116, k] = 0.0
            T[117, k] = e6*pe13u12
            T[118, k] = e6*pe13u13
            T[119, k] = e6*pe13u14
        unfold(T, first, D, False)


@entry
def shell_damped_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (15, count))
    v = carray(v, (15, count))
    s = carray(s, (7, count))
    S = carray(out, (15, count))
    for q in range(count):
        u0, u1, u2, u3, u4, u5, u6, u7, u8, u9, u10, u11, u12, u13, u14, v0, v1, v2, v3, v4, v5, v6, v7, v8, v9, v10, v11, v12, v13, v14, s0, s1, s2, s3, s4, s5, s6 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], u[6, q], u[7, q], u[8, q], u[9, q], u[10, q], u[11, q], u[12, q], u[13, q], u[14, q], v[0, q], v[1, q], v[2, q], v[3, q], v[4, q], v[5, q], v[6, q], v[7, q], v[8, q], v[9, q], v[10, q], v[11, q], v[12, q], v[13, q], v[14, q], s[0, q], s[1, q], s[2, q], s[3, q], s[4, q], s[5, q], s[6, q]
        e1 = -u0*u5 + u2*u3
        e0 = u1*u5 - u2*u4
        e2 = u0*u4 - u1*u3
        x0 = (e0 * e0) + (e1 * e1) + (e2 * e2)
        e3 = (1.0 / (math.sqrt(x0)))
        d15 = u1*v5 - u2*v4 - u4*v2 + u5*v1
        d16 = -u0*v5 + u2*v3 + u3*v2 - u5*v0
        d17 = u0*v4 - u1*v3 - u3*v1 + u4*v0
        x1 = (1.0 / (x0 * math.sqrt(x0)))
        d18 = -x1*(d15*e0 + d16*e1 + d17*e2)
        d19 = d15*e3 + d18*e0
        d20 = d16*e3 + d18*e1
        d21 = d17*e3 + d18*e2
        e4 = e0*e3
        e5 = e1*e3
        e6 = e2*e3
        d26 = d19*u6 + d20*u7 + d21*u8 + e4*v6 + e5*v7 + e6*v8
        d27 = d19*u9 + d20*u10 + d21*u11 + e4*v9 + e5*v10 + e6*v11
        e11 = e4*u6 + e5*u7 + e6*u8 - s3
        e12 = e4*u9 + e5*u10 + e6*u11 - s4
        x2 = s1*s6
        fe11 = x2*(beta*(d26 + d27*s2) + e11 + e12*s2)
        fe12 = x2*(beta*(d26*s2 + d27) + e11*s2 + e12)
        d28 = d19*u12 + d20*u13 + d21*u14 + e4*v12 + e5*v13 + e6*v14
        e10 = 0.5*(1.0 - s2)
        e13 = e4*u12 + e5*u13 + e6*u14 - s5
        fe13 = 4.0*e10*x2*(beta*d28 + e13)
        fe5 = fe11*u7 + fe12*u10 + fe13*u13
        fe4 = fe11*u6 + fe12*u9 + fe13*u12
        fe6 = fe11*u8 + fe12*u11 + fe13*u14
        fe3 = e0*fe4 + e1*fe5 + e2*fe6
        x4 = fe3*x1
        fe1 = -e1*x4 + e3*fe5
        fe2 = -e2*x4 + e3*fe6
        d22 = u0*v0 + u1*v1 + u2*v2
        d23 = u3*v3 + u4*v4 + u5*v5
        e7 = 0.5*((u0 * u0) + (u1 * u1) + (u2 * u2) - 1.0)
        e8 = 0.5*((u3 * u3) + (u4 * u4) + (u5 * u5) - 1.0)
        x3 = s0*s6
        fe7 = x3*(beta*(d22 + d23*s2) + e7 + e8*s2)
        d24 = u0*v3 + u1*v4 + u2*v5 + u3*v0 + u4*v1 + u5*v2
        e9 = u0*u3 + u1*u4 + u2*u5
        fe9 = e10*x3*(beta*d24 + e9)
        fe0 = -e0*x4 + e3*fe4
        fe8 = x3*(beta*(d22*s2 + d23) + e7*s2 + e8)
        S[0, q] = -fe1*u5 + fe2*u4 + fe7*u0 + fe9*u3
        S[1, q] = fe0*u5 - fe2*u3 + fe7*u1 + fe9*u4
        S[2, q] = -fe0*u4 + fe1*u3 + fe7*u2 + fe9*u5
        S[3, q] = fe1*u2 - fe2*u1 + fe8*u3 + fe9*u0
        S[4, q] = -fe0*u2 + fe2*u0 + fe8*u4 + fe9*u1
        S[5, q] = fe0*u1 - fe1*u0 + fe8*u5 + fe9*u2
        S[6, q] = e4*fe11
        S[7, q] = e5*fe11
        S[8, q] = e6*fe11
        S[9, q] = e4*fe12
        S[10, q] = e5*fe12
        S[11, q] = e6*fe12
        S[12, q] = e4*fe13
        S[13, q] = e5*fe13
        S[14, q] = e6*fe13


@entry
def shell_dissipation(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (15, count))
    v = carray(v, (15, count))
    s = carray(s, (7, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, u4, u5, u6, u7, u8, u9, u10, u11, u12, u13, u14, v0, v1, v2, v3, v4, v5, v6, v7, v8, v9, v10, v11, v12, v13, v14, s0, s1, s2, s6 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], u[6, q], u[7, q], u[8, q], u[9, q], u[10, q], u[11, q], u[12, q], u[13, q], u[14, q], v[0, q], v[1, q], v[2, q], v[3, q], v[4, q], v[5, q], v[6, q], v[7, q], v[8, q], v[9, q], v[10, q], v[11, q], v[12, q], v[13, q], v[14, q], s[0, q], s[1, q], s[2, q], s[6, q]
        d22 = u0*v0 + u1*v1 + u2*v2
        d23 = u3*v3 + u4*v4 + u5*v5
        d24 = u0*v3 + u1*v4 + u2*v5 + u3*v0 + u4*v1 + u5*v2
        d15 = u1*v5 - u2*v4 - u4*v2 + u5*v1
        d16 = -u0*v5 + u2*v3 + u3*v2 - u5*v0
        d17 = u0*v4 - u1*v3 - u3*v1 + u4*v0
        e0 = u1*u5 - u2*u4
        e1 = -u0*u5 + u2*u3
        e2 = u0*u4 - u1*u3
        x0 = (e0 * e0) + (e1 * e1) + (e2 * e2)
        d18 = -(d15*e0 + d16*e1 + d17*e2)/(x0 * math.sqrt(x0))
        e3 = (1.0 / (math.sqrt(x0)))
        d19 = d15*e3 + d18*e0
        d20 = d16*e3 + d18*e1
        d21 = d17*e3 + d18*e2
        e4 = e0*e3
        e5 = e1*e3
        e6 = e2*e3
        d26 = d19*u6 + d20*u7 + d21*u8 + e4*v6 + e5*v7 + e6*v8
        d27 = d19*u9 + d20*u10 + d21*u11 + e4*v9 + e5*v10 + e6*v11
        d28 = d19*u12 + d20*u13 + d21*u14 + e4*v12 + e5*v13 + e6*v14
        e10 = 0.5*(1.0 - s2)
        x1 = 2.0*s2
        W[q] = s6*(s0*((d22 * d22) + d22*d23*x1 + (d23 * d23) + (d24 * d24)*e10) + s1*((d26 * d26) + d26*d27*x1 + (d27 * d27) + 4.0*(d28 * d28)*e10))


@entry
def planar_beam_energy(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (8, count))
    s = carray(s, (12, count))
    total = 0.0
    for q in range(count):
        u2, u3, u4, u5, u6, u7, s0, s1, s2, s3, s4, s5, s6, s7, s8, s9, s10, s11 = u[2, q], u[3, q], u[4, q], u[5, q], u[6, q], u[7, q], s[0, q], s[1, q], s[2, q], s[3, q], s[4, q], s[5, q], s[6, q], s[7, q], s[8, q], s[9, q], s[10, q], s[11, q]
        e0 = -s7 + u2*u4 + u3*u5
        e1 = -s8 + u2*u5 - u3*u4
        e2 = -s9 + u2*u7 - u3*u6
        e3 = -s10 + (u2 * u2) + (u3 * u3)
        total += s11*(0.5*(e0 * e0)*s0 + e0*e1*s1 + e0*e2*s2 + 0.5*(e1 * e1)*s3 + e1*e2*s4 + 0.5*(e2 * e2)*s5 + 0.125*(e3 * e3)*s6)
    carray(out, 1)[0] = total


@entry
def planar_beam_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (8, count))
    s = carray(s, (12, count))
    S = carray(out, (8, count))
    for q in range(count):
        u2, u3, u4, u5, u6, u7, s0, s1, s2, s3, s4, s5, s6, s7, s8, s9, s10, s11 = u[2, q], u[3, q], u[4, q], u[5, q], u[6, q], u[7, q], s[0, q], s[1, q], s[2, q], s[3, q], s[4, q], s[5, q], s[6, q], s[7, q], s[8, q], s[9, q], s[10, q], s[11, q]
        e0 = -s7 + u2*u4 + u3*u5
        e1 = -s8 + u2*u5 - u3*u4
        e2 = -s9 + u2*u7 - u3*u6
        fe0 = s11*(e0*s0 + e1*s1 + e2*s2)
        fe1 = s11*(e0*s1 + e1*s3 + e2*s4)
        fe2 = s11*(e0*s2 + e1*s4 + e2*s5)
        e3 = -s10 + (u2 * u2) + (u3 * u3)
        fe3 = 0.25*e3*s11*s6
        x0 = 2.0*fe3
        S[0, q] = 0.0
        S[1, q] = 0.0
        S[2, q] = fe0*u4 + fe1*u5 + fe2*u7 + u2*x0
        S[3, q] = fe0*u5 - fe1*u4 - fe2*u6 + u3*x0
        S[4, q] = fe0*u2 - fe1*u3
        S[5, q] = fe0*u3 + fe1*u2
        S[6, q] = -fe2*u3
        S[7, q] = fe2*u2


@entry
def planar_beam_modulus(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (8, count))
    h = carray(v, (8, count))
    s = carray(s, (12, count))
    D = carray(out, (8, 8, count))
    T = np.empty((36, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u2, u3, u4, u5, u6, u7, h2, h3, h4, h5, h6, h7, s0, s1, s2, s3, s4, s5, s6, s7, s8, s9, s10, s11 = u[2, q], u[3, q], u[4, q], u[5, q], u[6, q], u[7, q], h[2, q], h[3, q], h[4, q], h[5, q], h[6, q], h[7, q], s[0, q], s[1, q], s[2, q], s[3, q], s[4, q], s[5, q], s[6, q], s[7, q], s[8, q], s[9, q], s[10, q], s[11, q]
            x9 = s11*(beta + 1.0)
            ke0e0 = s0*x9
            ke1e0 = s1*x9
            ke2e0 = s2*x9
            pe0u2 = ke0e0*u4 + ke1e0*u5 + ke2e0*u7
            ke1e1 = s3*x9
            ke2e1 = s4*x9
            x10 = ke1e0*u4
            pe1u2 = ke1e1*u5 + ke2e1*u7 + x10
            ke2e2 = s5*x9
            pe2u2 = ke2e0*u4 + ke2e1*u5 + ke2e2*u7
            x1 = -s10
            x6 = h2 - u2
            x7 = h3 - u3
            ae3 = (h2 * h2) + (h3 * h3) + x1 + (-2.0*h2*x6 - 2.0*h3*x7 if way == 1 else 0.0)
            x8 = 0.25*s6
            fe3 = ae3*s11*x8
            x17 = 2.0*fe3
            ke3e3 = x8*x9
            x18 = 4.0*ke3e3
            x2 = (u2 * u2)
            pe0u3 = ke0e0*u5 - ke2e0*u6 - x10
            pe1u3 = ke1e0*u5 - ke1e1*u4 - ke2e1*u6
            pe2u3 = ke2e0*u5 - ke2e1*u4 - ke2e2*u6
            x3 = (u3 * u3)
            x0 = -s7
            x4 = h4 - u4
            x5 = h5 - u5
            ae0 = h2*h4 + h3*h5 + x0 + (-h2*x4 - h3*x5 - h4*x6 - h5*x7 if way == 1 else 0.0)
            ae1 = h2*h5 - h3*h4 - s8 + (-h2*x5 + h3*x4 + h4*x7 - h5*x6 if way == 1 else 0.0)
            ae2 = h2*h7 - h3*h6 - s9 + (-h2*(h7 - u7) + h3*(h6 - u6) + h6*x7 - h7*x6 if way == 1 else 0.0)
            fe0 = s11*(ae0*s0 + ae1*s1 + ae2*s2)
            fe1 = s11*(ae0*s1 + ae1*s3 + ae2*s4)
            x11 = ke1e0*u3
            pe0u4 = ke0e0*u2 - x11
            x12 = ke1e0*u2
            pe1u4 = -ke1e1*u3 + x12
            pe0u5 = ke0e0*u3 + x12
            pe1u5 = ke1e1*u2 + x11
            fe2 = s11*(ae0*s2 + ae1*s4 + ae2*s5)
            x14 = ke2e0*u2
            x15 = -ke2e1*u3
            pe2u4 = x14 + x15
            x13 = ke2e0*u3
            x16 = ke2e1*u2
            pe2u5 = x13 + x16
            pe2u6 = -ke2e2*u3
            pe2u7 = ke2e2*u2
            T[0, k] = 0.0
            T[1, k] = 0.0
            T[2, k] = 0.0
            T[3, k] = 0.0
            T[4, k] = 0.0
            T[5, k] = pe0u2*u4 + pe1u2*u5 + pe2u2*u7 + x17 + x18*x2
            T[6, k] = 0.0
            T[7, k] = 0.0
            T[8, k] = pe0u2*u5 - pe1u2*u4 - pe2u2*u6 + u2*u3*x18
            T[9, k] = pe0u3*u5 - pe1u3*u4 - pe2u3*u6 + x17 + x18*x3
            T[10, k] = 0.0
            T[11, k] = 0.0
            T[12, k] = fe0 + pe0u2*u2 - pe1u2*u3
            T[13, k] = -fe1 + pe0u3*u2 - pe1u3*u3
            T[14, k] = pe0u4*u2 - pe1u4*u3
            T[15, k] = 0.0
            T[16, k] = 0.0
            T[17, k] = fe1 + pe0u2*u3 + pe1u2*u2
            T[18, k] = fe0 + pe0u3*u3 + pe1u3*u2
            T[19, k] = pe0u4*u3 + pe1u4*u2
            T[20, k] = pe0u5*u3 + pe1u5*u2
            T[21, k] = 0.0
            T[22, k] = 0.0
            T[23, k] = -pe2u2*u3
            T[24, k] = -fe2 - pe2u3*u3
            T[25, k] = -pe2u4*u3
            T[26, k] = -pe2u5*u3
            T[27, k] = -pe2u6*u3
            T[28, k] = 0.0
            T[29, k] = 0.0
            T[30, k] = fe2 + pe2u2*u2
            T[31, k] = pe2u3*u2
            T[32, k] = pe2u4*u2
            T[33, k] = pe2u5*u2
            T[34, k] = pe2u6*u2
            T[35, k] = pe2u7*u2
        unfold(T, first, D, False)


@entry
def planar_beam_damped_stress(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (8, count))
    v = carray(v, (8, count))
    s = carray(s, (12, count))
    S = carray(out, (8, count))
    for q in range(count):
        u2, u3, u4, u5, u6, u7, v2, v3, v4, v5, v6, v7, s0, s1, s2, s3, s4, s5, s6, s7, s8, s9, s10, s11 = u[2, q], u[3, q], u[4, q], u[5, q], u[6, q], u[7, q], v[2, q], v[3, q], v[4, q], v[5, q], v[6, q], v[7, q], s[0, q], s[1, q], s[2, q], s[3, q], s[4, q], s[5, q], s[6, q], s[7, q], s[8, q], s[9, q], s[10, q], s[11, q]
        d10 = u2*v7 - u3*v6 - u6*v3 + u7*v2
        d8 = u2*v4 + u3*v5 + u4*v2 + u5*v3
        d9 = u2*v5 - u3*v4 - u4*v3 + u5*v2
        e0 = -s7 + u2*u4 + u3*u5
        e1 = -s8 + u2*u5 - u3*u4
        e2 = -s9 + u2*u7 - u3*u6
        fe0 = s11*(beta*(d10*s2 + d8*s0 + d9*s1) + e0*s0 + e1*s1 + e2*s2)
        fe1 = s11*(beta*(d10*s4 + d8*s1 + d9*s3) + e0*s1 + e1*s3 + e2*s4)
        fe2 = s11*(beta*(d10*s5 + d8*s2 + d9*s4) + e0*s2 + e1*s4 + e2*s5)
        d11 = 2.0*(u2*v2 + u3*v3)
        e3 = -s10 + (u2 * u2) + (u3 * u3)
        fe3 = 0.25*s11*s6*(beta*d11 + e3)
        x0 = 2.0*fe3
        S[0, q] = 0.0
        S[1, q] = 0.0
        S[2, q] = fe0*u4 + fe1*u5 + fe2*u7 + u2*x0
        S[3, q] = fe0*u5 - fe1*u4 - fe2*u6 + u3*x0
        S[4, q] = fe0*u2 - fe1*u3
        S[5, q] = fe0*u3 + fe1*u2
        S[6, q] = -fe2*u3
        S[7, q] = fe2*u2


@entry
def planar_beam_dissipation(u, v, s, out, way, points, cells, n, beta):
    count = points * cells
    u = carray(u, (8, count))
    v = carray(v, (8, count))
    s = carray(s, (12, count))
    W = carray(out, count)
    for q in range(count):
        u2, u3, u4, u5, u6, u7, v2, v3, v4, v5, v6, v7, s0, s1, s2, s3, s4, s5, s6, s11 = u[2, q], u[3, q], u[4, q], u[5, q], u[6, q], u[7, q], v[2, q], v[3, q], v[4, q], v[5, q], v[6, q], v[7, q], s[0, q], s[1, q], s[2, q], s[3, q], s[4, q], s[5, q], s[6, q], s[11, q]
        d10 = u2*v7 - u3*v6 - u6*v3 + u7*v2
        d11 = 2.0*(u2*v2 + u3*v3)
        d8 = u2*v4 + u3*v5 + u4*v2 + u5*v3
        d9 = u2*v5 - u3*v4 - u4*v3 + u5*v2
        W[q] = 2.0*s11*(0.5*(d10 * d10)*s5 + d10*d8*s2 + d10*d9*s4 + 0.125*(d11 * d11)*s6 + 0.5*(d8 * d8)*s0 + d8*d9*s1 + 0.5*(d9 * d9)*s3)


FUNCTIONS = {"quadratic_2_energy": quadratic_2_energy, "quadratic_2_stress": quadratic_2_stress, "quadratic_2_modulus": quadratic_2_modulus, "quadratic_2_damped_stress": quadratic_2_damped_stress, "quadratic_2_dissipation": quadratic_2_dissipation, "quadratic_3_energy": quadratic_3_energy, "quadratic_3_stress": quadratic_3_stress, "quadratic_3_modulus": quadratic_3_modulus, "quadratic_3_damped_stress": quadratic_3_damped_stress, "quadratic_3_dissipation": quadratic_3_dissipation, "curved_2_energy": curved_2_energy, "curved_2_stress": curved_2_stress, "curved_2_modulus": curved_2_modulus, "curved_2_damped_stress": curved_2_damped_stress, "curved_2_dissipation": curved_2_dissipation, "curved_3_energy": curved_3_energy, "curved_3_stress": curved_3_stress, "curved_3_modulus": curved_3_modulus, "curved_3_damped_stress": curved_3_damped_stress, "curved_3_dissipation": curved_3_dissipation, "membrane_energy": membrane_energy, "membrane_stress": membrane_stress, "membrane_modulus": membrane_modulus, "membrane_damped_stress": membrane_damped_stress, "membrane_dissipation": membrane_dissipation, "shell_energy": shell_energy, "shell_stress": shell_stress, "shell_modulus": shell_modulus, "shell_damped_stress": shell_damped_stress, "shell_dissipation": shell_dissipation, "planar_beam_energy": planar_beam_energy, "planar_beam_stress": planar_beam_stress, "planar_beam_modulus": planar_beam_modulus, "planar_beam_damped_stress": planar_beam_damped_stress, "planar_beam_dissipation": planar_beam_dissipation}
