"""CRC-16/MCRF4XX, MAVLink's checksum, for compiled code.

It processes eight bytes at a time with tables (Sarwate's method, sliced by eight). The MAVLink guide calls it
X.25.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

Int = int | np.integer[Any]
"""An integer, in compiled code or outside it."""

_POLYNOMIAL: Final = 0x8408  # 0x1021 with its bits reversed
_SLICES: Final = 8


def _tables() -> NDArray[np.uint16]:
    tables = np.zeros((_SLICES, 256), dtype=np.uint16)
    for byte in range(256):
        value = byte
        for _ in range(8):
            value = (value >> 1) ^ (_POLYNOMIAL if value & 1 else 0)
        tables[0, byte] = value
    for step in range(1, _SLICES):
        last = tables[step - 1]
        tables[step] = (last >> 8) ^ tables[0, last & 0xFF]
    return tables


TABLES: Final = _tables()
_T0, _T1, _T2, _T3, _T4, _T5, _T6, _T7 = (np.ascontiguousarray(table) for table in TABLES)


@kernel
def checksum(data: NDArray[np.uint8], start: Int, stop: Int, extra: Int) -> np.uint32:
    """Checksum of data[start:stop] and one more byte."""
    crc = np.uint32(0xFFFF)
    at = np.uint64(start)
    end = np.uint64(stop)
    eight = np.uint64(8)
    while at + eight <= end:
        crc = (
            np.uint32(_T7[np.uint8(data[at]) ^ np.uint8(crc)])
            ^ np.uint32(_T6[np.uint8(data[at + np.uint64(1)]) ^ np.uint8(crc >> np.uint32(8))])
            ^ np.uint32(_T5[data[at + np.uint64(2)]])
            ^ np.uint32(_T4[data[at + np.uint64(3)]])
            ^ np.uint32(_T3[data[at + np.uint64(4)]])
            ^ np.uint32(_T2[data[at + np.uint64(5)]])
            ^ np.uint32(_T1[data[at + np.uint64(6)]])
            ^ np.uint32(_T0[data[at + np.uint64(7)]])
        )
        at += eight
    while at < end:
        crc = (crc >> np.uint32(8)) ^ np.uint32(_T0[np.uint8(crc) ^ np.uint8(data[at])])
        at += np.uint64(1)
    return (crc >> np.uint32(8)) ^ np.uint32(_T0[np.uint8(crc) ^ np.uint8(extra)])
