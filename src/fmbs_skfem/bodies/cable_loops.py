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
def planar_2_damped_modulus(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D = carray(out, (rows, rows, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0)
        x1 = u0*u3
        x2 = u1*u2
        x3 = x1 - x2
        x4 = (u1 * u1)
        x5 = x0 + x4
        x6 = (1.0 / (x5))
        x7 = x3*x6
        x8 = option*x7
        x9 = u0*x8 - u3
        x10 = fall(x5, option)
        x11 = s1*(x10 * x10)
        x12 = s0*x0 + x11*(x9 * x9)
        x13 = (0.5)*s0*(x5 - 1.0)
        x14 = 2.0*x7
        x15 = s2 - x10*x3
        x16 = option*x15*x6
        x17 = s1*x10
        x18 = x16*x17
        x19 = u0*u1
        x20 = u1*x8 + u2
        x21 = s0*x19 + x11*x20*x9
        x22 = s0*x4 + x11*(x20 * x20)
        x23 = x10*x9
        x24 = beta*x23
        x25 = s3*x17
        x26 = x10*x20
        x27 = u1*x26
        x28 = s3*x11*(beta + 1.0)
        D[0, 0, q] = D[0, 0, q] = s3*(beta*x12 + x12 + x13 - x18*(x0*x14 + x0*x8 - 3.0*x1 + x2))
        D[1, 0, q] = D[0, 1, q] = s3*(beta*x21 - x18*(u0*u2 - u1*u3 + x14*x19 + x19*x8) + x21)
        D[1, 1, q] = D[1, 1, q] = s3*(beta*x22 + x13 - x18*(-x1 + x14*x4 + 3.0*x2 + x4*x8) + x22)
        D[2, 0, q] = D[0, 2, q] = -u1*x25*(option*u0*x15*x6 - x23 - x24)
        D[2, 1, q] = D[1, 2, q] = -x25*(-beta*x27 + option*x15*x4*x6 - x15 - x27)
        D[2, 2, q] = D[2, 2, q] = x28*x4
        D[3, 0, q] = D[0, 3, q] = -x25*(u0*x23 + u0*x24 - x0*x16 + x15)
        D[3, 1, q] = D[1, 3, q] = -u0*x25*(beta*x26 - u1*x16 + x26)
        D[3, 2, q] = D[2, 3, q] = -x19*x28
        D[3, 3, q] = D[3, 3, q] = x0*x28


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
        unfold(T, first, D)


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
def spatial_3_damped_modulus(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D, T = carray(out, (rows, rows, count)), np.empty((21, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
            x0 = (u0 * u0)
            x1 = s0*x0
            x2 = (u1 * u1)
            x3 = (u2 * u2)
            x4 = x2 + x3
            x5 = x0 + x4
            x6 = (0.5)*s0*(x5 - 1.0)
            x7 = -u5
            x8 = u0*u5
            x9 = u2*u3
            x10 = x8 - x9
            x11 = u0*x10
            x12 = (1.0 / (x5))
            x13 = option*x12
            x14 = x11*x13 + x7
            x15 = (1.0 / (x5 * x5))
            x16 = (option * option)*x15
            x17 = u1*u5
            x18 = u2*u4
            x19 = x17 - x18
            x20 = (x19 * x19)
            x21 = x0*x20
            x22 = x16*x21
            x23 = u0*u4
            x24 = u1*u3
            x25 = x23 - x24
            x26 = u0*x25
            x27 = x13*x26
            x28 = -u4 + x27
            x29 = s0/s1
            x30 = 1.25e-7*x29
            x31 = x13*x20
            x32 = u0*x31
            x33 = -x10
            x34 = u0*x33
            x35 = u5 + x13*x34
            x36 = -x10*x35 + x25*x28 + x32
            x37 = ((fall(x5, option)) * (fall(x5, option)))
            x38 = 2.0*x37
            x39 = (x10 * x10)
            x40 = (x25 * x25)
            x41 = x20*x37 + x37*x40
            x42 = x37*x39 + x41
            x43 = (1.0 / ((6.25e-8*x29 + x42)))
            x44 = s1*x37
            x45 = x43*x44
            x46 = (0.5)*beta
            x47 = (u4 * u4)
            x48 = 2.0*x0
            x49 = option*x15
            x50 = x48*x49
            x51 = 2.0*x49
            x52 = x16*x40
            x53 = x16*x39
            x54 = x13*x25
            x55 = 4.0*x54
            x56 = x10*x13
            x57 = 4.0*x56
            x58 = x13*x40
            x59 = -x58
            x60 = x13*x39
            x61 = -x60
            x62 = -x31
            x63 = (u5 * u5) + x59 + x61 + x62
            x64 = x21*x51 + 2.0*x22 - x23*x55 + x39*x50 + x40*x50 + x47 + x48*x52 + x48*x53 - x57*x8 + x63
            x65 = 1.0e-12*(s2 * s2) + 1.0e-60
            x66 = x42 + x65
            x67 = (1.0 / (math.sqrt(x66)))
            x68 = s2*x67
            x69 = u4*x25
            x70 = u5*x10
            x71 = u0*x58 + u0*x60 + x32 - x69 - x70
            x72 = s2*x37
            x73 = x72/(x66 * math.sqrt(x66))
            x74 = u0*u1
            x75 = s0*x74
            x76 = u1*x19
            x77 = x13*x76
            x78 = x7 + x77
            x79 = -x78
            x80 = u0*x13
            x81 = u1*x13
            x82 = x33*x81
            x83 = u1*x25
            x84 = x13*x83
            x85 = u3 + x84
            x86 = -x28
            x87 = u1*x60
            x88 = x25*x85
            x89 = x19*x78 + x87 + x88
            x90 = -x36*x38
            x91 = u3*x25
            x92 = 2.0*x80
            x93 = 2.0*x8
            x94 = x13*x19
            x95 = 2.0*x81
            x96 = 2.0*x17
            x97 = x51*x74
            x98 = 2.0*x74
            x99 = x16*x20
            x100 = -u3*u4 + x20*x97 + x39*x97 + x40*x97 + x52*x98 + x53*x98 - x56*x96 - x69*x95 + x91*x92 - x93*x94 + x98*x99
            x101 = u5*x19
            x102 = u1*x31 + u1*x58 - x101 + x87 + x91
            x103 = x71*x73
            x104 = s0*x2
            x105 = x2*x53
            x106 = (u3 * u3)
            x107 = x2*x51
            x108 = 2.0*x2
            x109 = 4.0*x94
            x110 = 2.0*x105 + x106 + x107*x20 + x107*x39 + x107*x40 + x108*x52 + x108*x99 - x109*x17 + x24*x55 + x63
            x111 = u0*u2
            x112 = s0*x111
            x113 = u2*x19
            x114 = x113*x13
            x115 = u4 + x114
            x116 = x115*x19
            x117 = u2*x13
            x118 = u2*x33
            x119 = x118*x13
            x120 = -u3 + x119
            x121 = -x120
            x122 = u2*x58
            x123 = -x10*x120 + x116 + x122
            x124 = -x123
            x125 = u3*x10
            x126 = 2.0*x18
            x127 = 2.0*x117
            x128 = x111*x51
            x129 = 2.0*x111
            x130 = -u3*u5 + x125*x92 - x126*x54 - x127*x70 + x128*x20 + x128*x39 + x128*x40 + x129*x52 + x129*x53 + x129*x99 + 2.0*x23*x94
            x131 = u4*x19
            x132 = u2*x31 + u2*x60 + x122 + x125 + x131
            x133 = u1*u2
            x134 = s0*x133
            x135 = x38*x89
            x136 = 2.0*x24
            x137 = 2.0*x9
            x138 = x133*x51
            x139 = 2.0*x133
            x140 = -u4*u5 - x101*x127 + x131*x95 + x136*x56 + x137*x54 + x138*x20 + x138*x39 + x138*x40 + x139*x52 + x139*x53 + x139*x99
            x141 = x102*x73
            x142 = s0*x3
            x143 = u2*x10
            x144 = x13*x143
            x145 = x3*x52
            x146 = x3*x51
            x147 = 2.0*x3
            x148 = x106 + x109*x18 + 2.0*x145 + x146*x20 + x146*x39 + x146*x40 + x147*x53 + x147*x99 + x47 + x57*x9 + x59 + x61 + x62
            x149 = 2.0*u0
            x150 = x149*x84
            x151 = x144*x149
            x152 = u1*u4
            x153 = u2*u5
            x154 = x119*x149
            x155 = -x118 + x83
            x156 = s3*x44
            x157 = 2.0*u1
            x158 = x108*x54 + x136 + x144*x157 - x23
            x159 = u1*x30
            x160 = u2*x30
            x161 = x143 + x83
            x162 = x43*x46
            x163 = 2.0*u2
            x164 = x13*x147
            x165 = x10*x164 + x137 + x163*x84 - x8
            x166 = x161*x73
            x167 = -2.0*option*u0*u2*x12*x19 - 2.0*u0*u4 + x24 + x48*x54
            x168 = x115 - x27
            x169 = u0*x30
            x170 = -x113 + x26
            x171 = x170*x38
            x172 = u0*u3
            x173 = x114*x157
            x174 = x150 + x153 + x172 - x173
            x175 = -x126 + x163*x27 - x164*x19 + x17
            x176 = x132*x73
            x177 = (x33 * x33)*x37 + x41 + x65
            x178 = s2/(math.sqrt(x177))
            x179 = x72/(x177 * math.sqrt(x177))
            x180 = x155*x179
            x181 = -x155
            x182 = x0 + x3
            x183 = (x170 * x170)
            x184 = x48*x56 + x9 - x93 + x94*x98
            x185 = x34 - x76
            x186 = x108*x94 + x18 + x56*x98 - x96
            x187 = x11 + x76
            x188 = x152 + x172 + x173
            x189 = -x185
            x190 = x0 + x2
            T[0, k] = s3*(x1 + x44*(-x64*x68 + x64 + (x71 * x71)*x73) + x46*(2.0*x1 + x45*(x30*((x14 * x14) + x22 + (x28 * x28)) + (x36 * x36)*x38)) + x6)
            T[1, k] = s3*(x44*(-x100*x68 + x100 + x102*x103) + x46*(-x45*(x30*(x19*x79*x80 - x35*x82 + x85*x86) + x89*x90) + 2.0*x75) + x75)
            T[2, k] = s3*(x104 + x44*((x102 * x102)*x73 - x110*x68 + x110) + x46*(2.0*x104 + x45*(x30*(x105 + (x78 * x78) + (x85 * x85)) + x38*(x89 * x89))) + x6)
            T[3, k] = s3*(x112 + x44*(x103*x132 - x130*x68 + x130) + x46*(2.0*x112 - x45*(-x124*x90 + x30*(-x116*x80 + x117*x25*x86 + x121*x35))))
            T[4, k] = s3*(x134 + x44*(x132*x141 - x140*x68 + x140) + x46*(2.0*x134 - x45*(x124*x135 + x30*(x115*x79 - x117*x88 + x121*x82))))
            T[5, k] = s3*(x142 + x44*((x132 * x132)*x73 - x148*x68 + x148) + x46*(2.0*x142 + x45*((x123 * x123)*x38 + x30*((x115 * x115) + x145 + ((u3 + x144) * (u3 + x144))))) + x6)
            T[6, k] = -x156*((0.5)*beta*x43*(x155*x90 + x30*(u1*x86 + u2*x35)) + u1*u4 + u2*u5 - x103*x155 - x150 - x151 - x68*(-x150 + x152 + x153 + x154))
            T[7, k] = -x156*((0.5)*beta*x43*(-x135*x155 + x159*(x119 - x85)) + s2*x158*x67 - x141*x155 - x158)
            T[8, k] = x156*(x132*x166 + x162*(x123*x161*x38 + x160*(x144 + x85)) - x165*x68 + x165)
            T[9, k] = x156*(x155*x166 + x162*((x161 * x161)*x38 + x30*x4) - x4*x68 + x4)
            T[10, k] = x156*((0.5)*beta*x43*(x168*x169 - x171*x36) - x103*x170 + x167*x68 - x167)
            T[11, k] = -x156*(x141*x170 + x162*(x135*x170 + x30*(u0*x85 - u2*x78)) - x174*x68 + x174)
            T[12, k] = -x156*(x162*(-x124*x171 - x160*x168) + x170*x176 - x175*x68 + x175)
            T[13, k] = -x156*(x162*(-x171*x181 + x30*x74) + x170*x180 - x178*x74 + x74)
            T[14, k] = x156*(x162*(x182*x30 + x183*x38) - x182*x68 + x182 + x183*x73)
            T[15, k] = -x156*(-x103*x185 + x162*(x169*(-x35 + x77) + x185*x90) - x184*x68 + x184)
            T[16, k] = -x156*(-x141*x185 + x162*(x135*x187 + x159*(x14 + x77)) - x186*x68 + x186)
            T[17, k] = -x156*(x151 + x162*(x124*x185*x38 + x30*(u0*x121 + u1*x115)) - x176*x185 + x188 - x68*(-x154 + x188))
            T[18, k] = -x156*(-x111*x178 + x111 + x162*(x111*x30 - x181*x189*x38) + x180*x189)
            T[19, k] = -x156*(-x133*x178 + x133 + x162*(x133*x30 - x171*x189) - x170*x179*x189)
            T[20, k] = x156*(x162*((x187 * x187)*x38 + x190*x30) - x185*x187*x73 - x190*x68 + x190)
        unfold(T, first, D)


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
def quadratic_2_damped_modulus(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D = carray(out, (rows, rows, count))
    for q in range(count):
        u0, u1, u2, u3, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], s[0, q], s[1, q], s[2, q], s[3, q]
        x0 = (u0 * u0)
        x1 = (u1 * u1)
        x2 = s0*s3
        x3 = (u2 * u2)
        x4 = (u3 * u3)
        x5 = x3 + x4
        x6 = 1.0e-12*(s2 * s2) + x5 + 1.0e-60
        x7 = s2/(x6 * math.sqrt(x6))
        x8 = s0/s1
        x9 = 1.25e-7*x8
        x10 = beta/(x5 + 6.25e-8*x8)
        x11 = (0.5)*x10
        x12 = -s2/(math.sqrt(x6)) + 1.0
        x13 = s1*s3
        D[0, 0, q] = D[0, 0, q] = x2*(beta*x0 + (1.5)*x0 + (0.5)*x1 - 0.5)
        D[1, 0, q] = D[0, 1, q] = u0*u1*x2*(beta + 1.0)
        D[1, 1, q] = D[1, 1, q] = x2*(beta*x1 + (0.5)*x0 + (1.5)*x1 - 0.5)
        D[2, 0, q] = D[0, 2, q] = 0.0
        D[2, 1, q] = D[1, 2, q] = 0.0
        D[2, 2, q] = D[2, 2, q] = x13*(x11*(2.0*x3 + x9) + x12 + x3*x7)
        D[3, 0, q] = D[0, 3, q] = 0.0
        D[3, 1, q] = D[1, 3, q] = 0.0
        D[3, 2, q] = D[2, 3, q] = u2*u3*x13*(x10 + x7)
        D[3, 3, q] = D[3, 3, q] = x13*(x11*(2.0*x4 + x9) + x12 + x4*x7)


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
        unfold(T, first, D)


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
def quadratic_3_damped_modulus(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    D, T = carray(out, (rows, rows, count)), np.empty((21, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            u0, u1, u2, u3, u4, u5, s0, s1, s2, s3 = u[0, q], u[1, q], u[2, q], u[3, q], u[4, q], u[5, q], s[0, q], s[1, q], s[2, q], s[3, q]
            x0 = (u1 * u1)
            x1 = (0.5)*x0
            x2 = (u0 * u0)
            x3 = (u2 * u2)
            x4 = (0.5)*x3 - 0.5
            x5 = s0*s3
            x6 = beta + 1.0
            x7 = u0*x5*x6
            x8 = (0.5)*x2
            x9 = (u3 * u3)
            x10 = (u4 * u4)
            x11 = (u5 * u5)
            x12 = x10 + x11 + x9
            x13 = 1.0e-12*(s2 * s2) + x12 + 1.0e-60
            x14 = s2/(x13 * math.sqrt(x13))
            x15 = s0/s1
            x16 = 1.25e-7*x15
            x17 = beta/(x12 + 6.25e-8*x15)
            x18 = (0.5)*x17
            x19 = -s2/(math.sqrt(x13)) + 1.0
            x20 = s1*s3
            x21 = x14 + x17
            x22 = u3*x20*x21
            T[0, k] = x5*(beta*x2 + x1 + (1.5)*x2 + x4)
            T[1, k] = u1*x7
            T[2, k] = x5*(beta*x0 + (1.5)*x0 + x4 + x8)
            T[3, k] = u2*x7
            T[4, k] = u1*u2*x5*x6
            T[5, k] = x5*(beta*x3 + x1 + (1.5)*x3 + x8 - 0.5)
            T[6, k] = 0.0
            T[7, k] = 0.0
            T[8, k] = 0.0
            T[9, k] = x20*(x14*x9 + x18*(x16 + 2.0*x9) + x19)
            T[10, k] = 0.0
            T[11, k] = 0.0
            T[12, k] = 0.0
            T[13, k] = u4*x22
            T[14, k] = x20*(x10*x14 + x18*(2.0*x10 + x16) + x19)
            T[15, k] = 0.0
            T[16, k] = 0.0
            T[17, k] = 0.0
            T[18, k] = u5*x22
            T[19, k] = u4*u5*x20*x21
            T[20, k] = x20*(x11*x14 + x18*(2.0*x11 + x16) + x19)
        unfold(T, first, D)


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
