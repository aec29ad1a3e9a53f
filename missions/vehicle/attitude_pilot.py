"""Flight of an aircraft by bank angle from a mission; the autopilot or a loop of the mission holds the rest.

ArduPilot's plane accepts a roll command alone and holds altitude and airspeed itself. PX4 needs roll, pitch
and thrust together, so a total-energy loop of the mission computes the last two from pressure, airspeed and
climb rate. Neither needs a position.
"""

import math
from contextlib import suppress
from typing import Final

from autopilot_bridge.mavlink import dialect
from estimators.pressure_height import PressureHeight
from flightsim.foundation.atmosphere import air_density_ratio
from missions.errors import MissionError, VehicleTimeout
from missions.vehicle.adapters import Adapter
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.link import VehicleLink
from missions.vehicle.parameters import VehicleParameters
from missions.vehicle.piloting import EnergyController, EnergyParameters, EnergyState
from missions.vehicle.setpoint import AttitudeSetpoint
from missions.vehicle.stream_room import make_room
from missions.vehicle.telemetry import AirData, Attitude, Pressure

_RATES_HZ: Final = {"ATTITUDE": 40.0, "VFR_HUD": 20.0, "SCALED_PRESSURE": 20.0}
_STEP_S: Final = 0.02
_GROUND_SAMPLES: Final = 20
_GROUND_S: Final = 10.0


class AttitudePilot:
    """Height, airspeed and air data of one aircraft, and its attitude commands.

    It is created on the ground, because heights are relative to the pressure there.

    Args:
        link: messages of a fixed wing.
        adapter: its actions.
        parameters: its parameters.
        ground_pa: static pressure on the ground.
    """

    def __init__(
        self, link: VehicleLink, adapter: Adapter, parameters: VehicleParameters, ground_pa: float
    ) -> None:
        self._link = link
        self._adapter = adapter
        self._parameters = parameters
        self._pressure = PressureHeight(ground_pa)
        self._energy: EnergyController | None = None
        self._altitude_m = math.nan
        self._airspeed_m_s = math.nan
        self._last_us = -1
        self._air = link.latest(AirData)
        self._stops = [link.listen(AirData, self._on_air), link.listen(Pressure, self._on_pressure)]

    @classmethod
    async def on_ground(
        cls, commands: VehicleCommands, adapter: Adapter, parameters: VehicleParameters
    ) -> "AttitudePilot":
        """Request the needed streams, and measure the pressure on the ground.

        Raises:
            MissionError: the vehicle reports no pressure, or is in the air.
        """
        link = commands.link
        for name, rate_hz in _RATES_HZ.items():
            await commands.set_message_rate(name, rate_hz)
        await make_room(commands, {**link.firmware.stream_rates_hz, **_RATES_HZ})
        position = await link.position()
        if link.armed and position.height_m > 5.0:
            raise MissionError("the pressure on the ground must be taken before takeoff")
        total, count = 0.0, 0
        with link.messages(dialect.MAVLink_scaled_pressure_message) as stream, suppress(TimeoutError):
            async with link.deadline(_GROUND_S, "static pressure"):
                while count < _GROUND_SAMPLES:
                    message = await anext(stream)
                    total, count = total + 100.0 * message.press_abs, count + 1
        if not count:
            raise VehicleTimeout(
                f"the vehicle reports no static pressure (SCALED_PRESSURE) within {_GROUND_S:g} s; "
                f"{link.last_received()}"
            )
        return cls(link, adapter, parameters, total / count)

    def close(self) -> None:
        """Stop receiving messages."""
        for stop in self._stops:
            stop()

    def _on_air(self, air: AirData) -> None:
        self._air = air

    def _on_pressure(self, pressure: Pressure) -> None:
        if self._air is not None:
            self._pressure.add(pressure.time_us, pressure.static_pa, self._air.climb_m_s)

    @property
    def height_m(self) -> float:
        """Pressure height above the place of the ground pressure; NaN before the first sample."""
        return self._pressure.height_m

    @property
    def airspeed_true_m_s(self) -> float:
        """True airspeed; NaN when it is not reported."""
        pressure = self._link.latest(Pressure)
        air = self._link.latest(AirData)
        if pressure is None or air is None:
            return math.nan
        return air.airspeed_m_s / math.sqrt(air_density_ratio(pressure.static_pa))

    @property
    def climb_m_s(self) -> float:
        """Climb rate reported by the autopilot; 0 when it is not reported."""
        air = self._link.latest(AirData)
        return 0.0 if air is None else air.climb_m_s

    async def prepare(self, altitude_m: float, airspeed_m_s: float | None) -> None:
        """Read the aircraft's parameters that the loop needs, and set the altitude and the airspeed to be
        held.

        Args:
            altitude_m: height above the ground at the start.
            airspeed_m_s: equivalent airspeed; None: the autopilot's default.
        """
        limits = await self._parameters.limits()
        trim_m_s = getattr(limits, "airspeed_trim_m_s", math.nan)
        self._altitude_m = altitude_m
        self._airspeed_m_s = trim_m_s if airspeed_m_s is None else airspeed_m_s
        if not self._link.firmware.roll_alone:
            self._energy = EnergyController(await _energy_parameters(self._parameters))

    async def begin(self) -> None:
        """Send altitude and airspeed to an autopilot that holds them itself and is in its guided mode."""
        if self._link.firmware.roll_alone:
            await self._adapter.change_altitude(self._altitude_m)
            await self._adapter.change_airspeed(self._airspeed_m_s)

    def hold(self, *, altitude_m: float | None = None, airspeed_m_s: float | None = None) -> None:
        """Change the altitude or the airspeed of the mission's loop (PX4)."""
        self._altitude_m = self._altitude_m if altitude_m is None else altitude_m
        self._airspeed_m_s = self._airspeed_m_s if airspeed_m_s is None else airspeed_m_s

    def setpoint(self, time_us: int, roll_rad: float) -> AttitudeSetpoint:
        """The attitude setpoint for a roll angle."""
        if self._energy is None:
            return AttitudeSetpoint(roll_rad=roll_rad)
        air = self._link.latest(AirData)
        attitude = self._link.latest(Attitude)
        height_m = self.height_m
        if air is None or attitude is None or not math.isfinite(height_m):
            raise MissionError(
                "the vehicle reports no airspeed, attitude or pressure (VFR_HUD, ATTITUDE, "
                "SCALED_PRESSURE), so "
                f"altitude can't be held; {self._link.last_received()}"
            )
        dt_s = _STEP_S if self._last_us < 0 else min(0.2, max(0.0, (time_us - self._last_us) * 1e-6))
        self._last_us = time_us
        pitch_rad, throttle = self._energy.step(
            dt_s,
            EnergyState(
                height_m=height_m,
                climb_m_s=air.climb_m_s,
                airspeed_m_s=air.airspeed_m_s,
                roll_rad=attitude.roll_rad,
            ),
            height_m=self._altitude_m,
            airspeed_m_s=self._airspeed_m_s,
        )
        return AttitudeSetpoint(
            roll_rad=roll_rad, pitch_rad=pitch_rad, thrust=throttle, yaw_rad=attitude.yaw_rad
        )


async def _energy_parameters(parameters: VehicleParameters) -> EnergyParameters:
    """Parameters of the energy loop, from PX4's parameters of this aircraft."""
    get = parameters.read_or
    least, most = await get("FW_THR_MIN", 0.0), await get("FW_THR_MAX", 1.0)
    trim = min(max(await get("FW_THR_TRIM", 0.5), least + 0.02), most - 0.02)
    pitch_trim = math.radians(await get("FW_PSP_OFF", 0.0))
    lowest = math.radians(await get("FW_P_LIM_MIN", -20.0))
    highest = math.radians(await get("FW_P_LIM_MAX", 20.0))
    return EnergyParameters(
        throttle_trim=trim,
        throttle_min=max(0.0, least),
        throttle_max=min(1.0, most),
        pitch_trim_rad=min(max(pitch_trim, lowest + 0.02), highest - 0.02),
        pitch_min_rad=lowest,
        pitch_max_rad=highest,
        climb_full_throttle_m_s=max(0.5, await get("FW_T_CLMB_MAX", 5.0)),
        sink_idle_m_s=max(0.5, await get("FW_T_SINK_MIN", 2.0)),
        climb_max_m_s=max(0.3, 0.6 * await get("FW_T_CLMB_MAX", 5.0)),
        sink_max_m_s=max(0.3, await get("FW_T_SINK_MIN", 2.0)),
    )
