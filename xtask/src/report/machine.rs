//! What the numbers were measured on.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::output;

/// Processor, load, compiler, date and commit of a run.
pub(super) struct Machine {
    pub(super) processor: String,
    pub(super) threads: usize,
    /// Processes that wanted to run in the minute before, or `unknown`.
    pub(super) load: String,
    pub(super) compiler: String,
    pub(super) date: String,
    pub(super) commit: String,
}

impl Machine {
    pub(super) fn here(root: &Path) -> Result<Self, String> {
        let git = |arguments: &[&str]| {
            let mut command = Command::new("git");
            output(command.args(arguments).current_dir(root)).map(|text| text.trim().to_owned())
        };
        let mut commit = git(&["rev-parse", "--short", "HEAD"])?;
        if !git(&["status", "--porcelain", "--untracked-files=no"])?.is_empty() {
            commit += " with changes";
        }
        let unknown = || String::from("unknown");
        let information = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let processor = information
            .lines()
            .find_map(|line| line.strip_prefix("model name")?.split_once(':'))
            .map_or_else(unknown, |(_, name)| name.trim().to_owned());
        let load = fs::read_to_string("/proc/loadavg").ok();
        let load = load.and_then(|text| text.split(' ').next().map(str::to_owned));
        let mut rustc = Command::new("rustc");
        let mut date = Command::new("date");
        Ok(Self {
            processor,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            load: load.unwrap_or_else(unknown),
            compiler: output(rustc.arg("--version"))?.trim().to_owned(),
            date: output(date.args(["-u", "+%Y-%m-%d %H:%M UTC"]))?
                .trim()
                .to_owned(),
            commit,
        })
    }
}
