"""Parallel-beam tomography: projectors with exact adjoints, filtered back-projection, iterative methods.

Sinograms are `[view][bin]`, images `[y][x]`; centres of n bins or pixels are at `(k - (n - 1) / 2) * pitch`; angles in radians.
`float32` input gives `float32` output; other real numbers are computed in `float64`.

The iterative methods accept any operator with the methods `forward` and `adjoint` and the shapes `image_shape` and `data_shape`; `osem` also
needs `subset(k, n)`, the operator of the views `k, k + n, k + 2 n ...`, the first axis of the data.
"""

from heart_phantom._native import FbpPlan, Geometry, Grid, Projector, Solution, SpectOperator, cgls, fbp, mlem, osem, sirt
from heart_phantom.errors import RadonError

__all__ = [
    "FbpPlan",
    "Geometry",
    "Grid",
    "Projector",
    "RadonError",
    "Solution",
    "SpectOperator",
    "cgls",
    "fbp",
    "mlem",
    "osem",
    "sirt",
]
