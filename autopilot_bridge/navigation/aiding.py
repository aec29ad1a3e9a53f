"""Which measurement is fused when, and what happens when one is missing or refused.

The rules follow PX4's EKF2 control: GPS after its quality checks, position held where it was without
horizontal aiding, resets when a good sensor has been refused for long, height from GPS and barometer
together.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import fusion as f
from autopilot_bridge.navigation.aiding_parts import AidingParts
from autopilot_bridge.navigation.air_aiding import AirAiding
from autopilot_bridge.navigation.alignment import tilt_from_accel
from autopilot_bridge.navigation.clocks import Clocks, Contradictions
from autopilot_bridge.navigation.external import ExternalSample
from autopilot_bridge.navigation.external_aiding import ExternalAiding
from autopilot_bridge.navigation.gps_aiding import GpsAiding
from autopilot_bridge.navigation.heading_aiding import HeadingAiding
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.height_aiding import HeightAiding
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.report import report
from autopilot_bridge.navigation.solution import Solution
from autopilot_bridge.navigation.standby import Standby
from autopilot_bridge.navigation.terrain import TerrainEstimator, update_terrain
from flightsim.foundation.geodesy import FrameAt, GeodeticPosition, LocalFrame
from flightsim.foundation.kernels import bound
from flightsim.interface import SensorReadings

Array = NDArray[np.float64]

HAS_RANGE: Final = 64
_SLOW_RATE_HZ: Final = 5  # position hold and rest updates (PX4: 5 Hz)
_REPORT_RATE_HZ: Final = 10
_GROUND_SILENCE_US: Final = 1_000_000  # no GPS for this long: air data take over


class Aiding:
    """Turns readings into updates of a `Solution`.

    Attributes:
        air: airspeed, sideslip and wind; None unless on a fixed wing.
        external: odometry by messages; None before any has come.
        at_rest: the vehicle stands still on the ground.
    """

    def __init__(
        self,
        parameters: NavigationParameters,
        *,
        readings: SensorReadings,
        solution: Solution,
        health: NavigationHealth,
        frame_at: FrameAt,
    ) -> None:
        self._parameters = parameters
        self._readings = readings
        self._solution = solution
        self._health = health
        self._fuse = bound(
            f.update,
            solution.p,
            solution.core,
            solution.history,
            solution.work,
            solution.obs,
            solution.process,
            then=(0, 0, 0, 0),
        )
        self._slow_every = max(1, parameters.covariance_rate_hz // _SLOW_RATE_HZ)
        self._report_every = max(1, parameters.covariance_rate_hz // _REPORT_RATE_HZ)
        self._clocks = Clocks()
        self._contradictions = Contradictions()
        self._standby = Standby(solution, self._clocks)
        self._parts = parts = AidingParts(
            readings=readings,
            solution=solution,
            health=health,
            clocks=self._clocks,
            contradictions=self._contradictions,
            standby=self._standby,
        )
        self._terrain = TerrainEstimator(parameters)
        self._heading = HeadingAiding(parameters, parts)
        self._height = HeightAiding(parameters, parts, terrain=self._terrain)
        self._gps = GpsAiding(
            parameters, parts, heading=self._heading, height=self._height, frame_at=frame_at
        )
        self.external: ExternalAiding | None = None
        self.air: AirAiding | None = None
        if parameters.fixed_wing:
            self.air = AirAiding(parameters, parts)
        self.restart()

    @property
    def frame(self) -> LocalFrame | None:
        """NED frame at the origin; None before it is set."""
        return self._gps.frame

    def restart(self) -> None:
        """As at boot, but for the origin and what follows from it."""
        self._tick = 0
        self.at_rest = False
        self._clocks.restart()
        self._contradictions.restart()
        self._solution.obs[:] = 0.0
        self._tune()
        self._standby.restart()
        self._terrain.restart()
        self._heading.restart()
        self._height.restart()
        self._gps.restart()
        if self.air is not None:
            self.air.restart()
        if self.external is not None:
            self.external.restart()

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New tuning for the updates to come; what was decided and learnt until now stays."""
        self._parameters = parameters
        self._terrain.set_parameters(parameters)
        self._heading.set_parameters(parameters)
        self._height.set_parameters(parameters)
        self._gps.set_parameters(parameters)
        if self.air is not None:
            self.air.set_parameters(parameters)
        if self.external is not None:
            self.external.set_parameters(parameters.external)
        self._tune()

    def take_external(self, sample: ExternalSample) -> None:
        """External odometry, for the next update."""
        if self.external is None:
            self.external = ExternalAiding(self._parameters.external, self._parts)
        self.external.take(sample)

    def _tune(self) -> None:
        """Variances and gates that don't depend on the measurement."""
        p, obs = self._parameters, self._solution.obs
        obs[f.BARO_VAR] = p.barometer_noise_m**2
        obs[f.MAG_VAR] = p.magnetometer_noise_gauss**2
        obs[f.REST_VEL_VAR] = p.zero_velocity_noise_m_s**2
        obs[f.REST_RATE_VAR] = p.zero_rate_noise_rad_s**2
        obs[f.GATE_GPS] = p.gps_gate
        obs[f.GATE_GPS_VEL] = p.gps_velocity_gate
        obs[f.GATE_BARO] = p.barometer_gate
        obs[f.GATE_MAG] = p.magnetometer_gate

    def align(self, time_us: int, accel_frd_m_s2: Array, mag_frd_gauss: Array | None) -> None:
        """Start the solution from the averages of a vehicle about at rest."""
        roll, pitch = tilt_from_accel(accel_frd_m_s2)
        if mag_frd_gauss is None:
            self._solution.align(roll, pitch, 0.0, yaw_sigma_rad=math.pi)
        else:
            yaw = self._heading.yaw_from_field(mag_frd_gauss, roll, pitch)
            self._solution.align(roll, pitch, yaw, yaw_sigma_rad=self._parameters.alignment_yaw_rad)
            self._health.yaw_aligned = True
        self._clocks.aligned_us = time_us
        self._clocks.height_us = time_us

    def set_origin(self, origin: GeodeticPosition) -> None:
        """Fix the NED frame; gravity, Earth's rotation and the magnetic field follow from it."""
        self._gps.set_origin(origin)

    def update(self, time_us: int, pending: int) -> int:
        """Fuse what is pending (bits of `fusion` and `HAS_RANGE`) at `time_us`; returns what was accepted."""
        solution, clocks, air, external = self._solution, self._clocks, self.air, self.external
        slow = self._tick % self._slow_every == 0
        if air is not None:
            air.look(time_us)
            self.at_rest = self.at_rest and air.stands_still(time_us, gps_us=clocks.gps_us)
        has = 0
        if slow:
            has = self._standby.prepare(
                self._parameters,
                time_us,
                at_rest=self.at_rest,
                winged=air is not None,
                flying=air is not None and air.flying,
            )
        gps_row = baro_row = mag_row = 0
        if pending & f.HAS_GPS:
            gps_row = self._gps.prepare(time_us)
            if gps_row >= 0:
                has = has & ~f.HAS_HOLD | f.HAS_GPS
        if pending & f.HAS_BARO:
            baro_row = self._height.prepare_barometer(time_us)
            if baro_row >= 0:
                has |= f.HAS_BARO
        if pending & f.HAS_MAG and (external is None or not external.heading.in_use):
            mag_row = self._heading.prepare(time_us)
            if mag_row >= 0:
                has |= f.HAS_MAG
        accepted: int = self._fuse(has, gps_row, baro_row, mag_row)
        if has & f.HAS_BARO:
            self._height.note_barometer(time_us, accepted=bool(accepted & f.ACCEPTED_BARO))
        if has & f.HAS_MAG:
            self._heading.note(time_us, accepted=bool(accepted & f.ACCEPTED_MAG))
        if has & f.HAS_GPS:
            self._gps.note(time_us, gps_row, accepted, at_rest=self.at_rest)
        if air is not None and slow:
            accepted |= self._fuse_air(air, time_us)
        if external is not None and not external.update(time_us, at_rest=self.at_rest):
            return f.UNSOUND
        ranged = self._readings.rangefinder if pending & HAS_RANGE else None
        update_terrain(self._terrain, solution, ranged, time_us, slow=slow, at_rest=self.at_rest)
        if self._tick % self._report_every == 0:
            self._report(time_us)
        self._tick += 1
        return f.UNSOUND if self._contradictions.too_many else accepted

    def _report(self, time_us: int) -> None:
        health, quality, terrain = self._health, self._gps.quality, self._terrain
        report(
            health,
            self._parameters,
            self._solution,
            self._clocks,
            time_us,
            held=self._standby.held,
            at_rest=self.at_rest,
        )
        quality.silent(time_us)
        health.gps_quality = quality.good
        health.rangefinder_in_use = terrain.in_use
        health.height_above_ground_test_ratio = terrain.test_ratio
        health.position_vertical_agl = terrain.valid(time_us)
        if self.air is not None:
            self.air.report(time_us)
        if self.external is not None:
            self.external.report(health, on_earth=self.frame is not None)

    def _fuse_air(self, air: AirAiding, time_us: int) -> int:
        """Airspeed and sideslip; without GPS they aid the velocity, and so end holding the position."""
        clocks = self._clocks
        soundness = air.update(
            time_us, at_rest=self.at_rest, gps_us=clocks.gps_us, drifting=self._standby.held
        )
        if air.wind_us == time_us and (clocks.gps_us < 0 or time_us - clocks.gps_us > _GROUND_SILENCE_US):
            clocks.horizontal_aid_us = time_us
            self._standby.release()
        return soundness & f.UNSOUND
