"""Products of a phantom as an xarray dataset."""

from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numpy as np

from heart_phantom._native import Phantom

_DIMENSIONS = {
    "projections": ("gate", "view", "row", "bin"),
    "truth": ("gate", "z", "y", "x"),
    "reconstruction": ("gate", "z", "y", "x"),
}


def dataset(phantom: Phantom, products: Sequence[str]) -> Any:
    """Returns the products of all gates with the coordinates of their axes."""
    xarray = import_module("xarray")
    for product in products:
        if product not in _DIMENSIONS:
            raise ValueError(f"products contains {product!r}; it may contain {', '.join(_DIMENSIONS)}")
    scene, times, geometry = phantom.scene, phantom.view_times(), phantom.geometry()
    n_rows, pitch = scene["camera.rows"], scene["camera.pitch"][1]
    made = {
        "projections": phantom.views_of_gates,
        "truth": phantom.truth_of_gates,
        "reconstruction": lambda: np.stack([phantom.volume(gate) for gate in range(phantom.n_gates)]),
    }
    axes = {
        name: (name, origin + spacing * np.arange(n), {"units": "cm"})
        for name, origin, spacing, n in zip("zyx", phantom.origin, phantom.spacing, phantom.shape)
    }
    rows = (np.arange(n_rows) - (n_rows - 1) / 2) * pitch
    return xarray.Dataset(
        {name: (_DIMENSIONS[name], made[name]()) for name in products},
        coords={
            "angle": ("view", times["angle"], {"units": "rad"}),
            "start": ("view", times["start"], {"units": "s"}),
            "row": ("row", rows, {"units": "cm"}),
            "bin": ("bin", geometry.bins, {"units": "cm"}),
            **axes,
        },
        attrs={"scene": scene.to_toml()},
    )
