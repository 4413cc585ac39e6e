//! The error type of the crate.

use crate::scene::{SceneError, place_in};
use crate::text::{Number, brief, enough, escape, escape_path, range};
use std::path::PathBuf;

/// The errors of this crate. A message does not repeat its cause, the [`source`](std::error::Error::source): print the whole [`chain`](crate::chain).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PhantomError {
    /// A number is not finite or out of range.
    #[error("{what} is {}, must be {}", Number(*given), range(*least, *most))]
    OutOfRange {
        /// The quantity.
        what: &'static str,
        /// The value given.
        given: f64,
        /// Smallest value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// A count is out of range.
    #[error("{what} is {given}, must be {}", if least == most { least.to_string() } else { format!("between {least} and {most}") })]
    Count {
        /// The quantity.
        what: &'static str,
        /// The value given.
        given: usize,
        /// Smallest value allowed.
        least: usize,
        /// Largest value allowed.
        most: usize,
    },
    /// A gate does not occur during a view.
    #[error(
        "gate {gate} does not occur during view {view_idx}; a view of one cardiac cycle (and one respiratory cycle, if gated) contains every gate"
    )]
    EmptyView {
        /// The gate, from 0.
        gate: usize,
        /// The first view without it.
        view_idx: usize,
    },
    /// An array has the wrong length.
    #[error("{what}: {given} values given, {expected} expected")]
    WrongLength {
        /// The array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The expected length.
        expected: usize,
    },
    /// An [`Observer`](crate::Observer) stopped the computation.
    #[error("the computation was stopped by its caller")]
    Stopped,
    /// The threads could not be started.
    #[error("cannot start {}", threads(*given))]
    Threads {
        /// The number given; 0 for one per core.
        given: usize,
        /// The cause, such as the error of the operating system.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Invalid dimensions or stiffness of a membrane.
    #[error(transparent)]
    Balloon(#[from] membrane_newton::MembraneError),
    /// An equilibrium could not be solved.
    #[error(transparent)]
    Membrane(#[from] membrane_newton::NewtonError),
    /// A motion could not be integrated.
    #[error(transparent)]
    Motion(#[from] membrane_implicit::ImplicitError),
    /// The membranes intersect.
    #[error(
        "at a volume gain of {} the inner membrane is {} cm outside the outer one (x = {} cm from the base, r = {} cm); \
         choose more similar lengths, a thicker wall or a smaller volume",
        Number(brief(*gain)),
        Number(brief(*depth)),
        Number(brief(*x)),
        Number(brief(*r))
    )]
    Crossed {
        /// Volume gain of the cavity.
        gain: f64,
        /// Largest distance outside, cm.
        depth: f64,
        /// Distance from the base there, cm.
        x: f64,
        /// Radius there, cm.
        r: f64,
    },
    /// The wall has no material coordinates: lines between points of equal s cross in it.
    #[error("at a volume gain of {} the wall has no material coordinates, which defects and motion need", Number(brief(*gain)))]
    NoMaterial {
        /// Volume gain of the cavity.
        gain: f64,
        /// The cause, with the position.
        source: Box<PhantomError>,
    },
    /// A defect, or the part not replaced by later ones, is not a solid.
    #[error("defect {} at a volume gain of {}", defect + 1, Number(brief(*gain)))]
    NoDefect {
        /// Its index, from 0.
        defect: usize,
        /// Volume gain of the cavity.
        gain: f64,
        /// The cause.
        source: Box<PhantomError>,
    },
    /// The background does not contain the heart.
    #[error(
        "at a volume gain of {} the heart extends beyond the background, to {} times the distance of its surface",
        Number(brief(*gain)),
        Number(enough(*times))
    )]
    Uncovered {
        /// Volume gain of the cavity.
        gain: f64,
        /// Smallest factor by which the background must be larger, about its axis.
        times: f64,
    },
    /// The collimator face does not clear heart, torso and organs.
    #[error(
        "in view {view_idx} the collimator face is {} cm from the axis of rotation, but the body extends {} cm towards it",
        Number(brief(*radius)),
        Number(enough(*needed))
    )]
    DetectorInside {
        /// The view in which it is deepest inside.
        view_idx: usize,
        /// Distance of the face from the axis of rotation, cm.
        radius: f64,
        /// Extent of the body, cm.
        needed: f64,
    },
    /// A projection matrix has no source at a finite distance.
    #[error(
        "projection matrix {view_idx} (from 0) must be finite with a regular left 3 x 3 block; its determinant over the lengths of its \
         rows is {}",
        Number(brief(*determinant))
    )]
    Matrix {
        /// Index of the view.
        view_idx: usize,
        /// Determinant of the left block, over the product of the lengths of its rows.
        determinant: f64,
    },
    /// The source of a fan or cone beam is inside the heart or an organ; lines would then extend to both sides of the source.
    #[error(
        "the source of view {view_idx} is inside the heart or an organ; it must be outside all of them"
    )]
    SourceInside {
        /// The first such view.
        view_idx: usize,
    },
    /// An error of the solid, its rays or its voxels.
    #[error(transparent)]
    Solid(#[from] revolve_voxel::RevolveError),
    /// An error of the reconstruction.
    #[error(transparent)]
    Radon(#[from] radon::RadonError),
    /// Scatter cannot be computed.
    #[error("the scatter of the projections")]
    Scatter(#[from] photon_scatter::ScatterError),
    /// A file format cannot store something.
    #[error("{format} cannot store {what}")]
    Unsupported {
        /// The format.
        format: &'static str,
        /// The unsupported property or data.
        what: &'static str,
    },
    /// A path has the wrong extension.
    #[error("{}: the name must end in .{expected}", escape_path(path))]
    Extension {
        /// The path given.
        path: PathBuf,
        /// The expected extension.
        expected: &'static str,
    },
    /// Invalid values of a scene, or combinations of values.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// A valid scene that cannot be run.
    #[error("{}{field}", place_in(file.as_deref(), *place))]
    Rejected {
        /// The file, if the scene was read from one.
        file: Option<PathBuf>,
        /// Line and column of the field, from 1; `None` if the scene has no text or the text lacks the field.
        place: Option<[usize; 2]>,
        /// The field that causes the error, such as `defects.1` (the first one).
        // tidy: allow string: the path of a field in the file
        field: String,
        /// The cause.
        source: Box<PhantomError>,
    },
    /// More memory is needed than available.
    #[error("the computation needs {needed} bytes of memory; {available} are available")]
    Memory {
        /// Bytes needed at most.
        needed: u64,
        /// Bytes available.
        available: u64,
    },
    /// The phantom lacks the requested part.
    #[error("there is no {what}")]
    Absent {
        /// The requested part.
        what: &'static str,
    },
    /// A total number of counts without any activity in the projections.
    #[error("the projections contain no activity to simulate counts of")]
    NoCounts,
    /// The feature is not included in this build.
    #[error("this build has no {what}, without the feature `{feature}`")]
    NotBuilt {
        /// The requested function.
        what: &'static str,
        /// The Cargo feature.
        feature: &'static str,
    },
    /// No resolution meets the tolerance of the samples, of the ground truth or of a mesh.
    #[error(
        "{term}: the smallest error reached is {}; {}",
        Number(brief(*reached)),
        of_tolerance(*allowed, *tolerance)
    )]
    Tolerance {
        /// The term of [`ViewError`](crate::ViewError), or that of the ground truth or of a mesh.
        term: &'static str,
        /// Estimated error: relative to the largest sample, of the volume fraction of a voxel, or relative to the volume of a mesh.
        reached: f64,
        /// The part of the tolerance that this term may use.
        allowed: f64,
        /// The tolerance of the scene.
        tolerance: f64,
    },
    /// A file could not be read.
    #[error("cannot read {}", escape_path(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// Another process writes to the directory.
    #[error("another run writes to {}: {}", escape_path(path), escape(holder))]
    Busy {
        /// The directory.
        path: PathBuf,
        /// Process and computer.
        // tidy: allow string: written by the other process
        holder: String,
    },
    /// A file that would be replaced or removed is not known to be of this program: a report of another one, or a file that the `report.json` of no
    /// earlier run lists.
    #[error(
        "{} was not written by this program, or no report lists it; choose another directory or move the file",
        escape_path(path)
    )]
    Foreign {
        /// The existing file.
        path: PathBuf,
    },
    /// A file belongs to a run whose report is in the same directory.
    #[error(
        "{} is a file of the run of the report.json beside it; choose another directory",
        escape_path(path)
    )]
    Listed {
        /// The file.
        path: PathBuf,
    },
    /// A file name cannot be written to a header or the report of a run, which lists distinct names without directories.
    #[error(
        "{}: a file name has more than dots before its extension, without control characters; in a run it is unique and without directories",
        escape_path(path)
    )]
    Name {
        /// The path given.
        path: PathBuf,
    },
    /// A file or folder could not be written.
    #[error("cannot write {}", escape_path(path))]
    File {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
}

impl From<SceneError> for PhantomError {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

/// Returns the error of a term that exceeds its part of a tolerance.
pub(crate) fn missed(
    term: &'static str,
    reached: f64,
    [allowed, tolerance]: [f64; 2],
) -> PhantomError {
    PhantomError::Tolerance {
        term,
        reached,
        allowed,
        tolerance,
    }
}

/// The end of [`PhantomError::Tolerance`].
fn of_tolerance(allowed: f64, tolerance: f64) -> String {
    let part = match allowed < tolerance {
        true => format!(", of which {} is for this term", Number(brief(allowed))),
        false => String::new(),
    };
    format!("the tolerance is {}{part}", Number(tolerance))
}

/// Starts the threads of [`PhantomError::Threads`].
fn threads(given: usize) -> String {
    match given {
        0 => "a thread for each core".to_owned(),
        1 => "a thread".to_owned(),
        n => format!("{n} threads"),
    }
}

/// Returns `given` if it is finite and within `least..=most`.
///
/// # Errors
/// [`PhantomError::OutOfRange`].
pub fn check(what: &'static str, given: f64, [least, most]: [f64; 2]) -> Result<f64, PhantomError> {
    // NaN fails both comparisons.
    if given >= least && given <= most {
        Ok(given)
    } else {
        Err(PhantomError::OutOfRange {
            what,
            given,
            least,
            most,
        })
    }
}

/// Rejects samples that are not finite.
pub(crate) fn check_finite(what: &'static str, samples: &[f32]) -> Result<(), PhantomError> {
    let wrong = samples.iter().find(|sample| !sample.is_finite());
    let wrong = wrong.map_or(0.0, |sample| f64::from(*sample));
    check(what, wrong, [f32::MIN, f32::MAX].map(f64::from)).map(|_| ())
}

/// Returns zeros, or an error where `vec!` would abort the process for lack of memory.
pub(crate) fn zeros<T: Copy + Default>(
    what: &'static str,
    len: usize,
) -> Result<Vec<T>, PhantomError> {
    // Reserves first; `vec!` alone does not touch the memory.
    let mut room: Vec<T> = Vec::new();
    if room.try_reserve_exact(len).is_err() {
        let samples = len as f64;
        return Err(revolve_voxel::RevolveError::TooLarge { what, samples }.into());
    }
    drop(room);
    Ok(vec![T::default(); len])
}

/// Rejects a wrong number of values.
///
/// # Errors
/// [`PhantomError::WrongLength`].
pub fn check_length(what: &'static str, given: usize, expected: usize) -> Result<(), PhantomError> {
    if given == expected {
        Ok(())
    } else {
        Err(PhantomError::WrongLength {
            what,
            given,
            expected,
        })
    }
}

/// Returns `given` if it is within `least..=most`.
///
/// # Errors
/// [`PhantomError::Count`].
pub fn check_count(
    what: &'static str,
    given: usize,
    [least, most]: [usize; 2],
) -> Result<usize, PhantomError> {
    if (least..=most).contains(&given) {
        Ok(given)
    } else {
        Err(PhantomError::Count {
            what,
            given,
            least,
            most,
        })
    }
}
