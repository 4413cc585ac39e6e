"""Times and errors of forward projection of the shell's voxels: ASTRA, RTK, scikit-image. Ours are in the bench `projector`."""
import argparse
import json
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from objects import averages, middle, moved, own_axis, shell, sinogram, times

N, VIEWS = 256, 90
THETA = np.arange(VIEWS) * np.pi / VIEWS


def astra(image):
    """Joseph's method. ASTRA rotates in the opposite direction and counts rows downwards."""
    import astra as toolbox
    geometry = toolbox.create_proj_geom("parallel", 1.0, N, THETA)
    volume = toolbox.create_vol_geom(N, N)
    projector = toolbox.create_projector("linear", geometry, volume)
    source, rays = toolbox.create_sino(np.ascontiguousarray(image[::-1]), projector)
    toolbox.data2d.delete(source)
    toolbox.projector.delete(projector)
    return rays


def scikit_image(image):
    """Rotates the image about pixel n//2 and sums its columns."""
    from skimage.transform import radon
    return radon(image[::-1].astype(float), np.degrees(THETA), circle=True).T


def by_slice(project):
    """Applies a projector to each slice of a stack, with several threads."""
    def of(voxels, threads):
        with ThreadPoolExecutor(threads) as pool:
            return np.stack(list(pool.map(project, voxels)), axis=1)
    return of


def rtk(voxels, threads):
    """Joseph's method for the whole stack, by RTK. Rows count downwards."""
    import itk
    from reconstruction_toolkit import VOLUME, empty, geometry, image, toolkit
    project = toolkit.JosephForwardProjectionImageFilter[VOLUME, VOLUME].New()
    project.SetGeometry(geometry(THETA, threads))
    project.SetInput(0, empty((VIEWS, len(voxels), N)))
    project.SetInput(1, image(voxels[:, ::-1].transpose(1, 0, 2)))
    project.Update()
    return itk.array_from_image(project.GetOutput())


def relative(got, exact):
    """L2 distance after the best common factor, relative to the length."""
    a, b = got.ravel().astype(float), exact.ravel().astype(float)
    return float(np.sqrt(max(0.0, 1 - np.dot(a, b) ** 2 / (np.dot(a, a) * np.dot(b, b)))))


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--threads", type=int, default=2)
    p.add_argument("--repeats", type=int, default=9)
    args = p.parse_args()
    objects, z = shell(), middle(N)
    for tool, project, on_grid, exact in [("astra, linear", by_slice(astra), objects, sinogram),
                                          ("rtk, Joseph", rtk, objects, sinogram),
                                          ("scikit-image", by_slice(scikit_image), moved(objects), own_axis)]:
        voxels = averages(on_grid, N, z)
        # All slices once for the error; a slow tool is timed on 16 of them.
        start = time.perf_counter()
        rays = project(voxels, args.threads)
        seconds = [time.perf_counter() - start]
        few = voxels[N // 2 - 8 : N // 2 + 8] if seconds[0] > 10 else voxels
        for _ in range(args.repeats):
            start = time.perf_counter()
            project(few, args.threads)
            seconds.append((time.perf_counter() - start) * N / len(few))
        for sampling, name in [("centre", "rays through bin centres"), ("mean", "bin means")]:
            row = {"study": "projectors", "method": tool, "case": f"shell, {N} x {N} x {N} from {VIEWS} views, against {name}", "size": VIEWS,
                   "threads": args.threads, **times(seconds[1:]),
                   "error": relative(rays, exact(objects, N, VIEWS, z, sampling)), "error_kind": "relative L2, gain fitted"}
            print("row", json.dumps(row), flush=True)


main()
