//! Other software on the same inputs: a virtual environment, and the scripts of benches/peers.

use std::path::Path;
use std::process::Command;

use super::output;
use super::rows::{Row, parse};

/// Installs benches/peers/requirements.txt under target/, once, and runs the scripts.
pub(super) fn rows(root: &Path, quick: bool) -> Result<Vec<Row>, String> {
    let peers = root.join("benches/peers");
    let environment = root.join("target/peers");
    let python = environment.join("bin/python");
    if !python.is_file() {
        let mut venv = Command::new("python3");
        output(venv.args(["-m", "venv"]).arg(&environment))?;
    }
    let mut pip = Command::new(&python);
    output(
        pip.args(["-m", "pip", "install", "--quiet", "--requirement"])
            .arg(peers.join("requirements.txt")),
    )?;
    let mut rows = Vec::new();
    for script in ["solve_bvp.py", "rubber.py"] {
        let mut bvp = Command::new(&python);
        rows.extend(parse(&output(bvp.arg(peers.join(script)))?)?);
    }

    // The scripts measure our FBP on their input with this example.
    let mut build = Command::new(env!("CARGO"));
    output(
        build
            .args(["build", "--quiet", "--release", "--package", "benches"])
            .args(["--example", "fbp_raw"])
            .current_dir(root),
    )?;
    for threads in ["1", "2"] {
        let mut fbp = Command::new(&python);
        fbp.arg(peers.join("tomography.py"))
            .arg("--ours")
            .arg(root.join("target/release/examples/fbp_raw"))
            .args(["--threads", threads, "--rows"]);
        if quick {
            fbp.args(["--case", "shepp-logan", "--repeats", "1"]);
        }
        if threads == "1" {
            // the others take minutes, and are shown by two threads
            fbp.args([
                "--tools",
                "ours,ours-band-limited,ours-direct,finufft,finufft-1e-4",
            ]);
        }
        rows.extend(parse(&output(&mut fbp)?)?);
        if !quick {
            let mut large = Command::new(&python);
            large
                .arg(peers.join("tomography.py"))
                .arg("--ours")
                .arg(root.join("target/release/examples/fbp_raw"))
                .args(["--threads", threads, "--rows", "--case", "large"]);
            rows.extend(parse(&output(&mut large)?)?);
        }
    }
    if !quick {
        let mut projection = Command::new(&python);
        projection.arg(peers.join("projection.py"));
        rows.extend(parse(&output(&mut projection)?)?);
    }
    Ok(rows)
}
