"""Compares an estimator's needs with the messages of a log or a link, and describes the result."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from estimators.errors import EstimatorError
from estimators.interface import Need

__all__ = ["EstimatorError", "Supply", "lacking", "message_names", "supplies", "wanted_rate_hz"]

NOT_STREAMED = frozenset({"PARAM_VALUE"})
"""Messages that an autopilot sends on request or when a value changes; no rate can be requested for them."""
RATE_TOLERANCE = 0.95
"""Streams are a little slower than requested: 19.2 Hz of IMU are enough when 20 Hz are needed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Supply:
    """The messages available for one need.

    Attributes:
        need: the need.
        message: the alternative that is used, or the fastest one if all are too slow; "" when none is
            available.
        rate_hz: rate of that message.
        met: whether this rate is sufficient.
    """

    need: Need
    message: str
    rate_hz: float
    met: bool

    @property
    def text(self) -> str:
        """Text about what is missing ("RAW_IMU at 1.2 Hz; needs 20 Hz or more for ..."), or about the message
        used.
        """
        need = self.need
        if self.met:
            return f"{self.message} at {_hz(self.rate_hz)}" if self.message else f"{need.purpose}: not needed"
        wanted = f"needs {_hz(need.rate_hz)} or more" if need.rate_hz else "needs it at any rate"
        if self.message:
            return f"{self.message} at {_hz(self.rate_hz)}; {wanted} for {need.purpose}"
        return f"no {' or '.join(need.messages)}; {wanted} for {need.purpose}"


def supplies(needs: Iterable[Need], rate_hz: Callable[[str], float]) -> list[Supply]:
    """The supply of each need: the first of its messages that is fast enough, else the fastest.

    Args:
        needs: needs of an estimator.
        rate_hz: returns the rate of a message by name; 0 if it is absent.
    """
    return [_supply(need, rate_hz) for need in needs]


def lacking(needs: Iterable[Need], rate_hz: Callable[[str], float]) -> list[str]:
    """Texts about missing inputs that are not optional; empty when the estimator can work."""
    return [s.text for s in supplies(needs, rate_hz) if not s.met and not s.need.optional]


def message_names(needs: Sequence[Need]) -> frozenset[str]:
    """Names of all messages that can satisfy a need."""
    return frozenset(name for need in needs for name in need.messages)


def wanted_rate_hz(need: Need) -> float:
    """Rate to request from an autopilot; 1 Hz for a message that may come at any rate."""
    return max(need.rate_hz, need.wanted_rate_hz) or 1.0


def _supply(need: Need, rate_hz: Callable[[str], float]) -> Supply:
    fastest, fastest_hz = "", 0.0
    for name in need.messages:
        received_hz = rate_hz(name)
        if received_hz > 0.0 and received_hz >= RATE_TOLERANCE * need.rate_hz:
            return Supply(need=need, message=name, rate_hz=received_hz, met=True)
        if received_hz > fastest_hz:
            fastest, fastest_hz = name, received_hz
    return Supply(need=need, message=fastest, rate_hz=fastest_hz, met=False)


def _hz(rate_hz: float) -> str:
    return f"{rate_hz:.3g} Hz" if rate_hz < 100.0 else f"{rate_hz:.0f} Hz"
