//! The command line. `heart-phantom init > scene.toml`, then `heart-phantom run scene.toml --out DIR`.

mod arguments;
mod cohort;
mod commands;
mod output;
#[cfg(unix)]
mod signals;
mod slurm;

use arguments::{Arguments, Command};
use clap::{CommandFactory, Parser};
use commands::{Done, check, ef, init, man, one_view, paper, run_scene, text, truth};
use heart_phantom::{PhantomError, Scene};
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
    output.end(run(&arguments))
}

/// Runs a command.
fn run(arguments: &Arguments) -> Done {
    match &arguments.command {
        Command::Paper(options) => in_pool(arguments, || paper(arguments, options)),
        Command::Ef { out, quick } => in_pool(arguments, || ef(arguments, out, *quick)),
        Command::Init { file } => init(file.as_deref(), Scene::default().to_toml()),
        Command::Check { scene } => in_pool(arguments, || check(arguments, scene)),
        Command::Run {
            scene,
            out,
            no_html,
        } => in_pool(arguments, || run_scene(arguments, scene, out, !no_html)),
        Command::Truth { scene, phase, out } => in_pool(arguments, || {
            truth(arguments, scene, *phase, out.as_deref())
        }),
        Command::View {
            scene,
            view,
            gate,
            out,
        } => in_pool(arguments, || {
            one_view(arguments, scene, [*gate, *view], out)
        }),
        Command::Cohort { command } => in_pool(arguments, || cohort::run(arguments, command)),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            let mut command = Arguments::command();
            clap_complete::generate(*shell, &mut command, "heart-phantom", &mut script);
            Ok(text(&script))
        }
        Command::Man { command } => man(command),
    }
}

/// Runs a command on the threads of the arguments, by default one per core.
fn in_pool(arguments: &Arguments, work: impl FnOnce() -> Done + Send) -> Done {
    let given = arguments.threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(given).build();
    let failed = |error: rayon::ThreadPoolBuildError| PhantomError::Threads {
        given,
        source: error.into(),
    };
    pool.map_err(failed)?.install(work)
}
