"""A beating heart with exact ground truth: scenes, phantoms, and their parts.

>>> from heart_phantom import Phantom, Scene
>>> phantom = Phantom(Scene().with_size(32))
>>> phantom
<Phantom: 90 views of 32 x 32 samples, 32 x 32 x 32 voxels of 0.5 cm>
>>> round(phantom.numbers()["ejection_fraction"], 6)
0.375

Submodules: `heart_phantom.radon` (tomography), `heart_phantom.revolve` (solids), `heart_phantom.membrane` (membranes),
`heart_phantom.data` (datasets of cohorts), `heart_phantom.torch` (differentiable operators; needs PyTorch).
"""

from collections.abc import Mapping as _Mapping

from heart_phantom import membrane, radon, revolve
from heart_phantom._native import Cohort, Motion, Phantom, RayGeometry, Scene, __version__, set_threads, threads
from heart_phantom.errors import HeartPhantomError, MembraneError, RadonError, RevolveError, SceneError, SceneWarning

__all__ = [
    "Cohort",
    "HeartPhantomError",
    "MembraneError",
    "Motion",
    "Phantom",
    "RadonError",
    "RayGeometry",
    "RevolveError",
    "Scene",
    "SceneError",
    "SceneWarning",
    "__version__",
    "membrane",
    "radon",
    "revolve",
    "set_threads",
    "threads",
]

_Mapping.register(Scene)
