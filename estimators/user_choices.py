"""What users choose of every estimator, and of logs."""

from enum import StrEnum
from typing import Final

ESTIMATOR_COMPONENTS: Final = range(191, 195)
"""Component ids of estimators: MAVLink's onboard computers, the default one first."""


class ExportFormat(StrEnum):
    """The formats of other tools that logs are written in: of messages, and of places on a map."""

    CSV = "csv"
    PARQUET = "parquet"
    NPZ = "npz"
    MCAP = "mcap"
    KML = "kml"
    GPX = "gpx"
    GEOJSON = "geojson"


class Against(StrEnum):
    """The references that estimates are compared with."""

    AUTOPILOT = "autopilot"
    TRUTH = "truth"
    BOTH = "both"
    """Both of them, the autopilot first."""
