//! The error type of the crate.

use crate::ScatterReport;

/// Invalid input, or a tolerance that was not reached.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScatterError {
    /// A number or a count is not finite or out of range.
    #[error("{what} is {}; it must be {}", number(*given), range(*given, [*least, *most]))]
    OutOfRange {
        /// The quantity.
        what: &'static str,
        /// The value given.
        given: f64,
        /// The least value allowed.
        least: f64,
        /// The largest value allowed.
        most: f64,
    },
    /// The nodes do not fit into memory.
    #[error(
        "{nodes} nodes of all views, windows and widths of the response are more than {most}: {} x {} of each at a pitch of {pitch} cm; increase `ScatterOptions::pitch` or reduce the detector",
        size[0], size[1]
    )]
    Nodes {
        /// Number of nodes.
        nodes: f64,
        /// The largest number allowed.
        most: f64,
        /// Columns and rows of them in a view, which extend beyond the detector by the width of the response.
        size: [usize; 2],
        /// [`ScatterOptions::pitch`](crate::ScatterOptions::pitch), their distance in cm.
        pitch: f64,
    },
    /// The largest number of histories does not suffice.
    #[error("{}; {} `ScatterOptions::most_histories`", tolerance(*asked, *reached, report.histories), more(*expected))]
    Tolerance {
        /// The tolerance given; 0 if only a relative one is given and no scatter exceeds three of its standard errors.
        asked: f64,
        /// The largest standard error of any bin.
        reached: f64,
        /// Number of histories for the tolerance, estimated: the standard error is proportional to its power -1/2. Infinite if no photon was
        /// recorded.
        expected: f64,
        /// The work done.
        report: Box<ScatterReport>,
    },
    /// The error of interpolation exceeds the tolerance, and a smaller distance of the nodes is not allowed, does not fit into memory
    /// or would require more than [`ScatterOptions::most_histories`](crate::ScatterOptions::most_histories).
    #[error(
        "the error of interpolation is {reached:?} at a pitch of {pitch} cm of the nodes, the tolerance is {asked:?}; increase the tolerance, or accept this error with `ScatterOptions::with_pitch`"
    )]
    Interpolation {
        /// The tolerance given.
        asked: f64,
        /// [`ScatterReport::interpolation_error`].
        reached: f64,
        /// Distance of the nodes in cm.
        pitch: f64,
    },
}

/// What was reached, and the tolerance.
fn tolerance(asked: f64, reached: f64, histories: u64) -> String {
    match asked == 0.0 {
        true => format!(
            "no scatter exceeds three of its standard errors, up to {reached:.3e}, after {histories} histories, so that a relative tolerance has no scale"
        ),
        false => format!(
            "the largest standard error is {reached:.3e} after {histories} histories, the tolerance is {asked:.3e}"
        ),
    }
}

/// The work that is missing, and what to change.
fn more(expected: f64) -> String {
    match expected.is_finite() {
        true => format!("about {expected:.1e} histories reach it: increase the tolerance or"),
        false => "no photon is recorded: prescribe `ScatterOptions::tolerance` or increase".into(),
    }
}

/// A number without a fraction of zero or a long row of digits.
fn number(x: f64) -> String {
    match x == 0.0 || (1e-5..1e16).contains(&x.abs()) {
        true => format!("{x}"),
        false => format!("{x:?}"),
    }
}

/// A range; a bound that only excludes numbers that are not finite is omitted.
fn range(given: f64, [least, most]: [f64; 2]) -> String {
    let lower = match least == f64::MIN_POSITIVE {
        true => "greater than 0".to_owned(),
        false => format!("at least {}", number(least)),
    };
    let finite = if given.is_finite() { "" } else { " and finite" };
    match most == f64::MAX {
        false if least == most => number(least),
        true => format!("{lower}{finite}"),
        false if least == f64::MIN_POSITIVE => format!("{lower} and at most {}", number(most)),
        false => format!("from {} to {}", number(least), number(most)),
    }
}

/// Returns a number that is in its range.
pub(crate) fn within(what: &'static str, given: f64, range: [f64; 2]) -> Result<f64, ScatterError> {
    let [least, most] = range;
    match given >= least && given <= most {
        true => Ok(given),
        false => Err(ScatterError::OutOfRange {
            what,
            given,
            least,
            most,
        }),
    }
}

/// Returns a number of a user's source or medium that is finite and not negative.
pub(crate) fn valid(what: &'static str, given: f64) -> Result<f64, ScatterError> {
    within(what, given, [0.0, f64::MAX])
}
