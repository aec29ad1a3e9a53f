"""Parameters of external data: odometry (EKF2_EV_*, VISO_*, EK3_SRC1_*), and the source of the first GPS."""

from enum import Enum, auto
from typing import Final

from autopilot_bridge.firmware.mapping import FieldMap, build, integer
from autopilot_bridge.navigation.external_parameters import ExternalParameters
from autopilot_bridge.parameters import ParameterStore
from flightsim.interface import GPS_SIZE, Reading, SensorReadings

EXTERNAL_NAV: Final = 6
"""ExternalNav, of EK3_SRC1_*."""

_MS: Final = 1e-3
_PX4: Final = (
    FieldMap("position_noise_m", "EKF2_EVP_NOISE"),
    FieldMap("velocity_noise_m_s", "EKF2_EVV_NOISE"),
    FieldMap("yaw_noise_rad", "EKF2_EVA_NOISE"),
    FieldMap("position_gate", "EKF2_EVP_GATE"),
    FieldMap("velocity_gate", "EKF2_EVV_GATE"),
    FieldMap("yaw_gate", "EKF2_HDG_GATE"),
    FieldMap("delay_s", "EKF2_EV_DELAY", _MS),
)
_ARDUPILOT: Final = (
    FieldMap("position_noise_m", "VISO_POS_M_NSE"),
    FieldMap("velocity_noise_m_s", "VISO_VEL_M_NSE"),
    FieldMap("yaw_noise_rad", "VISO_YAW_M_NSE"),
    FieldMap("position_gate", "EK3_POS_I_GATE", 0.01),
    FieldMap("velocity_gate", "EK3_VEL_I_GATE", 0.01),
    FieldMap("delay_s", "VISO_DELAY_MS", _MS),
    FieldMap("scale", "VISO_SCALE"),
)
_POSITION: Final = 1
_HEIGHT: Final = 2
_VELOCITY: Final = 4
_YAW: Final = 8
_VISION: Final = 3  # of EKF2_HGT_REF

_NONE: Final = 0
_MAV: Final = 14


class GpsSource(Enum):
    """Where fixes come from."""

    SENSOR = auto()
    MESSAGES = auto()
    NONE = auto()


def own_receiver(store: ParameterStore) -> GpsSource:
    """PX4 takes no fixes by messages."""
    return GpsSource.SENSOR


def ardupilot_gps_source(store: ParameterStore) -> GpsSource:
    """GPS1_TYPE: 0 none, 14 MAVLink, all others the receiver on board."""
    kind = integer(store, "GPS1_TYPE")
    return {_NONE: GpsSource.NONE, _MAV: GpsSource.MESSAGES}.get(kind, GpsSource.SENSOR)


def connected(readings: SensorReadings, source: GpsSource) -> SensorReadings:
    """The readings with the receiver that the autopilot listens to; the others are the same objects."""
    if source is GpsSource.SENSOR:
        return readings
    chosen = SensorReadings()
    for name in SensorReadings.__slots__:
        setattr(chosen, name, getattr(readings, name))
    chosen.gps = Reading(GPS_SIZE)
    return chosen


def px4_external(store: ParameterStore) -> ExternalParameters:
    """EKF2_EV_*, EKF2_EVA_*, EKF2_EVP_*, EKF2_EVV_*, EKF2_HGT_REF."""
    control = integer(store, "EKF2_EV_CTRL")
    return build(
        ExternalParameters,
        store,
        _PX4,
        use_position=bool(control & _POSITION),
        use_height=bool(control & _HEIGHT),
        use_velocity=bool(control & _VELOCITY),
        use_yaw=bool(control & _YAW),
        height_reference=integer(store, "EKF2_HGT_REF") == _VISION,
        own_noise=integer(store, "EKF2_EV_NOISE_MD") == 1,
        least_quality=int(store.limited("EKF2_EV_QMIN")),
        offset_frd_m=_offset(store, "EKF2_EV_POS_"),
    )


def ardupilot_external(store: ParameterStore) -> ExternalParameters:
    """VISO_*, EK3_SRC1_*: a source of 6 is ExternalNav."""

    def external(name: str) -> bool:
        return integer(store, name) == EXTERNAL_NAV

    height = external("EK3_SRC1_POSZ")
    return build(
        ExternalParameters,
        store,
        _ARDUPILOT,
        use_position=external("EK3_SRC1_POSXY"),
        use_height=height,
        use_velocity=external("EK3_SRC1_VELXY"),
        use_yaw=external("EK3_SRC1_YAW"),
        height_reference=height,
        least_quality=int(store.limited("VISO_QUAL_MIN")),
        offset_frd_m=_offset(store, "VISO_POS_"),
    )


def _offset(store: ParameterStore, prefix: str) -> tuple[float, float, float]:
    x, y, z = (store.limited(prefix + axis) for axis in "XYZ")
    return x, y, z
