"""The end of a return: most vehicles land and disarm; by their parameters some stay in the air over home.

ArduPlane circles unless RTL_AUTOLAND and a landing sequence bring it down; PX4 circles or hovers with a
negative RTL_LAND_DELAY, which is the default of its fixed wings; ArduCopter hovers at RTL_ALT_FINAL where
that is above 0.

Sources: ArduPilot 4.6.3, ArduPlane/mode_rtl.cpp and ArduCopter/mode_rtl.cpp; PX4 1.16.1, rtl_direct.cpp.
"""

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from missions.kind import VehicleKind
from missions.vehicle.firmware import Mode
from missions.vehicle.link import VehicleLink
from missions.vehicle.parameters import VehicleParameters
from missions.vehicle.telemetry import Position

_STEADY_M: Final = 5.0  # a circle at one height, not a descent
_HOVER_S: Final = 10.0
_SLOW_M_S: Final = 0.7
_LANDS_WITH_SEQUENCE: Final = (1, 2, 4)  # RTL_AUTOLAND

_STAYS: Final[Mapping[tuple[str, VehicleKind], tuple[str, float, Callable[[float], bool]]]] = (
    MappingProxyType(
        {
            ("px4", VehicleKind.MULTICOPTER): ("RTL_LAND_DELAY", 0.0, lambda value: value < 0.0),
            ("px4", VehicleKind.FIXED_WING): ("RTL_LAND_DELAY", -1.0, lambda value: value < 0.0),
            ("ardupilot", VehicleKind.MULTICOPTER): ("RTL_ALT_FINAL", 0.0, lambda value: value > 0.0),
            ("ardupilot", VehicleKind.FIXED_WING): ("RTL_AUTOLAND", 0.0, lambda value: True),
        }
    )
)
"""Parameter, firmware's default, and whether a return with this value may end in the air."""


class AloftWatch:
    """Detects from positions that a returning vehicle stays in the air: an aircraft has flown a full turn at
    one height, a multicopter has hovered for ten seconds. Sans-IO.

    Args:
        kind: class of vehicle.

    Attributes:
        settled: whether it stays there.
    """

    def __init__(self, kind: VehicleKind) -> None:
        self.settled = False
        self._wings = kind is VehicleKind.FIXED_WING
        self._height_m = math.inf
        self._since_us = 0
        self._course_rad = 0.0
        self._turned_rad = 0.0

    def take(self, position: Position, *, returning: bool) -> None:
        """Process a position.

        Args:
            position: newest position.
            returning: whether the vehicle is in the mode of a return.
        """
        north_m_s, east_m_s, down_m_s = position.vel_ned_m_s
        course_rad = math.atan2(east_m_s, north_m_s)
        moves = not self._wings and math.hypot(north_m_s, east_m_s, down_m_s) > _SLOW_M_S
        if not returning or moves or abs(position.height_m - self._height_m) > _STEADY_M:
            self._height_m, self._since_us = position.height_m, position.time_us
            self._turned_rad = 0.0
        else:
            self._turned_rad += math.remainder(course_rad - self._course_rad, math.tau)
        self._course_rad = course_rad
        if self._wings:
            self.settled = abs(self._turned_rad) >= math.tau
        else:
            self.settled = position.time_us - self._since_us >= _HOVER_S * 1e6


class ReturnEnd:
    """The end of the returns of one vehicle.

    Args:
        link: messages of the vehicle.
        parameters: its parameters.
    """

    def __init__(self, link: VehicleLink, parameters: VehicleParameters) -> None:
        self._link = link
        self._parameters = parameters

    @property
    def stay(self) -> str:
        """What a vehicle of this kind does that stays in the air."""
        return "circles" if self._link.kind is VehicleKind.FIXED_WING else "hovers"

    async def stays_because(self) -> str:
        """The parameter by which a return ends in the air, and its value: "RTL_AUTOLAND 0"; "": it lands.

        With RTL_AUTOLAND 1, 2 and 4 ArduPlane lands only if its mission has a landing sequence.
        """
        name, usual, stays = _STAYS[self._link.firmware.name, self._link.kind]
        value = await self._parameters.read_or(name, usual)
        if not stays(value):
            return ""
        needed = " without a landing sequence" if value in _LANDS_WITH_SEQUENCE else ""
        return f"{name} {value:g}{needed}" if name == "RTL_AUTOLAND" else f"{name} {value:g}"

    async def wait(self, timeout_s: float) -> None:
        """Wait for the end of a return: until the vehicle is disarmed, or stays in the air over home.

        In the second case the notes get a warning, and `aloft`.

        Raises:
            VehicleTimeout: neither happened within the time.
        """
        link = self._link
        watch = AloftWatch(link.kind)
        returning = link.firmware.modes[Mode.RETURN]
        begun_us = link.clock.time_us

        def ended() -> bool:
            position = link.latest(Position)
            if position is not None:
                watch.take(position, returning=link.custom_mode == returning)
            return not link.armed or watch.settled

        await link.wait_until(
            ended, what="disarmed heartbeat", on=("HEARTBEAT", "GLOBAL_POSITION_INT"), timeout_s=timeout_s
        )
        if not link.armed:
            return
        reason = await self.stays_because()
        if not reason:  # it waits before it lands
            passed_s = (link.clock.time_us - begun_us) * 1e-6
            await link.wait_disarmed(max(1.0, timeout_s - passed_s))
            return
        position = link.latest(Position)
        height = "" if position is None else f", {position.height_m:.0f} m above it"
        link.notes.aloft = f"{self.stay} over home in mode {link.mode}{height}, armed"
        link.notes.warn(
            f"its return has ended in the air: it {link.notes.aloft} ({reason}); land it by hand, or end the "
            "flight with a landing"
        )
