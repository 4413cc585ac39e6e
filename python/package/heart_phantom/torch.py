"""Operators of `heart_phantom.radon` for PyTorch: differentiable, on batches, and as a physics of deepinv.

Needs PyTorch (`pip install "heart-phantom[torch]"`), which is imported by the first call. Tensors have any leading axes (batch, channel)
before the shape of an image or of data; `float32` and `float64` are computed in their precision, on the CPU.

>>> import torch
>>> from heart_phantom.radon import Geometry, Grid, Projector
>>> from heart_phantom.torch import forward
>>> projector = Projector(Geometry.half_turn(12, 16), Grid.square(16))
>>> x = torch.ones(2, 1, 16, 16, requires_grad=True)
>>> sinogram = forward(projector, x)
>>> tuple(sinogram.shape)
(2, 1, 12, 16)
>>> sinogram.sum().backward()
>>> tuple(x.grad.shape)
(2, 1, 16, 16)
"""

from __future__ import annotations

import functools
import inspect
import math
from importlib import import_module
from typing import TYPE_CHECKING, Any, Callable

import numpy as np

from heart_phantom.radon import FbpPlan, Projector

if TYPE_CHECKING:
    import torch
    from numpy.typing import NDArray

    _Map = Callable[[NDArray[Any]], NDArray[Any]]

__all__ = ["adjoint", "forward", "physics"]


def forward(operator: Any, x: torch.Tensor) -> torch.Tensor:
    """A x, differentiable: its gradient applies the exact adjoint of A.

    Parameters
    ----------
    operator : Projector, SpectOperator, FbpPlan or any operator
        A. Of an `FbpPlan` the reconstruction of a sinogram. Other operators need the methods `forward` and `adjoint` and the shapes
        `image_shape` and `data_shape`.
    x : torch.Tensor
        Images `[..., *image_shape]`; of an `FbpPlan` sinograms `[..., view, bin]`.

    Returns
    -------
    torch.Tensor
        Data `[..., *data_shape]` on the device of `x`; of an `FbpPlan` images.

    Raises
    ------
    TypeError
        If `x` is neither `float32` nor `float64`.
    ValueError
        If the last axes of `x` have another shape.
    """
    ahead, back = _maps(operator)
    return _linear().apply(x, ahead, back)  # type: ignore[no-any-return]


def adjoint(operator: Any, y: torch.Tensor) -> torch.Tensor:
    """The adjoint of A, differentiable: its gradient applies A.

    Parameters
    ----------
    operator : Projector, SpectOperator, FbpPlan or any operator
        A, as in `forward`.
    y : torch.Tensor
        Data `[..., *data_shape]`; of an `FbpPlan` images.

    Returns
    -------
    torch.Tensor
        Images `[..., *image_shape]` on the device of `y`; of an `FbpPlan` sinograms.

    Raises
    ------
    TypeError
        If `y` is neither `float32` nor `float64`.
    ValueError
        If the last axes of `y` have another shape.
    """
    ahead, back = _maps(operator)
    return _linear().apply(y, back, ahead)  # type: ignore[no-any-return]


def physics(operator: Any, **options: Any) -> Any:
    """The `deepinv.physics.LinearPhysics` of an operator, for images `[batch][channel]`.

    Parameters
    ----------
    operator : Projector, SpectOperator or any operator
        A, as in `forward`.
    **options
        Passed to `LinearPhysics`, for example `noise_model`.

    Returns
    -------
    deepinv.physics.LinearPhysics
        With `A` and `A_adjoint` of the operator, and `img_size` of one channel unless given.
    """
    options.setdefault("img_size", (1, *_shapes(operator)[0]))
    linear = import_module("deepinv.physics").LinearPhysics
    return linear(
        A=lambda x, **_: forward(operator, x), A_adjoint=lambda y, **_: adjoint(operator, y), **options
    )


def _shapes(operator: Any) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Shapes of the input and of the output of an operator."""
    if isinstance(operator, FbpPlan):
        return operator.geometry.shape, operator.image_shape
    return tuple(operator.image_shape), tuple(operator.data_shape)


def _maps(operator: Any) -> tuple[_Map, _Map]:
    """An operator and its adjoint as maps of arrays with leading axes."""
    before, after = _shapes(operator)
    if isinstance(operator, FbpPlan):
        # Slices of a stack: one traversal of the weights for all of them.
        ahead: _Map = lambda x: operator.reconstruct(x, order="slice-view-bin")
        return _batched(ahead, before, after), _batched(operator.adjoint, after, before)
    if isinstance(operator, Projector):
        ahead = lambda x: operator.forward(x, order="slice-view-bin")
        back: _Map = lambda y: operator.adjoint(y, order="slice-view-bin")
        return _batched(ahead, before, after), _batched(back, after, before)
    return _batched(_each(operator.forward), before, after), _batched(_each(operator.adjoint), after, before)


def _each(one: _Map) -> _Map:
    """Applies a map to each entry of a batch."""
    # A copy of one entry is avoided.
    return lambda batch: one(batch[0])[None] if len(batch) == 1 else np.stack([one(entry) for entry in batch])


def _batched(stack: _Map, before: tuple[int, ...], after: tuple[int, ...]) -> _Map:
    """Replaces any leading axes by one."""

    def apply(x: NDArray[Any]) -> NDArray[Any]:
        lead = x.shape[: max(x.ndim - len(before), 0)]
        if x.shape[len(lead) :] != before:
            raise ValueError(f"the tensor has the shape {x.shape}, expected (..., {', '.join(map(str, before))})")
        n = math.prod(lead)
        if n == 0:
            return np.zeros(lead + after, x.dtype)
        return np.asarray(stack(x.reshape((n, *before)))).reshape(lead + after)

    return apply


@functools.lru_cache(maxsize=None)
def _linear() -> Any:
    """The `torch.autograd.Function` of a linear map with a known adjoint."""
    import torch

    class Linear(torch.autograd.Function):
        @staticmethod
        def forward(x: torch.Tensor, ahead: _Map, back: _Map) -> torch.Tensor:
            if x.dtype not in (torch.float32, torch.float64):
                raise TypeError(f"the tensor is {x.dtype}; it must be float32 or float64")
            return torch.from_numpy(ahead(x.detach().cpu().numpy())).to(x.device)

        @staticmethod
        def setup_context(ctx: Any, inputs: tuple[Any, ...], output: torch.Tensor) -> None:
            _, ctx.ahead, ctx.back = inputs

        @staticmethod
        def backward(ctx: Any, grad: torch.Tensor) -> tuple[Any, ...]:
            return Linear.apply(grad, ctx.back, ctx.ahead), None, None

        @staticmethod
        def jvp(ctx: Any, tangent: torch.Tensor, *_: Any) -> Any:
            return Linear.apply(tangent, ctx.ahead, ctx.back)

    # `apply` asks for it with each call, and would compute it each time.
    Linear.forward.__signature__ = inspect.signature(Linear.forward)  # type: ignore[attr-defined]
    return Linear
