//! Draws the field values of a member from its index.

use crate::cohort::{Case, Cohort, Sampling, Subset};
use crate::error::CohortError;
use crate::field::FieldValue;
use crate::read::scene_from;
use crate::{field, sobol};
use heart_phantom::Scene;
use heart_phantom::scene::SceneError;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde_json::Value;
use std::collections::BTreeMap;

/// The stream of the shift of the Sobol points; members have the streams of their indices.
const STREAM_OF_SHIFT: u64 = u64::MAX;
/// The stream of the subsets, and the number of its words per member.
const STREAM_OF_SUBSETS: u64 = u64::MAX - 1;
const WORDS_OF_SUBSET: u128 = 2;
/// Bits of a seed that are exact in double precision.
const BITS_OF_SEED: u32 = 53;

/// A member: its case and its drawn values.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Member {
    /// Index in the cohort, from 0.
    pub index: u64,
    /// Name in shards and manifests, eight digits.
    pub key: String,
    /// Name of its case; empty if the cohort has no cases.
    pub case: String,
    /// Index of the case in the text, from 0.
    pub case_index: usize,
    /// Subset; `None` if the cohort is not split.
    pub split: Option<Subset>,
    /// Number of draws until the constraints were met, from 1.
    pub attempts: u32,
    /// Drawn values by the dotted paths of the fields.
    pub values: BTreeMap<String, FieldValue>,
    /// The complete scene, as JSON.
    scene: Value,
}

impl Member {
    /// Returns the number of a field of its scene; `None` if the field is absent or not a number.
    #[must_use]
    pub fn number(&self, path: &str) -> Option<f64> {
        field::get(&self.scene, path)?.as_f64()
    }

    /// Returns its scene.
    ///
    /// # Errors
    /// [`CohortError::NoScene`] for drawn values that are not a valid scene: a rejected member.
    pub fn scene(&self) -> Result<Scene, CohortError> {
        scene_from(&self.scene).map_err(|error| CohortError::NoScene {
            member: self.index,
            what: error.first().wanted.clone(),
        })
    }

    pub(crate) fn key_of(index: u64) -> String {
        format!("{index:08}")
    }
}

impl Cohort {
    /// Number of scenes of a case that are drawn to find a valid one.
    pub(crate) const SCENES: usize = 64;

    /// Draws a member. The result is a function of the text and the index.
    ///
    /// The first 53 bits of its ChaCha8 stream (seed of the cohort, stream = index) are the seed of its noise, if its scene has
    /// noise and the text does not vary that seed. The coordinates in the unit cube follow, draw by draw. With `sampling = "sobol"`
    /// the first draw is point `index` of the sequence; draws after a violated constraint come from the stream, because later
    /// points of the sequence belong to other members or to the same cell.
    ///
    /// # Errors
    /// [`CohortError::NoMember`] for an index beyond the cohort; [`CohortError::Unmet`] if no draw meets the constraints.
    pub fn member(&self, index: u64) -> Result<Member, CohortError> {
        if index >= self.members {
            return Err(CohortError::NoMember {
                member: index,
                members: self.members,
            });
        }
        let mut stream = self.stream(index);
        let noise = stream.next_u64() >> (64 - BITS_OF_SEED);
        let mut failed = vec![0; self.constraints.len()];
        for attempt in 0..self.attempts {
            let point = self.point(index, attempt, &mut stream);
            let (case_index, case) = self.case_at(point[0]);
            let values = match self.values(case, &point[1..]) {
                Ok(values) => values,
                Err(broken) => {
                    failed[broken] += 1;
                    continue;
                }
            };
            return Ok(Member {
                index,
                key: Member::key_of(index),
                case: case.name.clone(),
                case_index,
                split: self.subset(index),
                attempts: attempt + 1,
                scene: scene_of(case, &values, noise),
                values,
            });
        }
        let most = failed.iter().copied().max().unwrap_or(0);
        let worst = failed.iter().position(|count| *count == most).unwrap_or(0);
        Err(CohortError::Unmet {
            member: index,
            attempts: self.attempts,
            constraint: self.constraints[worst].text().to_owned(),
            failed: most,
        })
    }

    /// The values of the varied fields of a case at their coordinates.
    ///
    /// # Errors
    /// The index of the first constraint that they violate.
    fn values(&self, case: &Case, point: &[f64]) -> Result<BTreeMap<String, FieldValue>, usize> {
        let values: BTreeMap<String, FieldValue> = (self.varied.iter().zip(point))
            .filter_map(|(path, &u)| {
                let value = case.vary.get(path)?.value(u, self.whole.contains(path));
                Some((path.clone(), value))
            })
            .collect();
        let number = |path: &str| number_of(case, &values, path).unwrap_or(f64::NAN);
        let broken = (self.constraints.iter()).position(|constraint| !constraint.holds(&number));
        broken.map_or(Ok(values), Err)
    }

    /// Draws scenes of a case that meet the constraints until one of them is valid; returns the error of the first if none of
    /// [`SCENES`](Self::SCENES) is. Draws at most 1000 times.
    pub(crate) fn invalid(&self, case: &Case) -> Option<SceneError> {
        let mut stream = self.stream(0);
        let drawn = (0..1000).filter_map(|_| {
            let point = self.point(0, 1, &mut stream);
            let values = self.values(case, &point[1..]).ok()?;
            Some(scene_from(&scene_of(case, &values, 0)).and_then(|scene| scene.check()))
        });
        let errors: Result<Vec<SceneError>, ()> = (drawn.take(Self::SCENES))
            .map(|checked| checked.err().ok_or(()))
            .collect();
        errors
            .ok()
            .filter(|errors| errors.len() == Self::SCENES)?
            .into_iter()
            .next()
    }

    fn stream(&self, stream: u64) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(stream);
        random
    }

    /// Draws the subset of a member from a separate stream: a function of the seed, the fractions and the index.
    fn subset(&self, index: u64) -> Option<Subset> {
        let mut stream = self.stream(STREAM_OF_SUBSETS);
        stream.set_word_pos(WORDS_OF_SUBSET * u128::from(index));
        let u = (stream.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        self.split.map(|split| split.subset(u))
    }

    /// The coordinates of the case and of each varied field, in (0, 1).
    fn point(&self, index: u64, attempt: u32, stream: &mut ChaCha8Rng) -> Vec<f64> {
        let dimensions = 0..=self.varied.len();
        let mut point: Vec<f64> = match (self.sampling, attempt) {
            (Sampling::Plain, _) | (Sampling::Sobol, 1..) => dimensions
                .map(|_| ((stream.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64)
                .collect(),
            (Sampling::Sobol, 0) => {
                let at = index as u32;
                let mut shifts = self.stream(STREAM_OF_SHIFT);
                dimensions
                    .map(|d| sobol::sobol(at, d) ^ shifts.next_u32())
                    .map(|x| (f64::from(x) + 0.5) / (1u64 << 32) as f64)
                    .collect()
            }
        };
        self.copula.apply(&mut point);
        point
    }

    fn case_at(&self, u: f64) -> (usize, &Case) {
        let all: f64 = self.cases.iter().map(|case| case.weight).sum();
        let (mut last, mut left) = (0, u * all);
        for (k, case) in self.cases.iter().enumerate() {
            last = k;
            if left < case.weight {
                break;
            }
            left -= case.weight;
        }
        (last, &self.cases[last])
    }
}

/// Returns the number of a field in the scene of a member. A drawn field has priority over a drawn table that contains it; the
/// table has the shorter path and precedes the field in `values`.
fn number_of(case: &Case, values: &BTreeMap<String, FieldValue>, path: &str) -> Option<f64> {
    let mut drawn = values.iter().rev();
    match drawn.find(|(drawn, _)| field::is_within(path, drawn)) {
        Some((drawn, value)) if *drawn == path => value.number(),
        Some((drawn, value)) => field::get(&value.json(), &path[drawn.len() + 1..])?.as_f64(),
        None => field::get(&case.scene, path)?.as_f64(),
    }
}

fn scene_of(case: &Case, values: &BTreeMap<String, FieldValue>, noise: u64) -> Value {
    let mut scene = case.scene.clone();
    if field::get(&scene, "noise.seed").is_some() {
        field::set(&mut scene, "noise.seed", Value::from(noise));
    }
    for (path, value) in values {
        // Each was validated when the text was read.
        field::set(&mut scene, path, value.json());
    }
    scene
}
