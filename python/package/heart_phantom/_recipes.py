"""Repetition of the calls that made pickled objects."""

from typing import Any, Callable, Optional

from heart_phantom._native import Phantom, Scene


def call(function: Callable[..., Any], arguments: tuple[Any, ...], options: dict[str, Any]) -> Any:
    """Calls a function with arguments by place and by name."""
    return function(*arguments, **options)


def of_phantom(scene: Scene, method: str, arguments: tuple[Any, ...], item: Optional[int]) -> Any:
    """Calls a method of the phantom of a scene; selects one of its results if `item` is given."""
    made = getattr(Phantom(scene), method)(*arguments)
    return made if item is None else made[item]
