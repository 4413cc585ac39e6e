"""Scenes from texts, files and dictionaries, and their errors."""

import copy
import pickle

import numpy as np
import pytest

from heart_phantom import HeartPhantomError, Phantom, Scene, SceneError


def test_a_text_a_file_and_a_dictionary_give_the_same_scene(tmp_path):
    text = "[camera]\nviews = 60\n[acquisition]\nmode = { gated = { gates = 8 } }\n"
    file = tmp_path / "scene.toml"
    file.write_text(text)
    from_text = Scene.from_toml(text)
    assert from_text == Scene.load(file) == Scene.load(str(file))
    assert from_text == Scene({"camera": {"views": 60}, "acquisition": {"mode": {"gated": {"gates": 8}}}})
    assert from_text == Scene(camera={"views": 60}, acquisition={"mode": {"gated": {"gates": 8}}})
    assert from_text != Scene()
    assert Phantom.load(file).scene == from_text


def test_a_scene_is_restored_from_its_text_its_dictionary_and_its_pickle():
    scene = Scene().with_size(48).replace(
        {"heart.inner.radius": 1.7},
        defects=[{"layers": [0.0, 0.6], "s": [0.25, 0.4], "azimuths_degrees": [0.0, 60.0], "activity": 0.2}],
        blur={"fwhm": 0.8},
        noise={"counts": {"total": 1e6}, "seed": 7},
    )
    assert Scene.from_toml(scene.to_toml()) == scene
    assert Scene(scene.to_dict()) == scene
    assert pickle.loads(pickle.dumps(scene)) == scene
    assert copy.deepcopy(scene) == scene
    assert Scene.from_toml(Scene.template()) == Scene()


def test_replace_changes_the_named_fields_only():
    scene = Scene()
    changed = scene.replace({"heart.inner.radius": 1.6}, camera={"views": 30}, blur={"fwhm": 1.2})
    assert scene == Scene()
    before, after = scene.to_dict(), changed.to_dict()
    before["heart"]["inner"]["radius"] = 1.6
    before["camera"]["views"] = 30
    before["blur"] = {"fwhm": 1.2}
    assert before == after
    assert changed.replace(blur=None)["camera.views"] == 30
    with pytest.raises(KeyError, match="blur"):
        changed.replace(blur=None)["blur"]
    # A mode is replaced, not merged with the previous one.
    gated = scene.replace({"acquisition.mode": {"gated": {"gates": 4}}})
    assert gated.replace({"acquisition.mode": {"static": {"phase": 0.5}}})["acquisition.mode"] == {
        "static": {"phase": 0.5}
    }


def test_numbers_of_numpy_are_numbers():
    scene = Scene(
        camera={"views": np.int64(12), "pitch": np.array([0.5, 0.5]), "bins": np.int32(32), "rows": 32},
        blur={"fwhm": np.float32(0.5)},
    )
    assert (scene["camera.views"], scene["camera.pitch"], scene["blur.fwhm"]) == (12, [0.5, 0.5], 0.5)


def test_an_error_has_line_column_field_and_allowed_values(tmp_path):
    text = "[camera]\nviews = 60\nbins = -3\n"
    with pytest.raises(SceneError, match=r"^line 3, column 8: camera\.bins") as caught:
        Scene.from_toml(text)
    error = caught.value
    assert (error.file, error.line, error.column, error.field) == (None, 3, 8, "camera.bins")
    assert error.given == "-3"
    assert error.wanted
    assert isinstance(error, (ValueError, HeartPhantomError))
    file = tmp_path / "scene.toml"
    file.write_text(text)
    with pytest.raises(SceneError) as caught:
        Scene.load(file)
    assert caught.value.file == str(file)
    assert str(caught.value).startswith(f"{file}:3:8: camera.bins")


def test_a_dictionary_has_no_lines():
    with pytest.raises(SceneError, match=r"^camera\.views is 0") as caught:
        Scene(camera={"views": 0})
    assert (caught.value.line, caught.value.column, caught.value.field) == (None, None, "camera.views")


@pytest.mark.parametrize(
    ("make", "kind", "words"),
    [
        (lambda: Scene(camera={"view": 3}), SceneError, "view"),
        (lambda: Scene(nonsense={}), SceneError, "nonsense"),
        (lambda: Scene.from_toml("[camera"), SceneError, "line 1"),
        (lambda: Scene(camera={"views": float("nan")}), SceneError, "views"),
        (lambda: Scene({"camera.pitch.x": 1.0}), ValueError, "pitch"),
        (lambda: Scene({1: 2}), TypeError, "key 1"),
        (lambda: Scene(camera={"views": object()}), TypeError, "object"),
        (lambda: Scene(camera={"views": 10**30}), ValueError, "digits"),
        (lambda: Scene().with_size(0), ValueError, "size"),
        (lambda: Scene().with_size(-1), ValueError, "-1"),
        (lambda: Scene().with_size(2.5), TypeError, "expected an integer"),
        (lambda: Scene.load("/nonexistent/scene.toml"), FileNotFoundError, "scene.toml"),
        (lambda: Phantom("scene.toml"), TypeError, "Scene.load"),
        (lambda: Phantom({"camera": {"views": 0}}), SceneError, "camera.views"),
    ],
)
def test_invalid_input_is_an_error_with_a_message(make, kind, words):
    with pytest.raises(kind, match=words):
        make()


def test_a_repr_contains_the_views():
    scene = Scene().with_size(32).replace(acquisition={"mode": {"gated": {"gates": 8}}})
    assert repr(scene) == "<Scene: gated (gates 8), 90 views of 32 x 32 samples>"
    assert repr(Phantom(scene)) == (
        "<Phantom: 8 gates of 90 views of 32 x 32 samples, 32 x 32 x 32 voxels of 0.5 cm>"
    )
