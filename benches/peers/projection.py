"""Times and errors of forward projection of the shell's voxels: ASTRA, scikit-image. Ours stand in the bench `projector`."""
import argparse
import json
import statistics
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from objects import averages, middle, moved, own_axis, shell, sinogram

N, VIEWS = 256, 90
THETA = np.arange(VIEWS) * np.pi / VIEWS


def astra(image):
    """Joseph's method. ASTRA turns the other way and counts rows downwards."""
    import astra as toolbox
    geometry = toolbox.create_proj_geom("parallel", 1.0, N, THETA)
    volume = toolbox.create_vol_geom(N, N)
    projector = toolbox.create_projector("linear", geometry, volume)
    source, rays = toolbox.create_sino(np.ascontiguousarray(image[::-1]), projector)
    toolbox.data2d.delete(source)
    toolbox.projector.delete(projector)
    return rays


def scikit_image(image):
    """Turns the image about pixel n//2 and sums its columns."""
    from skimage.transform import radon
    return radon(image[::-1].astype(float), np.degrees(THETA), circle=True).T


def relative(got, exact):
    """L2 distance after the best common factor, relative to the length."""
    a, b = got.ravel().astype(float), exact.ravel().astype(float)
    return float(np.sqrt(max(0.0, 1 - np.dot(a, b) ** 2 / (np.dot(a, a) * np.dot(b, b)))))


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--threads", type=int, default=2)
    p.add_argument("--repeats", type=int, default=3)
    args = p.parse_args()
    objects, z = shell(), middle(N)
    for tool, project, on_grid, exact in [("astra, linear", astra, objects, sinogram),
                                          ("scikit-image", scikit_image, moved(objects), own_axis)]:
        voxels = averages(on_grid, N, z)
        few = range(N // 2 - 8, N // 2 + 8)
        with ThreadPoolExecutor(args.threads) as pool:
            # All slices once for the error; the slow tool is timed on 16 of them.
            start = time.perf_counter()
            rays = np.stack(list(pool.map(project, voxels)), axis=1)
            seconds = [time.perf_counter() - start]
            chosen = few if seconds[0] > 10 else range(N)
            for _ in range(args.repeats):
                start = time.perf_counter()
                list(pool.map(project, voxels[chosen.start:chosen.stop]))
                seconds.append((time.perf_counter() - start) * N / len(chosen))
        for sampling, name in [("centre", "rays through bin centres"), ("mean", "bin means")]:
            row = {"study": "projectors", "method": tool, "case": f"shell, {N} x {N} x {N} from {VIEWS} views, against {name}", "size": VIEWS,
                   "threads": args.threads, "seconds": statistics.median(seconds[1:]),
                   "error": relative(rays, exact(objects, N, VIEWS, z, sampling)), "error_kind": "relative L2, gain fitted"}
            print("row", json.dumps(row), flush=True)


main()
