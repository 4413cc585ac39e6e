"""Tests the page of a run in a headless Chromium: the viewer exists, the heart moves, and marks are at their positions.

    pip install pillow numpy
    heart-phantom run SCENE --out DIR      (gated, with a reconstruction or an exact volume)
    python3 page.py DIR/index.html [FOLDER for the screenshots]

Needs Debian's package chromium, or any other under that name; CHROMIUM_FLAGS contains further options, for example for root.
Not part of `.ci/run`, which has no browser.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image

page = pathlib.Path(sys.argv[1]).resolve()
out = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else tempfile.mkdtemp())
out.mkdir(parents=True, exist_ok=True)
SIZE = (1100, 6000)
BROWSER = [
    "chromium", "--headless=new", "--disable-dev-shm-usage", "--hide-scrollbars", *os.environ.get("CHROMIUM_FLAGS", "").split(),
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
    "--host-resolver-rules=MAP * ~NOTFOUND",  # no network
    f"--window-size={SIZE[0]},{SIZE[1]}", "--virtual-time-budget=20000",
]


def browser(arguments):
    with tempfile.TemporaryDirectory() as profile:
        command = [*BROWSER, f"--user-data-dir={profile}", *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=300, check=True).stdout


def screenshot(gate):
    path = out / f"gate-{gate}.png"
    browser([f"--screenshot={path}", f"file://{page}#gate={gate}"])
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


text = page.read_text()
assert page.stat().st_size < 25_000_000
n_gates = int(re.search(r"gate \d+ \(of (\d+)\)", text).group(1))
dom = browser(["--dump-dom", f"file://{page}#gate=0"])
state = re.search(r'id="beat-state"[^>]*>([^<]*)', dom).group(1)
assert 'data-ready="yes"' in dom, state
assert state == f"gate 0 (of {n_gates})", state

shots = {gate: screenshot(gate) for gate in (0, n_gates // 2)}
first, other = shots.values()
assert first.shape == other.shape
# The viewer is the first dark frame that is wide and high; the plots before it are white.
dark = np.flatnonzero((first.max(axis=2) < 40).mean(axis=1) > 0.3)
assert dark.size, "there is no viewer"
frames = np.split(dark, np.flatnonzero(np.diff(dark) > 8) + 1)
top, bottom = next((rows[0], rows[-1] + 1) for rows in frames if len(rows) > 300)  # below them is the colour bar
viewer = np.s_[top:bottom]
# Not empty: many greys, and not only those of the frame.
greys = first[viewer]
assert len(np.unique(greys.reshape(-1, 3), axis=0)) > 200, "the viewer is empty"
# The heart moves, and nothing else of the page but the slider and its label just above.
changed = np.abs(first - other).max(axis=2) > 24
assert changed[viewer].sum() > 2000, "nothing moves"
outside = changed.copy()
outside[top - 80 : bottom] = False
assert outside.sum() == 0, "something else moves"
# When stopped, the image is the same again.
again = screenshot(0)
assert (np.abs(first - again).max(axis=2) > 24).sum() == 0
print(f"{page.name}: {n_gates} gates, {changed[viewer].sum()} pixels of the viewer move; screenshots in {out}")
