"""Angles that count their turns: arguments of plane vectors on a motion, and the turns made between its stored states."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...core.notices import notify

# a turn is lost at a change of pi: half of that is left to what the expected change errs by
DOUBT = 1.5  #: change of an angle from one stored state to the next beside the expected one, above which a turn may be lost [rad]


def angle_and_rates(y: np.ndarray, rate: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Argument of plane vectors y (s, 2), in (-pi, pi] [rad], and its first and second derivative [rad/s, rad/s2], (s,) each.

        theta' = (y_0 y_1' - y_1 y_0') / |y|^2,    theta'' = (y_0 y_1'' - y_1 y_0'' - 2 (y . y') theta') / |y|^2

    `rate` and `change` are y' and y'' (s, 2).
    """
    square, along = np.sum(y * y, axis=1), np.sum(y * rate, axis=1)
    speed = (y[:, 0] * rate[:, 1] - y[:, 1] * rate[:, 0]) / square
    return np.arctan2(y[:, 1], y[:, 0]), speed, (y[:, 0] * change[:, 1] - y[:, 1] * change[:, 0] - 2.0 * along * speed) / square


def plane_vectors(y: np.ndarray, rate: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Plane vectors (s, 2) whose argument is an angle, and their two derivatives, of rows y with these derivatives.

        (y_0, y_1);    (a . b, b x a) of two plane vectors a and b;    (u . p, u . q) of vectors in space

    Rows are (s, 2) of one arm; (s, 4) of two arms a and b, from the second of which the angle counts; or (s, 9) of u, and of p
    and q normal to the axis, which another place carries.
    """
    if y.shape[1] == 2:
        return y, rate, change
    found = []
    for part in (y, rate, change):
        if part.shape[1] == 4:
            found.append((part[:, :2], np.stack([part[:, 2:], np.column_stack([-part[:, 3], part[:, 2]])], axis=1)))
        else:
            found.append((part[:, :3], part[:, 3:].reshape(-1, 2, 3)))
    (u, w), (du, dw), (ddu, ddw) = found
    product = partial(np.einsum, "sc,skc->sk")
    return product(u, w), product(du, w) + product(u, dw), product(ddu, w) + 2.0 * product(du, dw) + product(u, ddw)


def continuous(name: str, times: np.ndarray, angle: np.ndarray, speed: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """An angle (s,) known but for whole turns, with the turns that its angular velocity makes between the stored states.

    h / 2 (w0 + w1) + h^2 / 12 (w0' - w1') is its change up to h^5 w'''' / 720, so that states may be far apart. A notice where
    that leaves a doubt.
    """
    h = np.diff(times)
    expected = 0.5 * h * (speed[1:] + speed[:-1]) + h * h / 12.0 * (acceleration[:-1] - acceleration[1:])
    turns = np.round((expected - np.diff(angle)) / (2 * np.pi))
    found = angle + 2 * np.pi * np.append(0.0, np.cumsum(turns))
    if np.abs(np.diff(found) - expected).max(initial=0.0) > DOUBT:
        notify(f"{name}: stored states are too far apart to count the turns of the angle for certain; store more of them")
    return found
