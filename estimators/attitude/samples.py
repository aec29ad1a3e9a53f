"""Inertial messages in SI units, and their quirks.

RAW_IMU is what SCALED_IMU is on ArduPilot (milli-g, mrad/s); PX4 sends HIGHRES_IMU, in SI units, and none of
the others by itself. ArduPilot sends SCALED_IMU3 with zeros where there is no third sensor: no sample at all.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from estimators.attitude.parameters import ImuSource
from estimators.messages import Message

__all__ = ["DIFFERENTIAL_PRESSURE", "INERTIAL_FIELDS", "SAMPLES", "Sample"]

Sample = tuple[float, float, float, float, float, float]
"""Angular rate in rad/s, specific force in m/s^2, FRD."""

STANDARD_GRAVITY_M_S2: Final = 9.80665
_MILLI_G: Final = 1e-3 * STANDARD_GRAVITY_M_S2
_MILLI: Final = 1e-3
INERTIAL_FIELDS: Final = 0b111111
"""Rates and forces in HIGHRES_IMU.fields_updated."""
DIFFERENTIAL_PRESSURE: Final = 1 << 10
"""The same in it."""


def _si(m: Message) -> Sample:
    return m.xgyro, m.ygyro, m.zgyro, m.xacc, m.yacc, m.zacc


def _milli(m: Message) -> Sample:
    return (
        m.xgyro * _MILLI,
        m.ygyro * _MILLI,
        m.zgyro * _MILLI,
        m.xacc * _MILLI_G,
        m.yacc * _MILLI_G,
        m.zacc * _MILLI_G,
    )


SAMPLES: Final[Mapping[str, Callable[[Message], Sample]]] = MappingProxyType(
    {
        ImuSource.HIGHRES_IMU.value: _si,
        ImuSource.RAW_IMU.value: _milli,
        ImuSource.SCALED_IMU.value: _milli,
        ImuSource.SCALED_IMU2.value: _milli,
        ImuSource.SCALED_IMU3.value: _milli,
    }
)
"""Sample of a message by its name; best first."""
