//! Signals that end the program: temporary files are removed first.

use heart_phantom::files;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXCPU, SIGXFSZ};
use signal_hook::iterator::Signals;
use signal_hook::{flag, low_level};
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::{fs, io, thread};

/// Closed terminal, Ctrl-C, `kill`, and the processor time limit of batch systems.
const ENDING: [i32; 4] = [SIGHUP, SIGINT, SIGTERM, SIGXCPU];

/// Starts the thread that waits for signals and then prints a note.
pub(crate) fn watch(note: Option<&'static str>) -> io::Result<()> {
    // A file beyond the size limit of the system is then a write error, like a full disk. The flag is unused.
    flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))?;
    let mut signals = Signals::new(ENDING.into_iter().filter(|&signal| !is_ignored(signal)))?;
    thread::Builder::new()
        .name("signals".into())
        .spawn(move || {
            for signal in signals.forever() {
                let _held = files::remove_unfinished();
                if let Some(note) = note {
                    let _ = writeln!(io::stderr(), "{note}");
                }
                // The process ends by the signal itself, so that shells and batch systems detect it.
                if low_level::emulate_default_handler(signal).is_err() {
                    low_level::exit(128 + signal);
                }
            }
        })
        .map(drop)
}

/// Returns whether the signal was ignored by the parent process, as with `nohup`. Where the system does not report it, only a
/// closed terminal counts as ignored.
fn is_ignored(signal: i32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = (status.lines())
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    match mask {
        Some(mask) => mask >> (signal - 1) & 1 == 1,
        None => signal == SIGHUP,
    }
}
