//! Division of a ray's length among pixels.

/// Division of a ray's length among the pixels that it intersects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Kernel {
    /// Linear interpolation at each row (or column) that the ray crosses (Joseph 1982, doi:10.1109/TMI.1982.4307572).
    #[default]
    Joseph,
    /// The exact length of the ray within each pixel (Siddon 1985, doi:10.1118/1.595715). A ray that runs along the edge between two
    /// pixels, to 2^-21 of a pixel, is shared by both.
    Siddon,
    /// The exact area of the bin's strip within each pixel, divided by the pitch: Siddon's length averaged over the bin.
    Strip,
}
