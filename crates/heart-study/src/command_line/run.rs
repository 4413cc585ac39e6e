//! The choice of a command.

use super::arguments::{Arguments, Command};
use super::cohort;
use super::commands::{Done, check, ef, init, man, one_view, paper, run_scene, text, truth};
use clap::CommandFactory;
use heart_phantom::{PhantomError, Scene};

pub(crate) fn run(arguments: &Arguments) -> Done {
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
        Command::Man { command } => man(command.as_deref()),
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
