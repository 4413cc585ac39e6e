//! The cardiac cycle and its volume curves.

use heart_phantom::{Cycle, PhantomError, VolumeCurve, VolumeRange};

fn sinusoid(beats_per_minute: f64, gain: f64) -> Result<Cycle, PhantomError> {
    Cycle::new(beats_per_minute, &VolumeCurve::Sinusoid, [0.0, gain])
}

/// A cycle whose gain is the normalised volume.
fn normalised(curve: &VolumeCurve, beats_per_minute: f64) -> Result<Cycle, PhantomError> {
    Cycle::new(beats_per_minute, curve, [0.0, 1.0])
}

#[test]
fn gain_and_ejection_fraction_are_equivalent() {
    for gain in [0.0, 0.1, 0.6, 1.5, 20.0] {
        let fraction = gain / (1.0 + gain);
        let [low, high] = VolumeRange::EjectionFraction(fraction).gains(93.0).unwrap();
        // Conditioning: d gain / d fraction = (1 + gain)^2.
        assert!(low == 0.0 && (high - gain).abs() <= 4e-16 * (1.0 + gain).powi(2));
        let volumes = VolumeRange::Volumes {
            edv: 93.0 * (1.0 + gain),
            esv: 93.0,
        };
        assert!((volumes.gains(93.0).unwrap()[1] - gain).abs() < 1e-14);
    }
}

#[test]
fn invalid_ranges_are_rejected() {
    let bad = [
        VolumeRange::Gain(-0.1),
        VolumeRange::Gain(f64::NAN),
        VolumeRange::EjectionFraction(1.0),
        VolumeRange::EjectionFraction(-0.1),
        VolumeRange::Volumes {
            edv: 150.0,
            esv: 92.0,
        },
        VolumeRange::Volumes {
            edv: 100.0,
            esv: 101.0,
        },
        VolumeRange::Volumes {
            edv: f64::INFINITY,
            esv: 93.0,
        },
    ];
    for range in bad {
        let refused = range.gains(93.0);
        assert!(
            matches!(refused, Err(PhantomError::OutOfRange { .. })),
            "{range:?}"
        );
    }
    // Invalid reference volumes.
    for volume in [0.0, -93.0, f64::MIN_POSITIVE, f64::NAN, f64::INFINITY] {
        let (edv, esv) = (volume, volume);
        let ranges = [VolumeRange::Gain(0.6), VolumeRange::Volumes { edv, esv }];
        for range in ranges {
            let (what, refused) = ("reference volume", range.gains(volume));
            assert!(
                matches!(refused, Err(PhantomError::OutOfRange { what: of, .. }) if of == what)
            );
        }
    }
}

#[test]
fn the_physiological_curve_has_its_published_times() {
    for bpm in [35.0, 65.0, 110.0, 140.0] {
        let height = normalised(&VolumeCurve::Physiological, bpm).unwrap();
        let at = |seconds: f64| height.gain((seconds * bpm / 60.0).rem_euclid(1.0));
        let (pep, lvet) = (0.131 - 0.0004 * bpm, 0.413 - 0.0017 * bpm);
        // All valves closed: constant volume.
        assert_eq!([at(0.0), at(0.5 * pep), at(0.999 * pep)], [1.0; 3]);
        let closed = pep + lvet;
        assert_eq!(
            [at(closed + 1e-9), at(closed + 0.04), at(closed + 0.0799)],
            [0.0; 3]
        );
        // Falling, then rising.
        let samples: Vec<f64> = (0..2000)
            .map(|j| height.gain(f64::from(j) / 2000.0))
            .collect();
        let least = samples.iter().position(|&h| h == 0.0).unwrap();
        assert!(samples[..least].is_sorted_by(|a, b| a >= b));
        assert!(samples[least..].is_sorted());
        assert!((0.0..=1.0).contains(&samples[1999]) && samples[1999] > 0.99);
    }
    let refused = normalised(&VolumeCurve::Physiological, 141.0);
    assert!(matches!(
        refused,
        Err(PhantomError::OutOfRange { given: 141.0, .. })
    ));
}

#[test]
fn samples_are_interpolated_without_overshoot() {
    let volumes = vec![120.0, 119.0, 60.0, 50.0, 50.0, 95.0, 100.0];
    let height = normalised(&VolumeCurve::Sampled(volumes.clone()), 60.0).unwrap();
    for (j, volume) in volumes.iter().enumerate() {
        let h = height.gain(j as f64 / 7.0);
        // Phases are rounded to 5e-13; the slope is at most 6.
        assert!((h - (volume - 50.0) / 70.0).abs() < 1e-11);
    }
    for j in 0..7 {
        let ends = [
            height.gain(j as f64 / 7.0),
            height.gain((j + 1) as f64 % 7.0 / 7.0),
        ];
        for k in 0..50 {
            let h = height.gain((j as f64 + k as f64 / 50.0) / 7.0);
            assert!(h >= ends[0].min(ends[1]) && h <= ends[0].max(ends[1]));
        }
    }
}

#[test]
fn many_samples_of_the_sinusoid_reproduce_it() {
    let exact = sinusoid(60.0, 1.0).unwrap();
    let error = |n: usize| {
        let volumes = (0..n).map(|j| exact.gain(j as f64 / n as f64)).collect();
        let height = normalised(&VolumeCurve::Sampled(volumes), 60.0).unwrap();
        (0..1000)
            .map(|j| f64::from(j) / 1000.0)
            .map(|p| (height.gain(p) - exact.gain(p)).abs())
            .fold(0.0, f64::max)
    };
    // Third order except at extrema, where a monotone cubic is of second order: a factor of at least 4.
    assert!(
        error(64) < error(32) / 3.5 && error(64) < 1e-3,
        "{} {}",
        error(32),
        error(64)
    );
}

#[test]
fn invalid_samples_are_rejected() {
    for bad in [
        vec![],
        vec![1.0, 2.0],
        vec![1.0; 8],
        vec![1.0, f64::NAN, 2.0],
        vec![1.0, f64::INFINITY, 2.0],
    ] {
        let n = bad.len();
        assert!(match normalised(&VolumeCurve::Sampled(bad), 60.0) {
            Err(PhantomError::Count { given, .. }) => n < 3 && given == n,
            Err(PhantomError::OutOfRange { .. }) => n >= 3,
            _ => false,
        });
    }
}

#[test]
fn one_view_per_second_at_65_bpm_has_twelve_phases() {
    let cycle = sinusoid(65.0, 0.6).unwrap();
    let mut phases: Vec<f64> = (0..90).map(|k| cycle.phase(k as f64)).collect();
    phases.sort_by(f64::total_cmp);
    phases.dedup();
    assert_eq!(phases.len(), 12);
    for (j, p) in phases.iter().enumerate() {
        assert!((p - j as f64 / 12.0).abs() < 1e-12);
    }
}

#[test]
fn gain_is_periodic_even_and_bounded() {
    let cycle = sinusoid(72.0, 0.6).unwrap();
    for j in 0..64 {
        let p = j as f64 / 64.0;
        assert_eq!(cycle.gain(p), cycle.gain(p + 3.0));
        assert_eq!(cycle.gain(p), cycle.gain(1.0 - p));
        assert!((0.0..=0.6).contains(&cycle.gain(p)));
    }
}

#[test]
fn invalid_arguments_are_rejected() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1001.0] {
        assert!(matches!(
            sinusoid(bad, 0.6),
            Err(PhantomError::OutOfRange { .. })
        ));
    }
    for bad in [-0.1, f64::NAN, 21.0] {
        assert!(matches!(
            sinusoid(65.0, bad),
            Err(PhantomError::OutOfRange { .. })
        ));
    }
    for curve in [VolumeCurve::Sinusoid, VolumeCurve::Physiological] {
        let cycle = Cycle::new(65.0, &curve, [0.1, 0.6]).unwrap();
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(cycle.gain(bad).is_nan());
            assert!(cycle.gain(cycle.phase(bad)).is_nan());
        }
    }
}

/// The samples in reverse order are the curve in reverse time.
#[test]
fn reversed_samples_are_the_reversed_curve() {
    let volumes = vec![120.0, 119.0, 60.0, 50.0, 50.0, 95.0, 100.0];
    let mut reversed = volumes.clone();
    reversed[1..].reverse();
    let [height, mirrored] =
        [volumes, reversed].map(|v| normalised(&VolumeCurve::Sampled(v), 60.0).unwrap());
    for p in (1..100).map(|k| f64::from(k) / 100.0) {
        // Phases are rounded to 5e-13; the slope is at most 6.
        let off = height.gain(p) - mirrored.gain(1.0 - p);
        assert!(off.abs() < 1e-11, "{p}: {off:e}");
    }
}
