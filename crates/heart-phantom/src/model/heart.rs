//! The heart: two membranes with the wall between them; shapes are solved on demand.

use super::base::Descent;
use super::shape::HeartShape;
use super::shape_cache::ShapeCache;
use crate::error::PhantomError;
use membrane_newton::{
    Discretisation, Equilibrium, Membrane, NewtonError, NewtonOptions, Pair, ReferenceShape,
    Rubber, Solver, Stiffness, StrainEnergy,
};
use rayon::prelude::*;
use revolve_voxel::{Body, Meridian, Piece, Pose};
use std::f64::consts::FRAC_PI_4;
use std::sync::{Arc, OnceLock};

/// Dimensions of the reference configuration of a membrane: a cylinder closed by a hemisphere (Rohmer et al. 2006, Table 1).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Balloon {
    /// Length of the cylinder in cm.
    pub length: f64,
    /// Radius of cylinder and hemisphere in cm.
    pub radius: f64,
    /// Stiffness of the membrane.
    pub stiffness: f64,
}

impl Balloon {
    /// The endocardial membrane, the inner balloon of Table 1: 8.5 cm, radius 1.75 cm, stiffness 1.
    pub const INNER: Self = Self {
        length: 8.5,
        radius: 1.75,
        stiffness: 1.0,
    };
    /// The epicardial membrane, the outer balloon of Table 1: 8.5 cm, radius 2.75 cm, stiffness 1.
    pub const OUTER: Self = Self {
        length: 8.5,
        radius: 2.75,
        stiffness: 1.0,
    };

    /// Returns the membrane with its stiffness under the pressure of Eq. 3.
    ///
    /// # Errors
    /// [`PhantomError::Balloon`] for a dimension or stiffness that is not finite and positive.
    pub fn membrane(&self) -> Result<Membrane, PhantomError> {
        let rest = ReferenceShape::balloon(self.length, self.radius)?;
        Ok(Membrane::new(rest).with_stiffness(Stiffness::constant(self.stiffness)?))
    }

    /// Returns the membrane as rubber of reference `thickness` in cm under a pressure. The stiffness is not used.
    ///
    /// # Errors
    /// [`PhantomError::Balloon`] for a dimension or thickness that is not finite and positive, or invalid constants of the strain
    /// energy.
    pub fn of_rubber(
        &self,
        energy: StrainEnergy,
        thickness: f64,
    ) -> Result<Membrane, PhantomError> {
        let rest = ReferenceShape::balloon(self.length, self.radius)?;
        let rubber = Rubber::new(energy, membrane_newton::Thickness::constant(thickness)?)?;
        Ok(Membrane::new(rest).with_rubber(rubber))
    }
}

/// Two coaxial membranes in the lab. Shapes are solved on demand and cached, shared by clones, up to [512
/// MiB](Heart::DEFAULT_MEMORY) or [a given limit](Heart::with_memory).
///
/// ```
/// use heart_phantom::Heart;
/// let heart = Heart::study(201)?;
/// let shapes = heart.shapes(&[0.0, 0.6, 0.0])?;
/// assert_eq!(heart.shapes_solved(), 2); // equal gains share a shape
/// let [inner, outer] = shapes[1].volumes();
/// assert!((inner / shapes[0].volumes()[0] - 1.6).abs() < 1e-12);
/// assert!(shapes[1].solution().wall_volume_error.abs() < 1e-10); // the wall is incompressible
/// # let _ = outer;
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Heart {
    pair: Pair,
    /// The definition of the pair.
    membranes: [Membrane; 2],
    discretisation: Discretisation,
    descent: Option<Descent>,
    /// Tolerance of the body surface for polynomial membranes, cm.
    tolerance: f64,
    /// Reference length from the base to the outer apex, cm.
    length: f64,
    pose: Pose,
    memory: usize,
    shape_bytes: OnceLock<usize>,
    /// Bytes of the defects of a shape.
    pub(crate) defect_bytes: usize,
    /// Shared by clones, so that each shape is solved once.
    kept: Arc<ShapeCache>,
}

/// Memory per cone of a body surface including search structures (96 bytes, 48 in its chain, about 20 of boxes), and per node of a curve (a point and
/// half of a node of the solution). `tests/memory.rs` measures both.
const CONE_BYTES: f64 = 164.0;
const NODE_BYTES: f64 = 24.0;
/// Ratio of the number of cones of a dilated surface to that of the reference configuration, at equal tolerance.
const DILATED: f64 = 1.6;
/// Rounding tolerance for crossing membranes, as a fraction of the length.
const ROUNDING: f64 = 1e-9;

impl Heart {
    /// Default memory for shapes in bytes.
    pub const DEFAULT_MEMORY: usize = 512 << 20;

    /// Any two membranes, inner and outer. Finite differences give bodies bounded by the polygons through their nodes; spectral
    /// elements give bodies that follow the polynomials to `tolerance` cm.
    ///
    /// # Errors
    /// [`PhantomError::Membrane`] for an invalid discretisation, or if the outer membrane encloses at most the volume of the inner one or
    /// crosses it at an end or apex. Other crossings are detected when shapes are solved: [`PhantomError::Crossed`] of [`Heart::shapes`].
    pub fn of_membranes(
        [inner, outer]: [&Membrane; 2],
        discretisation: Discretisation,
        tolerance: f64,
        pose: Pose,
    ) -> Result<Self, PhantomError> {
        let solver = |membrane| Solver::new(membrane, discretisation);
        Ok(Self {
            pair: Pair::new(solver(inner)?, solver(outer)?)?,
            membranes: [inner.clone(), outer.clone()],
            discretisation,
            descent: None,
            tolerance,
            length: outer.reference().at(0.5).position[0],
            pose,
            memory: Self::DEFAULT_MEMORY,
            shape_bytes: OnceLock::new(),
            defect_bytes: 0,
            kept: Arc::default(),
        })
    }

    /// Sets the memory limit for shapes in bytes. Views that need more shapes are computed in parts, and evicted shapes are solved
    /// again when needed. Results are bitwise identical.
    ///
    /// ```
    /// use heart_phantom::Heart;
    /// let heart = Heart::study(201)?;
    /// let two = 2 * heart.shape_bytes();
    /// let heart = heart.with_memory(two);
    /// for gain in [0.0, 0.1, 0.2, 0.3] {
    ///     heart.shapes(&[gain])?;
    /// }
    /// assert_eq!((heart.shapes_solved(), heart.shapes_alive()), (4, [2, 2]));
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    #[must_use]
    pub fn with_memory(mut self, bytes: usize) -> Self {
        self.memory = bytes;
        self
    }

    /// The heart of the study: the balloons of Table 1 of the paper, rotated by 45 degrees about x and then about y so that the axis points
    /// along `(1/2, -sqrt(2)/2, 1/2)`, with the axis point `(h + R_outer) / 2` at the origin.
    ///
    /// # Errors
    /// [`PhantomError::Membrane`] for too few nodes.
    pub fn study(nodes: usize) -> Result<Self, PhantomError> {
        let middle = (Balloon::OUTER.length + Balloon::OUTER.radius) / 2.0;
        let pose = Pose::axis_along_z(middle)?
            .rotated_x(FRAC_PI_4)?
            .rotated_y(FRAC_PI_4)?;
        let [inner, outer] = [Balloon::INNER.membrane()?, Balloon::OUTER.membrane()?];
        let differences = Discretisation::FiniteDifferences { nodes };
        Self::of_membranes([&inner, &outer], differences, 0.0, pose)
    }

    /// Returns the shapes at the given volume gains, in their order. Equal gains are solved once, also across calls. Each shape is
    /// solved from the reference configuration and does not depend on earlier calls. Parallel and bitwise independent of the number
    /// of threads.
    ///
    /// # Errors
    /// [`PhantomError::Membrane`] if a gain cannot be reached; [`PhantomError::Crossed`] if the membranes intersect, as for
    /// membranes of very different form.
    pub fn shapes(&self, gains: &[f64]) -> Result<Vec<Arc<HeartShape>>, PhantomError> {
        let (mut there, missing) = self.kept.take(gains, self.most_shapes());
        let new: Vec<Result<_, _>> = missing
            .par_iter()
            .map(|&gain| {
                simd_set::checkpoint();
                self.solve(gain).map(Arc::new)
            })
            .collect();
        // The first of several errors, independent of the order of threads.
        let new: Vec<Arc<HeartShape>> = new.into_iter().collect::<Result<_, _>>()?;
        self.kept.add(&new);
        there.extend(new.into_iter().map(|shape| (shape.gain().to_bits(), shape)));
        Ok(gains
            .iter()
            .map(|gain| there[&gain.to_bits()].clone())
            .collect())
    }

    /// Returns the shape that defines the material coordinates.
    ///
    /// # Errors
    /// As [`Heart::shapes`].
    pub fn reference_shape(&self) -> Result<Arc<HeartShape>, PhantomError> {
        Ok(self.shapes(&[0.0])?.remove(0))
    }

    /// Sets the atrioventricular-plane displacement in cm from the larger of two volume gains (end-diastole) to the smaller
    /// (end-systole), proportional to the volume, with a fixed outer apex. Zero leaves results bitwise identical.
    ///
    /// In healthy adults it is 16 mm and causes 60 % of the stroke volume (Carlsson et al. 2007, Am J Physiol Heart Circ Physiol
    /// 293:H1452, doi:10.1152/ajpheart.01148.2006).
    ///
    /// The reference configurations are shortened along the axis at each volume until the outer apex is at its position. The
    /// volumes of cavity and wall are separate equations, exact to rounding.
    ///
    /// ```
    /// use heart_phantom::Heart;
    /// let heart = Heart::study(201)?.with_av_plane_displacement(1.6, [0.0, 0.6])?;
    /// let shapes = heart.shapes(&[0.6, 0.0])?;
    /// let ring = |k: usize| shapes[k].curves()[1][0][0];
    /// assert!((ring(1) - ring(0) - 1.6).abs() < 1e-12);
    /// let apex = |k: usize| shapes[k].solution().outer.at(0.5).position[0];
    /// assert!((apex(1) - apex(0)).abs() < 1e-9);
    /// assert!(shapes[1].solution().wall_volume_error.abs() < 1e-12);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for a displacement below 0 or above [`Heart::length`], and invalid gains.
    #[doc(alias("AVPD", "MAPSE"))]
    pub fn with_av_plane_displacement(
        mut self,
        cm: f64,
        gains: [f64; 2],
    ) -> Result<Self, PhantomError> {
        let descent = Descent::new(cm, gains, self.length)?;
        if descent != self.descent {
            // Earlier shapes belong to another heart.
            (self.descent, self.kept) = (descent, Arc::default());
        }
        Ok(self)
    }

    /// Returns the displacement of the base at a volume gain, cm.
    #[must_use]
    pub fn av_plane_displacement(&self, gain: f64) -> f64 {
        (self.descent.as_ref()).map_or(0.0, |descent| descent.at(gain))
    }

    /// Returns the number of shapes solved so far.
    #[must_use]
    pub fn shapes_solved(&self) -> usize {
        self.kept.solved()
    }

    /// Returns the number of shapes in memory, cached or referenced, and the largest number so far.
    #[must_use]
    pub fn shapes_alive(&self) -> [usize; 2] {
        self.kept.alive()
    }

    /// Returns the number of shapes that fit into its memory, at least one.
    pub(crate) fn most_shapes(&self) -> usize {
        (self.memory / self.bytes_with_defects()).max(1)
    }

    /// Returns the estimated bytes of a shape with its defects.
    pub(crate) fn bytes_with_defects(&self) -> usize {
        self.shape_bytes() + self.defect_bytes
    }

    /// Returns the estimated bytes of a shape without defects, from the reference configuration; solves nothing.
    #[must_use]
    pub fn shape_bytes(&self) -> usize {
        *self.shape_bytes.get_or_init(|| {
            let of = |solver: &Solver| {
                let start = solver.start();
                let curve = start.points();
                let cones = (self.meridian(&start, &curve)).map_or(curve.len(), |m| m.n_segments());
                let dilated = if start.pieces().is_empty() {
                    1.0
                } else {
                    DILATED
                };
                NODE_BYTES * curve.len() as f64 + CONE_BYTES * dilated * cones as f64
            };
            (of(self.pair.inner()) + of(self.pair.outer())) as usize
        })
    }

    /// Returns the reference length and radius of the heart, cm.
    pub(crate) fn reference_extent(&self) -> [f64; 2] {
        let most = |[x, r]: [f64; 2], [px, py]: [f64; 2]| [f64::max(x, px), f64::max(r, py)];
        (self.pair.outer().start().points().into_iter()).fold([0.0; 2], most)
    }

    /// Reference length from the base to the outer apex, cm.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Returns the volume of the cavity in the discretised reference configuration, mL.
    pub(crate) fn reference_volume(&self) -> f64 {
        self.pair.inner().start_measures().volume
    }

    /// Returns the pair of membrane solvers.
    #[must_use]
    pub fn pair(&self) -> &Pair {
        &self.pair
    }

    /// Returns the tolerance of bodies for polynomial membranes, cm.
    pub(crate) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Returns the heart with its shapes in another pose; existing bodies of shapes do not move.
    pub(crate) fn with_pose(&self, pose: Pose) -> Self {
        Self {
            pose,
            ..self.clone()
        }
    }

    /// Returns the pose; with respiratory motion that at end-expiration.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    fn solve(&self, gain: f64) -> Result<HeartShape, PhantomError> {
        let pair = match &self.descent {
            Some(descent) if descent.at(gain) > 0.0 => {
                let [inner, outer] = &self.membranes;
                descent.solve([inner, outer], self.discretisation, &self.pair, gain)
            }
            _ => (self.pair.solve_gain(gain, &NewtonOptions::default())).map_err(Into::into),
        };
        let solution = pair.map_err(|error| match error {
            PhantomError::Membrane(NewtonError::Crossed { depth, x, r }) => {
                PhantomError::Crossed { gain, depth, x, r }
            }
            error => error,
        })?;
        let curves = [solution.inner.points(), solution.outer.points()];
        let layers = [(&solution.inner, &curves[0]), (&solution.outer, &curves[1])]
            .into_iter()
            .map(|(membrane, curve)| self.meridian(membrane, curve))
            .collect::<Result<_, _>>()?;
        let length = curves[1].iter().fold(0.0, |most: f64, [x, _]| most.max(*x));
        match Body::nested(layers, self.pose, self.tolerance + ROUNDING * length) {
            Err(revolve_voxel::RevolveError::NotNested { depth, x, r, .. }) => {
                Err(PhantomError::Crossed { gain, depth, x, r })
            }
            body => Ok(HeartShape {
                gain,
                solution,
                curves,
                body: body?,
            }),
        }
    }

    /// Returns the upper half of a membrane, base to apex.
    fn meridian(
        &self,
        membrane: &Equilibrium,
        curve: &[[f64; 2]],
    ) -> Result<Meridian, PhantomError> {
        let pieces: Vec<Piece> = (membrane.pieces().into_iter())
            .filter(|piece| piece.to <= 0.5)
            .map(|piece| Piece::Chebyshev {
                x: piece.x,
                r: piece.y,
            })
            .collect();
        Ok(if pieces.is_empty() {
            Meridian::from_full_curve(curve)?
        } else {
            Meridian::smooth(&pieces, self.tolerance)?
        })
    }
}
