"""mavutil flying an aircraft: places in metres from home, circles and attitudes as they are reported."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from tests.clients.mavutil_client import Client, Each
from tests.clients.runway import Place, Runway
from tests.clients.sitl_process import free_port, running_sitl

SPEEDUP: Final = 25.0


class AircraftClient(Client):
    """A client of an aircraft.

    Attributes:
        runway: where it stood when it was ready.
    """

    def __init__(self, flavour: str, url: str, *, speedup: float = SPEEDUP) -> None:
        super().__init__(flavour, url, speedup=speedup, stream_hz=5)
        self.runway = Runway(lat_deg=math.nan, lon_deg=math.nan, alt_m=math.nan, heading_rad=0.0)

    def ready(self) -> None:
        """Wait until it may be armed, and see where it is."""
        super().ready()
        here = self.next("GLOBAL_POSITION_INT")
        self.runway = Runway(
            lat_deg=here.lat * 1e-7,
            lon_deg=here.lon * 1e-7,
            alt_m=here.alt * 1e-3,
            heading_rad=math.radians(here.hdg * 1e-2),
        )

    def geodetic(self, place: Place, height_m: float) -> tuple[float, float, float]:
        """Latitude, longitude and the height of a place."""
        return self.runway.geodetic(place, height_m)

    def distance_m(self, position: Any, place: Place) -> float:
        """From a GLOBAL_POSITION_INT to a place."""
        return math.dist(self.runway.place(position.lat * 1e-7, position.lon * 1e-7), place)

    # what it is seen to do

    def climbs_to(self, height_m: float, each: Each = None) -> Any:
        """Wait for a height over home."""
        return self.next("GLOBAL_POSITION_INT", lambda m: m.relative_alt * 1e-3 > height_m, each)

    def circles(
        self,
        place: Place,
        radius_m: float,
        height_m: float,
        *,
        seconds: float = 8.0,
        within_m: float = 12.0,
        each: Each = None,
    ) -> None:
        """Wait until it circles a place steadily; a negative radius is counter-clockwise."""
        self.holds(
            f"circle of {radius_m} m around {place} at {height_m} m",
            seconds,
            "GLOBAL_POSITION_INT",
            lambda m: (
                abs(self.distance_m(m, place) - abs(radius_m)) < within_m
                and abs(m.relative_alt * 1e-3 - height_m) < 6.0
                and self._turning(m, place) == math.copysign(1.0, radius_m)
            ),
            each,
        )

    def _turning(self, position: Any, place: Place) -> float:
        """1.0 clockwise around a place, -1.0 counter-clockwise."""
        north_m, east_m = self.runway.place(position.lat * 1e-7, position.lon * 1e-7)
        north_m, east_m = north_m - place[0], east_m - place[1]
        return math.copysign(1.0, north_m * position.vy - east_m * position.vx)

    def banks(
        self, roll_deg: float, *, seconds: float = 2.0, within_deg: float = 2.5, each: Each = None
    ) -> None:
        """Wait until it holds a bank angle."""
        self.holds(
            f"roll of {roll_deg} deg",
            seconds,
            "ATTITUDE",
            lambda m: abs(math.degrees(m.roll) - roll_deg) < within_deg,
            each,
        )

    def flies_at(self, airspeed_m_s: float, *, within_m_s: float = 1.0, seconds: float = 3.0) -> None:
        """Wait until it holds an airspeed."""
        since: list[float] = []

        def held(message: Any) -> bool:
            if message.get_type() == "VFR_HUD":
                if abs(message.airspeed - airspeed_m_s) > within_m_s:
                    since.clear()
                else:
                    since.append(clock[0])
            elif message.get_type() == "ATTITUDE":
                clock[0] = message.time_boot_ms * 1e-3
            return bool(since) and since[-1] - since[0] >= seconds

        clock = [0.0]
        self.until(f"airspeed of {airspeed_m_s} m/s", held)

    # what is requested

    def send_attitude(self, roll_deg: float, pitch_deg: float, thrust: float, type_mask: int = 0x07) -> None:
        """SET_ATTITUDE_TARGET of roll and pitch; type_mask 0x07 ignores the body rates."""
        roll, pitch = math.radians(roll_deg) / 2.0, math.radians(pitch_deg) / 2.0
        q = (
            math.cos(roll) * math.cos(pitch),
            math.sin(roll) * math.cos(pitch),
            math.cos(roll) * math.sin(pitch),
            -math.sin(roll) * math.sin(pitch),
        )
        self.link.mav.set_attitude_target_send(0, 1, 1, type_mask, q, 0.0, 0.0, 0.0, thrust)


@contextmanager
def aircraft(flavour: str) -> Iterator[AircraftClient]:
    """A client of an Aerosonde on the runway, in a SITL of its own."""
    port = free_port()
    with running_sitl(
        flavour, [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP, options=["--model", "aerosonde"]
    ):
        client = AircraftClient(flavour, f"udpin:127.0.0.1:{port}")
        try:
            yield client
        finally:
            client.link.close()
