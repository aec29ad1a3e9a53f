"""Control of altitude and airspeed by pitch and throttle, for autopilots that need both with a commanded roll
(PX4).

Total energy control (Lambregts, AIAA 83-2239): throttle controls the sum of the rates of potential and
kinetic energy, pitch controls their difference. Rates are expressed as climb rates: V dV/dt / g is the climb
rate that is equivalent to an acceleration. The controller runs at the end of a telemetry link, so it is slow:
its time constants are those of PX4's own TECS or longer.

Heading control by bank.
"""

import math
from dataclasses import dataclass
from typing import Final

from flightsim.foundation.atmosphere import GRAVITY_M_S2

_ACCELERATION_FILTER_S: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyParameters:
    """Trims, limits and gains.

    Attributes:
        throttle_trim, throttle_min, throttle_max: 0..1; `throttle_trim` holds level flight.
        pitch_trim_rad: pitch of the body in level flight.
        pitch_min_rad, pitch_max_rad: limits of the commanded pitch.
        climb_full_throttle_m_s: climb rate at `throttle_max`.
        sink_idle_m_s: sink rate at `throttle_min`, positive.
        climb_max_m_s, sink_max_m_s: largest commanded climb and sink rates.
        height_time_constant_s, airspeed_time_constant_s: time constants of the first-order response to a
            command.
        angle_of_attack_rad: angle of the wing's zero-lift line in level flight; the pitch added in a bank
            grows with it.
        bank_climb_m_s: loss of climb rate by the drag of one additional load factor.
        balance_gain, balance_integral_per_s: gains for the error of the energy balance.
        total_gain, total_integral_per_s: gains for the error of the total rate.
    """

    throttle_trim: float = 0.5
    throttle_min: float = 0.0
    throttle_max: float = 1.0
    pitch_trim_rad: float = 0.0
    pitch_min_rad: float = math.radians(-15.0)
    pitch_max_rad: float = math.radians(20.0)
    climb_full_throttle_m_s: float = 5.0
    sink_idle_m_s: float = 2.0
    climb_max_m_s: float = 2.5
    sink_max_m_s: float = 2.0
    height_time_constant_s: float = 5.0
    airspeed_time_constant_s: float = 5.0
    angle_of_attack_rad: float = 0.09
    bank_climb_m_s: float = 1.0
    balance_gain: float = 0.4
    balance_integral_per_s: float = 0.15
    total_gain: float = 0.4
    total_integral_per_s: float = 0.15

    def __post_init__(self) -> None:
        if not 0.0 <= self.throttle_min < self.throttle_trim < self.throttle_max <= 1.0:
            raise ValueError(
                f"throttles {self.throttle_min:g}, {self.throttle_trim:g}, {self.throttle_max:g} (least, "
                "trim, "
                "most) are not in order within 0..1"
            )
        if not self.pitch_min_rad < self.pitch_trim_rad < self.pitch_max_rad:
            raise ValueError(
                f"pitch {self.pitch_min_rad:g}, {self.pitch_trim_rad:g}, {self.pitch_max_rad:g} rad "
                "(least, trim, "
                "most) are not in order"
            )
        for name in (
            "climb_full_throttle_m_s",
            "sink_idle_m_s",
            "climb_max_m_s",
            "sink_max_m_s",
            "height_time_constant_s",
            "airspeed_time_constant_s",
        ):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} = {getattr(self, name)} is not possible; it must be more than 0")


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyState:
    """The measurements.

    Attributes:
        height_m: height over the same ground as the commanded height.
        climb_m_s: climb rate, positive upwards.
        airspeed_m_s: airspeed of the same kind as the commanded airspeed.
        roll_rad: bank angle.
    """

    height_m: float
    climb_m_s: float
    airspeed_m_s: float
    roll_rad: float


class EnergyController:
    """The control loop. Call it at a constant rate of about 10 Hz or more.

    Args:
        parameters: trims, limits and gains.
    """

    def __init__(self, parameters: EnergyParameters) -> None:
        self.parameters = parameters
        self._balance = 0.0  # integrals, m/s of climb
        self._total = 0.0
        self._airspeed_m_s = math.nan
        self._acceleration_m_s2 = 0.0

    def step(
        self, dt_s: float, state: EnergyState, *, height_m: float, airspeed_m_s: float
    ) -> tuple[float, float]:
        """(pitch rad, throttle 0..1) for the commanded height and airspeed."""
        p = self.parameters
        speed = max(3.0, state.airspeed_m_s)
        self._differentiate(dt_s, state.airspeed_m_s)
        climb_d = (height_m - state.height_m) / p.height_time_constant_s
        climb_d = max(-p.sink_max_m_s, min(p.climb_max_m_s, climb_d))
        gain = (airspeed_m_s - speed) / p.airspeed_time_constant_s
        gain_d = max(-1.0, min(1.0, gain)) * speed / GRAVITY_M_S2
        gain_now = self._acceleration_m_s2 * speed / GRAVITY_M_S2
        load = 1.0 / max(0.5, math.cos(state.roll_rad))

        total_error = climb_d + gain_d - state.climb_m_s - gain_now
        drag = p.bank_climb_m_s * (load - 1.0)
        commanded = climb_d + gain_d + drag + p.total_gain * total_error + self._total
        span = p.throttle_max - p.throttle_trim if commanded > 0.0 else p.throttle_trim - p.throttle_min
        rate = p.climb_full_throttle_m_s if commanded > 0.0 else p.sink_idle_m_s
        raw = p.throttle_trim + commanded * span / rate
        throttle = max(p.throttle_min, min(p.throttle_max, raw))
        if raw == throttle or (raw - throttle) * total_error < 0.0:
            self._total += p.total_integral_per_s * total_error * dt_s

        balance_error = (climb_d - gain_d) - (state.climb_m_s - gain_now)
        slope = (climb_d - gain_d + p.balance_gain * balance_error + self._balance) / speed
        raw = p.pitch_trim_rad + p.angle_of_attack_rad * (load - 1.0) + slope
        pitch = max(p.pitch_min_rad, min(p.pitch_max_rad, raw))
        if raw == pitch or (raw - pitch) * balance_error < 0.0:
            self._balance += p.balance_integral_per_s * balance_error * dt_s
        return pitch, throttle

    def _differentiate(self, dt_s: float, airspeed_m_s: float) -> None:
        """Acceleration along the path: low-passed difference of the airspeed."""
        if math.isnan(self._airspeed_m_s):
            self._airspeed_m_s = airspeed_m_s
        share = dt_s / (_ACCELERATION_FILTER_S + dt_s)
        step = share * (airspeed_m_s - self._airspeed_m_s)
        self._airspeed_m_s += step
        self._acceleration_m_s2 = step / dt_s if dt_s > 0.0 else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingController:
    """Commands a turn rate proportional to the heading error, and the bank that gives this rate.

    Attributes:
        gain_per_s: turn rate per heading error.
        bank_max_rad: largest commanded bank.
    """

    gain_per_s: float = 0.6
    bank_max_rad: float = math.radians(40.0)

    def roll_rad(self, *, heading_rad: float, wanted_rad: float, airspeed_m_s: float) -> float:
        """Bank angle for turning to a heading, the short way round."""
        error = math.remainder(wanted_rad - heading_rad, math.tau)
        bank = math.atan(self.gain_per_s * error * max(3.0, airspeed_m_s) / GRAVITY_M_S2)
        return max(-self.bank_max_rad, min(self.bank_max_rad, bank))


def heading_deg(heading_rad: float) -> float:
    """A heading for use in commands, in degrees: at least 0 and less than 360, also in single precision."""
    return round(math.degrees(heading_rad), 3) % 360.0
