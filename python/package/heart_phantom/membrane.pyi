from collections.abc import Mapping
from typing import Any, Literal, Optional, TypedDict, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heart_phantom.errors import MembraneError as MembraneError

__all__ = ["Equilibrium", "Membrane", "MembraneError", "PairEquilibrium", "solve_pair"]

_Doubles = NDArray[np.float64]
_Law = Literal["per-material-length", "total-force", "per-current-length"]
_Rubber = Mapping[str, Mapping[str, Any]]

class _Report(TypedDict):
    iterations: int
    factorisations: int
    residual_calls: int
    load_steps: int
    residual: float
    step: float
    iteration_error: float
    history: list[float]

class _RubberState(TypedDict):
    stretches: _Doubles
    tensions: _Doubles
    stresses: _Doubles

@final
class Membrane:
    @staticmethod
    def balloon(
        h: float,
        radius: float,
        *,
        stiffness: Optional[ArrayLike] = None,
        law: Optional[_Law] = None,
        rubber: Optional[_Rubber] = None,
        thickness: Optional[ArrayLike] = None,
    ) -> Membrane: ...
    @staticmethod
    def disc(
        radius: float,
        *,
        stiffness: Optional[ArrayLike] = None,
        law: Optional[_Law] = None,
        rubber: Optional[_Rubber] = None,
        thickness: Optional[ArrayLike] = None,
    ) -> Membrane: ...
    @staticmethod
    def polyline(
        curve: ArrayLike,
        *,
        stiffness: Optional[ArrayLike] = None,
        law: Optional[_Law] = None,
        rubber: Optional[_Rubber] = None,
        thickness: Optional[ArrayLike] = None,
    ) -> Membrane: ...
    def solve(
        self,
        *,
        load: Optional[float] = None,
        intensity: Optional[float] = None,
        total_force: Optional[float] = None,
        volume: Optional[float] = None,
        volume_gain: Optional[float] = None,
        area: Optional[float] = None,
        tolerance: float = 1e-12,
        degree: Optional[int] = None,
        nodes: Optional[int] = None,
    ) -> Equilibrium: ...

@final
class Equilibrium:
    @property
    def intensity(self) -> float: ...
    @property
    def load(self) -> float: ...
    @property
    def pressure(self) -> float: ...
    @property
    def length(self) -> float: ...
    @property
    def area(self) -> float: ...
    @property
    def surface(self) -> float: ...
    @property
    def volume(self) -> float: ...
    @property
    def points(self) -> _Doubles: ...
    @property
    def positions(self) -> _Doubles: ...
    def at(self, s: ArrayLike) -> _Doubles: ...
    def rubber_state(self, s: ArrayLike) -> _RubberState: ...
    def report(self) -> _Report: ...

@final
class PairEquilibrium:
    @property
    def inner(self) -> Equilibrium: ...
    @property
    def outer(self) -> Equilibrium: ...
    @property
    def wall_volume(self) -> float: ...
    @property
    def wall_volume_error(self) -> float: ...
    def report(self) -> _Report: ...

def solve_pair(
    inner: Membrane,
    outer: Membrane,
    volume_gain: float,
    *,
    tolerance: float = 1e-12,
    degree: Optional[int] = None,
    nodes: Optional[int] = None,
) -> PairEquilibrium: ...
