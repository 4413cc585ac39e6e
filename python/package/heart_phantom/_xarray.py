"""Products of a phantom as an xarray dataset."""

from collections.abc import Sequence
from importlib import import_module
from typing import Any, Optional

import numpy as np

from heart_phantom._native import Phantom
from heart_phantom._progress import parts

_DIMENSIONS = {
    "projections": ("gate", "view", "row", "bin"),
    "truth": ("gate", "z", "y", "x"),
    "reconstruction": ("gate", "z", "y", "x"),
}


def dataset(phantom: Phantom, products: Sequence[str], progress: Optional[Any]) -> Any:
    """Returns the products of all gates with the coordinates of their axes."""
    xarray = import_module("xarray")
    for product in products:
        if product not in _DIMENSIONS:
            raise ValueError(f"products contains {product!r}; it may contain {', '.join(_DIMENSIONS)}")
    scene, times, geometry = phantom.scene, phantom.view_times(), phantom.geometry()
    n_rows, pitch = scene["camera.rows"], scene["camera.pitch"][1]
    made = {
        "projections": lambda part: phantom.views_of_gates(progress=part),
        "truth": lambda part: phantom.truth_of_gates(progress=part),
        "reconstruction": lambda part: np.stack(
            [phantom.volume(gate, progress=own) for gate, own in enumerate(parts(part, phantom.n_gates))]
        ),
    }
    axes = {
        name: (name, origin + spacing * np.arange(n), {"units": "cm"})
        for name, origin, spacing, n in zip("zyx", phantom.origin, phantom.spacing, phantom.shape)
    }
    rows = (np.arange(n_rows) - (n_rows - 1) / 2) * pitch
    return xarray.Dataset(
        {name: (_DIMENSIONS[name], made[name](part)) for name, part in zip(products, parts(progress, len(products)))},
        coords={
            "angle": ("view", times["angle"], {"units": "rad"}),
            "start": ("view", times["start"], {"units": "s"}),
            "row": ("row", rows, {"units": "cm"}),
            "bin": ("bin", geometry.bins, {"units": "cm"}),
            **axes,
        },
        attrs={"scene": scene.to_toml()},
    )
