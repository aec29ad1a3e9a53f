"""Time: the only package that sleeps or reads a clock.

* `Clock`: what missions and other tasks wait on: vehicle time.
* `VirtualTimeLoop`, `LoopClock`, `run`: an embedded world's time, as fast as it goes or paced.
* `TelemetryClock`: the time of a remote vehicle, from its timestamped messages.
* `RealTimeClock`: keeps a simulation in step with the wall clock.
* `wall_time_s`, `unix_time_us`: the wall clock itself and the calendar, for reports and log stamps.
"""

from autopilot_bridge.clock.base import Clock, LoopClock
from autopilot_bridge.clock.pacing import Pacer, RealTimeClock, unix_time_us, wall_time_s
from autopilot_bridge.clock.telemetry import TelemetryClock
from autopilot_bridge.clock.virtual import VirtualTimeLoop, run

__all__ = [
    "Clock",
    "LoopClock",
    "Pacer",
    "RealTimeClock",
    "TelemetryClock",
    "VirtualTimeLoop",
    "run",
    "unix_time_us",
    "wall_time_s",
]
