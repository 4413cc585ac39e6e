//! Conversion of samples to 16-bit integers with a scale factor.

use super::item::{Item, decimal};
use crate::files::Samples;
use dicom_core::VR;
use dicom_dictionary_std::tags;

/// Bound on the rounding to 32 bits of a count of at most 65535.
const ROUNDING: f64 = 0.01;

/// Frames in their stored form.
pub(super) struct Pixels {
    bytes: Vec<u8>,
    bits: u16,
    signed: bool,
    /// The value of one unit, with the digits in the file.
    factor: String,
}

impl Pixels {
    /// Labels are stored unchanged. Other samples are divided by `factor`: the reciprocal of the counts of a sample of 1 if all
    /// samples are counts that fit, else the largest magnitude over the largest pixel.
    pub(super) fn new(samples: Samples, counts: Option<f64>) -> Self {
        match samples {
            Samples::U8(values) => {
                let mut bytes = values.to_vec();
                if bytes.len() % 2 == 1 {
                    bytes.push(0); // a value has an even length
                }
                Self::labels(bytes, 8)
            }
            Samples::U16(values) => {
                Self::labels(values.iter().flat_map(|v| v.to_le_bytes()).collect(), 16)
            }
            Samples::F32(values) => Self::scaled(values, counts),
        }
    }

    /// Stored values are the samples.
    pub(super) fn signed(bytes: Vec<u8>) -> Self {
        Self {
            signed: true,
            ..Self::labels(bytes, 16)
        }
    }

    fn labels(bytes: Vec<u8>, bits: u16) -> Self {
        Self {
            bytes,
            bits,
            signed: false,
            factor: "1".into(),
        }
    }

    fn scaled(values: &[f32], counts: Option<f64>) -> Self {
        let all = || values.iter().map(|&value| f64::from(value));
        let signed = all().any(|value| value < 0.0);
        let factor = match counts {
            Some(counts) if all().all(|value| is_count(value * counts)) => 1.0 / counts,
            _ => {
                let most = all().fold(0.0, |most: f64, value| most.max(value.abs()));
                let largest = match signed {
                    true => f64::from(i16::MAX),
                    false => f64::from(u16::MAX),
                };
                if most > 0.0 { most / largest } else { 1.0 }
            }
        };
        let factor = decimal(factor);
        // Pixels are relative to the value in the file.
        let over = factor.parse::<f64>().unwrap_or(1.0);
        let whole = all().map(|value| (value / over).round());
        let bytes = match signed {
            true => whole.flat_map(|v| (v as i16).to_le_bytes()).collect(),
            false => whole.flat_map(|v| (v as u16).to_le_bytes()).collect(),
        };
        Self {
            bytes,
            bits: 16,
            signed,
            factor,
        }
    }

    /// The attributes of the image, `columns` by `rows` pixels of `[down, across]` mm a frame.
    pub(super) fn put(self, item: Item, [rows, columns]: [u16; 2], spacing: [f64; 2]) -> Item {
        item.shorts(tags::SAMPLES_PER_PIXEL, vec![1])
            .text(tags::PHOTOMETRIC_INTERPRETATION, VR::CS, "MONOCHROME2")
            .shorts(tags::ROWS, vec![rows])
            .shorts(tags::COLUMNS, vec![columns])
            .decimals(tags::PIXEL_SPACING, &spacing)
            .shorts(tags::BITS_ALLOCATED, vec![self.bits])
            .shorts(tags::BITS_STORED, vec![self.bits])
            .shorts(tags::HIGH_BIT, vec![self.bits - 1])
            .shorts(tags::PIXEL_REPRESENTATION, vec![self.signed.into()])
            .text(tags::RESCALE_INTERCEPT, VR::DS, "0")
            .text(tags::RESCALE_SLOPE, VR::DS, &self.factor)
            .pixels(self.bytes, self.bits)
    }
}

fn is_count(value: f64) -> bool {
    (0.0..=65535.0 + ROUNDING).contains(&value) && (value - value.round()).abs() <= ROUNDING
}
