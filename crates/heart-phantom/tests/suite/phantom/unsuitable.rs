//! Warnings of settings with which reconstructions or counts are useless.

use super::small;
use super::warnings::warnings;
use heart_phantom::{Counts, Mode, Noise, Scene, radon::Window};
use heart_phantom::{Phantom, WarningKind};

/// Each setting alone, at and beyond its limit.
#[test]
fn settings_that_make_results_useless_are_warnings() {
    let found = |change: &dyn Fn(&mut Scene)| -> Vec<(&str, f64, f64, String)> {
        let mut scene = small(Mode::Static { phase: 0.5 });
        change(&mut scene);
        (warnings(&scene).iter())
            .filter(|warning| warning.what == WarningKind::Unsuitable)
            .map(|warning| {
                let [value, limit] = ["value", "limit"].map(|name| warning.numbers[name]);
                (warning.key, value, limit, warning.to_string())
            })
            .collect()
    };
    assert_eq!(found(&|_| {}), []);
    let shape = Phantom::new(small(Mode::Static { phase: 0.5 })).unwrap();
    let shape = shape.shape(0.5).unwrap();
    let radius = (shape.curves()[1].iter()).fold(0.0, |most: f64, [_, r]| most.max(*r));
    let heart = 2.0 * radius;
    for (key, unit) in [
        ("reconstruction.pixel", 1.0),
        ("reconstruction.filter_fwhm", 1.0),
        ("reconstruction.cutoff", 0.4),
    ] {
        for (times, n) in [(0.999, 0), (1.001, 1)] {
            let size = times * heart;
            let found = found(&|scene| {
                let own = &mut scene.reconstruction;
                match key {
                    "reconstruction.pixel" => own.pixel = Some(size),
                    "reconstruction.filter_fwhm" => own.filter_fwhm = Some(size),
                    _ => own.cutoff = unit / size,
                }
            });
            assert_eq!(found.len(), n, "{found:?}");
            for (found, value, limit, text) in found {
                assert_eq!((found, limit), (key, heart));
                assert!((value / size - 1.0).abs() < 1e-12, "{value}");
                assert!(text.contains("outer diameter of the heart"), "{text}");
            }
        }
    }
    // 4 x 0.4 cm.
    let [(key, width, needed, text)] = &found(&|scene| scene.reconstruction.pixels = Some(4))[..]
    else {
        panic!()
    };
    assert_eq!(*key, "reconstruction.pixels");
    assert!((width - 1.6).abs() < 1e-12, "{width}");
    let wide = |by: f64| (by * needed / 0.4).ceil() as usize;
    assert!(found(&|scene| scene.reconstruction.pixels = Some(wide(1.0))).is_empty());
    let narrow = found(&|scene| scene.reconstruction.pixels = Some(wide(1.0) - 1));
    assert_eq!(narrow.len(), 1);
    assert!(text.contains(" (1.6; the limit is "), "{text}");
    // A gain at frequency 0, and counts.
    let window = |gain| {
        let custom = move |scene: &mut Scene| {
            scene.reconstruction.window = Window::Custom(vec![gain, 0.5, 0.0]);
        };
        found(&custom)
    };
    assert_eq!(window(1.0), []);
    let expected =
        "reconstruction.window: the gain at frequency 0 scales the volumes (0.5; the limit is 1)";
    assert_eq!(window(0.5)[0].3, expected);
    let counts = |total| {
        let noise = Noise {
            counts: Counts::Total(total),
            seed: 0,
        };
        found(&move |scene: &mut Scene| scene.noise = Some(noise))
    };
    assert_eq!(counts(12.0), []);
    let expected =
        "noise.counts.total: too few counts are expected in a view (0.5; the limit is 1)";
    assert_eq!(counts(6.0)[0].3, expected);
}
