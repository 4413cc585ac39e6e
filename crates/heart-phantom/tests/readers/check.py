"""Reads what `tests/files.rs` wrote with readers that share no code with the writers.

    pip install -r requirements.txt
    python3 check.py FOLDER          (FOLDER holds scene.json and the files it lists)

Every voxel of the volume has a value of its own, a linear function of its place in the lab (cm): each reader says where
it puts each voxel, and that place has to have that value. No flip, shift, swapped axis or other unit passes.
There is no reader for Interfile here that others wrote: its keys are read by hand, by the rules of STIR and SIMIND.
"""

import json
import pathlib
import sys

import nibabel
import nrrd
import numpy as np
import SimpleITK as sitk

folder = pathlib.Path(sys.argv[1])
scene = json.loads((folder / "scene.json").read_text())
SHAPE = np.array(scene["shape"])  # x, y, z
SPACING = np.array(scene["spacing"])
RAS_FROM_LAB = np.diag([-10.0, -10.0, 10.0])  # the lab is left, posterior, superior in cm
LPS_FROM_LAB = np.diag([10.0, 10.0, 10.0])


def indices():
    """All (i, j, k), shape (n, 3), i fastest."""
    k, j, i = np.meshgrid(*(np.arange(n) for n in SHAPE[::-1]), indexing="ij")
    return np.stack([i.ravel(), j.ravel(), k.ravel()], axis=1)


def check_volume(entry, samples, places):
    """samples: flat, places: (n, 3) lab cm of each."""
    assert samples.dtype == np.dtype(entry["type"]), (entry, samples.dtype)
    assert samples.size == SHAPE.prod()
    steps = (places - entry["origin"]) / SPACING  # in voxels from the first one
    voxel = np.rint(steps).astype(int)
    # Headers of 32-bit floats: 1e-6 of a voxel and better at these sizes.
    assert np.abs(steps - voxel).max() < 1e-5, (entry, np.abs(steps - voxel).max())
    assert (voxel >= 0).all() and (voxel < SHAPE).all(), entry
    number = voxel @ [1, SHAPE[0], SHAPE[0] * SHAPE[1]]
    expected = {
        "float32": places @ scene["field"],
        "uint8": number,
        "uint16": 257 * number,
    }[entry["type"]]
    assert np.abs(samples.astype(float) - expected).max() < 1e-4, entry


def nibabel_places(path):
    image = nibabel.load(path)
    for affine, code in (image.get_sform(coded=True), image.get_qform(coded=True)):
        assert code == 1
        np.testing.assert_allclose(affine, image.affine, atol=1e-6)
    assert image.header.get_xyzt_units()[0] == "mm"
    assert nibabel.aff2axcodes(image.affine) == ("L", "P", "S")
    ras = nibabel.affines.apply_affine(image.affine, indices())
    samples = np.asanyarray(image.dataobj).ravel(order="F")
    return samples, ras @ np.linalg.inv(RAS_FROM_LAB)


def itk_places(path):
    image = sitk.ReadImage(str(path))
    lps = np.array([image.TransformIndexToPhysicalPoint([int(n) for n in i]) for i in indices()])
    return sitk.GetArrayFromImage(image).ravel(), lps @ np.linalg.inv(LPS_FROM_LAB)


def nrrd_places(path):
    samples, header = nrrd.read(str(path))
    assert header["space"] == "left-posterior-superior"
    lps = indices() @ header["space directions"] + header["space origin"]
    return samples.ravel(order="F"), lps @ np.linalg.inv(LPS_FROM_LAB)


def interfile(path):
    header = {}
    for line in path.read_text().splitlines():
        if ":=" in line and not line.startswith(";"):
            key, value = line.split(":=", 1)
            header[key.strip(" !").lower()] = value.strip()
    kinds = {"float4": "<f4", "short float4": "<f4", "unsigned integer1": "u1", "unsigned integer2": "<u2"}
    kind = kinds[header["number format"] + header["number of bytes per pixel"]]
    return header, np.fromfile(path.parent / header["name of data file"], dtype=kind)


def stir_places(path):
    """STIR's axes for head in, supine are left, posterior, inferior."""
    header, samples = interfile(path)
    assert (header["patient orientation"], header["patient rotation"]) == ("head_in", "supine")
    first = [float(header[f"first pixel offset (mm) [{a}]"]) for a in (1, 2, 3)]
    step = [float(header[f"scaling factor (mm/pixel) [{a}]"]) for a in (1, 2, 3)]
    lpi = first + indices() * step
    return samples, lpi * [0.1, 0.1, -0.1]


def simind_places(path):
    """Centred; the first slice is the one towards the head."""
    header, samples = interfile(path)
    step = [float(header[f"scaling factor (mm/pixel) [{a}]"]) for a in (1, 2)]
    step.append(-step[0] * float(header["centre-centre slice separation (pixels)"]))
    return samples, (indices() - (SHAPE - 1) / 2) * step / 10


def json_places(path):
    header = json.loads(path.read_text())
    samples = np.fromfile(path.parent / header["data"], dtype=np.dtype(header["type"]).newbyteorder("<"))
    assert header["shape"] == list(SHAPE[::-1])
    return samples, header["origin_cm"] + indices() * header["spacing_cm"]


def npz_places(path):
    arrays = np.load(path)
    assert arrays["samples"].shape == tuple(SHAPE[::-1])
    return arrays["samples"].ravel(), arrays["origin_cm"] + indices() * arrays["spacing_cm"]


def npy_places(path, entry):
    array = np.load(path)
    assert array.shape == tuple(SHAPE[::-1])
    return array.ravel(), entry["origin"] + indices() * SPACING


READERS = {
    "npy": [],
    "npz": [npz_places],
    "nifti": [nibabel_places, itk_places],
    "nifti-gz": [nibabel_places, itk_places],
    "meta-image": [itk_places],
    "meta-image-single": [itk_places],
    "nrrd": [nrrd_places, itk_places],
    "interfile-stir": [stir_places],
    "interfile-simind": [simind_places],
    "raw-json": [json_places],
}


def check_stack(entry, path):
    bins, rows, pitch = scene["bins"], scene["rows"], np.array(scene["pitch"])
    angles = np.array(scene["angles"])
    s = (np.arange(bins) - (bins - 1) / 2) * pitch[0]
    z = (np.arange(rows) - (rows - 1) / 2) * pitch[1]
    expected = (
        np.degrees(angles)[:, None, None] + scene["seen"][0] * s + scene["seen"][1] * z[:, None]
    )
    shape = (len(angles), rows, bins)
    if entry["format"] == "npy":
        samples = np.load(path)
    elif entry["format"] == "npz":
        arrays = np.load(path)
        samples = arrays["samples"]
        np.testing.assert_array_equal(arrays["angles_rad"], angles)
        np.testing.assert_allclose(arrays["first_cm"], [s[0], z[0]])
        np.testing.assert_allclose(arrays["pitch_cm"], pitch)
    elif entry["format"] == "nrrd":
        samples, header = nrrd.read(str(path), index_order="C")
        np.testing.assert_array_equal(np.array(header["angles_rad"].split(), float), angles)
        np.testing.assert_allclose(header["spacings"][:2], 10 * pitch)
        np.testing.assert_allclose([float(header["first_bin_mm"]), float(header["first_row_mm"])], [10 * s[0], 10 * z[0]])
        itk = sitk.ReadImage(str(path))
        np.testing.assert_array_equal(sitk.GetArrayFromImage(itk), samples)
    elif entry["format"] == "raw-json":
        header = json.loads(path.read_text())
        samples = np.fromfile(path.parent / header["data"], dtype="<f4").reshape(header["shape"])
        np.testing.assert_array_equal(header["angles_rad"], angles)
    else:
        header, samples = interfile(path)
        size = [int(header[f"matrix size [{a}]"]) for a in (1, 2)]
        assert size == [bins, rows]
        mm = [float(header[f"scaling factor (mm/pixel) [{a}]"]) for a in (1, 2)]
        np.testing.assert_allclose(mm, 10 * pitch)
        n = int(header["number of projections"])
        assert header["direction of rotation"] == "CCW"
        start = float(header["start angle"]) - (180 if entry["format"] == "interfile-simind" else 0)
        degrees = start + np.arange(n) * float(header["extent of rotation"]) / n
        np.testing.assert_allclose((degrees - np.degrees(angles) + 180) % 360, 180)
        assert float(header["radius"]) == 10 * scene["radius"]
        samples = samples.reshape(shape)[:, ::-1]  # rows from head to feet
    assert samples.shape == shape and samples.dtype == np.float32, entry
    np.testing.assert_allclose(samples, expected, atol=2e-5)


for entry in scene["files"]:
    path = folder / entry["name"]
    for reader in READERS[entry["format"]]:
        check_volume(entry, *reader(path))
    if entry["format"] == "npy":
        check_volume(entry, *npy_places(path, entry))
for entry in scene["stacks"]:
    check_stack(entry, folder / entry["name"])
print(f"{len(scene['files']) + len(scene['stacks'])} files agree")
