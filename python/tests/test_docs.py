"""Documentation: examples in docstrings and in the README run, and each name has one docstring."""

import doctest
import importlib.util
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import heart_phantom
from heart_phantom import Phantom, Scene, SceneError, data, errors, membrane, radon, revolve
from heart_phantom import torch as hp_torch

HERE = Path(__file__).resolve().parent
MODULES = (heart_phantom, data, errors, membrane, radon, revolve, hp_torch)
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL


def described():
    """Everything public, by its name."""
    for module in MODULES:
        yield module.__name__, module
        for name in getattr(module, "__all__", ()):
            thing = getattr(module, name)
            if inspect.ismodule(thing) or name == "__version__":
                continue
            yield f"{module.__name__}.{name}", thing
            if inspect.isclass(thing) and not issubclass(thing, Exception):
                for member, value in vars(thing).items():
                    if not member.startswith("_"):
                        yield f"{module.__name__}.{name}.{member}", value


@pytest.mark.parametrize(("name", "thing"), list(described()), ids=lambda x: x if isinstance(x, str) else "")
def test_docstrings_exist_and_their_examples_run(name, thing):
    doc = inspect.getdoc(thing)
    assert doc and doc.strip(), name
    if "import torch" in doc and not importlib.util.find_spec("torch"):
        pytest.skip("PyTorch is not here")
    names = {"Phantom": Phantom, "Scene": Scene, "SceneError": SceneError}
    test = doctest.DocTestParser().get_doctest(doc, names, name, None, None)
    assert doctest.DocTestRunner(optionflags=FLAGS).run(test).failed == 0


def arguments(thing):
    """Names of the arguments, as sections list them."""
    marks = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}
    parameters = inspect.signature(thing).parameters.values()
    return sorted(marks.get(one.kind, "") + one.name for one in parameters if one.name != "self")


def callables():
    """Everything public that is called: functions, methods, and classes with a constructor."""
    for name, thing in described():
        if isinstance(thing, staticmethod):
            thing = thing.__func__
        if inspect.isclass(thing):
            native = thing.__module__ != data.__name__
            if issubclass(thing, Exception) or native and not thing.__text_signature__:
                continue
        if callable(thing):
            yield name, thing


RETURN_NOTHING = {"heart_phantom.set_threads", "heart_phantom.revolve.Mesh.write"}


@pytest.mark.parametrize(("name", "thing"), list(callables()), ids=lambda x: x if isinstance(x, str) else "")
def test_sections_name_the_arguments_and_the_result(name, thing):
    docscrape = pytest.importorskip("numpydoc.docscrape")
    sections = docscrape.NumpyDocString(inspect.getdoc(thing))
    listed = [one for parameter in sections["Parameters"] for one in parameter.name.split(", ")]
    assert sorted(listed) == arguments(thing), name
    returns = not inspect.isclass(thing) and name not in RETURN_NOTHING
    assert bool(sections["Returns"]) == returns, name


@pytest.mark.parametrize("page", ["README.md"])
def test_the_examples_of_the_readme_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    blocks = re.findall(r"```python\n(.*?)```", (HERE.parent / page).read_text(), re.DOTALL)
    assert len(blocks) >= 3
    for block in blocks:
        if "import torch" in block and not importlib.util.find_spec("torch"):
            continue
        # A module of its own, whose functions and data other processes import.
        Path("block.py").write_text(block)
        subprocess.run([sys.executable, "-W", "error", "block.py"], check=True)


def test_sphinx_renders_the_docstrings_without_warnings(tmp_path):
    pytest.importorskip("sphinx")
    pytest.importorskip("numpydoc")
    (tmp_path / "conf.py").write_text('extensions = ["sphinx.ext.autodoc", "numpydoc"]\nnumpydoc_show_class_members = False\n')
    # Names that several modules export are described once.
    options = {"heart_phantom": "   :exclude-members: MembraneError, RadonError, RevolveError\n"}
    modules = [module.__name__ for module in MODULES if module is not errors]
    body = "\n".join(f".. automodule:: {name}\n   :members:\n   :undoc-members:\n{options.get(name, '')}" for name in modules)
    (tmp_path / "index.rst").write_text(f"Reference\n=========\n\n{body}")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", str(tmp_path), str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "SpectOperator" in (tmp_path / "out" / "index.html").read_text()


def test_the_package_has_the_files_for_type_checkers():
    package = Path(heart_phantom.__file__).parent
    assert (package / "py.typed").exists()
    assert sum(os.path.getsize(file) for file in package.glob("_native*")) < 30e6
    assert re.fullmatch(r"\d+\.\d+\.\d+", heart_phantom.__version__)
