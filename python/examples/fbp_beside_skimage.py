"""FBP of user data compared with scikit-image: time and error on ellipses with known line integrals.

NumPy computes the data; both programs receive the same sinogram. Values of ellipses add up, and images are compared with their
means over pixels.

python fbp_beside_skimage.py --size 256 --out fbp.png
"""

import argparse
import time

import matplotlib.pyplot as plt
import numpy as np
from skimage.transform import iradon

from heart_phantom import radon

# Value, centre, half axes, angle: a head with two ventricles and a tumour; lengths in halves of the image.
ELLIPSES = [
    (1.0, 0.0, 0.0, 0.7, 0.9, 0.0),
    (-0.6, -0.22, 0.05, 0.12, 0.35, 0.3),
    (-0.6, 0.25, 0.05, 0.10, 0.30, -0.3),
    (0.4, 0.1, -0.55, 0.08, 0.05, 0.0),
]


def sinogram_of(angles, bins, radius):
    """Line integrals [view][bin] of the ellipses, in closed form."""
    total = np.zeros((len(angles), len(bins)))
    for value, x, y, a, b, turn in ELLIPSES:
        a, b = a * radius, b * radius
        cos, sin = np.cos(angles - turn), np.sin(angles - turn)
        square = ((a * cos) ** 2 + (b * sin) ** 2)[:, None]
        centre = radius * (x * np.cos(angles) + y * np.sin(angles))
        s = bins[None, :] - centre[:, None]
        total += value * 2 * a * b / square * np.sqrt(np.maximum(square - s**2, 0))
    return total


def image_of(n, radius, fine=8):
    """Means over pixels [y][x], each from fine x fine points."""
    at = (np.arange(n * fine) - (n * fine - 1) / 2) / fine
    total = np.zeros((n * fine, n * fine))
    for value, x, y, a, b, turn in ELLIPSES:
        dx, dy = at[None, :] - x * radius, at[:, None] - y * radius
        along = dx * np.cos(turn) + dy * np.sin(turn)
        across = dy * np.cos(turn) - dx * np.sin(turn)
        total += value * ((along / (a * radius)) ** 2 + (across / (b * radius)) ** 2 <= 1)
    return total.reshape(n, fine, n, fine).mean(axis=(1, 3))


def timed(make, times=3):
    """The result, and the smallest time in seconds."""
    seconds = []
    for _ in range(times):
        start = time.perf_counter()
        made = make()
        seconds.append(time.perf_counter() - start)
    return made, min(seconds)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=256, help="bins, and pixels per side")
    parser.add_argument("--views", type=int, default=None, help="by default as many as bins")
    parser.add_argument("--out", default="fbp_beside_skimage.png")
    options = parser.parse_args(arguments)

    n, n_views = options.size, options.views or options.size
    geometry = radon.Geometry.half_turn(n_views, n)
    sinogram = sinogram_of(geometry.angles, geometry.bins, n / 2 - 1).astype(np.float32)
    truth = image_of(n, n / 2 - 1)

    plan, planned = timed(lambda: radon.FbpPlan(geometry, radon.Grid.square(n)))
    ours, our_time = timed(lambda: plan.reconstruct(sinogram))

    # scikit-image has [bin][view], degrees, rows downwards, and its centre in pixel n // 2: for an even n half a pixel from ours.
    odd = n + 1 - n % 2
    shifted = np.arange(odd) - odd // 2
    own = sinogram_of(geometry.angles, shifted.astype(float), n / 2 - 1).astype(np.float32)
    degrees = np.rad2deg(geometry.angles)
    theirs, their_time = timed(
        lambda: iradon(own.T, theta=degrees, filter_name="ramp", circle=True, output_size=own.shape[1])
    )
    their_truth = image_of(own.shape[1], n / 2 - 1)

    def error(image, exact):
        at = np.arange(len(exact)) - (len(exact) - 1) / 2
        inside = at[:, None] ** 2 + at[None, :] ** 2 < (0.9 * n / 2) ** 2
        return float(np.sqrt(np.mean((image - exact)[inside] ** 2)))

    results = {
        "heart_phantom": (ours, our_time, error(ours, truth)),
        "scikit-image": (theirs[::-1], their_time, error(theirs[::-1], their_truth)),
    }
    print(f"{n_views} views of {n} bins; a plan takes {1e3 * planned:.1f} ms, once")
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.6))
    for one, (name, (image, seconds, rms)) in zip(axes, results.items()):
        print(f"{name:14} {1e3 * seconds:8.1f} ms   rms error {rms:.4f}")
        one.imshow(image, cmap="gray", origin="lower", vmin=0, vmax=1.2)
        one.set_title(f"{name}: {1e3 * seconds:.1f} ms, rms error {rms:.4f}")
        one.set_axis_off()
    figure.tight_layout()
    figure.savefig(options.out, dpi=100)
    return results


if __name__ == "__main__":
    main()
