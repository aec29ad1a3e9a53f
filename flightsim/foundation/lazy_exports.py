"""Public names of a package, imported when they are used, so that the package itself imports quickly."""

import importlib
from collections.abc import Callable, Mapping


def lazy_exports(package: str, modules: Mapping[str, str]) -> Callable[[str], object]:
    """The module function `__getattr__` (PEP 562) of a package.

    Args:
        package: name of the package.
        modules: by public name, the module that defines it.
    """

    def find(name: str) -> object:
        if name not in modules:
            raise AttributeError(
                f"module {package!r} has no attribute {name!r}; there are {', '.join(modules)}"
            )
        return getattr(importlib.import_module(modules[name]), name)

    return find
