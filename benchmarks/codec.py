"""The codec against pymavlink, both in this run: times per message, and how many times faster.

python -m benchmarks.codec
"""

import random
import sys
import timeit
from collections.abc import Callable

from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, MAVLinkMessage, decode

REPEATS = 5
LOOPS = 20_000
MESSAGES = {
    "ATTITUDE": dialect.MAVLink_attitude_message(1000, 0.1, -0.2, 3.0, 0.01, 0.02, 0.03),
    "GLOBAL_POSITION_INT": dialect.MAVLink_global_position_int_message(
        1000, 473977420, 85455940, 488000, 10000, 120, -40, 3, 9000
    ),
    "STATUSTEXT": dialect.MAVLink_statustext_message(6, b"Takeoff detected"),
    "ODOMETRY": dialect.MAVLink_odometry_message(
        1000,
        1,
        12,
        1.0,
        2.0,
        -3.0,
        [1.0, 0.0, 0.0, 0.0],
        0.1,
        0.2,
        0.3,
        0.0,
        0.0,
        0.0,
        [0.1] * 21,
        [0.2] * 21,
    ),
}


def microseconds(action: Callable[[], object]) -> float:
    """Best time of one call."""
    return min(timeit.repeat(action, number=LOOPS, repeat=REPEATS)) / LOOPS * 1e6


def compare(name: str, message: MAVLinkMessage) -> str:
    """One line of the table."""
    encoder, parser = FrameEncoder(1, 1), FrameParser()
    mav = dialect.MAVLink(None, 1, 1)
    raw = encoder.encode(message)
    (frame,) = parser.feed(raw)
    pack = microseconds(lambda: encoder.encode(message))
    pack_theirs = microseconds(lambda: message.pack(mav))
    parse = microseconds(lambda: parser.feed(raw))
    both = microseconds(lambda: decode(parser.feed(raw)[0]))
    both_theirs = microseconds(lambda: mav.parse_buffer(raw))
    payload = microseconds(lambda: encoder.encode_payload(frame.message_id, frame.payload))
    return (
        f"{name:<20} {payload:8.2f} {pack:8.2f} {pack_theirs:10.2f} {pack_theirs / pack:6.1f}x"
        f" {parse:8.2f} {both:8.2f} {both_theirs:10.2f} {both_theirs / both:6.1f}x"
    )


def junk_megabytes_per_second() -> float:
    """Parser throughput on random bytes."""
    junk = random.Random(1).randbytes(4 << 20)
    seconds = min(timeit.repeat(lambda: FrameParser().feed(junk), number=1, repeat=REPEATS))
    return len(junk) / seconds / 1e6


def main() -> None:
    """Print the table."""
    lines = [
        "microseconds per message      (encode_payload: frame of a packed payload; parse: frame only)",
        f"{'':<20} {'payload':>8} {'encode':>8} {'pymavlink':>10} {'':>7}"
        f" {'parse':>8} {'+decode':>8} {'pymavlink':>10}",
        *(compare(name, message) for name, message in MESSAGES.items()),
        f"random bytes through the parser: {junk_megabytes_per_second():.0f} MB/s",
    ]
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
