//! The Python package `heart-phantom`: the crates of this workspace for NumPy.
//!
//! Classes wrap Rust objects, validate arguments and convert arrays; they compute nothing. `work.rs` releases the interpreter during calls,
//! `arrays.rs` converts arrays, `errors.rs` errors.

mod arrays;
mod cohort;
mod equilibrium;
mod errors;
mod membrane;
mod mesh;
mod motion;
mod phantom;
mod pose;
mod product;
mod radon;
mod rays;
mod recipe;
mod revolve;
mod scatter;
mod scene;
mod tables;
mod values;
mod work;

/// The names that the modules of the package `heart_phantom` export.
#[pyo3::pymodule]
mod _native {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::cohort::{PyCohort, command_line};
    #[pymodule_export]
    use crate::equilibrium::PyEquilibrium;
    #[pymodule_export]
    use crate::membrane::{PyMembrane, PyPairEquilibrium, solve_pair};
    #[pymodule_export]
    use crate::mesh::PyMesh;
    #[pymodule_export]
    use crate::motion::PyMotion;
    #[pymodule_export]
    use crate::pose::PyPose;
    #[pymodule_export]
    use crate::product::PyPhantom;
    #[pymodule_export]
    use crate::radon::{
        PyFbpPlan, PyGeometry, PyGrid, PyProjector, PySolution, PySpectOperator, cgls, fbp, mlem,
        osem, sirt,
    };
    #[pymodule_export]
    use crate::rays::PyRayGeometry;
    #[pymodule_export]
    use crate::revolve::{PyBody, PyMeridian};
    #[pymodule_export]
    use crate::scene::PyScene;
    #[pymodule_export]
    use crate::work::{set_threads, threads};

    #[pymodule_init]
    fn version(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
