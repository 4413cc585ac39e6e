"""Solids of revolution: exact chords, measures and views, coverage of voxels, meshes. Centimetres and radians."""

from heart_phantom._native import Body, Meridian, Mesh, Pose
from heart_phantom.errors import RevolveError

__all__ = ["Body", "Meridian", "Mesh", "Pose", "RevolveError"]
