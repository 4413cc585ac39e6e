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
                complain(&format_args!("error: {error}"));
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
    let mut json = serde_json::json!({ "error": error.to_string(), "code": code(error) });
    if let PhantomError::Scene(scene) = error {
        json["file"] = serde_json::json!(scene.file);
        json["field"] = serde_json::json!(scene.field);
        json["line"] = serde_json::json!(scene.place.map(|[line, _]| line));
        json["column"] = serde_json::json!(scene.place.map(|[_, column]| column));
    }
    json
}
