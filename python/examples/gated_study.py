"""A gated study: sixteen gates of a beat, reconstructed, compared with the ground truth of the voxels.

python gated_study.py --size 128 --gates 16 --out gated.png
"""

import argparse

import matplotlib.pyplot as plt
import numpy as np

from heart_phantom import Phantom, Scene


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=96, help="bins, rows and voxels per side")
    parser.add_argument("--gates", type=int, default=8)
    parser.add_argument("--out", default="gated_study.png")
    options = parser.parse_args(arguments)

    scene = Scene().with_size(options.size)
    scene = scene.replace(
        acquisition={"mode": {"gated": {"gates": options.gates}}},
        noise={"counts": {"total": 2e6}, "seed": 1},
        reconstruction={"window": "hann"},
    )
    phantom = Phantom(scene)
    views = phantom.views_of_gates()  # [gate][view][row][bin]
    truth = phantom.truth_of_gates()  # [gate][z][y][x]

    middle = options.size // 2
    shown = np.linspace(0, options.gates, min(options.gates, 4), endpoint=False).astype(int)
    figure, axes = plt.subplots(3, len(shown), figsize=(2.6 * len(shown), 7.5), squeeze=False)
    for column, gate in zip(axes.T, shown):
        volume = phantom.reconstruct(views[gate], gate)
        error = np.sqrt(np.mean((volume - truth[gate]) ** 2))
        column[0].imshow(views[gate, 0], cmap="gray", origin="lower")
        column[0].set_title(f"gate {gate}: view 0")
        column[1].imshow(volume[middle], cmap="gray", origin="lower", vmin=0, vmax=1.2)
        column[1].set_title(f"image, rms error {error:.3f}")
        column[2].imshow(truth[gate, middle], cmap="gray", origin="lower", vmin=0, vmax=1.2)
        column[2].set_title("truth")
    for one in axes.flat:
        one.set_axis_off()
    figure.tight_layout()
    figure.savefig(options.out, dpi=100)
    print(f"{phantom!r}\nwritten to {options.out}")


if __name__ == "__main__":
    main()
