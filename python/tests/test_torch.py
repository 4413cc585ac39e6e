"""Operators in PyTorch: gradients against differences, and the test of adjoints of deepinv."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from heart_phantom import radon  # noqa: E402
from heart_phantom import torch as hp  # noqa: E402

GEOMETRY, GRID = radon.Geometry.full_turn(6, 7, 0.6), radon.Grid(5, 4, 0.6)
OPERATORS = {
    "projector": radon.Projector(GEOMETRY, GRID),
    "strip": radon.Projector(GEOMETRY, GRID, "strip"),
    "spect": radon.SpectOperator(
        GEOMETRY,
        GRID,
        2,
        0.6,
        6.0,
        collimator={"holes": "ge-lehr", "intrinsic_fwhm": 0.38},
        attenuation=np.full((2, 4, 5), 0.15),
    ),
    "fbp": radon.FbpPlan(GEOMETRY, GRID, window="hann"),
}


def example(operator, lead=()):
    before = operator.geometry.shape if isinstance(operator, radon.FbpPlan) else operator.image_shape
    rng = np.random.default_rng(1)
    return torch.from_numpy(rng.normal(size=lead + before)).requires_grad_()


@pytest.mark.parametrize("name", OPERATORS)
@pytest.mark.filterwarnings("ignore::FutureWarning")  # of PyTorch, about its own functions
def test_gradients_agree_with_differences(name):
    operator = OPERATORS[name]
    x = example(operator, (2,))
    forward = lambda x: hp.forward(operator, x)  # noqa: E731
    # Linear: central differences have only rounding, 1e-16 / 1e-6.
    assert torch.autograd.gradcheck(forward, x, atol=1e-6, rtol=1e-6, check_forward_ad=True)
    assert torch.autograd.gradcheck(lambda x: hp.adjoint(operator, forward(x)), x, atol=1e-6, rtol=1e-6)
    assert torch.autograd.gradgradcheck(lambda x: forward(x) ** 2, x, atol=1e-6, rtol=1e-6)


@pytest.mark.parametrize("name", OPERATORS)
def test_batches_equal_their_entries(name):
    operator = OPERATORS[name]
    x = example(operator, (2, 3)).detach()
    batch = hp.forward(operator, x)
    for i in range(2):
        for j in range(3):
            one = hp.forward(operator, x[i, j])
            torch.testing.assert_close(batch[i, j], one, rtol=0, atol=0)
    single = hp.forward(operator, x.float())
    assert single.dtype == torch.float32
    torch.testing.assert_close(single.double(), batch, rtol=1e-4, atol=1e-5)  # of numbers about one, in single precision
    assert hp.forward(operator, x[:0]).shape == (0, *batch.shape[1:])


def test_wrong_tensors_are_errors():
    operator = OPERATORS["projector"]
    with pytest.raises(TypeError, match="float32 or float64"):
        hp.forward(operator, torch.zeros(operator.image_shape, dtype=torch.float16))
    with pytest.raises(ValueError, match=r"expected \(\.\.\., 4, 5\)"):
        hp.forward(operator, torch.zeros(5, 4))


@pytest.mark.parametrize("name", ["projector", "strip", "spect"])
@pytest.mark.filterwarnings("ignore")
def test_the_physics_passes_the_adjointness_test_of_deepinv(name):
    pytest.importorskip("deepinv")
    operator = OPERATORS[name]
    physics = hp.physics(operator)
    u = torch.zeros(1, 1, *operator.image_shape, dtype=torch.float64)
    assert physics.adjointness_test(u) < 1e-12
    assert physics(u).shape == (1, 1, *operator.data_shape)
