//! Exports a member as NIfTI in the layout of nnU-Net and MONAI.

use crate::cohort::{Cohort, Subset};
use crate::compute::RunOptions;
use crate::error::CohortError;
use crate::folder::check_own;
use flate2::Compression;
use flate2::write::GzEncoder;
use heart_phantom::files::{Volume, create_writable_folder, nifti_bytes, write_atomically};
use heart_phantom::{Phantom, PhantomError, Product};
use serde_json::{Value, json};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The list of cases and its name.
const DATASET: &str = "dataset.json";
const NAME: &str = "heart-phantom";

/// Computes a member, without reading its shard, and writes its gates to a directory, one case per gate. The image `imagesTr/heart_KEY_GG_0000.nii.gz` is the
/// reconstruction, or the exact activity if the scene has no reconstruction; the labels `labelsTr/heart_KEY_GG.nii.gz` are those in
/// the middle of the gate. Members of the test subset are written to `imagesTs` and `labelsTs`. `dataset.json` lists all cases of
/// the directory: `channel_names`, `labels`, `numTraining` and `file_ending` follow nnU-Net version 2, `training` and `test` the
/// Medical Segmentation Decathlon (MONAI). Returns the files, relative to the directory.
///
/// `memory` is the number of bytes for shapes of the heart, as in [`RunOptions`]. Threads are those of the current pool.
///
/// # Errors
/// [`PhantomError::Count`] for no memory; [`PhantomError::Foreign`] for a `dataset.json` of another program; [`CohortError::NoMember`],
/// [`CohortError::NoScene`]; [`CohortError::Phantom`] for a rejected member and for files that cannot be written.
pub fn export(
    cohort: &Cohort,
    member: u64,
    folder: &Path,
    memory: usize,
) -> Result<Vec<PathBuf>, CohortError> {
    /// Bytes per voxel of the image and its labels, and of an image as NIfTI.
    const BYTES_EACH: u64 = 4 + 1 + 4;
    RunOptions { threads: 1, memory }.check()?;
    check_own(&folder.join(DATASET), u64::MAX, |bytes| {
        serde_json::from_slice::<Value>(bytes).is_ok_and(|found| found["name"] == NAME)
    })?;
    let member = cohort.member(member)?;
    let phantom = Phantom::new(member.scene()?)?.with_memory(memory);
    let bytes = BYTES_EACH * phantom.camera().grid().len() as u64;
    let phantom = phantom.with_memory_share(1, bytes);
    phantom.prepare()?;
    let is_test = member.split == Some(Subset::Test);
    let set = if is_test { "Ts" } else { "Tr" };
    let [images, labels] = ["images", "labels"].map(|kind| format!("{kind}{set}"));
    for name in [&images, &labels] {
        create_writable_folder(&folder.join(name))?;
    }
    let reconstructs = (phantom.scene().output.write).contains(&Product::Reconstruction);
    let phases = phantom.phases();
    let mut files = Vec::new();
    for gate in 0..phantom.n_gates() {
        let image = match reconstructs {
            true => phantom.volume(gate)?,
            false => phantom.truth(gate)?,
        };
        let phase = phases.get(gate).or(phases.first());
        let map = phantom.labels(phase.map_or(0.0.into(), |phase| phase.at))?;
        let case = format!("heart_{}_{gate:02}", member.key);
        let grid = *phantom.camera().grid();
        for (name, volume) in [
            (
                format!("{images}/{case}_0000.nii.gz"),
                Volume::new(grid, image.as_slice())?,
            ),
            (
                format!("{labels}/{case}.nii.gz"),
                Volume::new(grid, map.as_slice())?,
            ),
        ] {
            let nifti = nifti_bytes(&volume, 1.0)?;
            write_atomically(&folder.join(&name), |out| {
                let mut out = GzEncoder::new(out, Compression::fast());
                out.write_all(&nifti)?;
                out.finish().map(drop)
            })?;
            files.push(name.into());
        }
    }
    let channel = if reconstructs {
        "reconstruction"
    } else {
        "activity"
    };
    let dataset = dataset(folder, &phantom, channel)?;
    write_atomically(&folder.join(DATASET), |out| writeln!(out, "{dataset:#}"))?;
    files.push(DATASET.into());
    Ok(files)
}

/// The content of `dataset.json` for the cases of the directory.
fn dataset(folder: &Path, phantom: &Phantom, channel: &str) -> Result<Value, PhantomError> {
    let cases = |set: &str| -> Result<Vec<Value>, PhantomError> {
        let path = folder.join(format!("labels{set}"));
        let entries = match fs::read_dir(&path) {
            Ok(entries) => entries.flatten().collect(),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            Err(source) => return Err(PhantomError::Read { path, source }),
        };
        let mut names: Vec<String> = (entries.iter())
            .filter_map(|entry| {
                Some(
                    entry
                        .file_name()
                        .to_str()?
                        .strip_suffix(".nii.gz")?
                        .to_owned(),
                )
            })
            .collect();
        names.sort();
        let case = |name: String| {
            json!({
                "image": format!("./images{set}/{name}_0000.nii.gz"), "label": format!("./labels{set}/{name}.nii.gz"),
            })
        };
        Ok(names.into_iter().map(case).collect())
    };
    let (training, test) = (cases("Tr")?, cases("Ts")?);
    let labels: serde_json::Map<String, Value> = (phantom.label_names().into_iter().enumerate())
        .map(|(label, name)| (name, label.into()))
        .collect();
    Ok(json!({
        "name": NAME, "channel_names": { "0": channel }, "labels": labels, "file_ending": ".nii.gz",
        "numTraining": training.len(), "training": training, "test": test,
    }))
}
