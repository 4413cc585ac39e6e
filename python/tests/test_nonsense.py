"""An invalid argument of any call is an error with a message, never an internal error, and never the end of the interpreter."""

import numpy as np
import pytest

import heart_phantom
from heart_phantom import Phantom, Scene, membrane, radon, revolve

NONSENSE = [
    None,
    -1,
    0,
    3,
    2**62,
    2**80,
    -0.5,
    float("nan"),
    float("inf"),
    1e300,
    "",
    "nonsense",
    b"\xff",
    [],
    [[]],
    [None],
    {},
    {"a": {"b": None}},
    object(),
    lambda *given: given,
    np.zeros(0),
    np.zeros((0, 3)),
    np.zeros((3, 0, 2)),
    np.array(1.0),
    np.full((2, 2), np.nan),
    np.array(["a"]),
    np.zeros(2, complex),
    np.zeros((1, 1, 1, 1, 1), np.float16),
    Scene,
]
# Exceptions for a caller; RuntimeError and SystemError would be defects.
TOLD = (ValueError, TypeError, KeyError, OSError, OverflowError)

PHANTOM = Phantom(Scene().with_size(8).replace({"camera.views": 4, "acquisition.mode": {"static": {"phase": 0.0}}}))
GEOMETRY, GRID = radon.Geometry.half_turn(6, 8), radon.Grid.square(6)
PROJECTOR, PLAN = radon.Projector(GEOMETRY, GRID), radon.FbpPlan(GEOMETRY, GRID)
BODY = revolve.Body([[[0.0, 1.0], [3.0, 0.0]]])
BALLOON = membrane.Membrane.balloon(8.5, 1.75)
SINOGRAM = np.ones((6, 8))

CALLS = {
    "Scene": (Scene, [{}], {"camera": {"views": 3}}),
    "from_toml": (Scene.from_toml, [""], {}),
    "load": (Scene.load, ["/"], {}),
    "replace": (Scene().replace, [{}], {"blur": {"fwhm": 1.0}}),
    "with_size": (Scene().with_size, [8], {}),
    "Phantom": (Phantom, [Scene()], {"memory": 1000}),
    "views": (PHANTOM.views, [0], {"progress": None}),
    "view": (PHANTOM.view, [0, 0], {}),
    "reconstruct": (PHANTOM.reconstruct, [np.zeros((4, 8, 8)), 0], {}),
    "slice": (PHANTOM.slice, [0, 0], {}),
    "truth_slice": (PHANTOM.truth_slice, [0, 0], {}),
    "activity": (PHANTOM.activity, [0.0, 0.0], {}),
    "labels": (PHANTOM.labels, [0.0, 0.0], {}),
    "motion": (PHANTOM.motion, [0.0, 0.0], {}),
    "meshes": (PHANTOM.meshes, [0.0, 0.0], {}),
    "body": (PHANTOM.body, [0.0, 0.0], {}),
    "membranes": (PHANTOM.membranes, [0.0], {}),
    "cavity_volumes": (PHANTOM.cavity_volumes, [[0.0]], {}),
    "artefacts": (PHANTOM.artefacts, [np.zeros((8, 8, 8)), np.zeros((8, 8, 8)), 0], {}),
    "Geometry": (radon.Geometry, [[0.0], 4, 1.0], {"offset": 0.0}),
    "half_turn": (radon.Geometry.half_turn, [4, 4, 1.0], {}),
    "with_rotation_bin": (GEOMETRY.with_rotation_bin, [0.5], {}),
    "Grid": (radon.Grid, [4, 4, 1.0], {"centre": (0.0, 0.0)}),
    "FbpPlan": (
        radon.FbpPlan,
        [GEOMETRY, GRID],
        {
            "window": "hann",
            "cutoff": 1.0,
            "interpolation": "linear",
            "edge": "zero",
            "arc": "complete",
            "ramp": True,
            "region": ((0, 2), (0, 2)),
            "method": "auto",
            "memory": 10**6,
        },
    ),
    "FbpPlan.reconstruct": (PLAN.reconstruct, [SINOGRAM], {"order": "view-slice-bin"}),
    "Projector": (radon.Projector, [GEOMETRY, GRID, "joseph"], {}),
    "forward": (PROJECTOR.forward, [np.ones((6, 6))], {"order": "view-slice-bin"}),
    "adjoint": (PROJECTOR.adjoint, [SINOGRAM], {"order": "view-slice-bin"}),
    "fbp": (radon.fbp, [SINOGRAM, GEOMETRY.angles], {"pitch": 1.0, "offset": 0.0, "n": 4, "window": "hann", "cutoff": 1.0}),
    "osem": (
        radon.osem,
        [PROJECTOR, SINOGRAM, 2],
        {"start": np.ones((6, 6)), "background": SINOGRAM, "iterations": 2, "residual": 0.1, "change": 0.1},
    ),
    "sirt": (
        radon.sirt,
        [PROJECTOR, SINOGRAM],
        {"start": np.ones((6, 6)), "relaxation": 1.0, "lower": 0.0, "upper": 1.0, "iterations": 2},
    ),
    "cgls": (radon.cgls, [PROJECTOR, SINOGRAM], {"gradient": 0.1, "iterations": 2, "order": "view-slice-bin"}),
    "Meridian": (revolve.Meridian, [[[0.0, 1.0], [3.0, 0.0]]], {"ring": False}),
    "Body": (revolve.Body, [[[[0.0, 1.0], [3.0, 0.0]]], revolve.Pose()], {}),
    "axis_along_z": (revolve.Pose.axis_along_z, [1.0], {}),
    "shifted": (revolve.Pose().shifted, [[0.0, 0.0, 1.0]], {}),
    "to_lab": (revolve.Pose().to_lab, [[[0.0, 0.0, 1.0]]], {}),
    "measures": (BODY.measures, [0], {}),
    "chords": (BODY.chords, [[[0.0, 0.0, 0.0]], [1.0, 0.0, 0.0], 0], {}),
    "line_integrals": (BODY.line_integrals, [[[0.0, 0.0, 0.0]], [1.0, 0.0, 0.0], [1.0]], {}),
    "body.views": (BODY.views, [[0.0], 4, 4, (1.0, 1.0), [1.0]], {"offset": (0.0, 0.0), "dtype": "float32"}),
    "coverage": (
        BODY.coverage,
        [(4, 4, 4), 1.0],
        {"centre": (0.0, 0.0, 0.0), "tolerance": 0.01, "dtype": "float32"},
    ),
    "mesh": (BODY.mesh, [0], {"tolerance": 0.1}),
    "signed_distances": (BODY.signed_distances, [[[0.0, 0.0, 0.0]], 0], {}),
    "write": (BODY.mesh(tolerance=0.5).write, ["/nonexistent/a.stl"], {}),
    "balloon": (membrane.Membrane.balloon, [8.5, 1.75], {"stiffness": 1.0, "law": "total-force"}),
    "disc": (membrane.Membrane.disc, [1.0], {"rubber": {"neo_hookean": {"mu": 1.0}}, "thickness": 1.0}),
    "polyline": (membrane.Membrane.polyline, [[[0.0, 1.0], [1.0, 0.0], [0.0, -1.0]]], {}),
    "solve": (BALLOON.solve, [], {"volume_gain": 0.1, "degree": 12}),
    "solve_by": (BALLOON.solve, [], {"volume": 100.0, "tolerance": 1e-6}),
    "at": (BALLOON.solve(volume_gain=0.1).at, [[0.5]], {}),
    "solve_pair": (membrane.solve_pair, [BALLOON, membrane.Membrane.balloon(8.5, 2.75), 0.1], {"nodes": 51}),
    "set_threads": (heart_phantom.set_threads, [1], {}),
}
# Valid requests that would need all memory or a very long time.
LONG = {("Projector", 0), ("osem", "iterations"), ("sirt", "iterations"), ("cgls", "iterations")}


@pytest.mark.filterwarnings("ignore")  # of NumPy, about conversions to a smaller type
@pytest.mark.parametrize("name", CALLS)
def test_invalid_arguments_are_errors(name):
    call, places, names = CALLS[name]
    refused = 0
    for at in [*range(len(places)), *names]:
        for nonsense in NONSENSE:
            if (name, at) in LONG and isinstance(nonsense, int) and nonsense > 3:
                continue
            given, named = list(places), dict(names)
            if isinstance(at, int):
                given[at] = nonsense
            else:
                named[at] = nonsense
            try:
                call(*given, **named)
            except TOLD as error:
                refused += 1
                assert str(error), (at, nonsense)
    heart_phantom.set_threads(0)
    assert refused > 0
