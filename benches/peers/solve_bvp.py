"""SciPy's solve_bvp on the balloon of benches/membrane.rs: half the curve, two mapped pieces.

R = 1.75, h = 8.5, lambda = 1, f = 17.5 per unit of material length. Prints one row a tolerance in
the format of the Rust benches, which `cargo xtask report --peers` collects.
Run: pip install -r requirements.txt && python solve_bvp.py
"""

import json
import time

import numpy as np
from scipy.integrate import solve_bvp

from objects import times

H, R, F = 8.5, 1.75, 17.5
VOLUME = 148.86748016
LENGTH = 2 * H + np.pi * R
CYLINDER = H / LENGTH  # s at which the cap begins
CAP = 0.5 - CYLINDER  # s from there to the apex


def equation(t, q):
    """Both pieces at once, each over t in [0, 1]: x, y, dx/ds, dy/ds of the first, then of the second."""
    out = np.empty_like(q)
    angle = np.pi / 2 * (1 - t)
    bend = R * (LENGTH / R) ** 2
    rest = (np.zeros((2, t.size)), -bend * np.array([np.cos(angle), np.sin(angle)]))
    for k, (size, second) in enumerate(zip((CYLINDER, CAP), rest)):
        x1, y1 = q[4 * k + 2], q[4 * k + 3]
        speed = np.hypot(x1, y1)
        out[4 * k : 4 * k + 2] = size * q[4 * k + 2 : 4 * k + 4]
        out[4 * k + 2] = size * (second[0] + F * y1 / speed)
        out[4 * k + 3] = size * (second[1] - F * x1 / speed)
    return out


def ends(a, b):
    """Fixed at the base, smooth between the pieces, mirror-symmetric at the apex."""
    return np.array([a[0], a[1] - R, *(b[:4] - a[4:]), b[5], b[6]])


def rest_shape(t):
    angle = np.pi / 2 * (1 - t)
    ones = np.ones_like(t)
    return np.array([
        H * t, R * ones, LENGTH * ones, 0 * t,
        H + R * np.cos(angle), R * np.sin(angle), LENGTH * np.sin(angle), -LENGTH * np.cos(angle),
    ])


def volume(solution):
    """pi times the integral of y^2 dx by Gauss quadrature on every mesh interval."""
    points, weights = np.polynomial.legendre.leggauss(10)
    total = 0.0
    for left, right in zip(solution.x[:-1], solution.x[1:]):
        q = solution.sol(0.5 * (left + right) + 0.5 * (right - left) * points)
        for k, size in enumerate((CYLINDER, CAP)):
            total += 0.5 * (right - left) * size * np.sum(weights * q[4 * k + 1] ** 2 * q[4 * k + 2])
    return np.pi * total


def main():
    mesh = np.linspace(0, 1, 11)
    for tolerance in (1e-3, 1e-5, 1e-7, 1e-9):
        seconds = []
        for _ in range(9):
            begin = time.perf_counter()
            solution = solve_bvp(equation, ends, mesh, rest_shape(mesh), tol=tolerance, max_nodes=100_000)
            seconds.append(time.perf_counter() - begin)
        assert solution.success, solution.message
        error = abs(volume(solution) / VOLUME - 1)
        row = {"study": "static solve", "method": "SciPy solve_bvp", "case": "balloon at f = 17.5, from rest",
               "size": int(solution.x.size), "threads": 1, **times(seconds), "error": float(error),
               "error_kind": "relative volume error (reference good to 3e-11)"}
        print("row", json.dumps(row))


if __name__ == "__main__":
    main()
