"""The vehicle API against scripted autopilots of both flavours."""

import asyncio
import itertools
import math
import re

import pytest

from autopilot_bridge.clock import LoopClock, TelemetryClock, run
from autopilot_bridge.links import memory_pair
from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.mission_plan import MissionItem
from estimators.status_texts import StatusTextAssembler
from missions.errors import CommandRejected, MissionError, TakenOver, VehicleTimeout
from missions.vehicle import Mode, Setpoint, Vehicle
from missions.vehicle.concurrency import run_concurrently
from missions.vehicle.connection import Connection
from missions.vehicle.telemetry import (
    Attitude,
    Battery,
    LocalPosition,
    Position,
    air_data,
    attitude,
    local_position,
)
from missions.vehicle_client.actions import watched

both = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])


@both
def test_finds_the_firmware_from_the_heartbeat(flown, flavour):
    async def script(vehicle, autopilot):
        return vehicle.autopilot, vehicle.system_id, vehicle.home.alt_m

    name, system_id, altitude = flown(script, flavour)
    assert (name, system_id) == (flavour, 1)
    assert altitude == pytest.approx(489.4)


@both
def test_takes_off_flies_and_lands(flown, flavour):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(12.0)
        assert vehicle.armed
        height = vehicle.latest(Position).height_m
        await vehicle.goto_ned(30.0, -20.0, -15.0)
        there = list(autopilot.pos)
        await vehicle.hold()
        await vehicle.return_to_launch()
        return height, there, vehicle.armed, autopilot.pos

    height, there, armed, end = flown(script, flavour)
    assert height == pytest.approx(12.0, abs=0.7)
    assert there == pytest.approx([30.0, -20.0, -15.0], abs=1.0)
    assert not armed
    assert math.hypot(end[0], end[1]) < 0.5


@both
def test_ready_waits_for_the_checks(flown, flavour):
    async def script(vehicle, autopilot):
        return autopilot.time_us

    def late(autopilot):
        autopilot.ready_after_us = 12_000_000

    assert 12_000_000 <= flown(script, flavour, setup=late) <= 13_500_000


@both
def test_not_ready_says_what_is_missing(flown, flavour):
    async def script(vehicle, autopilot):
        with pytest.raises(VehicleTimeout, match=r"missing: pre-arm checks.*last received: mode"):
            await vehicle.wait_ready(timeout_s=5.0)

    def never(autopilot):
        autopilot.ready_after_us = 10**12

    flown(script, flavour, ready=False, setup=never)


def test_a_lost_request_for_streams_is_repeated(flown):
    """It is not acknowledged; an ArduPilot that was starting lost it, and the mission was never ready."""

    async def script(vehicle, autopilot):
        return autopilot.streams["SYS_STATUS"]

    def starting(autopilot):
        requests, take = iter(range(3)), autopilot.on_request_data_stream
        autopilot.on_request_data_stream = lambda m: None if next(requests) < 2 else take(m)

    assert flown(script, "ardupilot", setup=starting) > 0.0


def test_no_heartbeat_says_that_nothing_was_received(flown):
    async def script(vehicle, autopilot):
        autopilot.streams.clear()
        with pytest.raises(VehicleTimeout, match=r"no heartbeat .* within 4 s; nothing was received"):
            await vehicle.wait_heartbeat(timeout_s=4.0)

    flown(script, ready=False, setup=lambda a: a.streams.clear())


@both
def test_arming_is_tried_again_and_then_refused_with_the_reason(flown, flavour):
    async def script(vehicle, autopilot):
        autopilot.arm_refusals = 3
        await vehicle.arm()
        assert vehicle.armed
        await vehicle.disarm()
        autopilot.arm_refusals = 1000
        with pytest.raises(CommandRejected, match=r"COMPONENT_ARM_DISARM.*Arming denied: Resolve"):
            await vehicle.arm(timeout_s=4.0)

    flown(script, flavour)


def test_command_is_repeated_with_confirmation_until_answered(flown):
    async def script(vehicle, autopilot):
        autopilot.mute_commands.add(dialect.MAV_CMD_DO_SET_HOME)
        with pytest.raises(VehicleTimeout, match="no answer to DO_SET_HOME after 5 attempts"):
            await vehicle.command(dialect.MAV_CMD_DO_SET_HOME, 1.0)
        sent = [c for command, c in autopilot.commands if command == dialect.MAV_CMD_DO_SET_HOME]
        assert sent == [0, 1, 2, 3, 4]
        with pytest.raises(CommandRejected, match="UNSUPPORTED") as refused:
            await vehicle.command(31999)
        assert refused.value.result == 3

    flown(script)


def test_px4_first_mode_acknowledgement_is_not_accepted(flown):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(5.0)
        autopilot.refuse_modes.add("return")
        with pytest.raises(CommandRejected, match="refused mode return: DO_SET_MODE: TEMPORARILY_REJECTED"):
            await vehicle.commands.set_mode(Mode.RETURN, timeout_s=4.0)
        autopilot.refuse_modes.clear()
        await vehicle.commands.set_mode(Mode.RETURN)
        assert vehicle.mode == "Return"

    flown(script)


@both
def test_follows_setpoints_from_home_whatever_the_local_origin(flown, flavour):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        from_home = await vehicle.local_origin.from_home()
        assert from_home((0.0, 0.0, 0.0)) == pytest.approx((1.5, -2.0, 0.3), abs=0.03)

        def circle(t):
            if t > 20.0:
                return None
            c, s = math.cos(0.3 * t), math.sin(0.3 * t)
            return Setpoint(
                position_ned_m=(10.0 * c, 10.0 * s, -10.0),
                velocity_ned_m_s=(-3.0 * s, 3.0 * c, 0.0),
                acceleration_ned_m_s2=(-0.9 * c, -0.9 * s, 0.0),
                yaw_rad=0.5,
            )

        await vehicle.follow(circle, rate_hz=25.0)
        end = circle(20.0).position_ned_m
        assert math.dist(autopilot.pos, end) < 0.5
        assert autopilot.kind == "hold"
        times = [t for t, _ in autopilot.setpoints]
        gaps = [b - a for a, b in itertools.pairwise(times)]
        assert max(gaps) <= 60_000
        assert sum(gaps) / len(gaps) == pytest.approx(40_000, rel=0.02)
        assert not any("Failsafe" in text.text for text in vehicle.link.texts.newest)
        assert autopilot.setpoints[-1][1].type_mask == 0x800

    flown(script, flavour)


def test_leaving_guided_ends_the_following_with_an_error(flown):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)

        async def pilot():
            await asyncio.sleep(5.0)
            autopilot.mode = 0x00030000

        task = asyncio.get_running_loop().create_task(pilot())
        with pytest.raises(TakenOver, match="has the vehicle, mode Position; nothing was commanded"):
            await vehicle.follow(lambda t: Setpoint(position_ned_m=(0.0, 0.0, -10.0)) if t < 60 else None)
        await task

    flown(script)


@both
def test_mission_upload_download_clear_and_flight(flown, flavour):
    async def script(vehicle, autopilot):
        home = vehicle.home
        points = [(home.lat_deg + 2e-4, home.lon_deg), (home.lat_deg + 2e-4, home.lon_deg + 3e-4)]
        items = [vehicle.firmware.takeoff_item(home, 10.0)]
        items += [
            MissionItem(command=dialect.MAV_CMD_NAV_WAYPOINT, x=lat, y=lon, z=10.0, param2=2.0)
            for lat, lon in points
        ]
        items.append(MissionItem(command=dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=2))
        first = await vehicle.plans.upload_mission(items)
        assert first == (1 if flavour == "ardupilot" else 0)
        back = await vehicle.plans.download_mission()
        assert [item.command for item in back] == [22, 16, 16, 20]
        assert back[1].x == pytest.approx(points[0][0], abs=1e-7)
        seen = []
        await vehicle.start_mission()
        await vehicle.plans.wait_item_reached(first + 2, 120.0, seen.append)
        assert max(seen) >= first + 2
        await vehicle.link.wait_disarmed(120.0)
        await vehicle.plans.clear_mission()
        assert autopilot.items == []

    flown(script, flavour)


@both
def test_items_without_a_place_are_sent_to_px4_in_the_frame_without_one(flown, flavour):
    async def script(vehicle, autopilot):
        takeoff = vehicle.firmware.takeoff_item(vehicle.home, 10.0)
        commands = (
            dialect.MAV_CMD_DO_CHANGE_SPEED,
            dialect.MAV_CMD_DO_LAND_START,
            dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        )
        items = [takeoff, *(MissionItem(command=c, frame=3, x=47.4, y=8.5, z=10.0) for c in commands)]
        await vehicle.plans.upload_mission(items)
        return [item.frame for item in await vehicle.plans.download_mission()]

    plain = [2, 2, 2] if flavour == "px4" else [3, 3, 3]
    assert flown(script, flavour)[1:] == plain


def test_refused_mission_names_the_item(flown):
    async def script(vehicle, autopilot):
        items = [MissionItem(command=dialect.MAV_CMD_NAV_WAYPOINT, x=47.0, y=8.0, z=10.0)] * 4
        with pytest.raises(CommandRejected, match=r"at item 3 \(NAV_WAYPOINT\): UNSUPPORTED"):
            await vehicle.plans.upload_mission(items)

    def refuse(autopilot):
        autopilot.mission_result = 3

    flown(script, setup=refuse)


@both
def test_parameters_in_either_encoding(flown, flavour):
    async def script(vehicle, autopilot):
        assert await vehicle.parameter("COM_RC_LOSS_T") == 4.0
        await vehicle.set_parameter("COM_RC_LOSS_T", 7.0)
        assert autopilot.parameters["COM_RC_LOSS_T"][0] == 7
        await vehicle.set_parameter("MPC_ACC_HOR", 4.5)
        assert await vehicle.parameter("MPC_ACC_HOR") == 4.5
        with pytest.raises(CommandRejected, match=r"kept MPC_ACC_HOR = 4\.5 instead of 99"):
            await vehicle.set_parameter("MPC_ACC_HOR", 99.0)
        with pytest.raises(VehicleTimeout, match="did not answer for parameter NO_SUCH"):
            await vehicle.parameter("NO_SUCH")

    flown(script, flavour)


@both
@pytest.mark.parametrize("action", [Mode.RETURN, Mode.LAND, Mode.HOLD])
def test_a_failing_script_leaves_the_vehicle_safe(flown, flavour, action):
    async def script(vehicle, autopilot):
        with pytest.raises(ZeroDivisionError):
            async with vehicle.safe_on_exit(action):
                await vehicle.takeoff(8.0)
                raise ZeroDivisionError
        return autopilot.kind

    assert flown(script, flavour) == action.value


@both
def test_of_blocks_in_each_other_the_innermost_leaves_the_vehicle_safe_and_only_once(flown, flavour):
    """As a script's own block inside that of the run."""

    async def script(vehicle, autopilot):
        with pytest.raises(MissionError):
            async with vehicle.safe_on_exit(Mode.RETURN):
                try:
                    async with vehicle.safe_on_exit(Mode.HOLD):
                        await vehicle.takeoff(8.0)
                        raise ZeroDivisionError
                except ZeroDivisionError as error:
                    raise MissionError("the script's own words") from error
        once = [c.action for c in vehicle.notes.safety_commands]
        with pytest.raises(ZeroDivisionError):
            async with vehicle.safe_on_exit(Mode.LAND), vehicle.safe_on_exit(Mode.HOLD):
                await vehicle.try_command(dialect.MAV_CMD_DO_CHANGE_SPEED, 1.0, 3.0)  # it flies on
                raise ZeroDivisionError
        return once, [c.action for c in vehicle.notes.safety_commands], autopilot.kind

    assert flown(script, flavour) == (["hold"], ["hold", "hold"], "hold")


def test_after_a_refusal_the_outer_block_tries_again(flown):
    async def script(vehicle, autopilot):
        with pytest.raises(ZeroDivisionError):
            async with vehicle.safe_on_exit(Mode.RETURN), vehicle.safe_on_exit(Mode.RETURN):
                await vehicle.takeoff(8.0)
                autopilot.refuse_modes |= {"return", "land", "hold"}
                asyncio.get_running_loop().call_later(20.0, autopilot.refuse_modes.clear)
                raise ZeroDivisionError
        return autopilot.kind

    assert flown(script, "ardupilot") == "return"


def test_a_height_that_is_older_than_the_heartbeats_is_stated_with_its_age(flown):
    async def script(vehicle, autopilot):
        await vehicle.takeoff(8.0)
        assert vehicle.safe_exit.how_left().height_older_s == 0.0
        autopilot.streams.pop("GLOBAL_POSITION_INT")
        await vehicle.clock.sleep(8.0)
        return vehicle.safe_exit.how_left().text, vehicle.link.last_received(), str(watched(vehicle))

    left, received, state = flown(script)
    age = r" \((7|8) s before\)"
    assert re.search(rf"at (7|8)\.\d m{age}, armed", left)
    assert re.search(rf"m above home{age}", received)
    assert re.search(rf"m above home{age}", state)


def test_a_cancelled_script_leaves_the_vehicle_safe_even_if_the_first_choice_is_refused(flown):
    async def script(vehicle, autopilot):
        async def fly():
            async with vehicle.safe_on_exit():
                await vehicle.takeoff(8.0)
                await asyncio.sleep(1000.0)

        task = asyncio.get_running_loop().create_task(fly())
        await asyncio.sleep(20.0)
        autopilot.refuse_modes.add("return")
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        return autopilot.kind

    assert flown(script) == "land"


async def interrupted_after_arming(vehicle, autopilot, delay_s):
    """A script that is cancelled a moment after the vehicle was armed, before a heartbeat says so."""

    async def fly():
        async with vehicle.safe_on_exit(Mode.RETURN):
            await vehicle.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
            await asyncio.sleep(100.0)

    autopilot.due["HEARTBEAT"] = 10**12
    task = asyncio.get_running_loop().create_task(fly())
    await asyncio.sleep(delay_s)
    assert autopilot.armed
    assert not vehicle.armed
    task.cancel()
    autopilot.due["HEARTBEAT"] = autopilot.time_us + 500_000
    with pytest.raises(asyncio.CancelledError):
        await task


@both
def test_interrupted_between_arming_and_its_heartbeat_on_the_ground_it_is_disarmed(flown, flavour):
    async def script(vehicle, autopilot):
        await interrupted_after_arming(vehicle, autopilot, 0.1)
        return autopilot.armed, autopilot.kind, autopilot.pos[2] > -0.1

    assert flown(script, flavour) == (False, "return", True)


def test_interrupted_between_arming_and_its_heartbeat_in_the_air_it_returns(flown):
    async def script(vehicle, autopilot):
        def up():
            autopilot.pos[2] = -3.0  # disarming is refused

        asyncio.get_running_loop().call_later(0.2, up)
        await interrupted_after_arming(vehicle, autopilot, 0.21)
        return autopilot.armed, autopilot.kind

    assert flown(script) == (True, "return")


def test_a_refused_arming_leaves_nothing_in_doubt(flown):
    async def script(vehicle, autopilot):
        autopilot.arm_refusals = 1000
        with pytest.raises(CommandRejected):
            await vehicle.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
        return vehicle.commands.may_be_armed

    assert flown(script) is False


def test_a_disarmed_heartbeat_long_after_arming_is_accepted(flown):
    async def script(vehicle, autopilot):
        await vehicle.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
        autopilot.armed = False
        doubts = [vehicle.commands.may_be_armed]
        await asyncio.sleep(2.0)
        return [*doubts, vehicle.commands.may_be_armed]

    assert flown(script) == [True, False]


def test_telemetry_in_si_units(flown):
    async def script(vehicle, autopilot):
        autopilot.yaw = 1.0
        positions = []
        async for position in vehicle.telemetry(Position):
            positions.append(position)
            if len(positions) == 5:
                break
        await asyncio.sleep(0.1)
        assert positions[1].time_us - positions[0].time_us == pytest.approx(40_000, abs=1000)
        assert vehicle.latest(Attitude).yaw_rad == pytest.approx(1.0)
        battery = vehicle.latest(Battery)
        assert battery.voltage_v == pytest.approx(16.2)
        assert math.isnan(battery.current_a)
        assert battery.remaining == 1.0
        assert vehicle.latest(LocalPosition).pos_ned_m == pytest.approx((1.5, -2.0, 0.3))

    flown(script)


def test_heartbeats_are_sent_once_a_second(flown):
    async def script(vehicle, autopilot):
        before = autopilot.heartbeats_received
        await asyncio.sleep(10.0)
        return autopilot.heartbeats_received - before

    assert flown(script) in (10, 11)


def test_long_status_texts_are_joined(flown):
    async def script(vehicle, autopilot):
        text = "Preflight Fail: " + "a very long reason " * 5
        for k in range(0, len(text), 50):
            chunk = text[k : k + 50].encode()
            autopilot.send(dialect.MAVLink_statustext_message(3, chunk, 7, k // 50))
        await asyncio.sleep(0.1)
        assert vehicle.link.texts.newest[-1].text == text

    flown(script)


def chunk(text, identity, sequence):
    return dialect.MAVLink_statustext_message(4, text.encode(), identity, sequence)


def test_texts_whose_id_is_used_again_are_not_mixed():
    assembler = StatusTextAssembler()
    assert assembler.add(chunk("A" * 50, 7, 0)) is None
    assert assembler.add(chunk("B" * 50, 7, 1)) is None  # the end is lost
    assert assembler.add(chunk("C" * 50, 7, 0)) is None
    assert assembler.add(chunk("C" * 50, 7, 0)) is None  # repeated
    assert assembler.add(chunk("end", 7, 1)).text == "C" * 50 + "end"


def test_a_text_is_shown_without_what_a_terminal_executes():
    assert StatusTextAssembler().add(chunk("\x1b[2Jready\t", 0, 0)).text == "\\x1b[2Jready"


def test_few_unfinished_texts_are_kept():
    assembler = StatusTextAssembler()
    for identity in range(1, 1000):
        assembler.add(chunk("A" * 50, identity, 0))
    assert len(assembler._parts) == 8
    assert assembler.add(chunk("end", 999, 1)).text == "A" * 50 + "end"


@pytest.mark.parametrize("nothing", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_none_make_no_telemetry(nothing):
    for angles in ((nothing, 0.0, 0.0), (0.0, nothing, 0.0), (0.0, 0.0, nothing)):
        assert attitude(0, *angles, 0.0, 0.0, 0.0) is None  # type: ignore[call-arg]
    assert air_data(nothing, 0.0, 0) is None
    assert air_data(20.0, nothing, 0) is None
    assert local_position(0, nothing, 0, 0, 0, 0, 0) is None


def test_an_attitude_that_is_none_is_passed_over_and_then_not_known(flown):
    passed = []

    async def script(vehicle, autopilot):
        await vehicle.commands.set_message_rate("ATTITUDE", 25.0)
        stop = vehicle.link.listen(Attitude, passed.append)
        await vehicle.clock.sleep(1.0)
        before = vehicle.latest(Attitude)
        autopilot.yaw = math.nan
        await vehicle.clock.sleep(0.5)
        stands = vehicle.latest(Attitude)
        await vehicle.clock.sleep(1.5)
        gone = vehicle.latest(Attitude)
        autopilot.yaw = 0.25
        await vehicle.clock.sleep(0.5)
        again = vehicle.latest(Attitude)
        stop()
        await vehicle.clock.sleep(0.5)
        return before, stands, gone, again

    before, stands, gone, again = flown(script)
    assert math.isfinite(before.yaw_rad)
    assert stands == before
    assert gone is None
    assert again.yaw_rad == pytest.approx(0.25)
    assert before in passed and passed[-1] == again
    assert all(math.isfinite(attitude.yaw_rad) for attitude in passed)
    times_us = [attitude.time_us for attitude in passed]
    assert len(times_us) == pytest.approx(37, abs=2) and times_us == sorted(set(times_us))


class TwoOnALink:
    """Two autopilots that share a link, the second with another clock."""

    def __init__(self, sitl):
        self.sitl = sitl
        theirs, ours = memory_pair("mission", "vehicles")
        self.link = theirs
        for autopilot in sitl.autopilots:
            autopilot.link = ours
        ours.on_receive = self.receive

    def receive(self, data):
        for autopilot in self.sitl.autopilots:
            autopilot.receive(data)


def test_one_of_several_vehicles_on_a_link_is_chosen_by_its_id(make_sitl):
    sitl = make_sitl("px4", 2)
    both_of_them = TwoOnALink(sitl)

    async def main():
        async with Connection(both_of_them.link, LoopClock(), vehicle_system_id=2) as connection:
            vehicle = Vehicle(connection, 2)
            await vehicle.wait_ready()
            home = vehicle.home
            return vehicle.system_id, home.lon_deg, connection.autopilots_received

    system_id, lon_deg, received = run(main(), sitl.loop)
    assert system_id == 2
    assert lon_deg == pytest.approx(sitl.autopilots[1].home.lon_deg, abs=2e-7)
    assert received == [1, 2]


def test_the_clock_of_a_connection_is_that_of_its_vehicle():
    clock = TelemetryClock()
    theirs, ours = memory_pair("mission", "vehicles")
    connection = Connection(theirs, clock, vehicle_system_id=2)

    async def main():
        connection.start()
        for system_id, time_ms in ((1, 500_000), (2, 1_000), (1, 500_100)):
            message = dialect.MAVLink_attitude_message(time_ms, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            ours.send(FrameEncoder(system_id, 1).encode(message))
        await connection.close()

    asyncio.run(main())
    assert clock.vehicle_time_us == 1_000_000


def test_a_heartbeat_before_the_first_time_stamp_is_no_silence_as_long_as_the_vehicle_was_on():
    theirs, ours = memory_pair("mission", "vehicles")
    clock = TelemetryClock()
    connection = Connection(theirs, clock)

    async def main():
        connection.start()
        vehicle = Vehicle(connection)
        encoder = FrameEncoder(1, 1)
        for message in (
            dialect.MAVLink_heartbeat_message(2, 3, 1, 4, 4, 3),
            dialect.MAVLink_attitude_message(190_000, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        ):
            ours.send(encoder.encode(message))
        seen = vehicle.link.last_received(), watched(vehicle).silent_s, vehicle.safe_exit.how_left().silent_s
        await connection.close()
        return seen

    text, silent_s, left_s = asyncio.run(main())
    assert "no heartbeat" not in text
    assert max(silent_s, left_s) < 1.0


def test_what_else_failed_side_by_side_hangs_on_the_first_error():
    async def fails(text):
        raise MissionError(text)

    with pytest.raises(MissionError, match="first") as caught:
        asyncio.run(run_concurrently([fails("first"), fails("second")]))
    assert caught.value.__notes__ == ["also failed: second"]


@pytest.mark.parametrize("delay_s", [0.1, 1.1])  # before anything is commanded, and after it
def test_a_cancellation_does_not_cut_off_what_leaves_the_vehicle_safe(flown, delay_s):
    """By a signal, after an own failure or that of another vehicle."""

    async def script(vehicle, autopilot):
        async def fly():
            async with vehicle.safe_on_exit():
                await vehicle.takeoff(8.0)
                failed.append(True)
                raise MissionError("own failure")

        failed = []
        task = asyncio.get_running_loop().create_task(fly())
        while not failed:
            await asyncio.sleep(0.02)
        await asyncio.sleep(delay_s)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        return autopilot.kind, [c.answer for c in vehicle.notes.safety_commands]

    assert flown(script) == ("return", ["done"])


@both
def test_a_mode_that_another_one_sets_while_arming_is_refused_ends_the_arming(flown, flavour):
    async def script(vehicle, autopilot):
        autopilot.arm_refusals = 3

        def pilot():
            autopilot.mode = 2 if flavour == "ardupilot" else 0x00070000

        asyncio.get_running_loop().call_later(1.5, pilot)
        with pytest.raises(MissionError, match=r"the mode was changed from .* while"):
            async with vehicle.safe_on_exit():
                await vehicle.takeoff(8.0)
        return autopilot.armed, vehicle.notes.safety_commands

    assert flown(script, flavour) == (False, [])
