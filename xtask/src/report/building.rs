//! Build times from an empty folder.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Instant;
use std::{env, fs, process};

use super::machine::Machine;
use super::output;

/// Heading of the section, the last one of the page.
const HEADING: &str = "\n## Build the workspace\n";

/// Builds: name and cargo arguments.
const BUILDS: [(&str, &[&str]); 3] = [
    (
        "the library heart-phantom",
        &["build", "--release", "-p", "heart-phantom", "--lib"],
    ),
    (
        "the program heart-phantom",
        &["build", "--release", "-p", "heart-study"],
    ),
    ("every test", &["test", "--workspace", "--no-run"]),
];

/// Returns the section of an older page; empty if there is none.
pub(super) fn kept(page: &str) -> &str {
    page.find(HEADING).map_or("", |at| &page[at..])
}

/// Measures the section: each build in an empty folder of its own.
pub(super) fn measured(root: &Path, machine: &Machine) -> Result<String, String> {
    let Machine {
        processor,
        threads,
        compiler,
        date,
        commit,
        ..
    } = machine;
    let mut section = format!(
        "{HEADING}\nClean builds, including all dependencies, on {date} at commit {commit}. {processor}, {threads} hardware threads, {compiler}.\n\n\
         | target | command | wall time | processor time |\n| --- | --- | ---: | ---: |\n"
    );
    let folder = env::temp_dir().join(format!("xtask-building-{}", process::id()));
    for (what, arguments) in BUILDS {
        let (before, clock) = (processor_seconds()?, Instant::now());
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(arguments).current_dir(root);
        let built = output(cargo.env("CARGO_TARGET_DIR", &folder));
        let (wall, spent) = (clock.elapsed().as_secs_f64(), processor_seconds()? - before);
        fs::remove_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        built?;
        let command = arguments.join(" ");
        // Writing to a String never fails.
        let _ = writeln!(
            section,
            "| {what} | `cargo {command}` | {wall:.0} s | {spent:.0} s |"
        );
    }
    Ok(section)
}

/// Returns the processor time of ended child processes on Linux: hundredths of a second, the 16th and 17th number of the process.
fn processor_seconds() -> Result<f64, String> {
    let stat = fs::read_to_string("/proc/self/stat").map_err(|error| format!("stat: {error}"))?;
    // The process name in brackets may contain anything; the third number follows it.
    let (_, numbers) = stat.rsplit_once(')').ok_or("stat: no name")?;
    let ticks = numbers.split_whitespace().skip(13).take(2);
    let ticks: Vec<f64> = ticks.filter_map(|ticks| ticks.parse().ok()).collect();
    Ok(ticks.iter().sum::<f64>() / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_section_of_an_older_page_is_kept() {
        let section = format!("{HEADING}\nClean builds.\n");
        assert_eq!(kept(&format!("# Page\n\n## motion\n{section}")), section);
        assert_eq!(kept("# Page\n\n## motion\n"), "");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn commands_are_counted_once_they_have_ended() {
        let before = processor_seconds().unwrap();
        let mut shell = Command::new("sh");
        output(shell.args(["-c", "i=0; while [ $i -lt 300000 ]; do i=$((i+1)); done"])).unwrap();
        assert!(processor_seconds().unwrap() > before);
    }
}
