//! The definition of a sample: a line integral, or an average over its bin.

/// The definition of a sample of a view.
///
/// A detector measures averages over its bins. Line integrals alias: their error after a blur is some per cent of the largest sample where
/// the bins are wider than half the blur.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "scene",
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
pub enum BinSample {
    /// The line integral through the centre of the bin. A blur is the discrete Gaussian of its variance on the bins.
    Centres,
    /// The average of the blurred image over the area of the bin.
    Averages,
}
