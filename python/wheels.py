#!/usr/bin/env python3
"""Builds the files for a package index, and checks them:

    python3 python/wheels.py --out DIR [--environment DIR] [--no-sdist]

On Linux a wheel for glibc 2.28 and later (manylinux_2_28), linked by Zig, so that it does not depend on the glibc of this machine; elsewhere
the wheel of the platform; and the sdist. Needs a Rust toolchain and a package index. A release workflow calls it once per platform.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
TOOLS = ["auditwheel", "check-wheel-contents", "maturin>=1.9,<2", "twine"]
COMPATIBILITY = "manylinux_2_28"


def run(*command, **options):
    print("===", " ".join(map(str, command)), flush=True)
    return subprocess.run(list(map(str, command)), check=True, **options)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="directory of the wheel and the sdist")
    parser.add_argument("--environment", type=Path, help="kept and reused; a temporary one by default")
    parser.add_argument("--no-sdist", action="store_true", help="only the wheel")
    options = parser.parse_args()
    linux = sys.platform == "linux"
    run(sys.executable, HERE / "licences.py", "--check")
    with tempfile.TemporaryDirectory() as scratch:
        environment = options.environment or Path(scratch) / "environment"
        programs = environment / ("Scripts" if os.name == "nt" else "bin")
        if not programs.is_dir():
            venv.create(environment, with_pip=True)
        run(programs / "python", "-m", "pip", "install", "--quiet", *TOOLS, *(["ziglang"] if linux else []))
        path = os.pathsep.join([str(programs), os.environ["PATH"]])
        build = [programs / "maturin", "build", "--release", "--locked", "--manifest-path", HERE / "Cargo.toml", "--out", options.out]
        build += ["--compatibility", COMPATIBILITY, "--zig"] if linux else []
        build += [] if options.no_sdist else ["--sdist"]
        run(*build, env={**os.environ, "PATH": path})
        made = sorted(options.out.glob("heart_phantom-*"))
        run(programs / "twine", "check", "--strict", *made)
        for wheel in (file for file in made if file.suffix == ".whl"):
            run(programs / "check-wheel-contents", wheel)
            if linux:
                shown = run(programs / "auditwheel", "show", wheel, capture_output=True, text=True).stdout
                print(shown)
                if COMPATIBILITY not in shown.replace("\n", " "):
                    sys.exit(f"{wheel.name} is not {COMPATIBILITY}")


if __name__ == "__main__":
    main()
