"""How a client sees that something is wrong: texts, EVENTs and bits of SYS_STATUS, coming and going."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.autopilot.status import StatusReport
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.firmware.px4 import events as px4_events
from autopilot_bridge.navigation import layout as nav_layout
from tests.commander.rig import Rig
from tests.commander.test_failsafes import battery, heartbeats

RECEIVER, BATTERY = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER, mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
GPS, COMPASS = mavlink.MAV_SYS_STATUS_SENSOR_GPS, mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
GYRO, BAROMETER = mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO, mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
FENCE = mavlink.MAV_SYS_STATUS_GEOFENCE


@dataclass(frozen=True)
class Case:
    """One thing that goes wrong with a vehicle that holds its place.

    Attributes:
        spoil, mend: make it wrong for a while, and right again; None: it stays.
        texts, cleared: what is said.
        events, cleared_events: messages of the events of a PX4; those of texts are left out.
        bit: of SYS_STATUS that is taken out of `health` meanwhile; 0: none.
    """

    name: str
    flavour: str
    spoil: Callable[[Rig], None]
    mend: Callable[[Rig], None] | None = None
    texts: tuple[str, ...] = ()
    cleared: tuple[str, ...] = ()
    events: tuple[str, ...] = ()
    cleared_events: tuple[str, ...] = ()
    bit: int = 0


def silent(seconds: float) -> Callable[[Rig], None]:
    return lambda rig: rig.run(seconds)


def received(rig: Rig) -> None:
    heartbeats(rig, 1.0)


def low(remaining: float, voltage_v: float = 16.0) -> Callable[[Rig], None]:
    def drain(rig: Rig) -> None:
        battery(rig, remaining=remaining, voltage_v=voltage_v)
        rig.run(11.0)

    return drain


def sticks(rig: Rig) -> None:
    for _ in range(25):
        rig.commander.pilot.move(roll=0.0, pitch=0.0, throttle=0.0, yaw=0.0, time_us=rig.time_us)
        rig.tick()


def radio(failed: bool) -> Callable[[Rig], None]:
    def switch(rig: Rig) -> None:
        rig.commander.pilot.lose_signal(failed, rig.time_us)
        rig.run(2.0)

    return switch


def position(valid: bool) -> Callable[[Rig], None]:
    def switch(rig: Rig) -> None:
        rig.judgement.position_valid = valid
        rig.navigation.time_since_gps_us = 0 if valid else 8_000_000
        rig.run(4.0)

    return switch


def sensor(name: str) -> Callable[[Rig], None]:
    def break_it(rig: Rig) -> None:
        values = getattr(rig.readings, name).values

        def spoil() -> None:
            values[:] = 0.0
            values[0] = 1e9

        rig.spoil = spoil
        rig.run(1.0)

    return break_it


def mended(rig: Rig) -> None:
    rig.spoil = None
    rig.run(1.0)


def far(north_m: float) -> Callable[[Rig], None]:
    def go(rig: Rig) -> None:
        rig.context.nav[nav_layout.POS] = north_m
        rig.run(0.3)

    return go


FAILSAFE, CLEARED = "Failsafe due to {1}, action: {2}", "Failsafe cleared: {1}"
WARNED = "Failsafe warning triggered"
CASES = (
    Case(
        "battery low",
        "px4",
        low(0.14),
        texts=("Low battery level, return advised", WARNED),
        events=(FAILSAFE,),
        bit=BATTERY,
    ),
    Case(
        "battery critical",
        "px4",
        low(0.06),
        texts=("Critical battery level, land now", WARNED),
        events=2 * (FAILSAFE,),
        bit=BATTERY,
    ),
    Case(
        "battery dangerous",
        "px4",
        low(0.04),
        texts=("Dangerous battery level, land immediately", WARNED),
        events=3 * (FAILSAFE,),
        bit=BATTERY,
    ),
    Case(
        "ground station",
        "px4",
        silent(11.0),
        received,
        events=("Connection to ground control station lost",),
        cleared_events=("GCS connection regained",),
    ),
    Case(
        "sticks",
        "px4",
        silent(1.0),
        sticks,
        events=("Manual control lost",),
        cleared_events=("Manual control regained after {1:.1} s",),
        bit=RECEIVER,
    ),
    Case(
        "position",
        "px4",
        position(False),
        position(True),
        ("GNSS data fusion stopped", "Failsafe activated"),
        ("GNSS data fusion started",),
        (FAILSAFE,),
        (CLEARED,),
        GPS,
    ),
    Case("compass", "px4", sensor("magnetometer"), mended, bit=COMPASS),
    Case("barometer", "px4", sensor("barometer"), mended, bit=BAROMETER),
    Case("gyro", "px4", sensor("imu"), mended, bit=GYRO),
    Case(
        "battery low",
        "ardupilot",
        low(1.0, 10.2),
        None,
        ("Battery 1 is low", "Battery Failsafe"),
        bit=BATTERY,
    ),
    Case(
        "battery critical",
        "ardupilot",
        low(1.0, 9.0),
        None,
        ("Battery 1 is critical", "Battery Failsafe"),
        bit=BATTERY,
    ),
    Case("ground station", "ardupilot", silent(6.0), received, ("GCS Failsafe",), ("GCS Failsafe Cleared",)),
    Case(
        "sticks",
        "ardupilot",
        radio(True),
        radio(False),
        ("Radio Failsafe",),
        ("Radio Failsafe Cleared",),
        bit=RECEIVER,
    ),
    Case(
        "position",
        "ardupilot",
        position(False),
        position(True),
        ("EKF3 IMU0 stopped aiding", "EKF variance", "EKF Failsafe: changed to LAND Mode"),
        ("EKF3 IMU0 is using GPS", "EKF Failsafe Cleared"),
        bit=GPS,
    ),
    Case(
        "fence",
        "ardupilot",
        far(200.0),
        far(0.0),
        ("Circle fence breached",),
        ("Fence breach cleared",),
        bit=FENCE,
    ),
    Case("compass", "ardupilot", sensor("magnetometer"), mended, bit=COMPASS),
    Case("barometer", "ardupilot", sensor("barometer"), mended, bit=BAROMETER),
    Case("gyro", "ardupilot", sensor("imu"), mended, bit=GYRO),
)
PARAMETERS = {
    "px4": {"COM_LOW_BAT_ACT": 0.0},
    "ardupilot": {"FS_GCS_ENABLE": 1.0, "BATT_CRT_VOLT": 9.5, "FENCE_ENABLE": 1.0, "FENCE_TYPE": 2.0},
}


@dataclass
class Listener:
    """What came since the last look."""

    rig: Rig
    seen: int = 0

    def new(self) -> tuple[list[str], list[str]]:
        """Texts, and messages of EVENTs without one."""
        events = self.rig.events[self.seen :]
        self.seen = len(self.rig.events)
        texts, kinds = [], []
        for event in events:
            notices = self.rig.flavour.texts.notices(event)
            texts += [notice.text for notice in notices]
            kinds += [each.kind.message for each in px4_events.occurrences(event, notices)]
        return texts, [kind for kind in kinds if kind not in texts]


def reported(texts: list[str], expected: tuple[str, ...]) -> None:
    """Each of these once or more, and nothing else; texts may go on with numbers."""
    for beginning in expected:
        assert any(text.startswith(beginning) for text in texts), texts
    assert all(text.startswith(expected) for text in texts), texts


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.flavour} {case.name}")
def test_what_clients_receive(case: Case) -> None:
    rig = Rig(case.flavour)
    for name, value in PARAMETERS[case.flavour].items():
        rig.set_parameter(name, value)
    rig.navigation.time_since_gps_us = 0
    if case.flavour == "ardupilot":
        rig.commander.set_mode(FlightMode.GUIDED)
    rig.put_in_air()
    if case.events[:1] == ("Manual control lost",):
        sticks(rig)
    if case.name == "ground station":
        received(rig)
    rig.run(0.2)
    status, listener = StatusReport(rig.flavour, rig.commander), Listener(rig)
    listener.new()
    before = status.sys_status()
    case.spoil(rig)
    texts, kinds = listener.new()
    reported(texts, case.texts)
    if case.flavour == "px4":
        assert tuple(kinds) == case.events
    # what breaks an inertial sensor breaks both of its halves
    assert before[2] & ~status.sys_status()[2] & ~mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL == case.bit
    if case.mend is None:
        return
    case.mend(rig)
    texts, kinds = listener.new()
    reported(texts, case.cleared)
    if case.flavour == "px4":
        assert tuple(kinds) == case.cleared_events
    assert status.sys_status()[2] == before[2]


def test_sticks_that_never_were_there_are_not_missed() -> None:
    rig = Rig("px4")
    status = StatusReport(rig.flavour, rig.commander)
    rig.put_in_air()
    rig.run(20.0)
    assert not {"Manual control lost", "Connection to ground control station lost"} & set(
        Listener(rig).new()[1]
    )
    assert status.sys_status() == (0x0300402F, 0x0301402F, 0x1320C83F)  # as recorded
    sticks(rig)
    present, _, health = status.sys_status()
    assert present & health & RECEIVER


def test_how_long_a_link_was_away_is_reported() -> None:
    rig = Rig("px4")
    sticks(rig)
    rig.run(5.0)
    sticks(rig)
    (back,) = (
        occurrence
        for event in rig.events
        for occurrence in px4_events.occurrences(event, ())
        if occurrence.kind.name == "commander_rc_regained"
    )
    assert back.values[0] == pytest.approx(5.0, abs=0.2)  # it is looked for at 10 Hz
