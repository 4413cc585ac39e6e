//! `heart_phantom.radon`: parallel-beam tomography.

mod filtered;
mod geometry;
mod iterative;
mod operator;
mod projector;
mod spect;

pub(crate) use filtered::{PyFbpPlan, fbp};
pub(crate) use geometry::{PyGeometry, PyGrid};
pub(crate) use iterative::{PySolution, cgls, mlem, osem, sirt};
pub(crate) use projector::PyProjector;
pub(crate) use spect::PySpectOperator;

use crate::arrays::wrong_shape;
use crate::values::choice;
use heart_phantom::radon::{Sample, StackOrder};
use numpy::Element;
use pyo3::prelude::*;

/// The two precisions of samples.
pub(crate) trait Precision: Sample + Element + Copy {}
impl Precision for f32 {}
impl Precision for f64 {}

fn order_of(name: &str) -> PyResult<StackOrder> {
    let orders = [
        ("view-slice-bin", StackOrder::ViewSliceBin),
        ("slice-view-bin", StackOrder::SliceViewBin),
    ];
    choice("order", name, &orders)
}

/// One slice or many, of data or of images.
#[derive(Debug, Clone, Copy)]
struct Stack {
    /// `None` for an array without an axis of slices.
    slices: Option<usize>,
}

impl Stack {
    /// Interprets the shape of a sinogram `[view][bin]`, or of a stack.
    fn of_data(shape: &[usize], [views, bins]: [usize; 2], order: StackOrder) -> PyResult<Self> {
        let slices = match (shape, order) {
            (&[v, b], _) if [v, b] == [views, bins] => None,
            (&[v, n, b], StackOrder::ViewSliceBin) if [v, b] == [views, bins] && n > 0 => Some(n),
            (&[n, v, b], StackOrder::SliceViewBin) if [v, b] == [views, bins] && n > 0 => Some(n),
            _ => {
                let many = match order {
                    StackOrder::ViewSliceBin => format!("({views}, n, {bins}) [view][slice][bin]"),
                    StackOrder::SliceViewBin => format!("(n, {views}, {bins}) [slice][view][bin]"),
                };
                let expected = format!("({views}, {bins}) [view][bin] or {many}");
                return Err(wrong_shape("sinogram", shape, &expected));
            }
        };
        Ok(Self { slices })
    }

    /// Interprets the shape of an image `[y][x]`, or of a stack.
    fn of_images(what: &str, shape: &[usize], [ny, nx]: [usize; 2]) -> PyResult<Self> {
        let slices = match *shape {
            [y, x] if [y, x] == [ny, nx] => None,
            [n, y, x] if [y, x] == [ny, nx] && n > 0 => Some(n),
            _ => {
                let expected = format!("({ny}, {nx}) [y][x] or (n, {ny}, {nx}) [slice][y][x]");
                return Err(wrong_shape(what, shape, &expected));
            }
        };
        Ok(Self { slices })
    }

    fn n(self) -> usize {
        self.slices.unwrap_or(1)
    }

    fn image_shape(self, [ny, nx]: [usize; 2]) -> Vec<usize> {
        self.slices.into_iter().chain([ny, nx]).collect()
    }

    fn data_shape(self, [views, bins]: [usize; 2], order: StackOrder) -> Vec<usize> {
        match (self.slices, order) {
            (None, _) => vec![views, bins],
            (Some(n), StackOrder::ViewSliceBin) => vec![views, n, bins],
            (Some(n), StackOrder::SliceViewBin) => vec![n, views, bins],
        }
    }
}
