//! Random scene files, run completely: all requested products are written, bitwise identical with one thread and with two.

use crate::scenes::{number, text};
use crate::{Outcome, with_threads};
use heart_phantom::Scene;
use heart_phantom::{Phantom, no_observer, run};
use std::collections::BTreeMap;
use std::path::Path;
use tests::Random;

pub(crate) fn scene(random: &mut Random) -> Outcome {
    let mut text = text(random);
    text += &more(random, text.contains("[attenuation]"));
    match Scene::from_toml(&text) {
        Ok(scene) => ran(&scene),
        Err(_) => Outcome::Rejected,
    }
}

/// Fields that the text of the scenes omits: the rest of the reconstruction, a background, the output.
fn more(random: &mut Random, attenuates: bool) -> String {
    let mut text = String::new();
    let mut line = |entry: String| {
        text.push_str(&entry);
        text.push('\n');
    };
    if random.one_in(4) {
        let amount = number(random, 0.0, 0.5);
        let axes = [0, 1].map(|_| number(random, 5.0, 50.0));
        line(format!(
            "[background]\nconcentration = {amount}\ncentre = [0.0, 0.0]\nsemi_axes = [{}, {}]",
            axes[0], axes[1]
        ));
    }
    line("[output]".into());
    let all = [
        "projections",
        "reconstruction",
        "truth",
        "labels",
        "attenuation",
        "meshes",
        "pictures",
    ];
    let few = random.one_in(2);
    let chosen: Vec<String> = (all.iter())
        .filter(|_| !few || random.one_in(2))
        .filter(|name| attenuates || **name != "attenuation")
        .map(|name| format!("'{name}'"))
        .collect();
    line(format!("write = [{}]", chosen.join(", ")));
    let formats = [
        "npy",
        "npz",
        "nifti",
        "nifti-gz",
        "meta-image",
        "meta-image-single",
        "nrrd",
        "interfile-stir",
        "interfile-simind",
        "raw-json",
        "dicom",
    ];
    line(format!("volumes = '{}'", random.pick(&formats)));
    line(format!(
        "projections = '{}'",
        random.pick(&[
            "npy",
            "npz",
            "nrrd",
            "interfile-stir",
            "interfile-simind",
            "raw-json",
            "dicom"
        ])
    ));
    text
}

fn ran(scene: &Scene) -> Outcome {
    let ends = [1, 2].map(|threads| {
        let folder = tempfile::tempdir().expect("a folder");
        let end = with_threads(threads, || {
            let phantom = Phantom::new(scene.clone()).map_err(|error| format!("{error:?}"))?;
            let found = phantom.prepare().map_err(|error| format!("{error:?}"));
            let ran =
                run(&phantom, folder.path(), &no_observer).map_err(|error| format!("{error:?}"));
            // Errors are found before any work, and valid scenes run.
            assert_eq!(found.as_ref().err(), ran.as_ref().err());
            ran
        });
        (end, files(folder.path()))
    });
    let [(one, written), (two, again)] = ends;
    match (one, two) {
        (Ok(one), Ok(two)) => {
            assert_eq!(one, two);
            let names: Vec<_> = written.keys().collect();
            assert!(written == again, "the files {names:?} differ");
            for file in &one.files {
                let name = file.to_string_lossy();
                assert!(written.contains_key(&*name), "{name} of {names:?}");
            }
            let numbers = &one.numbers;
            assert!(
                numbers.edv.is_finite() && numbers.wall_volume > 0.0,
                "{numbers:?}"
            );
            Outcome::Answered
        }
        (Err(one), Err(two)) => {
            assert_eq!(one, two);
            Outcome::Rejected
        }
        (one, two) => panic!("{one:?} with one thread, {two:?} with two"),
    }
}

/// Every file of a folder by its name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    entries
        .map(|entry| {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy();
            (name.into_owned(), std::fs::read(&path).expect("a file"))
        })
        .collect()
}
