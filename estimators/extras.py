"""Libraries of the extras of the package, which most runs do without."""

from pathlib import Path
from typing import Any

from estimators.errors import EstimatorError
from flightsim.foundation.packages import MissingPackage, required

__all__ = ["library"]


def library(name: str, path: Path) -> Any:
    """A library of an extra.

    Args:
        name: of the module.
        path: the file that needs it.

    Raises:
        EstimatorError: it is not installed.
    """
    try:
        return required(name, str(path))
    except MissingPackage as error:
        raise EstimatorError(str(error)) from None
