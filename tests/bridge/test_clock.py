"""Virtual time and pacing."""

import asyncio
import os
import random
import signal
import socket
import threading

import pytest

from autopilot_bridge.clock import LoopClock, Pacer, RealTimeClock, run, unix_time_us
from autopilot_bridge.errors import ClockError
from tests.bridge.clock_world import STEP_US, World


class Wall:
    """A wall clock that moves only when a task sleeps or works."""

    def __init__(self):
        self.now_s = 50.0
        self.slept = []

    def __call__(self):
        return self.now_s

    def sleep(self, seconds):
        self.slept.append(seconds)
        self.now_s += seconds


# Virtual time


def test_sleep_means_vehicle_seconds():
    world = World()

    async def main():
        await asyncio.sleep(1.0)
        first = world.now_us
        await LoopClock().sleep(0.5)
        await LoopClock().sleep_until(10_000_000)
        await LoopClock().sleep_until(5_000_000)  # past
        return first, world.now_us

    assert run(main(), world.loop()) == (1_000_000, 10_000_000)
    assert world.steps == 2500


def test_waiting_is_exact_to_the_step_far_from_the_start():
    world = World()
    world.now_us = 86_400_000_000 * 10  # ten days

    async def main():
        start_us = world.now_us
        for index in range(1, 500):
            await asyncio.sleep(0.1)
            assert world.now_us == start_us + index * 100_000

    run(main(), world.loop())


def test_timers_between_steps_wait_for_the_next_step():
    world = World()

    async def main():
        await asyncio.sleep(0.0055)
        return world.now_us

    assert run(main(), world.loop()) == 8000


def test_timeouts_are_in_vehicle_time():
    world = World()

    async def main():
        with pytest.raises(TimeoutError):
            async with LoopClock().timeout(2.0):
                await asyncio.sleep(1000.0)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(asyncio.Event().wait(), 3.0)
        return world.now_us

    assert run(main(), world.loop()) == 5_000_000


def test_a_step_wakes_a_task_at_once():
    world = World()

    async def main():
        done = asyncio.get_running_loop().create_future()
        world.at(40_000, lambda: done.set_result("message"))
        assert await done == "message"
        return world.now_us

    assert run(main(), world.loop()) == 40_000


def test_a_timer_set_in_a_step_is_kept():
    world = World()

    async def main():
        loop = asyncio.get_running_loop()
        done = loop.create_future()
        world.at(40_000, lambda: loop.call_later(0.020, done.set_result, None))
        async with asyncio.timeout(100.0):
            await done
        return world.now_us

    assert run(main(), world.loop()) == 60_000


def test_a_cancelled_timer_does_not_matter():
    world = World()

    async def main():
        asyncio.get_running_loop().call_later(0.1, lambda: None).cancel()
        await asyncio.sleep(0.5)
        return world.now_us

    assert run(main(), world.loop()) == 500_000


def test_tasks_that_only_yield_do_not_stop_the_world():
    world = World()

    async def main():
        while world.now_us < 20_000:
            await asyncio.sleep(0)

    run(main(), world.loop())
    assert world.now_us == 20_000


def record(**options):
    """What happens in which order when several tasks run."""
    world = World()
    seen = []

    async def task(name, chance):
        for _ in range(30):
            await asyncio.sleep(chance.random() * 0.1)
            seen.append((world.now_us, name))

    async def main():
        async with asyncio.TaskGroup() as group:
            for name in "abc":
                group.create_task(task(name, random.Random(name)))

    run(main(), world.loop(**options))
    return seen


def test_pacing_changes_nothing_but_the_pace():
    wall = Wall()

    def stops_now_and_then():
        wall.now_s += 0.0003 if len(stops) % 100 else 3.0  # a stopped process
        stops.append(wall.now_s)
        return wall.now_s

    stops = []
    assert record() == record() == record(speedup=500.0) == record(speedup=50.0, monotonic=stops_now_and_then)
    assert len(stops) > 100


def test_time_limit():
    world = World()

    async def main():
        await asyncio.Event().wait()

    with pytest.raises(ClockError, match="did not end within 12 s of vehicle time"):
        run(main(), world.loop(max_time_us=12_000_000))
    assert 12_000_000 <= world.now_us <= 12_100_000


def test_tasks_clean_up_in_vehicle_time_after_the_limit():
    world = World()
    landed = []

    async def main():
        try:
            await asyncio.Event().wait()
        finally:
            await asyncio.sleep(2.0)
            landed.append(world.now_us)

    with pytest.raises(ClockError):
        run(main(), world.loop(max_time_us=1_000_000))
    assert landed == [3_000_000]


def test_an_error_of_the_world_ends_the_run():
    world = World()

    def crash():
        raise ArithmeticError("the model diverged")

    world.at(8000, crash)

    cleaned = []

    async def task(name):
        try:
            await asyncio.sleep(1.0)
        finally:
            await asyncio.sleep(1.0)  # on a time that goes on without the world
            cleaned.append(name)

    async def main():
        await asyncio.gather(task("first"), asyncio.shield(task("second")))

    with pytest.raises(ArithmeticError, match="the model diverged"):
        run(main(), world.loop())
    assert world.now_us == 8000
    assert sorted(cleaned) == ["first", "second"]


@pytest.mark.parametrize("waits", [True, False])
def test_tasks_that_do_not_end_after_an_error_of_the_world_are_left(waits):
    world = World()

    def crash():
        raise ArithmeticError("the model diverged")

    world.at(8000, crash)

    async def main():
        try:
            await asyncio.sleep(1.0)
        finally:
            await (asyncio.get_running_loop().create_future() if waits else asyncio.sleep(1e6))

    with pytest.raises(ArithmeticError, match="the model diverged"):
        run(main(), world.loop())


def test_left_over_tasks_are_cancelled_and_cleaned_up():
    world = World()
    cleaned = []

    async def background():
        try:
            await asyncio.sleep(1e6)
        finally:
            await asyncio.sleep(0.1)
            cleaned.append(world.now_us)

    async def main():
        tasks.append(asyncio.create_task(background()))
        await asyncio.sleep(0.2)
        return "done"

    tasks = []
    assert run(main(), world.loop()) == "done"
    assert cleaned == [300_000] and tasks[0].cancelled()


def test_the_first_interrupt_lets_the_mission_clean_up():
    world = World()
    safe = []
    world.at(400_000, lambda: os.kill(os.getpid(), signal.SIGINT))

    async def main():
        try:
            await asyncio.sleep(1e6)
        except asyncio.CancelledError:
            await asyncio.sleep(1.0)  # land
            safe.append(True)
            raise

    with pytest.raises(KeyboardInterrupt):
        run(main(), world.loop())
    assert safe == [True] and 1_400_000 <= world.now_us < 1_500_000


def test_signal_handlers_of_the_loop_are_served():
    world = World()
    world.at(400_000, lambda: os.kill(os.getpid(), signal.SIGUSR1))

    async def main():
        stop = asyncio.Event()
        asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, stop.set)
        await stop.wait()

    run(main(), world.loop())
    assert 400_000 <= world.now_us <= 400_000 + 70 * STEP_US


@pytest.mark.parametrize("speedup", [None, 1000.0])
def test_sockets_and_threads_are_served(speedup):
    world = World()

    async def main():
        loop = asyncio.get_running_loop()
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        theirs.send(b"hello")
        assert await loop.sock_recv(ours, 10) == b"hello"
        reply = loop.create_future()
        thread = threading.Thread(target=lambda: loop.call_soon_threadsafe(reply.set_result, "thread"))
        thread.start()
        assert await reply == "thread"
        thread.join()
        ours.close()
        theirs.close()

    run(main(), world.loop(speedup=speedup))


def test_a_paced_loop_keeps_its_pace():
    world = World()
    wall = Wall()
    loop = world.loop(speedup=2.0, monotonic=wall)
    real_sleep = type(loop._world_selector).__mro__[1].select  # type: ignore[attr-defined]
    slept = []

    def select(selector, timeout=None):
        if timeout:
            slept.append(timeout)
            wall.now_s += timeout
        return real_sleep(selector, 0)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(loop._world_selector).__mro__[1], "select", select)

        async def main():
            await asyncio.sleep(10.0)

        run(main(), loop)
    assert sum(slept) == pytest.approx(5.0, abs=0.01)


# Pacing


def test_real_time_clock_holds_the_pace_and_tells_the_lag():
    wall = Wall()
    clock = RealTimeClock(2.0, monotonic=wall, wait=wall.sleep)
    for index in range(1001):
        clock.wait_until(index * STEP_US)
        wall.now_s += 0.0005  # work
    assert wall.now_s - 50.0 == pytest.approx(2.0, abs=0.001)
    assert clock.lag_s == 0.0 and clock.slipped_s == 0.0
    wall.now_s += 0.1  # a hiccup is caught up
    clock.wait_until(1001 * STEP_US)
    assert clock.lag_s == pytest.approx(0.1, abs=0.003)
    for index in range(1002, 1200):
        clock.wait_until(index * STEP_US)
    assert wall.now_s - 50.0 == pytest.approx(1199 * 0.002, abs=0.001)
    wall.now_s += 60.0  # a stop is not
    clock.wait_until(1200 * STEP_US)
    assert clock.lag_s == pytest.approx(60.0, abs=0.1) and clock.slipped_s == clock.lag_s
    before_s = wall.now_s
    clock.wait_until(1300 * STEP_US)
    assert wall.now_s - before_s == pytest.approx(0.2, abs=0.001)
    assert clock.max_lag_seen_s == pytest.approx(60.0, abs=0.1)


@pytest.mark.parametrize("speedup", [0.0, -1.0, float("inf"), float("nan")])
def test_impossible_speeds_are_named(speedup):
    with pytest.raises(ValueError, match=f"speed factor {speedup} is not accepted"):
        Pacer(speedup)


def test_the_calendar_is_in_microseconds():
    year_s = 365.25 * 86400
    assert 2024 < 1970 + unix_time_us() * 1e-6 / year_s < 2200
