"""What a mission may ask of an aircraft, flown in the embedded SITL of both firmwares."""

import asyncio
import math

import numpy as np
import pytest

from autopilot_bridge.clock import LoopClock, run
from autopilot_bridge.mavlink import dialect
from flightsim.environment import Environment
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.world_spec import WorldSpec
from missions.embedded import EmbeddedSitl
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.vehicle import Mode, Vehicle
from missions.vehicle.adapters import ArduPilot, Px4
from missions.vehicle.connection import Connection
from missions.vehicle.limits import FixedWingLimits
from missions.vehicle.telemetry import AirData, Attitude, Position
from missions.vehicle.wing import Approach

HEIGHT = 80.0


def flown(flavour, script, *, wind=5.0):
    """Run `async def script(vehicle)` on an aircraft in wind from the east; gives its result."""
    sitl = EmbeddedSitl(
        WorldSpec.of_team(
            model="aerosonde",
            autopilot=flavour,
            seed=3,
            air=Environment.from_wind(speed_m_s=wind, from_deg=90.0),
        ),
        max_flight_s=900.0,
    )

    async def main():
        async with Connection(sitl.links[0], LoopClock()) as connection:
            vehicle = Vehicle(connection)
            await vehicle.wait_ready()
            return await script(vehicle)

    try:
        return run(main(), sitl.loop)
    finally:
        sitl.close()
        sitl.loop.close()


async def watch(vehicle, seconds, look):
    """What `look` sees ten times a second."""
    seen = []
    for _ in range(round(seconds * 10)):
        await vehicle.clock.sleep(0.1)
        seen.append(look())
    return np.array(seen)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.slow
def test_an_aircraft_is_flown_by_circles_headings_and_an_approach(flavour):
    async def script(vehicle):
        assert vehicle.kind is VehicleKind.FIXED_WING
        limits = await vehicle.limits()
        assert isinstance(limits, FixedWingLimits)
        assert limits.airspeed_trim_m_s == pytest.approx(25.0)
        with pytest.raises(PlanError, match=r"use wing\.loiter"):
            await vehicle.goto(vehicle.home)
        await vehicle.wing.prepare_piloting()
        await vehicle.takeoff(HEIGHT)
        assert vehicle.wing.pilot.height_m == pytest.approx((await vehicle.position()).height_m, abs=4.0)

        # a circle to the left, 120 m around a place
        home = LocalFrame(vehicle.home)
        lat, lon, alt = home.geodetic_from_ned(300.0, 400.0, -HEIGHT)
        place = GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt)
        around = LocalFrame(place)
        await vehicle.wing.loiter(place, radius_m=120.0, clockwise=False)
        await vehicle.clock.sleep(25.0)

        def offset():
            p = vehicle.latest(Position)
            return around.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)

        circle = await watch(vehicle, 20.0, offset)
        radius = np.hypot(circle[:, 0], circle[:, 1])
        assert radius.mean() == pytest.approx(120.0, abs=8.0)
        assert np.abs(circle[:, 2]).max() < 5.0
        bearing = np.unwrap(np.arctan2(circle[:, 1], circle[:, 0]))
        assert bearing[-1] < bearing[0] - 1.0  # counter-clockwise seen from above

        # headings, through the air: within 5 degrees when settled, in wind
        async with vehicle.wing.heading_flight(altitude_m=HEIGHT + 15.0) as flight:
            for heading in (0.0, 2.0, -2.5):
                await flight.turn_to(heading, wait=True)
                await vehicle.clock.sleep(6.0)
                yaw = await watch(vehicle, 5.0, lambda: vehicle.latest(Attitude).yaw_rad)
                assert np.abs(np.angle(np.exp(1j * (yaw - heading)))).max() < math.radians(5.0)
            await flight.change_airspeed(22.0)
            await vehicle.clock.sleep(20.0)
            speed = await watch(vehicle, 5.0, lambda: vehicle.latest(AirData).airspeed_m_s)
            assert speed.mean() == pytest.approx(22.0, abs=0.8)
            height = await watch(vehicle, 5.0, lambda: vehicle.latest(Position).height_m)
            assert height.mean() == pytest.approx(HEIGHT + 15.0, abs=4.0)
        assert vehicle.link.custom_mode == vehicle.firmware.modes[Mode.HOLD]

        await vehicle.wing.land_along()
        p = vehicle.latest(Position)
        return home.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)

    north, east, down = flown(flavour, script)
    assert math.hypot(north, east) < 150.0  # rolled out along the runway
    assert abs(down) < 2.0


def test_an_approach_ends_on_its_line():
    """The circle touches the line of the landing where the glide begins."""
    place = GeodeticPosition(lat_deg=47.0, lon_deg=8.0, alt_m=500.0)
    for radius, heading in ((100.0, 0.3), (-100.0, 0.3), (80.0, -2.0)):
        approach = Approach(place=place, heading_rad=heading, height_m=40.0, circle_radius_m=radius)
        circle, landing = approach.items()
        north, east, _ = LocalFrame(place).ned_from_geodetic(circle.x, circle.y, 500.0)
        along = north * math.cos(heading) + east * math.sin(heading)
        across = -north * math.sin(heading) + east * math.cos(heading)
        assert along == pytest.approx(-approach.length_m, abs=0.5)
        assert across == pytest.approx(radius, abs=0.5)  # to the right of the line for a clockwise circle
        assert circle.param2 == radius
        assert math.degrees(math.atan(40.0 / approach.length_m)) < 5.0  # what PX4 accepts
        assert (landing.x, landing.y, landing.z) == (47.0, 8.0, 0.0)


@pytest.mark.parametrize(
    ("values", "words"),
    [({"height_m": 2.0}, "from 2 m is too low"), ({"circle_radius_m": 5.0}, "circle of 5 m")],
)
def test_approaches_that_are_none_are_refused(values, words):
    place = GeodeticPosition(lat_deg=47.0, lon_deg=8.0, alt_m=500.0)
    with pytest.raises(PlanError, match=words):
        Approach(place=place, heading_rad=0.0, **values)


class CommandRecorder:
    """The commands and parameters of a vehicle, as far as a circle needs them."""

    link = None

    def __init__(self):
        self.sent = []

    async def read_or(self, name, default):
        return {"NAV_LOITER_RAD": 70.0}.get(name, default)

    async def command_int(self, command, frame, params, x, y, z):
        self.sent.append((command, frame, params, x, y, z))


@pytest.mark.parametrize(
    ("adapter", "radius_m", "clockwise", "command", "given"),
    [
        # PX4 1.16.1 reads no radius in DO_REPOSITION; in DO_ORBIT its sign is the direction
        (Px4, 120.0, True, dialect.MAV_CMD_DO_ORBIT, {0: 120.0}),
        (Px4, 120.0, False, dialect.MAV_CMD_DO_ORBIT, {0: -120.0}),
        (Px4, None, False, dialect.MAV_CMD_DO_ORBIT, {0: -70.0}),
        # ArduPlane 4.6.3 ignores a negative radius; the direction is param4
        (ArduPilot, 120.0, True, dialect.MAV_CMD_DO_REPOSITION, {1: 1.0, 2: 120.0, 3: 0.0}),
        (ArduPilot, 120.0, False, dialect.MAV_CMD_DO_REPOSITION, {1: 1.0, 2: 120.0, 3: 1.0}),
        (ArduPilot, None, False, dialect.MAV_CMD_DO_REPOSITION, {1: 1.0, 2: 0.0, 3: 1.0}),
    ],
)
def test_a_circle_is_commanded_by_what_the_firmware_obeys(adapter, radius_m, clockwise, command, given):
    vehicle = CommandRecorder()
    place = GeodeticPosition(lat_deg=47.0, lon_deg=8.0, alt_m=500.0)
    asyncio.run(adapter(vehicle, vehicle).loiter(place, radius_m, clockwise))
    [(sent, frame, params, x, y, z)] = vehicle.sent
    assert sent == command
    assert {k: params[k] for k in given} == given
    assert (frame, x, y, z) == (dialect.MAV_FRAME_GLOBAL, 470000000, 80000000, 500.0)
