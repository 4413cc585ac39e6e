//! Messages of errors and their causes: each level contains its own part, once.

use heart_phantom::membrane_newton::{Discretisation, MembraneError};
use heart_phantom::revolve_voxel::Pose;
use heart_phantom::{Background, Scene};
use heart_phantom::{Balloon, Heart, Phantom, PhantomError, escape};
use std::error::Error;
use std::io;
use std::path::Path;

fn chain(error: &PhantomError) -> Vec<String> {
    let mut said = vec![error.to_string()];
    let mut cause = error.source();
    while let Some(error) = cause {
        said.push(error.to_string());
        cause = error.source();
    }
    said
}

/// An error of each variant that has a cause; that of threads has a test of its own.
fn with_causes() -> Vec<PhantomError> {
    let gain = 0.6;
    let io = || io::Error::new(io::ErrorKind::NotFound, "it is gone");
    let cause = || Box::new(PhantomError::NoCounts);
    vec![
        PhantomError::File {
            path: "a.npy".into(),
            source: io(),
        },
        PhantomError::Read {
            path: "a.toml".into(),
            source: io(),
        },
        PhantomError::NoMaterial {
            gain,
            source: cause(),
        },
        PhantomError::NoDefect {
            defect: 0,
            gain,
            source: cause(),
        },
        PhantomError::Rejected {
            file: Some("a.toml".into()),
            place: Some([3, 1]),
            field: "noise.counts.total".into(),
            source: cause(),
        },
    ]
}

#[test]
fn no_message_repeats_its_cause() {
    for error in with_causes() {
        let said = chain(&error);
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(!said[0].contains(&said[1]), "{said:?}");
        assert!(!said[0].ends_with([':', ' ']), "{said:?}");
    }
}

#[test]
fn an_error_chain_contains_failure_and_cause() {
    let said = chain(&Scene::load(Path::new("no such folder/a.toml")).unwrap_err()).join(": ");
    let why = io::Error::from_raw_os_error(2);
    assert_eq!(said, format!("cannot read no such folder/a.toml: {why}"));
    let narrow = Background {
        concentration: 1.0,
        centre: [0.0; 2],
        semi_axes: [4.0, 5.0],
    };
    let scene = Scene {
        background: Some(narrow),
        ..Scene::default().with_size(32)
    };
    let error = Phantom::new(scene).unwrap().prepare().unwrap_err();
    let said = chain(&error);
    assert_eq!(said[0], "background.semi_axes");
    assert!(said[1].starts_with("at a volume gain of "), "{said:?}");
    assert_eq!(said.len(), 2);
}

#[test]
fn invalid_pairs_of_balloons_have_distinct_errors() {
    let heart = |inner: Balloon, outer: Balloon, nodes| {
        let pose = Pose::axis_along_z(5.0).unwrap();
        let differences = Discretisation::FiniteDifferences { nodes };
        let membranes = [&inner.membrane()?, &outer.membrane()?];
        Heart::of_membranes(membranes, differences, 0.0, pose)
    };
    let none = Balloon {
        radius: -1.0,
        ..Balloon::INNER
    };
    let error = heart(none, Balloon::OUTER, 51).unwrap_err();
    assert!(matches!(error, PhantomError::Balloon(_)), "{error:?}");
    let long = |length: f64, balloon: Balloon| Balloon { length, ..balloon };
    // Coinciding nodes, an outer membrane with a smaller volume, and one with a larger volume that is shorter.
    for (inner, outer, nodes) in [
        (Balloon::INNER, Balloon::OUTER, 1),
        (Balloon::OUTER, Balloon::INNER, 51),
        (long(12.0, Balloon::INNER), Balloon::OUTER, 51),
    ] {
        let error = heart(inner, outer, nodes).unwrap_err();
        assert!(matches!(error, PhantomError::Membrane(_)), "{error:?}");
    }
    // Membranes that cross when inflated: detected in the shape.
    let thin = Balloon {
        radius: 1.77,
        ..long(14.0, Balloon::OUTER)
    };
    let crossed = heart(Balloon::INNER, thin, 101).unwrap();
    let error = crossed.shapes(&[0.6]).unwrap_err();
    assert!(matches!(error, PhantomError::Crossed { .. }), "{error:?}");
}

#[test]
fn the_error_contains_the_number_of_threads() {
    for (given, says) in [
        (0, "cannot start a thread for each core"),
        (1, "cannot start a thread"),
        (4096, "cannot start 4096 threads"),
    ] {
        let source = Box::new(io::Error::from(io::ErrorKind::OutOfMemory));
        let error = PhantomError::Threads { given, source };
        assert_eq!(error.to_string(), says);
    }
}

#[test]
fn control_characters_are_escaped_and_other_text_is_unchanged() {
    let kept = "Herz \u{e9} e\u{301} \u{5fc3} \u{1f493} \"'\\`";
    assert_eq!(escape(kept), kept);
    let moves = "\u{1b}[31m\r\n\u{7}\u{9b}2J\u{7f}\u{202e}\u{2066}\u{200b}\u{feff}\u{e0041}";
    let escaped = escape(moves);
    assert_eq!(
        escaped,
        "\\u{1b}[31m\\r\\n\\u{7}\\u{9b}2J\\u{7f}\\u{202e}\\u{2066}\\u{200b}\\u{feff}\\u{e0041}"
    );
    assert_eq!(escape(&escaped), escaped);
}

#[test]
fn a_chain_of_messages_contains_each_cause_once() {
    let error = MembraneError::within("radius", f64::NAN, f64::MIN_POSITIVE, f64::MAX);
    let error = PhantomError::Membrane(error.unwrap_err().into());
    let said = "radius is NaN; it must be finite and positive";
    assert_eq!(heart_phantom::chain(&error), said);
    let path = "a.toml".into();
    let source = io::Error::from(io::ErrorKind::NotFound);
    let error = PhantomError::Read { path, source };
    let said = "cannot read a.toml: entity not found";
    assert_eq!(heart_phantom::chain(&error), said);
}

#[test]
fn numbers_are_short_and_exact() {
    for (given, text) in [
        (-0.0, "-0"),
        (2e6, "2000000"),
        (-1e-3, "-0.001"),
        (123.456, "123.456"),
        (1e300, "1e300"),
        (-1e-320, "-1e-320"),
        (f64::MAX, "1.7976931348623157e308"),
        (f64::NAN, "NaN"),
        (f64::INFINITY, "inf"),
    ] {
        let (what, least, most) = ("it", 0.0, 1.0);
        let error = PhantomError::OutOfRange {
            what,
            given,
            least,
            most,
        };
        let said = format!("it is {text}, must be between 0 and 1");
        assert_eq!(error.to_string(), said);
    }
}

/// A gain has five digits; a factor by which something must be larger is rounded up.
#[test]
fn five_digits_are_accurate_and_required_numbers_are_rounded_up() {
    let said = |gain, times| PhantomError::Uncovered { gain, times }.to_string();
    for (gain, times, texts) in [
        (
            0.015178592099365087,
            2.0821653821723456,
            ["0.015179", "2.0822"],
        ),
        (15.999_999_999_999_998, 93.00423251564783, ["16", "93.009"]),
        (0.0, 16.0, ["0", "16"]),
        (12345.6, 9.99991, ["12346", "10"]),
    ] {
        let [gain_text, times_text] = texts;
        let text = said(gain, times);
        assert!(
            text.starts_with(&format!("at a volume gain of {gain_text} the")),
            "{text}"
        );
        assert!(text.contains(&format!(" to {times_text} times ")), "{text}");
    }
    for k in 1..2000 {
        let times = 1.0237f64.powi(k - 1000);
        let text = said(0.0, times);
        let (_, from) = text.rsplit_once(" to ").unwrap();
        let least: f64 = from.split(' ').next().unwrap().parse().unwrap();
        assert!(least >= times && least < times * (1.0 + 1e-4), "{text}");
    }
}

#[test]
fn long_texts_are_cut_between_characters() {
    let field = |n| {
        let name = "\u{5fc3}".repeat(n);
        let error = Scene::from_toml(&format!("\"{name}\" = 1\n")).unwrap_err();
        let PhantomError::Scene(error) = error else {
            panic!("{error}")
        };
        error.first().field.clone()
    };
    let short = "\u{5fc3}".repeat(120);
    assert_eq!(field(120), short);
    assert_eq!(field(1000), format!("{short}... (1000 characters)"));
}
