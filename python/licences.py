#!/usr/bin/env python3
"""Writes the licence texts of everything that is linked into the wheel:

    python3 python/licences.py [--check]

`LICENCES.txt` names each crate with its version and licence, and contains each text once. The texts are those in the sources of the crates, as
`cargo metadata` lists them for the lock file; of a crate without a text it states the licence. `--check` compares and writes nothing.
"""

import argparse
import json
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
TARGET = HERE / "LICENCES.txt"
PLATFORMS = ["x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu", "x86_64-pc-windows-msvc", "aarch64-apple-darwin"]
IS_TEXT = re.compile(r"^(licen[cs]e|copying|notice|unlicense|copyright)|(-licen[cs]e)", re.IGNORECASE)
RULE = "=" * 79


def metadata():
    command = ["cargo", "metadata", "--format-version=1", "--locked", "--manifest-path", HERE / "Cargo.toml"]
    platforms = [f"--filter-platform={platform}" for platform in PLATFORMS]
    done = subprocess.run([*command, *platforms], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def linked(found):
    """The packages that are compiled into the module: normal dependencies, without procedural macros and build scripts."""
    packages = {package["id"]: package for package in found["packages"]}
    nodes = {node["id"]: node for node in found["resolve"]["nodes"]}
    [root] = [name for name, package in packages.items() if package["name"] == "heart-phantom-python"]
    seen, left = set(), [root]
    while left:
        name = left.pop()
        kinds = {kind for target in packages[name]["targets"] for kind in target["kind"]}
        if name in seen or "proc-macro" in kinds:
            continue
        seen.add(name)
        left += [dep["pkg"] for dep in nodes[name]["deps"] if any(kind["kind"] is None for kind in dep["dep_kinds"])]
    return sorted((packages[name] for name in seen), key=lambda package: (package["name"], package["version"]))


def texts(package):
    """The licence files of a package: in its folder, and beside its data."""
    folder = Path(package["manifest_path"]).parent
    own = package["source"] is None
    places = [folder, *(folder / name for name in ("assets", "data", "LICENSES", "licenses"))]
    files = [file for place in places if place.is_dir() for file in sorted(place.iterdir())]
    if own:
        files += [HERE.parent / "LICENSE-APACHE", HERE.parent / "LICENSE-MIT"]
    named = [file for file in files if file.is_file() and IS_TEXT.search(file.name) and file.suffix not in (".rs", ".toml", ".py") and file != TARGET]
    return [file.read_text(encoding="utf-8", errors="replace").strip() for file in named]


def page():
    users = {}
    lines = ["Licences of the components of heart-phantom for Python.", ""]
    lines += ["The standard library of Rust: MIT OR Apache-2.0 (https://github.com/rust-lang/rust; the texts below apply)"]
    for package in linked(metadata()):
        label = f"{package['name']} {package['version']}"
        licence = package["license"] or "see the text"
        found = texts(package)
        lines.append(f"{label}: {licence}" + ("" if found else " (its source contains no text; the texts below apply)"))
        for text in found:
            key = " ".join(text.split())
            users.setdefault(key, (text, []))[1].append(label)
    for text, labels in sorted(users.values(), key=lambda entry: entry[1]):
        lines += ["", RULE, *labels, RULE, "", *(line.rstrip() for line in text.splitlines())]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="fail if LICENCES.txt is not up to date")
    made = page()
    if not parser.parse_args().check:
        TARGET.write_text(made, encoding="utf-8")
    elif TARGET.read_text(encoding="utf-8") != made:
        sys.exit("python/LICENCES.txt is out of date; run python3 python/licences.py")


if __name__ == "__main__":
    main()
