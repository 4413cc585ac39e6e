//! Rejected cohorts, their messages, and the state after failures.

use crate::{SCENE, names, shard, text, with_rejected};
use heart_cohort::heart_phantom::{PhantomError, no_observer};
use heart_cohort::{
    Cohort, CohortError, Fault, RunOptions, Shard, merge, run_shard, survey, verify,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::fs;
use std::ops::ControlFlow;

#[track_caller]
pub(crate) fn says(text: &str, words: &[&str]) {
    let error = Cohort::from_toml(text).unwrap_err().to_string();
    for word in words {
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn a_missing_field_is_reported_with_its_line() {
    for (vary, words) in [
        (
            "heart.inner.raduis = { uniform = [1.0, 2.0] }",
            [
                "line 12, ",
                "vary.heart.inner.raduis: unknown field `raduis`",
            ],
        ),
        (
            "\"hart.inner.radius\" = { uniform = [1.0, 2.0] }",
            ["line 12, ", "vary.hart.inner.radius: unknown field `hart`"],
        ),
        (
            "cycle.volume.gian = { uniform = [1.0, 2.0] }",
            ["line 12, ", "; cycle.volume of the scene has gain"],
        ),
        (
            "pose.shift.4 = { uniform = [1.0, 2.0] }",
            ["line 12, ", "is not a field"],
        ),
        (
            "defects.1.activity = { uniform = [1.0, 2.0] }",
            ["line 12, ", "vary.defects.1.activity"],
        ),
        (
            "heart.law = { uniform = [1.0, 2.0] }",
            ["line 12, ", "vary.heart.law"],
        ),
        (
            "heart.law = { choice = [\"total-force\", \"x\"] }",
            ["line 12, ", "unknown name `x`"],
        ),
        (
            "camera.views = { normal = { mean = 9.0 } }",
            ["line 12, ", "missing field `sd`"],
        ),
        (
            "camera.views = { uniform = [3.2, 3.8] }",
            ["line 12, ", "contains no integer"],
        ),
        (
            "camera.pitch.1 = { unifrom = [1.0, 2.0] }",
            [
                "line 12, ",
                "must be one of uniform, normal, log-normal, choice",
            ],
        ),
        (
            "camera.pitch.1 = { uniform = [nan, 2.0] }",
            ["line 12, ", "vary.camera.pitch.1"],
        ),
        (
            "camera.pitch.1 = { uniform = [2.0, 1.0] }",
            ["line 12, ", "must be ascending"],
        ),
        (
            "camera.views = { uniform = [0, 1e30] }",
            ["line 12, ", "exceed the limit of 9.007199254740992e15"],
        ),
        (
            "\"pose.shift.1\" = { uniform = [0, 1] }\npose.shift.1 = { uniform = [0, 2] }",
            ["line 1", "vary.pose.shift.1: is given twice"],
        ),
        (
            "heart.material = { choice = [\"springs\", { gent = { mu = inf } }] }",
            [
                "line 12, ",
                "vary.heart.material.choice.2.gent.mu: is not a finite number",
            ],
        ),
        ("camera.pitch.1 = 2.0", ["line 12, ", "must be one of"]),
    ] {
        says(&text(3, "seed = 1", vary), &words);
    }
    says(
        "members = 3\n[scene]\ncamera.view = 3\n",
        &["line 3, column 15: scene.camera.view: unknown field `view`"],
    );
    // A valid field, in place of a name, before the invalid one.
    says(
        "members = 3\n[scene]\nacquisition.mode = { gated = { gates = 2 } }\nattenuation = { heart = 1 }\n",
        &["line 4", "scene.attenuation.heart: unknown field `heart`"],
    );
    says(
        "members = 3\n[scene]\ncamera.views = -3\n",
        &["line 3", "scene.camera.views"],
    );
    says(
        "members = 3\n[scene]\ncamera.views = 0\n",
        &["line 3", "scene.camera.views: is 0; "],
    );
    says(
        "members = 3\n[scene]\noutput.write = [\"meshes\"]\n",
        &["line 3", "attenuation only"],
    );
    says(
        "members = 3\n[scene]\noutput.volumes = \"nifti\"\n",
        &["line 3", "as npy"],
    );
    says(
        "members = 3\n[[cases]]\nvary.heart.x = { choice = [1] }\n",
        &["line 3", "cases.1.vary.heart.x"],
    );
    says(
        "members = 3\n[[cases]]\nweight = 0\n",
        &["line 3", "weight: is 0.0; it must be positive"],
    );
    says(
        "members = 3\n[scene]\ncycle.volume = { ejection_fraction = 0.5 }\n[vary]\ncycle.volume.gain = { uniform = [0.2, 0.4] }\n",
        &[
            "line 5",
            "gain: only one of these can be chosen; cycle.volume of the scene has ejection_fraction",
        ],
    );
    says(
        "members = 3\n[[cases]]\nweight = 1e308\n[[cases]]\nweight = 1e308\n",
        &[
            "line 5",
            "cases.2.weight: is 1e308",
            "the sum of all weights must be finite",
        ],
    );
    for name in ["", "a\\nb", "a\\u202Eb"] {
        says(
            &format!("members = 3\n[[cases]]\nname = \"{name}\"\n"),
            &["line 3", "cases.1.name: "],
        );
    }
    for value in ["nan", "inf", "-inf"] {
        says(
            &format!("members = 3\n[scene]\nblur.fwhm = {value}\n"),
            &["line 3", "scene.blur.fwhm: is not a finite number"],
        );
    }
    says("members = 0\n", &["line 1, column 11: members: is 0"]);
    says(
        "members = -3\n",
        &["line 1, column 11: members is -3", "a non-negative integer"],
    );
    says(
        "members = 3\nsampling = \"foo\"\n",
        &["line 2, column 12: sampling is \"foo\"", "`sobol`"],
    );
    let long = format!("constraints = [\"{} > 1\"]", "a".repeat(200_000));
    says(
        &text(3, &long, ""),
        &["line 2", "constraints.1: has 200004 bytes"],
    );
    says(
        "members = 3\nmember = 4\n",
        &["line 2, column 1: ", "unknown field `member`"],
    );
    says("seed = 3\n", &["missing field `members`"]);
    says(
        "members = 3\nsampling = \"sobol\"\nattempts = 2000000000\n",
        &["line 3", "attempts"],
    );
    says("members = \n", &["line 1"]);
    let many: String = (1..=64)
        .map(|k| format!("heart.inner.radius{k} = {{ choice = [1] }}\n"))
        .collect();
    says(&text(3, "sampling = \"sobol\"", &many), &["unknown field"]);
}

#[test]
fn shards_of_another_number_are_rejected() {
    let cohort = with_rejected(6);
    let folder = tempfile::tempdir().unwrap();
    let run = |shard, of| {
        let options = RunOptions::new(1);
        run_shard(
            &cohort,
            folder.path(),
            Shard { shard, of },
            &options,
            &no_observer,
        )
    };
    for shard in [1, 2] {
        assert_eq!(run(shard, 2).unwrap().rows.len(), 3);
    }
    let before = names(folder.path());
    let error = run(1, 3).unwrap_err();
    assert!(
        matches!(
            error,
            CohortError::OtherDivision {
                found: 2,
                given: 3,
                ..
            }
        ),
        "{error}"
    );
    assert_eq!(names(folder.path()), before);
    assert!(merge(folder.path()).is_ok());
    let told = run(3, 2).unwrap_err().to_string();
    assert!(
        told.contains("shard is 3 of 2; the number of shards must be between 1 and"),
        "{told}"
    );
}

#[test]
fn invalid_constraints_are_reported_with_their_line() {
    for (constraint, words) in [
        ("heart.inner.radius >", "a number, a field"),
        ("heart.inner.radius", "one of < <= > >="),
        (
            "heart.inner.x > 1",
            "heart.inner.x is not a number of the scene",
        ),
        ("heart.law > 1", "heart.law is not a number of the scene"),
    ] {
        let head = format!("constraints = [\n \"1 < 2\",\n \"{constraint}\"]");
        says(&text(3, &head, ""), &["line 4", "constraints.2", words]);
    }
}

#[test]
fn an_impossible_constraint_leaves_no_files() {
    let head =
        "attempts = 50\nconstraints = [\"cycle.volume.gain > 0\", \"heart.inner.radius > 3\"]";
    let vary = "heart.inner.radius = { uniform = [1.5, 2.0] }";
    let cohort = Cohort::from_toml(&text(3, head, vary)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let error = run_shard(
        &cohort,
        &out,
        Shard { shard: 1, of: 1 },
        &RunOptions::new(1),
        &no_observer,
    )
    .unwrap_err();
    assert_eq!(
        error.to_string(),
        "member 0: none of 50 draws meets all constraints; `heart.inner.radius > 3` fails in 50 of them"
    );
    assert!(!out.exists());
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cohort.toml");
    let load = || Cohort::load(&path).unwrap_err();
    assert!(matches!(
        load(),
        CohortError::Phantom(PhantomError::Read { .. })
    ));
    fs::create_dir(&path).unwrap();
    assert!(matches!(
        load(),
        CohortError::Phantom(PhantomError::Read { .. })
    ));
    fs::remove_dir(&path).unwrap();
    fs::write(&path, b"members = \xff").unwrap();
    assert!(matches!(
        load(),
        CohortError::Phantom(PhantomError::Scene(_))
    ));
    fs::write(&path, "members = 3\nbase = \"scene.toml\"\n").unwrap();
    assert!(load().to_string().contains("scene.toml"));
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, "[camera]\nviews = 0\n").unwrap();
    assert!(load().to_string().contains("scene.toml:2:9: camera.views"));
    // The base scene is beside the cohort; [scene] has priority over it.
    fs::write(&scene, "[camera]\nviews = 7\nbins = 32\n").unwrap();
    fs::write(
        &path,
        "members = 3\nbase = \"scene.toml\"\n[scene]\ncamera.bins = 16\n",
    )
    .unwrap();
    let scene = Cohort::load(&path)
        .unwrap()
        .member(0)
        .unwrap()
        .scene()
        .unwrap();
    assert_eq!([scene.camera.views, scene.camera.bins], [7, 16]);
    fs::write(&path, "members = 3\n[vary]\nx = { choice = [1] }\n").unwrap();
    let error = load().to_string();
    assert!(
        error.contains("cohort.toml:3:5: vary.x: unknown field `x`"),
        "{error}"
    );
}

#[test]
fn missing_shards_are_rejected() {
    let cohort = with_rejected(3);
    let folder = tempfile::tempdir().unwrap();
    for shard in [[0, 3], [4, 3], [1, 0], [1, 4]] {
        let [shard, of] = shard;
        let run = run_shard(
            &cohort,
            folder.path(),
            Shard { shard, of },
            &RunOptions::new(1),
            &no_observer,
        );
        assert!(matches!(run, Err(CohortError::NoShard { .. })));
    }
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn numbers_of_threads_outside_the_range_are_rejected_before_any_work() {
    let (cohort, folder) = (with_rejected(3), tempfile::tempdir().unwrap());
    let out = folder.path().join("out");
    for threads in [0, 4097, usize::MAX] {
        let options = RunOptions::new(threads);
        let one = Shard { shard: 1, of: 1 };
        let errors = [
            run_shard(&cohort, &out, one, &options, &no_observer).map(drop),
            survey(&cohort, 1, &options).map(drop),
            verify(&cohort, &out, 1, 1, &options).map(drop),
        ];
        for error in errors.map(Result::unwrap_err) {
            let CohortError::Phantom(PhantomError::Count { given, most, .. }) = error else {
                panic!("{error:?}")
            };
            assert_eq!((given, most), (threads, 4096));
        }
        assert!(!out.exists());
    }
}

/// The range of the field, at the distribution, also if only the members of one case are outside; a part of a distribution may be outside.
#[test]
fn a_distribution_outside_the_range_of_its_field_is_rejected() {
    for (vary, words) in [
        (
            "cycle.volume.gain = { uniform = [30.0, 60.0] }",
            [
                "line 12, ",
                "vary.cycle.volume.gain: ",
                "cycle.volume.gain is ",
            ],
        ),
        (
            "cycle.volume.gain = { normal = { mean = -3.0, sd = 0.01 } }",
            ["line 12, ", "vary.cycle.volume.gain: ", "must be between"],
        ),
        (
            "pose.shift.1 = { uniform = [1e7, 2e7] }",
            ["line 12, ", "vary.pose.shift.1: ", "pose.shift is "],
        ),
        (
            "camera.views = { choice = [0, 100000000] }",
            ["line 12, ", "vary.camera.views: ", "camera.views is "],
        ),
        (
            "[[cases]]\n[[cases]]\nvary.cycle.volume.gain = { uniform = [30.0, 60.0] }",
            [
                "line 14, ",
                "cases.2.vary.cycle.volume.gain: ",
                "none of 64",
            ],
        ),
    ] {
        says(&text(3, "seed = 1", vary), &words);
    }
    for vary in [
        "cycle.volume.gain = { uniform = [-1.0, 60.0] }",
        // Each alone is outside what the base allows.
        "heart.outer.radius = { uniform = [1.4, 1.5] }\nheart.inner.radius = { uniform = [0.8, 0.9] }",
    ] {
        Cohort::from_toml(&text(3, "seed = 1", vary)).unwrap();
    }
}

#[test]
fn a_shard_of_another_cohort_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    assert!(!shard(&with_rejected(3), folder.path(), [1, 1], 1).skipped);
    let before = fs::read(folder.path().join("shard-00001-of-00001.tar")).unwrap();
    let other = Cohort::from_toml(&text(3, "seed = 6", "")).unwrap();
    let run = run_shard(
        &other,
        folder.path(),
        Shard { shard: 1, of: 1 },
        &RunOptions::new(1),
        &no_observer,
    );
    assert!(matches!(run, Err(CohortError::OtherCohort { .. })));
    // Nor is another shard added beside it.
    let two = tempfile::tempdir().unwrap();
    assert!(!shard(&with_rejected(3), two.path(), [1, 2], 1).skipped);
    let (before_two, options) = (names(two.path()), RunOptions::new(1));
    let second = Shard { shard: 2, of: 2 };
    let run = run_shard(&other, two.path(), second, &options, &no_observer);
    assert!(matches!(run, Err(CohortError::OtherCohort { .. })));
    assert_eq!(names(two.path()), before_two);
    let found = verify(&other, folder.path(), 1, 1, &RunOptions::new(1)).unwrap();
    assert_eq!(
        (found.complete, found.recomputed, &found.faults[0].fault),
        (0, Vec::new(), &Fault::OtherCohort)
    );
    assert!(fs::read(folder.path().join("shard-00001-of-00001.tar")).unwrap() == before);
}

#[test]
fn a_read_only_directory_is_reported_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "x").unwrap();
    let begun = std::sync::atomic::AtomicBool::new(false);
    let progress = |done| {
        begun.store(true, std::sync::atomic::Ordering::Relaxed);
        no_observer(done)
    };
    let run = run_shard(
        &with_rejected(3),
        &file,
        Shard { shard: 1, of: 1 },
        &RunOptions::new(1),
        &progress,
    );
    assert!(matches!(run, Err(CohortError::Phantom(_))) && !begun.into_inner());
    assert!(matches!(
        merge(&file),
        Err(CohortError::Phantom(PhantomError::Read { .. }))
    ));
}

/// Neither archive nor record nor temporary file, whichever member is the last; the next run is bitwise identical to one without a stop.
#[test]
fn a_stopped_shard_leaves_no_files() {
    let (cohort, folder) = (with_rejected(5), tempfile::tempdir().unwrap());
    let one = Shard { shard: 1, of: 1 };
    for threads in [1, 2] {
        for last in 1..=5 {
            let progress = |done| match done < last {
                true => ControlFlow::Continue(()),
                false => ControlFlow::Break(()),
            };
            let options = RunOptions::new(threads);
            let run = run_shard(&cohort, folder.path(), one, &options, &progress);
            let Err(CohortError::Phantom(PhantomError::Stopped)) = run else {
                panic!("{run:?}")
            };
            assert_eq!(names(folder.path()), [""; 0]);
        }
    }
    let complete = tempfile::tempdir().unwrap();
    let [made, expected] = [&folder, &complete].map(|out| shard(&cohort, out.path(), [1, 1], 2));
    assert_eq!(made.rows, expected.rows);
    let [made, expected] = [made, expected].map(|report| fs::read(report.path).unwrap());
    assert!(made == expected);
}

#[test]
fn an_unsolvable_member_has_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    let vary = "background.semi_axes.1 = { choice = [3.0, 30.0] }";
    let head = "sampling = \"sobol\"";
    let torso = format!(
        "{SCENE}background = {{ concentration = 0.1, centre = [0.0, 0.0], semi_axes = [30.0, 30.0] }}\n"
    );
    let text = text(8, head, vary).replace(SCENE, &torso);
    let report = shard(&Cohort::from_toml(&text).unwrap(), folder.path(), [1, 1], 2);
    assert_eq!((report.rows.len(), report.rejected), (8, 4));
    for row in &report.rows {
        let is_narrow = row.values["background.semi_axes.1"].number() == Some(3.0);
        assert_eq!(row.rejected.is_some(), is_narrow);
        if let Some(reason) = &row.rejected {
            assert!(reason.contains("background"), "{reason}");
            assert!(row.bytes == 0 && row.blake3.is_empty() && row.numbers.is_empty());
        }
    }
}

/// The template with characters changed, removed, inserted and doubled gives an error or a cohort, whose members are drawn or an error.
#[test]
fn random_texts_are_cohorts_or_errors() {
    const CHARACTERS: &[u8] = b"0123456789.-+e[]{}=,\"'# \nnaif_\xc3\xa9";
    let template = Cohort::TEMPLATE.replace("attempts = 1000", "attempts = 10");
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let mut below = |n: usize| (random.next_u64() % n as u64) as usize;
    let (mut cohorts, mut errors) = (0, 0);
    for _ in 0..1000 {
        let mut text = template.clone().into_bytes();
        for _ in 0..=below(3) {
            let (at, other) = (below(text.len()), CHARACTERS[below(CHARACTERS.len())]);
            match below(4) {
                0 => text[at] = other,
                1 => drop(text.remove(at)),
                2 => text.insert(at, other),
                _ => text.insert(at, text[at]),
            }
        }
        match Cohort::from_toml(&String::from_utf8_lossy(&text)) {
            Ok(cohort) => {
                cohorts += 1;
                for k in [0, cohort.members() - 1, cohort.members()] {
                    let _ = cohort.member(k).and_then(|member| member.scene());
                }
            }
            Err(error) => {
                errors += 1;
                assert!(!error.to_string().is_empty());
            }
        }
    }
    assert!(cohorts > 100 && errors > 100, "{cohorts} {errors}");
}
