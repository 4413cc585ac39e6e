//! The command line. `heart-phantom init > scene.toml`, then `heart-phantom run scene.toml --out DIR`.

mod arguments;
mod commands;
#[cfg(unix)]
mod signals;

use arguments::Arguments;
use clap::Parser;
use heart_phantom::PhantomError;
use std::fmt::Display;
use std::io::{self, Write};
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return refuse(&error),
    };
    #[cfg(unix)]
    if let Err(error) = signals::watch() {
        complain(&format_args!(
            "warning: an interrupt may leave a file that ends in .tmp: {error}"
        ));
    }
    match commands::run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if arguments.json {
                complain(&as_json(&error));
            } else {
                complain(&format_args!("error: {}", told(&error)));
            }
            ExitCode::from(code(&error))
        }
    }
}

/// A command line that cannot be understood, or that asks for help.
fn refuse(error: &clap::Error) -> ExitCode {
    let wants_json = std::env::args_os().any(|argument| argument == "--json");
    if !(wants_json && error.use_stderr()) {
        error.exit();
    }
    let text = error.to_string();
    let text = text.strip_prefix("error: ").unwrap_or(&text).trim();
    complain(&serde_json::json!({ "error": text, "code": 2 }));
    ExitCode::from(2)
}

/// To the standard error; if that is gone, the exit code has to say it all.
fn complain(what: &dyn Display) {
    let _ = writeln!(io::stderr(), "{what}");
}

/// The error and what led to it, each message once.
fn told(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let said = error.to_string();
        // Some messages end with their cause.
        if !text.ends_with(&said) {
            text = format!("{text}: {said}");
        }
        cause = error.source();
    }
    text
}

/// 2 for what the user can put right in the command or the scene, 1 for what went wrong at work.
fn code(error: &PhantomError) -> u8 {
    match error {
        PhantomError::Scene(_)
        | PhantomError::Read { .. }
        | PhantomError::Absent { .. }
        | PhantomError::Crossed { .. }
        | PhantomError::OutOfRange { .. }
        | PhantomError::Count { .. }
        | PhantomError::Odd { .. }
        | PhantomError::Extension { .. }
        | PhantomError::Unsupported { .. } => 2,
        _ => 1,
    }
}

fn as_json(error: &PhantomError) -> serde_json::Value {
    let mut json = serde_json::json!({ "error": told(error), "code": code(error) });
    if let PhantomError::Scene(scene) = error {
        json["file"] = serde_json::json!(scene.file);
        json["field"] = serde_json::json!(scene.field);
        json["line"] = serde_json::json!(scene.place.map(|[line, _]| line));
        json["column"] = serde_json::json!(scene.place.map(|[_, column]| column));
    }
    json
}

#[cfg(test)]
mod tests {
    use super::*;
    use membrane_newton::{MembraneError, NewtonError};

    #[test]
    fn a_cause_is_told_once() {
        let value = f64::NAN;
        let quantity = "radius";
        let cause = MembraneError::NotFinite { quantity, value };
        let error = PhantomError::Membrane(NewtonError::from(cause));
        let said = "the membrane cannot be solved for: radius must be finite, got NaN";
        assert_eq!(told(&error), said);
        assert_eq!(as_json(&error)["error"], said);
        let path = "a.toml".into();
        let source = io::Error::from(io::ErrorKind::NotFound);
        let error = PhantomError::Read { path, source };
        assert_eq!(told(&error), "cannot read a.toml: entity not found");
    }
}
