"""A link that is lost and comes back: what goes on, what ends, and what is reported."""

import asyncio
import math
from itertools import pairwise

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import LocalFrame
from missions.errors import LinkClosed, MissionError
from missions.vehicle import Setpoint
from missions.vehicle.firmware import Mode

both = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])


def cut(vehicle, autopilot, *, after_s, for_s, both_ways=True):
    """Nothing passes for a while."""
    send, receive = autopilot.send, autopilot.link.on_receive
    loop = asyncio.get_running_loop()

    def away():
        autopilot.send = lambda message: None
        if both_ways:
            autopilot.link.on_receive = lambda data: None

    def back():
        autopilot.send, autopilot.link.on_receive = send, receive

    loop.call_later(after_s, away)
    loop.call_later(after_s + for_s, back)


def leg_items(autopilot, *norths_m):
    frame = LocalFrame(autopilot.home)
    places = [frame.geodetic_from_ned(north, 0.0, 0.0)[:2] for north in norths_m]
    return [
        MissionItem(
            command=mavlink.MAV_CMD_NAV_TAKEOFF, x=autopilot.home.lat_deg, y=autopilot.home.lon_deg, z=10.0
        ),
        *(MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=lat, y=lon, z=10.0) for lat, lon in places),
    ]


@both
def test_an_uploaded_mission_goes_on(flown, flavour):
    async def script(vehicle, autopilot):
        vehicle.link.regain_s = 60.0
        first = await vehicle.plans.upload_mission(leg_items(autopilot, 100.0, 200.0, 300.0))
        await vehicle.start_mission()
        await vehicle.plans.wait_item_reached(first, 60.0)
        cut(vehicle, autopilot, after_s=3.0, for_s=25.0)
        await vehicle.plans.wait_item_reached(first + 3, 300.0)
        return vehicle.notes

    notes = flown(script, flavour)
    (loss,) = notes.link_losses
    assert loss.end_us is not None
    assert 24.0 < (loss.end_us - loss.start_us) * 1e-6 < 28.0
    assert len(notes.warnings) == 1
    assert "the link was lost for 2" in notes.warnings[0]


@both
def test_a_link_that_does_not_come_back_in_time_ends_the_mission(flown, flavour):
    async def script(vehicle, autopilot):
        vehicle.link.regain_s = 20.0
        await vehicle.takeoff(10.0)
        lost_us = autopilot.time_us + 3_000_000
        cut(vehicle, autopilot, after_s=3.0, for_s=500.0)
        with pytest.raises(LinkClosed, match=r"^link lost: no heartbeat for 3\d s while waiting for landing"):
            await vehicle.link.wait_landed(900.0)
        assert vehicle.link.lost
        assert vehicle.notes.link_losses[-1].end_us is None
        return (autopilot.time_us - lost_us) * 1e-6

    assert 28.0 < flown(script, flavour) < 34.0


def test_setpoints_wait_where_they_were_and_go_on(flown):
    """The vehicle still receives our messages and stays guided; it waits while no position is received."""

    async def script(vehicle, autopilot):
        vehicle.link.regain_s = 60.0
        await vehicle.takeoff(10.0)
        requested = []

        def source(t_s):
            requested.append(t_s)
            north_m = 2.0 * t_s
            return (
                Setpoint(position_ned_m=(north_m, 0.0, -10.0), velocity_ned_m_s=(2.0, 0.0, 0.0))
                if t_s < 40.0
                else None
            )

        cut(vehicle, autopilot, after_s=10.0, for_s=20.0, both_ways=False)
        begun_us = autopilot.time_us
        await vehicle.follow(source)
        return requested, autopilot.setpoints, (autopilot.time_us - begun_us) * 1e-6

    requested, setpoints, seconds = flown(script)
    steps = [b - a for a, b in pairwise(requested[1:])]
    assert max(steps) < 0.1  # the source's own time has no gap
    assert 40.0 + 15.0 < seconds < 40.0 + 24.0
    held = [m for _, m in setpoints if m.type_mask & 0x38 == 0x38]  # without velocity
    assert len(held) > 300
    assert len({(m.x, m.y, m.z) for m in held}) == 1
    rates_s = [(b - a) * 1e-6 for (a, _), (b, _) in pairwise(setpoints)]
    assert max(rates_s) < 0.5  # the stream never stops: PX4 would leave OFFBOARD


def test_setpoints_end_when_the_mode_is_no_longer_ours(flown):
    async def script(vehicle, autopilot):
        vehicle.link.regain_s = 60.0
        await vehicle.takeoff(10.0)
        cut(vehicle, autopilot, after_s=10.0, for_s=20.0)
        asyncio.get_running_loop().call_later(15.0, lambda: setattr(autopilot, "mode", 0x05040000))
        await vehicle.follow(lambda t: Setpoint(position_ned_m=(0.0, 0.0, -10.0)) if t < 100.0 else None)

    with pytest.raises(
        MissionError, match=r"left the guided mode for Return; .*the link had been lost for 2\d s"
    ):
        flown(script)


@both
@pytest.mark.parametrize("asking", ["command", "mode", "parameter"])
def test_what_is_requested_in_the_silence_is_answered_after_it(flown, flavour, asking):
    """A command is sent five times, a second apart, and is not received for much longer."""

    async def script(vehicle, autopilot):
        vehicle.link.regain_s = 60.0
        await vehicle.takeoff(10.0)
        cut(vehicle, autopilot, after_s=0.0, for_s=25.0)
        await vehicle.clock.sleep(4.0)
        begun_us = autopilot.time_us
        if asking == "command":
            await vehicle.commands.set_message_rate("VFR_HUD", 10.0)
        elif asking == "mode":
            await vehicle.commands.set_mode(Mode.LAND)
        else:
            await vehicle.parameter("MPC_XY_VEL_MAX" if flavour == "px4" else "WPNAV_SPEED")
        return (autopilot.time_us - begun_us) * 1e-6

    assert 20.0 < flown(script, flavour) < 25.0


def test_streams_are_requested_again(flown):
    async def script(vehicle, autopilot):
        vehicle.link.regain_s = 60.0
        await vehicle.commands.set_message_rate("VFR_HUD", 10.0)
        cut(vehicle, autopilot, after_s=1.0, for_s=15.0)
        asyncio.get_running_loop().call_later(5.0, autopilot.streams.clear)
        asyncio.get_running_loop().call_later(15.5, lambda: autopilot.streams.update(HEARTBEAT=1.0))
        with pytest.raises(MissionError):
            await vehicle.link.wait_until(lambda: False, what="nothing", on=("HEARTBEAT",), timeout_s=40.0)
        return dict(autopilot.streams)

    assert math.isclose(flown(script, "ardupilot")["VFR_HUD"], 10.0)


@both
def test_without_patience_nothing_changes(flown, flavour):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        cut(vehicle, autopilot, after_s=3.0, for_s=25.0)
        with pytest.raises(LinkClosed):
            await vehicle.link.wait_landed(60.0)

    flown(script, flavour)
