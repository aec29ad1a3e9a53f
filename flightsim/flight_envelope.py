"""The flight envelope of a fixed-wing aircraft, in numbers: the source of an autopilot's airframe file.

Its computation is also the check of an aircraft when it is loaded: one that cannot fly its cruise, or whose
controls have no effect or the opposite effect, is refused with a clear message.
"""

import math
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from flightsim.airframe import Airframe, AirframeError, FlightLimits, Role, load_airframe
from flightsim.control_effects import LEAST_EFFECT, control_effects, dead_controls
from flightsim.environment import Environment
from flightsim.flight_figures import FlightEnvelope
from flightsim.foundation.atmosphere import GRAVITY_M_S2, SEA_LEVEL_DENSITY_KG_M3
from flightsim.home import Home
from flightsim.jsbsim_package import jsbsim
from flightsim.linear_modes import LinearModel, P, Q, R, U, V, W, linearise
from flightsim.model_files import content_digest
from flightsim.trim_flight import AIRSPEEDS_M_S, FlightTrim, TrimError, trim_in_tunnel
from flightsim.wind_tunnel import WindTunnel

__all__ = ["FlightEnvelope", "flight_envelope"]

_HEIGHT_M: Final = 100.0
_STALL_STEP: Final = 0.93
_STALL_RESOLUTION: Final = 0.01
# Default speeds of an aircraft, as multiples of its stall speed.
_SLOWEST, _CRUISE, _FASTEST = 1.2, 1.6, 2.2


def flight_envelope(
    model: str | Path | Airframe, *, home: Home | None = None, environment: Environment | None = None
) -> FlightEnvelope:
    """Compute the flight envelope of an aircraft; a repeated call in this process returns the stored result.

    A call is repeated if the description is equal (its limits included), with files of equal content,
    engines, propellers and systems among them, in air of equal density.

    Args:
        model: as for `Vehicle`.
        home: its altitude makes the density.
        environment: only its temperature is used.

    Raises:
        AirframeError: no usable fixed-wing model, or it cannot fly; the message gives the reason.
    """
    airframe = model if isinstance(model, Airframe) else load_airframe(model)
    air = environment or Environment()
    return _envelope(airframe, home or Home(), air.temperature_offset_k, content_digest(airframe))


@lru_cache(maxsize=32)
def _envelope(airframe: Airframe, home: Home, temperature_offset_k: float, _content: str) -> FlightEnvelope:
    air = Environment(temperature_offset_k=temperature_offset_k)
    try:
        tunnel = WindTunnel(airframe, home=home, environment=air, height_m=_HEIGHT_M)
        return _Survey(tunnel).envelope()
    except (TrimError, jsbsim.BaseError) as error:
        raise AirframeError(f"vehicle '{airframe.name}' can't be trimmed: {error}") from None


class _Survey:
    """The measurements behind one envelope."""

    def __init__(self, tunnel: WindTunnel) -> None:
        self.tunnel = tunnel
        self.to_true = tunnel.true_airspeed_m_s(1.0)
        self.glides: dict[float, FlightTrim] = {}  # by equivalent airspeed
        self.limits = tunnel.airframe.limits

    def envelope(self) -> FlightEnvelope:
        tunnel, name = self.tunnel, self.tunnel.airframe.name
        stall = self.stall_speed()
        limits = self.limits
        slow, cruise, fast = _airspeeds_m_s(limits, stall)
        if not slow < cruise < fast:
            raise AirframeError(
                f"vehicle '{name}': airspeeds {slow:.1f} (min), {cruise:.1f} (trim) and {fast:.1f} (max) m/s "
                "must rise in this order"
            )
        if slow < stall:
            raise AirframeError(
                f"vehicle '{name}': airspeed_min_m_s {slow:.1f} is below its stall speed of {stall:.1f} m/s"
            )
        level = self.cruise(cruise)
        model = linearise(tunnel, level)
        self.check_controls(model)
        glide, dive = self.glide(cruise), self.glide(fast)
        climb = self.full_throttle(cruise, level) if tunnel.powered else glide
        best_speed, best = self.best_glide(slow, cruise)
        return FlightEnvelope(
            name=name,
            mass_kg=tunnel.mass_kg,
            wing_span_m=tunnel.wing_span_m,
            wing_area_m2=tunnel.wing_area_m2,
            chord_m=tunnel.chord_m,
            standing_height_m=tunnel.standing_height_m,
            density_kg_m3=tunnel.density_kg_m3,
            stall_speed_m_s=stall,
            airspeed_min_m_s=slow,
            airspeed_trim_m_s=cruise,
            airspeed_max_m_s=fast,
            powered=tunnel.powered,
            trim_throttle=level.throttle,
            trim_throttle_min_speed=self.level_throttle(slow, level),
            trim_throttle_max_speed=self.level_throttle(fast, level),
            throttle_max=limits.throttle_max if tunnel.powered else 0.0,
            trim_pitch_rad=level.pitch_rad,
            trim_angle_of_attack_rad=level.angle_of_attack_rad,
            trim_elevator=level.elevator,
            trim_aileron=level.aileron,
            trim_rudder=level.rudder,
            climb_max_m_s=climb.climb_m_s,
            sink_min_m_s=-glide.climb_m_s,
            sink_max_m_s=-dive.climb_m_s,
            glide_ratio=1.0 / math.tan(-best.climb_angle_rad),
            best_glide_speed_m_s=best_speed,
            bank_max_rad=limits.bank_max_rad,
            pitch_min_rad=limits.pitch_min_rad,
            pitch_max_rad=limits.pitch_max_rad,
            drag_n=tunnel.mass_kg * GRAVITY_M_S2 * math.sin(-glide.climb_angle_rad),
            **self.response(model, level),
        )

    def level(self, speed_m_s: float, near: FlightTrim | None = None) -> FlightTrim:
        """Level flight (a glider's glide) at an equivalent airspeed."""
        return trim_in_tunnel(self.tunnel, airspeed_m_s=speed_m_s * self.to_true, near=near)

    def cruise(self, speed_m_s: float) -> FlightTrim:
        """Level flight that it must be able to hold."""
        try:
            return self.level(speed_m_s)
        except TrimError as error:
            self.require_controls(speed_m_s)
            raise AirframeError(f"{error} ({speed_m_s:.1f} m/s equivalent, its cruise)") from None

    def level_throttle(self, speed_m_s: float, near: FlightTrim) -> float:
        """Throttle of level flight; all of it where that is not enough."""
        if not self.tunnel.powered:
            return 0.0
        try:
            return self.level(speed_m_s, near).throttle
        except TrimError:
            return 1.0

    def glide(self, speed_m_s: float, near: FlightTrim | None = None) -> FlightTrim:
        """Power-off flight at an equivalent airspeed."""
        if speed_m_s not in self.glides:
            self.glides[speed_m_s] = trim_in_tunnel(
                self.tunnel, airspeed_m_s=speed_m_s * self.to_true, throttle=0.0, near=near
            )
        return self.glides[speed_m_s]

    def full_throttle(self, speed_m_s: float, near: FlightTrim) -> FlightTrim:
        try:
            return trim_in_tunnel(
                self.tunnel,
                airspeed_m_s=speed_m_s * self.to_true,
                throttle=self.limits.throttle_max,
                near=replace(near, climb_angle_rad=0.1),
            )
        except TrimError as error:
            raise AirframeError(f"{error}, at full throttle") from None

    def stall_speed(self) -> float:
        """Lowest speed of a steady power-off glide: down from a speed at which it flies, then between."""
        tunnel = self.tunnel
        speed = self.limits.airspeed_trim_m_s
        if speed is None:  # a lift coefficient of 0.5 is within any wing's reach
            weight_n = tunnel.mass_kg * GRAVITY_M_S2
            speed = math.sqrt(weight_n / (0.5 * SEA_LEVEL_DENSITY_KG_M3 * tunnel.wing_area_m2 * 0.5))
        slowest, fastest = AIRSPEEDS_M_S
        if not slowest <= speed * self.to_true <= fastest:
            raise AirframeError(
                f"vehicle '{tunnel.airframe.name}' can't be trimmed: {tunnel.mass_kg:.3g} kg on a wing of "
                f"{tunnel.wing_area_m2:.3g} m2 fly at {speed:.3g} m/s; "
                f"accepted: {slowest:g} to {fastest:g} m/s"
            )
        try:
            flies = self.glide(speed)
        except TrimError as error:
            self.require_controls(speed)
            raise AirframeError(f"{error}, power off ({speed:.1f} m/s equivalent)") from None
        stalled = 0.0
        while speed - stalled > _STALL_RESOLUTION * speed:
            trial = speed * _STALL_STEP if stalled == 0.0 else 0.5 * (speed + stalled)
            if trial * self.to_true < slowest:
                break
            try:
                flies, speed = self.glide(trial, flies), trial
            except TrimError:
                stalled = trial
        return speed

    def best_glide(self, slow: float, cruise: float) -> tuple[float, FlightTrim]:
        """The flattest of the glides no slower than the lowest airspeed, found by golden section."""
        golden = (math.sqrt(5.0) - 1.0) / 2.0
        low, high = slow, cruise * 1.2
        near = self.glide(cruise)
        for _ in range(6):
            first, second = high - golden * (high - low), low + golden * (high - low)
            try:
                flatter = self.glide(first, near).climb_angle_rad > self.glide(second, near).climb_angle_rad
            except TrimError:
                flatter = True
            low, high = (low, second) if flatter else (first, high)
        self.glide(slow, near)
        allowed = [item for item in self.glides.items() if item[0] >= slow]
        speed, best = max(allowed, key=lambda item: item[1].climb_angle_rad)
        if best.climb_angle_rad >= 0.0:
            raise AirframeError(
                f"vehicle '{self.tunnel.airframe.name}' does not sink with the throttle closed "
                f"({best.climb_m_s:.1f} m/s at {speed:.1f} m/s): its description leaves thrust or lift on"
            )
        return speed, best

    def require_controls(self, speed_m_s: float) -> None:
        """Raise the reason of a failed trim where a control moves nothing at this equivalent airspeed."""
        airspeed_m_s = speed_m_s * self.to_true
        if dead := dead_controls(control_effects(self.tunnel, airspeed_m_s), airspeed_m_s):
            raise AirframeError(f"vehicle '{self.tunnel.airframe.name}' can't be trimmed: {dead}")

    def check_controls(self, model: LinearModel) -> None:
        """Every control must do something, and in the right direction."""
        checks = (
            (Role.AILERON, model.b[P, 0], "rolls left", "right"),
            (Role.ELEVATOR, model.b[Q, 1], "pitches the nose down", "up"),
            (Role.RUDDER, model.b[R, 3], "turns the nose left", "right"),
            (Role.THROTTLE, model.b[U, 2], "slows it down", "faster"),
        )
        name = self.tunnel.airframe.name
        for role, effect, wrong, right in checks:
            if role not in self.tunnel.actuators.roles:
                if role in (Role.AILERON, Role.ELEVATOR):
                    raise AirframeError(f"vehicle '{name}' has no {role}: [actuators] must name its property")
                continue
            if abs(effect) < LEAST_EFFECT:
                raise AirframeError(
                    f"vehicle '{name}': its {role} does nothing at cruise; its property in [actuators] may "
                    "be the wrong one"
                )
            if effect < 0.0:
                raise AirframeError(
                    f"vehicle '{name}': positive {role} {wrong}, which should be {right}; turn the sign of "
                    "its scale in [actuators] round"
                )

    def response(self, model: LinearModel, level: FlightTrim) -> dict[str, float]:
        a, b, speed = model.a, model.b, level.airspeed_m_s
        pitch = -np.linalg.solve(a[np.ix_((W, Q), (W, Q))], b[(W, Q), 1])
        yaw = -np.linalg.solve(a[np.ix_((V, R), (V, R))], b[(V, R), 3])
        density = self.tunnel.density_kg_m3
        pressure_area_n = 0.5 * density * speed**2 * self.tunnel.wing_area_m2
        return {
            "roll_rate_per_aileron_rad_s": float(-b[P, 0] / a[P, P]),
            "roll_time_constant_s": model.roll.time_constant_s,
            "pitch_acceleration_per_elevator_rad_s2": float(b[Q, 1]),
            "pitch_rate_per_elevator_rad_s": float(pitch[1]),
            "load_factor_per_elevator": float(pitch[1]) * speed / GRAVITY_M_S2,
            "short_period_frequency_rad_s": model.short_period.frequency_rad_s,
            "short_period_damping": model.short_period.damping,
            "yaw_acceleration_per_rudder_rad_s2": float(b[R, 3]),
            "yaw_rate_per_rudder_rad_s": float(yaw[1]),
            "sideslip_per_rudder_rad": float(yaw[0]) / speed,
            "dutch_roll_frequency_rad_s": model.dutch_roll.frequency_rad_s,
            "dutch_roll_damping": model.dutch_roll.damping,
            "spiral_time_constant_s": model.spiral.time_constant_s,
            "thrust_per_throttle_n": float(b[U, 2]) * self.tunnel.mass_kg,
            "lift_slope_per_rad": float(-a[W, W]) * self.tunnel.mass_kg * speed / pressure_area_n,
        }


def _airspeeds_m_s(limits: FlightLimits, stall_m_s: float) -> tuple[float, float, float]:
    """Lowest, cruise and highest equivalent airspeed, with those that the description leaves open."""
    cruise = limits.airspeed_trim_m_s or _CRUISE * stall_m_s
    slow = limits.airspeed_min_m_s or min(_SLOWEST * stall_m_s, 0.9 * cruise)
    fast = limits.airspeed_max_m_s or max(_FASTEST * stall_m_s, 1.2 * cruise)
    return slow, cruise, fast
