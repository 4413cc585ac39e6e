"""Pressure that inflates a neo-Hookean disc of finite thickness, by FElupe's axisymmetric solid elements.

Radius 1, shear modulus 1, bulk modulus BULK; pressure on the lower face. The volume is that under the deformed middle surface of the disc,
which differs from the volume under the lower face by half of the volume of the disc. Two edges: `hinged`, the mean displacement of the rim's
face is zero (the face may rotate and become thinner), and `clamped`, all points of the face are fixed. Prints, for each edge, volume and
thickness, the pressure over (mu h / R), extrapolated from meshes of N / 2 and N elements across the thickness (order 2), and the change by
the extrapolation.
Run: pip install -r requirements.txt && python disc_felupe.py
"""
import json

import felupe
import numpy as np
from scipy.sparse import bmat, csr_matrix
from scipy.sparse.linalg import splu

BULK = 1e7
VOLUMES = [0.5, 1.19181877167, 3.0]
THICKNESSES = [0.1, 0.05, 0.025, 0.0125]


class Disc:
    """Points (axial, radial); free numbers, border of the edge, and nodes of the middle surface."""

    def __init__(self, thickness, across, edge):
        along = round(across / thickness)
        mesh = felupe.Rectangle(a=(-thickness / 2, 0), b=(thickness / 2, 1), n=(across + 1, along + 1))
        self.h, self.mesh = thickness, mesh
        self.field = felupe.FieldContainer([felupe.FieldAxisymmetric(felupe.RegionQuad(mesh), dim=2)])
        self.solid = felupe.SolidBodyNearlyIncompressible(felupe.NeoHooke(mu=1), self.field, bulk=BULK)
        z, r = mesh.points.T
        below = felupe.RegionQuadBoundary(mesh, only_surface=True, mask=z < -thickness / 2 + 1e-12, ensure_3d=True)
        face = felupe.FieldContainer([felupe.FieldAxisymmetric(below, dim=2)])
        self.pressure = felupe.SolidBodyPressure(face, pressure=1.0)
        fixed = np.zeros_like(mesh.points, bool)
        fixed[r < 1e-12, 1] = True
        rim = np.flatnonzero(r > 1 - 1e-12)
        if edge == "clamped":
            fixed[rim] = True
        self.free = np.flatnonzero(~fixed.ravel())
        self.border = np.zeros((0 if edge == "clamped" else 2, fixed.size))
        if edge == "hinged":
            weight = np.full(len(rim), 1 / across)
            weight[np.abs(z[rim]) > thickness / 2 - 1e-12] /= 2
            for k in range(2):
                self.border[k, 2 * rim + k] = weight
        middle = np.flatnonzero(np.abs(z) < 1e-12)
        self.middle = middle[np.argsort(r[middle])]

    def volume(self, u):
        """Volume between the middle surface and the plane of the edge, with its gradient: frusta of the polyline."""
        z, r = (self.mesh.points + u)[self.middle].T
        outer, inner = slice(1, None), slice(None, -1)
        drop, square = z[inner] - z[outer], r[outer] ** 2 + r[outer] * r[inner] + r[inner] ** 2
        gradient = np.zeros_like(u)
        gradient[self.middle[inner], 0] += square
        gradient[self.middle[outer], 0] -= square
        gradient[self.middle[outer], 1] += drop * (2 * r[outer] + r[inner])
        gradient[self.middle[inner], 1] += drop * (2 * r[inner] + r[outer])
        # the cylinder under the last point
        gradient[self.middle[-1], 0] += 3 * r[-1] ** 2
        gradient[self.middle[-1], 1] += 6 * r[-1] * z[-1]
        return np.pi / 3 * (np.sum(drop * square) + 3 * r[-1] ** 2 * z[-1]), np.pi / 3 * gradient.ravel()

    def forces(self, pressure):
        """Inner forces, those of a unit pressure, and the tangent of their sum."""
        inner = self.solid.assemble.vector(self.field).toarray().ravel()
        # the item has the sign of an external force
        unit = -self.pressure.assemble.vector(self.field, pressure=1.0)
        unit.resize(inner.size, 1)
        turned = -self.pressure.assemble.matrix(self.field, pressure=1.0)
        tangent = self.solid.assemble.matrix()
        turned.resize(*tangent.shape)
        return inner, unit.toarray(), (tangent + pressure * turned).tocsr()

    def inflate(self, volume, pressure):
        """The pressure at this volume, in steps of a seventh of the volume; a flat disc starts at a tenth of its own. Newton's method for the
        displacements, the forces of the edge and the pressure."""
        u, free = self.field[0].values, self.free
        reactions = np.zeros(len(self.border))
        start = max(self.volume(u)[0], 0.1 * self.h)
        for target in np.geomspace(start, volume, 1 + int(np.ceil(np.log(volume / start) / np.log(8 / 7))))[1:]:
            for _ in range(40):
                inner, unit, tangent = self.forces(pressure)
                found, gradient = self.volume(u)
                force = inner + pressure * unit[:, 0] + reactions @ self.border
                rest = np.concatenate([force[free], self.border @ u.ravel(), [found - target]])
                columns = np.hstack([self.border.T, unit])[free]
                rows = np.vstack([self.border, gradient])[:, free]
                matrix = bmat([[tangent[free][:, free], csr_matrix(columns)], [csr_matrix(rows), None]], format="csc")
                moved, forced = np.split(-splu(matrix).solve(rest), [len(free)])
                u.reshape(-1)[free] += moved
                reactions += forced[:-1]
                pressure += forced[-1]
                if np.abs(moved).max() < 1e-10:
                    break
            else:
                raise SystemExit(f"no convergence: thickness {self.h}, volume {target}")
        return pressure


def pressures(thickness, across, edge):
    """Pressures at VOLUMES over mu h / R."""
    disc, pressure, found = Disc(thickness, across, edge), 0.0, []
    for volume in VOLUMES:
        pressure = disc.inflate(volume, pressure)
        found.append(pressure / thickness)
    return np.array(found)


def main():
    for edge in ("hinged", "clamped"):
        for thickness in THICKNESSES:
            coarse, fine = (pressures(thickness, across, edge) for across in (4, 8))
            best = fine + (fine - coarse) / 3
            for volume, p, change in zip(VOLUMES, best, best - fine):
                print("row", json.dumps({"edge": edge, "thickness": thickness, "volume": volume, "pressure": float(p), "change": float(change)}), flush=True)


if __name__ == "__main__":
    main()
