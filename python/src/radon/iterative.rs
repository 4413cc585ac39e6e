//! Iterative reconstruction.

use super::operator::Operator;
use super::order_of;
use super::spect::SpectSample;
use crate::arrays::{self, Samples, array, check_shape, samples};
use crate::errors::Failure;
use crate::values::Whole;
use crate::work::{Progress, Watch, work};
use heart_phantom::radon::{
    self, CglsOptions, EmOptions, Iteration, IterativeReport, RadonError, SirtOptions, StackOrder,
    StopReason, Stopping,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The result of an iterative method.
#[pyclass(name = "Solution", module = "heart_phantom.radon", frozen, get_all)]
#[derive(Debug)]
pub(crate) struct PySolution {
    /// The image `[y][x]`, or images `[slice][y][x]`, in the precision of the data.
    image: Py<PyAny>,
    /// Iterations; for OSEM through all subsets.
    iterations: usize,
    /// Stopping rule: `"max-iterations"`, `"residual"`, `"gradient"`, `"change"`, `"solved"` if no step remains (CGLS); `None` if a rule was set and not met.
    stopped_by: Option<&'static str>,
    /// Norms before each iteration, `float64[iteration]` by name: `residual` of the data, `change` of the image by the step, both relative;
    /// for CGLS `gradient`, for MLEM and OSEM `log_likelihood`.
    history: Py<PyDict>,
}

#[pymethods]
impl PySolution {
    fn __repr__(&self) -> String {
        let by = self.stopped_by.unwrap_or("no rule that was set");
        format!("<Solution: {} iterations, ended by {by}>", self.iterations)
    }
}

/// Stopping rules and order of the data.
#[derive(Debug)]
struct Plan {
    stopping: Stopping,
    order: StackOrder,
}

impl Plan {
    fn new(
        iterations: Whole,
        residual: Option<f64>,
        change: Option<f64>,
        order: &str,
    ) -> PyResult<Self> {
        let mut stopping = Stopping::default().with_max_iterations(iterations.0);
        stopping.residual = residual;
        stopping.change = change;
        let order = order_of(order)?;
        Ok(Self { stopping, order })
    }
}

/// A method with its own parameters.
#[derive(Debug, Clone, Copy)]
enum Method {
    Mlem,
    Osem {
        subsets: usize,
    },
    Sirt {
        relaxation: f64,
        lower: Option<f64>,
        upper: Option<f64>,
    },
    Cgls {
        gradient: Option<f64>,
    },
}

/// The input of a method.
#[derive(Debug)]
struct Problem<T> {
    operator: Operator,
    stopping: Stopping,
    data: Vec<T>,
    image: Vec<T>,
    background: Vec<T>,
}

impl<T: SpectSample> Problem<T> {
    fn solve(
        mut self,
        method: Method,
        watch: &Watch,
    ) -> Result<(Vec<T>, IterativeReport), RadonError> {
        let all = self.stopping.max_iterations.max(1) as f64;
        let told = |report: &IterativeReport, _: &[T]| watch.tell(report.iterations as f64 / all);
        // The units of work count each projection, not the iterations.
        let _ = watch.tell(0.0);
        let (data, image, stopping) = (&self.data, &mut self.image, self.stopping);
        let a = self.operator;
        let em = || {
            EmOptions::default()
                .with_stopping(stopping)
                .with_background(self.background.clone())
        };
        let report = match method {
            Method::Mlem => radon::mlem(&a.whole()?, data, image, &em(), told),
            Method::Osem { subsets } => radon::osem(&a.subsets(subsets)?, data, image, &em(), told),
            Method::Sirt {
                relaxation,
                lower,
                upper,
            } => {
                let mut options = SirtOptions::default()
                    .with_stopping(stopping)
                    .with_relaxation(relaxation);
                (options.lower, options.upper) = (lower, upper);
                radon::sirt(&a.whole()?, data, image, &options, told)
            }
            Method::Cgls { gradient } => {
                let mut options = CglsOptions::default().with_stopping(stopping);
                options.gradient = gradient;
                radon::cgls(&a.whole()?, data, image, &options, told)
            }
        };
        match report {
            Ok(report) => Ok((self.image, report)),
            // The last image is a valid result.
            Err(RadonError::NotConverged { report }) => Ok((self.image, *report)),
            Err(error) => Err(error),
        }
    }
}

/// The arguments of a call.
struct Call<'a, 'py> {
    operator: &'a Bound<'py, PyAny>,
    data: &'a Bound<'py, PyAny>,
    start: Option<&'a Bound<'py, PyAny>>,
    background: Option<&'a Bound<'py, PyAny>>,
    progress: Progress<'a, 'py>,
    plan: Plan,
    method: Method,
}

impl Call<'_, '_> {
    fn solve(self) -> Result<PySolution, Failure> {
        let given = samples("data", self.data)?;
        match given.samples {
            Samples::Single(data) => self.solve_in(data, &given.shape),
            Samples::Double(data) => self.solve_in(data, &given.shape),
        }
    }

    fn solve_in<T: SpectSample>(
        self,
        data: Vec<T>,
        shape: &[usize],
    ) -> Result<PySolution, Failure> {
        let py = self.data.py();
        let subsets = match self.method {
            Method::Osem { subsets } => Some(subsets),
            Method::Mlem | Method::Sirt { .. } | Method::Cgls { .. } => None,
        };
        let operator = Operator::new(self.operator, shape, self.plan.order, subsets)?;
        let image_shape = operator.image_shape.clone();
        let image = match self.start {
            Some(start) => {
                let start = arrays::of::<T>("start", start)?;
                check_shape("start", &start.shape, &image_shape)?;
                start.samples
            }
            None => {
                let level = match self.method {
                    // Zero pixels would stay zero.
                    Method::Mlem | Method::Osem { .. } => T::ONE,
                    Method::Sirt { .. } | Method::Cgls { .. } => T::ZERO,
                };
                vec![level; image_shape.iter().product()]
            }
        };
        let background = match self.background {
            None => Vec::new(),
            Some(background) => {
                let background = arrays::of::<T>("background", background)?;
                check_shape("background", &background.shape, shape)?;
                background.samples
            }
        };
        let problem = Problem {
            operator,
            stopping: self.plan.stopping,
            data,
            image,
            background,
        };
        let method = self.method;
        let (image, report) = work(py, self.progress, move |watch| problem.solve(method, watch))?;
        Ok(PySolution {
            image: array(py, image, &image_shape)?.into_any().unbind(),
            iterations: report.iterations,
            stopped_by: stopped_by(&report),
            history: history(py, &report)?,
        })
    }
}

fn stopped_by(report: &IterativeReport) -> Option<&'static str> {
    report.stopped_by.as_ref().map(|by| match by {
        StopReason::Residual => "residual",
        StopReason::Gradient => "gradient",
        StopReason::Change => "change",
        StopReason::Solved => "solved",
        _ => "max-iterations",
    })
}

/// A column of the history.
type Column = (&'static str, fn(&Iteration) -> Option<f64>);

fn history(py: Python<'_>, report: &IterativeReport) -> Result<Py<PyDict>, Failure> {
    let columns: [Column; 4] = [
        ("residual", |step| Some(step.residual)),
        ("change", |step| step.change),
        ("gradient", |step| step.gradient),
        ("log_likelihood", |step| step.log_likelihood),
    ];
    let made = PyDict::new(py);
    for (name, of) in columns {
        let column: Vec<f64> = report.history.iter().filter_map(of).collect();
        if !column.is_empty() {
            let n = column.len();
            made.set_item(name, array(py, column, &[n])?)?;
        }
    }
    Ok(made.unbind())
}

/// MLEM: maximises the Poisson likelihood over images >= 0, x <- x / (A^T 1) A^T (b / (A x + s)).
///
/// Shepp and Vardi 1982, doi:10.1109/TMI.1982.4307558.
///
/// Parameters
/// ----------
/// operator : Projector, SpectOperator or any operator
///     A. An object of your own needs the methods `forward` and `adjoint` and the shapes `image_shape` and `data_shape`.
/// data : array_like
///     b, counts: of a projector a sinogram `[view][bin]` or a stack in the given order.
/// start : array_like, optional
///     A positive image; by default ones.
/// background : array_like, optional
///     s, expected counts that do not come from the image.
/// iterations : int
///     Largest number of iterations.
/// residual, change : float, optional
///     Stop when \|\|A x - b\|\| / \|\|b\|\| or the change of a step, relative to the image after it, is at most this.
/// order : {"view-slice-bin", "slice-view-bin"}
///     Index order of a stack; only for a projector.
/// progress : callable, tqdm bar or True, optional
///     Receives the completed fraction.
///
/// Returns
/// -------
/// Solution
///     The image with the history of the iterations.
///
/// Raises
/// ------
/// RadonError
///     If a count is negative or not finite, or a rule is out of its range.
/// ValueError
///     If an array has another shape.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from heart_phantom.radon import Geometry, Grid, Projector, mlem
/// >>> projector = Projector(Geometry.half_turn(20, 24), Grid.square(16))
/// >>> truth = np.zeros((16, 16)); truth[4:10, 5:12] = 2.0
/// >>> solution = mlem(projector, projector.forward(truth), iterations=100)
/// >>> bool(solution.history["residual"][-1] < 0.02)
/// True
#[pyfunction]
#[pyo3(signature = (operator, data, *, start = None, background = None, iterations = Whole(50), residual = None, change = None, order = "view-slice-bin", progress = None), text_signature = "(operator, data, *, start=None, background=None, iterations=50, residual=None, change=None, order='view-slice-bin', progress=None)")]
#[expect(clippy::too_many_arguments, reason = "each by its name")]
pub(crate) fn mlem(
    operator: &Bound<'_, PyAny>,
    data: &Bound<'_, PyAny>,
    start: Option<&Bound<'_, PyAny>>,
    background: Option<&Bound<'_, PyAny>>,
    iterations: Whole,
    residual: Option<f64>,
    change: Option<f64>,
    order: &str,
    progress: Option<&Bound<'_, PyAny>>,
) -> Result<PySolution, Failure> {
    let plan = Plan::new(iterations, residual, change, order)?;
    let method = Method::Mlem;
    Call {
        operator,
        data,
        start,
        background,
        progress,
        plan,
        method,
    }
    .solve()
}

/// OSEM: MLEM on interleaved subsets of the views in turn; an iteration processes all of them.
///
/// Hudson and Larkin 1994, doi:10.1109/42.363108.
///
/// Parameters
/// ----------
/// operator : Projector, SpectOperator or any operator
///     A, as in `mlem`. An object of your own also needs `subset(k, n)`, the operator of the views `k, k + n, k + 2 n ...`, the first axis of
///     the data.
/// data, start, background, iterations, residual, change, order, progress
///     As in `mlem`.
/// subsets : int
///     Number of subsets, at most the number of views.
///
/// Returns
/// -------
/// Solution
///     The image with the history of the iterations.
///
/// Raises
/// ------
/// RadonError
///     As `mlem`.
/// ValueError
///     If an array has another shape, or there are more subsets than views.
#[pyfunction]
#[pyo3(signature = (operator, data, subsets, *, start = None, background = None, iterations = Whole(50), residual = None, change = None, order = "view-slice-bin", progress = None), text_signature = "(operator, data, subsets, *, start=None, background=None, iterations=50, residual=None, change=None, order='view-slice-bin', progress=None)")]
#[expect(clippy::too_many_arguments, reason = "each by its name")]
pub(crate) fn osem(
    operator: &Bound<'_, PyAny>,
    data: &Bound<'_, PyAny>,
    subsets: Whole,
    start: Option<&Bound<'_, PyAny>>,
    background: Option<&Bound<'_, PyAny>>,
    iterations: Whole,
    residual: Option<f64>,
    change: Option<f64>,
    order: &str,
    progress: Option<&Bound<'_, PyAny>>,
) -> Result<PySolution, Failure> {
    let plan = Plan::new(iterations, residual, change, order)?;
    let method = Method::Osem { subsets: subsets.0 };
    Call {
        operator,
        data,
        start,
        background,
        progress,
        plan,
        method,
    }
    .solve()
}

/// SIRT: x <- x + lambda C A^T R (b - A x), then the bounds; R and C contain the reciprocals of the row and column sums of A.
///
/// Gregor and Benson 2008, doi:10.1109/TMI.2008.923696.
///
/// Parameters
/// ----------
/// operator, data, iterations, residual, change, order, progress
///     As in `mlem`.
/// start : array_like, optional
///     By default zero.
/// relaxation : float
///     lambda, 0 < lambda < 2.
/// lower, upper : float, optional
///     Bounds of the pixels.
///
/// Returns
/// -------
/// Solution
///     The image with the history of the iterations.
#[pyfunction]
#[pyo3(signature = (operator, data, *, start = None, relaxation = 1.0, lower = None, upper = None, iterations = Whole(50), residual = None, change = None, order = "view-slice-bin", progress = None), text_signature = "(operator, data, *, start=None, relaxation=1.0, lower=None, upper=None, iterations=50, residual=None, change=None, order='view-slice-bin', progress=None)")]
#[expect(clippy::too_many_arguments, reason = "each by its name")]
pub(crate) fn sirt(
    operator: &Bound<'_, PyAny>,
    data: &Bound<'_, PyAny>,
    start: Option<&Bound<'_, PyAny>>,
    relaxation: f64,
    lower: Option<f64>,
    upper: Option<f64>,
    iterations: Whole,
    residual: Option<f64>,
    change: Option<f64>,
    order: &str,
    progress: Option<&Bound<'_, PyAny>>,
) -> Result<PySolution, Failure> {
    let plan = Plan::new(iterations, residual, change, order)?;
    let method = Method::Sirt {
        relaxation,
        lower,
        upper,
    };
    let background = None;
    Call {
        operator,
        data,
        start,
        background,
        progress,
        plan,
        method,
    }
    .solve()
}

/// CGLS: minimises ||A x - b|| over a Krylov space that grows with each step; few steps regularise.
///
/// Hestenes and Stiefel 1952, doi:10.6028/jres.049.044.
///
/// Parameters
/// ----------
/// operator, data, start, iterations, residual, change, order, progress
///     As in `sirt`.
/// gradient : float, optional
///     Stop when the norm of A^T (b - A x) is at most this times that of A^T b.
///
/// Returns
/// -------
/// Solution
///     The image with the history of the iterations.
#[pyfunction]
#[pyo3(signature = (operator, data, *, start = None, gradient = None, iterations = Whole(50), residual = None, change = None, order = "view-slice-bin", progress = None), text_signature = "(operator, data, *, start=None, gradient=None, iterations=50, residual=None, change=None, order='view-slice-bin', progress=None)")]
#[expect(clippy::too_many_arguments, reason = "each by its name")]
pub(crate) fn cgls(
    operator: &Bound<'_, PyAny>,
    data: &Bound<'_, PyAny>,
    start: Option<&Bound<'_, PyAny>>,
    gradient: Option<f64>,
    iterations: Whole,
    residual: Option<f64>,
    change: Option<f64>,
    order: &str,
    progress: Option<&Bound<'_, PyAny>>,
) -> Result<PySolution, Failure> {
    let plan = Plan::new(iterations, residual, change, order)?;
    let method = Method::Cgls { gradient };
    let background = None;
    Call {
        operator,
        data,
        start,
        background,
        progress,
        plan,
        method,
    }
    .solve()
}
