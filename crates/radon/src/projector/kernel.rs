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
    /// The exact area of the bin's strip within each pixel, divided by the pitch: the length of a ray within the pixel
    /// (Siddon 1985, doi:10.1118/1.595715) averaged over the bin.
    Strip,
}
