"""Tomography against closed forms, NumPy's own linear algebra, and scikit-image."""

import pickle

import numpy as np
import pytest
from skimage.transform import iradon

from heart_phantom import radon
from heart_phantom.radon import FbpPlan, Geometry, Grid, Projector, RadonError

KERNELS = ("joseph", "strip")


def disc(geometry, x, y, r):
    """Line integrals of a disc of value 1, in closed form."""
    s = geometry.bins[None, :] - (x * np.cos(geometry.angles) + y * np.sin(geometry.angles))[:, None]
    return 2 * np.sqrt(np.maximum(r**2 - s**2, 0))


def matrix(projector):
    """The projector as a matrix, column by column."""
    ny, nx = projector.grid.shape
    columns = []
    for k in range(ny * nx):
        one = np.zeros(ny * nx)
        one[k] = 1
        columns.append(projector.forward(one.reshape(ny, nx)).ravel())
    return np.array(columns).T


@pytest.mark.parametrize("n", [64, 65])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_disc_is_reconstructed_with_position_and_value(n, dtype):
    geometry, grid = Geometry.half_turn(120, n, 0.5), Grid.square(n, 0.5)
    plan = FbpPlan(geometry, grid)
    image = plan.reconstruct(disc(geometry, 3.0, -2.0, 6.0).astype(dtype))
    assert image.dtype == dtype
    x, y = grid.x[None, :], grid.y[:, None]
    away = np.hypot(x - 3.0, y + 2.0)
    # Views 1.5 degrees apart ring near the edge only.
    assert np.abs(image[away < 5] - 1).max() < 0.02
    assert image[away < 5].mean() == pytest.approx(1.0, abs=2e-3)
    within = image[np.hypot(x, y) < 15].sum() * 0.25
    assert within == pytest.approx(36 * np.pi, rel=0.01)
    assert (image * (away < 8) * x).sum() / (image * (away < 8)).sum() == pytest.approx(3.0, abs=0.02)


def test_fbp_in_one_call_equals_the_plan():
    geometry = Geometry.half_turn(60, 40, 0.7)
    sinogram = disc(geometry, 2.0, 1.0, 5.0)
    planned = FbpPlan(geometry, Grid.square(40, 0.7), window="hann").reconstruct(sinogram)
    np.testing.assert_array_equal(radon.fbp(sinogram, geometry.angles, pitch=0.7, window="hann"), planned)


def test_scikit_image_agrees():
    # Its centre is in pixel n // 2, which equals ours for an odd n; rows run downwards, bins are first.
    n = 129
    geometry = Geometry.half_turn(180, n)
    sinogram = disc(geometry, 20.0, -15.0, 25.0) - 0.5 * disc(geometry, 25.0, -10.0, 8.0)
    ours = radon.fbp(sinogram, geometry.angles)
    theirs = iradon(sinogram.T, theta=np.rad2deg(geometry.angles), filter_name="ramp", circle=True)[::-1]
    at = np.arange(n) - n // 2
    inside = at[:, None] ** 2 + at[None, :] ** 2 < 55**2
    # The same ramp and the same linear interpolation between bins.
    assert np.abs(ours - theirs)[inside].max() < 1e-3


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float32, 1e-5), (np.float64, 1e-12)])
def test_the_adjoint_is_exact(kernel, dtype, tolerance):
    rng = np.random.default_rng(2)
    geometry = Geometry(rng.uniform(0, 6, 17), 23, 0.8, offset=0.3)
    projector = Projector(geometry, Grid(19, 14, (0.7, 0.9), centre=(0.4, -0.2)), kernel)
    x = rng.normal(size=(5, 14, 19)).astype(dtype)
    y = rng.normal(size=(17, 5, 23)).astype(dtype)
    ax, aty = projector.forward(x), projector.adjoint(y)
    assert (ax.dtype, aty.dtype) == (dtype, dtype)
    left, right = np.vdot(ax.astype(float), y), np.vdot(x.astype(float), aty)
    assert abs(left - right) < tolerance * np.linalg.norm(ax) * np.linalg.norm(y)
    # One slice alone, and the other order.
    np.testing.assert_array_equal(projector.forward(x[2]), ax[:, 2])
    np.testing.assert_array_equal(projector.forward(x, order="slice-view-bin"), ax.transpose(1, 0, 2))
    swapped = np.ascontiguousarray(y.transpose(1, 0, 2))
    np.testing.assert_array_equal(projector.adjoint(swapped, order="slice-view-bin"), aty)


def test_strips_measure_areas():
    # Along an axis of a pixel areas are known: strips along y, of one row of pixels 2 wide.
    projector = Projector(Geometry([0.0], 3, 2.0), Grid(3, 4, 2.0), "strip")
    np.testing.assert_allclose(projector.forward(np.ones((4, 3))), [[8.0, 8.0, 8.0]])


def test_a_stack_equals_its_slices():
    geometry, grid = Geometry.half_turn(30, 32), Grid.square(32)
    plan = FbpPlan(geometry, grid, window={"butterworth": {"order": 3}}, cutoff=0.8, interpolation="band-limited")
    rng = np.random.default_rng(4)
    stack = rng.normal(size=(30, 5, 32)).astype(np.float32)
    images = plan.reconstruct(stack)
    assert images.shape == (5, 32, 32)
    for k in range(5):
        np.testing.assert_allclose(images[k], plan.reconstruct(stack[:, k]), rtol=0, atol=1e-6)
    swapped = plan.reconstruct(stack.transpose(1, 0, 2), order="slice-view-bin")
    np.testing.assert_array_equal(swapped, images)
    cut = FbpPlan(
        geometry,
        grid,
        window={"butterworth": {"order": 3}},
        cutoff=0.8,
        interpolation="band-limited",
        region=((3, 9), (4, 20)),
    )
    np.testing.assert_array_equal(cut.reconstruct(stack), images[:, 4:20, 3:9])


def test_iterative_methods_follow_their_formulas():
    rng = np.random.default_rng(3)
    projector = Projector(Geometry.half_turn(15, 14), Grid.square(10), "strip")
    a = matrix(projector)
    truth = rng.uniform(0.5, 2.0, size=(10, 10))
    data = projector.forward(truth) + rng.normal(scale=0.01, size=(15, 14))
    data = np.maximum(data, 0)
    b = data.ravel()

    x, sums = np.ones(100), a.sum(axis=0)
    for _ in range(7):
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(a @ x > 0, b / (a @ x), 0)
        x = x / sums * (a.T @ ratio)
    em = radon.mlem(projector, data, iterations=7)
    np.testing.assert_allclose(em.image.ravel(), x, rtol=1e-9)
    assert (em.iterations, em.stopped_by) == (7, "max-iterations")
    assert np.all(np.diff(em.history["log_likelihood"]) > 0)
    np.testing.assert_allclose(radon.osem(projector, data, 1, iterations=7).image, em.image, rtol=1e-12)

    rows, columns = a.sum(axis=1), a.sum(axis=0)
    r = np.divide(1, rows, out=np.zeros_like(rows), where=rows > 0)
    x = np.zeros(100)
    for _ in range(5):
        x = np.clip(x + 1.5 / columns * (a.T @ (r * (b - a @ x))), 0.0, 1.8)
    steps = radon.sirt(projector, data, relaxation=1.5, lower=0.0, upper=1.8, iterations=5)
    np.testing.assert_allclose(steps.image.ravel(), x, rtol=1e-9, atol=1e-12)

    least = np.linalg.lstsq(a, b, rcond=None)[0]
    found = radon.cgls(projector, data, iterations=400, gradient=1e-12)
    assert found.stopped_by == "gradient"
    np.testing.assert_allclose(found.image.ravel(), least, atol=1e-6)
    assert found.history["gradient"][-1] <= 1e-12


def test_an_unmet_rule_returns_the_image():
    projector = Projector(Geometry.half_turn(20, 16), Grid.square(12))
    data = projector.forward(np.ones((12, 12), np.float32))
    solution = radon.sirt(projector, data, iterations=3, residual=1e-9)
    assert (solution.stopped_by, solution.iterations, solution.image.dtype) == (None, 3, np.float32)
    on = radon.sirt(projector, data, iterations=2000, residual=1e-2, start=solution.image)
    assert on.stopped_by == "residual"
    assert repr(on).endswith("ended by residual>")
    told = []
    radon.osem(projector, data, 4, iterations=5, progress=told.append)
    assert told[-1] == 1.0


def test_geometries_and_grids_are_values():
    geometry = Geometry.from_degrees([0, 45, 90], 8, 0.5, offset=0.25)
    np.testing.assert_allclose(geometry.angles, [0, np.pi / 4, np.pi / 2])
    np.testing.assert_allclose(geometry.bins, (np.arange(8) - 3.5) * 0.5 + 0.25)
    assert geometry == pickle.loads(pickle.dumps(geometry))
    assert geometry != Geometry.half_turn(3, 8, 0.5)
    golden = np.arange(60) * np.pi * (3 - np.sqrt(5)) / 2
    many_turns = Geometry.from_radians(golden, 8, offset=0.25)
    np.testing.assert_array_equal(many_turns.angles, golden)
    assert many_turns == pickle.loads(pickle.dumps(many_turns))
    assert geometry.with_rotation_bin(3.5).offset == 0.0
    grid = Grid(4, 3, (0.5, 1.0), centre=(1.0, 2.0))
    assert grid == pickle.loads(pickle.dumps(grid))
    assert (grid.shape, grid.spacing, grid.centre) == ((3, 4), (0.5, 1.0), (1.0, 2.0))
    np.testing.assert_allclose(grid.y, [1.0, 2.0, 3.0])
    for one in (geometry, grid, Projector(geometry, grid), FbpPlan(geometry, grid, arc="extend")):
        assert repr(one).startswith("<")


G, S = Geometry.half_turn(12, 16), Grid.square(8)


@pytest.mark.parametrize(
    ("make", "kind", "words"),
    [
        (lambda: Geometry([], 8), RadonError, "n_views must be at least 1, got 0"),
        (lambda: Geometry([0.0, np.nan], 8), RadonError, "angle must be finite"),
        (lambda: Geometry([[0.0]], 8), ValueError, "angles has the shape"),
        (lambda: Geometry(["a"], 8), TypeError, "real numbers"),
        (lambda: Geometry(np.arange(180.0), 8), RadonError, "degrees"),
        (lambda: Geometry(np.arange(0, 136.5, 1.5), 8), RadonError, "degrees"),
        (lambda: Geometry([0.0], 0), RadonError, "n_bins"),
        (lambda: Geometry([0.0], -2), ValueError, "-2"),
        (lambda: Geometry([0.0], 8, 0.0), RadonError, "pitch must be greater than zero"),
        (lambda: Geometry([0.0], 2**62, 1.0), RadonError, "memory|address"),
        (lambda: Grid(4, 3, -1.0), RadonError, "greater than zero"),
        (lambda: Grid.square(2**40), RadonError, "memory"),
        (lambda: FbpPlan(G, S, window="han"), ValueError, "unknown name `han`, expected one of `ram-lak`"),
        (lambda: FbpPlan(G, S, window=3), ValueError, "window"),
        (lambda: FbpPlan(G, S, cutoff=1.5), RadonError, "cutoff must lie in"),
        (lambda: FbpPlan(G, S, edge="none"), ValueError, "edge is \"none\", must be one of zero, ellipse"),
        (lambda: FbpPlan(Geometry([0.0, 0.1, 0.2, 0.3], 16), S), RadonError, "gap"),
        (lambda: FbpPlan(G, S, region=((4, 2), (0, 8))), RadonError, "range 4..2"),
        (lambda: FbpPlan(G, "grid"), TypeError, "Grid"),
        (lambda: FbpPlan(G, S).reconstruct(np.zeros((16, 12))), ValueError, r"\(16, 12\), expected \(12, 16\)"),
        (lambda: FbpPlan(G, S).reconstruct(np.zeros((12, 0, 16))), ValueError, "shape"),
        (lambda: FbpPlan(G, S).reconstruct(np.full((12, 16), np.inf)), RadonError, "sample 0 of .* is inf"),
        (lambda: FbpPlan(G, S).reconstruct(np.zeros((12, 16), bool)), TypeError, "bool"),
        (lambda: FbpPlan(G, S).reconstruct(np.zeros((12, 16)), order="x"), ValueError, "order is \"x\""),
        (lambda: Projector(G, S, "ray"), ValueError, "kernel is \"ray\""),
        (lambda: Projector(G, S).forward(np.zeros((8, 9))), ValueError, r"image has the shape \(8, 9\)"),
        (lambda: Projector(G, S).forward(None), TypeError, "object"),
        (lambda: radon.mlem(Projector(G, S), -np.ones((12, 16))), RadonError, "must not be negative"),
        (lambda: radon.mlem(Projector(G, S), np.ones((12, 16)), start=np.ones(3)), ValueError, "start"),
        (lambda: radon.osem(Projector(G, S), np.ones((12, 16)), 13), RadonError, "n_subsets must lie in"),
        (lambda: radon.sirt(Projector(G, S), np.ones((12, 16)), relaxation=3.0), RadonError, "relaxation"),
        (lambda: radon.fbp(np.zeros(5), [0.0]), ValueError, "sinogram"),
        (lambda: radon.fbp(np.zeros((5, 4)), np.arange(3) * np.pi / 3), ValueError, "sinogram"),
    ],
)
def test_invalid_input_is_an_error_with_a_message(make, kind, words):
    with pytest.raises(kind, match=words):
        make()
