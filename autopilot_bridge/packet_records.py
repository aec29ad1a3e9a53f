"""Packets of whole frames as records of a log (.tlog): compiled code splits many at once."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import frame as frames
from flightsim.foundation.kernels import kernel

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]

TIME_SIZE: Final = 8
_WHOLE: Final = -1


@kernel
def _frame_size(data: Bytes, start: int, end: int) -> int:
    """Size of the frame that begins at `start`; 0 if there is none, or if it does not end by `end`."""
    size = 0
    if end - start >= frames.OVERHEAD_V1:
        if data[start] == frames.MAGIC_V2:
            size = frames.OVERHEAD_V2 + int(data[start + 1])
            if data[start + 2] & frames.INCOMPAT_SIGNED:
                size += frames.SIGNATURE_SIZE
        elif data[start] == frames.MAGIC_V1:
            size = frames.OVERHEAD_V1 + int(data[start + 1])
    return size if start + size <= end else 0


@kernel
def _split(data: Bytes, times_us: Integers, sizes: Integers, out: Bytes) -> tuple[int, int, int, int]:
    """Write the frames of packets as records.

    Args:
        data: the packets, in sequence.
        times_us, sizes: (packets,) of each.
        out: output, large enough for a time before every shortest frame.

    Returns:
        Bytes written, records, the first packet that does not end with a frame (-1: all do), and the offset
        in it where no whole frame begins.
    """
    written, records, torn, torn_at = 0, 0, _WHOLE, 0
    end = 0
    for k in range(sizes.shape[0]):
        first = start = end
        end += sizes[k]
        while start < end:
            size = _frame_size(data, start, end)
            if size == 0:
                if torn == _WHOLE:
                    torn, torn_at = k, start - first
                break
            for i in range(TIME_SIZE):
                out[written + i] = (times_us[k] >> (56 - 8 * i)) & 0xFF
            written += TIME_SIZE
            for i in range(size):
                out[written + i] = data[start + i]
            written += size
            start += size
            records += 1
    return written, records, torn, torn_at


def packet_records(times_us: list[int], packets: list[bytes]) -> tuple[bytes, int, str]:
    """Records of the frames in packets.

    Frames are split by their lengths only; data from other sources must go through a parser first. The
    packets may contain forwarded frames of other systems, unchanged: MAVLink 1, or signed.

    Args:
        times_us: of each packet, microseconds of the Unix epoch.
        packets: each of one or more whole frames, in sequence.

    Returns:
        The records, their number, and the error of the first packet that does not end with a
        frame (empty: all do); the whole frames of such a packet are included.
    """
    data = np.frombuffer(b"".join(packets), dtype=np.uint8)
    out = np.empty(data.size + TIME_SIZE * (data.size // frames.OVERHEAD_V1), dtype=np.uint8)
    sizes = np.array([len(packet) for packet in packets], dtype=np.int64)
    written, records, torn, at = _split(data, np.array(times_us, dtype=np.int64), sizes, out)
    wrong = "" if torn == _WHOLE else f"a packet of {sizes[torn]} bytes has no whole frame at byte {at}"
    return out[:written].tobytes(), records, wrong
