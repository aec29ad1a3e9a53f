"""Flying by the sticks: PX4's manual modes and ArduPlane's."""

import math
from enum import IntEnum
from typing import ClassVar, Final

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.fixed_wing.base import AircraftTask, GuidedPath
from autopilot_bridge.flight.fixed_wing.line import Line
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.task import TaskStatus, clear_setpoint

_LEVEL_WINGS_RAD: Final = math.radians(8.0)  # banked less than this, released sticks lock the course
_LOCK_WAIT_S: Final = 0.5  # ArduPlane CRUISE: so long after the stick is released


class ManualMode(IntEnum):
    """What the sticks mean."""

    MANUAL = 0  # surfaces and throttle, past all control
    STABILIZED = 1  # bank, pitch angle, throttle (PX4; ArduPlane's FBWA is alike)
    ACRO = 2  # body rates and throttle
    ALTITUDE = 3  # bank, climb rate, airspeed (PX4)
    POSITION = 4  # ALTITUDE that holds the course over ground with the stick centred (PX4)
    FBWA = 5  # bank, pitch angle, throttle (ArduPlane)
    FBWB = 6  # bank, climb rate, airspeed (ArduPlane)
    CRUISE = 7  # FBWB that holds the ground track with the sticks centred (ArduPlane)
    TRAINING = 8  # surfaces, within the limits of bank and pitch (ArduPlane)


def stick(value: float, parameters: FixedWingFlightParameters) -> float:
    """Stick with dead zone and cubic expo, -1..1."""
    dead = parameters.manual_deadzone
    if abs(value) <= dead:
        return 0.0
    live = math.copysign((abs(value) - dead) / (1.0 - dead), value)
    expo = parameters.manual_expo
    return (1.0 - expo) * live + expo * live**3


def throttle_of(value: float) -> float:
    """Throttle 0..1 of a stick -1..1."""
    return 0.5 * (min(1.0, max(-1.0, value)) + 1.0)


def stick_airspeed(value: float, parameters: FixedWingFlightParameters) -> float:
    """Airspeed of a throttle stick -1..1: the middle is trim (PX4), the ends are the limits."""
    p = parameters
    if value < 0.0:
        return p.airspeed_trim_m_s + value * (p.airspeed_trim_m_s - p.airspeed_min_m_s)
    return p.airspeed_trim_m_s + value * (p.airspeed_max_m_s - p.airspeed_trim_m_s)


_HEIGHT_MODES: Final = frozenset(
    {ManualMode.ALTITUDE, ManualMode.POSITION, ManualMode.FBWB, ManualMode.CRUISE}
)


class ManualTask(AircraftTask):
    """Flies what the pilot's sticks say. Without a pilot: wings level, height held, at the trim airspeed.

    Args:
        kind: what the sticks mean.
    """

    works_on_ground: ClassVar[bool] = True

    def __init__(self, kind: ManualMode) -> None:
        super().__init__()
        self.kind = kind
        self._path = GuidedPath()
        self._line = Line()
        self._locked = False
        self._held_s = 0.0
        self._down_m = math.nan

    def _begin(self, ctx: FlightContext) -> None:
        self._down_m = math.nan
        self._locked = False
        self._held_s = 0.0

    def _fly(self, ctx: FlightContext) -> TaskStatus:
        sticks, kind = ctx.sticks, self.kind
        if not sticks.valid:
            self._fly_level(ctx)
        elif kind is ManualMode.MANUAL:
            self._write_surfaces(ctx, sticks.roll, -sticks.pitch, sticks.yaw)
        elif kind is ManualMode.TRAINING:
            self._fly_training(ctx)
        elif kind is ManualMode.ACRO:
            self._fly_rates(ctx)
        elif kind in _HEIGHT_MODES:
            self._fly_height(ctx)
        else:
            self._fly_attitude(ctx)
        return TaskStatus.RUNNING

    def _fly_level(self, ctx: FlightContext) -> None:
        """No stick input: no thrust on the ground, straight and level in the air."""
        if ctx.on_ground:
            clear_setpoint(ctx.setpoint, sp.IDLE)
            self._down_m = math.nan
            return
        command = self._command
        if self._down_m != self._down_m:
            self._down_m = self._state.down_m
        command.roll_rad = 0.0
        command.down_m = self._down_m
        command.write(ctx)

    def _write_surfaces(self, ctx: FlightContext, roll: float, pitch: float, yaw: float) -> None:
        setpoint = ctx.setpoint
        clear_setpoint(setpoint, sp.SURFACES_DIRECT)
        setpoint[sp.SURFACES] = (roll, pitch, yaw)
        setpoint[sp.THROTTLE] = throttle_of(ctx.sticks.throttle)

    def _fly_training(self, ctx: FlightContext) -> None:
        """Surfaces, until a limit is passed; from there bank or pitch are held at the limit."""
        p, state, sticks = ctx.fixed_wing, self._state, ctx.sticks
        banked = abs(state.roll_rad) > p.manual_bank_max_rad and state.roll_rad * sticks.roll >= 0.0
        up = -sticks.pitch
        too_high = state.pitch_rad > p.manual_pitch_max_rad and up >= 0.0
        too_low = state.pitch_rad < -p.manual_pitch_down_max_rad and up <= 0.0
        if not (banked or too_high or too_low):
            self._write_surfaces(ctx, sticks.roll, up, sticks.yaw)
            return
        command = self._command
        command.roll_rad = math.copysign(min(abs(state.roll_rad), p.manual_bank_max_rad), state.roll_rad)
        command.pitch_rad = min(p.manual_pitch_max_rad, max(-p.manual_pitch_down_max_rad, state.pitch_rad))
        if not banked:
            command.roll_rad += stick(sticks.roll, p) * _LEVEL_WINGS_RAD
        command.throttle = throttle_of(sticks.throttle)
        command.yaw_stick = sticks.yaw
        command.write(ctx)

    def _fly_rates(self, ctx: FlightContext) -> None:
        p, sticks, setpoint = ctx.fixed_wing, ctx.sticks, ctx.setpoint
        clear_setpoint(setpoint, sp.RATES)
        setpoint[sp.RATES_FRD_RAD_S] = (
            stick(sticks.roll, p) * p.acro_roll_rate_rad_s,
            -stick(sticks.pitch, p) * p.acro_pitch_rate_rad_s,
            stick(sticks.yaw, p) * p.acro_yaw_rate_rad_s,
        )
        setpoint[sp.THROTTLE] = throttle_of(sticks.throttle)

    def _stick_bank(self, ctx: FlightContext) -> float:
        return stick(ctx.sticks.roll, ctx.fixed_wing) * ctx.fixed_wing.manual_bank_max_rad

    def _fly_attitude(self, ctx: FlightContext) -> None:
        p, sticks, command = ctx.fixed_wing, ctx.sticks, self._command
        up = -stick(sticks.pitch, p)
        command.roll_rad = self._stick_bank(ctx)
        command.pitch_rad = p.trim_pitch_rad + up * (
            p.manual_pitch_max_rad if up > 0.0 else p.manual_pitch_down_max_rad
        )
        command.pitch_rad = min(p.manual_pitch_max_rad, max(-p.manual_pitch_down_max_rad, command.pitch_rad))
        command.throttle = throttle_of(sticks.throttle)
        command.yaw_stick = sticks.yaw
        command.write(ctx)

    def _fly_height(self, ctx: FlightContext) -> None:
        p, state, sticks, command = ctx.fixed_wing, self._state, ctx.sticks, self._command
        if ctx.on_ground and throttle_of(sticks.throttle) < 0.1:
            clear_setpoint(ctx.setpoint, sp.IDLE)
            self._begin(ctx)
            return
        up = -stick(sticks.pitch, p)
        if up != 0.0:
            self._down_m = math.nan
            command.height_rate_m_s = up * (p.climb_rate_m_s if up > 0.0 else p.sink_rate_m_s)
        else:
            if self._down_m != self._down_m:
                self._down_m = state.down_m
            command.down_m = self._down_m
        command.airspeed_m_s = stick_airspeed(stick(sticks.throttle, p), p)
        command.yaw_stick = sticks.yaw
        bank = self._stick_bank(ctx)
        centred = bank == 0.0 and (self.kind is not ManualMode.CRUISE or abs(sticks.yaw) <= p.manual_deadzone)
        holds_course = self.kind in (ManualMode.POSITION, ManualMode.CRUISE) and ctx.position_valid
        self._held_s = self._held_s + ctx.dt_s if centred else 0.0
        if not (centred and holds_course):
            self._locked = False
        elif not self._locked and abs(state.roll_rad) < _LEVEL_WINGS_RAD and self._held_s > _LOCK_WAIT_S:
            self._locked = True
            self._line.begin(state, state.course_rad)
        if self._locked:
            self._line.follow(state, self._path.of(ctx), command)
        else:
            command.roll_rad = bank
        command.write(ctx)
