"""The bench for a fixed wing: pitot tube, launch crew, and the error of the wind."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import NavigationParameters
from autopilot_bridge.navigation import states as s
from estimators.tracking import metrics
from flightsim.sensors.airspeed import AirspeedParameters
from flightsim.sensors.suite import SensorSuiteParameters
from tests.navigation.bench import PARAMETERS, Bench
from tests.navigation.kinematic_wing import Wing, fly_wing

Array = NDArray[np.float64]

WING_PARAMETERS = replace(PARAMETERS, fixed_wing=True)
WING_SENSORS = SensorSuiteParameters(airspeed=AirspeedParameters())


class WingBench(Bench):
    """A `Bench` that flies a `Wing`; the rest hint ends `late_s` after the launch."""

    def __init__(
        self,
        wing: Wing,
        duration_s: float,
        *,
        seed: int = 1,
        sensors: SensorSuiteParameters = WING_SENSORS,
        parameters: NavigationParameters = WING_PARAMETERS,
        late_s: float = 0.2,
    ) -> None:
        truth = fly_wing(duration_s, wing, seed=seed)
        super().__init__(truth, seed=seed, sensors=sensors, parameters=parameters)
        self.wing = wing
        self.rest_ends_s = wing.launch_s + late_s
        self.filter.vehicle_at_rest = True

    def run(self, until_s: float, each: Callable[[], None] | None = None) -> "WingBench":
        if self.time_s < self.rest_ends_s:
            super().run(min(until_s, self.rest_ends_s), each)
            self.filter.vehicle_at_rest = self.time_s < self.rest_ends_s
        super().run(until_s, each)
        return self

    def wind_error(self) -> Array:
        """Steady wind less the estimate (2,)."""
        core = self.filter._solution.core
        return np.array(self.wing.wind_ne_m_s) - core[s.X_WIND : s.X_WIND + 2]

    def nees4(self) -> Array:
        """NEES over degrees of freedom: attitude (3), horizontal velocity, position, wind (2 each)."""
        error, wind, p = self.error(), self.wind_error(), self.filter.covariance

        def per_dof(e: Array, first: int) -> float:
            block = p[first : first + len(e), first : first + len(e)]
            return float(metrics.nees(e, block)) / len(e)

        return np.array(
            [
                per_dof(error[0:3], s.ATT),
                per_dof(error[3:5], s.VEL),
                per_dof(error[6:8], s.POS),
                per_dof(wind, s.WIND),
            ]
        )

    @property
    def tilt_deg(self) -> float:
        """Error of roll and pitch."""
        return float(np.degrees(np.hypot(*self.error()[:2])))

    @property
    def position_error_m(self) -> float:
        """Horizontal."""
        return float(np.hypot(*self.error()[6:8]))
