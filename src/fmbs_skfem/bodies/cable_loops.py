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
        x6 = (1.0 / (x1))
        x7 = option*x6
        x8 = u0*x7
        x9 = u1*u5 - u2*u4
        x10 = (x9 * x9)
        x11 = x10*x8
        x12 = u0*u4 - u1*u3
        x13 = (x12 * x12)
        x14 = -u4*x12 + x11 + x13*x8
        x15 = ((fall(x1, option)) * (fall(x1, option)))
        x16 = (x3 * x3)
        x17 = x10*x15 + x13*x15 + x15*x16
        x18 = s2/(math.sqrt(1.0e-12*(s2 * s2) + x17 + 1.0e-60))
        x19 = s1*x15
        x20 = u0*v0
        x21 = u2*v2
        x22 = 2.0*u1*v1 + 2.0*x20 + 2.0*x21
        x23 = u2*x9
        x24 = u4 + x23*x7
        x25 = u1*x9
        x26 = -u5 + x25*x7
        x27 = -u1*v5 + u2*v4 + v1*x26 + v2*x24 + x20*x7*x9
        x28 = -x27
        x29 = x28*x9
        x30 = u0*x4
        x31 = u5 + x30*x7
        x32 = u2*x4
        x33 = -u3 + x32*x7
        x34 = -option*u1*v1*x3*x6 + u0*v5 - u2*v3 + v0*x31 + v2*x33
        x35 = -x34
        x36 = 0.02*x35
        x37 = u0*x12
        x38 = -u4 + x37*x7
        x39 = u1*x12
        x40 = u3 + x39*x7
        x41 = -u0*v4 + u1*v3 + v0*x38 + v1*x40 + x12*x21*x7
        x42 = -x41
        x43 = 0.02*x42
        x44 = x12*x42
        x45 = 2.0*x15
        x46 = x45*(x29 - x3*x35 + x44)
        x47 = (1.0 / ((x17 + 0.01)))
        x48 = x19*x47
        x49 = (0.5)*beta
        x50 = s0*u1
        x51 = u1*x7
        x52 = x16*x51
        x53 = u3*x12 - u5*x9 + x10*x51 + x13*x51
        x54 = x45*(-x12*x41 - x27*x9 + x3*x34)
        x55 = s0*u2
        x56 = u2*x7
        x57 = x13*x56
        x58 = u4*x9 + x10*x56 + x57
        x59 = 0.02*x28
        x60 = -x32 + x39
        x61 = x47*x49
        x62 = s3*x19
        x63 = -x23 + x37
        x64 = -x25 + x30
        S[0, q] = s3*(x0*x2 - x19*(-u5*x3 + x14 + x16*x8 - x18*(u5*x4 + x14 + x5*x8)) + x49*(x0*x22 - x48*(0.02*x29*x8 + x31*x36 + x38*x43 - x46*(-x11 - x12*x38 + x3*x31))))
        S[1, q] = s3*(-x19*(-x18*(x5*x51 + x53) + x52 + x53) + x2*x50 + x49*(x22*x50 + x48*(0.02*x26*x27 - 0.02*x3*x34*x51 + 0.02*x40*x41 - x54*(x12*x40 + x26*x9 + x52))))
        S[2, q] = s3*(-x19*(u3*x3 + x16*x56 - x18*(-u3*x4 + x5*x56 + x58) + x58) + x2*x55 + x49*(x22*x55 - x48*(x24*x59 + x33*x36 + 0.02*x44*x56 - x46*(-x24*x9 + x3*x33 - x57))))
        S[3, q] = -x62*(u2*x3 - x18*x60 + x39 + x61*(u1*x43 - u2*x36 + x46*x60))
        S[4, q] = x62*(-x18*x63 + x61*(-0.02*u0*x41 + 0.02*u2*x27 + x54*x63) + x63)
        S[5, q] = x62*(u0*x3 + x18*x64 + x25 - x61*(u0*x36 - u1*x59 + x46*x64))


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
            x7 = 0.02*x0
            x8 = (option * option)
            x9 = u1*u5
            x10 = u2*u4
            x11 = -x10 + x9
            x12 = (x11 * x11)
            x13 = (1.0 / (x5 * x5))
            x14 = x12*x13
            x15 = x14*x8
            x16 = -u5
            x17 = u0*u5
            x18 = u2*u3
            x19 = -x18
            x20 = x17 + x19
            x21 = u0*x20
            x22 = (1.0 / (x5))
            x23 = option*x22
            x24 = u0*u4
            x25 = u1*u3
            x26 = x24 - x25
            x27 = u0*x26
            x28 = x23*x27
            x29 = -u4 + x28
            x30 = x12*x23
            x31 = u0*x30
            x32 = -x20
            x33 = u0*x32
            x34 = u5 + x23*x33
            x35 = x26*x29
            x36 = -x20*x34 + x31 + x35
            x37 = ((fall(x5, option)) * (fall(x5, option)))
            x38 = 2.0*x37
            x39 = (x20 * x20)
            x40 = (x26 * x26)
            x41 = x12*x37 + x37*x40
            x42 = x37*x39 + x41
            x43 = (1.0 / ((x42 + 0.01)))
            x44 = s1*x37
            x45 = x43*x44
            x46 = (0.5)*beta
            x47 = (u4 * u4)
            x48 = x13*x40
            x49 = 2.0*x0
            x50 = option*x49
            x51 = x13*x39
            x52 = x49*x8
            x53 = x23*x26
            x54 = 4.0*x53
            x55 = x20*x23
            x56 = 4.0*x55
            x57 = x23*x40
            x58 = -x57
            x59 = x23*x39
            x60 = -x59
            x61 = -x30
            x62 = (u5 * u5) + x58 + x60 + x61
            x63 = x14*x50 + x15*x49 - x17*x56 - x24*x54 + x47 + x48*x50 + x48*x52 + x50*x51 + x51*x52 + x62
            x64 = 1.0e-12*(s2 * s2) + 1.0e-60
            x65 = x42 + x64
            x66 = (1.0 / (math.sqrt(x65)))
            x67 = s2*x66
            x68 = u5*x20
            x69 = u4*x26
            x70 = u0*x57 + x31 - x69
            x71 = u0*x59 - x68 + x70
            x72 = s2*x37
            x73 = x72/(x65 * math.sqrt(x65))
            x74 = u0*u1
            x75 = s0*x74
            x76 = u1*x11
            x77 = x16 + x23*x76
            x78 = x11*x77
            x79 = 0.02*u0
            x80 = x23*x79
            x81 = u1*x26
            x82 = x23*x81
            x83 = u3 + x82
            x84 = 0.02*x29
            x85 = u1*x59
            x86 = x26*x83
            x87 = x78 + x85 + x86
            x88 = -x36
            x89 = u3*x26
            x90 = 2.0*x23
            x91 = u0*x90
            x92 = 2.0*x17
            x93 = x11*x23
            x94 = u1*x90
            x95 = 2.0*x9
            x96 = 2.0*x74
            x97 = option*x96
            x98 = x48*x8
            x99 = x51*x8
            x100 = -u3*u4 + x14*x97 + x15*x96 + x48*x97 + x51*x97 - x55*x95 - x69*x94 + x89*x91 - x92*x93 + x96*x98 + x96*x99
            x101 = u5*x11
            x102 = u1*x30 + u1*x57 - x101 + x89
            x103 = x102 + x85
            x104 = x71*x73
            x105 = s0*x2
            x106 = 0.02*x2
            x107 = (u3 * u3)
            x108 = 2.0*x2
            x109 = option*x108
            x110 = 4.0*x93
            x111 = x107 + x108*x15 + x108*x98 + x108*x99 + x109*x14 + x109*x48 + x109*x51 - x110*x9 + x25*x54 + x62
            x112 = u0*u2
            x113 = s0*x112
            x114 = u2*x11
            x115 = x114*x23
            x116 = u4 + x115
            x117 = x11*x116
            x118 = 0.02*u2
            x119 = x118*x23
            x120 = u2*x32
            x121 = x120*x23
            x122 = -u3 + x121
            x123 = 0.02*x34
            x124 = u2*x57
            x125 = x117 + x124
            x126 = -x122*x20 + x125
            x127 = -x126
            x128 = x38*x88
            x129 = u3*x20
            x130 = 2.0*x10
            x131 = u2*x90
            x132 = 2.0*x112
            x133 = option*x132
            x134 = -u3*u5 + x129*x91 - x130*x53 - x131*x68 + x132*x15 + x132*x98 + x132*x99 + x133*x14 + x133*x48 + x133*x51 + 2.0*x24*x93
            x135 = u4*x11
            x136 = u2*x30 + x124 + x135
            x137 = u2*x59 + x129 + x136
            x138 = u1*u2
            x139 = s0*x138
            x140 = 0.02*u1
            x141 = 0.02*x77
            x142 = x127*x38
            x143 = 2.0*x25
            x144 = 2.0*x18
            x145 = 2.0*x138
            x146 = option*x145
            x147 = -u4*u5 - x101*x131 + x135*x94 + x14*x146 + x143*x55 + x144*x53 + x145*x15 + x145*x98 + x145*x99 + x146*x48 + x146*x51
            x148 = x137*x73
            x149 = s0*x3
            x150 = u2*x20
            x151 = x150*x23
            x152 = 0.02*x3
            x153 = 2.0*x3
            x154 = option*x153
            x155 = x10*x110 + x107 + x14*x154 + x15*x153 + x153*x98 + x153*x99 + x154*x48 + x154*x51 + x18*x56 + x47 + x58 + x60 + x61
            x156 = u2*u5
            x157 = 2.0*u0
            x158 = x157*x82
            x159 = x151*x157
            x160 = u1*u4
            x161 = x121*x157
            x162 = -x120 + x81
            x163 = s3*x44
            x164 = 2.0*u1
            x165 = x121*x164
            x166 = x108*x53
            x167 = (x32 * x32)
            x168 = x167*x37 + x41 + x64
            x169 = s2/(math.sqrt(x168))
            x170 = -x162
            x171 = x167*x23
            x172 = u1*x171
            x173 = x72/(x168 * math.sqrt(x168))
            x174 = 0.02*x83
            x175 = x170*x38
            x176 = x43*x46
            x177 = 2.0*u2
            x178 = x153*x23
            x179 = x144 - x17 + x177*x82 + x178*x20
            x180 = x150 + x81
            x181 = -2.0*option*u0*u2*x11*x22 - 2.0*u0*u4 + x25 + x49*x53
            x182 = -x114 + x27
            x183 = x182*x38
            x184 = u0*u3
            x185 = x115*x164
            x186 = x156 + x158 + x184 - x185
            x187 = x103*x73
            x188 = -x11*x178 - x130 + x177*x28 + x9
            x189 = x173*x182
            x190 = 0.02*x74
            x191 = (x182 * x182)
            x192 = x0 + x3
            x193 = x93*x96
            x194 = x23*x32*x49
            x195 = -u1*x11 + x33
            x196 = -x195
            x197 = x173*x196
            x198 = x10 + x108*x93 + x55*x96 - x95
            x199 = x160 + x184 + x185
            x200 = x21 + x76
            x201 = x0 + x2
            T[0, k] = s3*(x1 + x44*(-x63*x67 + x63 + (x71 * x71)*x73) + x46*(2.0*x1 + x45*(x15*x7 + 0.02*(x29 * x29) + (x36 * x36)*x38 + 0.02*((-x16 - x21*x23) * (-x16 - x21*x23)))) + x6)
            T[1, k] = s3*(x44*(-x100*x67 + x100 + x103*x104) + x46*(-x45*(0.02*option*u1*x20*x22*x34 + 2.0*x37*x87*x88 - x78*x80 - x83*x84) + 2.0*x75) + x75)
            T[2, k] = s3*(x105 + x44*((x103 * x103)*x73 - x111*x67 + x111) + x46*(2.0*x105 + x45*(x106*x99 + x38*(x87 * x87) + 0.02*(x77 * x77) + 0.02*(x83 * x83))) + x6)
            T[3, k] = s3*(x113 + x44*(x104*x137 - x134*x67 + x134) + x46*(2.0*x113 + x45*(x117*x80 + x119*x35 + x122*x123 + x127*x128)))
            T[4, k] = s3*(x139 + x44*(x103*x148 - x147*x67 + x147) + x46*(2.0*x139 - x45*(-x116*x141 - x119*x86 + x122*x140*x20*x23 + x142*x87)))
            T[5, k] = s3*(x149 + x44*((x137 * x137)*x73 - x155*x67 + x155) + x46*(2.0*x149 + x45*(0.02*(x116 * x116) + (x126 * x126)*x38 + x152*x98 + 0.02*((u3 + x151) * (u3 + x151)))) + x6)
            T[6, k] = -x163*((0.5)*beta*x43*(-u1*x84 + u2*x123 + x128*x162) + u1*u4 - x104*x162 + x156 - x158 - x159 - x67*(x156 - x158 + x160 + x161))
            T[7, k] = -x163*(-x143 + x165 - x166 + x169*(x143 - x165 + x166 - x24) + x170*x173*(x102 + x172) + x176*(0.02*option*u1*u2*x22*x32 - u1*x174 - x175*(-x11*x77 - x172 - x86)) + x24)
            T[8, k] = x163*(x148*x180 - x176*(x118*x122 - x118*x82 + x142*x162) - x179*x67 + x179)
            T[9, k] = x163*(x162*x180*x73 + x176*(x106 + x152 + (x180 * x180)*x38) - x4*x67 + x4)
            T[10, k] = x163*((0.5)*beta*x43*(0.02*option*u0*u2*x11*x22 - u0*x84 - x183*x36) - x104*x182 + x181*x67 - x181)
            T[11, k] = x163*((0.5)*beta*x43*(-u0*x174 + 0.02*u2*x77 - x183*x87) + s2*x186*x66 - x182*x187 - x186)
            T[12, k] = -x163*(-x169*x188 + x176*(0.02*option*u0*u2*x22*x26 - x116*x118 - x183*(-x122*x32 - x125)) + x188 + x189*(u2*x171 - u3*x32 + x136))
            T[13, k] = -x163*(x162*x189 - x169*x74 + x176*(-x175*x182 + x190) + x74)
            T[14, k] = x163*(x176*(x152 + x191*x38 + x7) + x191*x73 - x192*x67 + x192)
            T[15, k] = -x163*(x169*(x19 - x193 + x194 + x92) + x176*(0.02*option*u0*u1*x11*x22 - u0*x123 - x196*x38*(-x26*x29 - x31 - x32*x34)) + x18 + x193 - x194 + x197*(u0*x171 + u5*x32 + x70) - x92)
            T[16, k] = -x163*(x176*(u1*x141 + x190*x55 - x195*x38*x87) - x187*x195 - x198*x67 + x198)
            T[17, k] = -x163*(-x148*x195 + x159 + x176*(x116*x140 - x122*x79 + x142*x195) + x199 - x67*(-x161 + x199))
            T[18, k] = -x163*(-x112*x169 + x112 + x162*x197 + x176*(0.02*x112 - x175*x196))
            T[19, k] = -x163*(-x138*x169 + x138 + x176*(0.02*x138 - x183*x196) - x182*x197)
            T[20, k] = x163*(x176*(x106 + (x200 * x200)*x38 + x7) - x195*x200*x73 - x201*x67 + x201)
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
        x5 = u0*u4 - u1*u3
        x6 = u0*u5 - u2*u3
        x7 = u1*u5 - u2*u4
        x8 = option/x3
        x9 = x7*x8
        x10 = -u1*v5 + u2*v4 + v1*(u1*x9 - u5) + v2*(u2*x9 + u4) + x0*x9
        x11 = x5*x8
        x12 = -u0*v4 + u1*v3 + v0*(u0*x11 - u4) + v1*(u1*x11 + u3) + x11*x2
        x13 = -x6*x8
        x14 = u0*v5 - u2*v3 + v0*(u0*x13 + u5) + v2*(u2*x13 - u3) - x1*x6*x8
        W[q] = s3*(s0*((x0 + x1 + x2) * (x0 + x1 + x2)) + s1*x4*(0.01*(x10 * x10) + 0.01*(x12 * x12) + 0.01*(x14 * x14) + x4*((-x10*x7 - x12*x5 + x14*x6) * (-x10*x7 - x12*x5 + x14*x6)))/(x4*(x5 * x5) + x4*(x6 * x6) + x4*(x7 * x7) + 0.01))


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
        x3 = 2.0*u2*v2 + 2.0*u3*v3
        x4 = (0.5)*beta/(x1 + 0.01)
        x5 = s1*s3
        S[0, q] = u0*x0
        S[1, q] = u1*x0
        S[2, q] = x5*(-u2*x2 + x4*(u2*x3 + 0.02*v2))
        S[3, q] = x5*(-u3*x2 + x4*(u3*x3 + 0.02*v3))


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
        x8 = beta/(x5 + 0.01)
        x9 = (0.5)*x8
        x10 = -s2/(math.sqrt(x6)) + 1.0
        x11 = s1*s3
        D[0, 0, q] = D[0, 0, q] = x2*(beta*x0 + (1.5)*x0 + (0.5)*x1 - 0.5)
        D[1, 0, q] = D[0, 1, q] = u0*u1*x2*(beta + 1.0)
        D[1, 1, q] = D[1, 1, q] = x2*(beta*x1 + (0.5)*x0 + (1.5)*x1 - 0.5)
        D[2, 0, q] = D[0, 2, q] = 0.0
        D[2, 1, q] = D[1, 2, q] = 0.0
        D[2, 2, q] = D[2, 2, q] = x11*(x10 + x3*x7 + x9*(2.0*x3 + 0.02))
        D[3, 0, q] = D[0, 3, q] = 0.0
        D[3, 1, q] = D[1, 3, q] = 0.0
        D[3, 2, q] = D[2, 3, q] = u2*u3*x11*(x7 + x8)
        D[3, 3, q] = D[3, 3, q] = x11*(x10 + x4*x7 + x9*(2.0*x4 + 0.02))


@entry
def quadratic_2_dissipation(u: Any, v: Any, s: Any, out: Any, rows: int, points: int, cells: int, option: int, beta: float) -> None:
    count = points * cells
    u = carray(u, (rows, count))
    s = carray(s, (4, count))
    v = carray(v, (rows, count))
    W = carray(out, count)
    for q in range(count):
        u0, u1, u2, u3, v0, v1, v2, v3, s0, s1, s3 = u[0, q], u[1, q], u[2, q], u[3, q], v[0, q], v[1, q], v[2, q], v[3, q], s[0, q], s[1, q], s[3, q]
        W[q] = s3*(s0*((u0*v0 + u1*v1) * (u0*v0 + u1*v1)) + s1*(0.01*(v2 * v2) + 0.01*(v3 * v3) + ((u2*v2 + u3*v3) * (u2*v2 + u3*v3)))/((u2 * u2) + (u3 * u3) + 0.01))


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
        x3 = 2.0*u3*v3 + 2.0*u4*v4 + 2.0*u5*v5
        x4 = (0.5)*beta/(x1 + 0.01)
        x5 = s1*s3
        S[0, q] = u0*x0
        S[1, q] = u1*x0
        S[2, q] = u2*x0
        S[3, q] = x5*(-u3*x2 + x4*(u3*x3 + 0.02*v3))
        S[4, q] = x5*(-u4*x2 + x4*(u4*x3 + 0.02*v4))
        S[5, q] = x5*(-u5*x2 + x4*(u5*x3 + 0.02*v5))


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
            x15 = beta/(x12 + 0.01)
            x16 = (0.5)*x15
            x17 = -s2/(math.sqrt(x13)) + 1.0
            x18 = s1*s3
            x19 = x14 + x15
            x20 = u3*x18*x19
            T[0, k] = x5*(beta*x2 + x1 + (1.5)*x2 + x4)
            T[1, k] = u1*x7
            T[2, k] = x5*(beta*x0 + (1.5)*x0 + x4 + x8)
            T[3, k] = u2*x7
            T[4, k] = u1*u2*x5*x6
            T[5, k] = x5*(beta*x3 + x1 + (1.5)*x3 + x8 - 0.5)
            T[6, k] = 0.0
            T[7, k] = 0.0
            T[8, k] = 0.0
            T[9, k] = x18*(x14*x9 + x16*(2.0*x9 + 0.02) + x17)
            T[10, k] = 0.0
            T[11, k] = 0.0
            T[12, k] = 0.0
            T[13, k] = u4*x20
            T[14, k] = x18*(x10*x14 + x16*(2.0*x10 + 0.02) + x17)
            T[15, k] = 0.0
            T[16, k] = 0.0
            T[17, k] = 0.0
            T[18, k] = u5*x20
            T[19, k] = u4*u5*x18*x19
            T[20, k] = x18*(x11*x14 + x16*(2.0*x11 + 0.02) + x17)
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
        W[q] = s3*(s0*((u0*v0 + u1*v1 + u2*v2) * (u0*v0 + u1*v1 + u2*v2)) + s1*(0.01*(v3 * v3) + 0.01*(v4 * v4) + 0.01*(v5 * v5) + ((u3*v3 + u4*v4 + u5*v5) * (u3*v3 + u4*v4 + u5*v5)))/((u3 * u3) + (u4 * u4) + (u5 * u5) + 0.01))
