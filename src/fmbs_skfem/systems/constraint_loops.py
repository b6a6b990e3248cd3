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
        x3 = 2.0*p0/(x2 * x2)
        x4 = x3*y0*y1
        x5 = -p0/x2
        x6 = (y2 * y2)
        x7 = (y3 * y3)
        x8 = x6 + x7
        x9 = 2.0*p1/(x8 * x8)
        x10 = x9*y2*y3
        x11 = -p1/x8
        s.H[F.pair + 8 * k + 0] += s.multipliers[F.row[k]] * (x4)
        s.H[F.pair + 8 * k + 1] += s.multipliers[F.row[k]] * (x1*x3 + x5)
        s.H[F.pair + 8 * k + 2] += s.multipliers[F.row[k]] * (-x0*x3 - x5)
        s.H[F.pair + 8 * k + 3] += s.multipliers[F.row[k]] * (-x4)
        s.H[F.pair + 8 * k + 4] += s.multipliers[F.row[k]] * (x10)
        s.H[F.pair + 8 * k + 5] += s.multipliers[F.row[k]] * (x11 + x7*x9)
        s.H[F.pair + 8 * k + 6] += s.multipliers[F.row[k]] * (-x11 - x6*x9)
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
        x2 = x0 + x1
        x3 = p0/x2
        x4 = (y2 * y2)
        x5 = (y3 * y3)
        x6 = x4 + x5
        x7 = p1/x6
        x8 = (1.0 / (x2 * x2))
        x9 = p0*x8
        x10 = 2.0*x9
        x11 = x10*y1
        x12 = x0*x10
        x13 = -v1*x12 + v1*x3
        x14 = (1.0 / (x6 * x6))
        x15 = p1*x14
        x16 = 2.0*x15
        x17 = x16*y3
        x18 = x16*x4
        x19 = -v3*x18 + v3*x7
        x20 = v0*x3
        x21 = v1*y0
        x22 = v2*x7
        x23 = v3*y2
        x24 = -x3
        x25 = x1*x10
        x26 = v0*y0
        x27 = 4.0*x9*y1
        x28 = -x7
        x29 = x16*x5
        x30 = v2*y2
        x31 = 4.0*x15*y3
        x32 = x11*y0
        x33 = (1.0 / (x2 * x2 * x2))
        x34 = 8.0*p0*x33
        x35 = v0*x34
        x36 = 2.0*p0*v0*x8*y0 + 8.0*p0*v1*x0*x33*y1 - v1*x11 - x1*x26*x34
        x37 = x17*y2
        x38 = (1.0 / (x6 * x6 * x6))
        x39 = 8.0*p1*x38
        x40 = v2*x39
        x41 = 2.0*p1*v2*x14*y2 + 8.0*p1*v3*x38*x4*y3 - v3*x17 - x30*x39*x5
        gap[F.row[k]] += second*(v0*(v0*x11*y0 + x13) + v1*(2.0*p0*v0*x1*x8 - x11*x21 - x20) + v2*(v2*x17*y2 + x19) + v3*(2.0*p1*v2*x14*x5 - x17*x23 - x22)) + third*(a0*(v1*(x24 + x25) + x13 + x26*x27) + a1*(v0*x25 + v0*(-x12 - x24) - x20 - x21*x27) + a2*(v3*(x28 + x29) + x19 + x30*x31) + a3*(v2*x29 + v2*(-x18 - x28) - x22 - x23*x31) + v0*(a0*x32 - a1*x12 + a1*x3 + v0*(2.0*p0*v0*x8*y1 + 8.0*p0*v1*x33*(y0 * y0 * y0) - x0*x35*y1 - 6.0*x21*x9) + v1*x36) + v1*(a0*x25 - a0*x3 - a1*x32 + v0*x36 + v1*(6.0*p0*v0*x8*y1 + 8.0*p0*v1*x1*x33*y0 - x10*x21 - x35*(y1 * y1 * y1))) + v2*(a2*x37 - a3*x18 + a3*x7 + v2*(2.0*p1*v2*x14*y3 + 8.0*p1*v3*x38*(y2 * y2 * y2) - 6.0*x15*x23 - x4*x40*y3) + v3*x41) + v3*(a2*x29 - a2*x7 - a3*x37 + v2*x41 + v3*(6.0*p1*v2*x14*y3 + 8.0*p1*v3*x38*x5*y2 - x16*x23 - x40*(y3 * y3 * y3)))) + x3*y0*z1 - x3*y1*z0 + x7*y2*z3 - x7*y3*z2
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
        x3 = 2.0*p0/(x2 * x2)
        x4 = x3*y0*y1
        x5 = -p0/x2
        x6 = (y2 * y2)
        x7 = (y3 * y3)
        x8 = x6 + x7
        x9 = 2.0*p1/(x8 * x8)
        x10 = x9*y2*y3
        x11 = -p1/x8
        x12 = (y4 * y4)
        x13 = (y5 * y5)
        x14 = x12 + x13
        x15 = 2.0*p2/(x14 * x14)
        x16 = x15*y4*y5
        x17 = -p2/x14
        s.H[F.pair + 12 * k + 0] += s.multipliers[F.row[k]] * (x4)
        s.H[F.pair + 12 * k + 1] += s.multipliers[F.row[k]] * (x1*x3 + x5)
        s.H[F.pair + 12 * k + 2] += s.multipliers[F.row[k]] * (-x0*x3 - x5)
        s.H[F.pair + 12 * k + 3] += s.multipliers[F.row[k]] * (-x4)
        s.H[F.pair + 12 * k + 4] += s.multipliers[F.row[k]] * (x10)
        s.H[F.pair + 12 * k + 5] += s.multipliers[F.row[k]] * (x11 + x7*x9)
        s.H[F.pair + 12 * k + 6] += s.multipliers[F.row[k]] * (-x11 - x6*x9)
        s.H[F.pair + 12 * k + 7] += s.multipliers[F.row[k]] * (-x10)
        s.H[F.pair + 12 * k + 8] += s.multipliers[F.row[k]] * (x16)
        s.H[F.pair + 12 * k + 9] += s.multipliers[F.row[k]] * (x13*x15 + x17)
        s.H[F.pair + 12 * k + 10] += s.multipliers[F.row[k]] * (-x12*x15 - x17)
        s.H[F.pair + 12 * k + 11] += s.multipliers[F.row[k]] * (-x16)
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
        x2 = x0 + x1
        x3 = p0/x2
        x4 = (y2 * y2)
        x5 = (y3 * y3)
        x6 = x4 + x5
        x7 = p1/x6
        x8 = (y4 * y4)
        x9 = (y5 * y5)
        x10 = x8 + x9
        x11 = p2/x10
        x12 = (1.0 / (x2 * x2))
        x13 = p0*x12
        x14 = 2.0*x13
        x15 = x14*y1
        x16 = x0*x14
        x17 = -v1*x16 + v1*x3
        x18 = (1.0 / (x6 * x6))
        x19 = p1*x18
        x20 = 2.0*x19
        x21 = x20*y3
        x22 = x20*x4
        x23 = -v3*x22 + v3*x7
        x24 = (1.0 / (x10 * x10))
        x25 = p2*x24
        x26 = 2.0*x25
        x27 = x26*y5
        x28 = x26*x8
        x29 = v5*x11 - v5*x28
        x30 = v0*x3
        x31 = v1*y0
        x32 = v2*x7
        x33 = v3*y2
        x34 = v4*x11
        x35 = v5*y4
        x36 = -x3
        x37 = x1*x14
        x38 = v0*y0
        x39 = 4.0*x13*y1
        x40 = -x7
        x41 = x20*x5
        x42 = v2*y2
        x43 = 4.0*x19*y3
        x44 = -x11
        x45 = x26*x9
        x46 = v4*y4
        x47 = 4.0*x25*y5
        x48 = x15*y0
        x49 = (1.0 / (x2 * x2 * x2))
        x50 = 8.0*p0*x49
        x51 = v0*x50
        x52 = 2.0*p0*v0*x12*y0 + 8.0*p0*v1*x0*x49*y1 - v1*x15 - x1*x38*x50
        x53 = x21*y2
        x54 = (1.0 / (x6 * x6 * x6))
        x55 = 8.0*p1*x54
        x56 = v2*x55
        x57 = 2.0*p1*v2*x18*y2 + 8.0*p1*v3*x4*x54*y3 - v3*x21 - x42*x5*x55
        x58 = x27*y4
        x59 = (1.0 / (x10 * x10 * x10))
        x60 = 8.0*p2*x59
        x61 = v4*x60
        x62 = 2.0*p2*v4*x24*y4 + 8.0*p2*v5*x59*x8*y5 - v5*x27 - x46*x60*x9
        gap[F.row[k]] += second*(v0*(v0*x15*y0 + x17) + v1*(2.0*p0*v0*x1*x12 - x15*x31 - x30) + v2*(v2*x21*y2 + x23) + v3*(2.0*p1*v2*x18*x5 - x21*x33 - x32) + v4*(v4*x27*y4 + x29) + v5*(2.0*p2*v4*x24*x9 - x27*x35 - x34)) + third*(a0*(v1*(x36 + x37) + x17 + x38*x39) + a1*(v0*x37 + v0*(-x16 - x36) - x30 - x31*x39) + a2*(v3*(x40 + x41) + x23 + x42*x43) + a3*(v2*x41 + v2*(-x22 - x40) - x32 - x33*x43) + a4*(v5*(x44 + x45) + x29 + x46*x47) + a5*(v4*x45 + v4*(-x28 - x44) - x34 - x35*x47) + v0*(a0*x48 - a1*x16 + a1*x3 + v0*(2.0*p0*v0*x12*y1 + 8.0*p0*v1*x49*(y0 * y0 * y0) - x0*x51*y1 - 6.0*x13*x31) + v1*x52) + v1*(-a0*x3 + a0*x37 - a1*x48 + v0*x52 + v1*(6.0*p0*v0*x12*y1 + 8.0*p0*v1*x1*x49*y0 - x14*x31 - x51*(y1 * y1 * y1))) + v2*(a2*x53 - a3*x22 + a3*x7 + v2*(2.0*p1*v2*x18*y3 + 8.0*p1*v3*x54*(y2 * y2 * y2) - 6.0*x19*x33 - x4*x56*y3) + v3*x57) + v3*(a2*x41 - a2*x7 - a3*x53 + v2*x57 + v3*(6.0*p1*v2*x18*y3 + 8.0*p1*v3*x5*x54*y2 - x20*x33 - x56*(y3 * y3 * y3))) + v4*(a4*x58 + a5*x11 - a5*x28 + v4*(2.0*p2*v4*x24*y5 + 8.0*p2*v5*x59*(y4 * y4 * y4) - 6.0*x25*x35 - x61*x8*y5) + v5*x62) + v5*(-a4*x11 + a4*x45 - a5*x58 + v4*x62 + v5*(6.0*p2*v4*x24*y5 + 8.0*p2*v5*x59*x9*y4 - x26*x35 - x61*(y5 * y5 * y5)))) + x11*y4*z5 - x11*y5*z4 + x3*y0*z1 - x3*y1*z0 + x7*y2*z3 - x7*y3*z2
    return 0


LAWS["gear_3"] = ConstraintLaw("gear_3", 6, 4, 0, ((0, 0), (0, 1), (1, 0), (1, 1), (2, 2), (2, 3), (3, 2), (3, 3), (4, 4), (4, 5), (5, 4), (5, 5)), Routines(gear_3_constrain, gear_3_slopes, gear_3_drift))
