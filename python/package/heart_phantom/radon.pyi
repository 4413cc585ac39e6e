from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Optional, Protocol, Union, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heart_phantom.errors import RadonError as RadonError

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

_Doubles = NDArray[np.float64]
# float32 of float32, else float64.
_Samples = NDArray[Any]
_Order = Literal["view-slice-bin", "slice-view-bin"]
_Window = Union[
    Literal["ram-lak", "shepp-logan", "cosine", "hamming", "hann"],
    Mapping[str, Union[Mapping[str, int], Sequence[float]]],
]
class _Bar(Protocol):
    total: Any
    def update(self, n: float, /) -> object: ...

_Progress = Union[Callable[[float], object], _Bar, Literal[True]]

class _Operator(Protocol):
    @property
    def image_shape(self) -> tuple[int, ...]: ...
    @property
    def data_shape(self) -> tuple[int, ...]: ...
    def forward(self, image: _Samples, /) -> ArrayLike: ...
    def adjoint(self, data: _Samples, /) -> ArrayLike: ...

class _Subsets(_Operator, Protocol):
    def subset(self, k: int, n: int, /) -> _Operator: ...

@final
class Geometry:
    def __new__(cls, angles: ArrayLike, n_bins: int, pitch: float = 1.0, *, offset: float = 0.0) -> Geometry: ...
    @staticmethod
    def from_radians(angles: ArrayLike, n_bins: int, pitch: float = 1.0, *, offset: float = 0.0) -> Geometry: ...
    @staticmethod
    def from_degrees(angles: ArrayLike, n_bins: int, pitch: float = 1.0, *, offset: float = 0.0) -> Geometry: ...
    @staticmethod
    def half_turn(n_views: int, n_bins: int, pitch: float = 1.0) -> Geometry: ...
    @staticmethod
    def full_turn(n_views: int, n_bins: int, pitch: float = 1.0) -> Geometry: ...
    def with_rotation_bin(self, bin: float) -> Geometry: ...
    @property
    def angles(self) -> _Doubles: ...
    @property
    def bins(self) -> _Doubles: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def pitch(self) -> float: ...
    @property
    def offset(self) -> float: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Grid:
    def __new__(
        cls,
        nx: int,
        ny: int,
        spacing: Union[float, Sequence[float]] = 1.0,
        *,
        centre: Sequence[float] = (0.0, 0.0),
    ) -> Grid: ...
    @staticmethod
    def square(n: int, spacing: float = 1.0) -> Grid: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def spacing(self) -> tuple[float, float]: ...
    @property
    def centre(self) -> tuple[float, float]: ...
    @property
    def x(self) -> _Doubles: ...
    @property
    def y(self) -> _Doubles: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __getnewargs_ex__(self) -> tuple[tuple[int, int, tuple[float, float]], dict[str, tuple[float, float]]]: ...

@final
class FbpPlan:
    def __new__(
        cls,
        geometry: Geometry,
        grid: Grid,
        *,
        window: Optional[_Window] = None,
        cutoff: float = 1.0,
        interpolation: Literal["linear", "band-limited"] = "linear",
        edge: Literal["zero", "ellipse"] = "zero",
        arc: Optional[Literal["complete", "extend", "truncate", "rescale"]] = None,
        ramp: bool = True,
        region: Optional[tuple[tuple[int, int], tuple[int, int]]] = None,
        method: Literal["auto", "direct", "fourier"] = "auto",
        memory: Optional[int] = None,
    ) -> FbpPlan: ...
    def reconstruct(
        self, sinogram: ArrayLike, *, order: _Order = "view-slice-bin", progress: Optional[_Progress] = None
    ) -> _Samples: ...
    def adjoint(self, image: ArrayLike, *, progress: Optional[_Progress] = None) -> _Samples: ...
    @property
    def image_shape(self) -> tuple[int, int]: ...
    @property
    def geometry(self) -> Geometry: ...
    @property
    def grid(self) -> Grid: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Geometry, Grid], dict[str, Any]]: ...

@final
class Projector:
    def __new__(
        cls, geometry: Geometry, grid: Grid, kernel: Literal["joseph", "strip"] = "joseph"
    ) -> Projector: ...
    def forward(
        self, image: ArrayLike, *, order: _Order = "view-slice-bin", progress: Optional[_Progress] = None
    ) -> _Samples: ...
    def adjoint(
        self, sinogram: ArrayLike, *, order: _Order = "view-slice-bin", progress: Optional[_Progress] = None
    ) -> _Samples: ...
    @property
    def image_shape(self) -> tuple[int, int]: ...
    @property
    def data_shape(self) -> tuple[int, int]: ...
    @property
    def geometry(self) -> Geometry: ...
    @property
    def grid(self) -> Grid: ...
    def __getnewargs__(self) -> tuple[Geometry, Grid, str]: ...

@final
class SpectOperator:
    def __new__(
        cls,
        geometry: Geometry,
        grid: Grid,
        n_layers: int,
        layer_spacing: float,
        radius: ArrayLike,
        *,
        n_rows: Optional[int] = None,
        row_pitch: Optional[float] = None,
        collimator: Optional[Mapping[str, Any]] = None,
        attenuation: Optional[ArrayLike] = None,
        tolerance: float = 1e-3,
        progress: Optional[_Progress] = None,
    ) -> SpectOperator: ...
    def forward(self, image: ArrayLike, *, progress: Optional[_Progress] = None) -> _Samples: ...
    def adjoint(self, data: ArrayLike, *, progress: Optional[_Progress] = None) -> _Samples: ...
    @property
    def image_shape(self) -> tuple[int, int, int]: ...
    @property
    def data_shape(self) -> tuple[int, int, int]: ...
    @property
    def geometry(self) -> Geometry: ...
    @property
    def grid(self) -> Grid: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class Solution:
    @property
    def image(self) -> _Samples: ...
    @property
    def iterations(self) -> int: ...
    @property
    def stopped_by(self) -> Optional[Literal["max-iterations", "residual", "gradient", "change", "solved"]]: ...
    @property
    def history(self) -> dict[str, _Doubles]: ...

def fbp(
    sinogram: ArrayLike,
    angles: ArrayLike,
    *,
    pitch: float = 1.0,
    offset: float = 0.0,
    n: Optional[int] = None,
    window: Optional[_Window] = None,
    cutoff: float = 1.0,
    progress: Optional[_Progress] = None,
) -> _Samples: ...
def mlem(
    operator: Union[Projector, SpectOperator, _Operator],
    data: ArrayLike,
    *,
    start: Optional[ArrayLike] = None,
    background: Optional[ArrayLike] = None,
    iterations: int = 50,
    residual: Optional[float] = None,
    change: Optional[float] = None,
    order: _Order = "view-slice-bin",
    progress: Optional[_Progress] = None,
) -> Solution: ...
def osem(
    operator: Union[Projector, SpectOperator, _Subsets],
    data: ArrayLike,
    subsets: int,
    *,
    start: Optional[ArrayLike] = None,
    background: Optional[ArrayLike] = None,
    iterations: int = 50,
    residual: Optional[float] = None,
    change: Optional[float] = None,
    order: _Order = "view-slice-bin",
    progress: Optional[_Progress] = None,
) -> Solution: ...
def sirt(
    operator: Union[Projector, SpectOperator, _Operator],
    data: ArrayLike,
    *,
    start: Optional[ArrayLike] = None,
    relaxation: float = 1.0,
    lower: Optional[float] = None,
    upper: Optional[float] = None,
    iterations: int = 50,
    residual: Optional[float] = None,
    change: Optional[float] = None,
    order: _Order = "view-slice-bin",
    progress: Optional[_Progress] = None,
) -> Solution: ...
def cgls(
    operator: Union[Projector, SpectOperator, _Operator],
    data: ArrayLike,
    *,
    start: Optional[ArrayLike] = None,
    gradient: Optional[float] = None,
    iterations: int = 50,
    residual: Optional[float] = None,
    change: Optional[float] = None,
    order: _Order = "view-slice-bin",
    progress: Optional[_Progress] = None,
) -> Solution: ...
