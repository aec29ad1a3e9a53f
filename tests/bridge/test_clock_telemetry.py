"""Vehicle time from telemetry: wall time is the virtual time of the test's loop."""

import asyncio
import random

import pytest

from autopilot_bridge.clock import TelemetryClock, run
from tests.bridge.clock_world import World


def telemetry_run(main):
    """Run `main(clock, wall)` with a telemetry clock on a wall clock that the loop simulates."""
    world = World()

    async def body():
        return await main(TelemetryClock(lambda: world.now_us * 1e-6), world)

    return run(body(), world.loop(max_time_us=10_000_000_000))


async def stream(clock, world, *, start_us, rate, period_s=0.1, latency=None):
    """Timestamps as a vehicle at `rate` sends them."""
    wall_us = world.now_us
    while True:
        clock.observe(round(start_us + (world.now_us - wall_us) * rate))
        await asyncio.sleep(period_s + (latency() if latency else 0.0))


@pytest.mark.parametrize("rate", [0.25, 1.0, 20.0])
def test_telemetry_clock_follows_and_interpolates(rate):
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=300_000_000, rate=rate))
        await asyncio.sleep(5.0)
        assert clock.rate == pytest.approx(rate, rel=1e-3)
        for _ in range(200):
            await asyncio.sleep(0.017)
            expected_us = 300_000_000 + world.now_us * rate
            assert clock.time_us == pytest.approx(expected_us, abs=20_000 * rate)
        telling.cancel()

    telemetry_run(main)


def test_telemetry_clock_never_runs_backwards():
    chance = random.Random(6)

    async def main(clock, world):
        latency = lambda: chance.random() * 0.05  # noqa: E731
        telling = [
            asyncio.create_task(stream(clock, world, start_us=1_000_000, rate=5.0, latency=latency))
            for _ in range(3)
        ]
        last_us = clock.time_us
        for _ in range(2000):
            await asyncio.sleep(0.004)
            assert clock.time_us >= last_us
            last_us = clock.time_us
        for task in telling:
            task.cancel()

    telemetry_run(main)


def test_waiting_on_a_fast_vehicle():
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=0, rate=10.0))
        await asyncio.sleep(1.0)
        started_us = world.now_us
        await clock.sleep(50.0)
        assert world.now_us - started_us == pytest.approx(5_000_000, abs=50_000)
        with pytest.raises(TimeoutError):
            async with clock.timeout(20.0):
                await asyncio.Event().wait()
        assert world.now_us - started_us == pytest.approx(7_000_000, abs=60_000)
        await clock.sleep_until(clock.time_us - 5)
        async with clock.timeout(20.0):
            await clock.sleep(1.0)
        await clock.sleep(30.0)  # the timeout that was left does not strike later
        telling.cancel()

    telemetry_run(main)


def test_a_change_of_speed_is_noticed_while_waiting():
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=0, rate=1.0))
        await asyncio.sleep(2.0)
        waiting = asyncio.create_task(clock.sleep_until(100_000_000))
        await asyncio.sleep(1.0)
        telling.cancel()
        telling = asyncio.create_task(stream(clock, world, start_us=clock.time_us, rate=20.0))
        await waiting
        assert world.now_us * 1e-6 == pytest.approx(3.0 + 97.0 / 20.0, abs=0.1)
        telling.cancel()

    telemetry_run(main)


def test_deadlines_expire_on_a_dead_link():
    async def main(clock, world):
        with pytest.raises(TimeoutError):
            async with clock.timeout(5.0):  # nothing was ever received
                await asyncio.Event().wait()
        assert world.now_us == pytest.approx(5_000_000, abs=10_000)
        telling = asyncio.create_task(stream(clock, world, start_us=60_000_000, rate=4.0))
        await asyncio.sleep(5.0)
        telling.cancel()
        silent_since_us = world.now_us
        with pytest.raises(TimeoutError):
            async with clock.timeout(40.0):
                await asyncio.Event().wait()
        # two seconds at the vehicle's pace, the others at real time
        assert world.now_us - silent_since_us == pytest.approx(38_800_000, abs=200_000)
        assert clock.silence_s == pytest.approx(38.9, abs=0.3)

    telemetry_run(main)


def test_a_fast_simulator_that_is_stopped_for_a_second_does_not_use_up_deadlines():
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=0, rate=20.0, period_s=0.01))
        await asyncio.sleep(5.0)
        async with clock.timeout(10.0):  # 20 s would have passed at the vehicle's pace
            telling.cancel()
            stopped_us = clock.time_us
            await asyncio.sleep(1.0)
            assert clock.time_us - stopped_us == pytest.approx(2_900_000, abs=300_000)
            telling = asyncio.create_task(stream(clock, world, start_us=stopped_us, rate=20.0, period_s=0.01))
            await asyncio.sleep(0.3)
        assert clock.time_us - stopped_us == pytest.approx(
            6_000_000, abs=300_000
        )  # its own time, nothing lost
        assert clock.rate < 20.0
        telling.cancel()

    telemetry_run(main)


def test_a_slow_vehicle_is_not_hurried_by_silence():
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=0, rate=0.25))
        await asyncio.sleep(5.0)
        telling.cancel()
        silent_since_us = clock.time_us
        await asyncio.sleep(40.0)
        assert clock.time_us - silent_since_us == pytest.approx(10_000_000, abs=100_000)

    telemetry_run(main)


@pytest.mark.parametrize("rate", [0.25, 1.0, 20.0])
@pytest.mark.parametrize("ahead_s", [0.5, 1.9, 2.1, 30.0])
def test_the_time_until_a_deadline_in_silence_is_exact(rate, ahead_s):
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=0, rate=rate))
        await asyncio.sleep(5.0)
        telling.cancel()
        due_us = clock.time_us + round(ahead_s * 1e6)
        wait_s = clock.wall_s_until(due_us)
        await asyncio.sleep(wait_s)
        assert clock.time_us == pytest.approx(due_us, abs=20_000 * rate)
        assert clock.wall_s_until(due_us) == pytest.approx(0.0, abs=0.02)

    telemetry_run(main)


def test_the_first_message_sets_the_time_and_leaves_waits_what_they_had():
    async def main(clock, world):
        waiting = asyncio.create_task(clock.sleep(10.0))
        await asyncio.sleep(4.0)
        telling = asyncio.create_task(stream(clock, world, start_us=500_000_000, rate=1.0))
        await asyncio.sleep(0.1)
        assert clock.time_us == pytest.approx(500_100_000, abs=10_000)
        await waiting
        assert world.now_us == pytest.approx(10_000_000, abs=20_000)
        telling.cancel()

    telemetry_run(main)


def test_a_vehicle_that_boots_after_us_sets_the_time_too():
    """Who waits for a vehicle to be switched on is not ahead of it ever after."""

    async def main(clock, world):
        waiting = asyncio.create_task(clock.sleep(30.0))
        await asyncio.sleep(20.0)
        assert clock.time_us == clock.stamp_us == pytest.approx(20_000_000, abs=10_000)
        telling = asyncio.create_task(stream(clock, world, start_us=1_200_000, rate=1.0))
        await asyncio.sleep(1.0)
        assert clock.time_us == clock.stamp_us == pytest.approx(2_200_000, abs=10_000)
        await waiting
        assert world.now_us == pytest.approx(30_000_000, abs=20_000)
        telling.cancel()

    telemetry_run(main)


def test_a_reboot_does_not_stop_the_clock():
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=900_000_000, rate=1.0))
        await asyncio.sleep(5.0)
        telling.cancel()
        await asyncio.sleep(2.0)
        before_us = clock.time_us
        telling = asyncio.create_task(stream(clock, world, start_us=100_000, rate=1.0))
        await clock.sleep(3.0)
        assert clock.reboots == 1
        assert clock.time_us == pytest.approx(before_us + 3_000_000, abs=20_000)
        assert clock.vehicle_time_us == pytest.approx(3_100_000, abs=110_000)
        assert clock.stamp_us == pytest.approx(3_100_000, abs=20_000)
        telling.cancel()

    telemetry_run(main)


def test_a_vehicle_that_stood_still_goes_on_with_the_clock():
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=10_000_000, rate=1.0))
        await asyncio.sleep(5.0)
        telling.cancel()
        await asyncio.sleep(60.0)  # paused; our deadlines went on
        before_us = clock.time_us
        telling = asyncio.create_task(stream(clock, world, start_us=15_000_000, rate=1.0))
        await asyncio.sleep(1.0)
        assert clock.time_us == pytest.approx(before_us + 1_000_000, abs=20_000)
        assert clock.stamp_us == pytest.approx(16_000_000, abs=20_000)  # what its messages say
        assert clock.reboots == 0
        telling.cancel()

    telemetry_run(main)


def test_messages_that_waited_for_a_busy_process_are_no_pause():
    """A computation of a second blocks us; then all messages of that time come at once."""

    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=10_000_000, rate=20.0))
        await asyncio.sleep(5.0)
        telling.cancel()
        await asyncio.sleep(1.0)
        before_us = clock.time_us
        assert before_us == pytest.approx(10_000_000 + 20 * 5_000_000 + 2_900_000, abs=1_000_000)
        for late_us in range(111_000_000, 130_000_001, 100_000):
            clock.observe(late_us)
            assert clock.time_us == pytest.approx(max(before_us, late_us), abs=200_000)  # in their order
        telling = asyncio.create_task(stream(clock, world, start_us=130_000_000, rate=20.0))
        await asyncio.sleep(1.0)
        assert clock.time_us == pytest.approx(150_000_000, abs=1_000_000)

    telemetry_run(main)


STAMPS = {
    "standing still": lambda t_s: 20_000_000,
    "always 0": lambda t_s: 0,
    "creeping": lambda t_s: 20_000_000 + round(1_000 * t_s),
    "ever earlier": lambda t_s: 400_000_000 - round(3_000_000 * t_s),
    "to and fro": lambda t_s: 20_000_000 + (round(t_s * 10) % 2) * 4_000_000,
    "the last one there is": lambda t_s: 0xFFFFFFFF * 1000,
}


@pytest.mark.parametrize("stamps", STAMPS)
def test_no_time_stamps_delay_a_deadline_for_ever(stamps):
    """Received are ten stamps a second, and never one that means a second of vehicle time in a second."""

    async def main(clock, world):
        async def tell():
            while True:
                clock.observe(STAMPS[stamps](world.now_us * 1e-6))
                await asyncio.sleep(0.1)

        telling = asyncio.create_task(stream(clock, world, start_us=20_000_000, rate=1.0))
        await asyncio.sleep(5.0)
        telling.cancel()
        telling = asyncio.create_task(tell())
        await asyncio.sleep(10.0)
        begun_us = world.now_us
        with pytest.raises(TimeoutError):
            async with clock.timeout(30.0):
                await asyncio.Event().wait()
        telling.cancel()
        return (world.now_us - begun_us) * 1e-6, clock

    took_s, clock = telemetry_run(main)
    # at real time; a vehicle that seems slow may be a slow simulator, and is waited for 20 times as long
    assert took_s == pytest.approx(600.0 if stamps == "creeping" else 30.0, rel=0.04)
    assert (clock.stood_still_s > 30.0) == (stamps in ("standing still", "always 0", "the last one there is"))


def test_a_time_that_stood_still_and_goes_on_is_followed_again():
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=10_000_000, rate=1.0))
        await asyncio.sleep(5.0)
        telling.cancel()
        telling = asyncio.create_task(stream(clock, world, start_us=15_000_000, rate=0.0))
        await asyncio.sleep(20.0)
        telling.cancel()
        telling = asyncio.create_task(stream(clock, world, start_us=15_000_000, rate=1.0))
        await asyncio.sleep(2.0)
        assert clock.time_us == pytest.approx(37_000_000, abs=400_000)
        assert clock.stamp_us == pytest.approx(17_000_000, abs=400_000)
        assert clock.rate == pytest.approx(1.0, rel=0.01)
        assert clock.stood_still_s == pytest.approx(20.0, abs=0.3)
        telling.cancel()

    telemetry_run(main)


@pytest.mark.parametrize("ahead_us", [4_000_000, 10_000_000_000])
def test_a_step_ahead_does_not_end_waits(ahead_us):
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=10_000_000, rate=1.0))
        await asyncio.sleep(5.0)
        telling.cancel()
        before_us = clock.time_us
        telling = asyncio.create_task(stream(clock, world, start_us=15_000_000 + ahead_us, rate=1.0))
        await asyncio.sleep(3.0)
        assert clock.time_us == pytest.approx(before_us + 3_000_000, abs=20_000)
        assert clock.stamp_us == pytest.approx(18_000_000 + ahead_us, abs=120_000)
        assert (clock.jumps, clock.reboots) == (1, 0)
        telling.cancel()

    telemetry_run(main)


def test_time_stamps_that_wrap_are_no_reboot():
    """time_boot_ms begins again after 49.7 days."""

    async def main(clock, world):
        wrap_us = (1 << 32) * 1000

        async def tell():
            while True:
                clock.observe((wrap_us - 5_000_000 + world.now_us) // 1000 * 1000 % wrap_us)
                await asyncio.sleep(0.1)

        telling = asyncio.create_task(tell())
        await asyncio.sleep(10.0)
        assert clock.time_us == pytest.approx(wrap_us + 5_000_000, abs=20_000)
        assert clock.stamp_us == pytest.approx(5_000_000, abs=20_000)
        assert (clock.jumps, clock.reboots) == (0, 0)
        telling.cancel()

    telemetry_run(main)


def test_a_simulator_is_not_hurried_down_to_a_twentieth_of_real_time():
    async def main(clock, world):
        telling = asyncio.create_task(stream(clock, world, start_us=0, rate=0.06))
        await asyncio.sleep(100.0)
        assert clock.stamp_us == clock.time_us == pytest.approx(6_000_000, abs=20_000)
        assert clock.stood_still_s == 0.0
        telling.cancel()

    telemetry_run(main)
