//! The command line. `heart-phantom init > scene.toml`, then `heart-phantom run scene.toml --out DIR`.

mod arguments;
mod cohort;
mod commands;
mod output;
#[cfg(unix)]
mod signals;

use arguments::Arguments;
use clap::Parser;
use output::{Failure, Output};
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let wants_json = std::env::args_os().any(|argument| argument == "--json");
            return Output::new(wants_json, false).end(Err(Failure::Usage(error)));
        }
    };
    let mut output = Output::new(arguments.json, arguments.quiet);
    #[cfg(unix)]
    if let Err(error) = signals::watch() {
        output.warn(format!(
            "an interrupt may leave a file that ends in .tmp: {error}"
        ));
    }
    output.end(commands::run(&arguments))
}
