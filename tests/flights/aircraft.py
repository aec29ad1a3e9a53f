"""A pilot of a fixed wing at the end of a memory link."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from autopilot_bridge.mavlink import dialect
from flightsim import truth as t
from flightsim.environment import Environment
from tests.flights.flight import SYSTEM_ID, Flight

_PX4_MODES: Final[Mapping[str, tuple[float, float]]] = {
    "manual": (1, 0),
    "altitude": (2, 0),
    "position": (3, 0),
    "takeoff": (4, 2),
    "hold": (4, 3),
    "mission": (4, 4),
    "return": (4, 5),
    "land": (4, 6),
    "acro": (5, 0),
    "offboard": (6, 0),
    "stabilized": (7, 0),
}
_ARDUPLANE_MODES: Final[Mapping[str, tuple[float, float]]] = {
    "manual": (0, 0),
    "circle": (1, 0),
    "stabilize": (2, 0),
    "training": (3, 0),
    "acro": (4, 0),
    "fbwa": (5, 0),
    "fbwb": (6, 0),
    "cruise": (7, 0),
    "mission": (10, 0),
    "return": (11, 0),
    "hold": (12, 0),
    "takeoff": (13, 0),
    "guided": (15, 0),
    "initialising": (16, 0),
}
_GLOBAL_RELATIVE_INT: Final = 6
_FRAME_MISSION: Final = 2
_METRES_PER_DEG: Final = math.radians(6_371_000.0)


class Item:
    """One plan item at a place given in metres from home; without a place it has MAV_FRAME_MISSION."""

    def __init__(
        self,
        command: int,
        north_m: float | None = None,
        east_m: float = 0.0,
        height_m: float = 0.0,
        params: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
    ) -> None:
        self.command = command
        self.north_m = north_m
        self.east_m = east_m
        self.height_m = height_m
        self.params = tuple(params)


class AircraftFlight(Flight):
    """One aircraft, flown over the link alone.

    Args:
        flavour: "px4" or "ardupilot".
        launch: None: from the runway.
    """

    def __init__(
        self,
        flavour: str = "px4",
        *,
        seed: int = 1,
        parameters: Mapping[str, float] | None = None,
        environment: Environment | None = None,
        launch: str | None = None,
        model: str = "aerosonde",
    ) -> None:
        super().__init__(
            flavour, seed=seed, parameters=parameters, environment=environment, model=model, launch=launch
        )
        self._modes = _PX4_MODES if flavour == "px4" else _ARDUPLANE_MODES

    # the truth

    @property
    def airspeed_m_s(self) -> float:
        return float(self.truth[t.AIRSPEED_TRUE_M_S])

    @property
    def roll_deg(self) -> float:
        w, x, y, z = self.truth[t.Q_NED_FROM_FRD]
        return math.degrees(math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)))

    @property
    def height_over_home_m(self) -> float:
        return -self.position_ned_m[2]

    def distance_m(self, north_m: float, east_m: float) -> float:
        north, east, _ = self.position_ned_m
        return math.hypot(north - north_m, east - east_m)

    # what is said

    def geodetic(self, north_m: float, east_m: float) -> tuple[float, float]:
        """(latitude, longitude) deg of a place given from home."""
        home = self.sitl.spec.place
        lat = home.lat_deg + north_m / _METRES_PER_DEG
        return lat, home.lon_deg + east_m / (_METRES_PER_DEG * math.cos(math.radians(home.lat_deg)))

    def on_runway(self, along_m: float, right_m: float = 0.0) -> tuple[float, float]:
        """North and east of a place given along the runway that starts at home, and to its right."""
        heading = math.radians(self.sitl.spec.place.heading_deg)
        c, s = math.cos(heading), math.sin(heading)
        return along_m * c - right_m * s, along_m * s + right_m * c

    def command_int(
        self, command: int, params: Sequence[float], north_m: float, east_m: float, height_m: float
    ) -> int | None:
        """COMMAND_INT at a place over home; its last answer within half a second."""
        lat, lon = self.geodetic(north_m, east_m)
        received = len(self.acks)
        self.send(
            dialect.MAVLink_command_int_message(  # type: ignore[call-arg]
                SYSTEM_ID,
                1,
                _GLOBAL_RELATIVE_INT,
                command,
                0,
                0,
                *params,
                round(lat * 1e7),
                round(lon * 1e7),
                height_m,
            )
        )
        self.fly(0.5)
        answers = [result for _, number, result in self.acks[received:] if number == command]
        return answers[-1] if answers else None

    def upload(self, items: Sequence[Item]) -> None:
        """Upload a plan by the mission protocol. ArduPilot's item 0 is put before it."""
        plan = list(items)
        if self.flavour == "ardupilot":
            plan.insert(0, Item(dialect.MAV_CMD_NAV_WAYPOINT, 0.0, 0.0, 0.0))
        self.newest.pop("MISSION_ACK", None)
        self.newest.pop("MISSION_REQUEST", None)
        self.newest.pop("MISSION_REQUEST_INT", None)
        self.send(dialect.MAVLink_mission_count_message(SYSTEM_ID, 1, len(plan)))
        for _ in range(40 * len(plan)):
            self.fly(0.1)
            ack = self.newest.get("MISSION_ACK")
            if ack is not None:
                assert ack.type == 0, f"mission refused: {ack}, {self.texts[-3:]}"
                return
            for name in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
                request = self.newest.pop(name, None)
                if request is not None:
                    self._send_item(request.seq, plan[request.seq])
        raise AssertionError("mission upload without an end")

    def _send_item(self, seq: int, item: Item) -> None:
        lat, lon = (0.0, 0.0) if item.north_m is None else self.geodetic(item.north_m, item.east_m)
        self.send(
            dialect.MAVLink_mission_item_int_message(  # type: ignore[call-arg]
                SYSTEM_ID,
                1,
                seq,
                _FRAME_MISSION if item.north_m is None else _GLOBAL_RELATIVE_INT,
                item.command,
                0,
                1,
                *item.params,
                round(lat * 1e7),
                round(lon * 1e7),
                item.height_m,
            )
        )

    def circle(self, north_m: float, east_m: float, height_m: float, radius_m: float = 0.0) -> int | None:
        """Circle a place; a negative radius is counter-clockwise, 0 leaves the radius to the firmware.

        PX4 gets DO_ORBIT where a radius is given, since it does not read that of DO_REPOSITION; ArduPilot
        gets DO_REPOSITION with a change of mode.
        """
        if self.flavour == "px4":
            alt_m = self.newest["HOME_POSITION"].altitude * 1e-3 + height_m
            place = (*self.geodetic(north_m, east_m), alt_m)
            if radius_m != 0.0:
                return self.result(dialect.MAV_CMD_DO_ORBIT, radius_m, math.nan, 0, math.nan, *place)
            return self.result(dialect.MAV_CMD_DO_REPOSITION, -1, 1, 0, math.nan, *place)
        clockwise = math.nan if radius_m >= 0.0 else 1.0
        return self.command_int(
            dialect.MAV_CMD_DO_REPOSITION, (0, 1, abs(radius_m), clockwise), north_m, east_m, height_m
        )

    def attitude_setpoint(
        self, roll_deg: float, pitch_deg: float, thrust: float, type_mask: int = 0x07
    ) -> Any:
        """SET_ATTITUDE_TARGET; type_mask 0x07 ignores the body rates."""
        roll, pitch = math.radians(roll_deg) / 2.0, math.radians(pitch_deg) / 2.0
        q = (
            math.cos(roll) * math.cos(pitch),
            math.sin(roll) * math.cos(pitch),
            math.cos(roll) * math.sin(pitch),
            -math.sin(roll) * math.sin(pitch),
        )
        return dialect.MAVLink_set_attitude_target_message(
            self.sitl.time_us // 1000, SYSTEM_ID, 1, type_mask, q, 0.0, 0.0, 0.0, thrust
        )

    # usual beginnings

    def get_ready(self) -> None:
        """From boot to ready to arm; asks for the streams the pilot looks at."""
        self.fly(2.5)
        for message_id, rate_hz in ((1, 2), (245, 5), (33, 10), (32, 10), (30, 10), (74, 10), (42, 5)):
            self.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / rate_hz)

        def ready() -> bool:
            status = self.newest.get("SYS_STATUS")
            return status is not None and bool(status.onboard_control_sensors_health & 0x10000000)

        self.fly_until(ready, 60.0, "readiness")

    def start(self) -> None:
        """Ready, in the take-off mode, armed."""
        self.get_ready()
        self.set_mode("takeoff")
        self.arm()

    def take_off(self, height_m: float = 50.0, place: tuple[float, float] = (150.0, 150.0)) -> None:
        """Take off, and circle at a place and height."""
        self.start()
        self.fly_until(lambda: self.height_over_home_m > 18.0, 40.0, "climb")
        assert self.circle(*place, height_m, 100.0) == 0, self.texts
        self.fly_until(
            lambda: abs(self.height_over_home_m - height_m) < 3.0 and self.distance_m(*place) < 130.0,
            90.0,
            "circle",
        )

    def cross_track_m(self, start: tuple[float, float], end: tuple[float, float]) -> float:
        """True distance from the line through two places, to its right."""
        along = np.array(end) - np.array(start)
        along /= np.hypot(*along)
        north, east, _ = self.position_ned_m
        return float(along[0] * (east - start[1]) - along[1] * (north - start[0]))
