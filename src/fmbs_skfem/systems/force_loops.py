"""Forces of loads and their derivatives, written by `force_symbols` and not to be edited."""

# fmt: off
# ruff: noqa
# mypy: ignore-errors
from __future__ import annotations
import math
from typing import Any
from fmbs_skfem.core.choices import chosen, floor_of, less, not_more, sign_of
from fmbs_skfem.core.structs import routine
from fmbs_skfem.systems.evaluation import evaluation
from fmbs_skfem.systems.force_laws import ForceLaw, continued, opened
from fmbs_skfem.systems.kernels import factor
from fmbs_skfem.systems.one_sided import closing, keeps, kept, lift, ramp, touch


LAWS = {}


@routine
def dead_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        p0, h0 = F.numbers[k, 0], factor(s.signals, F.signals[k, 0])
        s.g[F.rows[k, 0]] += h0*p0
    return 0


@routine
def dead_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        pass
    return 0


LAWS["dead"] = ForceLaw("dead", 1, 1, 1, (), 0, False, dead_force, dead_slopes)


@routine
def moment_2_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, p0, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], F.numbers[k, 0], factor(s.signals, F.signals[k, 0])
        x0 = h0*p0/((y0 * y0) + (y1 * y1))
        s.g[F.rows[k, 0]] += -x0*y1
        s.g[F.rows[k, 1]] += x0*y0
    return 0


@routine
def moment_2_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        y0, y1, p0, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], F.numbers[k, 0], factor(s.signals, F.signals[k, 0])
        x0 = (y0 * y0)
        x1 = (y1 * y1)
        x2 = x0 + x1
        x3 = h0*p0
        x4 = 2.0*x3/(x2 * x2)
        x5 = x4*y0*y1
        x6 = -x3/x2
        s.H[F.pair + 4 * k + 0] += c * (x5)
        s.H[F.pair + 4 * k + 1] += c * (x1*x4 + x6)
        s.H[F.pair + 4 * k + 2] += c * (-x0*x4 - x6)
        s.H[F.pair + 4 * k + 3] += c * (-x5)
    return 0


LAWS["moment_2"] = ForceLaw("moment_2", 2, 1, 1, ((0, 0), (0, 1), (1, 0), (1, 1)), 0, False, moment_2_force, moment_2_slopes)


@routine
def moment_3_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, p0, p1, p2, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], factor(s.signals, F.signals[k, 0])
        x0 = h0/((y0 * y0) + (y1 * y1) + (y2 * y2))
        s.g[F.rows[k, 0]] += x0*(p1*y2 - p2*y1)
        s.g[F.rows[k, 1]] += x0*(-p0*y2 + p2*y0)
        s.g[F.rows[k, 2]] += x0*(p0*y1 - p1*y0)
    return 0


@routine
def moment_3_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        y0, y1, y2, p0, p1, p2, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], factor(s.signals, F.signals[k, 0])
        x0 = (y0 * y0) + (y1 * y1) + (y2 * y2)
        x1 = 2.0*h0/(x0 * x0)
        x2 = x1*(p1*y2 - p2*y1)
        x3 = h0/x0
        x4 = p2*x3
        x5 = p1*x3
        x6 = x1*(-p0*y2 + p2*y0)
        x7 = p0*x3
        x8 = x1*(p0*y1 - p1*y0)
        s.H[F.pair + 9 * k + 0] += c * (-x2*y0)
        s.H[F.pair + 9 * k + 1] += c * (-x2*y1 - x4)
        s.H[F.pair + 9 * k + 2] += c * (-x2*y2 + x5)
        s.H[F.pair + 9 * k + 3] += c * (x4 - x6*y0)
        s.H[F.pair + 9 * k + 4] += c * (-x6*y1)
        s.H[F.pair + 9 * k + 5] += c * (-x6*y2 - x7)
        s.H[F.pair + 9 * k + 6] += c * (-x5 - x8*y0)
        s.H[F.pair + 9 * k + 7] += c * (x7 - x8*y1)
        s.H[F.pair + 9 * k + 8] += c * (-x8*y2)
    return 0


LAWS["moment_3"] = ForceLaw("moment_3", 3, 3, 1, ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)), 0, False, moment_3_force, moment_3_slopes)


@routine
def follower_2_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, p0, p1, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], F.numbers[k, 0], F.numbers[k, 1], factor(s.signals, F.signals[k, 0])
        x0 = h0/(math.sqrt((y0 * y0) + (y1 * y1)))
        s.g[F.rows[k, 2]] += x0*(p0*y0 - p1*y1)
        s.g[F.rows[k, 3]] += x0*(p0*y1 + p1*y0)
    return 0


@routine
def follower_2_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        y0, y1, p0, p1, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], F.numbers[k, 0], F.numbers[k, 1], factor(s.signals, F.signals[k, 0])
        x0 = (y0 * y0) + (y1 * y1)
        x1 = h0/(math.sqrt(x0))
        x2 = p0*x1
        x3 = h0/(x0 * math.sqrt(x0))
        x4 = x3*(p0*y0 - p1*y1)
        x5 = p1*x1
        x6 = x3*(p0*y1 + p1*y0)
        s.H[F.pair + 4 * k + 0] += c * (x2 - x4*y0)
        s.H[F.pair + 4 * k + 1] += c * (-x4*y1 - x5)
        s.H[F.pair + 4 * k + 2] += c * (x5 - x6*y0)
        s.H[F.pair + 4 * k + 3] += c * (x2 - x6*y1)
    return 0


LAWS["follower_2"] = ForceLaw("follower_2", 4, 2, 1, ((2, 0), (2, 1), (3, 0), (3, 1)), 0, False, follower_2_force, follower_2_slopes)


@routine
def follower_3_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, p0, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], F.numbers[k, 0], factor(s.signals, F.signals[k, 0])
        x0 = h0*p0/(math.sqrt((y0 * y0) + (y1 * y1) + (y2 * y2)))
        s.g[F.rows[k, 3]] += x0*y0
        s.g[F.rows[k, 4]] += x0*y1
        s.g[F.rows[k, 5]] += x0*y2
    return 0


@routine
def follower_3_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        y0, y1, y2, p0, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], F.numbers[k, 0], factor(s.signals, F.signals[k, 0])
        x0 = (y0 * y0)
        x1 = (y1 * y1)
        x2 = (y2 * y2)
        x3 = x0 + x1 + x2
        x4 = -h0*p0/(math.sqrt(x3))
        x5 = h0*p0/(x3 * math.sqrt(x3))
        x6 = x5*y0
        x7 = -x6*y1
        x8 = -x6*y2
        x9 = -x5*y1*y2
        s.H[F.pair + 9 * k + 0] += c * (-x0*x5 - x4)
        s.H[F.pair + 9 * k + 1] += c * (x7)
        s.H[F.pair + 9 * k + 2] += c * (x8)
        s.H[F.pair + 9 * k + 3] += c * (x7)
        s.H[F.pair + 9 * k + 4] += c * (-x1*x5 - x4)
        s.H[F.pair + 9 * k + 5] += c * (x9)
        s.H[F.pair + 9 * k + 6] += c * (x8)
        s.H[F.pair + 9 * k + 7] += c * (x9)
        s.H[F.pair + 9 * k + 8] += c * (-x2*x5 - x4)
    return 0


LAWS["follower_3"] = ForceLaw("follower_3", 6, 1, 1, ((3, 0), (3, 1), (3, 2), (4, 0), (4, 1), (4, 2), (5, 0), (5, 1), (5, 2)), 0, False, follower_3_force, follower_3_slopes)


@routine
def torsion_spring_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, v0, v1, p0, p1, p2, m0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.rates[F.rows[k, 0]], s.rates[F.rows[k, 1]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], s.memory[F.memory + 1 * k + 0]
        x0 = (1.0 / (((y0 * y0) + (y1 * y1))))
        x1 = x0*y1
        x2 = -p0*(-p2 + continued(math.atan2(y1, y0), m0)) - p1*(-v0*x1 + v1*x0*y0)
        s.g[F.rows[k, 0]] += -x1*x2
        s.g[F.rows[k, 1]] += x0*x2*y0
    return 0


@routine
def torsion_spring_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        y0, y1, v0, v1, p0, p1, p2, m0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.rates[F.rows[k, 0]], s.rates[F.rows[k, 1]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], s.memory[F.memory + 1 * k + 0]
        x0 = (y1 * y1)
        x1 = (y0 * y0)
        x2 = x0 + x1
        x3 = (1.0 / (x2 * x2))
        x4 = gh*p1*x3
        x5 = (1.0 / (x2))
        x6 = v0*x5
        x7 = -p0*(-p2 + continued(math.atan2(y1, y0), m0)) - p1*(v1*x5*y0 - x6*y1)
        x8 = 2.0*x3
        x9 = y0*y1
        x10 = x8*x9
        x11 = x10*x7
        x12 = x5*y1
        x13 = x1*x8
        x14 = p0*x12 - p1*(v0*x10 - v1*x13 + v1*x5)
        x15 = x4*x9
        x16 = x5*x7
        x17 = x5*y0
        x18 = -p0*x17 - p1*(2.0*v0*x0*x3 - v1*x10 - x6)
        s.H[F.pair + 4 * k + 0] += c * (-x0*x4 + x11 - x12*x14)
        s.H[F.pair + 4 * k + 1] += c * (x0*x7*x8 - x12*x18 + x15 - x16)
        s.H[F.pair + 4 * k + 2] += c * (-x13*x7 + x14*x17 + x15 + x16)
        s.H[F.pair + 4 * k + 3] += c * (-x1*x4 - x11 + x18*x5*y0)
    return 0


@routine
def torsion_spring_accept(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, m0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.memory[F.memory + 1 * k + 0]
        s.memory[F.memory + 1 * k + 0] = continued(math.atan2(y1, y0), m0)
    return 0


@routine
def torsion_spring_energy(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, p0, p2, m0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], F.numbers[k, 0], F.numbers[k, 2], s.memory[F.memory + 1 * k + 0]
        x0 = -p2 + continued(math.atan2(y1, y0), m0)
        x1 = p0*x0/((y0 * y0) + (y1 * y1))
        s.energy[0] += (0.5)*p0*(x0 * x0)
        s.g[F.rows[k, 0]] += -x1*y1
        s.g[F.rows[k, 1]] += x1*y0
    return 0


LAWS["torsion_spring"] = ForceLaw("torsion_spring", 2, 3, 0, ((0, 0), (0, 1), (1, 0), (1, 1)), 1, True, torsion_spring_force, torsion_spring_slopes, accept=torsion_spring_accept, energy=torsion_spring_energy)


@routine
def relative_torsion_spring_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, y3, v0, v1, v2, v3, p0, p1, p2, m0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.y[F.rows[k, 3]], s.rates[F.rows[k, 0]], s.rates[F.rows[k, 1]], s.rates[F.rows[k, 2]], s.rates[F.rows[k, 3]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], s.memory[F.memory + 1 * k + 0]
        x0 = (1.0 / (((y0 * y0) + (y1 * y1))))
        x1 = x0*y1
        x2 = (1.0 / (((y2 * y2) + (y3 * y3))))
        x3 = x2*y2
        x4 = -p0*(-p2 + continued(math.atan2(y1, y0) - math.atan2(y3, y2), m0)) - p1*(-v0*x1 + v1*x0*y0 + v2*x2*y3 - v3*x3)
        s.g[F.rows[k, 0]] += -x1*x4
        s.g[F.rows[k, 1]] += x0*x4*y0
        s.g[F.rows[k, 2]] += x2*x4*y3
        s.g[F.rows[k, 3]] += -x3*x4
    return 0


@routine
def relative_torsion_spring_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        y0, y1, y2, y3, v0, v1, v2, v3, p0, p1, p2, m0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.y[F.rows[k, 3]], s.rates[F.rows[k, 0]], s.rates[F.rows[k, 1]], s.rates[F.rows[k, 2]], s.rates[F.rows[k, 3]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], s.memory[F.memory + 1 * k + 0]
        x0 = (y1 * y1)
        x1 = (y0 * y0)
        x2 = x0 + x1
        x3 = (1.0 / (x2 * x2))
        x4 = gh*p1
        x5 = x3*x4
        x6 = (1.0 / (x2))
        x7 = x6*y1
        x8 = 2.0*x3
        x9 = y0*y1
        x10 = x8*x9
        x11 = x1*x8
        x12 = p0*x7 - p1*(v0*x10 - v1*x11 + v1*x6)
        x13 = v0*x6
        x14 = (y2 * y2)
        x15 = (y3 * y3)
        x16 = x14 + x15
        x17 = (1.0 / (x16))
        x18 = v3*x17
        x19 = -p0*(-p2 + continued(math.atan2(y1, y0) - math.atan2(y3, y2), m0)) - p1*(v1*x6*y0 + v2*x17*y3 - x13*y1 - x18*y2)
        x20 = x10*x19
        x21 = x5*x9
        x22 = x6*y0
        x23 = -p0*x22 - p1*(2.0*v0*x0*x3 - v1*x10 - x13)
        x24 = x19*x6
        x25 = x17*y3
        x26 = x4*x7
        x27 = x25*x26
        x28 = p0*x17
        x29 = (1.0 / (x16 * x16))
        x30 = 2.0*x29
        x31 = y2*y3
        x32 = x30*x31
        x33 = -p1*(-v2*x32 + 2.0*v3*x14*x29 - x18) - x28*y3
        x34 = x17*y2
        x35 = x26*x34
        x36 = x15*x30
        x37 = -p1*(v2*x17 - v2*x36 + v3*x32) + x28*y2
        x38 = x22*x4
        x39 = x25*x38
        x40 = x34*x38
        x41 = x29*x4
        x42 = x19*x32
        x43 = x31*x41
        x44 = x17*x19
        s.H[F.pair + 16 * k + 0] += c * (-x0*x5 - x12*x7 + x20)
        s.H[F.pair + 16 * k + 1] += c * (x0*x19*x8 + x21 - x23*x7 - x24)
        s.H[F.pair + 16 * k + 2] += c * (x27 - x33*x7)
        s.H[F.pair + 16 * k + 3] += c * (-x35 - x37*x7)
        s.H[F.pair + 16 * k + 4] += c * (-x11*x19 + x12*x22 + x21 + x24)
        s.H[F.pair + 16 * k + 5] += c * (-x1*x5 - x20 + x23*x6*y0)
        s.H[F.pair + 16 * k + 6] += c * (x33*x6*y0 - x39)
        s.H[F.pair + 16 * k + 7] += c * (x22*x37 + x40)
        s.H[F.pair + 16 * k + 8] += c * (x12*x25 + x27)
        s.H[F.pair + 16 * k + 9] += c * (x17*x23*y3 - x39)
        s.H[F.pair + 16 * k + 10] += c * (-x15*x41 + x17*x33*y3 - x42)
        s.H[F.pair + 16 * k + 11] += c * (-x19*x36 + x25*x37 + x43 + x44)
        s.H[F.pair + 16 * k + 12] += c * (-x12*x34 - x35)
        s.H[F.pair + 16 * k + 13] += c * (-x23*x34 + x40)
        s.H[F.pair + 16 * k + 14] += c * (x14*x19*x30 - x33*x34 + x43 - x44)
        s.H[F.pair + 16 * k + 15] += c * (-x14*x41 - x34*x37 + x42)
    return 0


@routine
def relative_torsion_spring_accept(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, y3, m0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.y[F.rows[k, 3]], s.memory[F.memory + 1 * k + 0]
        s.memory[F.memory + 1 * k + 0] = continued(math.atan2(y1, y0) - math.atan2(y3, y2), m0)
    return 0


@routine
def relative_torsion_spring_energy(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, y3, p0, p2, m0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.y[F.rows[k, 3]], F.numbers[k, 0], F.numbers[k, 2], s.memory[F.memory + 1 * k + 0]
        x0 = -p2 + continued(math.atan2(y1, y0) - math.atan2(y3, y2), m0)
        x1 = p0*x0
        x2 = x1/((y0 * y0) + (y1 * y1))
        x3 = x1/((y2 * y2) + (y3 * y3))
        s.energy[0] += (0.5)*p0*(x0 * x0)
        s.g[F.rows[k, 0]] += -x2*y1
        s.g[F.rows[k, 1]] += x2*y0
        s.g[F.rows[k, 2]] += x3*y3
        s.g[F.rows[k, 3]] += -x3*y2
    return 0


LAWS["relative_torsion_spring"] = ForceLaw("relative_torsion_spring", 4, 3, 0, ((0, 0), (0, 1), (0, 2), (0, 3), (1, 0), (1, 1), (1, 2), (1, 3), (2, 0), (2, 1), (2, 2), (2, 3), (3, 0), (3, 1), (3, 2), (3, 3)), 1, True, relative_torsion_spring_force, relative_torsion_spring_slopes, accept=relative_torsion_spring_accept, energy=relative_torsion_spring_energy)


@routine
def spring_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, v0, v1, v2, p0, p1, p2 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.rates[F.rows[k, 0]], s.rates[F.rows[k, 1]], s.rates[F.rows[k, 2]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2]
        x0 = (math.sqrt((y0 * y0) + (y1 * y1) + (y2 * y2) + 1.0e-60))
        x1 = (1.0 / (x0))
        x2 = x1*(-p0*(-p2 + x0) - p1*x1*(v0*y0 + v1*y1 + v2*y2))
        s.g[F.rows[k, 0]] += x2*y0
        s.g[F.rows[k, 1]] += x2*y1
        s.g[F.rows[k, 2]] += x2*y2
    return 0


@routine
def spring_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        y0, y1, y2, v0, v1, v2, p0, p1, p2 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.rates[F.rows[k, 0]], s.rates[F.rows[k, 1]], s.rates[F.rows[k, 2]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2]
        x0 = (y0 * y0)
        x1 = (y1 * y1)
        x2 = (y2 * y2)
        x3 = x0 + x1 + x2 + 1.0e-60
        x4 = gh/x3
        x5 = p1*x4
        x6 = (math.sqrt(x3))
        x7 = (1.0 / (x6))
        x8 = v0*y0 + v1*y1 + v2*y2
        x9 = p1*x7
        x10 = -p0*(-p2 + x6) - x8*x9
        x11 = -x10*x7
        x12 = (1.0 / (x3 * math.sqrt(x3)))
        x13 = x10*x12
        x14 = -p0*x7*y0 + p1*x12*x8*y0 - v0*x9
        x15 = p0*x7
        x16 = p1*x12*x8*y1 - v1*x9 - x15*y1
        x17 = x13*y0
        x18 = p1*x4*y0
        x19 = x17*y1 + x18*y1
        x20 = p1*x12*x8*y2 - v2*x9 - x15*y2
        x21 = x17*y2 + x18*y2
        x22 = y1*y2
        x23 = x13*x22 + x22*x5
        s.H[F.pair + 9 * k + 0] += c * (-x0*x13 - x0*x5 - x11 + x14*x7*y0)
        s.H[F.pair + 9 * k + 1] += c * (x16*x7*y0 - x19)
        s.H[F.pair + 9 * k + 2] += c * (x20*x7*y0 - x21)
        s.H[F.pair + 9 * k + 3] += c * (x14*x7*y1 - x19)
        s.H[F.pair + 9 * k + 4] += c * (-x1*x13 - x1*x5 - x11 + x16*x7*y1)
        s.H[F.pair + 9 * k + 5] += c * (x20*x7*y1 - x23)
        s.H[F.pair + 9 * k + 6] += c * (x14*x7*y2 - x21)
        s.H[F.pair + 9 * k + 7] += c * (x16*x7*y2 - x23)
        s.H[F.pair + 9 * k + 8] += c * (-x11 - x13*x2 - x2*x5 + x20*x7*y2)
    return 0


@routine
def spring_energy(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, p0, p2 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], F.numbers[k, 0], F.numbers[k, 2]
        x0 = (math.sqrt((y0 * y0) + (y1 * y1) + (y2 * y2) + 1.0e-60))
        x1 = -p2 + x0
        x2 = p0*x1/x0
        s.energy[0] += (0.5)*p0*(x1 * x1)
        s.g[F.rows[k, 0]] += x2*y0
        s.g[F.rows[k, 1]] += x2*y1
        s.g[F.rows[k, 2]] += x2*y2
    return 0


LAWS["spring"] = ForceLaw("spring", 3, 3, 0, ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)), 0, True, spring_force, spring_slopes, energy=spring_energy)


@routine
def one_sided_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, v0, v1, v2, p0, p1, p2, p3, p4, p5 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.rates[F.rows[k, 0]], s.rates[F.rows[k, 1]], s.rates[F.rows[k, 2]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], F.numbers[k, 3], F.numbers[k, 4], F.numbers[k, 5]
        x0 = (math.sqrt((y0 * y0) + (y1 * y1) + (y2 * y2) + 1.0e-60))
        x1 = p0*(-p3 + x0)
        x2 = p0/x0
        x3 = x2*kept(p1*ramp(x1, p4) + p2*x2*(v0*y0 + v1*y1 + v2*y2)*touch(x1, p4), p5)
        s.g[F.rows[k, 0]] += -x3*y0
        s.g[F.rows[k, 1]] += -x3*y1
        s.g[F.rows[k, 2]] += -x3*y2
    return 0


@routine
def one_sided_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        y0, y1, y2, v0, v1, v2, p0, p1, p2, p3, p4, p5 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], s.rates[F.rows[k, 0]], s.rates[F.rows[k, 1]], s.rates[F.rows[k, 2]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], F.numbers[k, 3], F.numbers[k, 4], F.numbers[k, 5]
        x0 = (y0 * y0)
        x1 = (y1 * y1)
        x2 = (y2 * y2)
        x3 = x0 + x1 + x2 + 1.0e-60
        x4 = (math.sqrt(x3))
        x5 = (1.0 / (x4))
        x6 = p0*(-p3 + x4)
        x7 = p2*(v0*y0 + v1*y1 + v2*y2)
        x8 = touch(x6, p4)
        x9 = p0*x5
        x10 = x8*x9
        x11 = p1*ramp(x6, p4) + x10*x7
        x12 = kept(x11, p5)
        x13 = p0*x12*x5
        x14 = (1.0 / (x3 * math.sqrt(x3)))
        x15 = keeps(x11, p5)
        x16 = (p0 * p0)/x3
        x17 = gh*p2*x15*x16*x8
        x18 = p1*x10
        x19 = p2*x10
        x20 = x7*y0
        x21 = p0*x14*x8
        x22 = x16*closing(x6, p4)
        x23 = v0*x19 + x18*y0 - x20*x21 + x20*x22
        x24 = x15*x9
        x25 = x24*y0
        x26 = x7*y1
        x27 = v1*x19 + x18*y1 - x21*x26 + x22*x26
        x28 = x17*y0
        x29 = -p0*x12*x14*y0*y1 + x28*y1
        x30 = x7*y2
        x31 = v2*x19 + x18*y2 - x21*x30 + x22*x30
        x32 = -p0*x12*x14*y0*y2 + x28*y2
        x33 = x24*y1
        x34 = -p0*x12*x14*y1*y2 + x17*y1*y2
        x35 = x24*y2
        s.H[F.pair + 9 * k + 0] += c * (p0*x0*x12*x14 - x0*x17 - x13 - x23*x25)
        s.H[F.pair + 9 * k + 1] += c * (-x25*x27 - x29)
        s.H[F.pair + 9 * k + 2] += c * (-x25*x31 - x32)
        s.H[F.pair + 9 * k + 3] += c * (-x23*x33 - x29)
        s.H[F.pair + 9 * k + 4] += c * (p0*x1*x12*x14 - x1*x17 - x13 - x27*x33)
        s.H[F.pair + 9 * k + 5] += c * (-x31*x33 - x34)
        s.H[F.pair + 9 * k + 6] += c * (-x23*x35 - x32)
        s.H[F.pair + 9 * k + 7] += c * (-x27*x35 - x34)
        s.H[F.pair + 9 * k + 8] += c * (p0*x12*x14*x2 - x13 - x17*x2 - x31*x35)
    return 0


@routine
def one_sided_energy(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, p0, p1, p3, p4 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 3], F.numbers[k, 4]
        x0 = (math.sqrt((y0 * y0) + (y1 * y1) + (y2 * y2) + 1.0e-60))
        x1 = p0*(-p3 + x0)
        x2 = p0*p1*ramp(x1, p4)/x0
        s.energy[0] += p1*lift(x1, p4)
        s.g[F.rows[k, 0]] += x2*y0
        s.g[F.rows[k, 1]] += x2*y1
        s.g[F.rows[k, 2]] += x2*y2
    return 0


LAWS["one_sided"] = ForceLaw("one_sided", 3, 6, 0, ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)), 0, True, one_sided_force, one_sided_slopes, energy=one_sided_energy)


@routine
def one_sided_plane_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, v0, p0, p1, p2, p3, p4 = s.y[F.rows[k, 0]], s.rates[F.rows[k, 0]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], F.numbers[k, 3], F.numbers[k, 4]
        x0 = p2 - y0
        s.g[F.rows[k, 0]] += kept(p0*ramp(x0, p3) - p1*v0*touch(x0, p3), p4)
    return 0


@routine
def one_sided_plane_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        y0, v0, p0, p1, p2, p3, p4 = s.y[F.rows[k, 0]], s.rates[F.rows[k, 0]], F.numbers[k, 0], F.numbers[k, 1], F.numbers[k, 2], F.numbers[k, 3], F.numbers[k, 4]
        x0 = p2 - y0
        x1 = touch(x0, p3)
        x2 = keeps(p0*ramp(x0, p3) - p1*v0*x1, p4)
        s.H[F.pair + 1 * k + 0] += c * (-gh*p1*x1*x2 + x2*(-p0*x1 + p1*v0*closing(x0, p3)))
    return 0


@routine
def one_sided_plane_energy(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, p0, p2, p3 = s.y[F.rows[k, 0]], F.numbers[k, 0], F.numbers[k, 2], F.numbers[k, 3]
        x0 = p2 - y0
        s.energy[0] += p0*lift(x0, p3)
        s.g[F.rows[k, 0]] += -p0*ramp(x0, p3)
    return 0


LAWS["one_sided_plane"] = ForceLaw("one_sided_plane", 1, 5, 0, ((0, 0),), 0, True, one_sided_plane_force, one_sided_plane_slopes, energy=one_sided_plane_energy)


@routine
def constant_pull_force(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, p0, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], F.numbers[k, 0], factor(s.signals, F.signals[k, 0])
        x0 = h0*p0/(math.sqrt((y0 * y0) + (y1 * y1) + (y2 * y2) + 1.0e-60))
        s.g[F.rows[k, 0]] += -x0*y0
        s.g[F.rows[k, 1]] += -x0*y1
        s.g[F.rows[k, 2]] += -x0*y2
    return 0


@routine
def constant_pull_slopes(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    c, gh = -s.c[0], s.gh[0]
    for k in range(len(F.rows)):
        y0, y1, y2, p0, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], F.numbers[k, 0], factor(s.signals, F.signals[k, 0])
        x0 = (y0 * y0)
        x1 = (y1 * y1)
        x2 = (y2 * y2)
        x3 = x0 + x1 + x2 + 1.0e-60
        x4 = h0*p0
        x5 = -x4/(math.sqrt(x3))
        x6 = x4/(x3 * math.sqrt(x3))
        x7 = x6*y0
        x8 = x7*y1
        x9 = x7*y2
        x10 = x6*y1*y2
        s.H[F.pair + 9 * k + 0] += c * (x0*x6 + x5)
        s.H[F.pair + 9 * k + 1] += c * (x8)
        s.H[F.pair + 9 * k + 2] += c * (x9)
        s.H[F.pair + 9 * k + 3] += c * (x8)
        s.H[F.pair + 9 * k + 4] += c * (x1*x6 + x5)
        s.H[F.pair + 9 * k + 5] += c * (x10)
        s.H[F.pair + 9 * k + 6] += c * (x9)
        s.H[F.pair + 9 * k + 7] += c * (x10)
        s.H[F.pair + 9 * k + 8] += c * (x2*x6 + x5)
    return 0


@routine
def constant_pull_energy(table: Any, record: Any) -> int:
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.rows)):
        y0, y1, y2, p0, h0 = s.y[F.rows[k, 0]], s.y[F.rows[k, 1]], s.y[F.rows[k, 2]], F.numbers[k, 0], factor(s.signals, F.signals[k, 0])
        x0 = (math.sqrt((y0 * y0) + (y1 * y1) + (y2 * y2) + 1.0e-60))
        x1 = h0*p0
        x2 = x1/x0
        s.energy[0] += x0*x1
        s.g[F.rows[k, 0]] += x2*y0
        s.g[F.rows[k, 1]] += x2*y1
        s.g[F.rows[k, 2]] += x2*y2
    return 0


LAWS["constant_pull"] = ForceLaw("constant_pull", 3, 1, 1, ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)), 0, False, constant_pull_force, constant_pull_slopes, energy=constant_pull_energy)
