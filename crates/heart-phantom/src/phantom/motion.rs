//! Ground truth of motion: displacement, velocity and strain of the wall.

use super::Phantom;
use super::phases::{MotionPhase, ScenePhase};
use crate::error::{PhantomError, check, zeros};
use crate::{HeartShape, Twist, Wall};

/// Time step of the velocity's difference quotient, as a fraction of a cycle.
const STEP: f64 = 1e-3;

/// Motion of the wall from end-diastole at end-expiration to a given time, on the voxels of the wall at the reference. `[z][y][x]`,
/// components of a voxel adjacent, zero outside the wall.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MotionField {
    /// Displacement of the material at the voxel's centre along x, y, z of the lab, cm.
    pub displacement: Vec<f32>,
    /// Velocity along x, y, z, cm/s: the difference quotient over a thousandth of a cycle, centred at the given time, of the membrane positions, with
    /// the material sliding along the tangent of its layer. It is accurate to 1e-3 cm/s with
    /// [spectral elements](crate::scene::DiscretisationSettings::Spectral). Finite differences give polygons, between which displacements have jumps
    /// of about 1e-3 cm (801 nodes); velocities differ from those of spectral elements by up to 3 % of the largest.
    pub velocity: Vec<f32>,
    /// Green's strain in the directions of the wall at end-diastole: radial, circumferential, longitudinal, and the shears rc, rl, cl
    /// ([`GreenStrain::NAMES`](crate::GreenStrain::NAMES)).
    pub strain: Vec<f32>,
    /// Indices of the voxels whose centres are in the wall at end-diastole, ascending.
    pub voxels: Vec<usize>,
}

/// Motion of a material point to a given time.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PointMotion {
    /// Position in the lab, cm.
    pub position_cm: [f64; 3],
    /// Displacement from end-diastole at end-expiration.
    pub displacement_cm: [f64; 3],
    /// Velocity of beat and respiration, as in [`Phantom::motion`].
    pub velocity_cm_per_s: [f64; 3],
    /// Green's strain since end-diastole: rr, cc, ll, rc, rl, cl.
    pub strain: [f64; 6],
}

/// The entry of `report.json` on the motion to a phase.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct MotionReport {
    /// Name of the phase, as in [`PhaseReport`](crate::PhaseReport).
    pub of: String,
    /// Torsion since end-diastole: twist from base to apex, averaged over both membranes, divided by the length of the cavity at
    /// end-diastole.
    pub torsion_degrees_per_cm: f64,
    /// Relative shortening of the cavity from base to inner apex since end-diastole.
    pub longitudinal_shortening: f64,
    /// The phantom's points, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<PointMotion>,
}

/// The walls of a motion: reference, current, and shortly before and after.
struct Walls {
    from: Wall,
    to: Wall,
    around: [Wall; 2],
    /// Time between the last two.
    seconds: f64,
}

impl Phantom {
    /// Returns the reference of motion: end-diastole at end-expiration.
    #[must_use]
    pub fn reference(&self) -> MotionPhase {
        let [_, diastole] = self.cycle().extreme_phases();
        diastole.into()
    }

    /// Returns the wall at a motion phase as a material with twist: positions, displacements, strains between any two phases.
    ///
    /// ```
    /// use heart_phantom::{MaterialPoint, Phantom, Scene};
    /// let phantom = Phantom::new(Scene::default().with_size(32))?;
    /// let walls = [phantom.wall(phantom.reference())?, phantom.wall(0.0)?];
    /// let point = MaterialPoint { layer: 0.5, s: 0.2, azimuth: 0.0 };
    /// let strain = walls[0].deformation(&walls[1], &point)?.strain();
    /// assert!(strain.radial > 0.0); // the wall thickens
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Phantom::shape`] and [`Phantom::pose`]; [`PhantomError::NoMaterial`] if the wall has no material coordinates.
    pub fn wall(&self, at: impl Into<MotionPhase>) -> Result<Wall, PhantomError> {
        let at = at.into();
        let phase = check("phase", at.phase, [f64::MIN, f64::MAX])?;
        self.wall_at(self.cycle().gain(phase), at.breath)
    }

    /// Returns the wall at a volume gain and a respiratory position.
    pub(super) fn wall_at(&self, gain: f64, breath: f64) -> Result<Wall, PhantomError> {
        let (rest, shape) = (self.heart().reference_shape()?, self.shape_at_gain(gain)?);
        let pose = self.pose(breath)?;
        let made = || -> Result<Wall, PhantomError> {
            let wall = |shape: &HeartShape| Wall::new(shape.solution(), pose);
            let wall = wall(&shape)?.sliding_from(&wall(&rest)?);
            Ok(match &self.scene().twist {
                None => wall,
                Some(twist) => wall.twisted(twist.scaled(self.cycle().emptied(gain))),
            })
        };
        made().map_err(|source| PhantomError::NoMaterial {
            gain,
            source: Box::new(source),
        })
    }

    /// Returns the motion from end-diastole at end-expiration to a motion phase, on the camera's voxels. Velocities are the sum of cardiac and
    /// respiratory velocities at a [`MotionPhase::breath_phase`], as in the middle of a respiratory gate by phase. Otherwise they are cardiac
    /// only; in a gate by amplitude, inspiration and expiration cancel in the average.
    ///
    /// # Errors
    /// As [`Phantom::wall`]; [`PhantomError::OutOfRange`] for a respiratory phase outside 0 to 1.
    pub fn motion(&self, to: impl Into<MotionPhase>) -> Result<MotionField, PhantomError> {
        let walls = self.walls(to.into())?;
        let (grid, slices) = (self.camera().grid(), 0..self.camera().n_rows());
        let from = &walls.from;
        let part = simd_set::part(0..1, 3);
        let displacement = from.displacements(&walls.to, grid, slices.clone())?;
        drop(part);
        let part = simd_set::part(1..2, 3);
        let strain = from.strains(&walls.to, grid, slices.clone())?;
        drop(part);
        let _part = simd_set::part(2..3, 3);
        let around = walls.around.each_ref();
        let velocity = from.velocities((&walls.to, around), walls.seconds, grid, slices)?;
        Ok(MotionField {
            voxels: displacement.iter().map(|(voxel, _)| *voxel).collect(),
            displacement: spread(&displacement, grid.len())?,
            velocity: spread(&velocity, grid.len())?,
            strain: spread(&strain, grid.len())?,
        })
    }

    /// Torsion, shortening and the motion of the phantom's points at each of [`Phantom::phases`].
    ///
    /// # Errors
    /// As [`Phantom::wall`].
    pub fn motion_reports(&self) -> Result<Vec<MotionReport>, PhantomError> {
        let phases = self.phases();
        phases.iter().map(|at| self.motion_report(at)).collect()
    }

    fn motion_report(
        &self,
        ScenePhase { of, at }: &ScenePhase,
    ) -> Result<MotionReport, PhantomError> {
        let walls = self.walls(*at)?;
        let points = self.scene().points.iter().map(|settings| {
            let point = &settings.point();
            let (here, there) = (walls.from.position(point)?, walls.to.position(point)?);
            Ok(PointMotion {
                position_cm: there.coords.into(),
                displacement_cm: (there - here).into(),
                velocity_cm_per_s: (walls.to).velocity(
                    walls.around.each_ref(),
                    walls.seconds,
                    point,
                )?,
                strain: (walls.from.deformation(&walls.to, point)?)
                    .strain()
                    .components(),
            })
        });
        let points = points.collect::<Result<_, PhantomError>>()?;
        let length = |phase| Ok::<_, PhantomError>(self.shape(phase)?.cavity_length());
        let (length, now) = (length(self.reference().phase)?, length(at.phase)?);
        let emptied = self.cycle().emptied(self.cycle().gain(at.phase));
        let twist = (self.scene().twist.as_ref()).map_or(0.0, Twist::base_to_apex);
        Ok(MotionReport {
            of: of.to_string(),
            torsion_degrees_per_cm: emptied * twist / length,
            longitudinal_shortening: 1.0 - now / length,
            points,
        })
    }

    /// Returns the wall in the reference phase, at `to`, and half a step before and after it. Respiration is constant without `breath_phase`.
    fn walls(&self, to: MotionPhase) -> Result<Walls, PhantomError> {
        let breath_phase = to.breath_phase.unwrap_or_default();
        check("respiratory phase", breath_phase, [0.0, 1.0])?;
        let seconds = STEP * self.cycle().period();
        let near = |by: f64| {
            let breathing = self.cycle().breathing().zip(to.breath_phase);
            self.wall(MotionPhase {
                phase: to.phase + by * STEP,
                breath: breathing.map_or(to.breath, |(breathing, phase)| {
                    breathing.at_phase(
                        (phase + by * seconds / breathing.breathing().period).rem_euclid(1.0),
                    )
                }),
                ..to
            })
        };
        Ok(Walls {
            from: self.wall(self.reference())?,
            to: self.wall(to)?,
            around: [near(-0.5)?, near(0.5)?],
            seconds,
        })
    }
}

/// Distributes the components of some voxels to all voxels; the others are zero.
fn spread<const N: usize>(
    of: &[(usize, [f32; N])],
    voxels: usize,
) -> Result<Vec<f32>, PhantomError> {
    let mut all: Vec<f32> = zeros("components of the motion", N * voxels)?;
    for (voxel, components) in of {
        all[N * voxel..][..N].copy_from_slice(components);
    }
    Ok(all)
}
