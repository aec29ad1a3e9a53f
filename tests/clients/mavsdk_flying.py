"""What tests by MAVSDK do again and again: ask, be refused, take off, hold, land."""

from collections.abc import Callable, Sequence
from typing import Any, Final

import pytest

from tests.clients.mavsdk_session import Session

HEIGHT_M: Final = 8.0
DEG_PER_M: Final = 1.0 / 111_195.0


def raw_item(
    seq: int,
    command: int,
    latitude_deg: float,
    longitude_deg: float,
    *,
    frame: int = 6,
    height_m: float = 10.0,
    parameters: Sequence[float] = (),
) -> Any:
    """An item of a mission as `mission_raw` has them; frame 6: height over home."""
    from mavsdk.plugins.mission_raw import MissionItem

    param1, param2, param3, param4 = (*parameters, *(0.0,) * (4 - len(parameters)))
    return MissionItem(
        seq=seq,
        frame=frame,
        command=command,
        current=int(seq == 0),
        autocontinue=1,
        param1=param1,
        param2=param2,
        param3=param3,
        param4=param4,
        x=round(latitude_deg * 1e7),
        y=round(longitude_deg * 1e7),
        z=height_m,
        mission_type=0,
    )


def rejected(session: Session, plugin: str, method: str, *arguments: Any) -> str:
    """The name of the result that a call is refused with."""
    from mavsdk.exceptions import MavsdkError

    with pytest.raises(MavsdkError) as caught:
        session.call(plugin, method, *arguments)
    return str(caught.value).split(";")[0].split(":")[0].strip()


def accepted(session: Session, plugin: str, method: str, *arguments: Any) -> bool:
    """A call went through; False when it can't be done (now)."""
    from mavsdk.exceptions import MavsdkError

    try:
        session.call(plugin, method, *arguments)
    except MavsdkError:
        return False
    return True


def land(session: Session) -> None:
    """On the ground and disarmed."""
    if session.first("telemetry", "armed"):
        session.until("landing", lambda: accepted(session, "action", "land"))
        session.first("telemetry", "armed", lambda armed: not armed)


def _arms(session: Session) -> bool:
    session.before_arming()
    return accepted(session, "action", "arm")


def fly(session: Session) -> Any:
    """In the air, holding; the position there."""
    if not session.first("telemetry", "in_air"):
        land(session)
        session.call("action", "set_takeoff_altitude", HEIGHT_M)
        session.until("arming", lambda: _arms(session))
        session.call("action", "takeoff")
        session.first("telemetry", "position", lambda p: p.relative_altitude_m > HEIGHT_M - 1.0)
        session.first("telemetry", "landed_state", lambda state: state.name == "IN_AIR")
    session.until("hold", lambda: accepted(session, "action", "hold"))
    return session.first("telemetry", "position")


def moved(session: Session, found: Callable[[Any], bool], each: Callable[[], None] | None = None) -> None:
    """Wait for a local position and velocity."""
    session.first("telemetry", "position_velocity_ned", found, each)
