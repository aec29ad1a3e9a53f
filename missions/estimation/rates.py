"""Message rates on a live link: measured rates, rates that are too low, and requests for higher ones."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, definition, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators.interface import Need
from estimators.needs import NOT_STREAMED, RATE_TOLERANCE, lacking, wanted_rate_hz

CHECK_PERIOD_S: Final = 2.0
"""Interval of vehicle time over which rates are measured; an autopilot answers a request within it."""
_MARGIN: Final = 1.25
"""Requested rates are higher than the needed ones by this factor."""
_STARVED_SHARE: Final = 0.1
_STARVED_S: Final = 6.0
"""An estimator has failed when it lacked its inputs for this time and for a tenth of its total time."""
_ROUNDS: Final = 3
"""Number of requests for each alternative of an optional rate."""


def interval_request(
    system_id: int, name: str, rate_hz: float, component_id: int = AUTOPILOT_COMPONENT
) -> MAVLinkMessage:
    """Message with MAV_CMD_SET_MESSAGE_INTERVAL for an autopilot, or for another component."""
    return dialect.MAVLink_command_long_message(
        system_id,
        component_id,
        dialect.MAV_CMD_SET_MESSAGE_INTERVAL,
        0,
        float(definition(name).message_id),
        1e6 / rate_hz,
        *(0.0,) * 5,
    )


class RateWatch:
    """Measures message rates between checks, and determines which rates to request.

    Args:
        needs: messages and rates that the estimator needs.
        received: frame counts by (system id, message id); the caller updates them.

    Attributes:
        lacking: description of what was missing at the newest check.
        enough: rates have been measured, and no message is missing or too slow.
        measured_s: vehicle time measured since the rates were sufficient for the first time.
        starved_s: the part of that time in which a message was missing or too slow.
    """

    def __init__(self, needs: Sequence[Need], received: Mapping[tuple[int, int], int]) -> None:
        self._needs = needs
        self._received = received
        self._before: Counter[tuple[int, int]] = Counter()
        self._before_us: int | None = None
        self._requests: Counter[tuple[int, int]] = Counter()
        self.lacking: list[str] = []
        self.enough = False
        self.measured_s = 0.0
        self.starved_s = 0.0
        self._missed = ""

    @property
    def starvation(self) -> str:
        """Description of messages that came at first and then were missing; "" if none.

        Messages that never came at the needed rate are not included; they are found from the log.
        """
        if self.starved_s < _STARVED_S or self.starved_s < _STARVED_SHARE * self.measured_s:
            return ""
        return f"starved for {self.starved_s:.0f} s of {self.measured_s:.0f} s: {self._missed}"

    def restart(self) -> None:
        """Restart the measurement, because the time base has changed."""
        self._before_us = None

    def look(self, time_us: int, system_ids: Iterable[int]) -> list[tuple[int, str, float]]:
        """Measure the rates since the last call.

        Args:
            time_us: vehicle time.
            system_ids: vehicles to use.

        Returns:
            (system id, message name, rate) to request; the first call only begins the measurement.
        """
        before_us, before = self._before_us, self._before
        self._before_us, self._before = time_us, Counter(self._received)
        if before_us is None or time_us <= before_us:
            return []
        elapsed_s = (time_us - before_us) * 1e-6
        ids = tuple(system_ids)
        requests: list[tuple[int, str, float]] = []
        self.lacking = [] if ids else lacking(self._needs, lambda _name: 0.0)
        for system_id in ids:
            rate_hz = self._rate_of(system_id, before, elapsed_s)
            which = f"vehicle {system_id}: " if len(ids) > 1 else ""
            self.lacking += [which + text for text in lacking(self._needs, rate_hz)]
            for index, need in enumerate(self._needs):
                if NOT_STREAMED.issuperset(need.messages):
                    continue
                requested = self._to_request(system_id, index, need, rate_hz)
                requests += [(system_id, name, requested_hz) for name, requested_hz in requested]
        self.enough = not self.lacking
        if self.enough or self.measured_s:
            self.measured_s += elapsed_s
        if self.lacking and self.measured_s:
            self.starved_s += elapsed_s
            self._missed = self._missed or "; ".join(self.lacking)
        return requests

    def _rate_of(
        self, system_id: int, before: Mapping[tuple[int, int], int], elapsed_s: float
    ) -> Callable[[str], float]:
        seldom = {name for need in self._needs if not need.rate_hz for name in need.messages}

        def rate_hz(name: str) -> float:
            key = (system_id, definition(name).message_id)
            count = self._received.get(key, 0)
            # A message that may come at any rate may be absent in this period (a target out of sight).
            return (count - (0 if name in seldom else before.get(key, 0))) / elapsed_s

        return rate_hz

    def _to_request(
        self, system_id: int, index: int, need: Need, rate_hz: Callable[[str], float]
    ) -> list[tuple[str, float]]:
        """Messages and rates to request; empty when one is fast enough, or requests had no effect."""
        received_hz, best = max((rate_hz(name), -k) for k, name in enumerate(need.messages))
        wanted_hz = wanted_rate_hz(need)
        served = received_hz > 0.0 and received_hz >= RATE_TOLERANCE * need.rate_hz
        if served and (not need.rate_hz or received_hz >= RATE_TOLERANCE * wanted_hz):
            return []
        times = self._requests[system_id, index]
        if served:  # sufficient; a higher rate is requested once
            self._requests[system_id, index] += 1
            return [] if times else [(need.messages[-best], wanted_hz)]
        if need.optional and times >= _ROUNDS * len(need.messages):
            return []
        self._requests[system_id, index] += 1
        name = need.messages[times % len(need.messages)]
        # An autopilot that refuses the second rate as too fast has already accepted the first.
        enough_hz = _MARGIN * need.rate_hz
        return [(name, rate) for rate in (enough_hz, wanted_hz) if 0.0 < rate <= wanted_hz]
