"""The arrays equal those that the program `heart-phantom` writes for the same scene.

The program is searched in HEART_PHANTOM, then on the path: `cargo build --release -p heart-study` builds it.
"""

import os
import shutil
import subprocess

import numpy as np
import pytest

from heart_phantom import Phantom, Scene

PROGRAM = os.environ.get("HEART_PHANTOM") or shutil.which("heart-phantom")


@pytest.mark.skipif(PROGRAM is None, reason="the program is not here")
def test_the_program_writes_the_same_arrays(tmp_path):
    scene = Scene().with_size(24).replace(
        {"camera.views": 18},
        acquisition={"mode": {"gated": {"gates": 2}}},
        noise={"counts": {"total": 1e5}, "seed": 3},
        output={"write": ["projections", "reconstruction", "truth", "labels", "motion"]},
    )
    file = tmp_path / "scene.toml"
    file.write_text(scene.to_toml())
    subprocess.run([PROGRAM, "run", str(file), "--out", str(tmp_path / "out")], check=True, capture_output=True)
    phantom = Phantom.load(file)
    for gate in range(2):
        phase = phantom.phases()[gate]["phase"]
        for name, array in {
            "projections": phantom.views(gate),
            "reconstruction": phantom.volume(gate),
            "truth": phantom.truth(gate),
            "labels": phantom.labels(phase),
            "displacement": phantom.motion(phase).displacement,
        }.items():
            written = np.load(tmp_path / "out" / f"{name}-gate-{gate:02}.npy")
            np.testing.assert_array_equal(written.reshape(array.shape), array, err_msg=name)
