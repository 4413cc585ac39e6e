//! Ground truth of motion: displacement, velocity and strain of the wall's material.

use super::Phantom;
use super::phases::{Moment, ScenePhase};
use crate::Wall;
use crate::error::PhantomError;

/// Share of a beat between the two moments of which a velocity is the difference quotient.
const STEP: f64 = 1e-3;

/// The motion of the wall from end-diastole at end-expiration to a given time, on the voxels of the wall at the reference.
/// `[z][y][x]`, the components of a voxel next to each other, zeros outside the wall.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MotionField {
    /// Where the material at a voxel's centre is at that moment, less the centre: along the lab's x, y and z, cm.
    pub displacement: Vec<f32>,
    /// How fast it moves then: x, y, z, cm/s. A difference quotient over a thousandth of a beat. By the beat alone ([`Phantom::motion`]),
    /// or by beat and breath ([`Phantom::motion_of`]).
    pub velocity: Vec<f32>,
    /// Green's strain, in the wall's own directions at end-diastole: radial, circumferential, longitudinal, and the shears rc, rl, cl
    /// ([`GreenStrain::NAMES`](crate::GreenStrain::NAMES)).
    pub strain: Vec<f32>,
    /// Numbers of the voxels whose centres are in the wall at end-diastole, rising.
    pub voxels: Vec<usize>,
}

/// The motion of a material point to some moment.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct PointMotion {
    /// Where it is in the lab, cm.
    pub position_cm: [f64; 3],
    /// From where it is at end-diastole at end-expiration.
    pub displacement_cm: [f64; 3],
    /// How fast beat and breath move it, as in [`Phantom::motion_of`].
    pub velocity_cm_per_s: [f64; 3],
    /// Green's strain since end-diastole: rr, cc, ll, rc, rl, cl.
    pub strain: [f64; 6],
}

/// What `report.json` has of the motion to a phase.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct MotionReport {
    /// What the phase stands for, as in [`PhaseReport`](crate::PhaseReport).
    pub of: String,
    /// Torsion since end-diastole: the twist from base to apex, in the mean of both membranes, over the cavity's length at end-diastole.
    pub torsion_degrees_per_cm: f64,
    /// Shortening of the cavity since end-diastole, base to inner apex, as a share of its length then.
    pub longitudinal_shortening: f64,
    /// The phantom's points, in their order.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Vec::is_empty"))]
    pub points: Vec<PointMotion>,
}

/// The walls between which motion is told: at the start, then, and shortly before and after then.
struct Walls {
    from: Wall,
    to: Wall,
    around: [Wall; 2],
    /// Between the last two.
    seconds: f64,
}

impl Phantom {
    /// The moment from which motion is counted: end-diastole at end-expiration.
    pub fn reference(&self) -> Moment {
        let [_, diastole] = self.extreme_phases();
        diastole.into()
    }

    /// The wall at a moment as material that slides and twists: positions, displacements, strains between any two moments.
    ///
    /// ```
    /// use heart_phantom::{MaterialPoint, Phantom, Scene};
    /// let phantom = Phantom::new(Scene::default().with_size(32))?;
    /// let walls = [phantom.wall(phantom.reference())?, phantom.wall(0.0)?];
    /// let point = MaterialPoint { layer: 0.5, s: 0.2, azimuth: 0.0 };
    /// let strain = walls[0].deformation(&walls[1], &point)?.strain();
    /// assert!(strain.radial > 0.0); // it thickens
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Phantom::shape`]; [`PhantomError::NoMaterial`] where the wall has no material coordinates.
    pub fn wall(&self, at: impl Into<Moment>) -> Result<Wall, PhantomError> {
        let at = at.into();
        self.wall_at(self.cycle().gain(at.phase), at.breath)
    }

    /// The wall at a volume of the cavity and a place of the breath.
    pub(super) fn wall_at(&self, gain: f64, breath: f64) -> Result<Wall, PhantomError> {
        let (rest, shape) = (self.heart().rest()?, self.shape_at_gain(gain)?);
        let pose = self.pose(breath)?;
        let made = || -> Result<Wall, PhantomError> {
            let wall = Wall::sliding(&shape, &Wall::new(&rest)?)?.standing(pose);
            let twist = self.parts().twist.as_ref();
            Ok(match twist {
                None => wall,
                Some(twist) => wall.twisted(twist.scaled(self.cycle().emptied(gain))),
            })
        };
        made().map_err(|source| PhantomError::NoMaterial {
            gain,
            source: Box::new(source),
        })
    }

    /// The motion from end-diastole at end-expiration to a moment, on the camera's voxels. Velocities are those of the beat, the breath held.
    ///
    /// # Errors
    /// As [`Phantom::wall`].
    pub fn motion(&self, to: impl Into<Moment>) -> Result<MotionField, PhantomError> {
        self.field(&self.walls(to.into(), None)?)
    }

    /// The same to one of [`Phantom::phases`]. In a respiratory gate by phase velocities are those of beat and breath together, in its
    /// middle; a gate by amplitude the breath passes both ways, as far in as out: its part cancels out in the mean, and they are those of
    /// the beat.
    ///
    /// # Errors
    /// As [`Phantom::wall`].
    pub fn motion_of(&self, to: &ScenePhase) -> Result<MotionField, PhantomError> {
        self.field(&self.walls(to.moment(), to.breath_phase)?)
    }

    fn field(&self, walls: &Walls) -> Result<MotionField, PhantomError> {
        let (grid, slices) = (self.camera().grid(), 0..self.camera().n_rows());
        let from = &walls.from;
        let displacement = from.displacements(&walls.to, grid, slices.clone())?;
        let strain = from.strains(&walls.to, grid, slices.clone())?;
        let around = walls.around.each_ref();
        let velocity = from.velocities(around, walls.seconds, grid, slices)?;
        Ok(MotionField {
            voxels: displacement.iter().map(|(voxel, _)| *voxel).collect(),
            displacement: spread(&displacement, grid.len()),
            velocity: spread(&velocity, grid.len()),
            strain: spread(&strain, grid.len()),
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

    fn motion_report(&self, at: &ScenePhase) -> Result<MotionReport, PhantomError> {
        let walls = self.walls(at.moment(), at.breath_phase)?;
        let points = self.parts().points.iter().map(|point| {
            let (here, there) = (walls.from.position(point)?, walls.to.position(point)?);
            Ok(PointMotion {
                position_cm: there.coords.into(),
                displacement_cm: (there - here).into(),
                velocity_cm_per_s: Wall::velocity(walls.around.each_ref(), walls.seconds, point)?,
                strain: (walls.from.deformation(&walls.to, point)?)
                    .strain()
                    .components(),
            })
        });
        let points = points.collect::<Result<_, PhantomError>>()?;
        let [length, now] = [self.reference(), at.moment()]
            .map(|at| Ok::<_, PhantomError>(self.shape(at.phase)?.cavity_length()));
        let (length, now) = (length?, now?);
        let twist = |gain: f64| {
            let twist = self.parts().twist.as_ref();
            twist.map_or(0.0, |twist| {
                self.cycle().emptied(gain) * twist.base_to_apex()
            })
        };
        Ok(MotionReport {
            of: at.of.to_string(),
            torsion_degrees_per_cm: twist(self.cycle().gain(at.phase)) / length,
            longitudinal_shortening: 1.0 - now / length,
            points,
        })
    }

    /// With the phase of the breath it goes on around that, or else is held.
    fn walls(&self, to: Moment, breath_phase: Option<f64>) -> Result<Walls, PhantomError> {
        let seconds = STEP * self.cycle().period();
        let near = |by: f64| {
            let breathing = self.cycle().breathing().zip(breath_phase);
            self.wall(Moment {
                phase: to.phase + by * STEP,
                breath: breathing.map_or(to.breath, |(breathing, phase)| {
                    breathing.at_phase(
                        (phase + by * seconds / breathing.breathing().period).rem_euclid(1.0),
                    )
                }),
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

/// The components of some voxels among those of all, the rest zero.
fn spread<const N: usize>(of: &[(usize, [f32; N])], voxels: usize) -> Vec<f32> {
    let mut all = vec![0.0; N * voxels];
    for (voxel, components) in of {
        all[N * voxel..][..N].copy_from_slice(components);
    }
    all
}
