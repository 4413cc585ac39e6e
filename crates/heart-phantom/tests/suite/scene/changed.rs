//! Scenes with random changes are read or rejected; the reader never panics.

use heart_phantom::PhantomError;
use heart_phantom::Scene;
use proptest::prelude::*;

/// One change to a scene's text.
#[derive(Debug, Clone)]
enum Change {
    /// Another value for a field.
    Value(usize, String),
    /// A line removed or duplicated.
    Drop(usize),
    Repeat(usize),
    /// Characters inserted anywhere.
    Insert(usize, String),
    /// The text truncated here.
    Cut(usize),
}

fn value() -> impl Strategy<Value = String> {
    prop_oneof![
        any::<f64>().prop_map(|v| format!("{v:?}")),
        (-1e3..1e3f64).prop_map(|v| format!("{v:?}")),
        any::<i64>().prop_map(|v| v.to_string()),
        (0..300i64).prop_map(|v| v.to_string()),
        prop::collection::vec(-5.0..300.0f64, 0..6).prop_map(|v| format!("{{ sampled = {v:?} }}")),
        prop::sample::select(vec![
            "nan",
            "-inf",
            "true",
            "''",
            "[]",
            "{}",
            "'hann'",
            "'physiological'",
            "'continuous'",
            "'instants'",
            "'nrrd'",
            "{ gain = 3.0 }",
            "{ volumes = { edv = 1e300, esv = 1e-300 } }",
            "{ gated = { gates = 7 } }",
            "{ steps = 18446744073709551615 }",
            "{ x = [0, 9], y = [3, 300] }",
            "[0.1, 0.2]",
            "1979-05-27",
            "\"\\u00e9\"",
        ])
        .prop_map(str::to_owned),
    ]
}

fn change() -> impl Strategy<Value = Change> {
    let at = 0..10_000usize;
    prop_oneof![
        4 => (at.clone(), value()).prop_map(|(at, value)| Change::Value(at, value)),
        1 => at.clone().prop_map(Change::Drop),
        1 => at.clone().prop_map(Change::Repeat),
        1 => (at.clone(), "\\PC{0,6}").prop_map(|(at, text)| Change::Insert(at, text)),
        1 => at.prop_map(Change::Cut),
    ]
}

fn apply(text: &str, change: &Change) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let boundary = |at: usize| {
        let mut at = at % (text.len() + 1);
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    match change {
        Change::Insert(at, inserted) => {
            let at = boundary(*at);
            return format!("{}{inserted}{}", &text[..at], &text[at..]);
        }
        Change::Cut(at) => return text[..boundary(*at)].to_owned(),
        _ if lines.is_empty() => {}
        Change::Value(at, value) => {
            let fields: Vec<usize> = (0..lines.len())
                .filter(|&k| lines[k].contains(" = "))
                .collect();
            if let Some(&k) = fields.get(at % fields.len().max(1)) {
                let name = lines[k]
                    .trim_start_matches("# ")
                    .split(" = ")
                    .next()
                    .unwrap_or_default()
                    .to_owned();
                lines[k] = format!("{name} = {value}");
            }
        }
        Change::Drop(at) => {
            lines.remove(at % lines.len());
        }
        Change::Repeat(at) => {
            let k = at % lines.len();
            lines.insert(k, lines[k].clone());
        }
    }
    lines.join("\n")
}

proptest! {
    // PROPTEST_CASES runs more.
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases.max(4000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn changed_scenes_are_read_or_rejected_and_never_panic(changes in prop::collection::vec(change(), 1..4)) {
        let mut text = Scene::default().to_toml();
        for change in &changes {
            text = apply(&text, change);
        }
        match Scene::from_toml(&text) {
            Ok(scene) => {
                prop_assert_eq!(Scene::from_toml(&scene.to_toml()).unwrap(), scene);
            }
            Err(PhantomError::Scene(error)) => {
                prop_assert!(!error.to_string().is_empty());
                if let Some([line, _]) = error.first().place {
                    prop_assert!(line >= 1 && line <= text.lines().count() + 1);
                }
            }
            Err(other) => prop_assert!(false, "{other}"),
        }
    }
}
