"""Detects that the messages of one system id do not come from one vehicle."""

from collections import deque
from itertools import pairwise
from typing import Final

_FOREIGN: Final = 2  # heartbeats of another kind of vehicle
_HEARTBEATS: Final = 12
_CHANGES: Final = 6  # of the armed state among those heartbeats; a script arms and disarms less often
_STEPS: Final = 6  # of the time stamps in that time: one reboot is one step
_STEPS_S: Final = 5.0


class SystemIdCheck:
    """Looks for contradictions in what is received from one system id.

    Two vehicles with the same system id look like one whose messages contradict each other: heartbeats of
    two firmwares or classes of vehicle, an armed state that changes from one heartbeat to the next, and time
    stamps that step to and fro between two boot times. A vehicle that is received by several links gives none
    of these, unless their delays differ by more than a second.

    Args:
        sender: description of the vehicle by its first heartbeat, "PX4 multicopter".
    """

    def __init__(self, sender: str) -> None:
        self._sender = sender
        self._foreign = 0
        self._armed: deque[bool] = deque(maxlen=_HEARTBEATS)
        self._steps: deque[tuple[float, int]] = deque()

    def on_heartbeat(self, sender: str, *, armed: bool) -> str:
        """Process a heartbeat; returns the contradiction that it completes, or ""."""
        if sender != self._sender:
            self._foreign += 1
            if self._foreign != _FOREIGN:
                return ""
            return f"heartbeats of {self._sender} and {sender} are received"
        self._armed.append(armed)
        changes = sum(before != after for before, after in pairwise(self._armed))
        if changes < _CHANGES:
            return ""
        return f"the armed state changed {changes} times in {len(self._armed)} heartbeats"

    def on_time_steps(self, count: int, now_s: float) -> str:
        """Process the number of steps that the time stamps have made so far, by this machine's time; returns
        the contradiction that they are, or "".
        """
        self._steps.append((now_s, count))
        while now_s - self._steps[0][0] > _STEPS_S:
            self._steps.popleft()
        steps = count - self._steps[0][1]
        if steps < _STEPS:
            return ""
        return f"the time stamps stepped to and fro {steps} times in {_STEPS_S:g} s"
