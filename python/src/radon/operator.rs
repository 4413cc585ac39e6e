//! Operators of the iterative solvers: those of this package, and objects of Python.

use super::spect::{Spect, SpectSample, check_subsets};
use super::{PyProjector, Stack};
use crate::arrays::{self, array, check_shape};
use crate::errors::Failure;
use heart_phantom::radon::{LinearOperator, Projector, RadonError, StackOrder, Subset};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::sync::Arc;

/// An operator with the shapes of its images and data.
#[derive(Debug)]
pub(super) struct Operator {
    kind: Kind,
    pub(super) image_shape: Vec<usize>,
    pub(super) data_shape: Vec<usize>,
}

#[derive(Debug)]
enum Kind {
    Projector(Arc<Projector>, Stack, StackOrder),
    Spect(Arc<Spect>),
    /// An object with `forward` and `adjoint`, and its subsets, if any were requested.
    Object(Object, Vec<Object>),
}

/// An object with `forward`, `adjoint`, `image_shape` and `data_shape`.
#[derive(Debug)]
struct Object {
    object: Py<PyAny>,
    image_shape: Vec<usize>,
    data_shape: Vec<usize>,
}

/// An operator as the solvers take it.
pub(super) type Linear<T> = Box<dyn LinearOperator<T> + Send + Sync>;

impl Operator {
    /// Reads an argument; `subsets` is the number of subsets that the solver uses.
    pub(super) fn new(
        given: &Bound<'_, PyAny>,
        data_shape: &[usize],
        order: StackOrder,
        subsets: Option<usize>,
    ) -> Result<Self, Failure> {
        let operator = if let Ok(projector) = given.cast::<PyProjector>() {
            let projector = projector.get();
            let stack = Stack::of_data(data_shape, projector.geometry().sizes(), order)?;
            Self {
                kind: Kind::Projector(projector.0.clone(), stack, order),
                image_shape: stack.image_shape(projector.grid().sizes()),
                data_shape: stack.data_shape(projector.geometry().sizes(), order),
            }
        } else if let Ok(spect) = given.cast::<super::PySpectOperator>() {
            let spect = spect.get().0.clone();
            Self {
                image_shape: spect.image_shape().to_vec(),
                data_shape: spect.data_shape().to_vec(),
                kind: Kind::Spect(spect),
            }
        } else {
            let whole = Object::new(given)?;
            let n = subsets.unwrap_or(0);
            if subsets.is_some() {
                check_subsets(n, whole.data_shape.first().copied().unwrap_or(0))?;
            }
            let parts = (0..n).map(|k| Object::new(&given.call_method1("subset", (k, n))?));
            let parts = parts.collect::<PyResult<Vec<_>>>()?;
            Self {
                image_shape: whole.image_shape.clone(),
                data_shape: whole.data_shape.clone(),
                kind: Kind::Object(whole, parts),
            }
        };
        check_shape("data", data_shape, &operator.data_shape)?;
        Ok(operator)
    }

    /// Returns the whole operator.
    pub(super) fn whole<T: SpectSample>(self) -> Result<Linear<T>, RadonError> {
        Ok(match self.kind {
            Kind::Projector(projector, stack, order) => {
                Box::new(projector.stack_operator::<T>(stack.n(), order)?)
            }
            Kind::Spect(spect) => Box::new(OfSpect(spect)),
            Kind::Object(whole, _) => Box::new(whole),
        })
    }

    /// Returns the subsets of OSEM.
    pub(super) fn subsets<T: SpectSample>(
        self,
        n: usize,
    ) -> Result<Vec<Subset<Linear<T>, T>>, RadonError> {
        fn boxed<T: SpectSample, O: LinearOperator<T> + Send + Sync + 'static>(
            subsets: Vec<Subset<O, T>>,
        ) -> Vec<Subset<Linear<T>, T>> {
            let boxed = |subset: Subset<O, T>| {
                let (operator, data) = subset.into_parts();
                Subset::new(Box::new(operator) as Linear<T>, data)
            };
            subsets.into_iter().map(boxed).collect()
        }
        match self.kind {
            Kind::Projector(projector, stack, order) => {
                let all = projector.stack_operator::<T>(stack.n(), order)?;
                Ok(boxed(all.subsets(n)?))
            }
            Kind::Spect(spect) => Ok(boxed(spect.subsets::<T>(n)?)),
            Kind::Object(whole, parts) => {
                let views = whole.data_shape[0];
                let view_len: usize = whole.data_shape[1..].iter().product();
                let samples = |view: usize| view * view_len..(view + 1) * view_len;
                let parts = parts.into_iter().enumerate();
                let parts = parts.map(|(k, operator)| {
                    let data = (k..views).step_by(n).flat_map(samples).collect();
                    Subset::new(operator, data)
                });
                Ok(boxed(parts.collect()))
            }
        }
    }
}

/// A SPECT operator that shares its plan with Python.
#[derive(Debug)]
struct OfSpect(Arc<Spect>);

impl<T: SpectSample> LinearOperator<T> for OfSpect {
    fn image_len(&self) -> usize {
        self.0.image_shape().iter().product()
    }

    fn data_len(&self) -> usize {
        self.0.data_shape().iter().product()
    }

    fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError> {
        self.0.operator::<T>()?.forward_into(image, data)
    }

    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
        self.0.operator::<T>()?.adjoint_into(data, image)
    }
}

impl Object {
    fn new(object: &Bound<'_, PyAny>) -> PyResult<Self> {
        let shape = |name: &str| {
            let shape = object.getattr(name).and_then(|shape| shape.extract());
            shape.map_err(|_| {
                let kind = object.get_type();
                PyTypeError::new_err(format!(
                    "operator is a {kind}; it must have the methods forward and adjoint and the shapes image_shape and data_shape"
                ))
            })
        };
        Ok(Self {
            object: object.clone().unbind(),
            image_shape: shape("image_shape")?,
            data_shape: shape("data_shape")?,
        })
    }

    fn call<T: SpectSample>(
        &self,
        method: &str,
        given: (&[T], &[usize]),
        out: (&mut [T], &[usize]),
    ) -> Result<(), RadonError> {
        let mut call = |py: Python<'_>| -> Result<(), Failure> {
            let given = array(py, given.0.to_vec(), given.1)?;
            let made = self.object.bind(py).call_method1(method, (given,))?;
            let made = arrays::of::<T>(method, &made)?;
            check_shape(&format!("result of {method}"), &made.shape, out.1)?;
            out.0.copy_from_slice(&made.samples);
            Ok(())
        };
        Python::attach(|py| call(py).map_err(|error| RadonError::user(PyErr::from(error))))
    }
}

impl<T: SpectSample> LinearOperator<T> for Object {
    fn image_len(&self) -> usize {
        self.image_shape.iter().product()
    }

    fn data_len(&self) -> usize {
        self.data_shape.iter().product()
    }

    fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError> {
        self.call(
            "forward",
            (image, &self.image_shape),
            (data, &self.data_shape),
        )
    }

    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
        self.call(
            "adjoint",
            (data, &self.data_shape),
            (image, &self.image_shape),
        )
    }
}
