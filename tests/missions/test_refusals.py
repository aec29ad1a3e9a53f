"""The autopilot's own reason is in the error about a refusal: texts that follow it, and PX4's events."""

import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.event_ids import event_sub_id
from missions.errors import CommandRejected
from missions.vehicle.px4_events import reason


def event(name: str, level: int) -> dialect.MAVLink_event_message:
    return dialect.MAVLink_event_message(
        0, 0, 1 << 24 | event_sub_id(name), 0, 1, level << 4 | level, [0] * 40
    )


def test_events_are_reasons_by_their_number() -> None:
    """FNV-1a with 24 bits; the offset basis and a vector of the hash's authors are the authority."""
    assert (event_sub_id(""), event_sub_id("foobar")) == (0x1C9DC5, 0x9CF968)
    number = 1 << 24 | event_sub_id("navigator_mis_land_missing")
    assert reason(number, 0x33) == (3, "mission rejected: a landing is required")
    assert reason(number, 0x36) is None  # information
    assert reason(number ^ 1, 0x33) is None


def test_the_reasons_of_a_refused_arming_are_requested_and_shown(flown) -> None:
    """PX4 names them by events, and goes on to send other texts."""

    async def script(vehicle, autopilot):
        autopilot.arm_refusals = 1000
        command = autopilot._command

        def with_events(number, p):
            command(number, p)
            if number == dialect.MAV_CMD_RUN_PREARM_CHECKS:
                for name in ("check_modes_mission", "navigator_mis_land_missing"):
                    autopilot.send(event(name, 3))
                for k in range(5):
                    autopilot.text(f"other {k}", 6)

        autopilot._command = with_events
        with pytest.raises(CommandRejected) as refused:
            await vehicle.arm(timeout_s=2.0)
        text = str(refused.value)
        assert "Arming denied: Resolve" in text
        assert "'no valid mission' / 'mission rejected: a landing is required'" in text
        assert text.count("Arming denied") == 1

    flown(script)


def test_a_text_behind_the_refusal_of_a_command_is_shown(flown) -> None:
    async def script(vehicle, autopilot):
        answer, sent_us = autopilot.ack, []

        def ack(command, result, sender=(255, 190)):
            answer(command, result, sender)
            sent_us.append(autopilot.time_us)

        step = autopilot.step

        def step_and_explain(time_us):
            step(time_us)
            if sent_us and time_us >= sent_us[0] + 200_000:
                sent_us.clear()
                autopilot.ack = answer
                autopilot.text("the reason", 3)

        autopilot.ack, autopilot.step = ack, step_and_explain
        with pytest.raises(CommandRejected, match=r"UNSUPPORTED.*'the reason'"):
            await vehicle.command(31999)

    flown(script)


def test_old_texts_are_not_shown_beside_new_ones(flown) -> None:
    async def script(vehicle, autopilot):
        for k in range(4):
            autopilot.text(f"old {k}")
        await vehicle.clock.sleep(60.0)
        for k in range(12):
            autopilot.text(f"new {k}")
        await vehicle.clock.sleep(1.0)
        text = vehicle.link.last_received()
        assert "'old" not in text
        assert text.endswith(" / ".join(f"'new {k}'" for k in range(2, 12)))

    flown(script)
