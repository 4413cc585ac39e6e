"""Compares the chords of `examples/shapes.rs` with those of RTK along the geometry in the same files.

    pip install itk-rtk numpy
    cargo run --release -p heart-phantom --example shapes -- FOLDER
    python3 shapes.py FOLDER
"""

import pathlib
import sys

import itk
import numpy as np
from itk import RTK as rtk

folder = pathlib.Path(sys.argv[1])
Image = itk.Image[itk.F, 3]


def rotation(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    i, j = [k for k in range(3) if k != axis] if axis != 1 else (2, 0)
    m = np.eye(3)
    m[i, i], m[i, j], m[j, i], m[j, j] = c, -s, s, c
    return m


# From the lab (cm) to RTK (mm): the axes x, z and -y.
to_rtk = 10.0 * np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
body = rotation(2, -0.4) @ rotation(1, 0.7)
shift = np.array([0.5, -1.0, 0.8])


def quadric(matrix, offset, middle, diagonal, constant, planes=()):
    """The quadric sum d_i y_i^2 + c y'_0 = 0 of y = R^T (x - shift) - middle, clipped by planes at values of y_0."""
    # x = to_rtk (R (y + middle) + offset), so that y = B x + b.
    back = matrix.T @ np.linalg.inv(to_rtk)
    b = -matrix.T @ offset - middle
    q = back.T @ np.diag(diagonal) @ back
    linear = 2.0 * back.T @ (np.array(diagonal) * b)
    last = b @ (np.array(diagonal) * b) + constant
    shape = rtk.QuadricShape.New()
    for name, value in zip("ABCDEFGHIJ", [*np.diag(q), 2 * q[0, 1], 2 * q[0, 2], 2 * q[1, 2], *linear, last]):
        getattr(shape, "Set" + name)(float(value))
    shape.SetDensity(1.0)
    for sign, at in planes:  # inside is sign * y_0 < at
        direction = sign * back[0]
        norm = np.linalg.norm(direction)
        shape.AddClipPlane((direction / norm).tolist(), float((at - sign * b[0]) / norm))
    return shape


eye, none = np.eye(3), np.zeros(3)
slope = 2.5 / 7.0
shapes = {
    "cylinder": quadric(body, shift, none, [0, 1, 1], -4.0, [(1, 4.0), (-1, 3.0)]),
    "cone": quadric(body, shift, np.array([4.0, 0, 0]), [-(slope**2), 1, 1], 0.0, [(1, 0.0), (-1, 7.0)]),
    "ellipsoid": quadric(eye, np.array([1.0, -2.0, 0.5]), none, [1 / 9, 1 / 25, 1 / 16], -1.0),
    "trunk": quadric(eye, np.array([-1.0, 0.5, 0.0]), none, [1 / 361, 1 / 121, 0], -1.0),
}
for name, shape in shapes.items():
    reader = rtk.ThreeDCircularProjectionGeometryXMLFileReader.New()
    reader.SetFilename(str(folder / f"{name}.xml"))
    reader.GenerateOutputInformation()
    views = itk.imread(str(folder / f"{name}.mha"), itk.F)
    zero = rtk.ConstantImageSource[Image].New()
    zero.SetInformationFromImage(views)
    project = rtk.RayConvexIntersectionImageFilter[Image, Image].New()
    project.SetInput(zero.GetOutput())
    project.SetGeometry(reader.GetOutputObject())
    project.SetConvexShape(shape)
    project.Update()
    own, theirs = itk.array_from_image(views), itk.array_from_image(project.GetOutput()) / 10.0
    off = np.abs(own - theirs)
    print(f"{name}: largest chord {own.max():.3f} cm, {np.sum(own > 0)} rays hit, largest difference {off.max() / own.max():.1e} of it")
    assert off.max() < 1e-5 * own.max(), name
