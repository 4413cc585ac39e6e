"""SPECT, the adjoint of FBP, and iterative methods with operators of Python: against dense matrices and closed forms."""

import pickle

import numpy as np
import pytest

from heart_phantom import RadonError, radon

GEOMETRY, GRID = radon.Geometry.full_turn(12, 11, 0.6), radon.Grid(9, 8, 0.6)
MAP = np.random.default_rng(5).uniform(0.0, 0.2, (3, 8, 9))
LEHR = {"holes": "ge-lehr", "intrinsic_fwhm": 0.38}


def spect(**options):
    return radon.SpectOperator(GEOMETRY, GRID, 3, 0.6, 6.0, **options)


def dense(operator):
    """The matrix of an operator, from the images of unit vectors."""
    n = int(np.prod(operator.image_shape))
    return np.array([operator.forward(e.reshape(operator.image_shape)).ravel() for e in np.eye(n)]).T


class Dense:
    """A matrix with views as the first axis of the data."""

    def __init__(self, matrix, image_shape, data_shape):
        self.matrix, self.image_shape, self.data_shape = matrix, image_shape, data_shape

    def forward(self, x):
        return (self.matrix @ x.ravel()).reshape(self.data_shape)

    def adjoint(self, y):
        return (self.matrix.T @ y.ravel()).reshape(self.image_shape)

    def subset(self, k, n):
        rows = self.matrix.reshape(*self.data_shape, -1)[k::n]
        return Dense(rows.reshape(-1, rows.shape[-1]), self.image_shape, rows.shape[:-1])


@pytest.mark.parametrize("options", [{}, {"collimator": LEHR}, {"attenuation": MAP}, {"collimator": LEHR, "attenuation": MAP}])
def test_the_adjoint_of_a_spect_operator_is_its_transpose(options):
    camera = spect(**options)
    matrix = dense(camera)
    assert (matrix >= 0).all()
    y = np.random.default_rng(2).normal(size=camera.data_shape)
    # Rounding of sums of about a hundred terms of size one.
    np.testing.assert_allclose(camera.adjoint(y).ravel(), matrix.T @ y.ravel(), atol=1e-12)
    # Single precision is that of the samples, 6e-8, in sums of a hundred.
    single = camera.forward(MAP.astype(np.float32))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, camera.forward(MAP), rtol=1e-5, atol=1e-6)


def test_without_models_the_operator_equals_the_strip_projector():
    strip = radon.Projector(GEOMETRY, GRID, "strip")
    # Areas of overlap of rotated pixels, in the unit of a line integral.
    np.testing.assert_allclose(spect().forward(MAP), strip.forward(MAP), rtol=1e-10, atol=1e-12)


def test_attenuation_and_resolution_agree_with_closed_forms():
    # A point in the middle of water: each view is attenuated by exp(-mu d), less the half voxel that contains it.
    n, mu = 21, 0.15
    geometry, grid = radon.Geometry.full_turn(4, n, 0.5), radon.Grid.square(n, 0.5)
    point = np.zeros((n, n, n))
    point[10, 10, 10] = 1.0
    water = radon.SpectOperator(geometry, grid, n, 0.5, 15.0, attenuation=np.full((n, n, n), mu))
    air = radon.SpectOperator(geometry, grid, n, 0.5, 15.0)
    passed = water.forward(point).sum((1, 2)) / air.forward(point).sum((1, 2))
    # 10 voxels in front, and the average over the source's own voxel.
    expected = np.exp(-mu * 5.0) * (1 - np.exp(-mu * 0.5)) / (mu * 0.5)
    np.testing.assert_allclose(passed, expected, rtol=1e-12)
    # The variance along the bins is that of the collimator at 15 cm, in bins.
    blurred = radon.SpectOperator(
        geometry, grid, n, 0.5, 15.0, collimator={"holes": {"widths": {"slope": 0.02, "at_face": 0.06}}, "intrinsic_fwhm": 0.0}
    )
    bins = geometry.bins
    image = blurred.forward(point)[0].sum(0)
    variance = (image * bins**2).sum() / image.sum()
    own = (air.forward(point)[0].sum(0) * bins**2).sum()
    # Plus that of the voxel; depth and width of a voxel change the former by less than 0.1 %.
    np.testing.assert_allclose(variance - own, (0.02 * 15.0 + 0.06) ** 2, rtol=2e-3)


def test_osem_of_an_object_equals_osem_of_its_matrix():
    camera = spect(collimator=LEHR, attenuation=MAP)
    truth = np.random.default_rng(3).uniform(0.5, 2.0, camera.image_shape)
    counts = camera.forward(truth)
    matrix = Dense(dense(camera), camera.image_shape, camera.data_shape)
    for method, options in [
        (radon.mlem, {"iterations": 5}),
        (radon.osem, {"subsets": 3, "iterations": 5, "background": 0.1 * counts}),
        (radon.sirt, {"iterations": 5}),
        (radon.cgls, {"iterations": 5}),
    ]:
        ours, theirs = method(camera, counts, **options), method(matrix, counts, **options)
        # Five steps multiply the rounding of sums, 1e-15, by the condition of a step.
        np.testing.assert_allclose(ours.image, theirs.image, rtol=1e-9)
    # The closed form of a step of MLEM.
    a, b = matrix.matrix, counts.ravel()
    step = a.T @ (b / a.sum(1)) / a.sum(0)
    np.testing.assert_allclose(radon.mlem(matrix, counts, iterations=1).image.ravel(), step, rtol=1e-12)


def test_a_projector_within_an_object_computes_while_the_solver_waits():
    projector = radon.Projector(GEOMETRY, GRID)

    class Scaled:
        image_shape, data_shape = projector.image_shape, projector.data_shape

        def forward(self, x):
            return 2 * projector.forward(x)

        def adjoint(self, y):
            return 2 * projector.adjoint(y)

    counts = projector.forward(MAP[0] + 0.1)
    ours, theirs = radon.mlem(Scaled(), 2 * counts, iterations=3), radon.mlem(projector, counts, iterations=3)
    np.testing.assert_allclose(ours.image, theirs.image, rtol=1e-12)


def test_errors_of_an_operator_are_passed_on():
    camera = spect()
    data = camera.forward(np.ones(camera.image_shape))

    class Bad(Dense):
        def forward(self, x):
            raise KeyError("mine")

    class Wrong(Dense):
        def adjoint(self, y):
            return np.zeros(3)

    arguments = dense(camera), camera.image_shape, camera.data_shape
    with pytest.raises(KeyError, match="mine"):
        radon.cgls(Bad(*arguments), data, start=np.ones(camera.image_shape))
    with pytest.raises(ValueError, match=r"result of adjoint has the shape \(3,\)"):
        radon.mlem(Wrong(*arguments), data)
    with pytest.raises(TypeError, match="image_shape"):
        radon.mlem(object(), data)
    with pytest.raises(ValueError, match="data has the shape"):
        radon.mlem(camera, data[1:])
    with pytest.raises(ValueError, match="subsets is 13"):
        radon.osem(Dense(*arguments), data, 13)
    with pytest.raises(RadonError, match="n_subsets"):
        radon.osem(camera, data, 13)
    with pytest.raises(ValueError, match="attenuation has the shape"):
        spect(attenuation=MAP[:2])
    with pytest.raises(RadonError, match="radii"):
        radon.SpectOperator(GEOMETRY, GRID, 3, 0.6, [6.0, 7.0])
    with pytest.raises(ValueError, match="collimator"):
        spect(collimator={"holes": "nonsense", "intrinsic_fwhm": 0.3})


def test_the_adjoint_of_fbp_is_its_transpose():
    for options in [{}, {"window": "hann", "cutoff": 0.7}, {"region": ((1, 5), (2, 8))}, {"method": "fourier"}]:
        plan = radon.FbpPlan(GEOMETRY, GRID, **options)
        ny, nx = plan.image_shape
        rng = np.random.default_rng(4)
        p, f = rng.normal(size=GEOMETRY.shape), rng.normal(size=(ny, nx))
        left, right = np.vdot(plan.reconstruct(p), f), np.vdot(p, plan.adjoint(f))
        assert abs(left - right) < 1e-12 * np.linalg.norm(p) * np.linalg.norm(f)
    assert plan.adjoint(np.zeros((4, ny, nx))).shape == (4, *GEOMETRY.shape)
    with pytest.raises(RadonError, match="edge"):
        radon.FbpPlan(GEOMETRY, GRID, edge="ellipse").adjoint(f)


def test_plans_and_operators_are_restored_from_their_pickle():
    rng = np.random.default_rng(6)
    x, y = rng.normal(size=(3, 8, 9)), rng.normal(size=GEOMETRY.shape)
    camera = spect(collimator={"holes": {"parallel": {"diameter": 0.15, "length": 3.5, "attenuation": 26.9}}, "intrinsic_fwhm": 0.3}, attenuation=MAP, n_rows=5, row_pitch=0.5)
    again = pickle.loads(pickle.dumps(camera))
    np.testing.assert_array_equal(again.forward(x), camera.forward(x))
    for projector in [radon.Projector(GEOMETRY, GRID, kernel) for kernel in ("joseph", "strip")]:
        again = pickle.loads(pickle.dumps(projector))
        np.testing.assert_array_equal(again.adjoint(y), projector.adjoint(y))
        assert repr(again) == repr(projector)
    for options in [
        {},
        {"window": {"butterworth": {"order": 4}}, "cutoff": 0.5, "edge": "ellipse", "region": ((0, 4), (1, 5))},
        {"interpolation": "band-limited", "method": "direct", "memory": 10**8, "ramp": False},
    ]:
        plan = radon.FbpPlan(GEOMETRY, GRID, **options)
        again = pickle.loads(pickle.dumps(plan))
        np.testing.assert_array_equal(again.reconstruct(y), plan.reconstruct(y))
