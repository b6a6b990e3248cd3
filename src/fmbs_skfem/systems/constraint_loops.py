"""Functions of joints and their derivatives, written by `constraint_symbols` and not to be edited."""

# fmt: off
# ruff: noqa
# mypy: ignore-errors
from __future__ import annotations
import math
from typing import Any
from fmbs_skfem.core.structs import routine
from fmbs_skfem.systems.evaluation import evaluation
from fmbs_skfem.systems.constraint_laws import ConstraintLaw, Routines, opened
from fmbs_skfem.systems.kernels import derivative, factor, remainder


LAWS = {}


@routine
def gear_2_constrain(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    gap = s.rhs[0, len(s.rhs[0]) - len(s.multipliers) :]
    for k in range(len(F.rows)):
        y0, y1, y2, y3, p0, p1, p2 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.y[F.rows[k, 3]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2]
        x0 = p0/((y0 * y0) + (y1 * y1))
        x1 = p1/((y2 * y2) + (y3 * y3))
        gap[F.row[k]] += remainder(p0*math.atan2(y1, y0) + p1*math.atan2(y3, y2), p2)
        s.Jy[F.row[k], F.rows[k, 0]] += -x0*y1
        s.Jy[F.row[k], F.rows[k, 1]] += x0*y0
        s.Jy[F.row[k], F.rows[k, 2]] += -x1*y3
        s.Jy[F.row[k], F.rows[k, 3]] += x1*y2
    return 0


@routine
def gear_2_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, y3, p0, p1 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.y[F.rows[k, 3]], F.numbers[k, 0], F.numbers[k, 1]
        x0 = (y0 * y0)
        x1 = (y1 * y1)
        x2 = x0 + x1
        x3 = 2.0*p0*y0*y1/(x2 * x2)
        x4 = (1.0 / (x2))
        x5 = 2.0*x4
        x6 = p0*x4
        x7 = (y2 * y2)
        x8 = (y3 * y3)
        x9 = x7 + x8
        x10 = 2.0*p1*y2*y3/(x9 * x9)
        x11 = (1.0 / (x9))
        x12 = 2.0*x11
        x13 = p1*x11
        s.H[F.pair + 8 * k + 0] += s.multipliers[F.row[k]] * (x3)
        s.H[F.pair + 8 * k + 1] += s.multipliers[F.row[k]] * (x6*(x1*x5 - 1.0))
        s.H[F.pair + 8 * k + 2] += s.multipliers[F.row[k]] * (x6*(-x0*x5 + 1.0))
        s.H[F.pair + 8 * k + 3] += s.multipliers[F.row[k]] * (-x3)
        s.H[F.pair + 8 * k + 4] += s.multipliers[F.row[k]] * (x10)
        s.H[F.pair + 8 * k + 5] += s.multipliers[F.row[k]] * (x13*(x12*x8 - 1.0))
        s.H[F.pair + 8 * k + 6] += s.multipliers[F.row[k]] * (x13*(-x12*x7 + 1.0))
        s.H[F.pair + 8 * k + 7] += s.multipliers[F.row[k]] * (-x10)
    return 0


@routine
def gear_2_drift(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    gap = s.rhs[0, len(s.rhs[0]) - len(s.multipliers) :]
    many, second, third = len(s.signals) // 4, s.leads[0], s.leads[1]
    for k in range(len(F.rows)):
        y0, y1, y2, y3, p0, p1, z0, z1, z2, z3, v0, v1, v2, v3, a0, a1, a2, a3 = s.paths[0, F.rows[k, 0]], s.paths[0, F.rows[k, 1]], s.paths[0, F.rows[k, 2]], s.paths[0, F.rows[k, 3]], F.numbers[k, 0], F.numbers[k, 1], s.paths[1, F.rows[k, 0]], s.paths[1, F.rows[k, 1]], s.paths[1, F.rows[k, 2]], s.paths[1, F.rows[k, 3]], s.paths[2, F.rows[k, 0]], s.paths[2, F.rows[k, 1]], s.paths[2, F.rows[k, 2]], s.paths[2, F.rows[k, 3]], s.paths[3, F.rows[k, 0]], s.paths[3, F.rows[k, 1]], s.paths[3, F.rows[k, 2]], s.paths[3, F.rows[k, 3]]
        x0 = (y0 * y0)
        x1 = (y1 * y1)
        x2 = (1.0 / ((x0 + x1)))
        x3 = p0*x2
        x4 = (y2 * y2)
        x5 = (y3 * y3)
        x6 = (1.0 / ((x4 + x5)))
        x7 = p1*x6
        x8 = v0*y1
        x9 = 2.0*x2
        x10 = x9*y0
        x11 = x0*x9
        x12 = -v1*x11 + v1
        x13 = v0*x3
        x14 = v2*y3
        x15 = 2.0*x6
        x16 = x15*y2
        x17 = x15*x4
        x18 = -v3*x17 + v3
        x19 = v2*x7
        x20 = v1*y1
        x21 = x1*x9
        x22 = -v0*x21 + v0
        x23 = v1*x3
        x24 = v3*y3
        x25 = x15*x5
        x26 = -v2*x25 + v2
        x27 = v3*x7
        x28 = 4.0*x2
        x29 = x28*y0
        x30 = 4.0*x6
        x31 = x30*y2
        x32 = x10*y1
        x33 = v1*y0
        x34 = x1*x28
        x35 = v1*x9
        x36 = v0*y0
        x37 = x0*x28
        x38 = -x20*x37 + x20 + x34*x36 - x36
        x39 = v0*x9
        x40 = x16*y3
        x41 = v3*y2
        x42 = x30*x5
        x43 = v3*x15
        x44 = v2*y2
        x45 = x30*x4
        x46 = -x24*x45 + x24 + x42*x44 - x44
        x47 = v2*x15
        gap[F.row[k]] += second*(x13*(x10*x8 + x12) + x19*(x14*x16 + x18) - x23*(x10*x20 + x22) - x27*(x16*x24 + x26)) + third*(a0*p0*x2*(v1*(x21 - 1.0) + x12 + x29*x8) - a1*x3*(v0*(x11 - 1.0) + x20*x29 + x22) + a2*p1*x6*(v3*(x25 - 1.0) + x14*x31 + x18) - a3*x7*(v2*(x17 - 1.0) + x24*x31 + x26) - x13*(-a0*x32 + a1*x11 - a1 + x35*x38 + x39*(-v1*x28*(y0 * y0 * y0) + 3.0*x33 + x37*x8 - x8)) - x19*(-a2*x40 + a3*x17 - a3 + x43*x46 + x47*(-v3*x30*(y2 * y2 * y2) + x14*x45 - x14 + 3.0*x41)) - x23*(-a0*x21 + a0 + a1*x32 + x35*(v0*x28*(y1 * y1 * y1) - x33*x34 + x33 - 3.0*x8) + x38*x39) - x27*(-a2*x25 + a2 + a3*x40 + x43*(v2*x30*(y3 * y3 * y3) - 3.0*x14 - x41*x42 + x41) + x46*x47)) + x3*y0*z1 - x3*y1*z0 + x7*y2*z3 - x7*y3*z2
    return 0


LAWS["gear_2"] = ConstraintLaw("gear_2", 4, 3, 0, ((0, 0), (0, 1), (1, 0), (1, 1), (2, 2), (2, 3), (3, 2), (3, 3)), Routines(gear_2_constrain, gear_2_slopes, gear_2_drift))


@routine
def gear_3_constrain(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    gap = s.rhs[0, len(s.rhs[0]) - len(s.multipliers) :]
    for k in range(len(F.rows)):
        y0, y1, y2, y3, y4, y5, p0, p1, p2, p3 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.y[F.rows[k, 3]], s.y[F.rows[k, 4]], s.y[F.rows[k, 5]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], F.numbers[k, 3]
        x0 = p0/((y0 * y0) + (y1 * y1))
        x1 = p1/((y2 * y2) + (y3 * y3))
        x2 = p2/((y4 * y4) + (y5 * y5))
        gap[F.row[k]] += remainder(p0*math.atan2(y1, y0) + p1*math.atan2(y3, y2) + p2*math.atan2(y5, y4), p3)
        s.Jy[F.row[k], F.rows[k, 0]] += -x0*y1
        s.Jy[F.row[k], F.rows[k, 1]] += x0*y0
        s.Jy[F.row[k], F.rows[k, 2]] += -x1*y3
        s.Jy[F.row[k], F.rows[k, 3]] += x1*y2
        s.Jy[F.row[k], F.rows[k, 4]] += -x2*y5
        s.Jy[F.row[k], F.rows[k, 5]] += x2*y4
    return 0


@routine
def gear_3_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, y3, y4, y5, p0, p1, p2 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.y[F.rows[k, 3]], s.y[F.rows[k, 4]], s.y[F.rows[k, 5]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2]
        x0 = (y0 * y0)
        x1 = (y1 * y1)
        x2 = x0 + x1
        x3 = 2.0*p0*y0*y1/(x2 * x2)
        x4 = (1.0 / (x2))
        x5 = 2.0*x4
        x6 = p0*x4
        x7 = (y2 * y2)
        x8 = (y3 * y3)
        x9 = x7 + x8
        x10 = 2.0*p1*y2*y3/(x9 * x9)
        x11 = (1.0 / (x9))
        x12 = 2.0*x11
        x13 = p1*x11
        x14 = (y4 * y4)
        x15 = (y5 * y5)
        x16 = x14 + x15
        x17 = 2.0*p2*y4*y5/(x16 * x16)
        x18 = (1.0 / (x16))
        x19 = 2.0*x18
        x20 = p2*x18
        s.H[F.pair + 12 * k + 0] += s.multipliers[F.row[k]] * (x3)
        s.H[F.pair + 12 * k + 1] += s.multipliers[F.row[k]] * (x6*(x1*x5 - 1.0))
        s.H[F.pair + 12 * k + 2] += s.multipliers[F.row[k]] * (x6*(-x0*x5 + 1.0))
        s.H[F.pair + 12 * k + 3] += s.multipliers[F.row[k]] * (-x3)
        s.H[F.pair + 12 * k + 4] += s.multipliers[F.row[k]] * (x10)
        s.H[F.pair + 12 * k + 5] += s.multipliers[F.row[k]] * (x13*(x12*x8 - 1.0))
        s.H[F.pair + 12 * k + 6] += s.multipliers[F.row[k]] * (x13*(-x12*x7 + 1.0))
        s.H[F.pair + 12 * k + 7] += s.multipliers[F.row[k]] * (-x10)
        s.H[F.pair + 12 * k + 8] += s.multipliers[F.row[k]] * (x17)
        s.H[F.pair + 12 * k + 9] += s.multipliers[F.row[k]] * (x20*(x15*x19 - 1.0))
        s.H[F.pair + 12 * k + 10] += s.multipliers[F.row[k]] * (x20*(-x14*x19 + 1.0))
        s.H[F.pair + 12 * k + 11] += s.multipliers[F.row[k]] * (-x17)
    return 0


@routine
def gear_3_drift(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    gap = s.rhs[0, len(s.rhs[0]) - len(s.multipliers) :]
    many, second, third = len(s.signals) // 4, s.leads[0], s.leads[1]
    for k in range(len(F.rows)):
        y0, y1, y2, y3, y4, y5, p0, p1, p2, z0, z1, z2, z3, z4, z5, v0, v1, v2, v3, v4, v5, a0, a1, a2, a3, a4, a5 = s.paths[0, F.rows[k, 0]], s.paths[0, F.rows[k, 1]], s.paths[0, F.rows[k, 2]], s.paths[0, F.rows[k, 3]], s.paths[0, F.rows[k, 4]], s.paths[0, F.rows[k, 5]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], s.paths[1, F.rows[k, 0]], s.paths[1, F.rows[k, 1]], s.paths[1, F.rows[k, 2]], s.paths[1, F.rows[k, 3]], s.paths[1, F.rows[k, 4]], s.paths[1, F.rows[k, 5]], s.paths[2, F.rows[k, 0]], s.paths[2, F.rows[k, 1]], s.paths[2, F.rows[k, 2]], s.paths[2, F.rows[k, 3]], s.paths[2, F.rows[k, 4]], s.paths[2, F.rows[k, 5]], s.paths[3, F.rows[k, 0]], s.paths[3, F.rows[k, 1]], s.paths[3, F.rows[k, 2]], s.paths[3, F.rows[k, 3]], s.paths[3, F.rows[k, 4]], s.paths[3, F.rows[k, 5]]
        x0 = (y0 * y0)
        x1 = (y1 * y1)
        x2 = (1.0 / ((x0 + x1)))
        x3 = p0*x2
        x4 = (y2 * y2)
        x5 = (y3 * y3)
        x6 = (1.0 / ((x4 + x5)))
        x7 = p1*x6
        x8 = (y4 * y4)
        x9 = (y5 * y5)
        x10 = (1.0 / ((x8 + x9)))
        x11 = p2*x10
        x12 = v0*y1
        x13 = 2.0*x2
        x14 = x13*y0
        x15 = x0*x13
        x16 = -v1*x15 + v1
        x17 = v0*x3
        x18 = v2*y3
        x19 = 2.0*x6
        x20 = x19*y2
        x21 = x19*x4
        x22 = -v3*x21 + v3
        x23 = v2*x7
        x24 = v4*y5
        x25 = 2.0*x10
        x26 = x25*y4
        x27 = x25*x8
        x28 = -v5*x27 + v5
        x29 = v4*x11
        x30 = v1*y1
        x31 = x1*x13
        x32 = -v0*x31 + v0
        x33 = v1*x3
        x34 = v3*y3
        x35 = x19*x5
        x36 = -v2*x35 + v2
        x37 = v3*x7
        x38 = v5*y5
        x39 = x25*x9
        x40 = -v4*x39 + v4
        x41 = v5*x11
        x42 = 4.0*x2
        x43 = x42*y0
        x44 = 4.0*x6
        x45 = x44*y2
        x46 = 4.0*x10
        x47 = x46*y4
        x48 = x14*y1
        x49 = v1*y0
        x50 = x1*x42
        x51 = v1*x13
        x52 = v0*y0
        x53 = x0*x42
        x54 = -x30*x53 + x30 + x50*x52 - x52
        x55 = v0*x13
        x56 = x20*y3
        x57 = v3*y2
        x58 = x44*x5
        x59 = v3*x19
        x60 = v2*y2
        x61 = x4*x44
        x62 = -x34*x61 + x34 + x58*x60 - x60
        x63 = v2*x19
        x64 = x26*y5
        x65 = v5*y4
        x66 = x46*x9
        x67 = v5*x25
        x68 = v4*y4
        x69 = x46*x8
        x70 = -x38*x69 + x38 + x66*x68 - x68
        x71 = v4*x25
        gap[F.row[k]] += second*(x17*(x12*x14 + x16) + x23*(x18*x20 + x22) + x29*(x24*x26 + x28) - x33*(x14*x30 + x32) - x37*(x20*x34 + x36) - x41*(x26*x38 + x40)) + third*(a0*p0*x2*(v1*(x31 - 1.0) + x12*x43 + x16) - a1*x3*(v0*(x15 - 1.0) + x30*x43 + x32) + a2*p1*x6*(v3*(x35 - 1.0) + x18*x45 + x22) - a3*x7*(v2*(x21 - 1.0) + x34*x45 + x36) + a4*p2*x10*(v5*(x39 - 1.0) + x24*x47 + x28) - a5*x11*(v4*(x27 - 1.0) + x38*x47 + x40) - x17*(-a0*x48 + a1*x15 - a1 + x51*x54 + x55*(-v1*x42*(y0 * y0 * y0) + x12*x53 - x12 + 3.0*x49)) - x23*(-a2*x56 + a3*x21 - a3 + x59*x62 + x63*(-v3*x44*(y2 * y2 * y2) + x18*x61 - x18 + 3.0*x57)) - x29*(-a4*x64 + a5*x27 - a5 + x67*x70 + x71*(-v5*x46*(y4 * y4 * y4) + x24*x69 - x24 + 3.0*x65)) - x33*(-a0*x31 + a0 + a1*x48 + x51*(v0*x42*(y1 * y1 * y1) - 3.0*x12 - x49*x50 + x49) + x54*x55) - x37*(-a2*x35 + a2 + a3*x56 + x59*(v2*x44*(y3 * y3 * y3) - 3.0*x18 - x57*x58 + x57) + x62*x63) - x41*(-a4*x39 + a4 + a5*x64 + x67*(v4*x46*(y5 * y5 * y5) - 3.0*x24 - x65*x66 + x65) + x70*x71)) + x11*y4*z5 - x11*y5*z4 + x3*y0*z1 - x3*y1*z0 + x7*y2*z3 - x7*y3*z2
    return 0


LAWS["gear_3"] = ConstraintLaw("gear_3", 6, 4, 0, ((0, 0), (0, 1), (1, 0), (1, 1), (2, 2), (2, 3), (3, 2), (3, 3), (4, 4), (4, 5), (5, 4), (5, 5)), Routines(gear_3_constrain, gear_3_slopes, gear_3_drift))
