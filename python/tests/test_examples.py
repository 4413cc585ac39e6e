"""Each example runs, small, and draws."""

import importlib.util
import json
from pathlib import Path

import pytest

matplotlib = pytest.importorskip("matplotlib")

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
SMALL = {
    "gated_study": ["--size", "24", "--gates", "4"],
    "ejection_fraction": ["--size", "32", "--gates", "4"],
    "motion_artefacts": ["--size", "24", "--rates", "60", "65"],
    "fbp_beside_skimage": ["--size", "64"],
}


def load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_example_is_tested():
    assert {file.stem for file in EXAMPLES.glob("*.py")} == set(SMALL)


@pytest.mark.parametrize("name", SMALL)
@pytest.mark.filterwarnings("ignore")
def test_an_example_runs(name, tmp_path, capsys):
    matplotlib.use("Agg", force=True)
    made = tmp_path / "made.png"
    load(name).main([*SMALL[name], "--out", str(made)])
    assert made.stat().st_size > 5000
    assert capsys.readouterr().out
    picture = matplotlib.image.imread(made) if hasattr(matplotlib, "image") else None
    if picture is not None:
        assert picture.std() > 0.01
    matplotlib.pyplot.close("all")


@pytest.mark.filterwarnings("ignore")
def test_the_cells_of_the_notebook_run(capsys):
    matplotlib.use("Agg", force=True)
    cells = json.loads((EXAMPLES / "study.ipynb").read_text())["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert len(code) == 9 and not any(cell.get("outputs") for cell in cells)
    names = {}
    for cell in code:  # the asserts of the last one compare the ejection fractions
        exec(compile(cell, "study.ipynb", "exec"), names)
        matplotlib.pyplot.close("all")
    assert "exact" in capsys.readouterr().out


@pytest.mark.filterwarnings("ignore")
def test_fbp_of_user_data_is_as_accurate_as_that_of_scikit_image(tmp_path):
    matplotlib.use("Agg", force=True)
    results = load("fbp_beside_skimage").main(["--size", "128", "--out", str(tmp_path / "made.png")])
    errors = {name: error for name, (_, _, error) in results.items()}
    assert errors["heart_phantom"] < 1.1 * errors["scikit-image"]
    matplotlib.pyplot.close("all")
