//! Automation of the workspace. `cargo xtask` lists the tasks; each task is one file.

mod accuracy;
mod consume;
mod counts;
mod dependencies;
mod examples;
mod features;
mod fuzz;
mod mutants;
mod report;
mod semver;
mod stress;
mod tidy;
mod workspace;

use std::process::ExitCode;

/// A task: name, summary and function.
struct Task {
    name: &'static str,
    arguments: &'static str,
    what: &'static str,
    run: fn(&[String]) -> Result<(), String>,
}

const TASKS: &[Task] = &[
    Task {
        name: "tidy",
        arguments: "[--bless]",
        what: "floors, files, manifests and pages obey the rules; --bless updates the hashes in docs/conventions.md",
        run: tidy::task,
    },
    Task {
        name: "dependencies",
        arguments: "",
        what: "dependencies of each published crate: number of packages, licences, duplicate versions",
        run: dependencies::task,
    },
    Task {
        name: "features",
        arguments: "",
        what: "each published crate compiles with each feature alone, with none and with all",
        run: features::task,
    },
    Task {
        name: "examples",
        arguments: "",
        what: "runs the examples of the published crates, each of which has one",
        run: examples::task,
    },
    Task {
        name: "counts",
        arguments: "[--update]",
        what: "instructions of ten kernels by valgrind against benches/counts/counts.txt; a change above 2 % fails",
        run: counts::task,
    },
    Task {
        name: "consume",
        arguments: "[--run]",
        what: "packs the published crates and compiles a project outside the workspace on the packages; --run runs its examples",
        run: consume::task,
    },
    Task {
        name: "fuzz",
        arguments: "[--minutes N] [TARGET]",
        what: "runs the targets of fuzz/ by cargo-fuzz, ten minutes each unless N is given",
        run: fuzz::task,
    },
    Task {
        name: "mutants",
        arguments: "[--sample N] [--seed S] [CRATE]",
        what: "share of small changes of the code that tests notice, by cargo-mutants, in about 300 changes of each crate",
        run: mutants::task,
    },
    Task {
        name: "semver",
        arguments: "",
        what: "changes of the public interfaces since the last tag, by cargo-semver-checks",
        run: semver::task,
    },
    Task {
        name: "report",
        arguments: "[--quick] [--peers] [--builds] [--render] [--against FILE]",
        what: "measures run time against error on an idle machine: docs/performance.md, its plots and numbers, ratios to earlier ones",
        run: report::task,
    },
    Task {
        name: "stress",
        arguments: "--minutes N | --scenes N [--seed S] [--kind NAME]",
        what: "runs random and pathological scenes from new seeds; --kind accuracy writes the table of docs/accuracy.md",
        run: stress::task,
    },
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(name) = arguments.first() else {
        list_tasks();
        return ExitCode::SUCCESS;
    };
    let Some(task) = TASKS.iter().find(|task| task.name == name) else {
        eprintln!("no task `{name}`");
        list_tasks();
        return ExitCode::from(2);
    };
    match (task.run)(&arguments[1..]) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn list_tasks() {
    println!("cargo xtask TASK");
    for task in TASKS {
        let call = format!("{} {}", task.name, task.arguments);
        println!("  {call:<24} {}", task.what);
    }
}
