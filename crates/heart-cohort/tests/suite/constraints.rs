//! Constraints between fields: precedence and invalid text.

use crate::text;
use heart_cohort::{Cohort, CohortError};

/// A cohort of one member with two fields that have one value each, and a constraint.
fn cohort(constraint: &str) -> Result<Cohort, CohortError> {
    let vary = "pose.shift.1 = { uniform = [2.0, 2.0] }\npose.shift.2 = { uniform = [-3.0, -3.0] }";
    let head = format!("attempts = 1\nconstraints = [\"{constraint}\"]");
    Cohort::from_toml(&text(1, &head, vary))
}

fn holds(constraint: &str) -> bool {
    match cohort(constraint).unwrap().member(0) {
        Ok(_) => true,
        Err(CohortError::Unmet { .. }) => false,
        Err(error) => panic!("{constraint}: {error}"),
    }
}

#[test]
fn sums_follow_the_usual_precedence() {
    for text in [
        "pose.shift.1 + 1 * 2 > 3.9",
        "pose.shift.1 - 1 - 1 <= 0",
        "2*(pose.shift.1 + 1) >= 6",
        "-pose.shift.2 > pose.shift.1",
        "--pose.shift.1/4 < .51",
        "1e-3 < 1.5E+2",
        "8 / 2 / 2 >= 2",
        " pose.shift.1>pose.shift.2 ",
    ] {
        assert!(holds(text), "{text}");
    }
    assert!(!holds("pose.shift.1 > 2"));
    assert!(!holds("0 / 0 <= 1") && !holds("pose.shift.1 / 0 > 1"));
}

#[test]
fn invalid_constraints_are_errors() {
    for (text, says) in [
        ("", "a number, a field or a bracket near character 0"),
        ("pose.centre", "one of < <= > >="),
        ("pose.centre > 1 2", "the end"),
        ("(pose.centre > 1", "a closing bracket"),
        ("pose.centre > 1.2.3", "`1.2.3` is not a number"),
        ("pose.centre > 1e999", "`1e999` is not a number"),
        ("1 > \u{5fc3}", "a number"),
        ("pose.centre = 1", "one of <"),
    ] {
        let error = cohort(text).unwrap_err().to_string();
        assert!(error.contains(says), "{text}: {error}");
    }
    // The limit of the length, whose message does not repeat the text.
    let long = format!("{}0 < 1", " ".repeat(1995));
    assert!(cohort(&long).is_ok());
    for text in [format!(" {long}"), "(".repeat(100_000)] {
        let error = cohort(&text).unwrap_err().to_string();
        let says = format!("has {} bytes; must have at most 2000", text.len());
        assert!(error.contains(&says) && error.len() < 300, "{error}");
    }
    let error = cohort("pose.shift.1 > x.y").unwrap_err().to_string();
    assert!(
        error.contains("x.y is not a number of the scene"),
        "{error}"
    );
}
