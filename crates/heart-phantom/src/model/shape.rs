//! The heart at one volume of its cavity.

use crate::error::PhantomError;
use membrane_newton::membrane_forces::Material;
use membrane_newton::{Equilibrium, PairEquilibrium};
use revolve_voxel::{Body, Meridian, Mesh, Pose};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Millimetres of mercury in a kilopascal: mercury of 13.5951 g/cm^3 under 9.80665 m/s^2.
pub const MMHG_PER_KPA: f64 = 1000.0 / 133.322_387_415;

/// Of the distance between a surface and its triangles: one or two bring the volume to its tolerance.
const MOST_HALVINGS: usize = 8;

/// The heart at one volume gain of its cavity.
#[derive(Debug)]
pub struct HeartShape {
    pub(super) gain: f64,
    pub(super) solution: PairEquilibrium,
    pub(super) curves: [Vec<[f64; 2]>; 2],
    pub(super) body: Body,
    pub(super) _life: Life,
}

/// How many shapes of a heart there are, kept by it or held by others.
#[derive(Debug, Default)]
pub(super) struct Alive {
    now: AtomicUsize,
    most: AtomicUsize,
}

impl Alive {
    /// For a new shape.
    pub(super) fn life(self: &Arc<Self>) -> Life {
        let now = 1 + self.now.fetch_add(1, Ordering::Relaxed);
        self.most.fetch_max(now, Ordering::Relaxed);
        Life(self.clone())
    }

    /// How many there are, and the most that there were at a time.
    pub(super) fn counts(&self) -> [usize; 2] {
        [&self.now, &self.most].map(|n| n.load(Ordering::Relaxed))
    }
}

/// Counts the shape that holds it as alive.
#[derive(Debug)]
pub(super) struct Life(Arc<Alive>);

impl Drop for Life {
    fn drop(&mut self) {
        self.0.now.fetch_sub(1, Ordering::Relaxed);
    }
}

impl HeartShape {
    /// Volume gain of the cavity, `(V - V_rest) / V_rest`.
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// The two membranes in equilibrium.
    pub fn solution(&self) -> &PairEquilibrium {
        &self.solution
    }

    /// Nodes `[x, y]` of the inner and the outer membrane in the body frame, from one side of the
    /// base over the apex to the other, in cm.
    pub fn curves(&self) -> [&[[f64; 2]]; 2] {
        [&self.curves[0], &self.curves[1]]
    }

    /// Volumes within the inner and the outer membrane in cm^3.
    pub fn volumes(&self) -> [f64; 2] {
        [
            self.solution.inner.measures.volume,
            self.solution.outer.measures.volume,
        ]
    }

    /// Pressures across the inner and the outer membrane in mmHg, if both are of rubber with moduli in kPa: the cavity is above the
    /// surroundings by their sum.
    pub fn pressures_mmhg(&self) -> Option<[f64; 2]> {
        let of_rubber = |solved: &&Equilibrium| match solved.membrane().material() {
            Material::Springs { .. } => false,
            Material::Rubber(_) => true,
        };
        let both = [&self.solution.inner, &self.solution.outer];
        (both.iter().all(of_rubber)).then(|| both.map(|solved| MMHG_PER_KPA * solved.intensity))
    }

    /// The largest distance of the outer membrane from the axis, cm.
    pub fn radius(&self) -> f64 {
        self.curves[1]
            .iter()
            .fold(0.0, |most: f64, [_, y]| most.max(y.abs()))
    }

    /// From the plane of the base to the inner apex, cm.
    pub fn cavity_length(&self) -> f64 {
        let [apex, base] = [0.5, 0.0].map(|s| self.solution.inner.at(s).position[0]);
        apex - base
    }

    /// Relative change of the wall's volume since rest.
    pub fn wall_volume_error(&self) -> f64 {
        self.solution.wall_volume_error
    }

    /// The surface of the inner (0) or the outer membrane (1) in the lab, cm: triangles that enclose the body's volume to a relative
    /// error `tolerance`.
    ///
    /// # Errors
    /// [`PhantomError::Solid`] if there is no such layer, for a tolerance that is not positive, or one that needs too many triangles;
    /// [`PhantomError::NotMeshed`] where rounding leaves the volume fewer digits than the tolerance has.
    pub fn mesh(&self, layer: usize, tolerance: f64) -> Result<Mesh, PhantomError> {
        self.mesh_standing(*self.body.pose(), layer, tolerance)
    }

    /// The same of the heart in another place.
    pub(crate) fn mesh_standing(
        &self,
        pose: Pose,
        layer: usize,
        tolerance: f64,
    ) -> Result<Mesh, PhantomError> {
        let body = self.body.standing(pose);
        let Some(solid) = body.layers().get(layer).map(Meridian::measures) else {
            return Ok(body.mesh(layer, tolerance)?);
        };
        // A surface that is off by this everywhere is off by so much of the volume.
        let mut distance = tolerance * solid.volume / solid.surface;
        let mut reached = f64::INFINITY;
        for _ in 0..MOST_HALVINGS {
            let mesh = body.mesh(layer, distance)?;
            reached = (mesh.volume() / solid.volume - 1.0).abs();
            if reached <= tolerance {
                return Ok(mesh);
            }
            distance *= 0.5;
        }
        Err(PhantomError::NotMeshed { reached, tolerance })
    }

    /// The solid in the lab: region 0 is the cavity, region 1 the wall.
    pub fn body(&self) -> &Body {
        &self.body
    }
}
