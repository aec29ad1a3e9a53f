"""Vehicle time: its rules one by one, and the form for whole logs against the one for single messages."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.mavlink import DEFINITIONS, FrameParser
from estimators.logs.dialect import load_dialect
from estimators.logs.tlog import TlogSource
from estimators.messages import message_class, read_message
from estimators.vehicle_time import TeamTime, VehicleTime, stamp_field, vehicle_times
from tests.estimators.logs.reference import pack, tlog


def message(made, *, system=1, component=1):
    (frame,) = FrameParser().feed(pack(made, system=system, component=component))
    return read_message(frame)


def attitude(ms, **source):
    return message(dialect.MAVLink_attitude_message(ms, 0, 0, 0, 0, 0, 0), **source)


def imu(us, **source):
    return message(dialect.MAVLink_raw_imu_message(us, *[0] * 9), **source)


def gps(us, **source):
    return message(dialect.MAVLink_gps_raw_int_message(us, 3, *[0] * 8), **source)


def speed(**source):
    return message(dialect.MAVLink_vfr_hud_message(1, 0, 0, 0, 0, 0), **source)


def stamps(*messages):
    clock = VehicleTime()
    return [clock.stamp(item) for item in messages]


UNIX_US = 1_790_000_000_000_000


def common_s(rates, seconds=60, set_at=None, set_by_s=0.0, boots=(0.0, 40.0)):
    """Common times of two vehicles at a time of their own, whose Unix times have rates and are set once."""
    time = TeamTime()
    for k in range(1, seconds + 1):
        for system, (rate, boot_s) in enumerate(zip(rates, boots, strict=True), start=1):
            own_us = 1_000_000 * k + 300_000 * system
            set_s = set_by_s if set_at is not None and k >= set_at else 0.0
            unix_us = UNIX_US + round(1e3 * (boot_s + rate * own_us * 1e-6 + set_s)) * 1000
            sent = dialect.MAVLink_system_time_message(unix_us, own_us // 1000)
            time.learn(own_us, message(sent, system=system))
    return tuple(time.common_us(5_000_000, system) * 1e-6 for system in (1, 2))


def test_team_time_by_the_boots_of_the_vehicles():
    assert common_s((1.0, 1.00005)) == pytest.approx((5.0, 45.0), abs=0.003)


@pytest.mark.parametrize("rate", [0.2, 0.98, 1.02, 5.0])
def test_a_unix_time_that_runs_apart_from_the_vehicle_time_converts_nothing(rate):
    """PX4 in lockstep with a simulation sends the computer's time of day."""
    assert common_s((rate, rate), boots=(0.0, 0.0)) == (5.0, 5.0)


def test_a_clock_that_is_set_once_counts_from_then_on():
    assert common_s((1.0, 1.0), set_at=20, set_by_s=7.0) == pytest.approx((12.0, 52.0), abs=0.003)


def test_own_stamp_or_the_newest():
    assert stamps(speed(), attitude(1000), speed(), imu(1_005_123), speed()) == [
        0,
        1_000_000,
        1_000_000,
        1_005_123,
        1_005_123,
    ]


def test_late_message_keeps_its_stamp_and_does_not_turn_back_the_clock():
    assert stamps(attitude(5000), imu(4_200_000), speed()) == [5_000_000, 4_200_000, 5_000_000]


def test_unix_time_and_zero_are_no_stamps():
    assert stamps(attitude(5000), imu(1_700_000_000_000_000), imu(0)) == [5_000_000] * 3


def test_time_that_goes_back_is_a_new_boot():
    clock = VehicleTime()
    times = [clock.stamp(item) for item in (attitude(60_000), attitude(2000), speed(), attitude(2100))]
    assert times == [60_000_000, 2_000_000, 2_000_000, 2_100_000]
    assert (clock.boot(1), clock.boot(2)) == (1, 0)


def test_a_burst_of_late_frames_is_no_new_boot():
    """Frames of 1.4 s before came late on a serial line, ten minutes after boot."""
    clock = VehicleTime()
    late = [attitude(608_600 + 50 * k) for k in range(28)]
    times = [clock.stamp(item) for item in (attitude(610_000), imu(610_000_000), *late, attitude(610_050))]
    assert clock.boot(1) == 0
    assert times[2] == 610_000_000 and times[-1] == 610_050_000


@pytest.mark.parametrize(
    ("before_s", "after_s", "boots"),
    [
        (610.0, 608.6, 0),  # late
        (610.0, 570.0, 1),  # no burst is so old
        (3.0, 0.4, 1),  # soon after boot
        (25.0, 15.0, 0),  # not decided by one message ...
    ],
)
def test_one_step_back(before_s, after_s, boots):
    clock = VehicleTime()
    clock.stamp(attitude(round(before_s * 1000)))
    clock.stamp(attitude(round(after_s * 1000)))
    assert clock.boot(1) == boots


def test_time_that_goes_on_behind_is_a_new_boot():
    """... but by those behind it: a boot whose first seconds were not received."""
    clock = VehicleTime()
    clock.stamp(attitude(25_000))
    times = [clock.stamp(attitude(15_000 + 100 * k)) for k in range(40)]
    assert clock.boot(1) == 1
    assert times[:2] == [25_000_000] * 2 and times[-1] == 18_900_000


def test_stale_receiver_is_no_new_boot():
    """A receiver that has lost its fix repeats the time of its last one."""
    clock = VehicleTime()
    times = []
    for second in range(10, 20):
        times += [clock.stamp(attitude(second * 1000)), clock.stamp(gps(10_000_000))]
    assert clock.boot(1) == 0
    assert times[1::2] == [10_000_000, 10_000_000, *(second * 1_000_000 for second in range(12, 20))]


def test_new_boot_is_seen_once_though_all_messages_go_back():
    clock = VehicleTime()
    for item in (attitude(60_000), gps(60_000_000), imu(60_000_000), attitude(100), gps(0), imu(120_000)):
        clock.stamp(item)
    assert clock.boot(1) == 1


def test_other_components_count_while_they_agree_with_the_autopilot():
    assert stamps(
        attitude(10_000),
        attitude(10_400, component=25),
        attitude(500, component=154),
        attitude(90_000, component=100),
        speed(component=154),
    ) == [10_000_000, 10_400_000, 10_000_000, 10_000_000, 10_000_000]


def test_autopilot_takes_over_from_who_was_received_before_it():
    clock = VehicleTime()
    times = [clock.stamp(item) for item in (attitude(90_000, component=154), speed(), attitude(10_000))]
    assert (times, clock.boot(1)) == ([90_000_000, 90_000_000, 10_000_000], 0)


def test_systems_have_clocks_of_their_own():
    assert stamps(attitude(10_000), attitude(3000, system=2), speed(), speed(system=2)) == [
        10_000_000,
        3_000_000,
        10_000_000,
        3_000_000,
    ]


def test_stamps_of_the_definitions_hold_more_than_an_hour():
    """Every field taken for a stamp is wide enough; 32 bits of microseconds are not."""
    for definition in DEFINITIONS.values():
        found = stamp_field(definition.name, definition.field_names)
        if found is not None:
            (field,) = [item for item in definition.wire_fields if item.name == found[0]]
            assert (field.type, field.length) == ("uint32_t" if found[0] == "time_boot_ms" else "uint64_t", 0)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("ATTITUDE", ("time_boot_ms", 1000)),
        ("SYSTEM_TIME", ("time_boot_ms", 1000)),
        ("HIGHRES_IMU", ("time_usec", 1)),
        ("SERVO_OUTPUT_RAW", None),
        ("VFR_HUD", None),
    ],
)
def test_which_field_is_the_stamp(name, expected):
    (found,) = [item for item in DEFINITIONS.values() if item.name == name]
    assert stamp_field(name, found.field_names) == expected
    assert stamp_field(name, message_class(found)._fields) == expected


times_us = st.one_of(
    st.integers(0, 5_000_000),
    st.integers(0, 5_000_000).map(lambda value: 60_000_000 + value),
    st.just(0),
    st.integers(999_999_000_000_000, 1_000_000_001_000_000),
)
steps = st.tuples(st.integers(0, 5), st.integers(1, 2), st.sampled_from([1, 1, 1, 25, 154]), times_us)


@given(st.lists(steps, max_size=60))
@settings(max_examples=300)
def test_whole_logs_have_the_times_of_single_messages(items):
    kinds = (
        lambda us, **source: attitude(min(us // 1000, 2**32 - 1), **source),
        imu,
        gps,
        lambda us, **source: speed(**source),
        lambda us, **source: message(
            dialect.MAVLink_system_time_message(us, min(us // 1000, 2**32 - 1)), **source
        ),
        lambda us, **source: message(
            dialect.MAVLink_servo_output_raw_message(us % 2**32, 0, *[0] * 8), **source
        ),
    )
    made = [kinds[kind](us, system=system, component=component) for kind, system, component, us in items]
    clock = VehicleTime()
    expected, boots = [], []
    for position, item in enumerate(made):
        before = clock.boot(item.src_system)
        expected.append(clock.stamp(item))
        if clock.boot(item.src_system) != before:
            boots.append(position)
    keys = sorted({(item.name, item.src_system, item.src_component) for item in made})
    own = []
    for item in made:
        found = stamp_field(item.name, item._fields)
        own.append(0 if found is None else getattr(item, found[0]) * found[1])
    times = np.array(own, dtype=np.int64)
    begins = vehicle_times(
        times,
        np.array([keys.index((m.name, m.src_system, m.src_component)) for m in made], dtype=np.int32),
        np.array([system for _, system, _ in keys], dtype=np.int64),
        np.array([component for _, _, component in keys], dtype=np.int64),
    )
    assert times.tolist() == expected
    assert begins.tolist() == boots


@given(st.lists(steps, min_size=1, max_size=30))
def test_times_are_read_from_truncated_payloads(items):
    frames = [
        pack(dialect.MAVLink_raw_imu_message(us, *[0] * 9), system=system, component=component)
        for _, system, component, us in items
    ]
    source = TlogSource("log", np.frombuffer(tlog(frames), dtype=np.uint8), load_dialect())
    clock = VehicleTime()
    expected = [clock.stamp(read_message(FrameParser().feed(frame)[0])) for frame in frames]
    assert source.time_us.tolist() == expected
