"""Reads what `tests/suite/files.rs` wrote with readers that share no code with the writers.

    pip install -r requirements.txt
    python3 check.py FOLDER          (FOLDER holds scene.json and the files it lists)

Every voxel of the volume has a value of its own, a linear function of its place in the lab (cm): each reader says where
it puts each voxel, and that place has to have that value. No flip, shift, swapped axis or other unit passes.
SIMIND's Interfile is read by the parsers of PyTomography, if it is installed (by itself: neither torch nor anything else that
it wants is needed). Of STIR's, whose reader is a C++ library, the keys are read by hand, by its rules.
"""

import importlib.util
import json
import pathlib
import sys
import types

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


def pytomography():
    """PyTomography's module for SIMIND's files, with stand-ins for what it imports and the parsers do not need; None without it."""
    found = importlib.util.find_spec("pytomography")
    if found is None:
        return None
    root = pathlib.Path(found.origin).parent

    class Array(np.ndarray):
        def to(self, _):
            return self

    class Meta:
        def __init__(self, *fields, **named):
            self.fields = fields

    def stand_in(name, **content):
        module = types.ModuleType(name)
        module.__path__ = []
        vars(module).update(content)
        sys.modules[name] = module

    def load(name, path):
        spec = importlib.util.spec_from_file_location(name, root / path)
        module = sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    stand_in("torch", tensor=lambda values: np.asarray(values).view(Array), Tensor=Array)
    stand_in("torch.nn")
    stand_in("pydicom")
    stand_in("pytomography", device=None)
    stand_in("pytomography.io")
    stand_in("pytomography.io.SPECT")
    stand_in("pytomography.metadata")
    stand_in("pytomography.metadata.SPECT", SPECTObjectMeta=Meta, SPECTProjMeta=Meta, SPECTPSFMeta=Meta)
    stand_in("pytomography.utils", get_mu_from_spectrum_interp=None, compute_EW_scatter=None)
    load("pytomography.io.shared", "io/shared/interfile.py")
    return load("pytomography.io.SPECT.simind", "io/SPECT/simind.py")


PYTOMOGRAPHY = pytomography()


def pytomography_places(path):
    """Arrays [x][y][z] of a map; the object that it reconstructs has the same axes."""
    samples = np.asarray(PYTOMOGRAPHY.get_attenuation_map(str(path)))
    assert samples.shape == tuple(SHAPE)
    return samples.ravel(order="F"), (indices() - (SHAPE - 1) / 2) * SPACING


def check_pytomography_stack(path, expected, angles, pitch):
    """Each sample is where its projector has it (`rotate_detector_z` and a sum along x): from angle beta the detector is at
    (-sin beta, -cos beta) of the array [x][y], which is the lab, and bins lie along (cos beta, -sin beta)."""
    samples = np.asarray(PYTOMOGRAPHY.get_projections(str(path)))  # [view][bin][row]
    _, projections = PYTOMOGRAPHY.get_metadata(str(path))
    (bins, rows), spacing, beta, radii = projections.fields
    assert (bins, rows) == (scene["bins"], scene["rows"])
    np.testing.assert_allclose(spacing, pitch, rtol=1e-6)
    np.testing.assert_allclose(radii, scene["radius"], rtol=1e-6)  # cm
    beta = np.radians(beta)
    # Angles are read in single precision.
    np.testing.assert_allclose(-np.sin(beta), -np.sin(angles), atol=1e-6)
    np.testing.assert_allclose(-np.cos(beta), np.cos(angles), atol=1e-6)
    along = np.cos(beta) * np.cos(angles) - np.sin(beta) * np.sin(angles)  # theirs in the direction of ours
    for view, seen in enumerate(samples):
        way = int(np.rint(along[view]))
        assert abs(along[view] - way) < 1e-6
        np.testing.assert_allclose(seen[::way].T, expected[view], atol=2e-5)


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


def check_field(entry, path):
    """Vectors, linear in the place in the lab: 3 x 3 numbers and an offset. Who knows a world has them along its axes, in mm."""
    lab = entry["origin"] + indices() * SPACING
    expected = lab @ np.array(entry["gradient"]).T + entry["offset"]
    vectors = entry["of"] != "Components"
    lps = 10 * expected if vectors else expected
    ras = lps * [-1, -1, 1] if vectors else expected
    shape = tuple(SHAPE)

    def close(found, wanted):
        np.testing.assert_allclose(found.reshape(-1, 3), wanted, atol=2e-4, err_msg=str(entry))

    if entry["format"] in ("npy", "npz"):
        found = np.load(path)
        found = found["samples"] if entry["format"] == "npz" else found
        assert found.shape == shape[::-1] + (3,) and found.dtype == np.float32
        close(found, expected)
        return
    if entry["format"].startswith("nifti"):
        image = nibabel.load(path)
        assert image.shape == shape + (1, 3), image.shape
        code = 1006 if entry["of"] == "Displacement" else 1007
        assert int(image.header["intent_code"]) == code
        found = np.asanyarray(image.dataobj)[..., 0, :]
        close(found.transpose(2, 1, 0, 3), ras)
        places = nibabel.affines.apply_affine(image.affine, indices()) @ np.linalg.inv(RAS_FROM_LAB)
        np.testing.assert_allclose(places, lab, atol=1e-4)
    image = sitk.ReadImage(str(path))
    assert image.GetNumberOfComponentsPerPixel() == 3 and image.GetSize() == tuple(int(n) for n in SHAPE)
    # ITK turns displacements of NIfTI into its own world, LPS, and leaves any other vector as it is.
    turned = entry["of"] == "Displacement" or not entry["format"].startswith("nifti")
    close(sitk.GetArrayFromImage(image), lps if turned else ras)
    first = image.TransformIndexToPhysicalPoint((0, 0, 0))
    np.testing.assert_allclose(first, 10 * np.array(entry["origin"]), atol=1e-3)


def check_stack(entry, path):
    bins, rows, pitch = scene["bins"], scene["rows"], np.array(scene["pitch"])
    angles = np.array(entry["angles"])
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
        turned = np.arange(n) * float(header["extent of rotation"]) / n
        turned *= {"CCW": 1, "CW": -1}[header["direction of rotation"]]
        start = float(header["start angle"])
        assert float(header["radius"]) == 10 * scene["radius"]
        samples = samples.reshape(shape)[:, ::-1]  # rows from head to feet
        if entry["format"] == "interfile-simind":
            samples = samples[:, :, ::-1]  # as a camera in front of the patient shows them
            if PYTOMOGRAPHY:
                check_pytomography_stack(path, expected, angles, pitch)
        else:
            np.testing.assert_allclose((start + turned - np.degrees(angles) + 180) % 360, 180)
    assert samples.shape == shape and samples.dtype == np.float32, entry
    np.testing.assert_allclose(samples, expected, atol=2e-5)


for entry in scene["files"]:
    path = folder / entry["name"]
    for reader in READERS[entry["format"]]:
        check_volume(entry, *reader(path))
    if PYTOMOGRAPHY and (entry["format"], entry["type"]) == ("interfile-simind", "float32"):
        check_volume(entry, *pytomography_places(path))
    if entry["format"] == "npy":
        check_volume(entry, *npy_places(path, entry))
for entry in scene["stacks"]:
    check_stack(entry, folder / entry["name"])
for entry in scene["fields"]:
    check_field(entry, folder / entry["name"])
if not PYTOMOGRAPHY:
    print("without PyTomography: SIMIND's angles are not checked")
print(f"{len(scene['files']) + len(scene['stacks']) + len(scene['fields'])} files agree")
