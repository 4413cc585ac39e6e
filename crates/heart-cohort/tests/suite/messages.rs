//! Messages that name the cause and the remedy.

use crate::failures::says;
use crate::{text, with_rejected};
use heart_cohort::{RunOptions, export, survey};

#[test]
fn messages_name_the_remedy() {
    says(
        &text(
            3,
            "seed = 1",
            "cycle.volume.ejection_fraction = { uniform = [0.4, 0.6] }",
        ),
        &["has gain; set cycle.volume = { ejection_fraction = ... } in [scene]"],
    );
    for (vary, words) in [
        (
            "log_normal = { median = 65.0, factor = 1.2 }",
            "unknown variant `log_normal`",
        ),
        (
            "normal = { mean = 65.0, sd = 2.0, bounds = [70, 60] }",
            "[70.0, 60.0]: must be ascending",
        ),
        (
            "uniform = [-1e308, 1e308]",
            "[-1e308, 1e308]: must be ascending with a finite difference",
        ),
        (
            "normal = { mean = 65.0, sd = 1.0, bounds = [90, 99] }",
            "[90.0, 99.0]: must contain a part",
        ),
    ] {
        let vary = format!("cycle.beats_per_minute = {{ {vary} }}");
        says(
            &text(3, "seed = 1", &vary),
            &["line 12", "vary.cycle.beats_per_minute: ", words],
        );
    }
    says(
        "members = 3\n[vary]\nnoise.seed = { uniform = [1, 9] }\n",
        &["noise.seed: the scene lacks its section, with `counts`"],
    );
    says(
        "members = 67108864\nsampling = \"sobol\"\n",
        &["attempts: is 1000; must be between 1 and 64 with sobol and 67108864 members"],
    );
}

#[test]
fn no_memory_is_rejected_before_any_work() {
    let (cohort, folder) = (with_rejected(3), tempfile::tempdir().unwrap());
    let out = folder.path().join("out");
    let mut options = RunOptions::new(1);
    options.memory = 0;
    let errors = [
        survey(&cohort, 1, &options).map(drop),
        export(&cohort, 0, &out, 0).map(drop),
    ];
    for error in errors.map(|result| result.unwrap_err().to_string()) {
        assert!(error.starts_with("memory is 0"), "{error}");
    }
    assert!(!out.exists());
}
