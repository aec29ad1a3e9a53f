"""Worlds of the study `handoff` that its estimators do not know, within what hardware shows."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Final

from missions.studies.handoff_world import HandoffSetting
from missions.studies.worlds import NOMINAL, World

__all__ = ["HANDOFF_WORLDS", "Deviation"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """Fields of a setting that differ from the nominal one.

    Attributes:
        fields: values by name.
    """

    fields: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    def over(self, nominal: HandoffSetting) -> HandoffSetting:
        """The setting of the world."""
        return replace(nominal, **self.fields)


def _world(differs: str, source: str, **fields: Any) -> World[Deviation]:
    return World(setting=Deviation(fields=MappingProxyType(fields)), differs=differs, source=source)


HANDOFF_WORLDS: Final[Mapping[str, World[Deviation]]] = MappingProxyType(
    {
        NOMINAL: World(setting=Deviation()),
        "clock": _world(
            "what the tracker sends is 0.3 s older than its stamps say",
            "delay of a telemetry link with retransmissions; the least delay counts as offset of the clocks "
            "(estimators.relative_pose.reported_aircraft)",
            clock_s=0.3,
        ),
        "heading": _world(
            "0.05 rad of constant error in the relative heading",
            "alignment of a magnetometer to the airframe: 1 to 3 degrees after calibration of both",
            heading_bias_rad=0.05,
        ),
        "iron": _world(
            "0.06 rad of error in each heading, one cycle in a turn",
            "hard iron of currents in the airframe: some uT of 20 uT horizontal field",
            iron_rad=0.06,
        ),
        "tilt": _world(
            "1 degree of constant error of roll and of pitch of each camera, and 1.5 times the slow errors",
            "mounting of a gimbal; docs/attitude.md has the filter's errors, up to 1.6 deg^2",
            mount_rad=math.radians(1.0),
            tilt_sigma_rad=0.018,
        ),
        "dense": _world("10 targets in the area for 5", "a group of persons", targets=10),
        "mixed": _world(
            "all of these, with 8 targets",
            "they do not exclude each other",
            clock_s=0.3,
            heading_bias_rad=0.05,
            iron_rad=0.06,
            mount_rad=math.radians(1.0),
            tilt_sigma_rad=0.018,
            targets=8,
        ),
        "alike": _world("all targets look the same", "uniforms", clothes_sigma=(0.0, 0.0, 0.0)),
    }
)
"""The nominal world, and those that differ from what the estimators assume."""
