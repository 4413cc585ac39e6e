//! Random scene files and all products of a phantom: views, slices, ground truth, numbers, each alone and with others.

use crate::{Outcome, with_threads};
use heart_phantom::Scene;
use heart_phantom::{Phantom, no_observer};
use tests::Random;

pub(crate) fn scene(random: &mut Random) -> Outcome {
    let text = text(random);
    // An invalid file is a typed error, at any stage.
    match study(random, &text) {
        Some(()) => Outcome::Answered,
        None => Outcome::Rejected,
    }
}

/// A number of a scene file, sometimes an unreasonable one.
pub(crate) fn number(random: &mut Random, low: f64, high: f64) -> String {
    let value = random.uniform(low, high);
    entered(random, value)
}

/// The same for an angle in degrees.
fn degrees(random: &mut Random, low: f64, high: f64) -> String {
    let value = random.degrees(low, high);
    entered(random, value)
}

fn entered(random: &mut Random, mut value: f64) -> String {
    if random.one_in(4) {
        value = random.spoiled(value);
    }
    format!("{value:?}").to_lowercase() // nan, as TOML has it
}

fn count(random: &mut Random, low: usize, high: usize) -> String {
    if random.one_in(150) {
        return random
            .pick(&["0", "-1", "9223372036854775807", "1.5"])
            .into();
    }
    random.integer(low, high).to_string()
}

pub(crate) fn text(random: &mut Random) -> String {
    let mut text = String::new();
    let mut line = |entry: String| {
        text.push_str(&entry);
        text.push('\n');
    };
    let unit = random.decades(-1.0, 1.0);
    let (length, radius) = (random.uniform(2.0, 9.0), random.uniform(1.0, 3.0));
    let law = random.pick(&["per-material-length", "total-force", "per-current-length"]);
    line(format!("[heart]\nlaw = '{law}'"));
    line(if random.one_in(2) {
        format!(
            "discretisation = {{ differences = {{ nodes = {} }} }}",
            count(random, 11, 101)
        )
    } else {
        format!(
            "discretisation = {{ spectral = {{ degree = {}, per_piece = {}, tolerance = {} }} }}",
            count(random, 6, 16),
            count(random, 1, 3),
            number(random, 1e-4 * unit, 1e-2 * unit)
        )
    });
    for (name, more) in [("inner", 0.0), ("outer", random.uniform(0.1, 1.5))] {
        line(format!(
            "[heart.{name}]\nlength = {}",
            number(random, length * unit, length * unit)
        ));
        let radius = (radius + more) * unit;
        line(format!(
            "radius = {}\nstiffness = {}",
            number(random, radius, radius),
            number(random, 0.2, 5.0)
        ));
    }
    line(format!(
        "[cycle]\nbeats_per_minute = {}",
        number(random, 40.0, 180.0)
    ));
    let curve = random.pick(&[
        "'sinusoid'",
        "'physiological'",
        "{ sampled = [1.0, 0.4, 0.3, 0.7] }",
    ]);
    line(format!("curve = {curve}"));
    line(if random.one_in(2) {
        format!("volume = {{ gain = {} }}", number(random, 0.0, 1.0))
    } else {
        format!(
            "volume = {{ ejection_fraction = {} }}",
            number(random, 0.0, 0.6)
        )
    });
    line(format!(
        "[pose]\nrotate_x = {}\nrotate_y = {}",
        degrees(random, -180.0, 180.0),
        degrees(random, -90.0, 135.0)
    ));
    if random.one_in(2) {
        let height = length * unit;
        line(format!("centre = {}", number(random, 0.0, height)));
        let [x, y, z] = [0, 1, 2].map(|_| number(random, -0.2 * height, 0.2 * height));
        line(format!("shift = [{x}, {y}, {z}]"));
    }
    let kind = random.pick(&["concentration", "total"]);
    line(format!(
        "[activity]\ncavity = {{ {kind} = {} }}",
        number(random, 0.0, 2.0)
    ));
    if random.one_in(2) {
        line(format!(
            "[attenuation]\ncoefficient = {}",
            number(random, 0.0, 0.3 / unit)
        ));
        line(if random.one_in(2) {
            "medium = 'heart'".into()
        } else {
            let [a, b] = [0, 1].map(|_| number(random, 3.0 * unit, 20.0 * unit));
            format!(
                "medium = {{ torso = {{ centre = [0.0, {}], semi_axes = [{a}, {b}] }} }}",
                number(random, -unit, unit)
            )
        });
    }
    for _ in 0..[0, 0, 0, 1, 1, 3][random.integer(0, 5)] {
        let range = |ends: [f64; 2], most: f64, random: &mut Random| {
            // The ends included, and boundaries that several defects share.
            let [a, b] = ends.map(|at| match random.integer(0, 2) {
                0 => at,
                _ => (4.0 * at / most).round() * most / 4.0,
            });
            format!("[{}, {:?}]", entered(random, a.min(b)), a.max(b))
        };
        let layers = range([0, 1].map(|_| random.uniform(0.0, 1.0)), 1.0, random);
        let s = range([0, 1].map(|_| random.uniform(0.0, 0.5)), 0.5, random);
        let azimuths = range([0, 1].map(|_| random.degrees(0.0, 360.0)), 360.0, random);
        line(format!(
            "[[defects]]\nlayers = {layers}\ns = {s}\nazimuths_degrees = {azimuths}"
        ));
        line(format!("activity = {}", number(random, 0.0, 2.0)));
    }
    let blurred = random.one_in(3);
    if blurred {
        line(format!(
            "[blur]\nfwhm = {}",
            number(random, 0.0, 2.0 * unit)
        ));
    }
    let collimated = random.one_in(4);
    if collimated {
        line(format!(
            "[collimator]\nholes = {{ widths = {{ slope = {}, at_face = {} }} }}\nintrinsic_fwhm = {}",
            number(random, 0.0, 0.05),
            number(random, 0.0, 0.2 * unit),
            number(random, 0.0, unit)
        ));
    }
    if random.one_in(3) {
        let counts = match random.one_in(2) {
            true => format!("total = {}", number(random, 1.0, 1e6)),
            false => format!("per_unit = {}", number(random, 0.1, 1e3)),
        };
        line(format!(
            "[noise]\ncounts = {{ {counts} }}\nseed = {}",
            count(random, 0, 99)
        ));
    }
    let averaged = random.one_in(8);
    // Images cost some hundred times as many rays as line integrals: fewer bins, and to a coarser tolerance.
    let has_images = blurred || collimated || averaged;
    let (bins, rows) = match has_images {
        true => (random.integer(3, 10), random.integer(2, 8)),
        false => (random.integer(3, 24), random.integer(2, 20)),
    };
    let field = 2.2 * (length + radius) * unit;
    line(format!(
        "[camera]\nviews = {}\nbins = {bins}\nrows = {rows}",
        count(random, 1, 8)
    ));
    line(format!(
        "arc = {}\nstart = {}",
        degrees(random, -360.0, 405.0),
        degrees(random, -90.0, 135.0)
    ));
    if !averaged {
        line("samples = \"centres\"".into());
    }
    if collimated {
        line(format!("radius = {}", number(random, field, 3.0 * field)));
    }
    let pitch = random.rounded(field / bins as f64);
    line(format!(
        "pitch = [{}, {}]",
        number(random, pitch, pitch),
        number(random, pitch, pitch)
    ));
    line(format!(
        "rotation = '{}'",
        random.pick(&["step-and-shoot", "continuous"])
    ));
    line(format!("seconds_per_view = {}", number(random, 0.1, 2.0)));
    let mode = match random.integer(0, 4) {
        0 => format!("{{ static = {{ phase = {} }} }}", number(random, 0.0, 1.0)),
        1 => "'instants'".into(),
        2 => format!(
            "{{ exposure = {{ seconds = {} }} }}",
            number(random, 0.01, 2.0)
        ),
        3 => "'whole-cycle'".into(),
        _ => format!("{{ gated = {{ gates = {} }} }}", count(random, 1, 4)),
    };
    let accuracy = match has_images && !random.one_in(10) {
        true => format!("tolerance = {}", number(random, 0.03, 0.3)),
        false => format!("steps = {}", 2 * random.integer(1, 4)),
    };
    line(format!(
        "[acquisition]\nmode = {mode}\naccuracy = {{ {accuracy} }}"
    ));
    line(format!(
        "[reconstruction]\ncutoff = {}",
        number(random, 0.3, 1.0)
    ));
    let window = random.pick(&[
        "'ram-lak'",
        "'hann'",
        "'cosine'",
        "{ butterworth = { order = 4 } }",
    ]);
    line(format!("window = {window}"));
    if random.one_in(3) {
        let pixels = count(random, 1, 24);
        line(format!(
            "pixels = {pixels}\npixel = {}",
            number(random, pitch, pitch)
        ));
    }
    line(format!(
        "arc = '{}'",
        random.pick(&["complete", "extend", "truncate", "rescale"])
    ));
    line(format!(
        "[truth]\ntolerance = {}",
        number(random, 1e-3, 0.1)
    ));
    text
}

/// Checks that a view is similar to those of the same heart displaced slightly in both directions.
///
/// Where a surface is parallel to the rays, one of them intersects it and another does not.
fn check_beside(random: &mut Random, scene: &Scene, gate: usize, view_idx: usize, view: &[f32]) {
    if scene.noise.is_some() {
        return;
    }
    let hair = 1e-7 * (scene.heart.outer.length + scene.heart.outer.radius);
    let by = [0, 1, 2].map(|_| random.any(-1.0, 1.0) * hair);
    let moved = [1.0, 0.5, -0.5, -1.0].map(|share| {
        let mut scene = scene.clone();
        for (at, by) in scene.pose.shift.iter_mut().zip(by) {
            *at += share * by;
        }
        Phantom::new(scene)
            .and_then(|phantom| phantom.view(gate, view_idx))
            .expect("as the one beside it")
    });
    let most = view.iter().fold(0.0_f32, |m, v| m.max(*v));
    for (k, here) in view.iter().enumerate() {
        let beside = moved.each_ref().map(|moved| moved[k]);
        let low = beside.into_iter().fold(f32::INFINITY, f32::min);
        let high = beside.into_iter().fold(f32::NEG_INFINITY, f32::max);
        // The square root of the displacement, where a ray is tangential to a surface.
        let slack = 2.0 * (high - low) + 2e-3 * most;
        assert!(
            (low - slack..=high + slack).contains(here),
            "sample {k} is {here}, its neighbours {beside:?}"
        );
    }
}

/// Bits, which distinguish signs of zero and NaNs.
fn bits(samples: &[f32]) -> Vec<u32> {
    samples.iter().map(|v| v.to_bits()).collect()
}

fn study(random: &mut Random, text: &str) -> Option<()> {
    let scene = Scene::from_toml(text).ok()?;
    let again = Scene::from_toml(&scene.to_toml()).expect("a scene is written and read");
    assert_eq!(again, scene);
    let phantom = Phantom::new(scene.clone()).ok()?;
    let [n_views, n_rows] = [phantom.camera().n_views(), phantom.camera().n_rows()];
    let gate = random.integer(0, phantom.n_gates() - 1);
    let (view_idx, z) = (
        random.integer(0, n_views - 1),
        random.integer(0, n_rows - 1),
    );

    // A view, a slice, a slice of the ground truth, each requested from a new phantom, with one thread.
    let fresh = || Phantom::new(scene.clone()).expect("made before");
    let view = with_threads(1, || fresh().view(gate, view_idx)).ok()?;
    assert!(view.iter().all(|v| v.is_finite()), "an invalid view");
    assert!(view.iter().all(|v| *v >= 0.0), "a view below zero");

    if random.one_in(5) {
        check_beside(random, &scene, gate, view_idx, &view);
    }

    // All of them, with two threads.
    let all = with_threads(2, || phantom.sinograms(gate, &no_observer))
        .expect("as the view")
        .samples;
    let own = view_idx * view.len()..(view_idx + 1) * view.len();
    assert!(
        bits(&view) == bits(&all[own]),
        "a view alone differs from that of the whole"
    );

    if let Ok(slice) = with_threads(1, || fresh().slice(gate, z)) {
        let volume = with_threads(2, || phantom.volume(gate)).expect("as the slice");
        let own = z * slice.len()..(z + 1) * slice.len();
        assert!(
            bits(&slice) == bits(&volume[own]),
            "a slice alone differs from that of the whole"
        );
    }
    let slice = with_threads(1, || fresh().truth_slice(gate, z)).ok()?;
    let truth = with_threads(2, || phantom.truth(gate)).expect("as its slice");
    let own = z * slice.len()..(z + 1) * slice.len();
    assert!(
        bits(&slice) == bits(&truth[own]),
        "ground truth alone differs from that of the whole"
    );
    // Where the thickness of a wall is zero its two sides cancel up to rounding.
    let most = truth.iter().fold(0.0_f32, |m, v| m.max(*v));
    let least = truth.iter().fold(0.0_f32, |m, v| m.min(*v));
    assert!(
        truth.iter().all(|v| v.is_finite()) && least >= -1e-6 * most,
        "{least} of {most}"
    );

    let numbers = phantom.numbers().ok()?;
    assert!(numbers.edv >= numbers.esv && numbers.esv > 0.0);
    assert!((0.0..1.0).contains(&numbers.ejection_fraction));
    let phase = random.uniform(0.0, 1.0);
    let labels = phantom.labels(phase).ok()?;
    let names = phantom.label_names();
    assert!(labels.iter().all(|label| usize::from(*label) < names.len()));
    Some(())
}
