"""Images and geometry of RTK (https://www.openrtk.org): its axis of rotation is y, so that an array of a volume is [y][z][x]."""
import itk
import numpy as np
from itk import RTK as toolkit

VOLUME = itk.Image[itk.F, 3]


def image(array):
    """An image with unit spacing about the origin."""
    out = itk.image_from_array(np.ascontiguousarray(array, np.float32))
    out.SetOrigin([-(n - 1) / 2 for n in array.shape[::-1]])
    return out


def empty(shape):
    return image(np.zeros(shape, np.float32))


def geometry(angles, threads):
    """Parallel rays (a distance of the detector of 0) at these angles."""
    itk.MultiThreaderBase.SetGlobalMaximumNumberOfThreads(threads)
    itk.MultiThreaderBase.SetGlobalDefaultNumberOfThreads(threads)
    out = toolkit.ThreeDCircularProjectionGeometry.New()
    for angle in np.degrees(angles):
        out.AddProjection(1000.0, 0.0, float(angle))
    return out
