"""Cohorts: members as scenes, datasets for several workers, the program in the wheel."""

import copy
import pickle
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from heart_phantom import Cohort, HeartPhantomError, Phantom, SceneError
from heart_phantom.data import CohortDataset, ShardDataset

TEXT = """
members = 6
seed = 7
split = { train = 0.5, validation = 0.25, test = 0.25 }
constraints = ["heart.outer.radius > heart.inner.radius + 0.8"]
[scene]
camera = { views = 6, bins = 8, rows = 8, pitch = [2.0, 2.0] }
acquisition.mode = { gated = { gates = 2 } }
output.write = ["projections", "truth"]
[vary]
heart.inner.radius = { uniform = [1.5, 2.0] }
heart.outer.radius = { normal = { mean = 2.8, sd = 0.2, bounds = [2.4, 3.2] } }
"""


def wall(phantom):
    return phantom.numbers()["wall_volume"]


def test_a_member_is_a_scene_with_its_drawn_values():
    cohort = Cohort(TEXT)
    assert len(cohort) == 6 and len(list(cohort)) == 6
    for index in range(6):
        scene, drawn = cohort.member(index), cohort.draw(index)
        assert drawn["key"] == f"{index:08}"
        assert set(drawn["values"]) == set(cohort.varied) == {"heart.inner.radius", "heart.outer.radius"}
        for name, value in drawn["values"].items():
            assert scene[name] == value
        assert scene["heart.outer.radius"] > scene["heart.inner.radius"] + 0.8
        assert cohort[index] == cohort[index - 6] == scene
        assert drawn["split"] in ("train", "validation", "test")
    with pytest.raises(IndexError, match="member is 6"):
        cohort.member(6)
    with pytest.raises(IndexError):
        cohort[-7]


def test_a_cohort_is_restored_from_its_pickle_and_its_file(tmp_path):
    cohort = Cohort(TEXT)
    for again in (pickle.loads(pickle.dumps(cohort)), copy.deepcopy(cohort)):
        assert again.digest == cohort.digest and again[3] == cohort[3]
    (tmp_path / "base.toml").write_text("[camera]\nviews = 5\n")
    file = tmp_path / "cohort.toml"
    file.write_text('members = 2\nbase = "base.toml"\n')
    loaded = pickle.loads(pickle.dumps(Cohort.load(file)))
    assert loaded[1]["camera.views"] == 5
    assert len(Cohort(Cohort.template())) > 0


def test_errors_have_their_place():
    with pytest.raises(SceneError) as caught:
        Cohort("members = 3\n[vary]\nheart.inner.radius = { uniform = [2.0, 1.5] }\n")
    assert (caught.value.line, caught.value.field) == (3, "vary.heart.inner.radius")
    with pytest.raises(FileNotFoundError, match="nonsense.toml"):
        Cohort.load("/nonexistent/nonsense.toml")
    unmet = Cohort('members = 1\nattempts = 2\nconstraints = ["heart.inner.radius > 5"]\n[vary]\nheart.inner.radius = { uniform = [1.5, 2.0] }\n')
    with pytest.raises(HeartPhantomError, match="none of 2 draws"):
        unmet.member(0)
    with pytest.raises(ValueError, match="products contains 'nonsense'"):
        CohortDataset(TEXT, ["nonsense"])
    with pytest.raises(ValueError, match="split is 'all'"):
        CohortDataset(TEXT, split="all")


@pytest.mark.filterwarnings("ignore::heart_phantom.SceneWarning")  # wide bins
def test_a_dataset_has_the_arrays_of_its_phantoms():
    dataset = CohortDataset(TEXT, ["projections", "truth", "reconstruction", "ejection_fraction"])
    assert len(dataset) == 6
    phantom = Phantom(Cohort(TEXT).member(2))
    sample = dataset[2]
    np.testing.assert_array_equal(sample["projections"], phantom.views_of_gates())
    np.testing.assert_array_equal(sample["truth"], phantom.truth_of_gates())
    np.testing.assert_array_equal(sample["reconstruction"][1], phantom.volume(1))
    assert abs(sample["ejection_fraction"] - 0.375) < 1e-6
    assert CohortDataset(TEXT, item=wall)[1] == Phantom(Cohort(TEXT).member(1)).numbers()["wall_volume"]
    parts = [CohortDataset(TEXT, split=split).members for split in ("train", "validation", "test")]
    assert sorted(sum(parts, [])) == list(range(6))
    with pytest.raises(IndexError):
        dataset[6]


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_workers_compute_the_same_samples(method):
    dataset = CohortDataset(TEXT, item=wall)
    expected = [dataset[index] for index in range(6)]  # the parent has threads when it forks
    with ProcessPoolExecutor(2, get_context(method)) as workers:
        assert list(workers.map(dataset.__getitem__, range(6), timeout=120)) == expected


@pytest.mark.filterwarnings("ignore::heart_phantom.SceneWarning")  # wide bins
def test_shards_of_the_program_are_the_same_dataset(tmp_path):
    (tmp_path / "cohort.toml").write_text(TEXT)
    program = [sys.executable, "-m", "heart_phantom"]
    for shard in (1, 2):
        command = ["cohort", "run", tmp_path / "cohort.toml", "--shard", f"{shard}/2", "--out", tmp_path / "shards"]
        subprocess.run([*program, *map(str, command)], check=True, capture_output=True)
    shards = pickle.loads(pickle.dumps(ShardDataset(tmp_path / "shards")))
    live = CohortDataset(TEXT)
    assert len(shards) == 6
    for index in (0, 5):
        sample = shards[index]
        assert sample["key"] == f"{index:08}" and sample["cls"] == 0
        np.testing.assert_array_equal(sample["projections.npy"], live[index]["projections"])
        np.testing.assert_array_equal(sample["truth.npy"], live[index]["truth"])
    assert set(ShardDataset(tmp_path / "shards", ["truth.npy"])[0]) == {"key", "truth.npy"}
    with pytest.raises(FileNotFoundError, match="no shard"):
        ShardDataset(tmp_path)


def test_the_program_is_on_the_path_and_a_module():
    beside = Path(sys.executable).parent / "heart-phantom"
    for program in ([str(beside)], [sys.executable, "-m", "heart_phantom"]):
        done = subprocess.run([*program, "--version"], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout.split()[0]) == (0, "heart-phantom"), done.stderr
        done = subprocess.run([*program, "check", "/nonexistent.toml"], capture_output=True, text=True, check=False)
        assert done.returncode == 2 and "/nonexistent.toml" in done.stderr
