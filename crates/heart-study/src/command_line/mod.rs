//! The command line. `heart-phantom init > scene.toml`, then `heart-phantom run scene.toml --out DIR`.

mod arguments;
mod cohort;
mod commands;
mod output;
mod run;
#[cfg(unix)]
mod signals;
mod slurm;

use arguments::Arguments;
use clap::Parser;
use output::{Failure, Output};
use std::ffi::OsString;

/// Runs the program `heart-phantom` with these arguments, the first of which is its name; returns the exit code.
///
/// On Unix, signals that end the process first remove its unfinished files. Help is printed with the colours of the terminal and ends the
/// process.
///
/// ```
/// assert_eq!(heart_study::command_line(["heart-phantom", "check", "/nonexistent.toml"]), 2);
/// ```
pub fn command_line(arguments: impl IntoIterator<Item = impl Into<OsString>>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let arguments = match Arguments::try_parse_from(&arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            let wants_json = arguments.iter().any(|argument| argument == "--json");
            return Output::new(wants_json, false).end(Err(Failure::Usage(error)));
        }
    };
    let mut output = Output::new(arguments.json, arguments.quiet);
    #[cfg(unix)]
    if let Err(error) = signals::watch(output.note(&arguments.command)) {
        output.warn(format!(
            "an interrupt may leave a file that ends in .tmp: {error}"
        ));
    }
    output.end(run::run(&arguments))
}
