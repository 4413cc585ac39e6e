"""Solids of revolution against spheres, cones and cylinders in closed form."""

import numpy as np
import pytest

from heart_phantom.revolve import Body, Meridian, Pose, RevolveError


def sphere(r, n=400):
    angles = np.linspace(np.pi, 0, n)
    return np.column_stack([r * np.cos(angles), r * np.abs(np.sin(angles)) * (np.sin(angles) > 1e-9)])


def test_a_sphere_has_its_measures():
    # Chords of 0.45 degrees: the polyline is inside by 1 - cos of half of that, 1.6e-5.
    measures = Meridian(sphere(2.0)).measures()
    assert measures["volume"] == pytest.approx(4 / 3 * np.pi * 8, rel=1e-4)
    assert measures["surface"] == pytest.approx(4 * np.pi * 4, rel=1e-4)
    assert measures["first_moment"] == pytest.approx(0.0, abs=1e-10)
    assert measures["second_moment"] == pytest.approx(4 / 15 * np.pi * 32, rel=2e-4)
    assert measures["polar_inertia"] == pytest.approx(8 / 15 * np.pi * 32, rel=2e-4)


def test_chords_of_a_sphere_do_not_depend_on_the_pose():
    rng = np.random.default_rng(5)
    for pose in (Pose(), Pose().rotated_x(0.4).rotated_y(-1.1).rotated_z(2.0)):
        body = Body([sphere(2.0)], pose)
        origins, directions = rng.normal(size=(200, 3)), rng.normal(size=(200, 3))
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        apart = np.linalg.norm(np.cross(origins, unit), axis=1)
        expected = 2 * np.sqrt(np.maximum(4.0 - apart**2, 0))
        chords = body.chords(origins, directions)
        far = np.abs(apart - 2.0) > 0.05  # grazing chords have half the digits
        assert chords[far] == pytest.approx(expected[far], abs=2e-3)
        assert body.signed_distances(origins) == pytest.approx(
            np.linalg.norm(origins, axis=1) - 2.0, abs=1e-4
        )


def test_views_contain_the_volume_of_the_body():
    pose = Pose.axis_along_z(1.0).rotated_x(0.5).shifted([0.3, -0.2, 0.1])
    body = Body([[[0.0, 1.0], [3.0, 0.5]], [[0.0, 2.0], [4.0, 1.0]]], pose)
    cone = np.pi / 3 * 3 * (1 + 0.5 + 0.25)
    outer = np.pi / 3 * 4 * (4 + 2 + 1)
    assert body.measures(0)["volume"] == pytest.approx(cone)
    assert body.measures(1)["volume"] == pytest.approx(outer - cone)
    angles = np.array([0.0, 0.7, 2.0])
    views = body.views(angles, 400, 380, (0.03, 0.03), [0.5, 1.0], dtype="float64")
    assert (views.shape, views.dtype) == ((3, 380, 400), np.float64)
    # Lines through the middles of bins 0.03 wide, over a body about 4 wide.
    assert views.sum(axis=(1, 2)) * 0.0009 == pytest.approx(0.5 * cone + outer - cone, rel=1e-3)
    assert body.views(angles, 8, 6, (0.5, 0.5), [0.5, 1.0]).dtype == np.float32
    # A bin is a line.
    u = (np.arange(8) - 3.5) * 0.5
    origins = np.column_stack([u * np.cos(0.7), u * np.sin(0.7), np.full(8, (2 - 2.5) * 0.5)])
    lines = body.line_integrals(origins, [-np.sin(0.7), np.cos(0.7), 0.0], [0.5, 1.0])
    np.testing.assert_allclose(body.views([0.7], 8, 6, (0.5, 0.5), [0.5, 1.0], dtype="float64")[0, 2], lines)


def test_coverage_adds_up_to_the_volume():
    body = Body([sphere(1.0), sphere(2.0)], Pose().shifted([0.2, 0.1, -0.3]))
    coverage, labels = body.coverage((20, 22, 24), 0.25, tolerance=1e-4, dtype="float64")
    assert (coverage.shape, labels.shape, labels.dtype) == ((2, 20, 22, 24), (20, 22, 24), np.uint8)
    inner, wall = coverage.sum(axis=(1, 2, 3)) * 0.25**3
    assert inner == pytest.approx(4 / 3 * np.pi, rel=1e-3)
    assert wall == pytest.approx(4 / 3 * np.pi * 7, rel=1e-3)
    centres = np.stack(
        np.meshgrid(*[(np.arange(n) - (n - 1) / 2) * 0.25 for n in (20, 22, 24)], indexing="ij"), axis=-1
    )
    away = np.linalg.norm(centres - np.array([-0.3, 0.1, 0.2]), axis=-1)
    assert np.all(labels[away < 0.75] == 1)
    assert np.all(labels[(away > 1.25) & (away < 1.75)] == 2)
    assert np.all(labels[away > 2.25] == 0)
    centre, _ = np.array(coverage[0].nonzero()), None
    weights = coverage[0][coverage[0] > 0]
    at = (centre * weights).sum(axis=1) / weights.sum()
    np.testing.assert_allclose((at - (np.array([20, 22, 24]) - 1) / 2) * 0.25, [-0.3, 0.1, 0.2], atol=2e-3)


def test_a_mesh_is_closed_and_has_the_volume(tmp_path):
    mesh = Body([sphere(2.0)]).mesh(tolerance=0.01)
    points, triangles = mesh.vertices, mesh.triangles
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, times = np.unique(edges, axis=0, return_counts=True)
    assert np.all(times == 2)
    assert len(points) - len(times) + len(triangles) == 2  # Euler
    corners = points[triangles]
    volume = np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume == pytest.approx(4 / 3 * np.pi * 8, rel=0.015)
    assert mesh.volume == pytest.approx(volume, rel=1e-12)
    assert np.einsum("ni,ni->n", mesh.normals, points).min() > 1.9  # outward
    mesh.write(tmp_path / "sphere.stl")
    header = np.fromfile(tmp_path / "sphere.stl", dtype=np.uint32, count=1, offset=80)
    assert header[0] == len(triangles)
    with pytest.raises(ValueError, match="extension"):
        mesh.write(tmp_path / "sphere.obj")
    with pytest.raises(FileNotFoundError):
        mesh.write(tmp_path / "nowhere" / "sphere.stl")


def test_a_ring_is_a_torus():
    angles = np.linspace(0, 2 * np.pi, 500, endpoint=False)
    torus = Meridian(np.column_stack([0.5 * np.cos(angles), 2 + 0.5 * np.sin(angles)]), ring=True)
    assert torus.measures()["volume"] == pytest.approx(2 * np.pi**2 * 2 * 0.25, rel=1e-4)
    # Pappus
    assert torus.measures()["surface"] == pytest.approx(4 * np.pi**2 * 2 * 0.5, rel=1e-4)
    assert (torus.r_max, torus.x_range[1]) == (pytest.approx(2.5, rel=1e-4), pytest.approx(0.5))
    assert Body([torus]).chords([[0.0, 0.0, 0.0]], [0.0, 1.0, 0.0])[0] == pytest.approx(2.0, rel=1e-3)


def test_a_pose_is_inverted():
    pose = Pose.axis_along_z(2.0).rotated_y(0.3).shifted([1.0, 2.0, 3.0])
    places = np.random.default_rng(6).normal(size=(10, 3))
    np.testing.assert_allclose(pose.to_body(pose.to_lab(places)), places, atol=1e-14)
    np.testing.assert_allclose(pose.to_lab([[2.0, 0.0, 0.0]]), [[1.0, 2.0, 3.0]], atol=1e-14)
    assert pose == Pose.axis_along_z(2.0).rotated_y(0.3).shifted([1.0, 2.0, 3.0])
    low, high = Body([[[0.0, 1.0], [3.0, 1.0]]], Pose().shifted([0, 0, 2])).bounding_box()
    assert (low, high) == ([0.0, -1.0, 1.0], [3.0, 1.0, 3.0])


BALL = Body([[[0.0, 1.0], [3.0, 0.0]]])


@pytest.mark.parametrize(
    ("make", "kind", "words"),
    [
        (lambda: Meridian([[0.0, 1.0]]), RevolveError, "point"),
        (lambda: Meridian([[0.0, 1.0], [np.nan, 0.0]]), RevolveError, "point 1|finite|NaN"),
        (lambda: Meridian([[0.0, -1.0], [1.0, 0.0]]), RevolveError, "-1"),
        (lambda: Meridian([0.0, 1.0]), ValueError, r"points has the shape \(2,\), expected \(n, 2\)"),
        (lambda: Body([]), RevolveError, "layers"),
        (lambda: BALL.chords([[0.0, 0.0, 0.0]], [0.0, 0.0, 0.0]), RevolveError, "direction"),
        (lambda: BALL.chords([[0.0, 0.0, 0.0]], [0.0, 1.0, 0.0], 3), RevolveError, "3"),
        (lambda: BALL.chords(np.zeros((4, 3)), np.ones((3, 3))), ValueError, "3 directions for 4 origins"),
        (lambda: BALL.views([0.0], 4, 4, (1.0, 1.0), [1.0, 2.0]), RevolveError, "activit"),
        (lambda: BALL.views([np.inf], 4, 4, (1.0, 1.0), [1.0]), RevolveError, "angle"),
        (lambda: BALL.views([0.0], 4, 4, (1.0, 1.0), [1.0], dtype="int8"), ValueError, "dtype is \"int8\""),
        (lambda: BALL.coverage((4, 4, 0), 1.0), RevolveError, "voxel"),
        (lambda: BALL.coverage((4, 4, 4), -1.0), RevolveError, "spacing"),
        (lambda: BALL.coverage((2**30, 2**30, 2**30), 1.0), RevolveError, "memory|address"),
        (lambda: BALL.coverage((4, 4, 4), 1.0, tolerance=0.0), RevolveError, "tolerance"),
        (lambda: BALL.mesh(tolerance=-1.0), RevolveError, "tolerance"),
        (lambda: BALL.mesh(2), RevolveError, "2"),
        (lambda: Pose().shifted([0.0, np.inf, 0.0]), RevolveError, "finite|inf"),
    ],
)
def test_invalid_input_is_an_error_with_a_message(make, kind, words):
    with pytest.raises(kind, match=words):
        make()
