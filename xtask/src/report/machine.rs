//! The machine of the measurements.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde::{Deserialize, Serialize};

use super::output;

/// Largest load average of the last minute for measurements of times.
const IDLE: f64 = 0.3;

/// Processor, load, compiler, date and commit of a run.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Machine {
    pub(super) processor: String,
    pub(super) threads: usize,
    /// Average number of runnable processes in the minute before, or `unknown`.
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

    /// Rejects a machine with other work, because its times would be wrong.
    pub(super) fn check_idle(&self) -> Result<(), String> {
        match self.load.parse::<f64>() {
            Ok(load) if load > IDLE => Err(format!(
                "load is {load}; it must be at most {IDLE}: times beside other work are not published (--quick measures anyway, and writes nothing)"
            )),
            _ => Ok(()),
        }
    }

    #[cfg(test)]
    pub(super) fn example() -> Self {
        Self {
            processor: "a processor".into(),
            threads: 2,
            load: "0.1".into(),
            compiler: "rustc 1".into(),
            date: "2000-01-01".into(),
            commit: "abc1234".into(),
        }
    }
}
