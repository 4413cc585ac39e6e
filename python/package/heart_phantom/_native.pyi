# Compiled; the exporting modules document the names.
from collections.abc import Sequence
from os import PathLike
from typing import Union

from heart_phantom import Cohort as Cohort
from heart_phantom import Motion as Motion
from heart_phantom import Phantom as Phantom
from heart_phantom import RayGeometry as RayGeometry
from heart_phantom import Scene as Scene
from heart_phantom import __version__ as __version__
from heart_phantom import set_threads as set_threads
from heart_phantom import threads as threads
from heart_phantom.membrane import Equilibrium as Equilibrium
from heart_phantom.membrane import Membrane as Membrane
from heart_phantom.membrane import PairEquilibrium as PairEquilibrium
from heart_phantom.membrane import solve_pair as solve_pair
from heart_phantom.radon import FbpPlan as FbpPlan
from heart_phantom.radon import Geometry as Geometry
from heart_phantom.radon import Grid as Grid
from heart_phantom.radon import Projector as Projector
from heart_phantom.radon import Solution as Solution
from heart_phantom.radon import SpectOperator as SpectOperator
from heart_phantom.radon import cgls as cgls
from heart_phantom.radon import fbp as fbp
from heart_phantom.radon import mlem as mlem
from heart_phantom.radon import osem as osem
from heart_phantom.radon import sirt as sirt
from heart_phantom.revolve import Body as Body
from heart_phantom.revolve import Meridian as Meridian
from heart_phantom.revolve import Mesh as Mesh
from heart_phantom.revolve import Pose as Pose

__all__ = [
    "Body",
    "Cohort",
    "Equilibrium",
    "FbpPlan",
    "Geometry",
    "Grid",
    "Membrane",
    "Meridian",
    "Mesh",
    "Motion",
    "PairEquilibrium",
    "Phantom",
    "Pose",
    "Projector",
    "RayGeometry",
    "Scene",
    "Solution",
    "SpectOperator",
    "__version__",
    "cgls",
    "command_line",
    "fbp",
    "mlem",
    "osem",
    "set_threads",
    "sirt",
    "solve_pair",
    "threads",
]

def command_line(arguments: Sequence[Union[str, PathLike[str]]]) -> int: ...
