//! What can go wrong, with the numbers that show why.

use crate::scene::{SceneError, place_in};
use crate::text::{Number, brief, enough, shown, shown_path};
use std::path::PathBuf;

/// Every failure of this crate. A message says what its own level knows; what led to it is the error's [`source`](std::error::Error::source), so that
/// the messages of the chain, joined by `: `, say each thing once.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PhantomError {
    /// Finer and finer triangles do not enclose the volume to the tolerance: it has fewer digits, so small is the body for its
    /// distance from the origin.
    #[error("triangles enclose the volume to {reached:e} only; the tolerance is {tolerance:e}")]
    NotMeshed {
        /// Relative error of the volume that was reached.
        reached: f64,
        /// What was asked for.
        tolerance: f64,
    },
    /// A number is not finite or outside the range that makes sense.
    #[error("{what} is {}, must be between {} and {}", Number(*given), Number(*least), Number(*most))]
    OutOfRange {
        /// Which quantity.
        what: &'static str,
        /// The value given.
        given: f64,
        /// Smallest value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// A count is outside the range that makes sense.
    #[error("{what} is {given}, must be between {least} and {most}")]
    Count {
        /// Which quantity.
        what: &'static str,
        /// The value given.
        given: usize,
        /// Smallest value allowed.
        least: usize,
        /// Largest value allowed.
        most: usize,
    },
    /// A count must be even.
    #[error("{what} is {given}, must be even")]
    Odd {
        /// Which quantity.
        what: &'static str,
        /// The value given.
        given: usize,
    },
    /// A gate does not come in the time of a view.
    #[error(
        "gate {gate} does not come in the time of view {view_idx}; a view that lasts a beat, and a breath where that is gated, sees every gate"
    )]
    Unseen {
        /// The gate, from 0.
        gate: usize,
        /// The first view without it.
        view_idx: usize,
    },
    /// An array has the wrong length.
    #[error("{what}: {given} values given, {expected} expected")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The length that fits.
        expected: usize,
    },
    /// The system would not give the threads asked for.
    #[error("cannot start {}", threads(*given))]
    Threads {
        /// The number asked for; 0 for one a core.
        given: usize,
        /// What the operating system said.
        source: rayon::ThreadPoolBuildError,
    },
    /// A balloon's dimensions or stiffness make no membrane.
    #[error(transparent)]
    Balloon(#[from] membrane_newton::MembraneError),
    /// A membrane could not be solved for.
    #[error(transparent)]
    Membrane(#[from] membrane_newton::NewtonError),
    /// A membrane could not be moved.
    #[error(transparent)]
    Motion(#[from] membrane_implicit::ImplicitError),
    /// The inner membrane reaches outside the outer one.
    #[error(
        "at a volume gain of {} the inner membrane is {} cm outside the outer one (x = {} cm from the base, r = {} cm); \
         give the balloons more alike lengths, a thicker wall, or the cavity less volume",
        Number(brief(*gain)),
        Number(brief(*depth)),
        Number(brief(*x)),
        Number(brief(*r))
    )]
    Crossed {
        /// Volume gain of the cavity.
        gain: f64,
        /// How far outside it is at most, cm.
        depth: f64,
        /// Distance from the base there, cm.
        x: f64,
        /// Radius there, cm.
        r: f64,
    },
    /// The wall has no material coordinates, which defects are given in: lines between points of equal s cross in it.
    #[error("at a volume gain of {} the wall has no place for defects, and no motion of material", Number(brief(*gain)))]
    NoMaterial {
        /// Volume gain of the cavity.
        gain: f64,
        /// Where and why.
        source: Box<PhantomError>,
    },
    /// A defect, or what later ones leave of it, is no solid.
    #[error("defect {} at a volume gain of {}", defect + 1, Number(brief(*gain)))]
    NoDefect {
        /// Its number, from 0.
        defect: usize,
        /// Volume gain of the cavity.
        gain: f64,
        /// Why.
        source: Box<PhantomError>,
    },
    /// The heart reaches beyond the background that is to surround it.
    #[error(
        "at a volume gain of {} the heart reaches beyond the background around it, {} times as far as its surface",
        Number(brief(*gain)),
        Number(enough(*times))
    )]
    Uncovered {
        /// Volume gain of the cavity.
        gain: f64,
        /// How much wider the background has to be, about its axis.
        times: f64,
    },
    /// The collimator's face is not in front of all that there is.
    #[error(
        "in view {view_idx} the collimator's face is {} cm from the axis of turning, and the body reaches {} cm towards it",
        Number(brief(*radius)),
        Number(enough(*needed))
    )]
    DetectorInside {
        /// The view in which it is farthest inside.
        view_idx: usize,
        /// How far from the axis of turning the face is there, cm.
        radius: f64,
        /// How far the body reaches, cm.
        needed: f64,
    },
    /// A solid, its rays or its voxels could not be made.
    #[error(transparent)]
    Solid(#[from] revolve_voxel::RevolveError),
    /// A reconstruction could not be made.
    #[error(transparent)]
    Radon(#[from] radon::RadonError),
    /// A file format has no place for what it was to hold.
    #[error("{format} cannot hold {what}")]
    Unsupported {
        /// The format.
        format: &'static str,
        /// What it cannot hold.
        what: &'static str,
    },
    /// A path does not end as its format wants, or its name cannot stand in a header.
    #[error("{}: the name must end in .{expected}", shown_path(path))]
    Extension {
        /// The path given.
        path: PathBuf,
        /// The extension that fits.
        expected: &'static str,
    },
    /// Values of a scene, or combinations of them, are not allowed.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// A scene makes sense, and yet there is a reason for which it cannot be run.
    #[error("{}{field}", place_in(file.as_deref(), *place))]
    Refused {
        /// The file, if it came from one.
        file: Option<PathBuf>,
        /// Line and column of the field, from 1; `None` for a scene without a text, or a field that its text leaves out.
        place: Option<[usize; 2]>,
        /// The field that is to blame, such as `defects.1`, the first of them.
        // tidy: allow string: the path of a field in the file
        field: String,
        /// The reason.
        source: Box<PhantomError>,
    },
    /// More memory is needed than the operating system can give.
    #[error("the computation needs {needed} bytes of memory; {available} are available")]
    Memory {
        /// Bytes needed at most.
        needed: u64,
        /// Bytes available.
        available: u64,
    },
    /// Something is asked for that this phantom has not.
    #[error("there is no {what}")]
    Absent {
        /// What was asked for.
        what: &'static str,
    },
    /// Counts of a given total have to be of something.
    #[error("the camera sees no activity, of which there could be counts")]
    NothingToCount,
    /// This build leaves something out.
    #[error("this build has no {what}, without the feature `{feature}`")]
    NotBuilt {
        /// What was asked for.
        what: &'static str,
        /// The feature that has it.
        feature: &'static str,
    },
    /// No resolution that is tried meets the tolerance of the samples.
    #[error(
        "{term}: the error is {} at the finest resolution, and may be {}",
        Number(brief(*reached)),
        Number(*tolerance)
    )]
    Tolerance {
        /// The term of [`ViewError`](crate::ViewError).
        term: &'static str,
        /// Estimated error, relative to the largest sample.
        reached: f64,
        /// The error allowed.
        tolerance: f64,
    },
    /// A file could not be read.
    #[error("cannot read {}", shown_path(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// Somebody else writes into the folder.
    #[error("another run writes to {}: {}", shown_path(path), shown(holder))]
    Busy {
        /// The folder.
        path: PathBuf,
        /// Process and computer.
        // tidy: allow string: what the other process has written
        holder: String,
    },
    /// A folder has a report that no run of ours has written.
    #[error(
        "{} is there, and no report of this program; choose another folder, or move it away",
        shown_path(path)
    )]
    Foreign {
        /// The file, or whatever has its name.
        path: PathBuf,
    },
    /// A file belongs to a run whose report is beside it.
    #[error(
        "{} belongs to the run whose report.json is beside it; choose another folder",
        shown_path(path)
    )]
    Listed {
        /// The file.
        path: PathBuf,
    },
    /// A file or folder could not be written.
    #[error("cannot write {}", shown_path(path))]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
}

impl From<SceneError> for PhantomError {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

/// The threads of [`PhantomError::Threads`].
fn threads(given: usize) -> String {
    match given {
        0 => "a thread for each core".to_owned(),
        1 => "a thread".to_owned(),
        n => format!("{n} threads"),
    }
}

/// `given` if it is finite and within `least..=most`.
pub(crate) fn check(
    what: &'static str,
    given: f64,
    [least, most]: [f64; 2],
) -> Result<f64, PhantomError> {
    // A NaN fails both comparisons.
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

/// As many values as expected.
pub(crate) fn check_length(
    what: &'static str,
    given: usize,
    expected: usize,
) -> Result<(), PhantomError> {
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

/// `given` if it is within `least..=most`.
pub(crate) fn check_count(
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_are_named_as_they_were_asked_for() {
        // A second global pool is refused, whatever the machine.
        let refused = || {
            let build = || rayon::ThreadPoolBuilder::new().build_global();
            build().and_then(|()| build()).unwrap_err()
        };
        for (given, says) in [
            (0, "cannot start a thread for each core"),
            (1, "cannot start a thread"),
            (4096, "cannot start 4096 threads"),
        ] {
            let source = refused();
            let error = PhantomError::Threads { given, source };
            assert_eq!(error.to_string(), says);
        }
    }
}
