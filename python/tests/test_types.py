"""The stubs: their check by mypy, and their agreement with the package."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mypy")
HERE = Path(__file__).resolve().parent


def run(*arguments, cwd):
    done = subprocess.run([sys.executable, "-m", *arguments], cwd=cwd, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def test_typed_use_is_accepted_and_misuse_is_not(tmp_path):
    code, said = run("mypy", "--strict", str(HERE / "typed_use.py"), cwd=tmp_path)
    assert code == 0, said
    misuse = tmp_path / "misuse.py"
    misuse.write_text(
        "from heart_phantom import Phantom, radon\n"
        "Phantom(3)\n"
        "Phantom().views(gate='a')\n"
        "radon.FbpPlan(radon.Geometry.half_turn(3, 4), radon.Grid.square(4), edge='none')\n"
        "Phantom().numbers()['efd']\n"
    )
    code, said = run("mypy", "--strict", str(misuse), cwd=tmp_path)
    assert code == 1
    for line in (2, 3, 4, 5):
        assert f"misuse.py:{line}: error" in said, said


def test_the_stubs_agree_with_the_package(tmp_path):
    # torch is optional.
    config = tmp_path / "mypy.ini"
    config.write_text("[mypy]\n[mypy-torch.*]\nignore_missing_imports = True\n")
    code, said = run("mypy.stubtest", "heart_phantom", "--mypy-config-file", str(config), cwd=tmp_path)
    assert code == 0, said
