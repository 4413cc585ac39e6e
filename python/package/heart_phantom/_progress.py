"""Reports of progress: a callable, a bar of tqdm, or True."""

import sys
from importlib import import_module
from typing import Any, Callable, Optional


def reporter(progress: Any) -> Callable[[float], object]:
    """Returns a function of the completed fraction.

    `progress` is a callable of the fraction, an object with `update` and `total` such as a bar of tqdm, or `True`: a bar of tqdm if it is
    installed, otherwise a line on the standard error.
    """
    if progress is True:
        try:
            tqdm = import_module("tqdm.auto").tqdm
        except ImportError:
            return _line
        progress = tqdm(total=100, unit="%", bar_format="{l_bar}{bar}| {elapsed}<{remaining}")
        return _bar(progress, close=True)
    if hasattr(progress, "update") and hasattr(progress, "total"):
        return _bar(progress, close=False)
    if not callable(progress):
        raise TypeError(f"progress is a {type(progress).__name__}; it must be a callable, a bar of tqdm, or True")
    return progress  # type: ignore[no-any-return]


def parts(progress: Any, n: int) -> list[Optional[Callable[[float], object]]]:
    """Returns the functions of the completed fraction of n calls that share `progress`."""
    if progress is None:
        return [None] * n
    report = reporter(progress)

    def part(k: int) -> Callable[[float], object]:
        return lambda fraction: report((k + fraction) / n)

    return [part(k) for k in range(n)]


def _bar(bar: Any, close: bool) -> Callable[[float], object]:
    if bar.total is None:
        bar.total = 1.0
    done = 0.0

    def report(fraction: float) -> None:
        nonlocal done
        if fraction * bar.total > done:
            bar.update(fraction * bar.total - done)
            done = fraction * bar.total
        if close and fraction >= 1.0:
            bar.close()

    return report


def _line(fraction: float) -> None:
    sys.stderr.write(f"\r{100 * fraction:3.0f} %" + ("\n" if fraction >= 1.0 else ""))
    sys.stderr.flush()
