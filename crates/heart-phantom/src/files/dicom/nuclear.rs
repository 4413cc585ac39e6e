//! Nuclear Medicine Image Storage: projections (`TOMO`, `GATED TOMO`) and volumes (`RECON TOMO`, `RECON GATED TOMO`).

use super::identity::series;
use super::item::{Item, decimal};
use super::pixels::Pixels;
use crate::error::{PhantomError, check, check_count};
use crate::files::names::millimetres;
use crate::files::turn::Turn;
use crate::files::{
    BeatCounts, Corrections, PROGRAM, Projections, Samples, Volume, write_atomically,
};
use crate::text::short;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::{tags, uids};
use std::io;
use std::path::Path;

/// Largest 16-bit number.
const MOST: [usize; 2] = [1, u16::MAX as usize];

/// Projections, of one or all gates.
pub(in crate::files) fn write_projections(
    path: &Path,
    projections: &Projections,
) -> Result<(), PhantomError> {
    let info = projections.info;
    let [views, rows, bins] = projections.shape();
    let each = views / info.heads;
    let turns = (projections.angles.chunks(each))
        .map(|angles| Turn::of(projections, angles))
        .collect::<Result<Vec<_>, _>>()?;
    let turn = &turns[0];
    let frames = Frames::new(
        [projections.n_gates(), info.heads],
        [each, rows, bins],
        projections.seconds_per_gate,
        info.beats,
    )?;
    let Frames { frames: n, .. } = frames;
    let [across, down] = projections.detector.pitch().map(millimetres);
    // One value, or one per view of a head.
    let radii: Vec<f64> = projections.radii.iter().map(|r| millimetres(*r)).collect();
    let radii_of = |head: usize| match radii.len() {
        1 => &radii[..],
        _ => &radii[head * each..(head + 1) * each],
    };
    let step = turn.extent / each as f64;
    // 0 at the back, as in the lab, with the opposite sign.
    let start = |turn: &Turn| decimal((360.0 - turn.start).rem_euclid(360.0));
    let direction = if turn.increases { "CW" } else { "CC" };
    let rotation = Item::new()
        .text(tags::START_ANGLE, VR::DS, &start(turn))
        .decimals(tags::ANGULAR_STEP, &[step])
        .text(tags::ROTATION_DIRECTION, VR::CS, direction)
        .decimals(tags::SCAN_ARC, &[turn.extent])
        .text(
            tags::ACTUAL_FRAME_DURATION,
            VR::IS,
            &milliseconds(info.seconds_per_view),
        )
        .decimals(tags::RADIAL_POSITION, radii_of(0))
        .shorts(tags::NUMBER_OF_FRAMES_IN_ROTATION, vec![frames.each]);
    // The front, right and head corner of the projected volume, where readers place reconstructions.
    let middle = |n: usize, mm: f64| short(0.5 * (n as f64 - 1.0) * mm);
    let (x, z) = (middle(bins, across), middle(rows, down));
    let detector = |(head, turn): (usize, &Turn)| {
        Item::new()
            .text(tags::COLLIMATOR_TYPE, VR::CS, "PARA")
            .text(tags::FOCAL_DISTANCE, VR::IS, "0")
            .text(tags::START_ANGLE, VR::DS, &start(turn))
            .decimals(tags::RADIAL_POSITION, radii_of(head))
            .decimals(tags::IMAGE_POSITION_PATIENT, &[-x, -x, z])
            .decimals(
                tags::IMAGE_ORIENTATION_PATIENT,
                &[1.0, 0.0, 0.0, 0.0, 0.0, -1.0],
            )
    };
    let kind = if frames.is_gated() {
        "ORIGINAL\\PRIMARY\\GATED TOMO\\EMISSION"
    } else {
        "ORIGINAL\\PRIMARY\\TOMO\\EMISSION"
    };
    let mut pointers = vec![
        tags::ENERGY_WINDOW_VECTOR,
        tags::DETECTOR_VECTOR,
        tags::ROTATION_VECTOR,
    ];
    pointers.extend(frames.pointers());
    pointers.push(tags::ANGULAR_VIEW_VECTOR);
    let heads = (1..=frames.heads).flat_map(|head| vec![head; n / info.heads]);
    let corrections = Corrections {
        decay: info.decay_corrected,
        ..Corrections::default()
    };
    let item = frames
        .put(common(kind, corrections))
        .pointers(tags::FRAME_INCREMENT_POINTER, pointers)
        .shorts(tags::ENERGY_WINDOW_VECTOR, vec![1; n])
        .shorts(tags::DETECTOR_VECTOR, heads.collect())
        .shorts(tags::ROTATION_VECTOR, vec![1; n])
        .shorts(tags::ANGULAR_VIEW_VECTOR, frames.within())
        .sequence(tags::ROTATION_INFORMATION_SEQUENCE, vec![rotation])
        .sequence(
            tags::DETECTOR_INFORMATION_SEQUENCE,
            turns.iter().enumerate().map(detector).collect(),
        );
    if info.counts {
        check_counts(projections.samples)?;
    }
    // Seen from the detector.
    let shape = [projections.n_gates(), info.heads, each];
    let seen = projections.samples.backwards_by_head(shape, rows * bins);
    let counts = match info.counts {
        true => Some(1.0),
        false => projections.common_counts(),
    };
    let pixels = Pixels::new(seen.as_samples(), counts);
    let item = pixels.put(item, frames.sides, [down, across]);
    write(path, item, projections.study)
}

/// A volume, of one or all gates.
pub(in crate::files) fn write_volume(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let [nx, ny, nz] = volume.grid.shape();
    let (gates, seconds) = (volume.n_gates(), volume.seconds_per_gate());
    let frames = Frames::new([gates, 1], [nz, ny, nx], seconds, volume.beats)?;
    let [dx, dy, dz] = volume.spacing_mm();
    let kind = match (frames.is_gated(), volume.transmission) {
        (true, false) => "DERIVED\\PRIMARY\\RECON GATED TOMO\\EMISSION",
        (true, true) => "DERIVED\\PRIMARY\\RECON GATED TOMO\\TRANSMISSION",
        (false, false) => "DERIVED\\PRIMARY\\RECON TOMO\\EMISSION",
        (false, true) => "DERIVED\\PRIMARY\\RECON TOMO\\TRANSMISSION",
    };
    let detector = Item::new()
        .text(tags::COLLIMATOR_TYPE, VR::CS, "PARA")
        .text(tags::FOCAL_DISTANCE, VR::IS, "0")
        .decimals(tags::IMAGE_POSITION_PATIENT, &volume.origin_mm())
        .decimals(
            tags::IMAGE_ORIENTATION_PATIENT,
            &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        );
    // Required, but meaningless here: a volume of this program need not belong to a rotation.
    let rotation = Item::new()
        .text(tags::START_ANGLE, VR::DS, "0")
        .text(tags::ANGULAR_STEP, VR::DS, "0")
        .text(tags::ROTATION_DIRECTION, VR::CS, "CC")
        .text(tags::SCAN_ARC, VR::DS, "0")
        .text(tags::ACTUAL_FRAME_DURATION, VR::IS, "0")
        .shorts(tags::NUMBER_OF_FRAMES_IN_ROTATION, vec![frames.each]);
    let mut pointers = frames.pointers();
    pointers.push(tags::SLICE_VECTOR);
    let item = frames
        .put(common(kind, volume.corrections))
        .pointers(tags::FRAME_INCREMENT_POINTER, pointers)
        .shorts(tags::SLICE_VECTOR, frames.within())
        .shorts(tags::NUMBER_OF_SLICES, vec![frames.each])
        .decimals(tags::SLICE_THICKNESS, &[dz])
        .decimals(tags::SPACING_BETWEEN_SLICES, &[dz])
        .sequence(tags::ROTATION_INFORMATION_SEQUENCE, vec![rotation])
        .sequence(tags::DETECTOR_INFORMATION_SEQUENCE, vec![detector]);
    let item = Pixels::new(volume.samples, None).put(item, frames.sides, [dy, dx]);
    write(path, item, volume.study)
}

fn write(path: &Path, item: Item, study: Option<&str>) -> Result<(), PhantomError> {
    write_atomically(path, |out| {
        for file in series(vec![item], uids::NUCLEAR_MEDICINE_IMAGE_STORAGE, study)? {
            file.write_all(&mut *out).map_err(io::Error::other)?;
        }
        Ok(())
    })
}

/// Formats a time as an integer of 32 bits.
fn milliseconds(seconds: f64) -> String {
    (1e3 * seconds).round().min(2e9).to_string()
}

/// Rejects counts that exceed a pixel of 16 bits.
fn check_counts(samples: Samples) -> Result<(), PhantomError> {
    let Samples::F32(counts) = samples else {
        return Ok(());
    };
    let most = counts.iter().copied().fold(0.0, f32::max);
    let what = "largest count (DICOM has 16 bits: reduce the counts or choose another format)";
    check(what, most.into(), [0.0, u16::MAX.into()]).map(drop)
}

/// Number and size of frames, and their gates.
struct Frames {
    gates: usize,
    /// Number of detectors.
    heads: u16,
    /// Frames per gate and detector.
    each: u16,
    /// All frames.
    frames: usize,
    /// Rows and columns.
    sides: [u16; 2],
    /// Seconds from one gate to the next.
    seconds: Option<f64>,
    /// R-R intervals.
    beats: Option<BeatCounts>,
}

impl Frames {
    fn new(
        [gates, heads]: [usize; 2],
        [each, rows, columns]: [usize; 3],
        seconds: Option<f64>,
        beats: Option<BeatCounts>,
    ) -> Result<Self, PhantomError> {
        let number = |what, n| check_count(what, n, MOST).map(|n| n as u16);
        number("gates", gates)?;
        let frames = gates.saturating_mul(heads).saturating_mul(each);
        let bytes = 2.0 * frames as f64 * rows as f64 * columns as f64;
        // The length of a value has 32 bits.
        check("bytes of the frames", bytes, [0.0, 4e9])?;
        Ok(Self {
            gates,
            heads: number("detectors", heads)?,
            each: number("frames", each)?,
            frames,
            sides: [number("rows", rows)?, number("columns", columns)?],
            seconds,
            beats,
        })
    }

    fn is_gated(&self) -> bool {
        self.seconds.is_some()
    }

    /// The role of a frame in a gated study, besides its number within the gate.
    fn pointers(&self) -> Vec<Tag> {
        if self.is_gated() {
            vec![tags::RR_INTERVAL_VECTOR, tags::TIME_SLOT_VECTOR]
        } else {
            Vec::new()
        }
    }

    /// The number of each frame within its gate, from 1.
    fn within(&self) -> Vec<u16> {
        let gates = self.gates * usize::from(self.heads);
        (0..gates).flat_map(|_| 1..=self.each).collect()
    }

    /// Attributes of all kinds of frames.
    fn put(&self, item: Item) -> Item {
        let item = item
            .text(tags::NUMBER_OF_FRAMES, VR::IS, &self.frames.to_string())
            .shorts(tags::NUMBER_OF_ENERGY_WINDOWS, vec![1])
            .shorts(tags::NUMBER_OF_DETECTORS, vec![self.heads])
            .shorts(tags::NUMBER_OF_ROTATIONS, vec![1]);
        let Some(seconds) = self.seconds else {
            return item;
        };
        let beat = seconds * self.gates as f64;
        let beats = self.beats.unwrap_or(BeatCounts {
            accepted: 1,
            rejected: 0,
            mean: beat,
            limits: [beat; 2],
            rejects: false,
        });
        let times = Item::new()
            .decimals(tags::FRAME_TIME, &[1e3 * seconds])
            .text(tags::NOMINAL_INTERVAL, VR::IS, &milliseconds(beats.mean))
            .text(tags::LOW_RR_VALUE, VR::IS, &milliseconds(beats.limits[0]))
            .text(tags::HIGH_RR_VALUE, VR::IS, &milliseconds(beats.limits[1]))
            .text(
                tags::INTERVALS_ACQUIRED,
                VR::IS,
                &beats.accepted.to_string(),
            )
            .text(
                tags::INTERVALS_REJECTED,
                VR::IS,
                &beats.rejected.to_string(),
            );
        let gated = Item::new().sequence(tags::DATA_INFORMATION_SEQUENCE, vec![times]);
        let slots = (1..=self.gates as u16).flat_map(|gate| vec![gate; self.each.into()]);
        let slots = slots.collect::<Vec<_>>().repeat(self.heads.into());
        let rejects = if beats.rejects { "Y" } else { "N" };
        item.shorts(tags::RR_INTERVAL_VECTOR, vec![1; self.frames])
            .shorts(tags::NUMBER_OF_RR_INTERVALS, vec![1])
            .shorts(tags::TIME_SLOT_VECTOR, slots)
            .shorts(tags::NUMBER_OF_TIME_SLOTS, vec![self.gates as u16])
            .text(tags::BEAT_REJECTION_FLAG, VR::CS, rejects)
            .sequence(tags::GATED_INFORMATION_SEQUENCE, vec![gated])
    }
}

/// Attributes of every nuclear medicine image.
fn common(kind: &str, corrections: Corrections) -> Item {
    // The defined terms of C.8.4.9.
    let corrected: Vec<&str> = [
        (corrections.decay, "DECY"),
        (corrections.attenuation, "ATTN"),
        (corrections.scatter, "SCAT"),
        (corrections.motion, "MOTN"),
    ]
    .into_iter()
    .filter_map(|(is_corrected, term)| is_corrected.then_some(term))
    .collect();
    let supine = Item::new().code(
        tags::PATIENT_ORIENTATION_MODIFIER_CODE_SEQUENCE,
        ["40199007", "supine"],
        Item::new(),
    );
    let window = Item::new().text(tags::ENERGY_WINDOW_NAME, VR::SH, "window");
    of_a_phantom("NM")
        .text(tags::IMAGE_TYPE, VR::CS, kind)
        .text(tags::BODY_PART_EXAMINED, VR::CS, "HEART")
        .empty(&[
            (tags::ACQUISITION_DATE, VR::DA),
            (tags::ACQUISITION_TIME, VR::TM),
            (tags::COUNTS_ACCUMULATED, VR::IS),
        ])
        .text(tags::CORRECTED_IMAGE, VR::CS, &corrected.join("\\"))
        .sequence(tags::ENERGY_WINDOW_INFORMATION_SEQUENCE, vec![window])
        .sequence(tags::RADIOPHARMACEUTICAL_INFORMATION_SEQUENCE, Vec::new())
        .code(
            tags::PATIENT_ORIENTATION_CODE_SEQUENCE,
            ["102538003", "recumbent"],
            supine,
        )
        .code(
            tags::PATIENT_GANTRY_RELATIONSHIP_CODE_SEQUENCE,
            ["102540008", "headfirst"],
            Item::new(),
        )
}

/// Attributes of every image: a patient without a name, and no dates.
pub(super) fn of_a_phantom(modality: &str) -> Item {
    Item::new()
        .text(tags::SPECIFIC_CHARACTER_SET, VR::CS, "ISO_IR 192")
        .text(tags::MODALITY, VR::CS, modality)
        .text(tags::MANUFACTURER, VR::LO, "heart-phantom")
        .text(tags::MANUFACTURER_MODEL_NAME, VR::LO, PROGRAM)
        .text(tags::SOFTWARE_VERSIONS, VR::LO, env!("CARGO_PKG_VERSION"))
        .text(tags::PATIENT_NAME, VR::PN, "Phantom^Heart")
        .text(tags::PATIENT_ID, VR::LO, "heart-phantom")
        .text(tags::SERIES_NUMBER, VR::IS, "1")
        .text(tags::INSTANCE_NUMBER, VR::IS, "1")
        .empty(&[
            (tags::STUDY_DATE, VR::DA),
            (tags::STUDY_TIME, VR::TM),
            (tags::CONTENT_DATE, VR::DA),
            (tags::CONTENT_TIME, VR::TM),
            (tags::ACCESSION_NUMBER, VR::SH),
            (tags::REFERRING_PHYSICIAN_NAME, VR::PN),
            (tags::STUDY_ID, VR::SH),
            (tags::PATIENT_BIRTH_DATE, VR::DA),
            (tags::PATIENT_SEX, VR::CS),
            (tags::POSITION_REFERENCE_INDICATOR, VR::LO),
        ])
}
