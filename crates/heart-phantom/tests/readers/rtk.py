"""Reconstructs the cone-beam views of `examples/cone_beam.rs` by RTK's FDK, and gives the vectors of its files to ASTRA.

    pip install itk-rtk numpy astra-toolbox
    cargo run --release -p heart-phantom --example cone_beam -- FOLDER
    python3 rtk.py FOLDER

RTK projects a ball along the geometry of the file, which must be the chords of the ball along the lines of the vectors. The wall of the
reconstructed static heart must have its activity, 1, to one per cent, and the centroid that the example prints, to 0.2 voxel.
"""

import pathlib
import sys

import itk
import numpy as np
from itk import RTK as rtk

TRUE_CENTROID = [-0.1139, 0.1610, -0.1139]  # cm, printed by the example

folder = pathlib.Path(sys.argv[1])
Image = itk.Image[itk.F, 3]
reader = rtk.ThreeDCircularProjectionGeometryXMLFileReader.New()
reader.SetFilename(str(folder / "still.xml"))
reader.GenerateOutputInformation()
geometry = reader.GetOutputObject()
views = itk.imread(str(folder / "still.mha"), itk.F)
samples = itk.array_view_from_image(views)
vectors = np.load(folder / "still-vectors.npy") * 10.0  # mm of the lab
n = len(vectors)

# ASTRA has the same samples in its own order.
astra_samples = np.load(folder / "still.npy")
np.testing.assert_array_equal(astra_samples.transpose(1, 0, 2), samples)
try:
    import astra

    shape = astra_samples.shape
    made = astra.create_proj_geom("cone_vec", shape[0], shape[2], vectors)
    angles = 2 * np.pi * np.arange(n) / n
    pitch = np.linalg.norm(vectors[0, 6:9])
    own = astra.create_proj_geom("cone", pitch, pitch, shape[0], shape[2], angles, 600.0, 400.0)
    np.testing.assert_allclose(astra.functions.geom_2vec(own)["Vectors"], made["Vectors"], atol=1e-9)
    print("astra: the vectors are those of its circular cone beam")
except ImportError:
    print("astra: not installed")

# A ball of RTK, off the axis, along the lines of the file, against its chords along the lines of the vectors.
centre, radius = np.array([13.0, -21.0, 17.0]), 25.0  # of the lab
ball = rtk.RayEllipsoidIntersectionImageFilter[Image, Image].New()
zero = rtk.ConstantImageSource[Image].New()
zero.SetInformationFromImage(views)
ball.SetInput(zero.GetOutput())
ball.SetGeometry(geometry)
ball.SetDensity(1.0)
ball.SetCenter([centre[0], centre[2], -centre[1]])
ball.SetAxis([radius] * 3)
ball.Update()
projected = itk.array_from_image(ball.GetOutput())
rows, bins = projected.shape[1:]
j, i = np.meshgrid(np.arange(rows) - (rows - 1) / 2, np.arange(bins) - (bins - 1) / 2, indexing="ij")
worst = 0.0
for k, v in enumerate(vectors):
    d = v[3:6] + i[..., None] * v[6:9] + j[..., None] * v[9:12] - v[0:3]
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    away = np.cross(centre - v[0:3], d)
    chord = 2 * np.sqrt(np.maximum(radius**2 - (away**2).sum(-1), 0.0))
    worst = max(worst, np.abs(chord**2 - projected[k] ** 2).max() / (4 * radius**2))
print(f"rtk: squared chords of a ball differ by {worst:.1e} of the largest one")
assert worst < 1e-5

# FDK of the static heart, 1.5 mm voxels.
size, spacing = 128, 1.5
volume = rtk.ConstantImageSource[Image].New()
volume.SetSize([size] * 3)
volume.SetSpacing([spacing] * 3)
volume.SetOrigin([-0.5 * (size - 1) * spacing] * 3)
fdk = rtk.FDKConeBeamReconstructionFilter[Image].New()
fdk.SetInput(0, volume.GetOutput())
fdk.SetInput(1, views)
fdk.SetGeometry(geometry)
fdk.Update()
image = itk.array_from_image(fdk.GetOutput()) * 10.0  # activity: samples are in cm, voxels in mm
at = (np.arange(size) - (size - 1) / 2) * spacing / 10.0
total = image.sum() * (spacing / 10.0) ** 3
place = [(image.sum((1, 2)) * at).sum(), (image.sum((0, 2)) * at).sum(), (image.sum((0, 1)) * at).sum()]
z, y, x = np.array(place) * (spacing / 10.0) ** 3 / total
wall = np.median(image[image > 0.5])
print(f"fdk: volume of the wall {total:.3f} mL, centroid in the lab ({x:.4f}, {-z:.4f}, {y:.4f}) cm, median of the wall {wall:.4f}")
assert abs(wall - 1.0) < 0.01
assert np.linalg.norm(np.array([x, -z, y]) - TRUE_CENTROID) < 0.2 * spacing / 10.0
