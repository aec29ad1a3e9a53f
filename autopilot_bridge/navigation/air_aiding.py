"""When a fixed wing's airspeed and sideslip are fused, with how much trust, and which airspeed is shown.

The rules follow PX4: airspeed above a threshold, sideslip in flight, wind alone corrected while GPS gives the
velocity, wind dead reckoning without it. Without GPS and pitot tube the airspeed is assumed to be unchanged
(as ArduPilot's EK3 does with its cruise airspeed). This is not good enough for a position, but in a turn it
prevents the filter from interpreting centripetal acceleration as tilt.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import air_fusion as a
from autopilot_bridge.navigation import covariance as cov
from autopilot_bridge.navigation.aiding_parts import AidingParts
from autopilot_bridge.navigation.layout import AIRSPEED_M_S, AIRSPEED_TRUE_M_S, WIND_NED_M_S
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.pitot import AirspeedCheck, GustVariance, Pitot
from autopilot_bridge.navigation.states import ACCEL, GRAVITY, WIND, X_POS, X_VEL, X_WIND
from autopilot_bridge.navigation.sustained_turn import SustainedTurn

Array = NDArray[np.float64]

_WIND_NE: Final = slice(WIND_NED_M_S.start, WIND_NED_M_S.start + 2)
_AIRBORNE_M: Final = 3.0  # this far from the height of the last rest, and fast: in flight
_LONGEST_ROLL_US: Final = 30_000_000  # at this speed for this time: not on a runway
_KNOWN_WIND_M_S: Final = 3.0  # 1-sigma up to which the wind is of use
_GROUND_AID_US: Final = 1_000_000  # GPS fused within this time: only the wind needs correcting
_AIR_AID_US: Final = 1_000_000
_SHORTEST_INTERVAL_S: Final = 0.01
_LONGEST_INTERVAL_S: Final = 2.0
_USUAL_TIME_S: Final = 10.0  # average of the airspeed that is assumed when it can't be measured
_STILL_SPEED_M_S: Final = 1.5  # what stands on the ground and is not being launched
_STILL_FORCE_M_S2: Final = 2.0
_QUIET_US: Final = 3_000_000  # without acceleration for this time: an estimated speed is an error


class AirAiding:
    """Fuses air data into a `Solution` with wind states, at the aiding's slow rate (5 Hz).

    Attributes:
        flying: off the ground and faster than the threshold.
        wind_us, airspeed_us, sideslip_us: when the air data last aided the velocity as a whole (pitot tube
            and sideslip both), and each was fused; -1 for never.
    """

    def __init__(self, parameters: NavigationParameters, parts: AidingParts) -> None:
        self._parameters = parameters
        self._solution, self._health = parts.solution, parts.health
        self._pitot = Pitot(parameters, readings=parts.readings)
        self._check = AirspeedCheck()
        self._turn = SustainedTurn(parameters, solution=parts.solution)
        self._airspeed_gusts = GustVariance()
        self._sideslip_gusts = GustVariance()
        self._air: Array = np.zeros(a.AIR_SIZE)
        self.restart()

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New tuning for the updates to come."""
        self._parameters = parameters
        self._pitot.set_parameters(parameters)
        self._turn.set_parameters(parameters)

    def restart(self) -> None:
        """As at boot."""
        self._pitot.restart()
        self._check.restart()
        self._turn.restart()
        self._airspeed_gusts.restart()
        self._sideslip_gusts.restart()
        self._fused_us = -1
        self._fast_since_us = -1
        self._time_us = 0
        self._quiet_since_us = -1
        self._rest_down_m = math.nan
        self._shown_m_s = math.nan
        self._usual_m_s = math.nan
        self.flying = False
        self.wind_us = self.airspeed_us = self.sideslip_us = -1

    @property
    def pitot_trusted(self) -> bool:
        """There is a pitot tube in use, alive and not found wrong."""
        used = self._parameters.use_airspeed
        return used and self._check.passed and self._pitot.alive(self._time_us)

    @property
    def relative_velocity_m_s(self) -> float:
        """Airspeed by the estimates of ground velocity and wind."""
        core = self._solution.core
        north, east = core[X_VEL] - core[X_WIND], core[X_VEL + 1] - core[X_WIND + 1]
        return math.hypot(north, east, core[X_VEL + 2])

    def aids_velocity(self, time_us: int) -> bool:
        """Pitot tube and sideslip have been fused lately."""
        return self.wind_us >= 0 and time_us - self.wind_us <= _AIR_AID_US

    def stands_still(self, time_us: int, *, gps_us: int) -> bool:
        """Speed and accelerometer agree that the vehicle is at rest: a launch is seen here before a land
        detector has made up its mind."""
        core = self._solution.core
        force = math.hypot(*core[ACCEL : ACCEL + 3].tolist())
        if abs(force - float(core[GRAVITY])) > _STILL_FORCE_M_S2:
            self._quiet_since_us = -1
            return False
        if self._quiet_since_us < 0:
            self._quiet_since_us = time_us
        speed = math.hypot(core[X_VEL], core[X_VEL + 1])
        if speed < _STILL_SPEED_M_S:
            return True
        if gps_us >= 0 and time_us - gps_us <= _GROUND_AID_US:
            return False  # the speed is a measured one
        blown = self.pitot_trusted and self._pitot.true_m_s > self._parameters.airspeed_threshold_m_s
        return not blown and time_us - self._quiet_since_us > _QUIET_US

    def look(self, time_us: int) -> None:
        """Take the pitot tube's newest sample if it is a new one."""
        self._time_us = time_us
        self._pitot.look(time_us)

    def update(self, time_us: int, *, at_rest: bool, gps_us: int, drifting: bool) -> int:
        """Fuse what there is; returns what was accepted and soundness (`air_fusion`).

        Args:
            at_rest: the vehicle stands on the ground.
            gps_us: when GPS was last fused; -1 for never.
            drifting: neither GPS nor air data have given a velocity for long.
        """
        self._time_us = time_us
        solution, p, pitot = self._solution, self._parameters, self._pitot
        pitot.update_density(trusted=self.pitot_trusted)
        self._set_wind_walk()
        self._turn.update()
        self._judge_flight(at_rest)
        speed = self.relative_velocity_m_s
        measured = pitot.true_m_s
        alive = p.use_airspeed and pitot.alive(time_us)
        row = solution.row_at(pitot.sample_us - round(p.airspeed_lag_s * 1e6), time_us) if alive else -1
        fast = not at_rest and speed > p.airspeed_threshold_m_s
        todo = 0
        # standing in a wind, the pitot tube is right and the wind not known yet: judged in flight only
        if row >= 0 and not at_rest and (self.flying or fast):
            todo |= a.JUDGE_AIRSPEED
            if self._check.passed and measured > p.airspeed_threshold_m_s:
                todo |= a.HAS_AIRSPEED
        if p.use_sideslip and self.flying and fast:
            todo |= a.HAS_SIDESLIP
        on_gps = gps_us >= 0 and time_us - gps_us <= _GROUND_AID_US
        if on_gps and self._health.magnetometer_in_use:
            todo |= a.WIND_ONLY
        assumed = drifting and self.flying and not todo & a.HAS_AIRSPEED and not math.isnan(self._usual_m_s)
        if assumed:
            todo |= a.HAS_AIRSPEED
            row = solution.row
        self._prepare(time_us, self._usual_m_s if assumed else measured, speed, assumed=assumed)
        accepted = a.update(
            solution.p, solution.core, solution.history, solution.work, self._air, max(row, 0), todo
        )
        self._take_results(time_us, todo, accepted, alive=alive, assumed=assumed)
        return accepted

    def _set_wind_walk(self) -> None:
        """The wind changes with height, so faster in a climb."""
        p, solution = self._parameters, self._solution
        climb = abs(float(solution.core[X_VEL + 2]))
        walk = p.wind_walk_m_s_sqrt_s * (1.0 + p.wind_height_scale * climb)
        solution.process[cov.WIND_WALK] = walk * walk

    def _judge_flight(self, at_rest: bool) -> None:
        speed = self.relative_velocity_m_s
        if self.pitot_trusted:
            speed = max(speed, self._pitot.true_m_s)
        down_m = float(self._solution.core[X_POS + 2])
        fast = speed > self._parameters.airspeed_threshold_m_s
        if at_rest or not fast:
            self._fast_since_us = -1
        elif self._fast_since_us < 0:
            self._fast_since_us = self._time_us
        if at_rest or math.isnan(self._rest_down_m):
            self._rest_down_m = down_m
            self.flying = False
        elif self.flying:
            self.flying = speed > 0.5 * self._parameters.airspeed_threshold_m_s
        elif fast:
            rolled_us = self._time_us - self._fast_since_us
            self.flying = abs(down_m - self._rest_down_m) > _AIRBORNE_M or rolled_us > _LONGEST_ROLL_US

    def _prepare(self, time_us: int, measured_m_s: float, speed_m_s: float, *, assumed: bool) -> None:
        p, air = self._parameters, self._air
        interval_s = (time_us - self._fused_us) * 1e-6 if self._fused_us >= 0 else _LONGEST_INTERVAL_S
        interval_s = min(max(interval_s, _SHORTEST_INTERVAL_S), _LONGEST_INTERVAL_S)
        correlation_s = p.turbulence_length_m / max(speed_m_s, p.airspeed_threshold_m_s)
        colour = 1.0 + 2.0 * correlation_s / interval_s
        noise = p.assumed_airspeed_noise_m_s if assumed else p.airspeed_noise_m_s
        gate_var = noise * noise + self._airspeed_gusts.variance
        air[a.AIRSPEED] = measured_m_s
        air[a.AIRSPEED_GATE_VAR] = gate_var
        air[a.AIRSPEED_VAR] = gate_var * colour
        noise = p.sideslip_noise_rad * speed_m_s
        gate_var = noise * noise + self._sideslip_gusts.variance
        air[a.SIDESLIP_GATE_VAR] = gate_var
        air[a.SIDESLIP_VAR] = gate_var * colour
        air[a.GATE_AIRSPEED] = p.airspeed_gate
        air[a.GATE_SIDESLIP] = p.sideslip_gate

    def _take_results(self, time_us: int, todo: int, accepted: int, *, alive: bool, assumed: bool) -> None:
        p, air, health = self._parameters, self._air, self._health
        interval_s = (time_us - self._fused_us) * 1e-6 if self._fused_us >= 0 else 0.0
        judged = todo & a.JUDGE_AIRSPEED and not assumed
        if self._pitot.sample_us >= 0:
            self._check.update(
                p,
                time_us,
                alive=alive,
                innovation_m_s=float(air[a.AIRSPEED_INNOVATION]) if judged else math.nan,
                sigma_m_s=math.sqrt(max(0.0, float(air[a.AIRSPEED_STATE_VAR]))),
            )
        if accepted & a.ACCEPTED_AIRSPEED and not assumed:
            self.airspeed_us = time_us
            self._airspeed_gusts.add(
                float(air[a.AIRSPEED_INNOVATION]),
                p.airspeed_noise_m_s**2,
                float(air[a.AIRSPEED_STATE_VAR]),
                interval_s,
            )
        if accepted & a.ACCEPTED_SIDESLIP:
            self.sideslip_us = time_us
            self._sideslip_gusts.add(
                float(air[a.SIDESLIP_INNOVATION]),
                (p.sideslip_noise_rad * self.relative_velocity_m_s) ** 2,
                float(air[a.SIDESLIP_STATE_VAR]),
                interval_s,
            )
            if accepted & a.ACCEPTED_AIRSPEED and not assumed:
                self.wind_us = time_us
        self._fused_us = time_us
        health.airspeed_test_ratio = float(air[a.AIRSPEED_RATIO]) if judged else 0.0

    def write(self, state: Array, interval_s: float) -> None:
        """Wind and airspeed into the navigation state; `interval_s` since the last time."""
        p, pitot, health = self._parameters, self._pitot, self._health
        core = self._solution.core
        measured = self.pitot_trusted
        synthetic = not measured and (self.flying or health.velocity_horizontal)
        health.airspeed_valid, health.airspeed_synthetic = measured, synthetic
        if measured or synthetic:
            ratio = pitot.true_per_equivalent
            newest = pitot.equivalent_m_s if measured else self.relative_velocity_m_s / ratio
            if math.isnan(self._shown_m_s):
                self._shown_m_s = newest
            self._shown_m_s += (newest - self._shown_m_s) * min(1.0, interval_s / p.airspeed_smoothing_s)
            state[AIRSPEED_M_S] = self._shown_m_s
            state[AIRSPEED_TRUE_M_S] = true = self._shown_m_s * ratio
            if self.flying and (measured or health.velocity_horizontal):
                if math.isnan(self._usual_m_s):
                    self._usual_m_s = true
                self._usual_m_s += (true - self._usual_m_s) * min(1.0, interval_s / _USUAL_TIME_S)
        else:
            self._shown_m_s = math.nan
            state[AIRSPEED_M_S] = state[AIRSPEED_TRUE_M_S] = math.nan
        if health.wind_valid:
            state[_WIND_NE] = core[X_WIND : X_WIND + 2]
            state[_WIND_NE.stop] = 0.0
        else:
            state[WIND_NED_M_S] = math.nan

    def report(self, time_us: int) -> None:
        """The air data's part of `health`."""
        p, health = self._solution.p, self._health
        north, east = float(p[WIND, WIND]), float(p[WIND + 1, WIND + 1])
        health.wind_variance_m2_s2 = (north, east)
        known = max(north, east) < _KNOWN_WIND_M_S**2
        health.wind_valid = known and max(self.airspeed_us, self.sideslip_us) >= 0
        health.airspeed_in_use = self.airspeed_us >= 0 and time_us - self.airspeed_us <= _AIR_AID_US
        health.sideslip_in_use = self.sideslip_us >= 0 and time_us - self.sideslip_us <= _AIR_AID_US
        health.wind_dead_reckoning = health.dead_reckoning and self.aids_velocity(time_us)
