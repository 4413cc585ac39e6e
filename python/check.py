#!/usr/bin/env python3
"""All checks of the Python package, in an empty environment:

    python3 python/check.py [--environment DIR]

Builds a wheel, installs it, and runs the tests: those of the arrays, the docstrings and the README's examples, the scripts in `examples`,
mypy and the stubs. Needs a Rust toolchain and a package index. If HEART_PHANTOM is set, results are compared with that program.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
MOST_MEGABYTES = 10


def run(*command, **options):
    print("===", " ".join(map(str, command)), flush=True)
    subprocess.run(list(map(str, command)), check=True, **options)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--environment", type=Path, help="kept and reused; a temporary one by default")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        environment = options.environment or Path(scratch) / "environment"
        python = environment / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        if not python.exists():
            venv.create(environment, with_pip=True)
        wheels = Path(scratch) / "wheels"
        run(python, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", wheels, HERE)
        [wheel] = wheels.glob("*.whl")
        megabytes = wheel.stat().st_size / 1e6
        print(f"{wheel.name}: {megabytes:.1f} MB")
        if megabytes > MOST_MEGABYTES:
            sys.exit(f"the wheel is larger than {MOST_MEGABYTES} MB")
        run(python, "-m", "pip", "install", "--quiet", "--force-reinstall", f"{wheel}[test]")
        # Not from the folder of the sources: the installed package is tested.
        run(python, "-m", "pytest", "-q", "-c", HERE / "pyproject.toml", HERE / "tests", cwd=scratch)


if __name__ == "__main__":
    main()
