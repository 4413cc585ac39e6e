"""SciPy's solve_bvp on the rubber balloon of benches/membrane.rs: half the meridian, two mapped pieces.

h = 8.5, R = 1.75, neo-Hookean mu h = 1, volume gain 0.3, ring fixed. Along the reference arc length S from the apex, with r0 the distance
from the axis there: x, y, b = r0 W_1 y' / l1 (the meridian's force across the axis, per angle), the volume so far. Its part along the axis
is that of the pressure, a = r0 W_1 x' / l1 = -p y^2 / 2. Parameters are the stretch at the apex and p; given are R and the volume.
Prints one row a tolerance in the format of the Rust benches, which `cargo xtask report --peers` collects.
Run: pip install -r requirements.txt && python rubber.py
"""

import json
import time

import numpy as np
from scipy.integrate import solve_bvp

from objects import times

H, R, GAIN = 8.5, 1.75, 0.3
VOLUME = np.pi * R**2 * (H + 2 * R / 3) * (1 + GAIN)
PRESSURE = 0.256444419246
CAP = R * np.pi / 2
FIRST = 1e-5 * CAP  # where the series about the apex is left; its error is of the order of the square


def stretch(tension, l2):
    """l1 with l1 - l1^-3 l2^-2 = tension, by Newton."""
    l1 = np.maximum(tension, 1.0)
    for _ in range(60):
        step = (l1 - l1**-3 * l2**-2 - tension) / (1 + 3 * l1**-4 * l2**-2)
        l1 = np.maximum(l1 - step, 0.3 * l1)
        if np.max(np.abs(step)) < 1e-15:
            break
    return l1


def equation(t, q, unknown):
    """The cap from its apex on, then the cylinder to the ring, each over t in [0, 1]."""
    out = np.empty_like(q)
    p = unknown[1]
    for k, (begin, size) in enumerate(((FIRST, CAP - FIRST), (0, H))):
        _, y, b, _ = q[4 * k : 4 * k + 4]
        r = R * np.sin((begin + size * t) / R) if k == 0 else R
        y = np.maximum(y, 0.3 * r)
        a = -0.5 * p * y * y
        force = np.hypot(a, b)
        l2 = y / r
        l1 = stretch(force / r, l2)
        dx, dy = l1 * a / force, l1 * b / force
        # b' = W_2 - p y |x'|: the hoop's pull against the pressure
        out[4 * k : 4 * k + 4] = size * np.array([dx, dy, l2 - l2**-3 * l1**-2 + p * y * dx, -np.pi * y * y * dx])
    return out


def ends(a, b, unknown):
    apex = unknown[0]
    r = R * np.sin(FIRST / R)
    series = [a[0], a[1] - apex * r, a[2] - r * (apex - apex**-5), a[3]]
    return np.array([*series, *(b[:4] - a[4:]), b[5] - R, b[7] - VOLUME])


def start(t):
    """The reference configuration, uniformly inflated except at the ring."""
    angle = (FIRST + (CAP - FIRST) * t) / R
    sin, cos = np.sin(angle), np.cos(angle)
    wide = 1.15 - 0.15 * np.exp(-3 * H * (1 - t))
    zero = 0 * t
    return np.array([
        R * (cos - 1), 1.15 * R * sin, 0.6 * R * sin * cos, 15 * t,
        -R - H * t, wide * R, zero + 0.01, 15 + (VOLUME - 15) * t,
    ])


def main():
    mesh = np.linspace(0, 1, 41)
    for tolerance in (1e-3, 1e-5, 1e-7, 1e-9):
        seconds = []
        for _ in range(9):
            begin = time.perf_counter()
            solution = solve_bvp(equation, ends, mesh, start(mesh), p=[1.15, 0.25], tol=tolerance, max_nodes=20_000)
            seconds.append(time.perf_counter() - begin)
        assert solution.success, solution.message
        error = abs(solution.p[1] / PRESSURE - 1)
        row = {"study": "static solve", "method": "SciPy solve_bvp", "case": "rubber balloon at a gain of 0.3, from rest",
               "size": int(solution.x.size), "threads": 1, **times(seconds), "error": float(error),
               "error_kind": "relative error of the pressure (reference good to 2e-12)"}
        print("row", json.dumps(row))


if __name__ == "__main__":
    main()
