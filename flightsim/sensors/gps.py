"""Satellite receiver: latency, white and correlated position error, velocity error, fix timeline."""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim import interface as i
from flightsim import truth as t
from flightsim.foundation.checks import NotNegative, Positive, Rate
from flightsim.foundation.geodesy import curvature_radii_m, longitude_near
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options
from flightsim.foundation.rotations import wrap_180
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit
from flightsim.sensors.sensor import SensorModel, gauss_markov, quantise

Array = NDArray[np.float64]

# UBX-NAV-PVT resolution
_ANGLE_QUANTUM_DEG: Final = 1e-7
_LENGTH_QUANTUM_M: Final = 1e-3
_SPEED_QUANTUM_M_S: Final = 1e-3

NO_FIX_ACCURACY_M: Final = 9999.0
NO_FIX_DOP: Final = 99.99  # UBX-NAV-DOP's largest

_WHITE: Final = 0  # north, east, up
_DECAY: Final = 3
_DRIVE: Final = 4  # north, east, up
_VELOCITY: Final = 7  # north, east, down
_EPH: Final = 10
_EPV: Final = 11
_SPEED_ACCURACY: Final = 12
_INTERVAL_S: Final = 13
_STAGES: Final = 14  # then 6 numbers per stage
_STAGE_SIZE: Final = 6  # start_s, fix type, satellites, hdop, vdop, error scale

_WANDER: Final = 0  # north, east, up
_SAMPLES: Final = 3
_STATE: Final = 4
_NORMALS: Final = 9  # white 3, velocity 3, correlated 3


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsFixStage(Options):
    """What the receiver reports from a moment on.

    Attributes:
        start_s: seconds since the suite's first step.
        fix_type: MAVLink GPS_FIX_TYPE (0 to 6).
        satellites: number used.
        hdop, vdop: dilution of precision.
        error_scale: factor on all errors and on the accuracies reported.
    """

    start_s: NotNegative
    fix_type: int
    satellites: int
    hdop: NotNegative
    vdop: NotNegative
    error_scale: NotNegative = 1.0

    def check_together(self) -> None:
        if not 0 <= self.fix_type <= 6:
            raise ValueError(f"fix_type = {self.fix_type!r} is not accepted: GPS_FIX_TYPE 0 to 6 is")
        if not 0 <= self.satellites <= 254:
            raise ValueError(f"satellites = {self.satellites!r} is not accepted: 0 to 254 is")


FIX_AT_BOOT: Final = (GpsFixStage(start_s=0.0, fix_type=3, satellites=10, hdop=0.7, vdop=1.1),)
"""PX4's simulated receiver: a 3D fix from the first message on."""

RTK_FIX_AFTER_10_S: Final = (
    GpsFixStage(start_s=9.7, fix_type=1, satellites=3, hdop=NO_FIX_DOP, vdop=NO_FIX_DOP),
    GpsFixStage(start_s=10.1, fix_type=6, satellites=10, hdop=1.21, vdop=2.0),
)
"""ArduPilot's SITL: nothing until 9.7 s, then no fix with 3 satellites, then RTK fixed at 10.1 s."""

FIX_AFTER_10_S: Final = (
    RTK_FIX_AFTER_10_S[0],
    GpsFixStage(start_s=10.1, fix_type=3, satellites=10, hdop=1.21, vdop=2.0),
)
"""The same for a receiver without corrections."""

RECEIVERS: Final = ("differential", "standalone")
"""Names of the receivers for `GpsParameters.of`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsParameters(Options):
    """A receiver with differential corrections; `GpsParameters.standalone()` is one without.

    The white part is PX4's SIH receiver (0.2 m horizontal, 0.5 m vertical; velocity 0.06, 0.077, 0.158 m/s).
    The correlated part is what corrections leave of the atmosphere and of multipath; the firmwares' own
    simulators have none (PX4's SIH) or centimetres (ArduPilot's RTK fix).

    Attributes:
        rate_hz: samples per second.
        latency_s: measurement to delivery; PX4's EKF2_GPS_DELAY default.
        horizontal_noise_m, vertical_noise_m: white, one sigma per axis.
        horizontal_wander_m, vertical_wander_m: stationary one sigma per axis of the Gauss-Markov part.
        wander_time_constant_s: its correlation time.
        velocity_noise_north_m_s, velocity_noise_east_m_s, velocity_noise_down_m_s: white, one sigma.
        reported_accuracy_scale: what the receiver reports of its accuracy over what it is.
        fix_timeline: stages by start time; before the first the receiver is silent.
    """

    rate_hz: Rate = 5
    latency_s: NotNegative = 0.11
    horizontal_noise_m: NotNegative = 0.2
    vertical_noise_m: NotNegative = 0.5
    horizontal_wander_m: NotNegative = 0.06
    vertical_wander_m: NotNegative = 0.12
    wander_time_constant_s: Positive = 100.0
    velocity_noise_north_m_s: NotNegative = 0.06
    velocity_noise_east_m_s: NotNegative = 0.077
    velocity_noise_down_m_s: NotNegative = 0.158
    reported_accuracy_scale: Positive = 1.0
    fix_timeline: tuple[GpsFixStage, ...] = FIX_AT_BOOT

    def check_together(self) -> None:
        starts = [stage.start_s for stage in self.fix_timeline]
        if starts != sorted(starts):
            raise ValueError(f"fix_timeline starts at {starts} s: accepted are stages in order of time")

    @classmethod
    def standalone(cls, **overrides: Any) -> "GpsParameters":
        """A plain u-blox M8: 2.5 m CEP (datasheet UBX-15031086), so 2.1 m per axis, nearly all correlated."""
        numbers: dict[str, Any] = {
            "horizontal_noise_m": 0.3,
            "vertical_noise_m": 0.6,
            "horizontal_wander_m": 2.1,
            "vertical_wander_m": 3.5,
            "wander_time_constant_s": 300.0,
        }
        return cls(**(numbers | overrides))

    @classmethod
    def of(cls, receiver: str, **overrides: Any) -> "GpsParameters":
        """The receiver of this name, one of `RECEIVERS`.

        Raises:
            ValueError: there is none of that name.
        """
        if receiver == "differential":
            return cls(**overrides)
        if receiver == "standalone":
            return cls.standalone(**overrides)
        raise ValueError(f"GPS receiver {receiver!r} is unknown; accepted: {', '.join(RECEIVERS)}")

    def build(self, interval_s: float, rng: np.random.Generator) -> SensorModel:
        """One specimen: draws where the correlated error starts.

        The accuracies reported are the one-sigma errors per axis: eph and epv of both parts together,
        the speed accuracy as root mean square of the three axes, each times `reported_accuracy_scale`.
        """
        white = np.array([self.horizontal_noise_m, self.horizontal_noise_m, self.vertical_noise_m])
        wander = np.array([self.horizontal_wander_m, self.horizontal_wander_m, self.vertical_wander_m])
        velocity = np.array(
            [self.velocity_noise_north_m_s, self.velocity_noise_east_m_s, self.velocity_noise_down_m_s]
        )
        reported = self.reported_accuracy_scale
        decay, unit_drive = gauss_markov(1.0, self.wander_time_constant_s, interval_s)
        stages = np.array(
            [(s.start_s, s.fix_type, s.satellites, s.hdop, s.vdop, s.error_scale) for s in self.fix_timeline],
            dtype=np.float64,
        )
        constants = np.concatenate(
            [
                white,
                [decay],
                unit_drive * wander,
                velocity,
                [reported * math.hypot(self.horizontal_noise_m, self.horizontal_wander_m)],
                [reported * math.hypot(self.vertical_noise_m, self.vertical_wander_m)],
                [reported * math.sqrt(float(np.mean(velocity**2)))],
                [interval_s],
                stages.ravel(),
            ]
        )
        state = np.zeros(_STATE)
        state[_WANDER : _WANDER + 3] = wander * rng.standard_normal(3)
        unchanged = (math.nan,) * (i.GPS_SIZE - 6)
        return SensorModel(
            kernel=_measure,
            constants=constants,
            state=state,
            normals_per_sample=_NORMALS,
            size=i.GPS_SIZE,
            fault_targets=(
                FaultTarget(
                    unit=SensorUnit.GPS,
                    channels=slice(0, i.GPS_SIZE),
                    wrong_bias=(30.0, 0.0, 0.0) + (0.0,) * (i.GPS_SIZE - 3),
                    drift_per_s=(0.5, 0.0, 0.0) + (0.0,) * (i.GPS_SIZE - 3),
                    low=(-90.0, -180.0, -1000.0, -100.0, -100.0, -100.0, *unchanged),
                    high=(90.0, 180.0, 10000.0, 100.0, 100.0, 100.0, *unchanged),
                    add_bias=add_local_bias,
                    no_fix=no_fix_values(),
                ),
            ),
        )


def no_fix_values() -> tuple[float, ...]:
    """What a receiver without a fix sends: no satellites, zero position and velocity, huge accuracies."""
    values = np.zeros(i.GPS_SIZE)
    _write_no_fix(1.0, 0.0, values)
    return tuple(values.tolist())


def add_local_bias(values: Array, bias: Array) -> None:
    """Add a bias to GPS values in place; its first three numbers are north, east and up in metres."""
    per_lat_deg, per_lon_deg = _metres_per_degree(values[i.GPS_LAT_DEG], values[i.GPS_ALT_M])
    values += bias
    values[i.GPS_LAT_DEG] += bias[0] / per_lat_deg - bias[0]
    values[i.GPS_LON_DEG] = longitude_near(values[i.GPS_LON_DEG] + (bias[1] / per_lon_deg - bias[1]))


_curvature_radii_m = kernel(curvature_radii_m)


@kernel
def _metres_per_degree(lat_deg: float, alt_m: float) -> tuple[float, float]:
    # At the poles a degree of longitude has no length; the floor keeps the division finite.
    cos_lat = max(1e-6, math.cos(math.radians(lat_deg)))
    meridian_m, normal_m = _curvature_radii_m(lat_deg)
    return math.radians(meridian_m + alt_m), math.radians((normal_m + alt_m) * cos_lat)


@kernel
def _write_no_fix(fix_type: float, satellites: float, out: Array) -> None:
    out[:] = 0.0
    out[i.GPS_EPH_M] = NO_FIX_ACCURACY_M
    out[i.GPS_EPV_M] = NO_FIX_ACCURACY_M
    out[i.GPS_SPEED_ACCURACY_M_S] = NO_FIX_ACCURACY_M
    out[i.GPS_FIX_TYPE] = fix_type
    out[i.GPS_SATELLITES] = satellites
    out[i.GPS_HDOP] = NO_FIX_DOP
    out[i.GPS_VDOP] = NO_FIX_DOP


_VEL: Final = t.VEL_NED_M_S.start
_OUT_VEL: Final = i.GPS_VEL_NED_M_S.start


@kernel
def _measure(truth: Array, constants: Array, state: Array, normals: Array, row: int, out: Array) -> bool:
    elapsed_s = state[_SAMPLES] * constants[_INTERVAL_S]
    state[_SAMPLES] += 1.0
    north_m = state[_WANDER] + constants[_WHITE] * normals[row, 0]
    east_m = state[_WANDER + 1] + constants[_WHITE + 1] * normals[row, 1]
    up_m = state[_WANDER + 2] + constants[_WHITE + 2] * normals[row, 2]
    for axis in range(3):
        state[_WANDER + axis] = (
            constants[_DECAY] * state[_WANDER + axis] + constants[_DRIVE + axis] * normals[row, 6 + axis]
        )

    stage = -1
    # A microsecond of slack: sample times are sums of a rounded interval.
    for s in range(_STAGES, constants.size, _STAGE_SIZE):
        if constants[s] <= elapsed_s + 1e-6:
            stage = s
    if stage < 0:
        return False
    fix_type, satellites = constants[stage + 1], constants[stage + 2]
    if fix_type < 2.0:
        _write_no_fix(fix_type, satellites, out)
        return True

    scale = constants[stage + 5]
    lat_deg = math.degrees(truth[t.LAT_RAD])
    alt_m = truth[t.ALT_M]
    per_lat_deg, per_lon_deg = _metres_per_degree(lat_deg, alt_m)
    lon_deg = wrap_180(math.degrees(truth[t.LON_RAD]) + scale * east_m / per_lon_deg)
    out[i.GPS_LAT_DEG] = quantise(lat_deg + scale * north_m / per_lat_deg, _ANGLE_QUANTUM_DEG)
    out[i.GPS_LON_DEG] = quantise(lon_deg, _ANGLE_QUANTUM_DEG)
    out[i.GPS_ALT_M] = quantise(alt_m + scale * up_m, _LENGTH_QUANTUM_M)
    for axis in range(3):
        out[_OUT_VEL + axis] = quantise(
            truth[_VEL + axis] + scale * constants[_VELOCITY + axis] * normals[row, 3 + axis],
            _SPEED_QUANTUM_M_S,
        )
    out[i.GPS_EPH_M] = scale * constants[_EPH]
    out[i.GPS_EPV_M] = scale * constants[_EPV]
    out[i.GPS_SPEED_ACCURACY_M_S] = scale * constants[_SPEED_ACCURACY]
    out[i.GPS_FIX_TYPE] = fix_type
    out[i.GPS_SATELLITES] = satellites
    out[i.GPS_HDOP] = constants[stage + 3]
    out[i.GPS_VDOP] = constants[stage + 4]
    return True
