"""Pressure that inflates a flat neo-Hookean membrane of radius 1, by SfePy's membrane elements (`dw_tl_membrane`).

The membrane, mu h = 1, closes a cylinder of height 1 that is filled with a fluid: a solid of the shear modulus SOFT whose volume is prescribed. The
cylinder's other faces are fixed. Linear tetrahedra and triangles on N rings; prints the pressures on N and 2 N rings and the value that is
extrapolated from both (order 2). The volume is that under the membrane.
Run: pip install -r requirements.txt && python disc_sfepy.py
"""
import json

import numpy as np
from sfepy.base.base import output
from sfepy.discrete import Equation, Equations, FieldVariable, Function, Functions, Integral, Material, Problem
from sfepy.discrete.conditions import Conditions, EssentialBC
from sfepy.discrete.fem import FEDomain, Field, Mesh
from sfepy.solvers.ls import ScipyDirect
from sfepy.solvers.nls import Newton
from sfepy.terms import Term

VOLUME = 1.19181877167
SOFT = 1e-9


def cylinder(rings):
    """Points and tetrahedra: rings of 6 k points at the radius k / rings at z = 0 and z = 1; each prism between them is cut into three."""
    angles = lambda k: 2 * np.pi * np.arange(6 * k) / (6 * k)
    flat = [[0.0, 0.0]] + [[k / rings * np.cos(a), k / rings * np.sin(a)] for k in range(1, rings + 1) for a in angles(k)]
    at = lambda k, i: 1 + 3 * k * (k - 1) + i % (6 * k) if k else 0
    triangles = []
    for k in range(1, rings + 1):
        for outer in range(6 * k):
            inner = outer // k * (k - 1) + outer % k
            triangles.append([at(k, outer), at(k, outer + 1), at(k - 1, inner)])
            if outer % k + 1 < k:
                triangles.append([at(k, outer + 1), at(k - 1, inner + 1), at(k - 1, inner)])
    points = np.array([[*xy, z] for z in (0, 1) for xy in flat])
    cells = []
    for a, b, c in map(sorted, triangles):
        up = len(flat)
        cells += [[a, b, c, c + up], [a, b, b + up, c + up], [a, a + up, b + up, c + up]]
    cells = np.array(cells)
    turned = np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]]) < 0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    return points, cells


def pressure(rings):
    points, cells = cylinder(rings)
    domain = FEDomain("domain", Mesh.from_data("cylinder", points, None, [cells], [np.zeros(len(cells), int)], ["3_4"]))
    fixed = Function("fixed", lambda x, domain=None: np.flatnonzero((np.hypot(x[:, 0], x[:, 1]) > 1 - 1e-6) | (x[:, 2] < 1e-6)))
    omega = domain.create_region("Omega", "all")
    top = domain.create_region("Top", "vertices in z > 0.999999", "facet")
    held = domain.create_region("Held", "vertices by fixed", "vertex", functions=Functions([fixed]))
    displacement = Field.from_args("displacement", np.float64, 3, omega, 1)
    constant = Field.from_args("pressure", np.float64, 1, omega, 0, "L2", "constant")
    u, v = FieldVariable("u", "unknown", displacement), FieldVariable("v", "test", displacement, primary_var_name="u")
    p, q = FieldVariable("p", "unknown", constant), FieldVariable("q", "test", constant, primary_var_name="p")
    body = np.abs(np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]])).sum() / 6
    material = Material("m", soft=SOFT, a1=0.5, a2=0.0, h0=1.0, ratio=1 + VOLUME / body)
    integral = Integral("i", order=2)
    term = lambda text, region, **names: Term.new(text, integral, region, m=material, **names)
    balance = (term("dw_tl_he_neohook(m.soft, v, u)", omega, v=v, u=u) + term("dw_tl_membrane(m.a1, m.a2, m.h0, v, u)", top, v=v, u=u)
               + Term.new("dw_tl_bulk_pressure(v, u, p)", integral, omega, v=v, u=u, p=p))
    volume = Term.new("dw_tl_volume(q, u)", integral, omega, q=q, u=u) - term("dw_volume_lvf(m.ratio, q)", omega, q=q)
    problem = Problem("disc", equations=Equations([Equation("balance", balance), Equation("volume", volume)]))
    problem.set_bcs(ebcs=Conditions([EssentialBC("held", held, {"u.all": 0.0})]))
    linear = ScipyDirect({"use_presolve": False, "use_mtx_digest": False})
    problem.set_solver(Newton({"i_max": 60, "eps_a": 1e-11, "eps_r": 1e-9, "lin_red": None, "ls_on": 10.0}, lin_solver=linear))
    # a paraboloid, with a deflection that decreases linearly to the bottom
    start = np.zeros_like(points)
    start[:, 2] = 2 * VOLUME / np.pi * (1 - np.sum(points[:, :2] ** 2, axis=1)) * points[:, 2]
    problem.time_update()
    variables = problem.get_initial_state()
    variables.set_state_parts({"u": start.ravel(), "p": np.ones(constant.n_nod)})
    state = problem.solve(state0=variables(), save_results=False)
    return float(state.get_state_parts()["p"][-1])


def main():
    output.set_output(quiet=True)
    coarse, fine = (pressure(rings) for rings in (16, 32))
    print("row", json.dumps({"volume": VOLUME, "coarse": coarse, "fine": fine, "pressure": fine + (fine - coarse) / 3}))


if __name__ == "__main__":
    main()
