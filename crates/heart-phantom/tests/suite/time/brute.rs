//! Reference projections: the average of very many instants, each with its own shape and angle. It shares solved shapes and rays with the
//! crate, but not the choice of times and angles.

use heart_phantom::Phantom;
use heart_phantom::{Mode, Rotation};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Shapes are solved at this number of volumes, and interpolated linearly: the error of the sharpest change, that of a ray that touches the
/// surface, scales with the power -3/2.
const GAINS: f64 = 4000.0;

/// A view of a gate from `n` instants.
pub(crate) fn view(phantom: &Phantom, gate: usize, view_idx: usize, n: usize) -> Vec<f64> {
    let scene = phantom.scene();
    let (camera, interval) = (&scene.camera, scene.camera.seconds_per_view);
    let turning = camera.rotation == Rotation::Continuous;
    let (from, seconds, gates) = match scene.acquisition.mode {
        Mode::Static { .. } => panic!("nothing moves"),
        Mode::Instants => (view_idx as f64 * interval, 0.0, 1),
        Mode::Exposure { seconds } => (view_idx as f64 * interval, seconds, 1),
        // With step and shoot a view is an average over a beat, at any time.
        Mode::WholeCycle if !turning => (0.0, phantom.cycle().period(), 1),
        Mode::Gated { gates } if !turning => (0.0, phantom.cycle().period(), gates),
        Mode::WholeCycle => (view_idx as f64 * interval, interval, 1),
        Mode::Gated { gates } => (view_idx as f64 * interval, interval, gates),
        _ => panic!("no such time"),
    };
    let step = (camera.arc / camera.views as f64).to_radians();
    let nominal = (camera.start + view_idx as f64 * camera.arc / camera.views as f64).to_radians();
    // Instants with the same volume and angle are one.
    let mut moments = BTreeMap::<(u64, u64), f64>::new();
    let windows = windows(from, seconds, phantom.cycle().period(), [gate, gates]);
    let all: f64 = windows.iter().map(|[from, to]| to - from).sum();
    for [start, end] in windows {
        let here = if all > 0.0 { (end - start) / all } else { 1.0 };
        let n = (here * n as f64).ceil();
        for j in 0..n as usize {
            let t = start + (end - start) * (j as f64 + 0.5) / n;
            let phase = (t * scene.cycle.beats_per_minute / 60.0).rem_euclid(1.0);
            let share = t / interval - view_idx as f64;
            let angle = if turning {
                nominal + (share - 0.5) * step
            } else {
                nominal
            };
            let [low, high] = phantom.cycle().gains();
            let gain = phantom.cycle().gain(phase);
            let at = match high > low {
                true => (gain - low) / (high - low) * GAINS,
                false => 0.0,
            };
            for (grid, near) in [
                (at.floor(), 1.0 + at.floor() - at),
                (at.floor() + 1.0, at - at.floor()),
            ] {
                if near > 0.0 {
                    let gain = low + (high - low) * grid / GAINS;
                    let sum = moments
                        .entry((gain.to_bits(), angle.to_bits()))
                        .or_default();
                    *sum += near * here / n;
                }
            }
        }
    }
    let moments: Vec<((u64, u64), f64)> = moments.into_iter().collect();
    let parts: Vec<Vec<f64>> = moments
        .par_chunks(64)
        .map(|part| weighted(phantom, part))
        .collect();
    let mut sum = vec![0.0f64; phantom.camera().view_len()];
    for part in parts {
        for (sum, value) in sum.iter_mut().zip(part) {
            *sum += value;
        }
    }
    sum
}

/// The sum of the images of instants, each of a gain and an angle, times their weights.
fn weighted(phantom: &Phantom, moments: &[((u64, u64), f64)]) -> Vec<f64> {
    let activity = phantom.scene().activity;
    let mut sum = vec![0.0f64; phantom.camera().view_len()];
    let mut one = vec![0.0f32; sum.len()];
    for ((gain, angle), weight) in moments {
        let shape = phantom
            .heart()
            .shapes(&[f64::from_bits(*gain)])
            .unwrap()
            .remove(0);
        let rays = phantom
            .camera()
            .detector()
            .rays(f64::from_bits(*angle))
            .unwrap();
        let [inner, outer] = shape.volumes();
        let held = [
            activity.cavity.concentration(inner),
            activity.wall.concentration(outer - inner),
        ];
        one.fill(0.0);
        shape
            .body()
            .project_add(&rays, &held, 1.0, &mut one)
            .unwrap();
        for (sum, value) in sum.iter_mut().zip(&one) {
            *sum += weight * f64::from(*value);
        }
    }
    sum
}

/// The times of a gate between two others, in seconds.
fn windows(from: f64, seconds: f64, period: f64, [gate, gates]: [usize; 2]) -> Vec<[f64; 2]> {
    if seconds == 0.0 {
        return vec![[from; 2]];
    }
    let [a, b] = [gate, gate + 1].map(|g| g as f64 / gates as f64);
    let beats = (from / period) as usize..=((from + seconds) / period) as usize;
    let window = |beat: usize| {
        let [a, b] = [a, b].map(|phase| (beat as f64 + phase) * period);
        [a.max(from), b.min(from + seconds)]
    };
    beats.map(window).filter(|[a, b]| b > a).collect()
}

/// Euclidean distance relative to the norm of the second.
pub(crate) fn distance(a: &[f32], b: &[f64]) -> f64 {
    let square: f64 = a
        .iter()
        .zip(b)
        .map(|(a, b)| (f64::from(*a) - b).powi(2))
        .sum();
    let norm: f64 = b.iter().map(|b| b * b).sum();
    (square / norm).sqrt()
}

/// Largest difference relative to the largest sample: the norm of `ViewError`.
pub(crate) fn worst(a: &[f32], b: &[f64]) -> f64 {
    let (off, most) = (a.iter().zip(b)).fold((0.0f64, 0.0f64), |(off, most), (a, b)| {
        (off.max((f64::from(*a) - b).abs()), most.max(b.abs()))
    });
    off / most
}
