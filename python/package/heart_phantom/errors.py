"""What can go wrong. Every message has the numbers that show why."""

from typing import Optional


class HeartPhantomError(ValueError):
    """Something given makes no sense, or no phantom, image or shape comes of it."""


class SceneError(HeartPhantomError):
    """A scene makes no sense, or cannot be computed."""

    #: The file, if it came from one.
    file: Optional[str] = None
    #: Line in the text, from 1; None for a scene that is no text, or a field that the text leaves out.
    line: Optional[int] = None
    #: Column in the text, from 1.
    column: Optional[int] = None
    #: The field, such as `camera.views` or `defects.1.s`; empty where the text is no TOML.
    field: str = ""
    #: What stands there; empty where nothing does.
    given: str = ""
    #: What would be right.
    wanted: str = ""


class RadonError(HeartPhantomError):
    """A sinogram, an image or what is asked of them makes no sense."""


class RevolveError(HeartPhantomError):
    """A solid, its rays or its voxels make no sense."""


class MembraneError(HeartPhantomError):
    """A membrane makes no sense, or has no equilibrium of that kind."""
