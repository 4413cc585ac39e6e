"""A program that uses everything once, for mypy; it is not run."""

from typing import Optional

import numpy as np
from numpy.typing import NDArray

import heart_phantom
from heart_phantom import Phantom, Scene, SceneError, membrane, radon, revolve


def scenes(text: str) -> Optional[Scene]:
    try:
        scene = Scene.from_toml(text).replace({"camera.views": 30}, blur={"fwhm": 0.8})
    except SceneError as error:
        place: tuple[Optional[int], Optional[int]] = (error.line, error.column)
        print(place, error.field, error.wanted)
        return None
    return scene.with_size(32)


def arrays(phantom: Phantom) -> NDArray[np.float32]:
    views: NDArray[np.float32] = phantom.views(0, progress=lambda share: print(share))
    labels: NDArray[np.uint8] = phantom.labels(0.0)
    edv: float = phantom.numbers()["edv"]
    side: float = phantom.numbers()["systolic_thickness"]["side"]
    wall: NDArray[np.bool_] = phantom.motion(0.5).wall
    print(labels.shape, edv, side, wall.sum(), phantom.phases()[0]["f_inner"])
    return phantom.reconstruct(views)


def tomography() -> NDArray[np.float64]:
    geometry = radon.Geometry(np.linspace(0, 3, 30), 64, 0.5)
    projector = radon.Projector(geometry, radon.Grid(64, 64, (0.5, 0.5)), "strip")
    sinogram = projector.forward(np.ones((64, 64)))
    plan = radon.FbpPlan(geometry, projector.grid, window={"butterworth": {"order": 4}}, arc="extend")
    solution = radon.osem(projector, sinogram, 5, iterations=2)
    print(plan.reconstruct(sinogram).shape, solution.history["residual"][-1])
    return geometry.angles


def solids() -> float:
    body = revolve.Body([[[0.0, 1.0], [3.0, 0.0]]], revolve.Pose.axis_along_z(1.0))
    coverage, labels = body.coverage((8, 8, 8), 0.5)
    print(coverage.shape, labels.max(), body.mesh().triangles.shape)
    return body.measures(0)["volume"]


def membranes() -> float:
    solved = membrane.Membrane.disc(1.0, rubber={"neo_hookean": {"mu": 1.0}}).solve(volume=1.0)
    stretches: NDArray[np.float64] = solved.rubber_state([0.5])["stretches"]
    heart_phantom.set_threads(heart_phantom.threads())
    return solved.pressure + float(stretches[0, 0])
