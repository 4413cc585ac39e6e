//! The program `heart-phantom`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(heart_study::command_line(std::env::args_os()))
}
