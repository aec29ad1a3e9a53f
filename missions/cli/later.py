"""Functions and classes that are imported when they are used.

A command is declared in a module that imports little, so that help and errors of usage appear quickly. What
it does is a function in `missions.cli.bodies`, which imports at its top all that it needs.
"""

import importlib
from collections.abc import Callable
from functools import wraps
from typing import Any


def named(place: tuple[str, str]) -> Any:
    """The object of a module and a name."""
    module, name = place
    return getattr(importlib.import_module(module), name)


def later(module: str, name: str) -> Callable[..., Any]:
    """A function that is imported when it is called."""

    def call(*arguments: Any, **keywords: Any) -> Any:
        return named((module, name))(*arguments, **keywords)

    return call


def body_in(module: str) -> Callable[[Callable[[], object]], Callable[..., Any]]:
    """Decorator of the declaration of a command, which has its name and its help: the function of the same
    name in the module is its body, and receives its options.
    """

    def declared(declaration: Callable[[], object]) -> Callable[..., Any]:
        return wraps(declaration)(later(module, declaration.__name__))

    return declared
