"""Times and errors of FBP on closed-form sinograms: this crate, FINUFFT, ASTRA, RTK, scikit-image. See README.md."""
import argparse
import json
import os
import pathlib
import subprocess
import tempfile
import time


def arguments():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--ours", required=True, help="path of the built example fbp_raw")
    p.add_argument("--case", choices=["shell", "shepp-logan", "both", "large"], default="both")
    p.add_argument("--sampling", choices=["centre", "mean"], default="centre")
    p.add_argument("--filter", choices=["ram-lak", "hann"], default="ram-lak")
    p.add_argument("--threads", type=int, default=2)
    p.add_argument("--repeats", type=int, default=9)
    p.add_argument("--tools", help="comma-separated; by default all that support the case")
    p.add_argument("--rows", action="store_true", help="print rows for cargo xtask report as well")
    p.add_argument("--json", help="append the rows to this file, one JSON object per line")
    return p.parse_args()


ARGS = arguments()
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = str(ARGS.threads)

import numpy as np  # noqa: E402  (after the thread counts)

from objects import averages, errors, middle, moved, own_axis, shell, shepp_logan, sinogram, times  # noqa: E402


# ---- tools: each returns (seconds of every repeat, images [slice][y][x], scaled)

def timed(run):
    """All repeats, in seconds, after a warm-up run."""
    run()
    seconds = []
    for _ in range(ARGS.repeats):
        start = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - start)
    return seconds


def ours(sino, interpolation="linear", method="auto"):
    n_views, n_slices, n = sino.shape
    with tempfile.TemporaryDirectory() as folder:
        source, target = pathlib.Path(folder, "in.f32"), pathlib.Path(folder, "out.f32")
        sino.astype("<f4").tofile(source)
        command = [ARGS.ours, source, target, n_views, n_slices, n, ARGS.filter, interpolation, "view-slice-bin", ARGS.repeats,
                   ARGS.threads, method]
        out = subprocess.run([str(a) for a in command], check=True, capture_output=True, text=True).stdout
        return list(map(float, out.split())), np.fromfile(target, "<f4").reshape(n_slices, n, n), False


def response(n):
    """The band-limited ramp of length n from its spatial samples, at the n//2 + 1 frequencies of a real FFT."""
    k = np.minimum(np.arange(n), n - np.arange(n))
    odd = k % 2 == 1
    h = np.zeros(n)
    h[0], h[odd] = .25, -1 / (np.pi * k[odd]) ** 2
    frequency = np.arange(n // 2 + 1) / n
    return np.fft.rfft(h).real * (.5 + .5 * np.cos(2 * np.pi * frequency) if ARGS.filter == "hann" else 1)


def finufft(sino, eps=1e-3):
    """Each view's spectrum times the ramp lies on a line through the origin of the image's spectrum; a type-1 transform sums
    them. Two slices form one complex image."""
    import finufft as nufft
    import scipy.fft as fft
    n_views, n_slices, n = sino.shape
    m, theta = 2 * n, np.arange(n_views) * np.pi / n_views
    omega = 2 * np.pi * np.arange(-n, n) / m
    fx, fy = omega[None, :] * np.cos(theta)[:, None], omega[None, :] * np.sin(theta)[:, None]
    half = response(m)
    ramp = np.concatenate([half[:0:-1], half[:-1]])
    # Bins and pixels are counted from (n-1)/2, the transforms from 0 and n/2.
    phase = np.exp(1j * (omega[None, :] * (n - 1) / 2 + .5 * (fx + fy)))
    weight = (ramp * phase * np.pi / n_views / m).astype(np.complex64)
    rows = np.ascontiguousarray(sino.transpose(1, 0, 2))
    if n_slices % 2:
        rows = np.concatenate([rows, np.zeros_like(rows[:1])])
    pairs = len(rows) // 2
    plan = nufft.Plan(1, (n, n), n_trans=pairs, eps=eps, isign=1, dtype="complex64", nthreads=ARGS.threads)
    plan.setpts(fy.astype(np.float32).ravel(), fx.astype(np.float32).ravel())
    images = np.empty((2 * pairs, n, n), np.float32)

    def run():
        spectrum = fft.fftshift(fft.fft(rows[0::2] + 1j * rows[1::2], m, axis=2, workers=ARGS.threads), axes=2) * weight
        spectrum = spectrum.reshape(pairs, -1)
        result = plan.execute(spectrum if pairs > 1 else spectrum[0]).reshape(pairs, n, n)
        images[0::2], images[1::2] = result.real, result.imag
    return timed(run), images[:n_slices], False


def some(sino, at_most=16):
    """Slices that a slow tool is timed on."""
    n = sino.shape[1]
    return list(range(n)) if n <= at_most else list(np.linspace(.3 * n, .7 * n, at_most).astype(int))


def slice_by_slice(sino, reconstruct):
    """All slices once for the error, a few of them for the time."""
    from concurrent.futures import ThreadPoolExecutor
    chosen = some(sino)
    with ThreadPoolExecutor(ARGS.threads) as pool:
        images = np.stack(list(pool.map(lambda i: reconstruct(sino[:, i]), range(sino.shape[1]))))
        seconds = timed(lambda: list(pool.map(lambda i: reconstruct(sino[:, i]), chosen)))
    return [s * sino.shape[1] / len(chosen) for s in seconds], images, len(chosen) < sino.shape[1]


def astra(sino):
    import astra as toolbox
    n_views, _, n = sino.shape
    # ASTRA rotates in the opposite direction and counts rows downwards.
    geometry = toolbox.create_proj_geom("parallel", 1.0, n, np.arange(n_views) * np.pi / n_views)
    volume = toolbox.create_vol_geom(n, n)
    projector = toolbox.create_projector("linear", geometry, volume)

    def reconstruct(rows):
        source = toolbox.data2d.create("-sino", geometry, np.ascontiguousarray(rows))
        target = toolbox.data2d.create("-vol", volume)
        config = toolbox.astra_dict("FBP")
        config.update(ProjectorId=projector, ProjectionDataId=source, ReconstructionDataId=target,
                      option={"FilterType": "ram-lak" if ARGS.filter == "ram-lak" else "hann"})
        algorithm = toolbox.algorithm.create(config)
        toolbox.algorithm.run(algorithm)
        image = toolbox.data2d.get(target)
        toolbox.algorithm.delete(algorithm)
        toolbox.data2d.delete([source, target])
        return image[::-1]
    return slice_by_slice(sino, reconstruct)


def rtk(sino):
    """Rows count downwards."""
    import itk
    from reconstruction_toolkit import VOLUME, empty, geometry, image, toolkit
    n_views, n_slices, n = sino.shape
    turns, rows, found = geometry(np.arange(n_views) * np.pi / n_views, ARGS.threads), image(sino), []

    def run():
        reconstruct = toolkit.FDKConeBeamReconstructionFilter[VOLUME].New()
        reconstruct.SetGeometry(turns)
        reconstruct.SetInput(0, empty((n, n_slices, n)))
        reconstruct.SetInput(1, rows)
        if ARGS.filter == "hann":
            reconstruct.GetRampFilter().SetHannCutFrequency(1.0)
        reconstruct.Update()
        found[:] = [reconstruct.GetOutput()]
    return timed(run), itk.array_from_image(found[0]).transpose(1, 0, 2)[:, ::-1], False


def scikit_image(sino):
    """Rotates about pixel n//2; see own_axis."""
    from skimage.transform import iradon
    n_views, _, n = sino.shape
    theta = np.degrees(np.arange(n_views) * np.pi / n_views)

    def reconstruct(rows):
        return iradon(rows.T, theta, filter_name="ramp" if ARGS.filter == "ram-lak" else "hann", circle=True, preserve_range=True)[::-1]
    return slice_by_slice(sino, reconstruct)


TOOLS = {"ours": ours, "ours-band-limited": lambda s: ours(s, "band-limited"), "ours-direct": lambda s: ours(s, method="direct"),
         "finufft": finufft, "finufft-1e-4": lambda s: finufft(s, 1e-4), "astra": astra, "rtk": rtk, "scikit-image": scikit_image}
SLOW = ["astra", "rtk", "scikit-image"]


def main():
    cases = {"shell": (shell(), 256, 90, middle(256)), "shepp-logan": (shepp_logan(512), 512, 720, np.zeros(1))}
    if ARGS.case == "large":
        cases = {f"shepp-logan {n}": (shepp_logan(n), n, n * 45 // 32, np.zeros(1)) for n in (512, 1024, 2048)}
    print("| case | tool | s | rmse | edge | far inside | far outside | gain |\n|---|---|---|---|---|---|---|---|")
    for case, (objects, n, n_views, z) in cases.items():
        if ARGS.case not in (case, "both", "large"):
            continue
        sino, truth = sinogram(objects, n, n_views, z, ARGS.sampling), averages(objects, n, z)
        # RTK interpolates between slices and gives zero for a single one.
        tools = [tool for tool in TOOLS if (ARGS.case != "large" or tool not in SLOW) and (len(z) > 1 or tool != "rtk")]
        for tool in ARGS.tools.split(",") if ARGS.tools else tools:
            # scikit-image's axis is bin and pixel n//2, half a step from ours: exact data for its own grid.
            if tool == "scikit-image":
                data, against = own_axis(objects, n, n_views, z, ARGS.sampling), averages(moved(objects), n, z)
            else:
                data, against = sino, truth
            seconds, images, scaled = TOOLS[tool](data)
            row = {"case": case, "tool": tool, "filter": ARGS.filter, "sampling": ARGS.sampling, "threads": ARGS.threads,
                   **times(seconds), "scaled": scaled, **errors(np.asarray(images, np.float32), against)}
            show = lambda v: "-" if v is None else f"{v:.5f}"
            print(f"| {case} | {tool} | {row['seconds']:.4f}{'*' if scaled else ''} | {show(row['rmse'])} | {show(row['edge'])} | "
                  f"{show(row['far_inside'])} | {show(row['far_outside'])} | {show(row['gain'])} |", flush=True)
            if ARGS.rows:
                # A smaller error by smoothing is no gain: errors near edges and far from them are separate.
                for part, where in [("rmse", ""), ("edge", ", near edges"), ("far_inside", ", far inside"), ("far_outside", ", far outside")]:
                    if row[part] is None:
                        continue
                    peer = {"study": "FBP", "method": f"{tool}, {ARGS.filter}",
                            "case": f"{case}, {len(z)} x {n} x {n} from {n_views} views{where}", "size": n_views,
                            "threads": ARGS.threads, **times(seconds), "error": row[part],
                            "error_kind": "rms within the circle, gain fitted"}
                    print("row", json.dumps(peer), flush=True)
            if ARGS.json:
                with open(ARGS.json, "a") as f:
                    f.write(json.dumps(row) + "\n")


main()
