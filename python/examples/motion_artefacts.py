"""Motion artefacts over heart rates: instantaneous views against views averaged over whole beats.

With one view per second at 60 beats per minute all views have the same phase; at any other rate the views are inconsistent.

python motion_artefacts.py --size 96 --out artefacts.png
"""

import argparse

import matplotlib.pyplot as plt
import numpy as np

from heart_phantom import Phantom, Scene

MODES = {"an instant a view": "instants", "whole beats a view": "whole-cycle"}


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=64, help="bins, rows and voxels per side")
    parser.add_argument("--rates", type=float, nargs="+", default=[55.0, 58.0, 60.0, 62.0, 65.0, 70.0, 75.0])
    parser.add_argument("--out", default="motion_artefacts.png")
    options = parser.parse_args(arguments)

    figure, axes = plt.subplots(2, 1, figsize=(6, 7), sharex=True)
    for name, mode in MODES.items():
        streaks, errors = [], []
        for rate in options.rates:
            scene = Scene().with_size(options.size).replace(
                {"cycle.beats_per_minute": rate, "acquisition.mode": mode}
            )
            phantom = Phantom(scene)
            found = phantom.artefacts(phantom.volume(), phantom.truth())
            streaks.append(found["streaks_outside"])
            errors.append(found["rmse"])
            print(f"{name}, {rate:g}/min: streaks {streaks[-1]:.4f}, rms error {errors[-1]:.4f}")
        axes[0].plot(options.rates, np.array(streaks, dtype=float), "o-", label=name)
        axes[1].plot(options.rates, np.array(errors, dtype=float), "o-", label=name)
    axes[0].set_ylabel("streaks outside the heart, rms")
    axes[1].set_ylabel("rms difference from the ground truth")
    axes[1].set_xlabel("beats per minute, one view per second")
    axes[0].legend()
    figure.tight_layout()
    figure.savefig(options.out, dpi=100)


if __name__ == "__main__":
    main()
