//! Texts of cohorts: every member of an accepted cohort is drawn, or no draw meets its constraints.
#![no_main]

use heart_cohort::{Cohort, CohortError};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    // A base scene is any file of the machine; the number of attempts is the user's time.
    if text.contains("base") || text.contains("attempts") {
        return;
    }
    if let Ok(cohort) = Cohort::from_toml(text) {
        for index in [0, cohort.members() / 2, cohort.members() - 1] {
            match cohort.member(index) {
                Ok(member) => drop(member.scene()),
                Err(error) => assert!(matches!(error, CohortError::Unmet { .. }), "{error}"),
            }
        }
        assert!(cohort.member(cohort.members()).is_err());
    }
});
