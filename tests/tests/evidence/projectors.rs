//! Joseph's method beside ASTRA and RTK on the same image (`tests/peers/joseph.py`).

use radon::{ImageGrid, Kernel, LinearOperator, ParallelGeometry, Projector};
use serde_json::Value;

const SIZE: usize = 14;
const BINS: usize = 15;

#[test]
fn joseph_s_method_agrees_with_other_programs() {
    let text = include_str!("../../peers/joseph.json");
    let published: Value = serde_json::from_str(text).unwrap();
    let numbers = |list: &Value| -> Vec<f64> {
        let list = list.as_array().unwrap().iter();
        list.map(|x| x.as_f64().unwrap()).collect()
    };
    let angles = numbers(&published["angles"]);
    let pixel = |k: usize| {
        let (x, y) = (k % SIZE, k / SIZE);
        let is_inside = x.min(y) >= 3 && x.max(y) < SIZE - 3;
        if is_inside {
            ((5 * x + 3 * y + x * y) % 11) as f64
        } else {
            0.0
        }
    };
    let image: Vec<f64> = (0..SIZE * SIZE).map(pixel).collect();
    let radians: Vec<f64> = angles.iter().map(|angle| angle.to_radians()).collect();
    let geometry = ParallelGeometry::new(radians, BINS, 1.0).unwrap();
    let grid = ImageGrid::square(SIZE, 1.0).unwrap();
    let projector = Projector::new(&geometry, &grid, Kernel::Joseph).unwrap();
    let found = projector.forward(&image).unwrap();
    for program in ["astra", "rtk"] {
        let rows = published[program].as_array().unwrap();
        let samples: Vec<f64> = rows.iter().flat_map(numbers).collect();
        assert_eq!(samples.len(), found.len());
        for (found, sample) in found.iter().zip(samples) {
            // single precision of samples up to 61
            assert!((found - sample).abs() < 1e-4, "{program}: {found} {sample}");
        }
    }
}
