"""The estimators by name. One in a folder of this package has a line here, and nowhere else.

A user's package names its own in `pyproject.toml`: group `flightstack.estimators`, value the class.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

GROUP: Final = "flightstack.estimators"

ESTIMATORS: Final[Mapping[str, str]] = MappingProxyType(
    {
        name: f"estimators.{name.replace('-', '_')}"
        for name in (
            *("attitude", "handoff", "lissajous", "magnetic-identification", "multi-target", "orbit-target"),
            *("relative-pose", "survey", "target-fusion", "vision-search"),
        )
    }
)
"""Module of each estimator; it is imported only when it is used."""
