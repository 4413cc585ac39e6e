//! The files read by other packages, if Python has them.

use super::*;

#[test]
fn independent_readers_agree() {
    let modules = "import nibabel, SimpleITK, numpy, nrrd, pydicom";
    let there = Command::new("python3").args(["-c", modules]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: python3 cannot `{modules}`; see tests/readers/requirements.txt");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    for format in plain() {
        let grid = grid(format);
        let floats = sampled(&grid);
        let bytes = labels(&grid);
        let words: Vec<u16> = bytes.iter().map(|&v| 257 * u16::from(v)).collect();
        for (kind, volume) in [
            ("float32", Volume::new(grid, floats.as_slice()).unwrap()),
            ("uint8", Volume::new(grid, bytes.as_slice()).unwrap()),
            ("uint16", Volume::new(grid, words.as_slice()).unwrap()),
        ] {
            let name = format!("{format:?}-{kind}.{}", format.info().volume.header);
            write(&folder.path().join(&name), &volume, format).unwrap();
            files.push(serde_json::json!({
                "name": name, "format": format, "type": kind, "origin": grid.origin(),
            }));
        }
    }
    // Both directions of rotation, from an angle that is distinct from its negative, from half turns and from multiples of a quarter.
    let growing: Vec<f64> = (0..6).map(|k| 0.5 + 0.25 * f64::from(k)).collect();
    let falling: Vec<f64> = growing.iter().rev().copied().collect();
    let mut stacks = Vec::new();
    for (way, angles) in [("growing", &growing), ("falling", &falling)] {
        let (detector, samples) = stack(angles, [0.0; 2]);
        let radii: Vec<f64> = (0..6).map(|k| 11.0 + 0.5 * f64::from(k * k)).collect();
        for (orbit, radius) in [("circle", &[RADIUS][..]), ("radii", &radii)] {
            let projections = Projections::new(detector, angles, radius, samples.as_slice());
            for format in plain() {
                let Some(extensions) = format.info().projections else {
                    continue;
                };
                let name = format!("{format:?}-{way}-{orbit}.{}", extensions.header);
                let path = folder.path().join(&name);
                write(&path, projections.as_ref().unwrap(), format).unwrap();
                let radii = (orbit == "radii").then_some(&radii);
                stacks.push(serde_json::json!({
                    "name": name, "format": format, "angles": angles, "radii": radii,
                }));
            }
        }
    }
    let fields = fields(folder.path());
    let beats = beats(folder.path());
    let dicom = dicom(folder.path(), &[growing, falling]);
    let scene = serde_json::json!({
        "fields": fields,
        "shape": SHAPE, "spacing": SPACING, "field": [1.0, 8.0, 64.0], "files": files,
        "bins": BINS, "rows": ROWS, "pitch": PITCH, "radius": RADIUS,
        "seen": [0.125, 0.015625], "stacks": stacks, "beats": beats, "dicom": dicom,
        "gates": GATES, "seconds": SECONDS,
    });
    fs::write(folder.path().join("scene.json"), scene.to_string()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("readers/check.py");
    let run = Command::new("python3")
        .arg(script)
        .arg(folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stdout).into_owned();
    let complaints = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(run.status.success(), "{said}{complaints}");
    let n = files.len() + stacks.len() + fields.len() + beats.len() + dicom.len();
    let expected = format!("{n} files agree");
    assert!(said.contains(&expected), "{said}");
    eprintln!("{said}");
}

/// Vectors that depend linearly on the position, with distinct axes and signs, in each format that stores vectors.
fn fields(folder: &Path) -> Vec<serde_json::Value> {
    let gradient = [[1.0, 0.5, -0.25], [0.0, -2.0, 0.75], [0.5, 0.25, 3.0]];
    let offset = [0.25, -1.5, 4.0];
    let mut made = Vec::new();
    for format in Format::ALL
        .into_iter()
        .filter(|format| format.info().fields)
    {
        let grid = grid(format);
        let [nx, ny, nz] = grid.shape();
        let mut samples = Vec::new();
        for k in 0..nx * ny * nz {
            let p = grid.centre(k % nx, k / nx % ny, k / (nx * ny));
            for a in 0..3 {
                let value: f64 = (0..3).map(|b| gradient[a][b] * p[b]).sum();
                samples.push((value + offset[a]) as f32);
            }
        }
        for of in [
            FieldOf::Displacement,
            FieldOf::Velocity,
            FieldOf::Components(3),
        ] {
            let kind = match of {
                FieldOf::Components(_) => "Components".to_owned(),
                of => format!("{of:?}"),
            };
            let name = format!("field-{format:?}-{kind}.{}", format.info().volume.header);
            let field = Volume::of_field(grid, &samples, of).unwrap();
            write(&folder.join(&name), &field, format).unwrap();
            made.push(serde_json::json!({
                "name": name, "format": format, "of": kind, "origin": grid.origin(),
                "gradient": gradient, "offset": offset,
            }));
        }
    }
    made
}

const GATES: usize = 3;
const SECONDS: f64 = 0.25;

/// `one` for each gate, plus 1000 per gate index.
fn by_gates(one: &[f32]) -> Vec<f32> {
    let of = |gate: usize| one.iter().map(move |v| v + 1000.0 * gate as f32);
    (0..GATES).flat_map(of).collect()
}

/// Volumes of all gates in one file, and projections.
fn beats(folder: &Path) -> Vec<serde_json::Value> {
    let mut made = Vec::new();
    for format in [
        Format::Nifti,
        Format::NiftiGz,
        Format::MetaImage,
        Format::MetaImageSingle,
        Format::Nrrd,
        Format::InterfileSimind,
    ] {
        let grid = grid(format);
        let samples = by_gates(&sampled(&grid));
        let volume = Volume::of_gates(grid, samples.as_slice(), SECONDS).unwrap();
        let name = format!("{format:?}-beat.{}", format.info().volume.header);
        write(&folder.join(&name), &volume, format).unwrap();
        made.push(serde_json::json!({"name": name, "format": format, "origin": grid.origin()}));
    }
    made
}

/// DICOM of both directions of rotation, gated and not, a volume and a CT.
fn dicom(folder: &Path, ways: &[Vec<f64>]) -> Vec<serde_json::Value> {
    let mut made = Vec::new();
    for (way, angles) in ways.iter().enumerate() {
        let (detector, one) = stack(angles, [0.0; 2]);
        let all = by_gates(&one);
        for gated in [false, true] {
            let projections = match gated {
                false => Projections::new(detector, angles, &[RADIUS], one.as_slice()),
                true => Projections::of_gates(detector, angles, &[RADIUS], all.as_slice(), SECONDS),
            };
            let name = format!("views-{way}-{gated}.dcm");
            write(&folder.join(&name), &projections.unwrap(), Format::Dicom).unwrap();
            made.push(serde_json::json!({
                "name": name, "kind": "views", "gated": gated, "angles": angles,
            }));
        }
    }
    let grid = grid(Format::Dicom);
    let one = sampled(&grid);
    let all = by_gates(&one);
    for gated in [false, true] {
        let volume = match gated {
            false => Volume::new(grid, one.as_slice()),
            true => Volume::of_gates(grid, all.as_slice(), SECONDS),
        };
        let name = format!("volume-{gated}.dcm");
        write(&folder.join(&name), &volume.unwrap(), Format::Dicom).unwrap();
        made.push(serde_json::json!({
            "name": name, "kind": "volume", "gated": gated, "origin": grid.origin(),
        }));
    }
    {
        let map: Vec<f32> = (0..grid.len()).map(|k| 0.002 * k as f32).collect();
        let volume = Volume::new(grid, map.as_slice()).unwrap();
        let water = 0.1536;
        let names = heart_phantom::files::write_ct(folder, "ct", &volume, water).unwrap();
        made.push(serde_json::json!({
            "kind": "ct", "names": names, "origin": grid.origin(), "water": water, "step": 0.002,
        }));
    }
    made
}
