"""Energy, stress and modulus of cables, written by `cable_symbols` and not to be edited."""

# fmt: off
# ruff: noqa
# mypy: ignore-errors
from __future__ import annotations
import math
from typing import Any
import numpy as np
from fmbs_skfem.core.entries import LANES, entry, unfold
from fmbs_skfem.core.jit import carray
from .cable_law import fall


@entry
def planar_2_energy(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    total = 0.0
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0) + (u1 * u1)
        total += (0.125)*s3*(s0*((x0 - 1.0) * (x0 - 1.0)) + 4.0*s1*((s2 - (u0*u3 - u1*u2)*fall(x0, option)) * (s2 - (u0*u3 - u1*u2)*fall(x0, option))))
    carray(out, 1)[0] = total


@entry
def planar_2_stress(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    S = carray(out, (rows, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0) + (u1 * u1)
        x1 = (0.5)*s0*(x0 - 1.0)
        x2 = u0*u3 - u1*u2
        x3 = option*x2/x0
        x4 = fall(x0, option)
        x5 = s1*x4*(s2 - x2*x4)
        x6 = s3*x5
        S[0, q] = s3*(u0*x1 + x5*(u0*x3 - u3))
        S[1, q] = s3*(u1*x1 + x5*(u1*x3 + u2))
        S[2, q] = u1*x6
        S[3, q] = -u0*x6


@entry
def planar_2_modulus(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D = carray(out, (rows, rows, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0)
        x1 = (u1 * u1)
        x2 = x0 + x1
        x3 = (0.5)*s0*(x2 - 1.0)
        x4 = u0*u3
        x5 = u1*u2
        x6 = x4 - x5
        x7 = (1.0 / (x2))
        x8 = x6*x7
        x9 = option*x8
        x10 = u0*x9 - u3
        x11 = fall(x2, option)
        x12 = s1*(x11 * x11)
        x13 = 2.0*x8
        x14 = x11*x6
        x15 = option*x7*(s2 - x14)
        x16 = s1*x11
        x17 = x15*x16
        x18 = u0*u1
        x19 = u1*x9 + u2
        x20 = s3*x16
        x21 = -s2 + x14
        x22 = s3*x12
        D[0, 0, q] = D[0, 0, q] = s3*(s0*x0 + (x10 * x10)*x12 - x17*(x0*x13 + x0*x9 - 3.0*x4 + x5) + x3)
        D[1, 0, q] = D[0, 1, q] = s3*(s0*x18 + x10*x12*x19 - x17*(u0*u2 - u1*u3 + x13*x18 + x18*x9))
        D[1, 1, q] = D[1, 1, q] = s3*(s0*x1 + x12*(x19 * x19) - x17*(x1*x13 + x1*x9 - x4 + 3.0*x5) + x3)
        D[2, 0, q] = D[0, 2, q] = -u1*x20*(u0*x15 - x10*x11)
        D[2, 1, q] = D[1, 2, q] = -x20*(-u1*x11*x19 + x1*x15 + x21)
        D[2, 2, q] = D[2, 2, q] = x1*x22
        D[3, 0, q] = D[0, 3, q] = -x20*(u0*x10*x11 - x0*x15 - x21)
        D[3, 1, q] = D[1, 3, q] = -u0*x20*(-u1*x15 + x11*x19)
        D[3, 2, q] = D[2, 3, q] = -x18*x22
        D[3, 3, q] = D[3, 3, q] = x0*x22


@entry
def planar_2_damped_stress(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    v = carray(v, (rows, count))
    S = carray(out, (rows, count))
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0) + (u1 * u1)
        x1 = (0.5)*s0*(x0 - 1.0)
        x2 = u0*u3 - u1*u2
        x3 = option*x2/x0
        x4 = u0*x3 - u3
        x5 = s1*x4
        x6 = fall(x0, option)
        x7 = x2*x6
        x8 = s2 - x7
        x9 = x6*x8
        x10 = s0*(u0*v0 + u1*v1)
        x11 = u1*x3 + u2
        x12 = -u0*v3 + u1*v2 + v0*x4 + v1*x11
        x13 = x12*(x6 * x6)
        x14 = s1*x11
        x15 = beta*x6
        x16 = s1*s3*x6
        S[0, q] = s3*(beta*(u0*x10 + x13*x5) + u0*x1 + x5*x9)
        S[1, q] = s3*(beta*(u1*x10 + x13*x14) + u1*x1 + x14*x9)
        S[2, q] = -u1*x16*(-s2 - x12*x15 + x7)
        S[3, q] = -u0*x16*(x12*x15 + x8)


@entry
def planar_2_viscosity(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D = carray(out, (rows, rows, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[3, q]
        x0 = (u0 * u0)
        x1 = (u1 * u1)
        x2 = x0 + x1
        x3 = option*(u0*u3 - u1*u2)/x2
        x4 = u0*x3 - u3
        x5 = s1*((fall(x2, option)) * (fall(x2, option)))
        x6 = beta*s3
        x7 = u0*u1
        x8 = u1*x3 + u2
        x9 = x4*x5
        x10 = x6*x9
        x11 = x5*x6
        x12 = x11*x8
        D[0, 0, q] = D[0, 0, q] = D[0, 0, q] + x6*(s0*x0 + (x4 * x4)*x5)
        D[1, 0, q] = D[0, 1, q] = D[1, 0, q] + x6*(s0*x7 + x8*x9)
        D[1, 1, q] = D[1, 1, q] = D[1, 1, q] + x6*(s0*x1 + x5*(x8 * x8))
        D[2, 0, q] = D[0, 2, q] = D[2, 0, q] + u1*x10
        D[2, 1, q] = D[1, 2, q] = D[2, 1, q] + u1*x12
        D[2, 2, q] = D[2, 2, q] = D[2, 2, q] + x1*x11
        D[3, 0, q] = D[0, 3, q] = D[3, 0, q] + -u0*x10
        D[3, 1, q] = D[1, 3, q] = D[3, 1, q] + -u0*x12
        D[3, 2, q] = D[2, 3, q] = D[3, 2, q] + -x11*x7
        D[3, 3, q] = D[3, 3, q] = D[3, 3, q] + x0*x11


@entry
def planar_2_dissipation(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    v = carray(v, (rows, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[3, q]
        x0 = (u0 * u0) + (u1 * u1)
        x1 = option*(u0*u3 - u1*u2)/x0
        W[q] = s3*(s0*((u0*v0 + u1*v1) * (u0*v0 + u1*v1)) + s1*((-u0*v3 + u1*v2 + v0*(u0*x1 - u3) + v1*(u1*x1 + u2)) * (-u0*v3 + u1*v2 + v0*(u0*x1 - u3) + v1*(u1*x1 + u2)))*((fall(x0, option)) * (fall(x0, option))))


@entry
def spatial_3_energy(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    total = 0.0
    for q in range(count):
        u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0) + (u1 * u1) + (u2 * u2)
        x1 = (s2 * s2)
        x2 = ((fall(x0, option)) * (fall(x0, option)))
        x3 = x2*((u0*u4 - u1*u3) * (u0*u4 - u1*u3)) + x2*((u0*u5 - u2*u3) * (u0*u5 - u2*u3)) + x2*((u1*u5 - u2*u4) * (u1*u5 - u2*u4))
        total += (0.125)*s3*(s0*((x0 - 1.0) * (x0 - 1.0)) + 4.0*s1*(-2.0*s2*(math.sqrt(1.0e-12*x1 + x3 + 1.0e-60)) + x1 + x3))
    carray(out, 1)[0] = total


@entry
def spatial_3_stress(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    S = carray(out, (rows, count))
    for q in range(count):
        u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0) + (u1 * u1) + (u2 * u2)
        x1 = (0.5)*s0*(x0 - 1.0)
        x2 = u0*u5 - u2*u3
        x3 = -x2
        x4 = (x3 * x3)
        x5 = option/x0
        x6 = u0*x5
        x7 = u0*u4 - u1*u3
        x8 = (x7 * x7)
        x9 = u1*u5 - u2*u4
        x10 = (x9 * x9)
        x11 = -u4*x7 + x10*x6 + x6*x8
        x12 = ((fall(x0, option)) * (fall(x0, option)))
        x13 = (x2 * x2)
        x14 = s2/(math.sqrt(1.0e-12*(s2 * s2) + x10*x12 + x12*x13 + x12*x8 + 1.0e-60))
        x15 = s1*x12
        x16 = u1*x5
        x17 = u3*x7 - u5*x9 + x10*x16 + x16*x8
        x18 = u2*x5
        x19 = u4*x9 + x10*x18 + x18*x8
        x20 = u1*x7
        x21 = s3*x15
        x22 = u2*x9
        x23 = u0*x7
        x24 = u1*x9
        S[0, q] = s3*(u0*x1 - x15*(-u5*x2 + x11 + x13*x6 - x14*(u5*x3 + x11 + x4*x6)))
        S[1, q] = s3*(u1*x1 - x15*(x13*x16 - x14*(x16*x4 + x17) + x17))
        S[2, q] = s3*(u2*x1 - x15*(u3*x2 + x13*x18 - x14*(-u3*x3 + x18*x4 + x19) + x19))
        S[3, q] = -x21*(u2*x2 - x14*(-u2*x3 + x20) + x20)
        S[4, q] = -x21*(x14*(-x22 + x23) + x22 - x23)
        S[5, q] = x21*(u0*x2 + x14*(u0*x3 - x24) + x24)


@entry
def spatial_3_modulus(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D, T = carray(out, (rows, rows, count)), np.empty((21, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
            x0 = (u0 * u0)
            x1 = (u1 * u1)
            x2 = (u2 * u2)
            x3 = x1 + x2
            x4 = x0 + x3
            x5 = (0.5)*s0*(x4 - 1.0)
            x6 = (u4 * u4)
            x7 = u0*u4
            x8 = u1*u3
            x9 = x7 - x8
            x10 = (x9 * x9)
            x11 = 2.0/(x4 * x4)
            x12 = x0*x11
            x13 = option*x12
            x14 = u0*u5
            x15 = u2*u3
            x16 = x14 - x15
            x17 = (x16 * x16)
            x18 = u1*u5
            x19 = u2*u4
            x20 = x18 - x19
            x21 = (x20 * x20)
            x22 = (option * option)
            x23 = x12*x22
            x24 = option/x4
            x25 = 4.0*x24
            x26 = x25*x9
            x27 = x16*x25
            x28 = x10*x24
            x29 = -x28
            x30 = x17*x24
            x31 = -x30
            x32 = x21*x24
            x33 = -x32
            x34 = (u5 * u5) + x29 + x31 + x33
            x35 = x10*x13 + x10*x23 + x13*x17 + x13*x21 - x14*x27 + x17*x23 + x21*x23 - x26*x7 + x34 + x6
            x36 = ((fall(x4, option)) * (fall(x4, option)))
            x37 = 1.0e-12*(s2 * s2) + x10*x36 + x17*x36 + x21*x36 + 1.0e-60
            x38 = (1.0 / (math.sqrt(x37)))
            x39 = s2*x38
            x40 = u4*x9
            x41 = u5*x16
            x42 = u0*x28 + u0*x30 + u0*x32 - x40 - x41
            x43 = s2*x36/(x37 * math.sqrt(x37))
            x44 = s1*x36
            x45 = u0*u1
            x46 = u3*x9
            x47 = 2.0*x24
            x48 = u0*x47
            x49 = 2.0*x14
            x50 = x20*x24
            x51 = u1*x47
            x52 = 2.0*x18
            x53 = x16*x24
            x54 = x11*x45
            x55 = option*x54
            x56 = x22*x54
            x57 = -u3*u4 + x10*x55 + x10*x56 + x17*x55 + x17*x56 + x21*x55 + x21*x56 - x40*x51 + x46*x48 - x49*x50 - x52*x53
            x58 = u5*x20
            x59 = u1*x28 + u1*x30 + u1*x32 + x46 - x58
            x60 = x42*x43
            x61 = (u3 * u3)
            x62 = x1*x11
            x63 = option*x62
            x64 = x22*x62
            x65 = x20*x25
            x66 = x10*x63 + x10*x64 + x17*x63 + x17*x64 - x18*x65 + x21*x63 + x21*x64 + x26*x8 + x34 + x61
            x67 = u0*u2
            x68 = u3*x16
            x69 = 2.0*x7
            x70 = 2.0*x19
            x71 = x24*x9
            x72 = u2*x47
            x73 = x11*x67
            x74 = option*x73
            x75 = x22*x73
            x76 = -u3*u5 + x10*x74 + x10*x75 + x17*x74 + x17*x75 + x21*x74 + x21*x75 - x41*x72 + x48*x68 + x50*x69 - x70*x71
            x77 = u4*x20
            x78 = u2*x28 + u2*x30 + u2*x32 + x68 + x77
            x79 = u1*u2
            x80 = 2.0*x8
            x81 = 2.0*x15
            x82 = x11*x79
            x83 = option*x82
            x84 = x22*x82
            x85 = -u4*u5 + x10*x83 + x10*x84 + x17*x83 + x17*x84 + x21*x83 + x21*x84 + x51*x77 + x53*x80 - x58*x72 + x71*x81
            x86 = x43*x59
            x87 = x11*x2
            x88 = option*x87
            x89 = x22*x87
            x90 = x10*x88 + x10*x89 + x15*x27 + x17*x88 + x17*x89 + x19*x65 + x21*x88 + x21*x89 + x29 + x31 + x33 + x6 + x61
            x91 = u1*x9
            x92 = x48*x91
            x93 = u2*x16
            x94 = x48*x93
            x95 = u1*u4
            x96 = u2*u5
            x97 = -x16
            x98 = u2*x97
            x99 = x48*x98
            x100 = x91 - x98
            x101 = s3*x44
            x102 = x47*x9
            x103 = x1*x102 + x51*x93 - x7 + x80
            x104 = x2*x47
            x105 = x104*x16 - x14 + x72*x91 + x81
            x106 = x43*(x91 + x93)
            x107 = u2*x20
            x108 = x0*x102 - x107*x48 - x69 + x8
            x109 = u0*x9
            x110 = -x107 + x109
            x111 = u0*u3
            x112 = x107*x51
            x113 = x111 - x112 + x92 + x96
            x114 = -x104*x20 + x109*x72 + x18 - x70
            x115 = x43*x78
            x116 = x0 + x2
            x117 = x20*x47
            x118 = x16*x47
            x119 = x0*x118 + x117*x45 + x15 - x49
            x120 = u1*x20
            x121 = u0*x97 - x120
            x122 = x1*x117 + x118*x45 + x19 - x52
            x123 = x111 + x112 + x95
            x124 = x121*x43
            T[0, k] = s3*(s0*x0 + x44*(-x35*x39 + x35 + (x42 * x42)*x43) + x5)
            T[1, k] = s3*(s0*x45 + x44*(-x39*x57 + x57 + x59*x60))
            T[2, k] = s3*(s0*x1 + x44*(-x39*x66 + x43*(x59 * x59) + x66) + x5)
            T[3, k] = s3*(s0*x67 + x44*(-x39*x76 + x60*x78 + x76))
            T[4, k] = s3*(s0*x79 + x44*(-x39*x85 + x78*x86 + x85))
            T[5, k] = s3*(s0*x2 + x44*(-x39*x90 + x43*(x78 * x78) + x90) + x5)
            T[6, k] = -x101*(u1*u4 + u2*u5 - x100*x60 - x39*(-x92 + x95 + x96 + x99) - x92 - x94)
            T[7, k] = -x101*(s2*x103*x38 - x100*x86 - x103)
            T[8, k] = x101*(-x105*x39 + x105 + x106*x78)
            T[9, k] = -x101*(s2*x3*x38 - x100*x106 - x3)
            T[10, k] = -x101*(-x108*x39 + x108 + x110*x60)
            T[11, k] = -x101*(x110*x86 - x113*x39 + x113)
            T[12, k] = -x101*(x110*x115 - x114*x39 + x114)
            T[13, k] = -x101*(x106*x110 - x39*x45 + x45)
            T[14, k] = -x101*(s2*x116*x38 - (x110 * x110)*x43 - x116)
            T[15, k] = -x101*(-x119*x39 + x119 - x121*x60)
            T[16, k] = -x101*(-x121*x86 - x122*x39 + x122)
            T[17, k] = -x101*(-x115*x121 + x123 - x39*(x123 - x99) + x94)
            T[18, k] = -x101*(u0*u2 - x106*x121 - x39*x67)
            T[19, k] = -x101*(x110*x124 - x39*x79 + x79)
            T[20, k] = -x101*(-x0 - x1 + x124*(u0*x16 + x120) + x39*(x0 + x1))
        unfold(T, first, D, False)


@entry
def spatial_3_damped_stress(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    v = carray(v, (rows, count))
    S = carray(out, (rows, count))
    for q in range(count):
        u0, u1, u2, u3, u4, u5, v0, v1, v2, v3, v4, v5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], v[0, q], v[1, q], v[2, q], v[3, q], v[4, q], v[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = s0*u0
        x1 = (u0 * u0) + (u1 * u1) + (u2 * u2)
        x2 = (0.5)*x1 - 0.5
        x3 = u0*u5 - u2*u3
        x4 = -x3
        x5 = (x4 * x4)
        x6 = option/x1
        x7 = u0*x6
        x8 = u1*u5 - u2*u4
        x9 = (x8 * x8)
        x10 = x7*x9
        x11 = u0*u4 - u1*u3
        x12 = (x11 * x11)
        x13 = -u4*x11 + x10 + x12*x7
        x14 = ((fall(x1, option)) * (fall(x1, option)))
        x15 = (x3 * x3)
        x16 = x12*x14 + x14*x15 + x14*x9
        x17 = s2/(math.sqrt(1.0e-12*(s2 * s2) + x16 + 1.0e-60))
        x18 = s1*x14
        x19 = u0*v0
        x20 = u1*v1
        x21 = u2*v2
        x22 = 2.0*x19 + 2.0*x20 + 2.0*x21
        x23 = u1*x8
        x24 = -u5 + x23*x6
        x25 = u2*x8
        x26 = u4 + x25*x6
        x27 = -u1*v5 + u2*v4 + v2*x26 + x19*x6*x8
        x28 = v1*x24 + x27
        x29 = -x28
        x30 = x29*x8
        x31 = u0*x4
        x32 = u5 + x31*x6
        x33 = u2*x4
        x34 = -u3 + x33*x6
        x35 = x20*x6
        x36 = u0*v5 - u2*v3 + v0*x32
        x37 = v2*x34 - x3*x35 + x36
        x38 = -x37
        x39 = u0*x11
        x40 = -u4 + x39*x6
        x41 = u1*x11
        x42 = u3 + x41*x6
        x43 = -u0*v4 + u1*v3 + v1*x42 + x11*x21*x6
        x44 = v0*x40 + x43
        x45 = -x44
        x46 = s0/s1
        x47 = 1.25e-7*x46
        x48 = 2.0*x14
        x49 = x48*(-x11*x44 - x28*x8 + x3*x37)
        x50 = (1.0 / ((x16 + 6.25e-8*x46)))
        x51 = x18*x50
        x52 = (0.5)*beta
        x53 = s0*u1
        x54 = u1*x6
        x55 = x15*x54
        x56 = u3*x11 - u5*x8 + x12*x54 + x54*x9
        x57 = x3*x38
        x58 = s0*u2
        x59 = u2*x6
        x60 = x12*x59
        x61 = u4*x8 + x59*x9 + x60
        x62 = x11*x45
        x63 = -x33 + x41
        x64 = -v2*x34 - x35*x4 - x36
        x65 = x48*(x30 - x57 + x62)
        x66 = x50*x52
        x67 = s3*x18
        x68 = -x25 + x39
        x69 = -x23 + x31
        S[0, q] = s3*(x0*x2 - x18*(-u5*x3 + x13 + x15*x7 - x17*(u5*x4 + x13 + x5*x7)) + x52*(x0*x22 - x51*(x47*(x30*x7 + x32*x38 + x40*x45) + x49*(x10 + x11*x40 - x3*x32))))
        S[1, q] = s3*(-x18*(-x17*(x5*x54 + x56) + x55 + x56) + x2*x53 + x52*(x22*x53 - x51*(x47*(x24*x29 + x42*x45 - x54*x57) + x49*(x11*x42 + x24*x8 + x55))))
        S[2, q] = s3*(-x18*(u3*x3 + x15*x59 - x17*(-u3*x4 + x5*x59 + x61) + x61) + x2*x58 + x52*(x22*x58 - x51*(x47*(x26*x29 + x34*x38 + x59*x62) + x49*(x26*x8 - x3*x34 + x60))))
        S[3, q] = -x67*(u2*x3 - x17*x63 + x41 + x66*(x47*(u1*(-v0*x40 - x43) - u2*x64) + x63*x65))
        S[4, q] = x67*(-x17*x68 + x66*(x47*(-u0*x44 + u2*x28) + x49*x68) + x68)
        S[5, q] = x67*(u0*x3 + x17*x69 + x23 - x66*(x47*(u0*x64 - u1*(-v1*x24 - x27)) + x65*x69))


@entry
def spatial_3_viscosity(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D, T = carray(out, (rows, rows, count)), np.empty((21, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u0, u1, u2, u3, u4, u5, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[3, q]
            x0 = (u0 * u0)
            x1 = -u5
            x2 = u0*u5 - u2*u3
            x3 = u0*x2
            x4 = (u1 * u1)
            x5 = (u2 * u2)
            x6 = x4 + x5
            x7 = x0 + x6
            x8 = option/x7
            x9 = x1 + x3*x8
            x10 = u1*u5 - u2*u4
            x11 = (x10 * x10)
            x12 = (option * option)/(x7 * x7)
            x13 = u0*u4 - u1*u3
            x14 = u0*x13
            x15 = x14*x8
            x16 = -u4 + x15
            x17 = s0/s1
            x18 = 1.25e-7*x17
            x19 = u0*x8
            x20 = -x2
            x21 = u0*x20
            x22 = u5 + x21*x8
            x23 = x11*x19 + x13*x16 - x2*x22
            x24 = ((fall(x7, option)) * (fall(x7, option)))
            x25 = 2.0*x24
            x26 = (x13 * x13)
            x27 = (x2 * x2)
            x28 = (0.5)*s1*x24/(x11*x24 + 6.25e-8*x17 + x24*x26 + x24*x27)
            x29 = beta*s3
            x30 = s0*u0
            x31 = u1*x10
            x32 = x31*x8
            x33 = x1 + x32
            x34 = -x33
            x35 = u1*x8
            x36 = x20*x35
            x37 = u1*x13
            x38 = u3 + x37*x8
            x39 = -x16
            x40 = x13*x38
            x41 = x10*x33 + x27*x35 + x40
            x42 = -x23*x25
            x43 = u2*x10
            x44 = u4 + x43*x8
            x45 = x10*x44
            x46 = u2*x8
            x47 = u2*x20
            x48 = x47*x8
            x49 = -u3 + x48
            x50 = -x49
            x51 = -x2*x49 + x26*x46 + x45
            x52 = -x51
            x53 = u1*u2
            x54 = x25*x41
            x55 = u2*x2
            x56 = x55*x8
            x57 = x37 - x47
            x58 = x28*x29
            x59 = u1*x18
            x60 = u2*x18
            x61 = x37 + x55
            x62 = -x15 + x44
            x63 = u0*x18
            x64 = x14 - x43
            x65 = x25*x64
            x66 = x21 - x31
            x67 = x3 + x31
            x68 = x25*x66
            T[0, k] = x29*(s0*x0 + x28*(x18*(x0*x11*x12 + (x16 * x16) + (x9 * x9)) + (x23 * x23)*x25))
            T[1, k] = x29*(u1*x30 - x28*(x18*(x10*x19*x34 - x22*x36 + x38*x39) + x41*x42))
            T[2, k] = x29*(s0*x4 + x28*(x18*(x12*x27*x4 + (x33 * x33) + (x38 * x38)) + x25*(x41 * x41)))
            T[3, k] = x29*(u2*x30 - x28*(x18*(x13*x39*x46 - x19*x45 + x22*x50) - x42*x52))
            T[4, k] = x29*(s0*x53 - x28*(x18*(x34*x44 + x36*x50 - x40*x46) + x52*x54))
            T[5, k] = x29*(s0*x5 + x28*(x18*(x12*x26*x5 + (x44 * x44) + ((u3 + x56) * (u3 + x56))) + x25*(x51 * x51)))
            T[6, k] = -x58*(x18*(u1*x39 + u2*x22) + x42*x57)
            T[7, k] = -x58*(-x54*x57 + x59*(-x38 + x48))
            T[8, k] = x58*(x25*x51*x61 + x60*(x38 + x56))
            T[9, k] = x58*(x18*x6 + x25*(x61 * x61))
            T[10, k] = x58*(-x23*x65 + x62*x63)
            T[11, k] = -x58*(x18*(u0*x38 - u2*x33) + x54*x64)
            T[12, k] = -x58*(-x52*x65 - x60*x62)
            T[13, k] = -x58*(u0*x59 + x57*x65)
            T[14, k] = x58*(x18*(x0 + x5) + x25*(x64 * x64))
            T[15, k] = -x58*(x42*x66 + x63*(-x22 + x32))
            T[16, k] = -x58*(x54*x67 + x59*(x32 + x9))
            T[17, k] = -x58*(x18*(u0*x50 + u1*x44) + x52*x68)
            T[18, k] = -x58*(u0*x60 - x57*x68)
            T[19, k] = -x58*(x18*x53 + x65*x66)
            T[20, k] = x58*(x18*(x0 + x4) + x25*(x67 * x67))
        unfold(T, first, D, True)


@entry
def spatial_3_dissipation(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    v = carray(v, (rows, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, u4, u5, v0, v1, v2, v3, v4, v5, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], v[0, q], v[1, q], v[2, q], v[3, q], v[4, q], v[5, q], s[0, q], s[1, q], s[3, q]
        x0 = u0*v0
        x1 = u1*v1
        x2 = u2*v2
        x3 = (u0 * u0) + (u1 * u1) + (u2 * u2)
        x4 = ((fall(x3, option)) * (fall(x3, option)))
        x5 = 6.25e-8*s0/s1
        x6 = u0*u4 - u1*u3
        x7 = u0*u5 - u2*u3
        x8 = u1*u5 - u2*u4
        x9 = option/x3
        x10 = x8*x9
        x11 = -u1*v5 + u2*v4 + v1*(u1*x10 - u5) + v2*(u2*x10 + u4) + x0*x10
        x12 = x6*x9
        x13 = -u0*v4 + u1*v3 + v0*(u0*x12 - u4) + v1*(u1*x12 + u3) + x12*x2
        x14 = -x7*x9
        x15 = u0*v5 - u2*v3 + v0*(u0*x14 + u5) + v2*(u2*x14 - u3) - x1*x7*x9
        W[q] = s3*(s0*((x0 + x1 + x2) * (x0 + x1 + x2)) + s1*x4*(x4*((-x11*x8 - x13*x6 + x15*x7) * (-x11*x8 - x13*x6 + x15*x7)) + x5*((x11 * x11) + (x13 * x13) + (x15 * x15)))/(x4*(x6 * x6) + x4*(x7 * x7) + x4*(x8 * x8) + x5))


@entry
def quadratic_2_energy(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    total = 0.0
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (s2 * s2)
        x1 = (u2 * u2) + (u3 * u3)
        total += (0.125)*s3*(s0*(((u0 * u0) + (u1 * u1) - 1.0) * ((u0 * u0) + (u1 * u1) - 1.0)) + 4.0*s1*(-2.0*s2*(math.sqrt(1.0e-12*x0 + x1 + 1.0e-60)) + x0 + x1))
    carray(out, 1)[0] = total


@entry
def quadratic_2_stress(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    S = carray(out, (rows, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (0.5)*s0*s3*((u0 * u0) + (u1 * u1) - 1.0)
        x1 = s1*s3*(s2/(math.sqrt(1.0e-12*(s2 * s2) + (u2 * u2) + (u3 * u3) + 1.0e-60)) - 1.0)
        S[0, q] = u0*x0
        S[1, q] = u1*x0
        S[2, q] = -u2*x1
        S[3, q] = -u3*x1


@entry
def quadratic_2_modulus(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D = carray(out, (rows, rows, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u1 * u1)
        x1 = (u0 * u0)
        x2 = s0*s3
        x3 = (0.5)*x2
        x4 = (u2 * u2)
        x5 = (u3 * u3)
        x6 = 1.0e-12*(s2 * s2) + x4 + x5 + 1.0e-60
        x7 = s2/(x6 * math.sqrt(x6))
        x8 = -s2/(math.sqrt(x6)) + 1.0
        x9 = s1*s3
        D[0, 0, q] = D[0, 0, q] = x3*(x0 + 3.0*x1 - 1.0)
        D[1, 0, q] = D[0, 1, q] = u0*u1*x2
        D[1, 1, q] = D[1, 1, q] = x3*(3.0*x0 + x1 - 1.0)
        D[2, 0, q] = D[0, 2, q] = 0.0
        D[2, 1, q] = D[1, 2, q] = 0.0
        D[2, 2, q] = D[2, 2, q] = x9*(x4*x7 + x8)
        D[3, 0, q] = D[0, 3, q] = 0.0
        D[3, 1, q] = D[1, 3, q] = 0.0
        D[3, 2, q] = D[2, 3, q] = u2*u3*x7*x9
        D[3, 3, q] = D[3, 3, q] = x9*(x5*x7 + x8)


@entry
def quadratic_2_damped_stress(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    v = carray(v, (rows, count))
    S = carray(out, (rows, count))
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = s0*s3*(beta*(u0*v0 + u1*v1) + (0.5)*(u0 * u0) + (0.5)*(u1 * u1) - 0.5)
        x1 = (u2 * u2) + (u3 * u3)
        x2 = s2/(math.sqrt(1.0e-12*(s2 * s2) + x1 + 1.0e-60)) - 1.0
        x3 = s0/s1
        x4 = 1.25e-7*x3
        x5 = 2.0*u2*v2 + 2.0*u3*v3
        x6 = (0.5)*beta/(x1 + 6.25e-8*x3)
        x7 = s1*s3
        S[0, q] = u0*x0
        S[1, q] = u1*x0
        S[2, q] = x7*(-u2*x2 + x6*(u2*x5 + v2*x4))
        S[3, q] = x7*(-u3*x2 + x6*(u3*x5 + v3*x4))


@entry
def quadratic_2_viscosity(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D = carray(out, (rows, rows, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[3, q]
        x0 = beta*s3
        x1 = s0*x0
        x2 = (u2 * u2)
        x3 = s0/s1
        x4 = 1.25e-7*x3
        x5 = (u3 * u3)
        x6 = s1*x0/(x2 + 6.25e-8*x3 + x5)
        x7 = (0.5)*x6
        D[0, 0, q] = D[0, 0, q] = D[0, 0, q] + (u0 * u0)*x1
        D[1, 0, q] = D[0, 1, q] = D[1, 0, q] + u0*u1*x1
        D[1, 1, q] = D[1, 1, q] = D[1, 1, q] + (u1 * u1)*x1
        D[2, 0, q] = D[0, 2, q] = D[2, 0, q] + 0.0
        D[2, 1, q] = D[1, 2, q] = D[2, 1, q] + 0.0
        D[2, 2, q] = D[2, 2, q] = D[2, 2, q] + x7*(2.0*x2 + x4)
        D[3, 0, q] = D[0, 3, q] = D[3, 0, q] + 0.0
        D[3, 1, q] = D[1, 3, q] = D[3, 1, q] + 0.0
        D[3, 2, q] = D[2, 3, q] = D[3, 2, q] + u2*u3*x6
        D[3, 3, q] = D[3, 3, q] = D[3, 3, q] + x7*(x4 + 2.0*x5)


@entry
def quadratic_2_dissipation(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    v = carray(v, (rows, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[3, q]
        x0 = 6.25e-8*s0/s1
        W[q] = s3*(s0*((u0*v0 + u1*v1) * (u0*v0 + u1*v1)) + s1*(x0*((v2 * v2) + (v3 * v3)) + ((u2*v2 + u3*v3) * (u2*v2 + u3*v3)))/((u2 * u2) + (u3 * u3) + x0))


@entry
def quadratic_3_energy(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    total = 0.0
    for q in range(count):
        u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (s2 * s2)
        x1 = (u3 * u3) + (u4 * u4) + (u5 * u5)
        total += (0.125)*s3*(s0*(((u0 * u0) + (u1 * u1) + (u2 * u2) - 1.0) * ((u0 * u0) + (u1 * u1) + (u2 * u2) - 1.0)) + 4.0*s1*(-2.0*s2*(math.sqrt(1.0e-12*x0 + x1 + 1.0e-60)) + x0 + x1))
    carray(out, 1)[0] = total


@entry
def quadratic_3_stress(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    S = carray(out, (rows, count))
    for q in range(count):
        u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (0.5)*s0*s3*((u0 * u0) + (u1 * u1) + (u2 * u2) - 1.0)
        x1 = s1*s3*(s2/(math.sqrt(1.0e-12*(s2 * s2) + (u3 * u3) + (u4 * u4) + (u5 * u5) + 1.0e-60)) - 1.0)
        S[0, q] = u0*x0
        S[1, q] = u1*x0
        S[2, q] = u2*x0
        S[3, q] = -u3*x1
        S[4, q] = -u4*x1
        S[5, q] = -u5*x1


@entry
def quadratic_3_modulus(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D, T = carray(out, (rows, rows, count)), np.empty((21, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
            x0 = (u1 * u1)
            x1 = (u0 * u0)
            x2 = (u2 * u2)
            x3 = x2 - 1.0
            x4 = s0*s3
            x5 = (0.5)*x4
            x6 = u0*x4
            x7 = (u3 * u3)
            x8 = (u4 * u4)
            x9 = (u5 * u5)
            x10 = 1.0e-12*(s2 * s2) + x7 + x8 + x9 + 1.0e-60
            x11 = s2/(x10 * math.sqrt(x10))
            x12 = -s2/(math.sqrt(x10)) + 1.0
            x13 = s1*s3
            x14 = u3*x11*x13
            T[0, k] = x5*(x0 + 3.0*x1 + x3)
            T[1, k] = u1*x6
            T[2, k] = x5*(3.0*x0 + x1 + x3)
            T[3, k] = u2*x6
            T[4, k] = u1*u2*x4
            T[5, k] = x5*(x0 + x1 + 3.0*x2 - 1.0)
            T[6, k] = 0.0
            T[7, k] = 0.0
            T[8, k] = 0.0
            T[9, k] = x13*(x11*x7 + x12)
            T[10, k] = 0.0
            T[11, k] = 0.0
            T[12, k] = 0.0
            T[13, k] = u4*x14
            T[14, k] = x13*(x11*x8 + x12)
            T[15, k] = 0.0
            T[16, k] = 0.0
            T[17, k] = 0.0
            T[18, k] = u5*x14
            T[19, k] = u4*u5*x11*x13
            T[20, k] = x13*(x11*x9 + x12)
        unfold(T, first, D, False)


@entry
def quadratic_3_damped_stress(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    v = carray(v, (rows, count))
    S = carray(out, (rows, count))
    for q in range(count):
        u0, u1, u2, u3, u4, u5, v0, v1, v2, v3, v4, v5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], v[0, q], v[1, q], v[2, q], v[3, q], v[4, q], v[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = s0*s3*(beta*(u0*v0 + u1*v1 + u2*v2) + (0.5)*(u0 * u0) + (0.5)*(u1 * u1) + (0.5)*(u2 * u2) - 0.5)
        x1 = (u3 * u3) + (u4 * u4) + (u5 * u5)
        x2 = s2/(math.sqrt(1.0e-12*(s2 * s2) + x1 + 1.0e-60)) - 1.0
        x3 = s0/s1
        x4 = 1.25e-7*x3
        x5 = 2.0*u3*v3 + 2.0*u4*v4 + 2.0*u5*v5
        x6 = (0.5)*beta/(x1 + 6.25e-8*x3)
        x7 = s1*s3
        S[0, q] = u0*x0
        S[1, q] = u1*x0
        S[2, q] = u2*x0
        S[3, q] = x7*(-u3*x2 + x6*(u3*x5 + v3*x4))
        S[4, q] = x7*(-u4*x2 + x6*(u4*x5 + v4*x4))
        S[5, q] = x7*(-u5*x2 + x6*(u5*x5 + v5*x4))


@entry
def quadratic_3_viscosity(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D, T = carray(out, (rows, rows, count)), np.empty((21, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u0, u1, u2, u3, u4, u5, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[3, q]
            x0 = beta*s3
            x1 = s0*x0
            x2 = u0*x1
            x3 = (u3 * u3)
            x4 = s0/s1
            x5 = 1.25e-7*x4
            x6 = (u4 * u4)
            x7 = (u5 * u5)
            x8 = s1*x0/(x3 + 6.25e-8*x4 + x6 + x7)
            x9 = (0.5)*x8
            x10 = u3*x8
            T[0, k] = (u0 * u0)*x1
            T[1, k] = u1*x2
            T[2, k] = (u1 * u1)*x1
            T[3, k] = u2*x2
            T[4, k] = u1*u2*x1
            T[5, k] = (u2 * u2)*x1
            T[6, k] = 0.0
            T[7, k] = 0.0
            T[8, k] = 0.0
            T[9, k] = x9*(2.0*x3 + x5)
            T[10, k] = 0.0
            T[11, k] = 0.0
            T[12, k] = 0.0
            T[13, k] = u4*x10
            T[14, k] = x9*(x5 + 2.0*x6)
            T[15, k] = 0.0
            T[16, k] = 0.0
            T[17, k] = 0.0
            T[18, k] = u5*x10
            T[19, k] = u4*u5*x8
            T[20, k] = x9*(x5 + 2.0*x7)
        unfold(T, first, D, True)


@entry
def quadratic_3_dissipation(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    v = carray(v, (rows, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, u4, u5, v0, v1, v2, v3, v4, v5, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], v[0, q], v[1, q], v[2, q], v[3, q], v[4, q], v[5, q], s[0, q], s[1, q], s[3, q]
        x0 = 6.25e-8*s0/s1
        W[q] = s3*(s0*((u0*v0 + u1*v1 + u2*v2) * (u0*v0 + u1*v1 + u2*v2)) + s1*(x0*((v3 * v3) + (v4 * v4) + (v5 * v5)) + ((u3*v3 + u4*v4 + u5*v5) * (u3*v3 + u4*v4 + u5*v5)))/((u3 * u3) + (u4 * u4) + (u5 * u5) + x0))
