"""Reads the files of `tests/suite/files.rs` with readers that share no code with the writers.

    pip install -r requirements.txt
    python3 check.py FOLDER          (FOLDER contains scene.json and the files that it lists)

Every voxel of the volume has a distinct value, a linear function of its position in the lab (cm). At the position that a
reader assigns to a voxel, the value must agree. Any flip, shift, exchange of axes or other unit is detected.
SIMIND's Interfile is read by the parsers of PyTomography, if it is installed (alone: torch and its other dependencies
are not needed), and both kinds by xmedcon, if there is `medcon`. The keys of STIR's, whose reader is a C++ library, are
also read here by its rules.
"""

import importlib.util
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import types

import nibabel
import nrrd
import numpy as np
import pydicom
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
    """PyTomography's modules for SIMIND's files and for DICOM, with stubs for imports that the parsers do not need; None without it."""
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

    shared = ("open_multifile", "open_singlefile", "_get_affine_multifile", "_get_affine_single_file", "align_images_affine")
    stand_in("torch", tensor=lambda values: np.asarray(values).view(Array), Tensor=Array)
    stand_in("torch.nn")
    for name in ("scipy", "rt_utils", "pandas"):
        if importlib.util.find_spec(name) is None:
            stand_in(name, RTStructBuilder=None)
            stand_in(name + ".ndimage", affine_transform=None)
    stand_in("pytomography", device=None, dtype=None, verbose=False)
    stand_in("pytomography.io")
    stand_in("pytomography.io.SPECT")
    stand_in("pytomography.metadata", ObjectMeta=Meta)
    stand_in("pytomography.metadata.SPECT", SPECTObjectMeta=Meta, SPECTProjMeta=Meta, SPECTPSFMeta=Meta, StarGuideProjMeta=Meta)
    stand_in("pytomography.utils", get_mu_from_spectrum_interp=None, compute_EW_scatter=None)
    keys = load("pytomography.io.shared", "io/shared/interfile.py")
    simind = load("pytomography.io.SPECT.simind", "io/SPECT/simind.py")
    of_dicom = load("pytomography.io.shared.dicom", "io/shared/dicom.py")
    vars(keys).update({name: getattr(of_dicom, name) for name in shared}, create_ds=None)
    stand_in("pytomography.io.SPECT.attenuation_map", get_HU2mu_conversion=None)
    return simind, load("pytomography.io.SPECT.dicom", "io/SPECT/dicom.py")


PYTOMOGRAPHY, PYTOMOGRAPHY_DICOM = pytomography() or (None, None)


def pytomography_places(path):
    """Arrays [x][y][z] of a map; the object that it reconstructs has the same axes."""
    samples = np.asarray(PYTOMOGRAPHY.get_attenuation_map(str(path)))
    assert samples.shape == tuple(SHAPE)
    return samples.ravel(order="F"), (indices() - (SHAPE - 1) / 2) * SPACING


def of_an_older_version(path):
    """The same as SIMIND wrote it before its version 8, in whose headers the radius is in cm."""
    text = path.read_text()
    older = text.replace("program version := V8.0", "program version := V6.2")
    older = older.replace(f"Radius := {10 * scene['radius']:g}\n", f"Radius := {scene['radius']:g}\n")
    assert len(older) == len(text) - 1, "a version and a radius were replaced"
    other = path.with_name("older-" + path.name)
    other.write_text(older)
    return other


def check_pytomography_stack(path, expected, angles, pitch, radii):
    """`radii` in cm, of a view each where they differ: then they are in a `.cor` beside. Each sample is where its projector has it (`rotate_detector_z` and a sum along x): from angle beta the detector is at
    (-sin beta, -cos beta) of the array [x][y], which is the lab, and bins lie along (cos beta, -sin beta)."""
    samples = np.asarray(PYTOMOGRAPHY.get_projections(str(path)))  # [view][bin][row]
    beside = path.with_suffix(".cor")
    _, projections = PYTOMOGRAPHY.get_metadata(str(path), str(beside) if np.ndim(radii) else None)
    (bins, rows), spacing, beta, found = projections.fields
    assert (bins, rows) == (scene["bins"], scene["rows"])
    np.testing.assert_allclose(spacing, pitch, rtol=1e-6)
    assert len(found) == len(angles)
    np.testing.assert_allclose(found, radii, rtol=1e-6)  # cm
    beta = np.radians(beta)
    # Angles are read in single precision.
    np.testing.assert_allclose(-np.sin(beta), -np.sin(angles), atol=1e-6)
    np.testing.assert_allclose(-np.cos(beta), np.cos(angles), atol=1e-6)
    along = np.cos(beta) * np.cos(angles) - np.sin(beta) * np.sin(angles)  # theirs in the direction of ours
    for view, seen in enumerate(samples):
        way = int(np.rint(along[view]))
        assert abs(along[view] - way) < 1e-6
        np.testing.assert_allclose(seen[::way].T, expected[view], atol=2e-5)


MEDCON = shutil.which("medcon")


def by_medcon(path):
    """The image that xmedcon makes of an Interfile, as nibabel and SimpleITK read it, and its interpretation of the geometry, as DICOM."""
    with tempfile.TemporaryDirectory() as out:
        base = pathlib.Path(out) / "out"
        command = [MEDCON, "-s", "-w", "-n", "-f", path.name, "-c", "nifti", "dicom", "-o", str(base)]
        subprocess.run(command, cwd=path.parent, check=True, capture_output=True, stdin=subprocess.DEVNULL)
        image = nibabel.load(base.with_suffix(".nii"))
        samples = np.asanyarray(image.dataobj).copy()
        # Also a test of xmedcon: all readers of its file give the same samples.
        np.testing.assert_array_equal(sitk.GetArrayFromImage(sitk.ReadImage(str(base.with_suffix(".nii")))).T, samples)
        return samples, np.array(image.header.get_zooms()), pydicom.dcmread(base.with_suffix(".dcm"))


def medcon_places(path, entry):
    """It stores no position: centred; the first slice is the one towards the head."""
    samples, step, _ = by_medcon(path)
    assert samples.shape == tuple(SHAPE)
    if entry["format"] == "interfile-simind":
        step[2] *= step[0] / step[:2].mean()  # a separation in pixels is to it one in the mean of their two sides
    middle = entry["origin"] + (SHAPE - 1) / 2 * SPACING
    places = middle + (indices() - (SHAPE - 1) / 2) * step / 10 * [1, 1, -1]
    return samples.ravel(order="F").astype(entry["type"]), places


def check_medcon_stack(path, header, samples, pitch):
    """Samples, sizes and the radius are right. Its angles would be right if Interfile's were counted from the front of the patient and
    DICOM's from the back, both the same way round: so it is neither STIR's rule nor PyTomography's."""
    seen, step, dataset = by_medcon(path)
    np.testing.assert_array_equal(seen.T, samples)
    np.testing.assert_allclose(step[:2], 10 * pitch, rtol=1e-6)
    rotation = dataset.RotationInformationSequence[0]
    start = 180 - float(header["start angle"])
    assert abs((float(rotation.StartAngle) - start + 180) % 360 - 180) < 1e-3
    assert rotation.RotationDirection == {"CW": "CW", "CCW": "CC"}[header["direction of rotation"]]
    if "radius" in header:  # it supports no others
        assert float(rotation.RadialPosition) == float(header["radius"])  # mm
    assert rotation.NumberOfFramesInRotation == len(samples)


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
    """Vectors, linear in the position in the lab: 3 x 3 numbers and an offset. Formats with a world frame have them along its axes, in mm."""
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
    if entry["format"] == "nrrd":
        found, header = nrrd.read(str(path))
        assert found.shape == (3,) + shape and found.dtype == np.float32
        assert header["kinds"] == [{True: "vector", False: "list"}[vectors]] + 3 * ["domain"]
        assert header["space"] == "left-posterior-superior" and np.isnan(header["space directions"][0]).all()
        np.testing.assert_allclose(found.transpose(3, 2, 1, 0).reshape(-1, 3), lps, atol=2e-4)
        places = indices() @ header["space directions"][1:] + header["space origin"]
        np.testing.assert_allclose(places, 10 * lab, atol=1e-3)
    if entry["format"] == "raw-json":
        header = json.loads(path.read_text())
        assert header["order"] == ["z", "y", "x", "component"] and header["shape"] == list(shape[::-1] + (3,))
        close(np.fromfile(path.parent / header["data"], dtype="<f4"), expected)
        np.testing.assert_allclose(header["origin_cm"] + indices() * header["spacing_cm"], lab)
        return
    image = sitk.ReadImage(str(path))
    assert image.GetNumberOfComponentsPerPixel() == 3 and image.GetSize() == tuple(int(n) for n in SHAPE)
    # ITK converts displacements of NIfTI to its own world, LPS, and leaves any other vector unchanged.
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
    radii = np.array(entry["radii"] or scene["radius"])  # cm, per view or for all views
    if entry["format"] == "npy":
        samples = np.load(path)
    elif entry["format"] == "npz":
        arrays = np.load(path)
        samples = arrays["samples"]
        np.testing.assert_array_equal(arrays["angles_rad"], angles)
        np.testing.assert_allclose(arrays["first_cm"], [s[0], z[0]])
        np.testing.assert_allclose(arrays["pitch_cm"], pitch)
        np.testing.assert_array_equal(arrays["radius_cm"].squeeze(), radii)
    elif entry["format"] == "nrrd":
        samples, header = nrrd.read(str(path), index_order="C")
        np.testing.assert_array_equal(np.array(header["angles_rad"].split(), float), angles)
        np.testing.assert_allclose(header["spacings"][:2], 10 * pitch)
        np.testing.assert_allclose(np.array(header["radius_mm"].split(), float).squeeze(), 10 * radii)
        np.testing.assert_allclose([float(header["first_bin_mm"]), float(header["first_row_mm"])], [10 * s[0], 10 * z[0]])
        itk = sitk.ReadImage(str(path))
        np.testing.assert_array_equal(sitk.GetArrayFromImage(itk), samples)
    elif entry["format"] == "raw-json":
        header = json.loads(path.read_text())
        samples = np.fromfile(path.parent / header["data"], dtype="<f4").reshape(header["shape"])
        np.testing.assert_array_equal(header["angles_rad"], angles)
        np.testing.assert_array_equal(header["radius_cm"], radii)
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
        if not np.ndim(radii):
            assert float(header["radius"]) == 10 * radii
        elif entry["format"] == "interfile-stir":
            # The format of lists of its parser: in braces, with commas, one number per view.
            assert header["orbit"] == "non-circular" and header["radii"][0] + header["radii"][-1] == "{}"
            np.testing.assert_allclose([float(r) for r in header["radii"][1:-1].split(",")], 10 * radii)
        if MEDCON:
            check_medcon_stack(path, header, samples.reshape(shape), pitch)
        samples = samples.reshape(shape)[:, ::-1]  # rows from head to feet
        if entry["format"] == "interfile-simind":
            samples = samples[:, :, ::-1]  # as displayed by a camera in front of the patient
            if PYTOMOGRAPHY:
                for version in (path,) if np.ndim(radii) else (path, of_an_older_version(path)):
                    check_pytomography_stack(version, expected, angles, pitch, radii)
        else:
            np.testing.assert_allclose((start + turned - np.degrees(angles) + 180) % 360, 180)
    assert samples.shape == shape and samples.dtype == np.float32, entry
    np.testing.assert_allclose(samples, expected, atol=2e-5)


def expected_volume(entry):
    places = entry["origin"] + indices() * SPACING
    return (places @ scene["field"]).reshape(SHAPE[::-1])


def check_beat(entry, path):
    """All gates of one file: each reader's [gate][z][y][x]."""
    n = scene["gates"]
    expected = np.stack([expected_volume(entry) + 1000 * gate for gate in range(n)])
    found = []
    if entry["format"].startswith("nifti"):
        image = nibabel.load(path)
        assert image.header.get_xyzt_units() == ("mm", "sec")
        np.testing.assert_allclose(image.header.get_zooms(), [*(10 * SPACING), scene["seconds"]])
        found.append(np.asanyarray(image.dataobj).T)
        image = sitk.ReadImage(str(path))
        assert image.GetDimension() == 4 and abs(image.GetSpacing()[3] - scene["seconds"]) < 1e-6
        found.append(sitk.GetArrayFromImage(image))
    elif entry["format"].startswith("interfile"):
        if MEDCON:
            found.append(by_medcon(path)[0].T[:, ::-1])  # slices from head to feet
    else:
        image = sitk.ReadImage(str(path))
        assert image.GetNumberOfComponentsPerPixel() == n
        np.testing.assert_allclose(image.GetOrigin(), 10 * np.array(entry["origin"]), atol=1e-6)
        found.append(np.moveaxis(sitk.GetArrayFromImage(image), -1, 0))
        if entry["format"] == "nrrd":
            samples, header = nrrd.read(str(path), index_order="C")
            assert float(header["seconds_per_gate"]) == scene["seconds"]
            found.append(samples)
    for samples in found:
        assert samples.shape == expected.shape, (entry, samples.shape)
        np.testing.assert_allclose(samples, expected, atol=2e-4)


def asked(program, path):
    """Output of a program of the Debian packages dicom3tools and dcmtk on a file; nothing without it."""
    if shutil.which(program) is None:
        return ""
    ended = subprocess.run([program, str(path)], capture_output=True, text=True)
    said = ended.stdout + ended.stderr
    assert ended.returncode == 0 and "Error" not in said and "E: " not in said, (path, said)
    return said


def check_dicom(entry):
    names = entry.get("names") or [entry["name"]]
    for name in names:
        asked("dcmdump", folder / name)
        asked("dciodvfy", folder / name)
    if entry["kind"] == "views":
        check_dicom_views(entry, folder / names[0])
    elif entry["kind"] == "volume":
        check_dicom_volume(entry, folder / names[0])
    else:
        check_ct(entry, [str(folder / name) for name in names])


def check_dicom_views(entry, path):
    bins, rows, pitch, angles = scene["bins"], scene["rows"], np.array(scene["pitch"]), np.array(entry["angles"])
    n = scene["gates"] if entry["gated"] else 1
    s = (np.arange(bins) - (bins - 1) / 2) * pitch[0]
    z = (np.arange(rows) - (rows - 1) / 2) * pitch[1]
    one = np.degrees(angles)[:, None, None] + scene["seen"][0] * s + scene["seen"][1] * z[:, None]
    expected = np.stack([one + 1000 * gate for gate in range(n)])
    dataset = pydicom.dcmread(path)
    factor = float(dataset.RescaleSlope)
    samples = factor * dataset.pixel_array.reshape(expected.shape)
    np.testing.assert_allclose(samples[..., ::-1, ::-1], expected, atol=0.51 * factor)
    assert list(dataset.PixelSpacing) == [10 * pitch[1], 10 * pitch[0]]
    if not PYTOMOGRAPHY_DICOM:
        return
    # Its views are sorted by its angles; geometry as with SIMIND's files: `check_pytomography_stack`.
    seen, beta, radii, _ = PYTOMOGRAPHY_DICOM.parse_projection_dataset(dataset)
    seen = factor * np.asarray(seen)[0]  # [gate][view][bin][row], rows from feet to head
    assert seen.shape == (n, len(angles), bins, rows)
    np.testing.assert_allclose(radii, scene["radius"])
    for view, angle in enumerate(np.radians(beta)):
        theta = np.pi - angle
        ours = int(np.argmax(np.cos(angles - theta)))
        assert np.cos(angles[ours] - theta) > 1 - 1e-12, (beta, angles)
        way = int(np.rint(np.cos(angle) * np.cos(angles[ours]) - np.sin(angle) * np.sin(angles[ours])))
        np.testing.assert_allclose(
            np.swapaxes(seen[:, view, ::way], 1, 2), expected[:, ours], atol=0.51 * factor
        )
    volume, projections = PYTOMOGRAPHY_DICOM.get_metadata(str(path))
    # It uses the vertical spacing of an image as the horizontal one: correct for square pixels.
    np.testing.assert_allclose(projections.fields[1], pitch[::-1])
    np.testing.assert_allclose(volume.affine_matrix[:2, 3], 10 * s[0])
    assert projections.fields[0] == (bins, rows)


def check_dicom_volume(entry, path):
    n = scene["gates"] if entry["gated"] else 1
    expected = np.concatenate([expected_volume(entry) + 1000 * gate for gate in range(n)])
    dataset = pydicom.dcmread(path)
    factor = float(dataset.RescaleSlope)
    np.testing.assert_allclose(factor * dataset.pixel_array, expected, atol=0.51 * factor)
    image = sitk.ReadImage(str(path))  # applies the factor; reads gates as additional slices
    np.testing.assert_allclose(sitk.GetArrayFromImage(image), expected, atol=0.51 * factor)
    np.testing.assert_allclose(image.GetOrigin(), 10 * np.array(entry["origin"]), atol=1e-6)
    np.testing.assert_allclose(image.GetSpacing(), 10 * SPACING, rtol=1e-9)
    np.testing.assert_allclose(image.GetDirection(), np.eye(3).ravel())
    if PYTOMOGRAPHY_DICOM and not entry["gated"]:
        # In the unit of the samples, [x][y][z].
        seen = np.asarray(PYTOMOGRAPHY_DICOM.get_attenuation_map_from_file(str(path)))
        np.testing.assert_allclose(seen.T, expected, atol=0.51 * factor)


def check_ct(entry, paths):
    mu = entry["step"] * np.arange(SHAPE.prod()).reshape(SHAPE[::-1])
    units = 1000 * (mu / entry["water"] - 1)
    image = sitk.ReadImage(paths)
    np.testing.assert_allclose(sitk.GetArrayFromImage(image), units, atol=0.51)
    np.testing.assert_allclose(image.GetOrigin(), 10 * np.array(entry["origin"]), atol=1e-6)
    np.testing.assert_allclose(image.GetSpacing(), 10 * SPACING, rtol=1e-6)
    if PYTOMOGRAPHY_DICOM:
        shared = sys.modules["pytomography.io.shared"]
        np.testing.assert_allclose(np.asarray(shared.open_multifile(paths)).T, units, atol=0.51)


for entry in scene["files"]:
    path = folder / entry["name"]
    for reader in READERS[entry["format"]]:
        check_volume(entry, *reader(path))
    if MEDCON and entry["format"].startswith("interfile"):
        check_volume(entry, *medcon_places(path, entry))
    if PYTOMOGRAPHY and (entry["format"], entry["type"]) == ("interfile-simind", "float32"):
        check_volume(entry, *pytomography_places(path))
    if entry["format"] == "npy":
        check_volume(entry, *npy_places(path, entry))
for entry in scene["stacks"]:
    check_stack(entry, folder / entry["name"])
for entry in scene["fields"]:
    check_field(entry, folder / entry["name"])
for entry in scene["beats"]:
    check_beat(entry, folder / entry["name"])
for entry in scene["dicom"]:
    check_dicom(entry)
for reader, there in (("PyTomography", PYTOMOGRAPHY), ("medcon", MEDCON)):
    if not there:
        print(f"without {reader}: its reading of projections is not checked")
for program in ("dciodvfy", "dcmdump"):
    if not shutil.which(program):
        print(f"without {program}")
print(f"{sum(len(scene[of]) for of in ('files', 'stacks', 'fields', 'beats', 'dicom'))} files agree")
