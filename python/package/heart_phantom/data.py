"""Map-style datasets of cohorts for machine learning, computed on access or read from shards.

Both have `len(...)`, integer indices and pickling, as `torch.utils.data.DataLoader` needs them; neither imports PyTorch. Samples are
dictionaries of NumPy arrays, numbers and texts, which the default collation stacks if all members have the same shapes.
"""

from __future__ import annotations

import gzip
import io
import json
import os
import tarfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Optional, Union

import numpy as np

from heart_phantom._native import Cohort, Phantom, set_threads
from heart_phantom.errors import SceneWarning

__all__ = ["CohortDataset", "ShardDataset"]

_PRODUCTS: dict[str, Callable[[Phantom], Any]] = {
    "projections": lambda phantom: phantom.views_of_gates(),
    "truth": lambda phantom: phantom.truth_of_gates(),
    "reconstruction": lambda phantom: np.stack([phantom.volume(gate) for gate in range(phantom.n_gates)]),
    "ejection_fraction": lambda phantom: np.float32(phantom.numbers()["ejection_fraction"]),
}


class CohortDataset:
    """Members of a cohort, computed on access.

    Parameters
    ----------
    cohort : Cohort or str
        The cohort, or its text.
    products : sequence of str
        Entries of a sample: `"projections"` `[gate][view][row][bin]`, `"truth"` and `"reconstruction"` `[gate][z][y][x]`, `float32`, and
        `"ejection_fraction"`.
    item : callable, optional
        A function of the member's `Phantom` that returns the sample, instead of `products`. With several workers it must support pickling.
    split : {"train", "validation", "test"}, optional
        The subset of the cohort; all members by default.
    threads : int
        Threads of each process that computes members. Results do not depend on it.

    Raises
    ------
    ValueError
        If a product or the split is unknown.

    Examples
    --------
    >>> from heart_phantom.data import CohortDataset
    >>> dataset = CohortDataset('''
    ... members = 4
    ... scene = { camera = { views = 6, bins = 8, rows = 8, pitch = [2.0, 2.0] } }
    ... [vary]
    ... heart.inner.radius = { uniform = [1.5, 2.0] }
    ... ''', ["projections", "ejection_fraction"])
    >>> len(dataset)
    4
    >>> dataset[3]["projections"].shape
    (1, 6, 8, 8)
    """

    def __init__(
        self,
        cohort: Union[Cohort, str],
        products: Sequence[str] = ("projections", "truth"),
        *,
        item: Optional[Callable[[Phantom], Any]] = None,
        split: Optional[str] = None,
        threads: int = 1,
    ) -> None:
        for product in products:
            if product not in _PRODUCTS:
                raise ValueError(f"products contains {product!r}; it may contain {', '.join(_PRODUCTS)}")
        if split not in (None, "train", "validation", "test"):
            raise ValueError(f"split is {split!r}; it must be train, validation or test")
        self.cohort = Cohort(cohort) if isinstance(cohort, str) else cohort
        self.products = tuple(products)
        self.item = item
        self.threads = threads
        members = range(len(self.cohort))
        #: Indices of the members in the cohort.
        self.members: Sequence[int] = (
            members if split is None else [i for i in members if self.cohort.draw(i)["split"] == split]
        )
        self._process: Optional[int] = None

    def __len__(self) -> int:
        """Number of members."""
        return len(self.members)

    def __getitem__(self, index: int) -> Any:
        """The sample of a member. A member that cannot be computed raises `HeartPhantomError`; `Phantom.warnings` lists its warnings."""
        if self._process != os.getpid():
            set_threads(self.threads)
            self._process = os.getpid()
        phantom = Phantom(self.cohort.member(self.members[index]))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SceneWarning)
            if self.item is not None:
                return self.item(phantom)
            return {product: _PRODUCTS[product](phantom) for product in self.products}

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_process": None}


class ShardDataset:
    """Members in the shards of a directory, which `heart-phantom cohort run` writes.

    Parameters
    ----------
    folder : path_like
        The directory with `shard-*.tar`.
    names : sequence of str, optional
        The entries of a sample, such as `"projections.npy"`, `"truth.npy"`, `"numbers.json"` or `"cls"`; all by default.

    Raises
    ------
    FileNotFoundError
        If the directory has no shards.
    """

    def __init__(self, folder: Union[str, os.PathLike[str]], names: Optional[Sequence[str]] = None) -> None:
        paths = sorted(Path(folder).glob("shard-*.tar"))
        if not paths:
            raise FileNotFoundError(f"{folder} contains no shard-*.tar")
        # Offsets in the archives, so that a worker reads only the necessary parts.
        found: dict[str, dict[str, tuple[str, int, int]]] = {}
        for path in paths:
            with tarfile.open(path) as archive:
                for entry in archive:
                    key, name = entry.name.split(".", 1)
                    if names is None or name.removesuffix(".gz") in names:
                        found.setdefault(key, {})[name] = (str(path), entry.offset_data, entry.size)
        #: Names of the members, sorted.
        self.keys: list[str] = sorted(found)
        self._entries: list[Mapping[str, tuple[str, int, int]]] = [found[key] for key in self.keys]

    def __len__(self) -> int:
        """Number of members."""
        return len(self.keys)

    def __getitem__(self, index: int) -> dict[str, Any]:
        """The entries of a member by name: arrays, dictionaries (`.json`), the index of its case (`cls`), and its `key`."""
        sample: dict[str, Any] = {"key": self.keys[index]}
        for name, (path, start, size) in self._entries[index].items():
            with open(path, "rb") as file:
                file.seek(start)
                data = file.read(size)
            sample[name.removesuffix(".gz")] = _decoded(name, data)
        return sample


def _decoded(name: str, data: bytes) -> Any:
    if name.endswith(".gz"):
        name, data = name.removesuffix(".gz"), gzip.decompress(data)
    if name.endswith(".npy"):
        return np.load(io.BytesIO(data))
    if name.endswith(".json"):
        return json.loads(data)
    return int(data) if name == "cls" else data
