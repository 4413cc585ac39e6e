//! The interface of linear operators to the solvers.

use std::sync::Arc;

use super::vectors::{check_samples, norm, relative, sum2};
use crate::Sample;
use crate::error::{RadonError, length, zeros};

/// A linear map A from images to data, with its adjoint; implement it for your own to use the solvers.
///
/// The solvers need <A x, y> = <x, Aᵀ y> to rounding, which [`adjoint_mismatch`] tests. Lengths are checked before the first call. References, boxes
/// and shared pointers to an operator are operators too, including `dyn`. [`RadonError::user`] wraps errors of your own operator, for example of
/// reading a file.
///
/// ```
/// use radon::{CglsOptions, LinearOperator, RadonError, cgls};
/// struct Differences; // of three numbers
/// impl LinearOperator<f64> for Differences {
///     fn image_len(&self) -> usize { 3 }
///     fn data_len(&self) -> usize { 3 }
///     fn forward_into(&self, x: &[f64], y: &mut [f64]) -> Result<(), RadonError> {
///         y.copy_from_slice(&[x[0], x[1] - x[0], x[2] - x[1]]);
///         Ok(())
///     }
///     fn adjoint_into(&self, y: &[f64], x: &mut [f64]) -> Result<(), RadonError> {
///         x.copy_from_slice(&[y[0] - y[1], y[1] - y[2], y[2]]);
///         Ok(())
///     }
/// }
/// let mut x = vec![0.0; 3];
/// cgls(&Differences, &[1.0, 1.0, 2.0], &mut x, &CglsOptions::default().with_gradient(1e-12), radon::no_observer)?;
/// assert!((x[2] - 4.0).abs() < 1e-10);
/// # Ok::<(), RadonError>(())
/// ```
pub trait LinearOperator<T: Sample> {
    /// Number of unknowns.
    fn image_len(&self) -> usize;
    /// Number of data.
    fn data_len(&self) -> usize;
    /// Writes A x to `data`.
    ///
    /// # Errors
    /// Errors of the operator, which stop the solver.
    fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError>;
    /// Writes Aᵀ y to `image`.
    ///
    /// # Errors
    /// Errors of the operator, which stop the solver.
    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError>;

    /// Returns A x.
    ///
    /// # Errors
    /// As [`forward_into`](Self::forward_into); [`RadonError::TooLarge`].
    fn forward(&self, image: &[T]) -> Result<Vec<T>, RadonError> {
        let mut data = zeros("data", self.data_len(), 1)?;
        self.forward_into(image, &mut data)?;
        Ok(data)
    }

    /// Returns Aᵀ y.
    ///
    /// # Errors
    /// As [`adjoint_into`](Self::adjoint_into); [`RadonError::TooLarge`].
    fn adjoint(&self, data: &[T]) -> Result<Vec<T>, RadonError> {
        let mut image = zeros("image", self.image_len(), 1)?;
        self.adjoint_into(data, &mut image)?;
        Ok(image)
    }
}

macro_rules! pointers {
    ($($pointer:ty),*) => {$(
        impl<T: Sample, A: LinearOperator<T> + ?Sized> LinearOperator<T> for $pointer {
            fn image_len(&self) -> usize {
                (**self).image_len()
            }
            fn data_len(&self) -> usize {
                (**self).data_len()
            }
            fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError> {
                (**self).forward_into(image, data)
            }
            fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
                (**self).adjoint_into(data, image)
            }
        }
    )*};
}
pointers!(&A, Box<A>, Arc<A>);

/// Returns |<A x, y> - <x, Aᵀ y>| / max(|A x| |y|, |x| |Aᵀ y|) for pseudo-random x and y, whose entries are uniform in [-1, 1) and depend on
/// `seed` only.
///
/// With an exact adjoint it is a rounding error: about 1e-16 for `f64` and 1e-7 for `f32`. The inner products are sums in `f64`. If the
/// denominator is zero, the numerator is returned. Cost: one forward, one adjoint. [`Projector`](crate::Projector) has an example.
///
/// # Errors
/// Errors of the operator; [`RadonError::BadSample`] for a result that is not finite; [`RadonError::TooLarge`].
#[doc(alias("adjointness", "dot product test"))]
pub fn adjoint_mismatch<T: Sample, O: LinearOperator<T> + ?Sized>(
    operator: &O,
    seed: u64,
) -> Result<f64, RadonError> {
    let operator = Checked(&operator);
    let (image_len, data_len) = (operator.0.image_len(), operator.0.data_len());
    // A linear congruential generator with the constants of Knuth's MMIX.
    let mut state = seed.wrapping_mul(2).wrapping_add(1);
    let mut fill = |samples: &mut [T]| {
        for x in samples {
            state = (state.wrapping_mul(6364136223846793005)).wrapping_add(1442695040888963407);
            *x = T::of((state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0);
        }
    };
    let (mut x, mut y) = (zeros("image", image_len, 1)?, zeros("data", data_len, 1)?);
    fill(&mut x);
    fill(&mut y);
    let (mut ax, mut aty) = (zeros("data", data_len, 1)?, zeros("image", image_len, 1)?);
    operator.forward_into(&x, &mut ax)?;
    operator.adjoint_into(&y, &mut aty)?;
    let inner = |a: &[T], b: &[T]| sum2(a, b, |a, b| a * b);
    let scale = (norm(&ax) * norm(&y)).max(norm(&x) * norm(&aty));
    Ok(relative((inner(&ax, &y) - inner(&x, &aty)).abs(), scale))
}

/// An operator whose results are checked to be finite.
pub(super) struct Checked<'a, T>(pub(super) &'a dyn LinearOperator<T>);

impl<T: Sample> Checked<'_, T> {
    /// Checks lengths and finiteness of the arguments of a solver.
    pub(super) fn check_input(&self, data: &[T], image: &[T]) -> Result<(), RadonError> {
        length("data", data.len(), self.0.data_len())?;
        length("image", image.len(), self.0.image_len())?;
        check_samples("data", data)?;
        check_samples("image", image)
    }

    pub(super) fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError> {
        self.0.forward_into(image, data)?;
        check_samples("result of forward_into", data)
    }

    pub(super) fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
        self.0.adjoint_into(data, image)?;
        check_samples("result of adjoint_into", image)
    }
}
