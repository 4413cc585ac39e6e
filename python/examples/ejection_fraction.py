"""The exact ejection fraction, and its measurement by counting the voxels of the cavity in each gate.

python ejection_fraction.py --size 128 --out ef.png
"""

import argparse

import matplotlib.pyplot as plt
import numpy as np

from heart_phantom import Phantom, Scene


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=96, help="bins, rows and voxels per side")
    parser.add_argument("--gates", type=int, default=8)
    parser.add_argument("--out", default="ejection_fraction.png")
    options = parser.parse_args(arguments)

    scene = Scene().with_size(options.size).replace(
        {"heart.inner.radius": 1.3, "heart.outer.radius": 2.4},
        cycle={"curve": "physiological", "volume": {"volumes": {"edv": 130.0, "esv": 52.0}}},
        acquisition={"mode": {"gated": {"gates": options.gates}}},
        # Active blood: its volume is that of the bright voxels.
        activity={"cavity": {"concentration": 1.0}, "wall": {"concentration": 0.0}},
        reconstruction={"window": "hann"},
    )
    phantom = Phantom(scene)
    numbers = phantom.numbers()
    millilitres = float(np.prod(phantom.spacing))

    middles = (np.arange(options.gates) + 0.5) / options.gates
    exact = phantom.truth_of_gates().sum(axis=(1, 2, 3), dtype=np.float64) * millilitres
    views = phantom.views_of_gates()
    counted = np.array(
        [
            np.count_nonzero(phantom.reconstruct(views[gate], gate) > 0.5) * millilitres
            for gate in range(options.gates)
        ]
    )

    def ejected(volumes):
        return (volumes.max() - volumes.min()) / volumes.max()

    print(f"ejection fraction, of the beat itself:   {numbers['ejection_fraction']:.4f}")
    print(f"  of the mean volumes of {options.gates} gates:      {ejected(exact):.4f}")
    print(f"  of voxels above half in their images:  {ejected(counted):.4f}")

    phases = np.linspace(0, 1, 201)
    figure, axes = plt.subplots(figsize=(6, 4))
    axes.plot(phases, phantom.cavity_volumes(phases), label="exact")
    axes.plot(middles, exact, "o", label="exact, mean over the gate")
    axes.plot(middles, counted, "x", label="voxels above half in the image")
    axes.set_xlabel("phase of the beat")
    axes.set_ylabel("volume of the cavity / mL")
    axes.legend()
    figure.tight_layout()
    figure.savefig(options.out, dpi=100)


if __name__ == "__main__":
    main()
