"""A world of time alone, for tests of clocks."""

from autopilot_bridge.clock import VirtualTimeLoop

STEP_US = 4000


class World:
    """Time in steps, and things that happen at a step."""

    def __init__(self):
        self.now_us = 0
        self.steps = 0
        self.events = {}

    def advance(self):
        self.steps += 1
        self.now_us += STEP_US
        for event in self.events.pop(self.now_us, ()):
            event()

    def time_us(self):
        return self.now_us

    def at(self, time_us, event):
        self.events.setdefault(time_us, []).append(event)

    def loop(self, **options):
        return VirtualTimeLoop(self.advance, self.time_us, **options)
