//! Minimal readers, independent of the writers.

use super::*;

/// The content of a file: x fastest; sample (i, j, k) at `first + (i, j, k) * step` in the lab, cm.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) shape: [usize; 3],
    pub(super) first: [f64; 3],
    pub(super) step: [f64; 3],
    pub(super) samples: Vec<f64>,
}

impl Found {
    pub(super) fn centre(&self, index: usize) -> [f64; 3] {
        let [nx, ny, _] = self.shape;
        let k = [index % nx, index / nx % ny, index / nx / ny];
        [0, 1, 2].map(|a| self.first[a] + k[a] as f64 * self.step[a])
    }
}

pub(super) fn numbers(bytes: &[u8], kind: &str) -> Vec<f64> {
    match kind {
        "f32" => bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f64::from(f32::from_le_bytes(*b)))
            .collect(),
        "f64" => bytes
            .as_chunks::<8>()
            .0
            .iter()
            .map(|b| f64::from_le_bytes(*b))
            .collect(),
        "u8" => bytes.iter().map(|&b| f64::from(b)).collect(),
        "u16" => bytes
            .as_chunks::<2>()
            .0
            .iter()
            .map(|b| f64::from(u16::from_le_bytes(*b)))
            .collect(),
        kind => panic!("unknown kind {kind}"),
    }
}

pub(super) fn list(text: &str) -> Vec<f64> {
    text.split(|c: char| c.is_whitespace() || "(),".contains(c))
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().unwrap())
        .collect()
}

pub(super) fn three(values: &[f64]) -> [f64; 3] {
    values.try_into().unwrap()
}

pub(super) fn sizes(values: &[f64]) -> [usize; 3] {
    three(values).map(|v| v as usize)
}

pub(super) fn mm_to_cm(values: [f64; 3]) -> [f64; 3] {
    values.map(|mm| mm / 10.0)
}

/// Header lines `key SEPARATOR value`; an Interfile key loses its leading `!`.
pub(super) fn keys(text: &str, separator: &str) -> HashMap<String, String> {
    text.lines()
        .filter(|line| !line.starts_with([';', '#']))
        .filter_map(|line| line.split_once(separator))
        .map(|(key, value)| {
            let key = key.trim().trim_start_matches('!').to_string();
            (key, value.trim().to_string())
        })
        .collect()
}

/// A NumPy array: shape and values.
pub(super) fn read_npy(bytes: &[u8]) -> (Vec<usize>, Vec<f64>) {
    assert_eq!(&bytes[..6], b"\x93NUMPY");
    let start = 10 + u16::from_le_bytes([bytes[8], bytes[9]]) as usize;
    let header = String::from_utf8_lossy(&bytes[10..start]).into_owned();
    assert!(header.contains("'fortran_order': False"), "{header}");
    let kind = if header.contains("<f4") {
        "f32"
    } else if header.contains("<f8") {
        "f64"
    } else if header.contains("<u2") {
        "u16"
    } else {
        assert!(header.contains("|u1"), "{header}");
        "u8"
    };
    let shape = header.split_once("'shape': (").unwrap().1;
    let shape = list(shape.split_once(')').unwrap().0);
    let shape = shape.iter().map(|&n| n as usize).collect();
    (shape, numbers(&bytes[start..], kind))
}

/// The stored files of a zip archive, from its local headers. Sizes are in the 64-bit field.
pub(super) fn read_npz(bytes: &[u8]) -> HashMap<String, (Vec<usize>, Vec<f64>)> {
    let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]) as usize;
    let mut at = 0;
    let mut found = HashMap::new();
    while bytes[at..].starts_with(b"PK\x03\x04") {
        assert_eq!(word(at + 8), 0, "stored");
        let (name, extra) = (at + 30, at + 30 + word(at + 26));
        let data = extra + word(at + 28);
        assert_eq!(word(extra), 1, "64-bit sizes");
        let size = u64::from_le_bytes(bytes[extra + 4..extra + 12].try_into().unwrap());
        let end = data + size as usize;
        let name = String::from_utf8_lossy(&bytes[name..extra]).into_owned();
        found.insert(name, read_npy(&bytes[data..end]));
        at = end;
    }
    found
}

pub(super) fn read_nifti(bytes: &[u8]) -> Found {
    let short = |at: usize| i16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let float = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    assert_eq!(i32::from_le_bytes(bytes[..4].try_into().unwrap()), 348);
    assert_eq!(&bytes[344..348], b"n+1\0");
    assert_eq!((short(40), bytes[123]), (3, 2), "three axes, mm");
    assert_eq!((short(252), short(254)), (1, 1), "both forms");
    let kind = match (short(70), short(72)) {
        (2, 8) => "u8",
        (16, 32) => "f32",
        (512, 16) => "u16",
        other => panic!("{other:?}"),
    };
    // The rotation of a quaternion without its real part, from the NIfTI standard, method 2.
    let [b, c, d] = [256, 260, 264].map(float);
    let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
    let rotation = [
        [
            a * a + b * b - c * c - d * d,
            2.0 * (b * c - a * d),
            2.0 * (b * d + a * c),
        ],
        [
            2.0 * (b * c + a * d),
            a * a + c * c - b * b - d * d,
            2.0 * (c * d - a * b),
        ],
        [
            2.0 * (b * d - a * c),
            2.0 * (c * d + a * b),
            a * a + d * d - b * b - c * c,
        ],
    ];
    assert_eq!(float(76), 1.0, "qfac");
    let ras_to_lab = [-1.0, -1.0, 1.0];
    let mut found = Found {
        shape: [42, 44, 46].map(|at| short(at) as usize),
        first: [0.0; 3],
        step: [0.0; 3],
        samples: numbers(&bytes[float(108) as usize..], kind),
    };
    for i in 0..3 {
        for j in 0..3 {
            let s = float(280 + 16 * i + 4 * j);
            assert_eq!(
                s,
                rotation[i][j] * float(80 + 4 * j),
                "forms differ at {i} {j}"
            );
            assert!(i == j || s == 0.0);
        }
        assert_eq!(float(292 + 16 * i), float(268 + 4 * i), "offsets differ");
        found.first[i] = ras_to_lab[i] * float(268 + 4 * i) / 10.0;
        found.step[i] = ras_to_lab[i] * float(280 + 20 * i) / 10.0;
    }
    found
}

pub(super) fn read_metaimage(path: &Path, bytes: &[u8]) -> Found {
    let end = b"ElementDataFile";
    let at = bytes.windows(end.len()).position(|w| w == end).unwrap();
    let line = at + bytes[at..].iter().position(|&b| b == b'\n').unwrap() + 1;
    let header = keys(std::str::from_utf8(&bytes[..line]).unwrap(), " = ");
    assert_eq!(header["TransformMatrix"], "1 0 0 0 1 0 0 0 1");
    assert_eq!(header["BinaryDataByteOrderMSB"], "False");
    let kind = match header["ElementType"].as_str() {
        "MET_FLOAT" => "f32",
        "MET_UCHAR" => "u8",
        "MET_USHORT" => "u16",
        other => panic!("{other}"),
    };
    let data = match header["ElementDataFile"].as_str() {
        "LOCAL" => bytes[line..].to_vec(),
        name => fs::read(path.with_file_name(name)).unwrap(),
    };
    Found {
        shape: sizes(&list(&header["DimSize"])),
        first: mm_to_cm(three(&list(&header["Offset"]))),
        step: mm_to_cm(three(&list(&header["ElementSpacing"]))),
        samples: numbers(&data, kind),
    }
}

/// Fields, and the samples.
pub(super) fn read_nrrd(bytes: &[u8]) -> (HashMap<String, String>, Vec<f64>) {
    assert!(bytes.starts_with(b"NRRD0004\n"));
    let end = bytes.windows(2).position(|w| w == b"\n\n").unwrap();
    let text = std::str::from_utf8(&bytes[..end]).unwrap();
    let mut header = keys(text, ": ");
    header.extend(keys(text, ":="));
    assert_eq!(
        (&*header["encoding"], &*header["endian"]),
        ("raw", "little")
    );
    let kind = match header["type"].as_str() {
        "float" => "f32",
        "uint8" => "u8",
        "uint16" => "u16",
        other => panic!("{other}"),
    };
    (header, numbers(&bytes[end + 2..], kind))
}

/// Keys, and the samples of the data file named there.
pub(super) fn read_interfile(path: &Path) -> (HashMap<String, String>, Vec<f64>) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.starts_with("!INTERFILE :=\n") && text.ends_with("!END OF INTERFILE :=\n"));
    let header = keys(&text, ":=");
    assert_eq!(header["imagedata byte order"], "LITTLEENDIAN");
    let kind = match (
        &*header["number format"],
        &*header["number of bytes per pixel"],
    ) {
        ("float" | "short float", "4") => "f32",
        ("unsigned integer", "1") => "u8",
        ("unsigned integer", "2") => "u16",
        other => panic!("{other:?}"),
    };
    let data = fs::read(path.with_file_name(&header["name of data file"])).unwrap();
    (header, numbers(&data, kind))
}

pub(super) fn indexed(header: &HashMap<String, String>, key: &str) -> Vec<f64> {
    (1..=3)
        .filter_map(|k| header.get(&format!("{key} [{k}]")))
        .map(|value| value.parse().unwrap())
        .collect()
}

pub(super) fn read_json(path: &Path) -> (serde_json::Value, Vec<f64>) {
    let header: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let data = fs::read(path.with_file_name(header["data"].as_str().unwrap())).unwrap();
    let kind = match header["type"].as_str().unwrap() {
        "float32" => "f32",
        "uint8" => "u8",
        "uint16" => "u16",
        other => panic!("{other}"),
    };
    (header, numbers(&data, kind))
}

pub(super) fn json_list(value: &serde_json::Value) -> Vec<f64> {
    let list = value.as_array().unwrap();
    list.iter().map(|v| v.as_f64().unwrap()).collect()
}

pub(super) fn read(path: &Path, format: Format) -> Found {
    let bytes = fs::read(path).unwrap();
    match format {
        // The bare array: only the caller knows its position.
        Format::Npy => {
            let (shape, samples) = read_npy(&bytes);
            Found {
                shape: [shape[2], shape[1], shape[0]],
                first: grid(format).origin(),
                step: SPACING,
                samples,
            }
        }
        Format::Npz => {
            let arrays = read_npz(&bytes);
            let (shape, samples) = arrays["samples.npy"].clone();
            Found {
                shape: [shape[2], shape[1], shape[0]],
                first: three(&arrays["origin_cm.npy"].1),
                step: three(&arrays["spacing_cm.npy"].1),
                samples,
            }
        }
        Format::Nifti => read_nifti(&bytes),
        Format::NiftiGz => {
            let mut plain = Vec::new();
            let mut gz = flate2::read::GzDecoder::new(bytes.as_slice());
            std::io::Read::read_to_end(&mut gz, &mut plain).unwrap();
            read_nifti(&plain)
        }
        Format::MetaImage | Format::MetaImageSingle => read_metaimage(path, &bytes),
        Format::Nrrd => {
            let (header, samples) = read_nrrd(&bytes);
            assert_eq!(header["space"], "left-posterior-superior");
            let directions = list(&header["space directions"]);
            for (k, direction) in directions.iter().enumerate() {
                assert!(k % 4 == 0 || *direction == 0.0, "not along the axes");
            }
            Found {
                shape: sizes(&list(&header["sizes"])),
                first: mm_to_cm(three(&list(&header["space origin"]))),
                step: mm_to_cm([directions[0], directions[4], directions[8]]),
                samples,
            }
        }
        Format::InterfileStir => {
            let (header, samples) = read_interfile(path);
            assert_eq!(header["patient orientation"], "head_in");
            assert_eq!(header["patient rotation"], "supine");
            // Head in, supine: STIR's z runs to the feet.
            let to_lab = |v: [f64; 3]| [v[0] / 10.0, v[1] / 10.0, -v[2] / 10.0];
            Found {
                shape: sizes(&indexed(&header, "matrix size")),
                first: to_lab(three(&indexed(&header, "first pixel offset (mm)"))),
                step: to_lab(three(&indexed(&header, "scaling factor (mm/pixel)"))),
                samples,
            }
        }
        Format::InterfileSimind => {
            let (header, samples) = read_interfile(path);
            let mut size = indexed(&header, "matrix size");
            size.push(header["number of slices"].parse().unwrap());
            let mut step = indexed(&header, "scaling factor (mm/pixel)");
            let apart = &header["centre-centre slice separation (pixels)"];
            step.push(-step[0] * apart.parse::<f64>().unwrap());
            let step = mm_to_cm(three(&step));
            let shape = sizes(&size);
            Found {
                shape,
                first: [0, 1, 2].map(|a| -0.5 * (shape[a] as f64 - 1.0) * step[a]),
                step,
                samples,
            }
        }
        Format::RawJson => {
            let (header, samples) = read_json(path);
            let shape = sizes(&json_list(&header["shape"]));
            Found {
                shape: [shape[2], shape[1], shape[0]],
                first: three(&json_list(&header["origin_cm"])),
                step: three(&json_list(&header["spacing_cm"])),
                samples,
            }
        }
        other => panic!("no reader for {other:?}"),
    }
}
