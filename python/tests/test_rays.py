"""Rays that are not parallel, and scatter, against parallel views and closed forms."""

import numpy as np
import pytest

from heart_phantom import Phantom, RayGeometry, RevolveError, Scene

STATIC = {"mode": {"static": {"phase": 0.0}}}


def phantom():
    return Phantom(Scene().with_size(24).replace({"camera.views": 6}, acquisition=STATIC))


def test_lines_of_the_parallel_detector_give_its_views():
    still = phantom()
    bins = (np.arange(24) - 11.5) * still.scene["camera.pitch"][0]
    points = np.empty((6, 24, 24, 2, 3))
    for view, theta in enumerate(still.angles()):
        across, ahead = [np.cos(theta), np.sin(theta), 0], [-np.sin(theta), np.cos(theta), 0]
        for end, side in enumerate([-50, 50]):
            points[view, :, :, end, :] = bins[None, :, None] * across + bins[:, None, None] * [0, 0, 1]
            points[view, :, :, end, :] += side * np.array(ahead)
    rays = RayGeometry.from_lines(points)
    assert rays.n_views == 6
    views = still.along(rays).views()
    # Grazing rays have half of the digits.
    assert np.abs(views - still.views()).max() < 1e-5 * views.max()


def test_a_cone_equals_the_lines_from_its_source_and_its_matrices():
    theta, near, far = 0.3, 60.0, 100.0
    cone = RayGeometry.cone([near, far], [theta], n_bins=24, n_rows=24, pitch=[0.8, 0.8])
    views = phantom().along(cone).views()
    across = np.array([np.cos(theta), np.sin(theta), 0])
    ahead = np.array([-np.sin(theta), np.cos(theta), 0])
    source = -near * ahead
    at = (np.arange(24) - 11.5) * 0.8
    ends = source + far * ahead + at[None, :, None] * across + at[:, None, None] * np.array([0, 0, 1])
    points = np.stack([np.broadcast_to(source, ends.shape), ends], axis=2)[None]
    lines = phantom().along(RayGeometry.from_lines(points)).views()
    assert np.abs(views - lines).max() < 1e-5 * views.max()
    # P = K [R | t] with bins and rows from the centre of the first.
    inner = np.array([[far / 0.8, 0, 11.5], [0, far / 0.8, 11.5], [0, 0, 1]])
    turn = np.array([across, [0, 0, 1], ahead])
    matrix = inner @ np.hstack([turn, (-turn @ source)[:, None]])
    found = phantom().along(RayGeometry.from_matrices([matrix], n_bins=24, n_rows=24, pitch=[0.8, 0.8]))
    assert np.abs(found.views() - views).max() < 1e-5 * views.max()


def test_invalid_rays_are_errors():
    with pytest.raises(ValueError, match="views, rows, bins, 2, 3"):
        RayGeometry.from_lines(np.zeros((2, 2, 3)))
    with pytest.raises(ValueError, match="n, 3, 4"):
        RayGeometry.from_matrices(np.zeros((3, 4)), n_bins=2, n_rows=2, pitch=[1, 1])
    with pytest.raises(RevolveError):
        RayGeometry.from_lines(np.zeros((1, 1, 1, 2, 3)))


def test_scatter_has_its_standard_errors():
    scene = Scene().with_size(12).replace(
        {"camera.views": 4},
        acquisition=STATIC,
        attenuation={"coefficient": 0.15, "medium": {"torso": {"centre": [0, 0], "semi_axes": [16, 11]}}},
        scatter={"tolerance": 0.1},
    )
    made = Phantom(scene)
    samples, errors = made.scatter()
    assert samples.shape == errors.shape == (4, 12, 12)
    assert (samples >= 0).all() and (errors >= 0).all() and errors.max() < 0.5 * samples.max()
    assert phantom().scatter() is None
    with pytest.raises(ValueError, match="window is 1"):
        made.scatter(0, 1)
