//! `cargo xtask report`: measures run time against error and writes docs/performance.md.
//!
//! The benches of `benches` and `benches-heart` print rows when called with `--rows`; this runs them on an idle machine and writes
//! docs/performance.json, the page, and its plots under docs/img. It prints the ratios to the earlier rows of docs/performance.json, or to
//! those of another such file. `--render` writes the page from docs/performance.json without a measurement; `--quick` measures a few
//! rows, prints the ratios and writes nothing.

mod against;
mod building;
mod machine;
mod page;
mod peers;
mod plot;
mod rows;

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::workspace::root;
use against::Earlier;
use machine::Machine;
use rows::{Measured, Row, parse};

/// Benches that print rows, in the order of their studies on the page.
const BENCHES: &[(&str, &str)] = &[
    ("benches-heart", "membrane"),
    ("benches-heart", "motion"),
    ("benches-heart", "revolve"),
    ("benches", "radon"),
    ("benches", "slices"),
    ("benches-heart", "projector"),
    ("benches", "spect"),
    ("benches-heart", "phantom"),
];

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    let Given {
        quick,
        peers,
        builds,
        render,
        against,
    } = Given::parse(arguments)?;
    let root = root();
    let kept = root.join("docs/performance.json");
    let earlier = match against {
        Some(path) => Some(Earlier::read(Path::new(&path))?),
        None if kept.exists() => Some(Earlier::read(&kept)?),
        None => None,
    };
    if render {
        let Measured { machine, rows } = Measured::read(&kept)?;
        return write(&root.join("docs"), machine, rows, builds);
    }
    let machine = Machine::here(&root)?;
    if !quick {
        machine.check_idle()?;
    }
    let mut rows = Vec::new();
    for (package, bench) in BENCHES {
        println!("{bench}");
        rows.extend(run_bench(&root, package, bench, quick)?);
    }
    if peers {
        println!("peers");
        rows.extend(peers::rows(&root, quick)?);
    }
    if let Some(earlier) = earlier {
        print!("{}", earlier.beside(&rows));
    }
    if quick {
        return Ok(());
    }
    println!("{} rows in docs/performance.json", rows.len());
    for row in rows.iter().filter(|row| !row.is_steady()) {
        let Row {
            study,
            method,
            case,
            size,
            threads,
            ..
        } = row;
        println!(
            "spread {:.0} %: {study}, {case}, {method}, {size}, {threads} threads",
            100.0 * row.spread()
        );
    }
    write(&root.join("docs"), machine, rows, builds)
}

/// The arguments of the task.
#[derive(Debug, Default, PartialEq)]
struct Given {
    quick: bool,
    peers: bool,
    builds: bool,
    render: bool,
    against: Option<String>,
}

impl Given {
    fn parse(arguments: &[String]) -> Result<Self, String> {
        let mut given = Self::default();
        let mut rest = arguments.iter();
        while let Some(argument) = rest.next() {
            match argument.as_str() {
                "--quick" => given.quick = true,
                "--peers" => given.peers = true,
                "--builds" => given.builds = true,
                "--render" => given.render = true,
                "--against" => {
                    let file = rest.next().ok_or("--against needs a file")?;
                    given.against = Some(file.clone());
                }
                other => {
                    return Err(format!(
                        "`{other}`? usage: cargo xtask report [--quick] [--peers] [--builds] [--render] [--against FILE]"
                    ));
                }
            }
        }
        Ok(given)
    }
}

fn run_bench(root: &Path, package: &str, bench: &str, quick: bool) -> Result<Vec<Row>, String> {
    let mut command = Command::new(env!("CARGO"));
    command
        .args(["bench", "--quiet", "--package", package, "--bench", bench])
        .args((package == "benches-heart").then_some("--features=rivals"))
        .args(["--", "--rows"])
        .args(quick.then_some("--quick"))
        .current_dir(root);
    let printed = output(&mut command)?;
    let rows = parse(&printed)?;
    if rows.is_empty() {
        return Err(format!("the bench {bench} printed no rows"));
    }
    Ok(rows)
}

/// Returns the output of a command; its errors go to the terminal.
fn output(command: &mut Command) -> Result<String, String> {
    let name = format!("{command:?}");
    let done = command
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("{name}: {error}"))?;
    if !done.status.success() {
        return Err(format!("{name}: {}", done.status));
    }
    String::from_utf8(done.stdout).map_err(|error| format!("{name}: {error}"))
}

/// Writes the page, its plots and its numbers to `docs`; build times are measured, or those of the older page are kept.
fn write(docs: &Path, machine: Machine, rows: Vec<Row>, builds: bool) -> Result<(), String> {
    let put = |name: &str, text: &str| {
        let path = docs.join(name);
        fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))
    };
    let older = fs::read_to_string(docs.join("performance.md")).unwrap_or_default();
    let building = match builds {
        true => building::measured(&root(), &machine)?,
        false => building::kept(&older).to_owned(),
    };
    fs::create_dir_all(docs.join("img")).map_err(|error| format!("docs/img: {error}"))?;
    for group in page::shown(&rows) {
        put(&format!("img/{}", group.file()), &plot::svg(&group)?)?;
    }
    put(
        "performance.md",
        &(page::markdown(&rows, &machine) + &building),
    )?;
    put("performance.json", &Measured { machine, rows }.json()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRINTED: &str = r#"
some other line
row {"study":"motion","method":"a, fast","case":"balloon at f = 17.5 to t = 5, 101 nodes","size":10,"threads":1,"seconds":1e-3,"least":1e-3,"repeats":9,"error":1e-2,"error_kind":"cm"}
row {"study":"motion","method":"a, fast","case":"balloon at f = 17.5 to t = 5, 101 nodes","size":20,"threads":1,"seconds":2e-3,"least":2e-3,"repeats":9,"error":0.0,"error_kind":"cm"}
row {"study":"motion","method":"diffsol","case":"balloon at f = 17.5 to t = 5, 101 nodes","size":10,"threads":2,"seconds":4e-3,"least":3e-3,"repeats":9,"error":1e-3,"error_kind":"cm"}
row {"study":"voxels","method":"centre","case":"a wall","size":64,"threads":1,"seconds":0.5,"least":0.5,"repeats":9,"error":1e-2,"error_kind":"rms"}
at error 1e-2 ours 1 ms
"#;

    #[test]
    fn rows_become_a_page_plots_and_json() {
        let rows = parse(PRINTED).unwrap();
        assert_eq!(rows.len(), 4);
        assert_eq!((rows[1].method.as_str(), rows[1].size), ("a, fast", 20));
        let docs = std::env::temp_dir().join(format!("xtask-report-{}", std::process::id()));
        write(&docs, Machine::example(), rows, false).unwrap();
        let read = |name: &str| fs::read_to_string(docs.join(name)).unwrap();
        let page = read("performance.md");
        for wanted in [
            "## Follow a motion",
            "| a, fast | 10 | 1 | 1.00 ms | 0 % | 1.0e-2 |",
            "| diffsol | 10 | 2 | 4.00 ms | **33 %** | 1.0e-3 |",
            "img/performance-motion-balloon-at-f-17-5-to-t-5-101-nodes.svg",
            "abc1234",
        ] {
            assert!(page.contains(wanted), "{wanted} in\n{page}");
        }
        let measured = Measured::read(&docs.join("performance.json")).unwrap();
        assert_eq!(measured.rows.len(), 4);
        assert_eq!(measured.rows[3].error_kind, "rms");
        assert_eq!(measured.machine.commit, "abc1234");
        let svg = read("img/performance-motion-balloon-at-f-17-5-to-t-5-101-nodes.svg");
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("seconds") && svg.contains("cm"));
        // a point for each row with a positive error, and one for each method
        assert_eq!(svg.matches("<circle").count(), 2 + 2, "{svg}");
        fs::remove_dir_all(docs).unwrap();
    }

    #[test]
    fn arguments_are_parsed_or_rejected() {
        let read = |line: &str| {
            let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
            Given::parse(&words)
        };
        assert_eq!(read("").unwrap(), Given::default());
        let all = read("--peers --builds --render --against old.json --quick").unwrap();
        assert!(
            all.quick
                && all.peers
                && all.builds
                && all.render
                && all.against.as_deref() == Some("old.json")
        );
        assert!(read("--against").is_err() && read("--fast").is_err());
    }

    #[test]
    fn broken_rows_are_rejected() {
        for broken in [
            "row {}",
            "row not json",
            r#"row {"study":"a","method":"b","case":"c","size":1,"threads":1,"seconds":1.0,"least":-1.0,"repeats":9,"error":0.1,"error_kind":"d"}"#,
            r#"row {"study":"a","method":"b","case":"c","size":1,"threads":1,"seconds":1.0,"least":1.0,"repeats":9,"error":null,"error_kind":"d"}"#,
        ] {
            assert!(parse(broken).is_err(), "{broken}");
        }
    }
}
