"""Worlds of the study `multi-target`: the paper's, and those that differ from what its filter expects."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Final

from missions.multi_target.target_field import Deviation
from missions.studies.worlds import World

__all__ = ["WORLDS", "SearchWorlds", "Setting"]


class SearchWorlds(StrEnum):
    """Worlds by name."""

    NOMINAL = "nominal"
    MISMATCHED = "mismatched"
    """All that follow."""
    CLUTTER_HALF = "clutter-half"
    CLUTTER_DOUBLE = "clutter-double"
    CLUTTER_UNKNOWN = "clutter-unknown"
    DETECTION_HALF = "detection-half"
    DETECTION_DOUBLE = "detection-double"
    MOTION_HALF = "motion-half"
    MOTION_DOUBLE = "motion-double"
    DRIFT = "drift"
    BIAS_HALF = "bias-half"
    BIAS_DOUBLE = "bias-double"
    MIXED = "mixed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """One world.

    Attributes:
        deviation: of the true world from what the estimator expects.
        expected_clutter: false detections per scan that the estimator expects; the paper's sensor has none.
    """

    deviation: Deviation = field(default_factory=Deviation)
    expected_clutter: float = 0.0


_RANGE_M: Final = math.hypot(0.5, 0.3)
"""Standard deviation of a range that the filter expects: noise, and the error of the vehicle's place."""
_BEARING_RAD: Final = math.hypot(math.radians(1.7), 0.02)
_WALK: Final = 0.03  # m per root second, that the filter expects of static targets
_HALF_AND_DOUBLE: Final = "half and twice what the filter expects: a check of robustness, not a data sheet"
_HEADING: Final = "a compass that is calibrated with the motors off is wrong by some degrees in flight"

WORLDS: Final[Mapping[str, World[Setting]]] = MappingProxyType(
    {
        SearchWorlds.NOMINAL: World(setting=Setting()),
        SearchWorlds.CLUTTER_HALF: World(
            setting=Setting(deviation=Deviation(clutter_per_scan=0.5), expected_clutter=1.0),
            differs="0.5 false detections per scan, the filter expects 1",
            source=_HALF_AND_DOUBLE,
        ),
        SearchWorlds.CLUTTER_DOUBLE: World(
            setting=Setting(deviation=Deviation(clutter_per_scan=2.0), expected_clutter=1.0),
            differs="2 false detections per scan, the filter expects 1",
            source=_HALF_AND_DOUBLE,
        ),
        SearchWorlds.CLUTTER_UNKNOWN: World(
            setting=Setting(deviation=Deviation(clutter_per_scan=0.1)),
            differs="1 false detection in 10 scans, the filter expects none",
            source="the paper's sensor has none; a detector of objects in pictures always has some",
        ),
        SearchWorlds.DETECTION_HALF: World(
            setting=Setting(deviation=Deviation(detection_scale=0.5)),
            differs="detection falls over 7.5 m, the filter expects 15 m",
            source=_HALF_AND_DOUBLE,
        ),
        SearchWorlds.DETECTION_DOUBLE: World(
            setting=Setting(deviation=Deviation(detection_scale=2.0)),
            differs="detection falls over 30 m, the filter expects 15 m",
            source=_HALF_AND_DOUBLE,
        ),
        SearchWorlds.MOTION_HALF: World(
            setting=Setting(deviation=Deviation(walk_m_sqrt_s=0.5 * _WALK)),
            differs=f"targets walk by {0.5 * _WALK:g} m per root second, the filter expects {_WALK:g}",
            source=_HALF_AND_DOUBLE,
        ),
        SearchWorlds.MOTION_DOUBLE: World(
            setting=Setting(deviation=Deviation(walk_m_sqrt_s=2.0 * _WALK)),
            differs=f"targets walk by {2.0 * _WALK:g} m per root second, the filter expects {_WALK:g}",
            source=_HALF_AND_DOUBLE,
        ),
        SearchWorlds.DRIFT: World(
            setting=Setting(deviation=Deviation(walk_m_sqrt_s=0.3)),
            differs=f"targets walk by 0.3 m per root second, the filter expects {_WALK:g}",
            source="litter that the wind moves by 5 m in 5 minutes",
        ),
        SearchWorlds.BIAS_HALF: World(
            setting=Setting(
                deviation=Deviation(range_bias_m=0.5 * _RANGE_M, bearing_bias_rad=0.5 * _BEARING_RAD)
            ),
            differs="every range is 0.29 m too long and every bearing 1.0 degree off: half a sigma",
            source=_HALF_AND_DOUBLE,
        ),
        SearchWorlds.BIAS_DOUBLE: World(
            setting=Setting(
                deviation=Deviation(range_bias_m=2.0 * _RANGE_M, bearing_bias_rad=2.0 * _BEARING_RAD)
            ),
            differs="every range is 1.17 m too long and every bearing 4.1 degrees off: two sigma",
            source=_HEADING,
        ),
        SearchWorlds.MIXED: World(
            setting=Setting(
                deviation=Deviation(
                    clutter_per_scan=0.1,
                    detection_scale=0.7,
                    range_bias_m=_RANGE_M,
                    bearing_bias_rad=_BEARING_RAD,
                    walk_m_sqrt_s=2.0 * _WALK,
                )
            ),
            differs="unknown clutter of 0.1 per scan, detection over 10.5 m, biases of one sigma, and a "
            "walk of 0.06 m per root second",
            source="several of the worlds above at once",
        ),
    }
)
"""The worlds, in the order in which tables show them."""
