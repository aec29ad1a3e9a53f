"""Which measurement is fused when, and what happens when one is missing or refused.

The rules follow PX4's EKF2 control: GPS after its quality checks, position held where it was without
horizontal aiding, resets when a good sensor has been refused for long, height from GPS and barometer
together.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.geodesy import GeodeticPosition, LocalFrame
from autopilot_bridge.navigation import fusion as f
from autopilot_bridge.navigation.air_aiding import AirAiding
from autopilot_bridge.navigation.alignment import magnetic_heading_rad, tilt_from_accel
from autopilot_bridge.navigation.earth import pressure_altitude_m
from autopilot_bridge.navigation.external import ExternalSample
from autopilot_bridge.navigation.external_aiding import ExternalAiding
from autopilot_bridge.navigation.gps_quality import GpsQuality
from autopilot_bridge.navigation.heading_check import HeadingCheck
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.pressure_scale import PressureScale
from autopilot_bridge.navigation.report import Clocks, report
from autopilot_bridge.navigation.solution import UNKNOWN_VELOCITY_M_S, Solution
from autopilot_bridge.navigation.standby import Standby
from autopilot_bridge.navigation.states import (
    X_BARO_OFFSET,
    X_POS,
    X_VEL,
    R,
)
from autopilot_bridge.navigation.terrain import TerrainEstimator, update_terrain
from flightsim.interface import (
    BARO_PRESSURE_PA,
    GPS_ALT_M,
    GPS_EPH_M,
    GPS_EPV_M,
    GPS_LAT_DEG,
    GPS_LON_DEG,
    GPS_SPEED_ACCURACY_M_S,
    GPS_VEL_NED_M_S,
    SensorReadings,
)
from flightsim.magnetics import magnetic_field_ned_gauss

Array = NDArray[np.float64]

HAS_RANGE: Final = 64
_SLOW_RATE_HZ: Final = 5  # position hold and rest updates (PX4: 5 Hz)
_REPORT_RATE_HZ: Final = 10
_GAP_US: Final = 2_000_000  # silence after which a sensor's refusal is counted from the beginning
_CONTRADICTION_MEMORY_US: Final = 10_000_000
_TOO_MANY_CONTRADICTIONS: Final = 4  # within that time of each other: the estimate is worth nothing
_GROUND_SILENCE_US: Final = 1_000_000  # no GPS for this long: air data take over


class Aiding:
    """Turns readings into updates of a `Solution`.

    Attributes:
        air: airspeed, sideslip and wind; None unless on a fixed wing.
        external: odometry by messages; None before any has come.
        frame: NED frame at the origin; None before it is set.
        at_rest: the vehicle stands still on the ground.
    """

    __slots__ = (
        "_baro_known",
        "_clocks",
        "_contradicted_us",
        "_contradictions",
        "_gps_height_known",
        "_heading",
        "_health",
        "_mag_ned",
        "_parameters",
        "_pressure_scale",
        "_quality",
        "_readings",
        "_rejoining",
        "_report_every",
        "_slow_every",
        "_solution",
        "_standby",
        "_terrain",
        "_tick",
        "air",
        "at_rest",
        "external",
        "frame",
    )

    def __init__(
        self,
        parameters: NavigationParameters,
        *,
        readings: SensorReadings,
        solution: Solution,
        health: NavigationHealth,
    ) -> None:
        self._parameters = parameters
        self._readings = readings
        self._solution = solution
        self._health = health
        self._quality = GpsQuality(parameters)
        self._terrain = TerrainEstimator(parameters)
        self._standby = Standby(solution, health)
        self._slow_every = max(1, parameters.covariance_rate_hz // _SLOW_RATE_HZ)
        self._report_every = max(1, parameters.covariance_rate_hz // _REPORT_RATE_HZ)
        self._mag_ned: Array | None = None
        if parameters.mag_ned_gauss is not None:
            self._mag_ned = np.array(parameters.mag_ned_gauss)
        self.frame: LocalFrame | None = None
        self._heading = HeadingCheck()
        self._pressure_scale = PressureScale()
        self.external: ExternalAiding | None = None
        self.air: AirAiding | None = None
        if parameters.fixed_wing:
            self.air = AirAiding(parameters, readings=readings, solution=solution, health=health)
        self.restart()

    def restart(self) -> None:
        """As at boot, but for the origin and what follows from it."""
        self._clocks = Clocks()
        self._quality.restart()
        self._terrain.restart()
        self._baro_known = False
        self._gps_height_known = False
        self._standby.restart()
        self._heading.restart()
        self._pressure_scale.restart()
        self._rejoining = False
        self._contradictions = 0
        self._contradicted_us = 0
        self._tick = 0
        self.at_rest = False
        if self.air is not None:
            self.air.restart()
        if self.external is not None:
            self.external.restart(self._clocks)
        obs = self._solution.obs
        obs[:] = 0.0
        self._tune()
        if self._mag_ned is not None:
            obs[f.MAG_NED : f.MAG_NED + 3] = self._mag_ned

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New tuning for the updates to come; what was decided and learnt until now stays."""
        self._parameters = parameters
        self._quality.set_parameters(parameters)
        self._terrain.set_parameters(parameters)
        if self.air is not None:
            self.air.set_parameters(parameters)
        if self.external is not None:
            self.external.set_parameters(parameters.external)
        self._tune()

    def take_external(self, sample: ExternalSample) -> None:
        """External odometry, for the next update."""
        if self.external is None:
            self.external = ExternalAiding(
                self._parameters.external,
                solution=self._solution,
                standby=self._standby,
                health=self._health,
                clocks=self._clocks,
            )
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
        p = self._parameters
        if mag_frd_gauss is None:
            self._solution.align(roll, pitch, 0.0, yaw_sigma_rad=math.pi)
        else:
            yaw = self._take_field(mag_frd_gauss, roll, pitch)
            self._solution.align(roll, pitch, yaw, yaw_sigma_rad=p.alignment_yaw_rad)
            self._health.yaw_aligned = True
        self._clocks.aligned_us = time_us
        self._clocks.height_us = time_us

    def _take_field(self, mag_frd_gauss: Array, roll_rad: float, pitch_rad: float) -> float:
        """Yaw from the field; without a known field the one measured, with its horizontal part to the
        north."""
        heading, horizontal, down = magnetic_heading_rad(mag_frd_gauss, roll_rad, pitch_rad)
        obs = self._solution.obs
        if self._mag_ned is None:
            obs[f.MAG_NED : f.MAG_NED + 3] = horizontal, 0.0, down
            return heading
        return heading + math.atan2(self._mag_ned[1], self._mag_ned[0])

    def set_origin(self, origin: GeodeticPosition) -> None:
        """Fix the NED frame; gravity, Earth's rotation and the magnetic field follow from it."""
        self.frame = LocalFrame(origin)
        solution, p = self._solution, self._parameters
        solution.set_latitude(origin.lat_deg, origin.alt_m)
        if p.mag_ned_gauss is not None:
            return
        self._mag_ned = magnetic_field_ned_gauss(
            origin.lat_deg, origin.lon_deg, origin.alt_m, p.magnetic_year
        )
        obs = solution.obs
        before = math.atan2(obs[f.MAG_NED + 1], obs[f.MAG_NED])
        obs[f.MAG_NED : f.MAG_NED + 3] = self._mag_ned
        if self._health.yaw_aligned:
            self._turn_yaw(math.atan2(self._mag_ned[1], self._mag_ned[0]) - before)

    def _turn_yaw(self, angle_rad: float) -> None:
        self._solution.turn_yaw(angle_rad, yaw_sigma_rad=self._parameters.alignment_yaw_rad)
        self._health.yaw_resets += 1
        self._health.yaw_reset_rad = angle_rad

    def update(self, time_us: int, pending: int) -> int:
        """Fuse what is pending (bits of `fusion` and `HAS_RANGE`) at `time_us`; returns what was accepted."""
        solution, clocks, health = self._solution, self._clocks, self._health
        slow = self._tick % self._slow_every == 0
        if self.air is not None:
            self.air.look(time_us)
            self.at_rest = self.at_rest and self.air.stands_still(time_us, gps_us=clocks.gps_us)
        has = 0
        if slow:
            has = self._standby.prepare(
                self._parameters,
                clocks,
                time_us,
                at_rest=self.at_rest,
                winged=self.air is not None,
                flying=self.air is not None and self.air.flying,
            )
        gps_row = baro_row = mag_row = 0
        if pending & f.HAS_GPS:
            gps_row = self._prepare_gps(time_us)
            if gps_row >= 0:
                has = has & ~f.HAS_HOLD | f.HAS_GPS
        if pending & f.HAS_BARO:
            baro_row = self._prepare_baro(time_us)
            if baro_row >= 0:
                has |= f.HAS_BARO
        external = self.external
        if pending & f.HAS_MAG and (external is None or not external.heading.in_use):
            mag_row = self._prepare_mag(time_us)
            if mag_row >= 0:
                has |= f.HAS_MAG
        before = solution.core[X_VEL : X_POS + 2].copy() if self._rejoining else None
        accepted = f.update(
            solution.p,
            solution.core,
            solution.history,
            solution.work,
            solution.obs,
            solution.process,
            has,
            gps_row,
            baro_row,
            mag_row,
        )
        if accepted & f.ACCEPTED_MAG:
            clocks.mag_us = time_us
            clocks.mag_refused_us = time_us
        if accepted & f.ACCEPTED_BARO:
            self._baro_fused(time_us)
        elif has & f.HAS_BARO:
            self._baro_refused(time_us)
        if has & f.HAS_MAG and not accepted & f.ACCEPTED_MAG:
            self._mag_refused(time_us)
        if has & f.HAS_GPS:
            self._gps_fused(time_us, accepted)
            if self.air is not None:
                self._check_heading(time_us, gps_row, bool(accepted & f.ACCEPTED_GPS_VEL))
            if before is not None:
                self._rejoined(solution.core[X_VEL : X_POS + 2] - before)
        if self.air is not None and slow:
            accepted |= self._fuse_air(self.air, time_us)
        if external is not None and not external.update(time_us, at_rest=self.at_rest):
            return f.UNSOUND
        ranged = self._readings.rangefinder if pending & HAS_RANGE else None
        update_terrain(self._terrain, solution, ranged, time_us, slow=slow, at_rest=self.at_rest)
        if self._tick % self._report_every == 0:
            report(
                health,
                self._parameters,
                solution,
                clocks,
                time_us,
                held=self._standby.held,
                at_rest=self.at_rest,
            )
            self._quality.silent(time_us)
            health.gps_quality = self._quality.good
            health.rangefinder_in_use = self._terrain.in_use
            health.height_above_ground_test_ratio = self._terrain.test_ratio
            health.position_vertical_agl = self._terrain.valid(time_us)
            if self.air is not None:
                self.air.report(time_us)
            if external is not None:
                external.report(health, on_earth=self.frame is not None)
        self._tick += 1
        return f.UNSOUND if self._contradictions >= _TOO_MANY_CONTRADICTIONS else accepted

    def _prepare_gps(self, time_us: int) -> int:
        reading = self._readings.gps
        values, solution, p, obs = reading.values, self._solution, self._parameters, self._solution.obs
        usable = self._quality.judge(values, reading.time_us, time_us)
        row = solution.row_at(reading.time_us, time_us)
        if not (usable and p.use_gps) or row < 0:
            return -1
        if not self._health.yaw_aligned and not self._align_with_course(values):
            return -1
        lat, lon, alt = float(values[GPS_LAT_DEG]), float(values[GPS_LON_DEG]), float(values[GPS_ALT_M])
        if self.frame is None:
            down = float(solution.past_position(row)[2])
            self.set_origin(GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt + down))
        assert self.frame is not None
        obs[f.GPS_POS : f.GPS_POS + 3] = self.frame.ned_from_geodetic(lat, lon, alt)
        obs[f.GPS_VEL : f.GPS_VEL + 3] = values[GPS_VEL_NED_M_S]
        obs[f.GPS_DELAY_S] = max(0, time_us - reading.time_us) * 1e-6
        horizontal, vertical = p.gps_position_noise_m
        obs[f.GPS_POS_VAR] = obs[f.GPS_POS_VAR + 1] = horizontal * horizontal
        obs[f.GPS_POS_VAR + 2] = vertical * vertical
        scale = max(1.0, float(values[GPS_SPEED_ACCURACY_M_S]) / p.gps_nominal_speed_accuracy_m_s) ** 2
        for i, noise in enumerate(p.gps_velocity_noise_m_s):
            obs[f.GPS_VEL_VAR + i] = scale * noise * noise
        solution.set_gps_accuracy(float(values[GPS_EPH_M]), float(values[GPS_EPV_M]))
        clocks = self._clocks
        timeout_us = p.gps_timeout_s * 1e6
        if self._standby.held or clocks.gps_position_us < 0:
            self._reset_to_gps(row, time_us)
        elif self.air is not None and time_us - clocks.gps_judged_us > timeout_us:
            self._rejoining = True  # the covariance has grown with the error: the gate can judge it
            clocks.gps_position_us = clocks.gps_velocity_us = time_us
        elif time_us - min(clocks.gps_position_us, clocks.gps_velocity_us) > timeout_us:
            self._contradicted(time_us)
            self._reset_to_gps(row, time_us)
        if not self._gps_height_known:
            self._reset_height_to_gps(row, time_us)
        elif clocks.gps_height_refused_us >= 0 and time_us - clocks.gps_height_refused_us > timeout_us:
            self._contradicted(time_us)
            solution.forget_gps_height_error()
            self._reset_height_to_gps(row, time_us)
        return row

    def _align_with_course(self, values: Array) -> bool:
        """A wing that has no heading, for want of a magnetometer, flies about where it points; True if so."""
        north, east, _ = values[GPS_VEL_NED_M_S]
        if self.air is None or math.hypot(north, east) < self._parameters.airspeed_threshold_m_s:
            return False
        rotation = self._solution.core[R : R + 9]
        self._turn_yaw(math.atan2(east, north) - math.atan2(rotation[3], rotation[0]))
        self._health.yaw_aligned = True
        return True

    def _check_heading(self, time_us: int, row: int, accepted: bool) -> None:
        """A heading that was wrong on the ground shows in the first seconds of a flight."""
        obs, rotation = self._solution.obs, self._solution.core[R : R + 9]
        north, east = float(obs[f.GPS_VEL]), float(obs[f.GPS_VEL + 1])
        if self.at_rest:
            self._heading.restart()
        elif math.hypot(north, east) > self._parameters.airspeed_threshold_m_s:
            course, yaw = math.atan2(east, north), math.atan2(rotation[3], rotation[0])
            angle = self._heading.judge(time_us, accepted=accepted, course_rad=course, yaw_rad=yaw)
            if angle:
                self._turn_yaw(angle)
                self._reset_to_gps(row, time_us)

    def _contradicted(self, time_us: int) -> None:
        """A sensor that seems good had to be obeyed against the filter's belief."""
        if time_us - self._contradicted_us > _CONTRADICTION_MEMORY_US:
            self._contradictions = 0
        self._contradictions += 1
        self._contradicted_us = time_us

    def _reset_to_gps(self, row: int, time_us: int) -> None:
        """Horizontal position and velocity jump to the GPS; the update that follows gives them their
        variances."""
        solution, obs, health, clocks = self._solution, self._solution.obs, self._health, self._clocks
        step = obs[f.GPS_POS : f.GPS_POS + 3] - solution.past_position(row)
        change = obs[f.GPS_VEL : f.GPS_VEL + 3] - solution.past_velocity(row)
        solution.move_horizontally(float(step[0]), float(step[1]))
        solution.change_velocity(float(change[0]), float(change[1]), sigma_m_s=UNKNOWN_VELOCITY_M_S)
        self._standby.release()
        clocks.horizontal_aid_us = clocks.gps_position_us = clocks.gps_velocity_us = time_us
        health.position_resets += 1
        health.position_reset_ne_m = (float(step[0]), float(step[1]))
        health.velocity_resets += 1
        health.velocity_reset_ne_m_s = (float(change[0]), float(change[1]))

    def _rejoined(self, jump: Array) -> None:
        """The first fix after dead reckoning has moved velocity and position by what had built up."""
        health = self._health
        self._rejoining = False
        health.velocity_resets += 1
        health.velocity_reset_ne_m_s = (float(jump[0]), float(jump[1]))
        health.position_resets += 1
        health.position_reset_ne_m = (float(jump[3]), float(jump[4]))

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

    def _reset_height_to_gps(self, row: int, time_us: int) -> None:
        solution, obs = self._solution, self._solution.obs
        down = float(obs[f.GPS_POS + 2] - solution.past_position(row)[2])
        solution.move_vertically(down, with_baro=self._baro_known)
        solution.change_vertical_velocity(float(obs[f.GPS_VEL + 2] - solution.past_velocity(row)[2]))
        self._clocks.gps_height_us = time_us
        self._clocks.gps_height_refused_us = -1
        self._gps_height_known = True
        self._height_has_jumped(down)

    def _height_has_jumped(self, down_m: float) -> None:
        self._terrain.shift(down_m)
        self._health.height_resets += 1
        self._health.height_reset_down_m = down_m

    def _gps_fused(self, time_us: int, accepted: int) -> None:
        clocks, health, obs = self._clocks, self._health, self._solution.obs
        good = True
        if accepted & f.ACCEPTED_GPS_VEL:
            clocks.gps_velocity_us = clocks.horizontal_aid_us = time_us
        else:
            good = False
        if accepted & f.ACCEPTED_GPS_POS:
            clocks.gps_position_us = clocks.horizontal_aid_us = time_us
        else:
            good = False
        if accepted & f.ACCEPTED_GPS_HEIGHT:
            clocks.gps_height_us = clocks.height_us = time_us
            clocks.gps_height_refused_us = -1
        elif clocks.gps_height_refused_us < 0 or time_us - clocks.gps_judged_us > _GAP_US:
            clocks.gps_height_refused_us = time_us
        clocks.gps_judged_us = time_us
        if accepted & (f.ACCEPTED_GPS_VEL | f.ACCEPTED_GPS_POS):
            clocks.gps_us = time_us
        health.gps_glitch = not good
        health.velocity_test_ratio = float(obs[f.RATIO_VEL])
        health.position_horizontal_test_ratio = float(obs[f.RATIO_POS])

    def _prepare_baro(self, time_us: int) -> int:
        reading, solution = self._readings.barometer, self._solution
        height = pressure_altitude_m(float(reading.values[BARO_PRESSURE_PA]))
        lag_us = round(self._parameters.barometer_lag_s * 1e6)
        row = solution.row_at(reading.time_us - lag_us, time_us)
        if row < 0 or not math.isfinite(height):
            return -1
        solution.obs[f.BARO_HEIGHT] = height
        solution.obs[f.BARO_DELAY_S] = max(0, time_us - reading.time_us + lag_us) * 1e-6
        if not self._baro_known:
            self._baro_known = True
            solution.set_baro_offset(height + float(solution.past_position(row)[2]))
        return row

    def _baro_fused(self, time_us: int) -> None:
        self._clocks.baro_us = self._clocks.height_us = time_us
        height = float(self._solution.obs[f.BARO_HEIGHT])
        grown = self._pressure_scale.variance_m2(height, self._parameters.barometer_scale_error)
        if grown > 0.0:
            self._solution.widen_baro_offset(grown)

    def _baro_refused(self, time_us: int) -> None:
        """Refused for too long: with GPS heights the offset is learnt anew, without them the height jumps."""
        clocks, p, solution = self._clocks, self._parameters, self._solution
        if time_us - max(clocks.baro_us, clocks.aligned_us) <= p.height_timeout_s * 1e6:
            return
        offset = solution.obs[f.BARO_HEIGHT] + solution.core[X_POS + 2]
        if time_us - clocks.gps_height_us <= 1_000_000 and clocks.gps_height_us >= 0:
            solution.set_baro_offset(float(offset))
        else:
            down = float(solution.core[X_BARO_OFFSET] - offset)
            solution.move_vertically(down, with_baro=False)
            solution.change_vertical_velocity(-float(solution.core[X_VEL + 2]))
            self._contradicted(time_us)
            self._height_has_jumped(down)
        clocks.baro_us = time_us

    def _prepare_mag(self, time_us: int) -> int:
        reading, solution, health = self._readings.magnetometer, self._solution, self._health
        row = solution.row_at(reading.time_us, time_us)
        norm = math.hypot(*reading.values.tolist())
        if row < 0 or not 0.05 < norm < 2.0 or self._heading.magnetometer_wrong:
            return -1
        if not health.yaw_aligned:
            rotation = solution.core[R : R + 9]
            roll, pitch = math.atan2(rotation[7], rotation[8]), math.asin(max(-1.0, min(1.0, -rotation[6])))
            heading = self._take_field(reading.values, roll, pitch)
            health.yaw_aligned = True
            self._turn_yaw(heading - math.atan2(rotation[3], rotation[0]))
        solution.obs[f.MAG : f.MAG + 3] = reading.values
        return row

    def _mag_refused(self, time_us: int) -> None:
        """Refused for long while it speaks: perhaps its bias has changed, and is learnt anew."""
        clocks = self._clocks
        if (
            time_us - max(clocks.mag_refused_us, clocks.aligned_us)
            > self._parameters.magnetometer_timeout_s * 1e6
        ):
            self._solution.forget_mag_bias()
            clocks.mag_refused_us = time_us
