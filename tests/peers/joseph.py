"""Line integrals of an image by Joseph's method, by ASTRA and by RTK.

Pixel (x, y) of SIZE x SIZE has the value (5 x + 3 y + x y) mod 11 if it is at least three pixels from the border, else 0: programs differ in what
they interpolate beyond the border. Bins and pixels have the size 1 and the conventions of this project (rays of the angle a run along (-sin a, cos a)).
Writes joseph.json: angles in degrees, and for each program a row of BINS samples per angle.
Run: pip install -r requirements.txt && python joseph.py
"""
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "benches/peers"))
from reconstruction_toolkit import VOLUME, empty, geometry, image, itk, toolkit  # noqa: E402

SIZE, BINS = 14, 15
ANGLES = [0, 17, 45, 62, 90, 118, 151]


def picture():
    y, x = np.mgrid[:SIZE, :SIZE]
    inside = (np.minimum(x, y) >= 3) & (np.maximum(x, y) < SIZE - 3)
    return np.where(inside, (5 * x + 3 * y + x * y) % 11, 0).astype(np.float32)


def by_astra(pixels):
    import astra
    rays = astra.create_proj_geom("parallel", 1.0, BINS, np.radians(ANGLES))
    projector = astra.create_projector("linear", rays, astra.create_vol_geom(SIZE, SIZE))
    return astra.create_sino(np.ascontiguousarray(pixels[::-1]), projector)[1]


def by_rtk(pixels):
    project = toolkit.JosephForwardProjectionImageFilter[VOLUME, VOLUME].New()
    project.SetGeometry(geometry(np.radians(ANGLES), 1))
    project.SetInput(0, empty((len(ANGLES), 3, BINS)))
    project.SetInput(1, image(np.stack([pixels[::-1]] * 3, axis=1)))
    project.Update()
    return itk.array_from_image(project.GetOutput())[:, 1]


def main():
    rows = {name: np.round(project(picture()).astype(float), 5).tolist() for name, project in [("astra", by_astra), ("rtk", by_rtk)]}
    text = ",\n".join(f'"{key}": {json.dumps(value)}' for key, value in {"angles": ANGLES, **rows}.items())
    Path(__file__).with_suffix(".json").write_text("{\n" + text + "\n}\n")


if __name__ == "__main__":
    main()
