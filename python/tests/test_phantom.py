"""The phantom's arrays against closed forms, conservation, and each other."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import heart_phantom
from heart_phantom import HeartPhantomError, MembraneError, Phantom, RadonError, Scene, SceneWarning

STATIC = {"mode": {"static": {"phase": 0.3}}}


def small(**sections):
    return Scene().with_size(32).replace({"camera.views": 20}, **sections)


def volume_of_turned(points):
    """Volume of a curve [x, y], mirrored about y = 0 and rotated about the x axis, in NumPy only: cones between its points."""
    half = points[: len(points) // 2 + 1]
    x, r = half[:, 0], np.maximum(half[:, 1], 0)
    return float(np.sum(np.pi / 3 * np.diff(x) * (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2)))


def test_arrays_have_their_shapes_and_are_owned_without_a_copy():
    phantom = Phantom(small(acquisition={"mode": {"gated": {"gates": 2}}}))
    assert (phantom.n_gates, phantom.shape) == (2, (32, 32, 32))
    assert phantom.spacing == (0.5, 0.5, 0.5)
    assert phantom.origin == (-7.75, -7.75, -7.75)
    arrays = {
        (20, 32, 32): phantom.views(1),
        (32, 32): phantom.view(3, 1),
        (2, 20, 32, 32): phantom.views_of_gates(),
        (32, 32, 32): phantom.volume(1),
        (2, 32, 32, 32): phantom.truth_of_gates(),
    }
    for shape, array in arrays.items():
        assert array.shape == shape
        assert array.dtype == np.float32
        assert array.flags.c_contiguous
        assert array.flags.writeable
        assert array.flags.aligned
    labels = phantom.labels(0.0)
    assert labels.dtype == np.uint8
    assert set(np.unique(labels)) == {0, 1, 2}
    assert phantom.label_names == ["background", "cavity", "wall"]


def test_each_view_and_the_ground_truth_contain_the_activity_of_the_wall():
    # 1 per mL in the wall. The tolerances are those of the averages over bins and of the voxels' coverage.
    acquisition = STATIC | {"accuracy": {"tolerance": 5e-3}}
    phantom = Phantom(small(acquisition=acquisition, **{"camera": {"samples": "averages"}}))
    wall = phantom.numbers()["wall_volume"]
    inner, outer = phantom.membranes(0.3)
    assert wall == pytest.approx(outer.volume - inner.volume, rel=1e-12)
    assert phantom.views().sum(axis=(1, 2), dtype=float) * 0.25 == pytest.approx(wall, rel=2e-3)
    assert phantom.truth().sum(dtype=float) * 0.125 == pytest.approx(wall, rel=1e-3)
    assert phantom.activity(0.3).sum(dtype=float) * 0.125 == pytest.approx(wall, rel=1e-3)
    # Cones between the nodes of the curves: second order in their 801 nodes.
    assert volume_of_turned(outer.points) - volume_of_turned(inner.points) == pytest.approx(wall, rel=1e-4)


def test_the_cavity_follows_the_beat():
    phantom = Phantom(small(cycle={"volume": {"volumes": {"edv": 150.0, "esv": 100.0}}}))
    numbers = phantom.numbers()
    assert (numbers["edv"], numbers["esv"]) == (pytest.approx(150.0), pytest.approx(100.0))
    assert numbers["ejection_fraction"] == pytest.approx(1 / 3)
    assert numbers["stroke_volume"] == pytest.approx(50.0)
    assert numbers["cardiac_output"] == pytest.approx(50.0 * 65 / 1000)
    # A sinusoid between the two, end-systole at phase 0.
    phases = np.linspace(0, 1, 11)
    expected = 125.0 - 25.0 * np.cos(2 * np.pi * phases)
    assert phantom.cavity_volumes(phases) == pytest.approx(expected, rel=1e-9)
    assert phantom.cavity_volumes(0.25) == pytest.approx(125.0)
    assert phantom.extreme_phases == (pytest.approx(0.0), pytest.approx(0.5))
    [inner, _] = phantom.membranes(0.25)
    assert inner.volume == pytest.approx(125.0, rel=1e-9)
    cavity = np.count_nonzero(phantom.labels(0.25) == 1) * 0.125
    assert cavity == pytest.approx(125.0, rel=0.03)  # whole voxels


def test_single_views_equal_those_of_the_whole():
    phantom = Phantom(small(acquisition={"mode": {"gated": {"gates": 3}}}))
    views, truths = phantom.views_of_gates(), phantom.truth_of_gates()
    for gate in range(3):
        np.testing.assert_allclose(views[gate], phantom.views(gate), rtol=0, atol=2e-6)
        np.testing.assert_allclose(truths[gate], phantom.truth(gate), rtol=0, atol=2e-6)
        np.testing.assert_array_equal(phantom.views(gate)[7], phantom.view(7, gate))
        np.testing.assert_array_equal(phantom.volume(gate)[11], phantom.slice(11, gate))
        np.testing.assert_array_equal(phantom.truth(gate)[11], phantom.truth_slice(11, gate))
        np.testing.assert_array_equal(phantom.volume(gate), phantom.reconstruct(phantom.views(gate), gate))
    # A plan of radon gives the same reconstruction as the phantom within the inscribed circle of the bins.
    plan = heart_phantom.radon.FbpPlan(phantom.geometry(), phantom.grid)
    x = 0.5 * (np.arange(32) - 15.5)
    inside = np.hypot(x[:, None], x) <= 8.0
    np.testing.assert_array_equal(np.where(inside, plan.reconstruct(phantom.views()), 0.0), phantom.volume())
    np.testing.assert_array_equal(phantom.angles(), phantom.geometry().angles)


def test_views_of_any_real_numbers_are_reconstructed():
    phantom = Phantom(small(acquisition=STATIC))
    counts = np.random.default_rng(1).poisson(10.0 * phantom.views())
    volume = phantom.reconstruct(counts)
    assert counts.dtype == np.int64
    np.testing.assert_array_equal(volume, phantom.reconstruct(counts.astype(np.float32)))
    reversed_twice = np.asfortranarray(counts)[::-1][::-1]
    np.testing.assert_array_equal(volume, phantom.reconstruct(reversed_twice))


def test_results_are_bitwise_independent_of_threads():
    made = []
    for threads in (1, 3):
        heart_phantom.set_threads(threads)
        assert heart_phantom.threads() == threads
        phantom = Phantom(small())
        made.append((phantom.views(), phantom.volume(), phantom.truth()))
    heart_phantom.set_threads(0)
    for one, other in zip(*made):
        np.testing.assert_array_equal(one, other)


def test_the_displacement_of_the_cavity_equals_its_change_of_volume():
    phantom = Phantom(Scene().with_size(64).replace({"camera.views": 4}))
    motion = phantom.motion(0.0)  # from end-diastole, phase 0.5, to the reference configuration
    assert motion.displacement.shape == motion.velocity.shape == (64, 64, 64, 3)
    assert motion.strain.shape == (64, 64, 64, 6)
    assert motion.wall.dtype == np.bool_
    assert not motion.displacement[~motion.wall].any()
    # det F = 1: the trace of Green's strain is of second order, and the wall thickens.
    strain = motion.strain[motion.wall].astype(float)
    c = 1 + 2 * strain[:, :3]
    shear = 2 * strain[:, 3:]
    determinant = (
        c.prod(axis=1)
        + 2 * shear.prod(axis=1)
        - c[:, 0] * shear[:, 2] ** 2
        - c[:, 1] * shear[:, 1] ** 2
        - c[:, 2] * shear[:, 0] ** 2
    )
    assert np.median(determinant) == pytest.approx(1.0, abs=0.02)
    assert np.mean(strain[:, 0]) > 0.1
    assert repr(motion).startswith("<Motion: ")


def test_a_mesh_encloses_its_volume():
    phantom = Phantom(small())
    inner, outer = phantom.meshes(0.0)
    membranes = phantom.membranes(0.0)
    for mesh, membrane in zip((inner, outer), membranes):
        corners = mesh.vertices[mesh.triangles]
        volume = np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        assert volume == pytest.approx(mesh.volume, rel=1e-9)
        assert volume == pytest.approx(membrane.volume, rel=2e-3)


def test_reports_are_dictionaries_of_numbers():
    phantom = Phantom(small(acquisition={"mode": {"gated": {"gates": 2}}}))
    phases = phantom.phases()
    assert [phase["of"] for phase in phases] == ["gate-00", "gate-01", "end-diastole", "end-systole"]
    assert phases[2]["f_inner"] == pytest.approx(17.4835, abs=1e-3)  # the paper's gain of 0.6, by 801 nodes
    assert phantom.beats() is None
    assert phantom.memory()["views"] > 0
    times = phantom.view_times(1)
    assert set(times) == {"start", "window", "phase", "angle"}
    np.testing.assert_allclose(times["start"], np.arange(20.0))
    artefacts = phantom.artefacts(phantom.volume(), phantom.truth())
    difference = phantom.volume().astype(float) - phantom.truth()
    assert 0 < artefacts["rmse"] < 3 * np.sqrt(np.mean(difference**2))
    assert phantom.work()["shapes_solved"] > 0
    assert phantom.warnings() == [str(w) for w in phantom.warnings()]


def test_warnings_of_a_scene_are_issued_once():
    phantom = Phantom(small(acquisition=STATIC, pose={"shift": [4.5, 0.0, 0.0]}))
    with pytest.warns(SceneWarning, match="the heart needs a detector") as caught:
        phantom.view(0)
    assert [str(warning.message) for warning in caught] == phantom.warnings()
    assert Path(caught[0].filename) == Path(__file__)
    phantom.view(1)  # warnings are errors in these tests


def test_a_phantom_is_passed_to_another_process():
    phantom = Phantom(small(acquisition=STATIC))
    there = pickle.loads(pickle.dumps(phantom))
    assert there.scene == phantom.scene
    np.testing.assert_array_equal(there.view(0), phantom.view(0))


def test_a_run_writes_the_arrays(tmp_path):
    phantom = Phantom(small(acquisition=STATIC, output={"write": ["projections", "reconstruction", "truth", "labels"]}))
    told = []
    report = phantom.run(tmp_path / "out", progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    for name, array in {
        "projections.npy": phantom.views(),
        "reconstruction.npy": phantom.volume(),
        "truth.npy": phantom.truth(),
        "labels.npy": phantom.labels(0.3),
    }.items():
        assert name in report["files"]
        written = np.load(tmp_path / "out" / name)
        assert written.dtype == array.dtype
        np.testing.assert_array_equal(written.reshape(array.shape), array)
    assert report["numbers"] == phantom.numbers()
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OSError, match="file"):
        phantom.run(tmp_path / "file")


@pytest.mark.parametrize(
    ("make", "kind", "words"),
    [
        (lambda p: p.views(1), HeartPhantomError, "gate is 1, must be 0"),
        (lambda p: p.views(-1), ValueError, "-1"),
        (lambda p: p.views("a"), TypeError, "expected an integer"),
        (lambda p: p.view(20), HeartPhantomError, "view is 20"),
        (lambda p: p.slice(32), HeartPhantomError, "slice is 32"),
        (lambda p: p.reconstruct(np.zeros((20, 32))), ValueError, r"\(20, 32\), expected \(20, 32, 32\)"),
        (lambda p: p.reconstruct(np.zeros(0)), ValueError, r"\(0,\)"),
        (lambda p: p.reconstruct(np.full((20, 32, 32), np.nan)), RadonError, "NaN"),
        (lambda p: p.reconstruct(np.zeros((20, 32, 32), complex)), TypeError, "complex128"),
        (lambda p: p.reconstruct("views"), TypeError, "real numbers"),
        (lambda p: p.reconstruct([[1.0], [1.0, 2.0]]), ValueError, "inhomogeneous"),
        (lambda p: p.attenuation(0.0), HeartPhantomError, "no attenuation"),
        (lambda p: p.activity(float("nan")), HeartPhantomError, "NaN"),
        (lambda p: p.activity(0.0, float("inf")), ValueError, "breath is inf"),
        (lambda p: p.artefacts(np.zeros((2, 2)), np.zeros((2, 2))), ValueError, r"volume has the shape \(2, 2\)"),
        (lambda p: Phantom(small(cycle={"volume": {"gain": 60.0}})).numbers(), ValueError, "gain"),
        (lambda p: p.views(progress=3), TypeError, "callable"),
    ],
)
def test_invalid_input_is_an_error_with_a_message(make, kind, words):
    phantom = Phantom(Scene().with_size(32).replace({"camera.views": 20}, acquisition=STATIC))
    with pytest.raises(kind, match=words):
        make(phantom)


def test_invalid_membranes_are_rejected():
    with pytest.raises((MembraneError, HeartPhantomError), match="radius|outer|inner"):
        Phantom(small(heart={"inner": {"radius": 3.5}})).numbers()
