"""The errors of a mission when the link dies, a failsafe takes over, or it asks for what can't be."""

import asyncio
import math

import pytest

from autopilot_bridge.clock import TelemetryClock
from autopilot_bridge.links import memory_pair
from autopilot_bridge.mavlink import FrameEncoder, dialect
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import LinkClosed, MissionError, PlanError, TakenOver, VehicleTimeout
from missions.vehicle import Mode, Setpoint, Vehicle
from missions.vehicle.connection import Connection
from missions.vehicle.link_watch import LinkWatch

both = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])


def silent(autopilot):
    """The vehicle is gone: nothing is sent, nothing answered."""
    autopilot.send = lambda message: None


def later(seconds, action):
    asyncio.get_running_loop().call_later(seconds, action)


WAITS = {
    "arrival": lambda v: v.goto_ned(5000.0, 0.0, -10.0),
    "landing": lambda v: v.link.wait_landed(),
    "disarmed heartbeat": lambda v: v.link.wait_disarmed(),
    "the end of the setpoints": lambda v: v.follow(
        lambda t: Setpoint(position_ned_m=(0.0, 0.0, -10.0)) if t < 500.0 else None
    ),
    "mission item 9": lambda v: v.plans.wait_item_reached(9, 900.0),
    "the answer to DO_SET_HOME": lambda v: v.command(dialect.MAV_CMD_DO_SET_HOME, 1.0, timeout_s=60.0),
    "mode land": lambda v: v.commands.set_mode(Mode.LAND, 60.0),
}


@both
@pytest.mark.parametrize("awaited", WAITS)
def test_a_lost_link_ends_every_wait(flown, flavour, awaited):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        if awaited == "mission item 9":
            await vehicle.commands.set_mode(Mode.MISSION)
        autopilot.mute_commands.add(dialect.MAV_CMD_DO_SET_HOME)
        if awaited == "mode land":
            autopilot.mute_commands.add(dialect.MAV_CMD_DO_SET_MODE)
        lost_us = autopilot.time_us + 3_000_000
        later(3.0, lambda: silent(autopilot))
        expected = rf"^link lost: no heartbeat for 1\d s while waiting for {awaited}.*; last received: mode"
        with pytest.raises(LinkClosed, match=expected) as lost:
            await WAITS[awaited](vehicle)
        assert str(lost.value).count("no heartbeat") == 1
        return (autopilot.time_us - lost_us) * 1e-6

    assert 8.0 < flown(script, flavour) < 13.0


def test_a_lost_link_is_not_waited_for_when_making_safe(flown):
    async def script(vehicle, autopilot):
        with pytest.raises(LinkClosed):
            async with vehicle.safe_on_exit(Mode.RETURN):
                await vehicle.takeoff(10.0)
                lost_us = autopilot.time_us + 3_000_000
                later(3.0, lambda: silent(autopilot))
                await vehicle.goto_ned(100.0, 0.0, -10.0)
        return autopilot.kind, (autopilot.time_us - lost_us) * 1e-6

    kind, seconds = flown(script)
    assert kind == "return"  # it still hears us
    assert seconds < 15.0


def test_before_the_first_heartbeat_the_wait_has_its_own_deadline(flown):
    async def script(vehicle, autopilot):
        with pytest.raises(VehicleTimeout, match="within 30 s; nothing was received"):
            await vehicle.wait_heartbeat(timeout_s=30.0)

    flown(script, ready=False, setup=lambda autopilot: autopilot.streams.clear())


def test_a_silence_of_less_than_ten_seconds_is_sat_out(flown):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        autopilot.due["HEARTBEAT"] = autopilot.time_us + 9_000_000
        await vehicle.goto_ned(100.0, 0.0, -10.0)

    flown(script)


class Wall:
    """An event loop's time set by hand, and its timers."""

    def __init__(self, monkeypatch):
        self.now, self.timers = 100.0, []
        monkeypatch.setattr("missions.vehicle.link_watch.asyncio.get_running_loop", lambda: self)

    def time(self):
        return self.now

    def call_later(self, delay, callback, *arguments):
        self.timers.append((self.now + delay, callback, arguments))

    def wait(self, seconds, stall=0.0):
        """Time passes; the timers come late by what the process stalled."""
        end = self.now + seconds
        while self.timers and self.timers[0][0] + stall <= end:
            due, callback, arguments = self.timers.pop(0)
            self.now = due + stall
            stall = 0.0
            callback(*arguments)
        self.now = max(self.now, end)


class Scope:
    ended = False

    def expired(self):
        return self.ended

    def reschedule(self, when):
        self.ended = True


def watched(monkeypatch, rate=1.0):
    wall = Wall(monkeypatch)
    clock = TelemetryClock(wall.time)
    for k in range(50):
        clock.observe(round(1e6 * rate * 0.1 * k))
        wall.now += 0.1
    watch, scope = LinkWatch(clock, lambda: ""), Scope()
    watch.on_heartbeat()
    watch._scopes.append(scope)
    watch._start()
    return wall, watch, scope


@pytest.mark.parametrize(("rate", "limit_s"), [(1.0, 10.0), (200.0, 10.0), (0.1, 100.0)])
def test_a_remote_link_is_watched_in_wall_time_and_slow_vehicles_get_more(monkeypatch, rate, limit_s):
    wall, _, scope = watched(monkeypatch, rate)
    wall.wait(0.98 * limit_s)
    assert not scope.ended
    wall.wait(2.0)
    assert scope.ended


def test_time_in_which_this_process_was_busy_is_no_silence(monkeypatch):
    wall, watch, scope = watched(monkeypatch)
    wall.wait(68.0, stall=60.0)
    assert not scope.ended
    watch.on_heartbeat()
    wall.wait(9.0)
    assert not scope.ended
    wall.wait(3.0)
    assert scope.ended


def test_the_link_is_looked_at_only_while_something_waits(monkeypatch):
    wall, watch, scope = watched(monkeypatch)
    watch._scopes.remove(scope)
    wall.wait(5.0)
    assert wall.timers == []


def test_a_vehicle_elsewhere_that_is_killed_is_missed():
    """The same over a TelemetryClock on an ordinary loop; the loop's own time is sped up by hand."""

    async def main():
        ours, theirs = memory_pair()
        encoder = FrameEncoder(1, 1)
        loop = asyncio.get_running_loop()
        skipped = [0.0]
        real = loop.time
        loop.time = lambda: real() + skipped[0]
        async with Connection(ours, TelemetryClock(loop.time)) as connection:
            vehicle = Vehicle(connection)
            theirs.send(encoder.encode(dialect.MAVLink_heartbeat_message(2, 12, 129, 0x03040000, 4, 3)))
            await vehicle.wait_heartbeat()
            task = loop.create_task(vehicle.link.wait_disarmed())
            for _ in range(60):  # steps too small to count as a stall
                await asyncio.sleep(0)
                skipped[0] += 0.2
                for _ in range(5):
                    await asyncio.sleep(0)
            with pytest.raises(LinkClosed, match=r"link lost: no heartbeat for 1\d s .*disarmed heartbeat"):
                await task

    asyncio.run(main())


# goto


@both
def test_goto_ends_when_a_failsafe_takes_over(flown, flavour):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        begun_us = autopilot.time_us

        def failsafe():
            autopilot.text("Failsafe: battery low, returning", 2)
            autopilot.mode = {"px4": 0x05040000, "ardupilot": 6}[flavour]

        later(4.0, failsafe)
        name = {"px4": "Return", "ardupilot": "RTL"}[flavour]
        expected = rf"\(or failsafe: 'Failsafe: battery low, returning'\) has the vehicle, mode {name};"
        with pytest.raises(TakenOver, match=expected):
            await vehicle.goto_ned(500.0, 0.0, -10.0)
        return (autopilot.time_us - begun_us) * 1e-6

    assert flown(script, flavour) < 6.0


@both
def test_goto_ends_when_the_vehicle_disarms(flown, flavour):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)

        def fall():
            autopilot.text("Crash: Disarming", 2)
            autopilot.armed = False

        later(4.0, fall)
        with pytest.raises(MissionError, match=r"the vehicle is disarmed .* m before the target \('Crash"):
            await vehicle.goto_ned(500.0, 0.0, -10.0)

    flown(script, flavour)


@both
def test_goto_from_another_mode_is_no_failsafe(flown, flavour):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        await vehicle.hold()
        await vehicle.goto_ned(30.0, 0.0, -10.0)
        await vehicle.goto_ned(0.0, 0.0, -10.0)

    flown(script, flavour)


def test_a_mode_the_mission_itself_asks_for_meanwhile_is_no_failsafe(flown):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        task = asyncio.get_running_loop().create_task(vehicle.goto_ned(100.0, 0.0, -10.0))
        await asyncio.sleep(3.0)
        await vehicle.commands.set_mode(Mode.LAND)
        await asyncio.sleep(3.0)
        assert not task.done()
        task.cancel()

    flown(script)


def test_goto_refuses_what_is_too_far_away_and_names_the_distance(flown):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        sent = len(autopilot.commands)
        lat, lon, alt = LocalFrame(vehicle.home).geodetic_from_ned(12_345.0, 0.0, -10.0)
        far = GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt)
        with pytest.raises(PlanError, match=r"12\.3 km from home; accepted: at most 10 km"):
            await vehicle.goto(far)
        swapped = GeodeticPosition(lat_deg=lon, lon_deg=lat, alt_m=alt)
        with pytest.raises(PlanError, match="km from home"):
            await vehicle.goto(swapped)
        assert len(autopilot.commands) == sent

    flown(script)


# takeoff, follow


@pytest.mark.parametrize("altitude_m", [-5, 0, math.nan, math.inf])
def test_an_impossible_takeoff_is_refused_before_anything_is_sent(flown, altitude_m):
    async def script(vehicle, autopilot):
        sent = len(autopilot.commands)
        accepted = r"m is not possible; accepted: a finite .* above 0 m \(altitude above home, positive up\)"
        with pytest.raises(PlanError, match=f"takeoff to {altitude_m:g} {accepted}"):
            await vehicle.takeoff(altitude_m)
        assert len(autopilot.commands) == sent
        assert not autopilot.armed

    flown(script)


@both
@pytest.mark.parametrize("good_s", [-1.0, 2.0])
def test_a_source_of_something_else_is_shown_what_it_gave(flown, flavour, good_s):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        good = Setpoint(position_ned_m=(0.0, 0.0, -10.0))
        expected = (
            r"follow's source gave a tuple \(\(0, 0, -10\)\); "
            "accepted: a Setpoint, an AttitudeSetpoint or None"
        )
        with pytest.raises(PlanError, match=expected):
            await vehicle.follow(lambda t: good if t < good_s else (0, 0, -10))

    flown(script, flavour)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_what_keeps_a_vehicle_from_arming_is_reported(flown, flavour):
    def unready(autopilot):
        autopilot.ready_after_us = 10**12
        autopilot.text("PreArm: Compass not healthy")  # long ago, and mended since
        answer = autopilot.on_command_long

        def on_command_long(message):
            if message.command == dialect.MAV_CMD_RUN_PREARM_CHECKS:
                autopilot.text(
                    "PreArm: Battery 1 below minimum"
                    if flavour == "ardupilot"
                    else "Preflight Fail: low battery"
                )
                autopilot.text("something else")
            answer(message)

        autopilot.on_command_long = on_command_long

    async def script(vehicle, autopilot):
        await vehicle.wait_heartbeat()
        with pytest.raises(VehicleTimeout) as caught:
            await vehicle.wait_ready(20.0)
        return str(caught.value), autopilot.time_us

    said, time_us = flown(script, flavour=flavour, ready=False, setup=unready)
    why = "PreArm: Battery 1 below minimum" if flavour == "ardupilot" else "Preflight Fail: low battery"
    assert "missing: pre-arm checks" in said and "within 20 s" in said
    assert f"; the autopilot says: {why}; last received" in said
    assert time_us < 24_000_000


def test_readiness_that_comes_at_the_last_moment_counts(flown):
    def late(autopilot):
        autopilot.ready_after_us = 19_000_000

    async def script(vehicle, autopilot):
        await vehicle.wait_heartbeat()
        await vehicle.wait_ready(20.0)

    flown(script, ready=False, setup=late)
