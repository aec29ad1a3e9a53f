"""The end of a return: on the ground, or in the air where the vehicle's parameters keep it there."""

import math

import pytest

from missions.errors import VehicleTimeout
from missions.kind import VehicleKind
from missions.vehicle.returning import AloftWatch
from missions.vehicle.telemetry import Position

RADIUS_M, SPEED_M_S, STEP_S = 90.0, 22.0, 0.2


def position(time_s: float, north_m_s: float, east_m_s: float, height_m: float = 100.0) -> Position:
    return Position(
        time_us=round(time_s * 1e6), lat_deg=47.0, lon_deg=8.0, alt_m=500.0 + height_m, height_m=height_m,
        vel_ned_m_s=(north_m_s, east_m_s, 0.0),
    )  # fmt: skip


def settled_after_s(course_rad, *, sink_m_s: float = 0.0, until_s: float = 120.0, returning: bool = True):
    """Time after which an aircraft with a course over time counts as circling; None: it never does."""
    watch = AloftWatch(VehicleKind.FIXED_WING)
    for k in range(round(until_s / STEP_S)):
        t = k * STEP_S
        course = course_rad(t)
        watch.take(
            position(t, SPEED_M_S * math.cos(course), SPEED_M_S * math.sin(course), 200.0 - sink_m_s * t),
            returning=returning,
        )
        if watch.settled:
            return t
    return None


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_full_turn_at_one_height_is_a_circle(sense) -> None:
    turn_s = math.tau * RADIUS_M / SPEED_M_S
    assert settled_after_s(lambda t: sense * t * SPEED_M_S / RADIUS_M) == pytest.approx(turn_s, abs=1.0)


def test_the_way_home_a_descent_and_another_mode_are_none() -> None:
    assert settled_after_s(lambda t: 0.9 * math.pi * min(1.0, t / 10.0)) is None
    assert settled_after_s(lambda t: 0.5 * math.sin(t)) is None
    assert settled_after_s(lambda t: t * SPEED_M_S / RADIUS_M, sink_m_s=1.0) is None
    assert settled_after_s(lambda t: t * SPEED_M_S / RADIUS_M, returning=False) is None


def test_a_multicopter_that_hovers_for_ten_seconds_stays() -> None:
    watch = AloftWatch(VehicleKind.MULTICOPTER)
    for k in range(300):
        watch.take(position(k * 0.1, 5.0 if k < 150 else 0.1, 0.0), returning=True)
        assert watch.settled == (k >= 249)


@pytest.mark.parametrize(("value", "stays"), [(-1.0, True), (30.0, False)])
def test_a_return_ends_where_the_parameters_end_it(flown, value, stays) -> None:
    async def script(vehicle, autopilot):
        autopilot.parameters["RTL_LAND_DELAY"] = value, 9
        await vehicle.takeoff(10.0)
        fly, hover = autopilot._fly, [True]

        def over_home(dt):  # the return hovers; later it lands, if it does
            if autopilot.kind != "return" or not hover[0]:
                fly(dt)

        autopilot._fly = over_home
        if stays:
            await vehicle.return_to_launch()
            assert vehicle.armed
            assert vehicle.notes.aloft == "hovers over home in mode Return, 10 m above it, armed"
            assert "ended in the air" in vehicle.notes.warnings[-1]
            assert "RTL_LAND_DELAY -1" in vehicle.notes.warnings[-1]
            return
        with pytest.raises(VehicleTimeout, match="disarmed heartbeat"):
            await vehicle.return_to_launch(timeout_s=40.0)
        hover[0] = False
        await vehicle.return_to_launch()
        assert not vehicle.armed
        assert not vehicle.notes.aloft

    flown(script)
