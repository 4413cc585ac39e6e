//! Parses a cohort. Every named field must be a field of the scene; errors contain the position.

use crate::cohort::{Case, Cohort, Compression, Precision, Sampling, Split};
use crate::correlation::{Copula, Correlation};
use crate::distribution::Distribution;
use crate::error::CohortError;
use crate::field::FieldValue;
use crate::{field, sobol};
use heart_phantom::scene::{Finding, SceneError, locate, read_text, read_toml};
use heart_phantom::{PhantomError, Product, Scene, files::Format};
use serde::Deserialize;
use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The file as parsed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    members: u64,
    #[serde(default = "one")]
    seed: u64,
    #[serde(default)]
    sampling: Sampling,
    #[serde(default = "thousand")]
    attempts: u32,
    base: Option<PathBuf>,
    #[serde(default)]
    compression: Compression,
    #[serde(default)]
    precision: Precision,
    split: Option<Split>,
    #[serde(default)]
    constraints: Vec<String>,
    #[serde(default)]
    correlations: Vec<Correlation>,
    #[serde(default)]
    scene: Fields,
    #[serde(default)]
    vary: Fields,
    #[serde(default)]
    cases: Vec<TextOfCase>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TextOfCase {
    name: Option<String>,
    #[serde(default = "unit")]
    weight: f64,
    #[serde(default)]
    scene: Fields,
    #[serde(default)]
    vary: Fields,
}

/// A table of fields before the check for NaN and infinity.
type Fields = BTreeMap<String, FieldValue>;

fn one() -> u64 {
    1
}

fn thousand() -> u32 {
    1000
}

fn unit() -> f64 {
    1.0
}

impl Cohort {
    /// Reads a cohort from a file; the path of a base scene is relative to it.
    ///
    /// # Errors
    /// [`PhantomError::Read`] if the file or that of the base scene cannot be read; [`PhantomError::Scene`] with file, line and field for
    /// invalid text.
    pub fn load(path: &Path) -> Result<Self, CohortError> {
        let text = read_text(path)?;
        let folder = path.parent().unwrap_or(Path::new("."));
        Self::of_text(&text, folder).map_err(|mut error| {
            if let CohortError::Phantom(PhantomError::Scene(error)) = &mut error {
                // An error of the base scene has its own file.
                error.file.get_or_insert_with(|| path.to_path_buf());
            }
            error
        })
    }

    /// Parses a cohort; the path of a base scene is relative to the working directory.
    ///
    /// # Errors
    /// As [`Cohort::load`].
    pub fn from_toml(text: &str) -> Result<Self, CohortError> {
        Self::of_text(text, Path::new("."))
    }

    fn of_text(text: &str, folder: &Path) -> Result<Self, CohortError> {
        let given: Text = read_toml(text).map_err(SceneError::from)?;
        let reader = Reader { text };
        let base = match &given.base {
            Some(base) => Scene::load(&folder.join(base))?,
            None => Scene::default(),
        };
        let mut cohort = Self {
            members: given.members,
            seed: given.seed,
            sampling: given.sampling,
            attempts: given.attempts,
            compression: given.compression,
            precision: given.precision,
            split: given.split,
            cases: Vec::new(),
            constraints: Vec::new(),
            correlations: Vec::new(),
            copula: Copula::default(),
            varied: BTreeSet::new(),
            whole: BTreeSet::new(),
            digest: String::new(),
        };
        reader.check_numbers(&cohort)?;
        let scene = reader.json(given.scene, "scene")?;
        let base = reader.laid_over(&json_of(&base), &scene, "scene")?;
        let vary = reader.distributions(&reader.json(given.vary, "vary")?, "vary")?;
        let only = TextOfCase {
            name: Some(String::new()),
            weight: 1.0,
            scene: Fields::new(),
            vary: Fields::new(),
        };
        let (has_cases, cases) = match given.cases.is_empty() {
            true => (false, vec![only]),
            false => (true, given.cases),
        };
        for (k, case) in cases.into_iter().enumerate() {
            let case = reader.case(case, k, &base, &vary)?;
            cohort
                .whole
                .extend(reader.whole_fields(&case, &section_of(k, has_cases))?);
            cohort.varied.extend(case.vary.keys().cloned());
            cohort.cases.push(case);
        }
        reader.check_cases(&cohort.cases, has_cases)?;
        if cohort.sampling == Sampling::Sobol && cohort.varied.len() >= sobol::MOST_DIMENSIONS {
            let what = format!(
                "sobol has at most {} dimensions (the case and the varied fields), but the cohort has {}; use plain",
                sobol::MOST_DIMENSIONS,
                cohort.varied.len() + 1
            );
            return Err(reader.wrong("sampling", what).into());
        }
        cohort.constraints = reader.constraints(&given.constraints, &cohort)?;
        cohort.copula = reader.copula(&given.correlations, &cohort)?;
        cohort.correlations = given.correlations;
        reader.check_scenes(&cohort, has_cases)?;
        Ok(cohort.with_digest())
    }
}

/// The text, for positions of errors.
pub(crate) struct Reader<'a> {
    text: &'a str,
}

impl Reader<'_> {
    pub(crate) fn wrong(&self, field: &str, what: impl Into<String>) -> SceneError {
        let place = locate(self.text, field).map(|(place, _)| place);
        Finding::new(place, field, what).into()
    }

    /// A table of the text as JSON; rejects NaN and infinity.
    fn json(&self, table: Fields, section: &str) -> Result<Value, SceneError> {
        let mut json = Map::new();
        for (name, value) in table {
            if let Some(path) = value.not_finite() {
                let dot = if path.is_empty() { "" } else { "." };
                let field = format!("{section}.{name}{dot}{path}");
                return Err(self.wrong(&field, "is not a finite number"));
            }
            json.insert(name, value.json());
        }
        Ok(Value::Object(json))
    }

    /// Merges a section of the text into a scene; validates it and adds defaults.
    fn laid_over(&self, base: &Value, above: &Value, section: &str) -> Result<Value, SceneError> {
        let mut scene = base.clone();
        field::lay_over(&mut scene, above);
        let read = scene_from(&scene).and_then(|scene| scene.check().map(|()| scene));
        let scene = read.map_err(|error| {
            let first = error.first();
            let field = match first.field.as_str() {
                "" => section.to_owned(),
                field => format!("{section}.{field}"),
            };
            match first.given.as_str() {
                "" => self.wrong(&field, first.wanted.clone()),
                given => self.wrong(&field, format!("is {given}; {}", first.wanted)),
            }
        })?;
        self.check_output(&scene, section)?;
        Ok(json_of(&scene))
    }

    /// Shards contain arrays as npy.
    fn check_output(&self, scene: &Scene, section: &str) -> Result<(), SceneError> {
        let output = &scene.output;
        for product in &output.write {
            match product {
                Product::Projections
                | Product::Reconstruction
                | Product::Truth
                | Product::Labels
                | Product::Attenuation => {}
                _ => {
                    let field = format!("{section}.output.write");
                    let what = "shards can contain projections, reconstruction, truth, labels and attenuation only";
                    return Err(self.wrong(&field, what));
                }
            }
        }
        if output.volumes != Format::Npy || output.projections != Format::Npy {
            let what = "shards contain arrays as npy only";
            return Err(self.wrong(&format!("{section}.output"), what));
        }
        Ok(())
    }

    /// The varied fields by their paths.
    fn distributions(
        &self,
        table: &Value,
        section: &str,
    ) -> Result<BTreeMap<String, Distribution>, SceneError> {
        let mut found = BTreeMap::new();
        for (name, value) in table.as_object().into_iter().flatten() {
            let at = format!("{section}.{name}");
            let is_one = |inner: &Map<String, Value>| {
                // Also by another spelling, for the error of the parser.
                let plain = |name: &str| name.replace(['-', '_'], "").to_lowercase();
                let mut names = Distribution::NAMES.iter();
                names.any(|name| inner.keys().any(|key| plain(key) == plain(name)))
            };
            match value {
                Value::Object(inner) if !is_one(inner) && !inner.is_empty() => {
                    for (path, distribution) in self.distributions(value, &at)? {
                        self.add(&mut found, format!("{name}.{path}"), distribution, section)?;
                    }
                }
                value => {
                    let distribution: Distribution = serde_json::from_value(value.clone())
                        .map_err(|error| {
                            let names = Distribution::NAMES.join(", ");
                            self.wrong(&at, format!("{error}; must be one of {names}"))
                        })?;
                    if let Some(fault) = distribution.fault() {
                        return Err(self.wrong(&at, fault));
                    }
                    self.add(&mut found, name.clone(), distribution, section)?;
                }
            }
        }
        Ok(found)
    }

    /// A path may be written as tables or as a quoted key, but not both.
    fn add(
        &self,
        found: &mut BTreeMap<String, Distribution>,
        path: String,
        distribution: Distribution,
        section: &str,
    ) -> Result<(), SceneError> {
        let at = format!("{section}.{path}");
        match found.insert(path, distribution) {
            None => Ok(()),
            Some(_) => Err(self.wrong(&at, "is given twice")),
        }
    }

    /// A case; its distributions replace those of all cases.
    fn case(
        &self,
        given: TextOfCase,
        k: usize,
        base: &Value,
        vary: &BTreeMap<String, Distribution>,
    ) -> Result<Case, SceneError> {
        let section = format!("cases.{}", k + 1);
        let [at_scene, at_vary] = ["scene", "vary"].map(|name| format!("{section}.{name}"));
        let (own, own_vary) = (
            self.json(given.scene, &at_scene)?,
            self.json(given.vary, &at_vary)?,
        );
        let fixed = field::leaves(&own, "");
        let scene = match own.as_object().is_some_and(Map::is_empty) {
            true => base.clone(),
            false => self.laid_over(base, &own, &at_scene)?,
        };
        // A case may use another variant of a choice, which lacks the field.
        let is_gone =
            |path: &str| field::get(base, path).is_some() && field::get(&scene, path).is_none();
        let is_fixed = |path: &str| fixed.iter().any(|other| field::overlap(path, other));
        let mut varied: BTreeMap<String, Distribution> = (vary.iter())
            .filter(|(path, _)| !is_fixed(path) && !is_gone(path))
            .map(|(path, distribution)| (path.clone(), distribution.clone()))
            .collect();
        varied.extend(self.distributions(&own_vary, &at_vary)?);
        Ok(Case {
            name: given.name.unwrap_or_else(|| format!("case {}", k + 1)),
            weight: given.weight,
            scene,
            vary: varied,
        })
    }

    /// The path of a varied field in the text: of its case, or of all cases.
    pub(crate) fn varied_at(&self, section: &str, path: &str) -> String {
        let own = format!("{section}.vary.{path}");
        let is_there = locate(self.text, &own).is_some_and(|(_, is_there)| is_there);
        let is_own = !section.is_empty() && is_there;
        if is_own { own } else { format!("vary.{path}") }
    }

    /// Tries each varied field separately: finds integer fields, and names that are not fields of the scene.
    fn whole_fields(&self, case: &Case, section: &str) -> Result<Vec<String>, SceneError> {
        let mut whole = Vec::new();
        for (path, distribution) in &case.vary {
            let tried = |value: Value| -> Result<(), String> {
                let mut scene = case.scene.clone();
                if !field::set(&mut scene, path, value) {
                    return Err("is not a field of the scene".into());
                }
                let scene = scene_from(&scene).map(drop);
                scene.map_err(|error| error.first().wanted.clone())
            };
            let outcome = match distribution {
                Distribution::Choice(values) => {
                    values.iter().try_for_each(|value| tried(value.json()))
                }
                // Midway between two integers: a field that accepts it accepts all numbers.
                _ => tried(Value::from(0.5)).or_else(|_| {
                    tried(Value::from(1))?;
                    whole.push(path.clone());
                    distribution.fault_of_whole().map_or(Ok(()), Err)
                }),
            };
            outcome.map_err(|what| {
                let field = self.varied_at(section, path);
                // The parser's words for two alternatives of one choice, and for a section that the scene lacks.
                let what = match what.starts_with("expected value") {
                    true => "is not a field of the scene".to_owned(),
                    false => what.replace("missing field", "the scene lacks its section, with"),
                };
                self.wrong(&field, format!("{what}{}", there_is(&case.scene, path)))
            })?;
        }
        Ok(whole)
    }
}

/// The section of a case; empty if the text has no cases.
pub(crate) fn section_of(k: usize, has_cases: bool) -> String {
    match has_cases {
        true => format!("cases.{}", k + 1),
        false => String::new(),
    }
}

/// The existing fields at a path, for a message.
fn there_is(scene: &Value, path: &str) -> String {
    let mut parent = path;
    while let Some((above, _)) = parent.rsplit_once('.') {
        parent = above;
        match field::get(scene, parent) {
            None => {}
            Some(Value::Object(table)) => {
                let names: Vec<&str> = table.keys().map(String::as_str).collect();
                let names = names.join(", ");
                let hint = other_choice(scene, parent, path).unwrap_or_default();
                return format!("; {parent} of the scene has {names}{hint}");
            }
            Some(value) => return format!("; {parent} of the scene is {value}"),
        }
    }
    String::new()
}

/// A hint for a field of a choice of which the scene has another variant, such as `cycle.volume.ejection_fraction`.
fn other_choice(scene: &Value, parent: &str, path: &str) -> Option<String> {
    let name = path.strip_prefix(parent)?.strip_prefix('.')?;
    let mut scene = scene.clone();
    field::set(&mut scene, parent, serde_json::json!({ name: 0.5 }));
    let hint = format!("; set {parent} = {{ {name} = ... }} in [scene]");
    scene_from(&scene).is_ok().then_some(hint)
}

/// A scene as JSON with defaults. Its numbers are finite, and JSON has all its names.
pub(crate) fn json_of(scene: &Scene) -> Value {
    serde_json::from_str(&scene.to_json()).unwrap_or_default()
}

/// Reads a scene from JSON without validation.
pub(crate) fn scene_from(json: &Value) -> Result<Scene, SceneError> {
    Scene::from_json(&json.to_string())
}
