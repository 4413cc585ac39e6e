"""Elastic membranes of revolution in equilibrium: springs or rubber, at a pressure, a force or a volume."""

from heart_phantom._native import Equilibrium, Membrane, PairEquilibrium, solve_pair
from heart_phantom.errors import MembraneError

__all__ = ["Equilibrium", "Membrane", "MembraneError", "PairEquilibrium", "solve_pair"]
