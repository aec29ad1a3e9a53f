"""Public names of a package, imported when they are used, so that the package itself imports quickly.

A package declares each public name once, in its stub `__init__.pyi`. What is not in a stub is private.
Type checkers read the stub, and so does the package when it is imported.
"""

import ast
import importlib
from collections.abc import Callable
from pathlib import Path


def lazy_exports(
    package: str, file: str
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """The functions `__getattr__` and `__dir__` (PEP 562) and the list `__all__` of a package.

    Args:
        package: its name.
        file: its `__file__`, beside which its stub lies.
    """
    modules: dict[str, str] = {}
    for statement in ast.parse(Path(file).with_suffix(".pyi").read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.ImportFrom) and statement.module:
            modules |= dict.fromkeys((alias.name for alias in statement.names), statement.module)
    return _exports(package, modules)


def joined_exports(
    name: str, *packages: str
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """The same for a module that exports the public names of several packages.

    Args:
        name: of the module.
        packages: their names.
    """
    return _exports(
        name, {public: package for package in packages for public in importlib.import_module(package).__all__}
    )


def _exports(
    name: str, modules: dict[str, str]
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    public = sorted(modules)

    def find(wanted: str) -> object:
        if wanted not in modules:
            raise AttributeError(
                f"module {name!r} has no attribute {wanted!r}; there are {', '.join(public)}"
            )
        return getattr(importlib.import_module(modules[wanted]), wanted)

    return find, lambda: public, public
