"""An own estimator: altitude and climb from the static pressure.

    flightstack fly lissajous --estimator examples/own_estimator.py --out climb
    flightstack replay climb/flight.tlog --estimator examples/own_estimator.py --set time_constant_s=1
    flightstack estimate examples/own_estimator.py --connect udpin:127.0.0.1:14540

The three commands run it in a flight, over a log and on a live link. It needs no registration.
"""

from dataclasses import dataclass
from typing import ClassVar

from flightstack import Estimator, InputGuard, Need, Outcome


@dataclass(frozen=True, slots=True, kw_only=True)
class ClimbParameters:
    time_constant_s: float = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ClimbEstimate:
    COLUMNS: ClassVar = ("alt_m", "down_m_s")
    time_us: int
    subject: int
    alt_m: float
    down_m_s: float

    def row(self) -> tuple[float, ...]:
        return self.alt_m, self.down_m_s


class Climb(Estimator[ClimbParameters]):
    """Altitude and climb from pressure (ISA), by an alpha-beta filter."""

    NAME = "climb"
    PARAMETERS = ClimbParameters
    needs = (Need(messages=("SCALED_PRESSURE",), rate_hz=4.0, wanted_rate_hz=20.0, purpose="pressure"),)

    def __init__(self, parameters=None):
        super().__init__(parameters)
        self.reset()

    def reset(self):
        self.guard = InputGuard(max_gap_us=2_000_000)
        self.newest = None

    def handle(self, time_us, message):
        fault = self.guard.check(time_us, message.name, (message.press_abs,))
        if fault is Outcome.TIME_JUMP:
            self.newest = None
        elif fault is not None:
            return fault
        if not 1.0 < message.press_abs < 1200.0:
            return Outcome.IMPLAUSIBLE
        alt_m = 44330.8 * (1.0 - (message.press_abs / 1013.25) ** 0.190263)
        last = self.newest
        if last is None:
            estimate = (alt_m, 0.0)
        else:
            dt_s = max(1e-3, (time_us - last.time_us) * 1e-6)  # two samples of one time may differ
            gain = dt_s / (self.parameters.time_constant_s + dt_s)
            expected_m = last.alt_m - last.down_m_s * dt_s
            error_m = alt_m - expected_m
            estimate = (expected_m + gain * (2.0 - gain) * error_m, last.down_m_s - gain**2 / dt_s * error_m)
        self.newest = ClimbEstimate(
            time_us=time_us, subject=message.src_system, alt_m=estimate[0], down_m_s=estimate[1]
        )
        return Outcome.UPDATED

    @property
    def estimates(self):
        return (self.newest,) if self.newest else ()
