"""The objects of the comparison: closed-form sinograms, averages over pixels, the errors of an image, and the time of a row."""
import numpy as np


def times(seconds):
    """The fields of a row for repeated runs: median, minimum, number."""
    return {"seconds": float(np.median(seconds)), "least": float(np.min(seconds)), "repeats": len(seconds)}


def turn(about, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return {"x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
            "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
            "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])}[about]


def shell():
    """The wall of a tilted prolate balloon, in pixels of a 256^3 grid."""
    tilt, centre = turn("y", 45) @ turn("x", 45), (3.3, -2.1, 1.7)
    return [(1.0, centre, (28, 28, 90), tilt), (-1.0, centre, (18, 18, 80), tilt)]


def shepp_logan(n):
    """The modified Shepp-Logan phantom (Toft 1996) as cylinders along z."""
    rows = [(1, .69, .92, 0, 0, 0), (-.8, .6624, .874, 0, -.0184, 0), (-.2, .11, .31, .22, 0, -18), (-.2, .16, .41, -.22, 0, 18),
            (.1, .21, .25, 0, .35, 0), (.1, .046, .046, 0, .1, 0), (.1, .046, .046, 0, -.1, 0), (.1, .046, .023, -.08, -.605, 0),
            (.1, .023, .023, 0, -.606, 0), (.1, .023, .046, .06, -.605, 0)]
    h = n / 2
    return [(v, (x * h, y * h, 0), (a * h, b * h, np.inf), turn("z", phi)) for v, a, b, x, y, phi in rows]


def level(ellipsoid, x, y, z):
    _, centre, axes, rotation = ellipsoid
    to_ball = rotation.T / np.array(axes, float)[:, None]
    d = (x - centre[0], y - centre[1], z - centre[2])
    return sum((row[0] * d[0] + row[1] * d[1] + row[2] * d[2]) ** 2 for row in to_ball)


def chord(ellipsoid, theta, s, z):
    """Length inside, times the value: |p + t d|^2 = 1 is a quadratic in t in the frame where the ellipsoid is a ball."""
    value, centre, axes, rotation = ellipsoid
    to_ball = rotation.T / np.array(axes, float)[:, None]
    p = (s * np.cos(theta) - centre[0], s * np.sin(theta) - centre[1], z - centre[2])
    d = (-np.sin(theta), np.cos(theta))
    a = b = 0.0
    c = -1.0
    for row in to_ball:
        pr = row[0] * p[0] + row[1] * p[1] + row[2] * p[2]
        dr = row[0] * d[0] + row[1] * d[1]
        a, b, c = a + dr * dr, b + pr * dr, c + pr * pr
    return value * 2 * np.sqrt(np.maximum(b * b - a * c, 0)) / a


def middle(n):
    return np.arange(n) - (n - 1) / 2


def offsets(k):
    return (np.arange(k) + .5) / k - .5


def sinogram(objects, n, n_views, z, sampling, bins=None):
    """[view][slice][bin]; `bins` are their centres, counted from the middle by default."""
    out = np.zeros((n_views, len(z), n), np.float32)
    s = middle(n) if bins is None else bins
    ds, dz = (offsets(8), offsets(4) if len(z) > 1 else [0]) if sampling == "mean" else ([0], [0])
    for k in range(n_views):
        rows = sum(chord(e, np.pi * k / n_views, s[None, :] + a, z[:, None] + b) for e in objects for a in ds for b in dz)
        out[k] = rows / (len(ds) * len(dz))
    return out


def own_axis(objects, n, n_views, z, sampling):
    """The sinogram with bins and objects counted from n//2 instead of (n-1)/2: the centre of rotation of scikit-image."""
    return sinogram(objects, n, n_views, z, sampling, np.arange(n) - n // 2)


def moved(objects):
    """Where the objects of `own_axis` appear on our grid: half a pixel further right and, rows counting downwards, lower."""
    return [(v, (c[0] + .5, c[1] - .5, c[2]), a, r) for v, c, a, r in objects]


def averages(objects, n, z):
    """[slice][y][x]: sub-samples, only in voxels whose neighbourhood an outline can cut."""
    out = np.zeros((len(z), n, n), np.float32)
    sz, sy, sx = (a.ravel() for a in np.meshgrid(offsets(4) if len(z) > 1 else [0.0], offsets(8), offsets(8), indexing="ij"))
    x, y = middle(n)[None, :], middle(n)[:, None]
    for e in objects:
        near = .9 / min(e[2])
        for i, zi in enumerate(z):
            q = np.sqrt(level(e, x, y, zi))
            inside = (q <= 1).astype(np.float32)
            iy, ix = np.nonzero(np.abs(q - 1) < near)
            if len(iy):
                q = level(e, x[0, ix][:, None] + sx, y[iy, 0][:, None] + sy, zi + sz)
                inside[iy, ix] = (q <= 1).mean(1)
            out[i] += e[0] * inside
    return out


def errors(image, truth):
    """Overall, near an edge (within 3 pixels), far from one inside, far from one outside; gain fitted far from edges."""
    n = truth.shape[-1]
    from scipy.ndimage import maximum_filter, minimum_filter
    near = maximum_filter(truth, (1, 7, 7)) - minimum_filter(truth, (1, 7, 7)) > 1e-4
    circle = np.broadcast_to(np.hypot(middle(n)[None, :], middle(n)[:, None]) <= n / 2 - 1, truth.shape)
    inside = circle & ~near & (truth > 0)
    gain = float(image[inside].mean(dtype=float) / truth[inside].mean(dtype=float))
    d = image / gain - truth
    rms = lambda mask: float(np.sqrt(np.mean(np.square(d[mask], dtype=float)))) if mask.any() else None
    return {"gain": gain, "rmse": rms(circle), "edge": rms(circle & near), "far_inside": rms(inside),
            "far_outside": rms(circle & ~near & (truth == 0))}
