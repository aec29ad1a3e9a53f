"""A mission's conversation with a vehicle over a radio that loses, delays, repeats and swaps what it carries.

At 5 % loss everything is done in the end. At 30 % it is done or fails with a reason, and never done by half.
"""

import asyncio
import math
from collections.abc import Awaitable, Callable
from typing import TypeVar

import numpy as np
import pytest

from autopilot_bridge.clock import LoopClock, VirtualTimeLoop, run
from autopilot_bridge.links import Impairment, LossyLink, MemoryLink
from autopilot_bridge.mavlink import FrameParser, decode, definition
from autopilot_bridge.mission_plan import MissionItem
from missions.errors import MissionError
from missions.vehicle.connection import Connection
from missions.vehicle.setpoint import Setpoint
from missions.vehicle.vehicle import Vehicle
from tests.slow import slow_after
from tests.system.flying import Flying

T = TypeVar("T")
FLAVOURS = ("px4", "ardupilot")
POOR = Impairment(loss=0.05, duplicate=0.05, reorder=0.05, jitter_s=0.2)
BAD = Impairment(loss=0.3, duplicate=0.05, reorder=0.05, jitter_s=0.2)
SPEEDS = {"px4": ("MPC_XY_VEL_MAX", "MPC_ACC_HOR"), "ardupilot": ("WPNAV_SPEED", "WPNAV_ACCEL")}
WAYPOINT = 16
ITEM = definition("MISSION_ITEM_INT").message_id
LIMIT_S = 900.0


class Radio:
    """A vehicle, and a mission's connection to it over a lossy link of its own."""

    def __init__(self, flavour: str, impairment: Impairment, seed: int) -> None:
        self.flying = Flying(flavour)
        self._generator = np.random.default_rng(seed)
        self._impairment = impairment

    def mission(self, script: Callable[[Vehicle], Awaitable[T]]) -> T:
        sitl = self.flying.sitl

        async def main() -> T:
            link = LossyLink(
                sitl.connect(0), self._impairment, generator=self._generator, time_us=lambda: sitl.time_us
            )
            async with Connection(link, LoopClock()) as connection:
                vehicle = Vehicle(connection)
                await vehicle.wait_heartbeat()
                return await script(vehicle)

        limit_us = sitl.time_us + round(LIMIT_S * 1e6)
        return run(main(), VirtualTimeLoop(sitl.advance, lambda: sitl.time_us, max_time_us=limit_us))

    @property
    def stored(self) -> tuple[MissionItem, ...]:
        """The mission on board, without ArduPilot's home."""
        items = self.flying.autopilot.commander.missions.items
        return tuple(items[1:] if self.flying.flavour == "ardupilot" else items)


def plan(vehicle: Vehicle, count: int, height_m: float) -> list[MissionItem]:
    home = vehicle.home
    away = [
        MissionItem(command=WAYPOINT, x=home.lat_deg + 1e-5 * k, y=home.lon_deg, z=height_m)
        for k in range(1, count)
    ]
    return [vehicle.firmware.takeoff_item(home, height_m), *away]


def heights(items: tuple[MissionItem, ...] | list[MissionItem]) -> list[float]:
    return [item.z for item in items]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_everything_is_done_over_a_poor_radio(flavour: str, seed: int) -> None:
    radio = Radio(flavour, POOR, seed)
    speed, acceleration = SPEEDS[flavour]

    async def script(vehicle: Vehicle) -> list[MissionItem]:
        await vehicle.wait_ready()
        for k in range(5):
            await vehicle.set_parameter(speed, 5.0 + k)
            await vehicle.set_parameter(acceleration, 3.0 + k)
        assert [await vehicle.parameter(name) for name in (speed, acceleration)] == [9.0, 7.0]
        await vehicle.plans.upload_mission(plan(vehicle, 25, 30.0))
        await vehicle.plans.clear_mission()
        assert radio.stored == ()
        await vehicle.plans.upload_mission(plan(vehicle, 25, 40.0))
        return await vehicle.plans.download_mission()

    assert heights(radio.mission(script)) == [40.0] * 25
    assert heights(radio.stored) == [40.0] * 25
    parameters = radio.flying.autopilot.parameters
    assert (parameters.get(speed), parameters.get(acceleration)) == (9.0, 7.0)


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_flies_by_setpoints_over_a_poor_radio(flavour: str) -> None:
    radio = Radio(flavour, POOR, 7)

    async def script(vehicle: Vehicle) -> float:
        await vehicle.wait_ready()
        await vehicle.takeoff(8.0)
        worst_m = 0.0

        def circle(time_s: float) -> Setpoint | None:
            nonlocal worst_m
            if time_s > 20.0:
                return None
            if time_s > 5.0:
                north_m, east_m, _ = radio.flying.true_position_m
                worst_m = max(worst_m, abs(math.hypot(north_m, east_m) - 10.0))
            return Setpoint(
                position_ned_m=(10.0 * math.cos(0.2 * time_s), 10.0 * math.sin(0.2 * time_s), -8.0)
            )

        await vehicle.goto_ned(10.0, 0.0, -8.0)
        await vehicle.follow(circle)
        await vehicle.land()
        return worst_m

    assert radio.mission(script) < 2.5
    assert not radio.flying.armed


@pytest.mark.parametrize("seed", slow_after(1, range(10)))
@pytest.mark.parametrize("flavour", slow_after(1, FLAVOURS))
def test_nothing_is_done_by_half_over_a_bad_radio(flavour: str, seed: int) -> None:
    radio = Radio(flavour, BAD, 100 + seed)
    speed, _ = SPEEDS[flavour]
    flying = radio.flying
    failures: list[str] = []

    async def attempt(step: Awaitable[object]) -> bool:
        try:
            await step
        except MissionError as error:
            failures.append(str(error))
            return False
        return True

    async def script(vehicle: Vehicle) -> None:
        while True:
            if await attempt(vehicle.wait_ready()):
                break
        for k in range(3):
            before, after = flying.autopilot.parameters.get(speed), 5.0 + k
            done = await attempt(vehicle.set_parameter(speed, after))
            kept = flying.autopilot.parameters.get(speed)
            assert kept == after if done else kept in (before, after)
        for k in range(2):
            before_items = radio.stored
            done = await attempt(vehicle.plans.upload_mission(plan(vehicle, 12 + k, 20.0 + k)))
            stored = heights(radio.stored)
            new = [20.0 + k] * (12 + k)
            assert stored == new if done else stored in (heights(before_items), new)
            await asyncio.sleep(10.0)  # what an unfinished transfer leaves is over
            try:
                down = await vehicle.plans.download_mission()
            except MissionError as error:
                failures.append(str(error))
            else:
                assert heights(down) == heights(radio.stored)

    radio.mission(script)
    assert all(len(text) > 20 for text in failures)


class Stalled:
    """A link whose way up stands still once, for so long, from the item with a number on."""

    def __init__(self, link: MemoryLink, seq: int, seconds: float, time_us: Callable[[], int]) -> None:
        self._link, self._seq, self._us, self._time_us = link, seq, round(seconds * 1e6), time_us
        self._until_us: int | None = None
        self._held: list[bytes] = []
        self.receive, self.filenos, self.close = link.receive, link.filenos, link.close

    def send(self, data: bytes) -> None:
        now_us = self._time_us()
        if self._until_us is None:
            for frame in FrameParser().feed(data):
                if frame.message_id == ITEM and decode(frame).seq == self._seq:  # type: ignore[attr-defined]
                    self._until_us = now_us + self._us
        if self._until_us is not None and now_us < self._until_us:
            self._held.append(data)
            return
        for held in self._held:
            self._link.send(held)
        self._held.clear()
        self._link.send(data)


@pytest.mark.parametrize(("flavour", "seconds"), [("px4", 7.0), ("ardupilot", 7.0), ("ardupilot", 10.0)])
@pytest.mark.sampled(1)
def test_an_upload_that_the_vehicle_gave_up_is_done_anew(flavour: str, seconds: float) -> None:
    """PX4 gives a transfer up after 5 s, and answers the item that comes then with ERROR; ArduPilot cancels
    it after 8 s.
    """
    flying = Flying(flavour)
    sitl = flying.sitl

    async def main() -> None:
        link = Stalled(sitl.connect(0), 3, seconds, lambda: sitl.time_us)
        async with Connection(link, LoopClock()) as connection:  # type: ignore[arg-type]
            vehicle = Vehicle(connection)
            await vehicle.wait_ready()
            await vehicle.plans.upload_mission(plan(vehicle, 8, 30.0))

    run(main(), VirtualTimeLoop(sitl.advance, lambda: sitl.time_us, max_time_us=round(LIMIT_S * 1e6)))
    items = flying.autopilot.commander.missions.items
    assert [item.z for item in items][-8:] == [30.0] * 8
