//! Output of the program: text, or JSON only.

#[cfg(unix)]
use super::arguments::{Cohort, Command};
use clap::error::{ContextKind, ErrorKind};
use heart_cohort::CohortError;
use heart_phantom::{PhantomError, chain, escape};
use serde_json::{Value, json};
use std::error::Error;
use std::io::{self, Write};

/// The result of a command.
pub(crate) enum Answer {
    /// A report, as JSON and as text lines.
    Report(Value, Vec<String>),
    /// A text: a scene, a script, a page.
    Text(String),
}

pub(crate) enum Failure {
    /// A report of a failure, as JSON with the fields `error` and `code`, and as text lines.
    Report(Value, Vec<String>),
    /// An invalid command line, or a request for help.
    Usage(clap::Error),
}

impl Failure {
    fn new(error: &(dyn Error + 'static), code: u8) -> Self {
        let text = chain(error);
        Self::Report(json!({ "error": text, "code": code }), vec![text])
    }
}

impl From<PhantomError> for Failure {
    fn from(error: PhantomError) -> Self {
        Self::Report(as_json(&error), vec![chain(&error)])
    }
}

impl From<CohortError> for Failure {
    fn from(error: CohortError) -> Self {
        match error {
            CohortError::Phantom(error) => error.into(),
            error => Self::new(&error, code_of_cohort(&error)),
        }
    }
}

impl From<clap::Error> for Failure {
    fn from(error: clap::Error) -> Self {
        Self::Usage(error)
    }
}

pub(crate) struct Output {
    pub(crate) json: bool,
    pub(crate) quiet: bool,
    /// Warnings for the JSON output.
    warnings: Vec<String>,
}

impl Output {
    pub(crate) fn new(json: bool, quiet: bool) -> Self {
        let warnings = Vec::new();
        Self {
            json,
            quiet,
            warnings,
        }
    }

    /// Returns the message of an interrupted command.
    #[cfg(unix)]
    pub(crate) fn note(&self, command: &Command) -> Option<&'static str> {
        const NOTE: &str = "interrupted: complete shards are kept, the unfinished one will be computed again from its first member; \
            with more shards (--shard all/N) less work is repeated";
        let note = match command {
            Command::Cohort {
                command: Cohort::Run { .. },
            } => NOTE,
            Command::Run { .. } | Command::Paper(_) | Command::Ef { .. } => {
                "interrupted: incomplete output was removed"
            }
            _ => return None,
        };
        (!self.quiet && !self.json).then_some(note)
    }

    pub(crate) fn warn(&mut self, warning: String) {
        if self.json {
            self.warnings.push(warning);
        } else {
            complain(&format!("warning: {warning}"));
        }
    }

    /// Prints the result or the failure; returns the exit code.
    pub(crate) fn end(&self, outcome: Result<Answer, Failure>) -> u8 {
        let ended = outcome.and_then(|answer| Ok(self.tell(answer)?));
        match ended {
            Ok(()) => 0,
            Err(Failure::Report(json, lines)) => {
                let code = json["code"].as_u64().unwrap_or(1) as u8;
                self.refuse(&lines.join("\n"), json);
                code
            }
            Err(Failure::Usage(mut error)) => {
                // A hint to take an unknown option for a file name.
                if error.kind() == ErrorKind::UnknownArgument {
                    error.remove(ContextKind::Suggested);
                }
                self.usage(&error)
            }
        }
    }

    fn tell(&self, answer: Answer) -> Result<(), PhantomError> {
        let text = match answer {
            Answer::Report(found, _) if self.json => self.json_text(found),
            Answer::Text(text) if self.json => self.json_text(json!({ "text": text })),
            Answer::Text(text) => text,
            Answer::Report(..) if self.quiet => return Ok(()),
            Answer::Report(_, lines) => lines.iter().map(|line| escape(line) + "\n").collect(),
        };
        let mut out = io::stdout().lock();
        match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
            // The reader closed the pipe.
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            written => written.map_err(|source| PhantomError::File {
                path: "the standard output".into(),
                source,
            }),
        }
    }

    fn refuse(&self, text: &str, json: Value) {
        if self.json {
            complain(self.json_text(json).trim_end());
        } else {
            complain(&format!("error: {text}"));
        }
    }

    fn usage(&self, error: &clap::Error) -> u8 {
        let is_help = error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
        if !self.json && (is_help || !error.use_stderr()) {
            error.exit(); // with the terminal's colours
        }
        if !error.use_stderr() {
            return match self.tell(Answer::Text(error.render().to_string())) {
                Ok(()) => 0,
                Err(_) => 1,
            };
        }
        let text = error.to_string();
        let text = text.strip_prefix("error: ").unwrap_or(&text).trim();
        self.refuse(text, json!({ "error": text, "code": 2 }));
        2
    }

    /// Returns a JSON object with the warnings; control characters are escaped as in JSON.
    fn json_text(&self, mut value: Value) -> String {
        if !self.warnings.is_empty() {
            let others = self.warnings.iter().map(|told| json!({ "message": told }));
            match value["warnings"].as_array_mut() {
                Some(warnings) => warnings.extend(others),
                None => value["warnings"] = others.collect(),
            }
        }
        let mut text = String::new();
        for c in format!("{value:#}\n").chars() {
            if c == '\n' || escape(c.encode_utf8(&mut [0; 4])).chars().eq([c]) {
                text.push(c);
            } else {
                for unit in c.encode_utf16(&mut [0; 2]) {
                    text += &format!("\\u{unit:04x}");
                }
            }
        }
        text
    }
}

/// Prints to standard error; if it is closed, only the exit code remains.
pub(crate) fn complain(what: &str) {
    let mut to = io::stderr().lock();
    for line in what.lines() {
        let _ = writeln!(to, "{}", escape(line));
    }
}

/// Returns 2 for errors in the command or the scene, 1 for failures during work.
fn code(error: &PhantomError) -> u8 {
    match error {
        PhantomError::Scene(_)
        | PhantomError::Rejected { .. }
        | PhantomError::Read { .. }
        | PhantomError::Absent { .. }
        | PhantomError::NoCounts
        | PhantomError::NotBuilt { .. }
        | PhantomError::Balloon(_)
        | PhantomError::Membrane(_)
        | PhantomError::Crossed { .. }
        | PhantomError::NoMaterial { .. }
        | PhantomError::NoDefect { .. }
        | PhantomError::Uncovered { .. }
        | PhantomError::Tolerance { .. }
        | PhantomError::OutOfRange { .. }
        | PhantomError::Count { .. }
        | PhantomError::Extension { .. }
        | PhantomError::Unsupported { .. } => 2,
        _ => 1,
    }
}

/// As [`code`], for cohorts.
fn code_of_cohort(error: &CohortError) -> u8 {
    match error {
        CohortError::Unmet { .. }
        | CohortError::NoMember { .. }
        | CohortError::NoScene { .. }
        | CohortError::NoShard { .. }
        | CohortError::OtherDivision { .. }
        | CohortError::OtherCohort { .. } => 2,
        _ => 1,
    }
}

fn as_json(error: &PhantomError) -> Value {
    let mut json = json!({ "error": chain(error), "code": code(error) });
    let at = match error {
        PhantomError::Scene(scene) => {
            let first = scene.first();
            Some((scene.file.as_deref(), &first.field, first.place))
        }
        PhantomError::Rejected {
            file, field, place, ..
        } => Some((file.as_deref(), field, *place)),
        _ => None,
    };
    if let Some((file, field, place)) = at {
        json["file"] = json!(file.map(|file| file.to_string_lossy()));
        json["field"] = json!(field);
        json["line"] = json!(place.map(|[line, _]| line));
        json["column"] = json!(place.map(|[_, column]| column));
    }
    json
}
