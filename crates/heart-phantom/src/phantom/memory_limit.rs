//! The memory that the operating system can give a process.

use std::path::Path;

/// Returns the memory in bytes that Linux can give this process: the least of physical memory with swap, the limits of its control groups and
/// the rest of the address space. `None` if unknown.
pub(super) fn memory_limit() -> Option<u64> {
    let value = |text: &str, name: &str| -> Option<u64> {
        let line = text.lines().find_map(|line| line.strip_prefix(name));
        number(line?)
    };
    let memory = read("/proc/meminfo");
    let physical = value(&memory, "MemTotal:")
        .map(|kib| kib.saturating_add(value(&memory, "SwapTotal:").unwrap_or(0)) << 10);
    let group = limit_of_groups(&read("/proc/self/cgroup"), Path::new("/sys/fs/cgroup"));
    let used = value(&read("/proc/self/status"), "VmSize:").unwrap_or(0) << 10;
    let address = value(&read("/proc/self/limits"), "Max address space")
        .map(|limit: u64| limit.saturating_sub(used));
    [physical, group, address].into_iter().flatten().min()
}

/// Returns the least limit of some control groups and of all that contain them. A line is `0::/path` (version 2) or `4:memory:/path` (version 1).
pub(super) fn limit_of_groups(groups: &str, root: &Path) -> Option<u64> {
    let limits = groups.lines().filter_map(|line| {
        let [_, controllers, path] = line.splitn(3, ':').collect::<Vec<_>>()[..] else {
            return None;
        };
        let (top, file) = match controllers {
            "" => (root.to_path_buf(), "memory.max"),
            names if names.split(',').any(|name| name == "memory") => {
                (root.join("memory"), "memory.limit_in_bytes")
            }
            _ => return None,
        };
        let own = top.join(path.trim_start_matches('/'));
        let groups = own.ancestors().take_while(|group| group.starts_with(&top));
        groups
            .filter_map(|group| number(&read(group.join(file))))
            .min()
    });
    limits.min()
}

/// Returns the content of a file, empty if there is none.
fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(path).unwrap_or_default()
}

/// Returns the first number of a text.
fn number(text: &str) -> Option<u64> {
    text.split_whitespace().find_map(|word| word.parse().ok())
}
