"""Libraries of the extras of the package, which most runs do without."""

import importlib
from pathlib import Path
from typing import Any

from estimators.errors import EstimatorError

__all__ = ["library"]


def library(name: str, path: Path, extra: str = "maps") -> Any:
    """A library of an extra.

    Args:
        name: of the module.
        path: the file that needs it.
        extra: the extra that installs it.

    Raises:
        EstimatorError: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        module = name.partition(".")[0]
        raise EstimatorError(
            f"{path} needs {module}, which is not installed: pip install 'flightstack[{extra}]'"
        ) from None
