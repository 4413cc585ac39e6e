"""The program `heart-phantom`: `python -m heart_phantom run scene.toml --out DIR`."""

import sys

from heart_phantom._native import command_line


def main() -> None:
    """Runs the program with the arguments of the process and ends it with the exit code."""
    sys.exit(command_line(["heart-phantom", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
