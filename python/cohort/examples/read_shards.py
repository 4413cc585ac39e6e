"""Iterates the shards of a folder like a training loop, without training, and checks the shapes.

    python read_shards.py DIR                 with webdataset, if it is installed, and with tarfile
    python read_shards.py DIR --tarfile       with tarfile and numpy only
"""

import argparse
import glob
import gzip
import io
import json
import os
import tarfile

import numpy as np


def with_tarfile(paths):
    """One dictionary per member: consecutive files with the same name before the first dot."""
    for path in paths:
        with tarfile.open(path) as archive:
            sample = {}
            for entry in archive:
                key, name = entry.name.split(".", 1)
                if sample and sample["__key__"] != key:
                    yield sample
                    sample = {}
                data = archive.extractfile(entry).read()
                if name.endswith(".gz"):
                    data, name = gzip.decompress(data), name.removesuffix(".gz")
                if name.endswith(".npy"):
                    data = np.load(io.BytesIO(data))
                elif name.endswith(".json"):
                    data = json.loads(data)
                elif name == "cls":
                    data = int(data)
                sample.update({"__key__": key, name: data})
            if sample:
                yield sample


def with_webdataset(paths):
    """The same by webdataset, which decodes json, npy and cls by itself."""
    import webdataset

    urls = ["file:" + os.path.abspath(path) for path in paths]
    for sample in webdataset.WebDataset(urls, shardshuffle=False, empty_check=False).decode():
        yield {name.removesuffix(".gz"): data for name, data in sample.items()}


def check(sample):
    """The shapes according to the member's scene."""
    scene, camera = sample["scene.json"], sample["scene.json"]["camera"]
    mode = scene["acquisition"]["mode"]
    gates = mode["gated"]["gates"] if isinstance(mode, dict) and "gated" in mode else 1
    n = scene["reconstruction"].get("pixels", camera["bins"])
    views = (gates, camera["views"], camera["rows"], camera["bins"])
    for name, shape in [
        ("projections.npy", views),
        ("truth.npy", (gates, camera["rows"], n, n)),
        ("reconstruction.npy", (gates, camera["rows"], n, n)),
    ]:
        if name in sample:
            array = sample[name]
            assert array.shape == shape, (sample["__key__"], name, array.shape, shape)
            assert array.dtype in (np.float32, np.float16) and np.isfinite(array).all()
    geometry = sample["geometry.json"]
    if "truth.npy" in sample:
        assert list(sample["truth.npy"].shape[1:]) == geometry["shape_zyx"]
    assert sample["numbers.json"]["numbers"]["edv"] > sample["numbers.json"]["numbers"]["esv"] > 0
    assert isinstance(sample["cls"], int)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--tarfile", action="store_true")
    given = parser.parse_args()
    paths = sorted(glob.glob(os.path.join(given.folder, "shard-*.tar")))
    readers = [with_tarfile] if given.tarfile else [with_tarfile, with_webdataset]
    for reader in readers:
        keys = []
        for sample in reader(paths):
            check(sample)
            keys.append(sample["__key__"])
        assert keys == sorted(set(keys)), "every member once, in order"
        print(f"{reader.__name__}: {len(keys)} members in {len(paths)} shards have the shapes of their scenes")


if __name__ == "__main__":
    main()
