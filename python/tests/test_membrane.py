"""Membranes against closed forms."""

import numpy as np
import pytest

from heart_phantom.membrane import Membrane, MembraneError, solve_pair

BALLOON = Membrane.balloon(8.5, 1.75)


def turned(points):
    """Volume of the solid bounded by a curve [x, y] mirrored about y = 0, by cones between fine points."""
    x, r = points[:, 0], np.maximum(points[:, 1], 0)
    return float(np.sum(np.pi / 3 * np.diff(x) * (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2)))


def test_both_discretisations_reach_the_pressure_of_the_study():
    spectral = BALLOON.solve(volume_gain=0.6)
    assert spectral.intensity == pytest.approx(17.48357527761, abs=1e-10)
    # Second order: four times the nodes, a sixteenth of the error.
    errors = [abs(BALLOON.solve(volume_gain=0.6, nodes=n).intensity - 17.48357527761) for n in (101, 401)]
    assert 14 < errors[0] / errors[1] < 18
    at_rest = 8.5 * np.pi * 1.75**2 + 2 / 3 * np.pi * 1.75**3
    assert spectral.volume == pytest.approx(1.6 * at_rest, rel=1e-12)
    fine = spectral.at(np.linspace(0, 0.5, 20001))
    assert turned(fine) == pytest.approx(spectral.volume, rel=1e-7)
    assert (spectral.points.shape[0], spectral.points.shape[1]) == (len(spectral.positions), 2)
    assert spectral.report()["residual"] < 1e-9


def test_controls_are_consistent():
    solved = BALLOON.solve(volume_gain=0.3)
    for control in (
        {"volume": solved.volume},
        {"intensity": solved.intensity},
        {"total_force": solved.intensity * solved.surface},
        {"area": solved.area},
    ):
        again = BALLOON.solve(**control)
        assert again.intensity == pytest.approx(solved.intensity, rel=1e-9)
        assert again.volume == pytest.approx(solved.volume, rel=1e-9)


def test_a_sphere_of_rubber_has_the_pressure_of_the_closed_form():
    # Neo-Hookean: p = 2 mu h / r (1/l - 1/l^7). A half sphere is in equilibrium if its edge may move; that of a balloon is fixed, so that
    # the formula applies far from the edge: the tip of a long balloon is not a sphere, but its tensions follow from the energy.
    rubber = {"neo_hookean": {"mu": 3.0}}
    disc = Membrane.disc(1.0, rubber=rubber)
    blown = disc.solve(volume=1.2)
    apex = blown.rubber_state([0.5])
    l1, l2, l3 = apex["stretches"][0]
    assert l1 == pytest.approx(l2, rel=1e-9)
    assert l1 * l2 * l3 == pytest.approx(1.0, rel=1e-12)
    # Stress of neo-Hookean rubber: mu (l1^2 - l3^2).
    assert apex["stresses"][0, 0] == pytest.approx(3.0 * (l1**2 - l3**2), rel=1e-9)
    # Laplace's law at the apex, p = 2 T / R, with the radius of curvature there.
    s = 0.5 + np.array([-1e-3, 0, 1e-3])
    (x0, y0), (x1, y1), (x2, y2) = blown.at(s)
    radius = (y0 - y2) ** 2 / 8 / (x1 - (x0 + x2) / 2)
    tension = apex["tensions"][0, 0]
    assert blown.pressure == pytest.approx(2 * tension / radius, rel=1e-4)
    # The modulus scales only the pressure.
    other = Membrane.disc(1.0, rubber={"neo_hookean": {"mu": 6.0}}, thickness=0.5).solve(volume=1.2)
    assert other.pressure == pytest.approx(blown.pressure, rel=1e-9)
    with pytest.raises(MembraneError):
        BALLOON.solve(volume_gain=0.1).rubber_state([0.5])


def test_the_wall_volume_is_constant():
    outer = Membrane.balloon(8.5, 2.75)
    pair = solve_pair(BALLOON, outer, 0.6)
    assert abs(pair.wall_volume_error) < 1e-12
    rest = np.pi * (2.75**2 - 1.75**2) * 8.5 + 2 / 3 * np.pi * (2.75**3 - 1.75**3)
    assert pair.wall_volume == pytest.approx(rest, rel=1e-12)
    assert pair.inner.intensity == pytest.approx(17.48357527761, abs=1e-9)
    assert pair.outer.intensity == pytest.approx(10.30942447850, abs=1e-9)
    assert repr(pair).startswith("<PairEquilibrium: cavity ")


def test_a_membrane_may_have_any_curve_and_stiffness():
    half = np.pi * (0.5 - np.arange(101) / 100)
    curve = np.column_stack([8 * np.cos(half), 2.5 * np.sin(half)])
    even = Membrane.polyline(curve, stiffness=2.0).solve(volume_gain=0.2, nodes=201)
    same = Membrane.polyline(curve, stiffness=[2.0, 2.0, 2.0]).solve(volume_gain=0.2, nodes=201)
    assert even.intensity == pytest.approx(same.intensity, rel=1e-9)
    assert even.intensity == pytest.approx(2 * Membrane.polyline(curve).solve(volume_gain=0.2, nodes=201).intensity)
    assert repr(Membrane.disc(1.0)) == "<Membrane: of springs, apex at 0 cm in the reference configuration>"


@pytest.mark.parametrize(
    ("make", "kind", "words"),
    [
        (lambda: Membrane.balloon(-1.0, 1.75), MembraneError, "-1"),
        (lambda: Membrane.disc(float("nan")), MembraneError, "NaN|finite|radius"),
        (lambda: Membrane.balloon(8.5, 1.75, stiffness=0.0), MembraneError, "stiffness"),
        (lambda: Membrane.balloon(8.5, 1.75, stiffness=[1.0]), MembraneError, "samples"),
        (lambda: Membrane.balloon(8.5, 1.75, thickness=1.0), ValueError, "thickness is given, which only rubber"),
        (lambda: Membrane.balloon(8.5, 1.75, law="x"), ValueError, "law: unknown name `x`"),
        (lambda: Membrane.disc(1.0, rubber={"gum": {}}), ValueError, "rubber"),
        (lambda: Membrane.disc(1.0, rubber={"neo_hookean": {"mu": -1.0}}), MembraneError, "mu"),
        (lambda: BALLOON.solve(), ValueError, "none is given"),
        (lambda: BALLOON.solve(volume=1.0, area=2.0), ValueError, "several are given"),
        (lambda: BALLOON.solve(volume=-1.0), MembraneError, "volume"),
        (lambda: BALLOON.solve(volume_gain=float("inf")), MembraneError, "volume gain"),
        (lambda: BALLOON.solve(volume_gain=0.1, nodes=2), MembraneError, "node"),
        (lambda: BALLOON.solve(volume_gain=0.1, nodes=101, degree=12), ValueError, "give one of them"),
        (lambda: BALLOON.solve(volume_gain=0.1).at([np.nan]), MembraneError, "s "),
        (lambda: solve_pair(BALLOON, BALLOON, 0.1), MembraneError, "enclose|volume"),
        (lambda: Membrane(), TypeError, "constructor|create"),
    ],
)
def test_invalid_input_is_an_error_with_a_message(make, kind, words):
    with pytest.raises(kind, match=words):
        make()
