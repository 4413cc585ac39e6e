//! Projections of an object in several states of a known motion, as one operator on the object in one of them.

use super::warps::Warps;
use crate::error::{RadonError, at_least, finite, length, zeros};
use crate::{LinearOperator, Sample};

/// A state of a moving object and its projections.
#[derive(Debug, Clone)]
pub struct MotionState<O> {
    /// From the reference state of the object to this state.
    pub warps: Warps,
    /// The projection operator of this state.
    pub operator: O,
    /// Factors of equally long parts of the data, for instance the duration of each view in seconds.
    pub weights: Vec<f64>,
}

/// The projections of an object with a known motion: with warps W, an operator A and factors w for each state k,
///
/// ```text
/// x -> ( w_0 A_0 W_0 x,  w_1 A_1 W_1 x,  ... )        adjoint: sum over k of  W_kᵀ A_kᵀ w_k y_k
/// ```
///
/// The data are ordered by state. A solver finds one volume from the projections of all states. For Poisson data the factors convert
/// samples to expected counts, so that every count has its statistical weight. Results are bitwise independent of the number of threads if those
/// of the operators are. Cost: that of the operators and warps, applied one after the other, and three volumes.
///
/// ```
/// use radon::{Displacements, ImageGrid, Kernel, LinearOperator, MovingOperator, ParallelGeometry, Projector, RadonError, StackOrder, MotionState, Warp};
/// let (geometry, grid) = (ParallelGeometry::half_turn(8, 12, 1.0)?, ImageGrid::square(8, 1.0)?);
/// let projector = Projector::new(&geometry, &grid, Kernel::Strip)?;
/// // Stationary for three seconds, and displaced by a voxel along x for one second.
/// let state = |by: f32, seconds: f64| {
///     let by: Vec<_> = (0..64).map(|voxel| (voxel, [-by, 0.0, 0.0])).collect();
///     let moved = Displacements { fraction: 1.0, by: &by };
///     let operator = projector.stack_operator::<f64>(1, StackOrder::ViewSliceBin)?;
///     Ok::<_, RadonError>(MotionState { warps: Warp::new([8, 8, 1], [1.0; 3], &[moved])?.into(), operator, weights: vec![seconds] })
/// };
/// let seen = MovingOperator::new(vec![state(0.0, 3.0)?, state(1.0, 1.0)?])?;
/// let mut object = vec![0.0; 64];
/// object[3 * 8 + 2] = 1.0;
/// let mut views = vec![0.0; 2 * 8 * 12];
/// seen.forward_into(&object, &mut views)?;
/// let sum = |views: &[f64]| views.iter().sum::<f64>();
/// assert!((sum(&views[..96]) / sum(&views[96..]) - 3.0).abs() < 1e-12);
/// # Ok::<(), RadonError>(())
/// ```
#[derive(Debug, Clone)]
pub struct MovingOperator<O> {
    states: Vec<MotionState<O>>,
}

impl<O> MovingOperator<O> {
    /// Combines at least one state.
    ///
    /// # Errors
    /// [`RadonError::TooFew`] without a state, or for one without factors; [`RadonError::WrongLength`] for volumes of different lengths,
    /// or factors that do not divide the data into equal parts; [`RadonError::NotFinite`] for a factor. Shapes of equal length and voxel sizes
    /// are not compared.
    pub fn new<T: Sample>(states: Vec<MotionState<O>>) -> Result<Self, RadonError>
    where
        O: LinearOperator<T>,
    {
        at_least("states of an object", states.len(), 1)?;
        let volume = <Warps as LinearOperator<T>>::image_len(&states[0].warps);
        for MotionState {
            warps,
            operator,
            weights,
        } in &states
        {
            at_least("factors of a state", weights.len(), 1)?;
            weights
                .iter()
                .try_for_each(|w| finite("factor of a state", *w).map(drop))?;
            let warped = <Warps as LinearOperator<T>>::image_len(warps);
            length("volume of a state", warped, volume)?;
            length("volume of an operator", operator.image_len(), volume)?;
            let each = operator.data_len() / weights.len();
            length("data of a state", operator.data_len(), each * weights.len())?;
        }
        Ok(Self { states })
    }
}

impl<O> MotionState<O> {
    /// Multiplies data by their factors.
    fn weigh<T: Sample>(&self, data: &mut [T]) {
        let each = (data.len() / self.weights.len()).max(1);
        for (part, weight) in data.chunks_mut(each).zip(&self.weights) {
            part.iter_mut().for_each(|x| *x *= T::of(*weight));
        }
    }
}

impl<T: Sample, O: LinearOperator<T>> LinearOperator<T> for MovingOperator<O> {
    fn image_len(&self) -> usize {
        self.states[0].operator.image_len()
    }

    fn data_len(&self) -> usize {
        self.states
            .iter()
            .map(|state| state.operator.data_len())
            .sum()
    }

    fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError> {
        length("volume", image.len(), self.image_len())?;
        length("data", data.len(), self.data_len())?;
        let mut moved = zeros("moved volume", image.len(), 1)?;
        let mut rest = data;
        for state in &self.states {
            let (own, others) = rest.split_at_mut(state.operator.data_len());
            state.warps.forward_into(image, &mut moved)?;
            state.operator.forward_into(&moved, own)?;
            state.weigh(own);
            rest = others;
        }
        Ok(())
    }

    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
        length("data", data.len(), self.data_len())?;
        length("volume", image.len(), self.image_len())?;
        let mut moved = zeros("moved volume", image.len(), 1)?;
        let mut back = zeros("volume of a state", image.len(), 1)?;
        image.fill(T::ZERO);
        let mut rest = data;
        for state in &self.states {
            let (own, others) = rest.split_at(state.operator.data_len());
            let mut own = own.to_vec();
            state.weigh(&mut own);
            state.operator.adjoint_into(&own, &mut moved)?;
            state.warps.adjoint_into(&moved, &mut back)?;
            for (sum, x) in image.iter_mut().zip(&back) {
                *sum += *x;
            }
            rest = others;
        }
        Ok(())
    }
}
