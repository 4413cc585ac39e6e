"""Exceptions and warnings. Messages contain the given values and the allowed ones."""

from typing import Optional


class HeartPhantomError(ValueError):
    """An invalid argument, or a computation that failed."""


class SceneError(HeartPhantomError):
    """An invalid scene, or a scene that cannot be computed."""

    #: The scene file, if any.
    file: Optional[str] = None
    #: Line, from 1; None if the scene has no text or the text lacks the field.
    line: Optional[int] = None
    #: Column, from 1.
    column: Optional[int] = None
    #: The field, such as `camera.views` or `defects.1.s`; empty if the text is not valid TOML.
    field: str = ""
    #: The value; empty if there is none.
    given: str = ""
    #: The allowed values.
    wanted: str = ""


class SceneWarning(UserWarning):
    """A value of a scene that is allowed, but probably not intended."""


class RadonError(HeartPhantomError):
    """Invalid sinograms, images or options."""


class RevolveError(HeartPhantomError):
    """Invalid solids, rays or voxels."""


class MembraneError(HeartPhantomError):
    """An invalid membrane, or no equilibrium at the prescribed quantity."""
