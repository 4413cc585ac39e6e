//! The definition of a sample: a line integral, or an average over its bin.

/// The definition of a sample of a view.
///
/// A detector measures averages over its bins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "scene",
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
pub enum BinSample {
    /// The value of the blurred image at the centre of the bin; without a response the line integral through it. It differs from the average by
    /// some per cent of the largest sample where the bins are wider than half the response.
    Centres,
    /// The average of the blurred image over the area of the bin.
    Averages,
}
