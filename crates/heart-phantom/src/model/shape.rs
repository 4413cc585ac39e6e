//! The shape of the heart at one cavity volume.

use crate::error::{PhantomError, missed};
use membrane_newton::membrane_forces::Material;
use membrane_newton::{Equilibrium, PairEquilibrium};
use revolve_voxel::{Body, Meridian, Mesh, Pose};

/// Millimetres of mercury per kilopascal: mercury of 13.5951 g/cm^3, 9.80665 m/s^2.
pub const MMHG_PER_KPA: f64 = 1000.0 / 133.322_387_415;

/// The term of errors of meshes, which are due to rounding at a large distance from the origin.
pub(crate) const MESH_VOLUME: &str = "volume of a mesh";
/// Refinements of the distance between surface and mesh: one or two reach the volume tolerance.
const MOST_HALVINGS: usize = 8;

/// The shape of the heart at one volume gain.
#[derive(Debug)]
pub struct HeartShape {
    pub(super) gain: f64,
    pub(super) solution: PairEquilibrium,
    pub(super) curves: [Vec<[f64; 2]>; 2],
    pub(super) body: Body,
}

impl HeartShape {
    /// Returns the volume gain of the cavity, `(V - V_ref) / V_ref`.
    #[must_use]
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// Returns the equilibria of both membranes.
    #[must_use]
    pub fn solution(&self) -> &PairEquilibrium {
        &self.solution
    }

    /// Returns the nodes `[x, y]` of the inner and the outer membrane in the body frame, from one side of the base over the apex to
    /// the other, in cm. With spectral elements these are the few nodes of polynomials, between which the membranes are curved: draw
    /// [`Equilibrium::at`] of [`HeartShape::solution`].
    #[must_use]
    pub fn curves(&self) -> [&[[f64; 2]]; 2] {
        [&self.curves[0], &self.curves[1]]
    }

    /// Returns the volumes within the inner and the outer membrane in cm^3.
    #[must_use]
    pub fn volumes(&self) -> [f64; 2] {
        [
            self.solution.inner.measures.volume,
            self.solution.outer.measures.volume,
        ]
    }

    /// Returns the pressures across the inner and the outer membrane in mmHg, if both are rubber with moduli in kPa. Their sum is
    /// the cavity pressure relative to the surroundings.
    #[must_use]
    pub fn pressures_mmhg(&self) -> Option<[f64; 2]> {
        let of_rubber = |solved: &&Equilibrium| match solved.membrane().material() {
            Material::Springs { .. } => false,
            Material::Rubber(_) => true,
        };
        let both = [&self.solution.inner, &self.solution.outer];
        (both.iter().all(of_rubber)).then(|| both.map(|solved| MMHG_PER_KPA * solved.intensity))
    }

    /// Returns the largest distance of the outer membrane from the axis, cm.
    pub(crate) fn radius(&self) -> f64 {
        self.curves[1]
            .iter()
            .fold(0.0, |most: f64, [_, y]| most.max(y.abs()))
    }

    /// Returns the length of the cavity from the base to the inner apex, cm.
    pub(crate) fn cavity_length(&self) -> f64 {
        let [apex, base] = [0.5, 0.0].map(|s| self.solution.inner.at(s).position[0]);
        apex - base
    }

    /// Returns a mesh of the inner (0) or outer membrane (1) in a pose, cm. Its volume has the relative error `tolerance`.
    pub(crate) fn mesh(
        &self,
        pose: Pose,
        layer: usize,
        tolerance: f64,
    ) -> Result<Mesh, PhantomError> {
        let body = self.body.with_pose(pose);
        let Some(solid) = body.layers().get(layer).map(Meridian::mass_properties) else {
            return Ok(body.mesh(layer, tolerance)?);
        };
        // A uniform offset of the surface by this amount changes the volume by the tolerance.
        let mut distance = tolerance * solid.volume / solid.surface;
        let mut reached = f64::INFINITY;
        for k in 0..MOST_HALVINGS {
            // The number of attempts is not known in advance: each is half of the remaining progress.
            let all = 1 << MOST_HALVINGS;
            let _part = simd_set::part(all - (all >> k)..all - (all >> (k + 1)), all);
            let mesh = body.mesh(layer, distance)?;
            reached = (mesh.volume() / solid.volume - 1.0).abs();
            if reached <= tolerance {
                return Ok(mesh);
            }
            distance *= 0.5;
        }
        Err(missed(MESH_VOLUME, reached, [tolerance; 2]))
    }

    /// Returns the solid in the lab: layer 0 is the cavity, layer 1 the wall.
    #[must_use]
    pub fn body(&self) -> &Body {
        &self.body
    }
}
