//! The command line. `heart-phantom init > scene.toml`, then `heart-phantom run scene.toml --out DIR`.

mod arguments;
mod commands;

use arguments::Arguments;
use clap::Parser;
use heart_phantom::PhantomError;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match commands::run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if arguments.json {
                eprintln!("{}", as_json(&error));
            } else {
                eprintln!("error: {error}");
            }
            ExitCode::from(code(&error))
        }
    }
}

/// 2 for what the user can put right in the command or the scene, 1 for what went wrong at work.
fn code(error: &PhantomError) -> u8 {
    match error {
        PhantomError::Scene(_)
        | PhantomError::Read { .. }
        | PhantomError::Absent { .. }
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
