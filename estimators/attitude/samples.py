"""Inertial messages converted to SI units.

On ArduPilot RAW_IMU has the units of SCALED_IMU (milli-g, mrad/s). PX4 sends HIGHRES_IMU, in SI units, and
none of the others by default. ArduPilot sends SCALED_IMU3 with zeros when there is no third sensor; these are
not used as samples.
"""

from collections.abc import Callable, Mapping
from operator import itemgetter
from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink import definition
from estimators.attitude.parameters import ImuSource
from estimators.messages import Message, message_class
from flightsim.foundation.atmosphere import GRAVITY_M_S2

Sample = tuple[float, float, float, float, float, float]
"""Specific force in m/s^2 and angular rate in rad/s, FRD."""

_MILLI_G: Final = 1e-3 * GRAVITY_M_S2
_MILLI: Final = 1e-3
INERTIAL_FIELDS: Final = 0b111111
"""Rates and forces in HIGHRES_IMU.fields_updated."""
DIFFERENTIAL_PRESSURE: Final = 1 << 10
"""Bit of the differential pressure in HIGHRES_IMU.fields_updated."""


def _fields(name: str) -> Callable[[Message], Sample]:
    """Reader of the six values of a message: x, y, z of the accelerometer, then of the gyro."""
    first = message_class(definition(name))._fields.index("xacc")
    return itemgetter(slice(first, first + 6))


def _scaled(name: str) -> Callable[[Message], Sample]:
    fields = _fields(name)

    def sample(message: Message) -> Sample:
        ax, ay, az, wx, wy, wz = fields(message)
        return ax * _MILLI_G, ay * _MILLI_G, az * _MILLI_G, wx * _MILLI, wy * _MILLI, wz * _MILLI

    return sample


SAMPLES: Final[Mapping[str, Callable[[Message], Sample]]] = MappingProxyType(
    {
        source.value: _fields(source.value) if source is ImuSource.HIGHRES_IMU else _scaled(source.value)
        for source in ImuSource
        if source is not ImuSource.AUTO
    }
)
"""Function that makes a sample of a message, by the message's name; best first."""
