"""`flightstack --version -v`: the program, the system, and which packages are there."""

import platform
import re
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, packages_distributions, requires, version
from typing import Final

from flightsim.foundation.packages import OPTIONAL, how_to_install

__all__ = ["installation", "program_version"]

_NAME: Final = "flightstack"


def program_version() -> str:
    """The line of `--version`."""
    return f"{_NAME}, version {version(_NAME)}"


def installation() -> Iterator[str]:
    """The lines of `--version -v`: Python and the system, the dependencies' versions, and what is missing."""
    yield program_version()
    yield f"Python {platform.python_version()}, {platform.platform()}"
    core = (text for text in requires(_NAME) or () if "extra ==" not in text)
    names = {found[0] for found in map(re.compile(r"[\w.-]+").match, core) if found}
    present = packages_distributions()
    names |= {present[module][0] for module in OPTIONAL if module in present}
    for name in sorted(names, key=str.lower):
        try:
            yield f"{name} {version(name)}"
        except PackageNotFoundError:  # left out on this system; named below
            continue
    for module, package in OPTIONAL.items():
        if module not in present:
            yield f"{package.name}: not installed; {how_to_install(package)}"
