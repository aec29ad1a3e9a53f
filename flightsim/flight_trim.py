"""Steady flight of a fixed-wing aircraft: its figures and its geometry."""

import math
from dataclasses import dataclass

import numpy as np

from flightsim.foundation.rotations import quaternion_from_euler, rotate
from flightsim.initial_state import InitialState
from flightsim.interface import AILERON, ELEVATOR, MAX_ACTUATORS, RUDDER, THROTTLE
from flightsim.wind_tunnel import FlightState


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightTrim:
    """Steady flight.

    Attributes:
        airspeed_m_s: true airspeed.
        angle_of_attack_rad, sideslip_rad: of the body's x axis.
        roll_rad, pitch_rad: attitude.
        climb_angle_rad: of the path through the air.
        turn_rate_rad_s: positive to the right.
        aileron, elevator, rudder, throttle: commands, -1..1 and 0..1.
        rotor_rad_s: speeds of propellers the description names.
        voltage_v, current_a: at the battery's terminals; NaN for an aircraft without.
        residual_m_s2, residual_rad_s2: largest accelerations left over.
    """

    airspeed_m_s: float
    angle_of_attack_rad: float
    sideslip_rad: float
    roll_rad: float
    pitch_rad: float
    climb_angle_rad: float
    turn_rate_rad_s: float
    aileron: float
    elevator: float
    rudder: float
    throttle: float
    rotor_rad_s: tuple[float, ...]
    voltage_v: float
    current_a: float
    residual_m_s2: float
    residual_rad_s2: float

    @property
    def climb_m_s(self) -> float:
        """Rate of climb."""
        return self.airspeed_m_s * math.sin(self.climb_angle_rad)

    @property
    def actuators(self) -> tuple[float, ...]:
        """Commands in the order of `flightsim.interface`."""
        values = [0.0] * MAX_ACTUATORS
        values[AILERON], values[ELEVATOR] = self.aileron, self.elevator
        values[THROTTLE], values[RUDDER] = self.throttle, self.rudder
        return tuple(values)

    def initial_state(self, *, height_m: float, yaw_rad: float = 0.0) -> InitialState:
        """A start in this flight, in still air, the actuators where they should be."""
        q, vel_ned = np.empty(4), np.empty(3)
        state = self.state
        quaternion_from_euler(self.roll_rad, self.pitch_rad, yaw_rad, q)
        rotate(q, np.array(state.vel_frd_m_s), vel_ned)
        north, east, down = vel_ned.tolist()
        return InitialState(
            height_m=height_m,
            vel_ned_m_s=(north, east, down),
            roll_rad=self.roll_rad,
            pitch_rad=self.pitch_rad,
            yaw_rad=yaw_rad,
            rates_frd_rad_s=state.rates_frd_rad_s,
            actuators=self.actuators,
        )

    @property
    def state(self) -> FlightState:
        """The state of motion."""
        return flight_state(
            self.airspeed_m_s,
            self.angle_of_attack_rad,
            self.sideslip_rad,
            self.roll_rad,
            self.climb_angle_rad,
            self.turn_rate_rad_s,
            self.actuators,
        )


def flight_pitch_rad(alpha: float, beta: float, bank: float, climb: float) -> float:
    """Pitch of a flight path that climbs by an angle (Stevens and Lewis, eq. 3.6-3)."""
    a = math.cos(alpha) * math.cos(beta)
    b = math.sin(bank) * math.sin(beta) + math.cos(bank) * math.sin(alpha) * math.cos(beta)
    rise = math.sin(climb)
    root = math.sqrt(max(0.0, a * a - rise * rise + b * b))
    return math.atan2(a * b + rise * root, a * a - rise * rise)


def flight_state(
    airspeed: float,
    alpha: float,
    beta: float,
    bank: float,
    climb: float,
    rate: float,
    commands: tuple[float, ...],
) -> FlightState:
    """State of steady flight: true airspeed, flow angles, bank, climb angle, rate of turn, commands."""
    pitch = flight_pitch_rad(alpha, beta, bank, climb)
    return FlightState(
        vel_frd_m_s=(
            airspeed * math.cos(alpha) * math.cos(beta),
            airspeed * math.sin(beta),
            airspeed * math.sin(alpha) * math.cos(beta),
        ),
        rates_frd_rad_s=(
            -rate * math.sin(pitch),
            rate * math.sin(bank) * math.cos(pitch),
            rate * math.cos(bank) * math.cos(pitch),
        ),
        roll_rad=bank,
        pitch_rad=pitch,
        actuators=commands,
    )
