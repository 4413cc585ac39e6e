//! The heart: two balloons with the wall between them, whose shapes are solved when asked for.

use super::base::Descent;
use super::kept::Kept;
use super::shape::HeartShape;
use crate::error::PhantomError;
use membrane_newton::{
    Discretisation, Equilibrium, Membrane, NewtonOptions, Pair, RestShape, Rubber, Solver,
    Stiffness, StrainEnergy,
};
use rayon::prelude::*;
use revolve_voxel::{Body, Meridian, Piece, Pose};
use std::f64::consts::FRAC_PI_4;
use std::sync::{Arc, OnceLock};

/// Dimensions of a balloon at rest: a cylinder closed by a hemisphere (Rohmer et al. 2006, Table 1).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
pub struct Balloon {
    /// Length of the cylinder in cm.
    pub length: f64,
    /// Radius of cylinder and hemisphere in cm.
    pub radius: f64,
    /// Stiffness of the membrane.
    pub stiffness: f64,
}

impl Balloon {
    /// The inner balloon of Table 1, the endocardium: 8.5 cm, radius 1.75 cm, stiffness 1.
    pub const INNER: Self = Self {
        length: 8.5,
        radius: 1.75,
        stiffness: 1.0,
    };
    /// The outer balloon of Table 1, the epicardium: 8.5 cm, radius 2.75 cm, stiffness 1.
    pub const OUTER: Self = Self {
        length: 8.5,
        radius: 2.75,
        stiffness: 1.0,
    };

    /// The membrane of this balloon: its rest shape with its stiffness, under the pressure of Eq. 3.
    ///
    /// # Errors
    /// [`PhantomError::Balloon`] for a dimension or stiffness that is not finite and positive.
    pub fn membrane(&self) -> Result<Membrane, PhantomError> {
        let rest = RestShape::balloon(self.length, self.radius)?;
        Ok(Membrane::new(rest).with_stiffness(Stiffness::constant(self.stiffness)?))
    }

    /// The same balloon of rubber, `thickness` cm thick at rest, under a pressure. Its stiffness is not used.
    ///
    /// # Errors
    /// [`PhantomError::Balloon`] for a dimension or thickness that is not finite and positive, or constants that no rubber has.
    pub fn of_rubber(
        &self,
        energy: StrainEnergy,
        thickness: f64,
    ) -> Result<Membrane, PhantomError> {
        let rest = RestShape::balloon(self.length, self.radius)?;
        let rubber = Rubber::new(energy, membrane_newton::Thickness::constant(thickness)?)?;
        Ok(Membrane::new(rest).with_rubber(rubber))
    }
}

/// Two concentric balloons standing in the lab. Shapes are solved when first asked for and kept, for copies of the heart too, as many as fit into
/// [512 MiB](Heart::DEFAULT_MEMORY) or [what it is given](Heart::with_memory).
///
/// ```
/// use heart_phantom::Heart;
/// let heart = Heart::study(201)?;
/// let shapes = heart.shapes(&[0.0, 0.6, 0.0])?;
/// assert_eq!(heart.shapes_solved(), 2); // equal gains share a shape
/// let [inner, outer] = shapes[1].volumes();
/// assert!((inner / shapes[0].volumes()[0] - 1.6).abs() < 1e-12);
/// assert!(shapes[1].wall_volume_error().abs() < 1e-10); // water does not compress
/// # let _ = outer;
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Heart {
    pair: Pair,
    /// What the pair is of.
    membranes: [Membrane; 2],
    discretisation: Discretisation,
    descent: Option<Descent>,
    /// How far the body may be from membranes that are no polygons.
    tolerance: f64,
    /// From the base to the outer apex at rest, cm.
    length: f64,
    pose: Pose,
    memory: usize,
    shape_bytes: OnceLock<usize>,
    /// Copies share it, so that no shape is solved again for them.
    kept: Arc<Kept>,
}

/// Memory of a cone of a body's surface with all that finds it: 96 bytes, 48 in its chain, some 20 of boxes; and of a node of a
/// curve, as a point and as half of a node of the solution. `tests/memory.rs` measures them.
const CONE_BYTES: f64 = 164.0;
const NODE_BYTES: f64 = 24.0;
/// Cones that follow a smooth surface to a tolerance when it is dilated, for one at rest, where the sides are straight.
const DILATED: f64 = 1.6;
/// What rounding may put of one membrane outside the other, as a share of the length.
const ROUNDING: f64 = 1e-9;

impl Heart {
    /// Memory for shapes, in bytes, if nothing else is said.
    pub const DEFAULT_MEMORY: usize = 512 << 20;

    /// Two balloons under the pressure law of Eq. 3, discretised with `nodes` nodes each, standing
    /// in `pose` (body frame: x from the base to the apex).
    ///
    /// # Errors
    /// [`PhantomError::Balloon`] for a dimension or stiffness that is not finite and positive; else as [`Heart::of_membranes`].
    pub fn new(
        inner: Balloon,
        outer: Balloon,
        nodes: usize,
        pose: Pose,
    ) -> Result<Self, PhantomError> {
        let differences = Discretisation::FiniteDifferences { nodes };
        Self::of_membranes(
            [&inner.membrane()?, &outer.membrane()?],
            differences,
            0.0,
            pose,
        )
    }

    /// Any two membranes, the inner and the outer one. Finite differences give bodies bounded by the polygons through
    /// their nodes; spectral elements give polynomials, which the bodies follow to `tolerance` cm.
    ///
    /// # Errors
    /// [`PhantomError::Membrane`] for a discretisation of nothing, or if the outer membrane does not enclose more volume than the inner one.
    /// Whether one lies within the other everywhere is seen where shapes are solved: [`PhantomError::Crossed`] of [`Heart::shapes`].
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
            length: outer.rest().at(0.5).position[0],
            pose,
            memory: Self::DEFAULT_MEMORY,
            shape_bytes: OnceLock::new(),
            kept: Arc::default(),
        })
    }

    /// The same with another bound, in bytes, on the memory of its shapes: no more of them are kept, and views that need more are
    /// taken part by part. It changes no bit of any result. A shape that is needed again after others had to take its place is
    /// solved again.
    ///
    /// ```
    /// use heart_phantom::Heart;
    /// let heart = Heart::study(201)?;
    /// let two = 2 * heart.shape_bytes();
    /// let heart = heart.with_memory(two);
    /// for gain in [0.0, 0.1, 0.2, 0.3] {
    ///     heart.shapes(&[gain])?;
    /// }
    /// assert_eq!((heart.shapes_solved(), heart.shapes_alive()), (4, 2));
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    pub fn with_memory(mut self, bytes: usize) -> Self {
        self.memory = bytes;
        self
    }

    /// The study's heart: the balloons of Table 1, the axis turned by 45 degrees about x and then
    /// about y so that it points along `(1/2, -sqrt(2)/2, 1/2)`, the axis point `(h + R_outer) / 2`
    /// at the origin.
    ///
    /// # Errors
    /// [`PhantomError::Membrane`] for too few nodes.
    pub fn study(nodes: usize) -> Result<Self, PhantomError> {
        let middle = (Balloon::OUTER.length + Balloon::OUTER.radius) / 2.0;
        let pose = Pose::axis_along_z(middle)?
            .turned_x(FRAC_PI_4)?
            .turned_y(FRAC_PI_4)?;
        Self::new(Balloon::INNER, Balloon::OUTER, nodes, pose)
    }

    /// The shapes at the given volume gains, in their order. Equal gains are solved once, also
    /// from one call to the next; each is solved from rest, so that a shape does not depend on
    /// what was asked for before. In parallel, with the same bits for any number of threads.
    ///
    /// # Errors
    /// [`PhantomError::Membrane`] if a gain cannot be reached; [`PhantomError::Crossed`] if no wall is left somewhere, as between
    /// balloons of very different form.
    pub fn shapes(&self, gains: &[f64]) -> Result<Vec<Arc<HeartShape>>, PhantomError> {
        let (mut there, missing) = self.kept.take(gains, self.most_shapes());
        let new: Vec<Result<_, _>> = missing
            .par_iter()
            .map(|&gain| self.solve(gain).map(Arc::new))
            .collect();
        // Of several errors the first, whichever thread was faster.
        let new: Vec<Arc<HeartShape>> = new.into_iter().collect::<Result<_, _>>()?;
        self.kept.add(&new);
        there.extend(new.into_iter().map(|shape| (shape.gain().to_bits(), shape)));
        Ok(gains
            .iter()
            .map(|gain| there[&gain.to_bits()].clone())
            .collect())
    }

    /// The shape on whose membranes material coordinates are counted.
    ///
    /// # Errors
    /// As [`Heart::shapes`].
    pub fn rest(&self) -> Result<Arc<HeartShape>, PhantomError> {
        Ok(self.shapes(&[0.0])?.remove(0))
    }

    /// The same heart, the plane of whose base goes down, towards the apex, by so many cm from the larger of two volume gains, at
    /// end-diastole, to the smaller, at end-systole, in proportion to the volume; the outer apex rests meanwhile. Zero is the heart
    /// without it, to the bit.
    ///
    /// Of healthy adults it is 16 mm, and the epicardial area that comes down with it is 60 % of the stroke volume (Carlsson et al. 2007,
    /// Am J Physiol Heart Circ Physiol 293:H1452, doi:10.1152/ajpheart.01148.2006).
    ///
    /// The membranes are those of a muscle that shortens: at each volume their rest shapes are drawn together along the axis until the
    /// outer apex is where it was. Cavity and wall keep their volumes as equations, to rounding.
    ///
    /// ```
    /// use heart_phantom::Heart;
    /// let heart = Heart::study(201)?.with_base_descent(1.6, [0.0, 0.6])?;
    /// let shapes = heart.shapes(&[0.6, 0.0])?;
    /// let ring = |k: usize| shapes[k].curves()[1][0][0];
    /// assert!((ring(1) - ring(0) - 1.6).abs() < 1e-12);
    /// let apex = |k: usize| shapes[k].solution().outer.at(0.5).position[0];
    /// assert!((apex(1) - apex(0)).abs() < 1e-9);
    /// assert!(shapes[1].wall_volume_error().abs() < 1e-12);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for a descent below 0 or above 10 cm, and gains that are none.
    pub fn with_base_descent(mut self, cm: f64, gains: [f64; 2]) -> Result<Self, PhantomError> {
        let descent = Descent::new(cm, gains)?;
        if descent != self.descent {
            // Shapes so far are of another heart.
            (self.descent, self.kept) = (descent, Arc::default());
        }
        Ok(self)
    }

    /// How far the base has gone down at a volume gain, cm.
    pub fn base_descent(&self, gain: f64) -> f64 {
        (self.descent.as_ref()).map_or(0.0, |descent| descent.at(gain))
    }

    /// How many shapes have been solved so far.
    pub fn shapes_solved(&self) -> usize {
        self.kept.solved()
    }

    /// How many shapes there are at the moment, kept by the heart or held by others.
    pub fn shapes_alive(&self) -> usize {
        self.kept.alive.counts()[0]
    }

    /// The most shapes that there were at a time.
    pub fn most_shapes_alive(&self) -> usize {
        self.kept.alive.counts()[1]
    }

    /// How many shapes fit into its memory; one at least.
    pub fn most_shapes(&self) -> usize {
        (self.memory / self.shape_bytes()).max(1)
    }

    /// About how many bytes a shape takes, from the shape at rest; nothing is solved for it.
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

    /// Length and radius of the heart at rest, cm.
    pub(crate) fn rest_extent(&self) -> [f64; 2] {
        let most = |[x, r]: [f64; 2], [px, py]: [f64; 2]| [f64::max(x, px), f64::max(r, py)];
        (self.pair.outer().start().points().into_iter()).fold([0.0; 2], most)
    }

    /// From the base to the outer apex at rest, cm.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The two membranes, ready to be solved.
    pub fn pair(&self) -> &Pair {
        &self.pair
    }

    /// How far bodies may be from membranes that are no polygons, cm.
    pub(crate) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// The same heart, its shapes among them, standing elsewhere; bodies of shapes stand where they did.
    pub(crate) fn standing(&self, pose: Pose) -> Self {
        Self {
            pose,
            ..self.clone()
        }
    }

    /// Where the heart stands, of one that breathes at end-expiration.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    fn solve(&self, gain: f64) -> Result<HeartShape, PhantomError> {
        let solution = match &self.descent {
            Some(descent) if descent.at(gain) > 0.0 => {
                let [inner, outer] = &self.membranes;
                descent.solve([inner, outer], self.discretisation, &self.pair, gain)?
            }
            _ => self.pair.solve_gain(gain, &NewtonOptions::default())?,
        };
        let curves = [solution.inner.points(), solution.outer.points()];
        let layers = [(&solution.inner, &curves[0]), (&solution.outer, &curves[1])]
            .into_iter()
            .map(|(membrane, curve)| self.meridian(membrane, curve))
            .collect::<Result<_, _>>()?;
        let body = Body::new(layers, self.pose)?;
        let length = curves[1].iter().fold(0.0, |most: f64, [x, _]| most.max(*x));
        match body.check_nested(self.tolerance + ROUNDING * length) {
            Err(revolve_voxel::RevolveError::NotNested { depth, x, r, .. }) => {
                Err(PhantomError::Crossed { gain, depth, x, r })
            }
            checked => Ok(checked.map(|()| HeartShape {
                gain,
                solution,
                curves,
                body,
                _life: self.kept.alive.life(),
            })?),
        }
    }

    /// The upper half of a membrane, base to apex.
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
