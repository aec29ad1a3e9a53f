"""What an estimator needs and a log or a link gives, compared and told in words."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from estimators.errors import EstimatorError
from estimators.interface import Need

__all__ = ["EstimatorError", "Supply", "lacking", "message_names", "supplies", "wanted_rate_hz"]

NOT_STREAMED = frozenset({"PARAM_VALUE"})
"""Messages that an autopilot sends on request or when something changes: no rate can be asked for."""
RATE_TOLERANCE = 0.95
"""Streams come a little slower than they are asked for: 19.2 Hz of IMU serve where 20 are needed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Supply:
    """How one need is served.

    Attributes:
        need: the need.
        message: the alternative that serves it, or would if it were faster; "" where there is none of them.
        rate_hz: rate of that message.
        met: whether that is enough.
    """

    need: Need
    message: str
    rate_hz: float
    met: bool

    @property
    def text(self) -> str:
        """What is lacking, in words ("RAW_IMU at 1.2 Hz; needs 20 Hz or more for ..."), or what serves."""
        need = self.need
        if self.met:
            return f"{self.message} at {_hz(self.rate_hz)}" if self.message else f"{need.purpose}: not needed"
        wanted = f"needs {_hz(need.rate_hz)} or more" if need.rate_hz else "needs it at any rate"
        if self.message:
            return f"{self.message} at {_hz(self.rate_hz)}; {wanted} for {need.purpose}"
        return f"no {' or '.join(need.messages)}; {wanted} for {need.purpose}"


def supplies(needs: Iterable[Need], rate_hz: Callable[[str], float]) -> list[Supply]:
    """How each need is served: by the first of its messages that is fast enough, else by the fastest.

    Args:
        needs: of an estimator.
        rate_hz: rate of a message by name; 0 where it is absent.
    """
    return [_supply(need, rate_hz) for need in needs]


def lacking(needs: Iterable[Need], rate_hz: Callable[[str], float]) -> list[str]:
    """What is missing and can't be done without, in words; empty when the estimator can work."""
    return [s.text for s in supplies(needs, rate_hz) if not s.met and not s.need.optional]


def message_names(needs: Sequence[Need]) -> frozenset[str]:
    """Every message that serves a need."""
    return frozenset(name for need in needs for name in need.messages)


def wanted_rate_hz(need: Need) -> float:
    """What to ask an autopilot for; a message that may come at any rate is asked for each second."""
    return max(need.rate_hz, need.wanted_rate_hz) or 1.0


def _supply(need: Need, rate_hz: Callable[[str], float]) -> Supply:
    fastest, fastest_hz = "", 0.0
    for name in need.messages:
        heard_hz = rate_hz(name)
        if heard_hz > 0.0 and heard_hz >= RATE_TOLERANCE * need.rate_hz:
            return Supply(need=need, message=name, rate_hz=heard_hz, met=True)
        if heard_hz > fastest_hz:
            fastest, fastest_hz = name, heard_hz
    return Supply(need=need, message=fastest, rate_hz=fastest_hz, met=False)


def _hz(rate_hz: float) -> str:
    return f"{rate_hz:.3g} Hz" if rate_hz < 100.0 else f"{rate_hz:.0f} Hz"
