"""Serves a lossless video to the first player that connects, once: a process of its own, because FFmpeg waits
for the player.

    python -m tests.estimators.vision.stream_server PORT FILE FIRST LAST [ROUNDS]
"""

import sys
import time
from fractions import Fraction

import av

from estimators.vision.video import frames_of

PERIOD_S = 0.1


def serve(port: int, file: str, first: int, last: int, rounds: int = 1) -> None:
    """Send some pictures, again and again, at 10 Hz."""
    pictures = [frame.pixels for frame in frames_of(file)][first:last]
    height, width = pictures[0].shape[:2]
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    with av.open(f"tcp://127.0.0.1:{port}?listen=1", "w", format="nut") as container:
        stream = container.add_stream("ffv1", rate=10)
        stream.width, stream.height, stream.pix_fmt = width, height, "bgr0"
        stream.codec_context.time_base = Fraction(1, 1000)
        for number, pixels in enumerate(pictures * rounds):
            frame = av.VideoFrame.from_ndarray(pixels, format="bgr24")
            frame.pts, frame.time_base = 100 * number, Fraction(1, 1000)
            for packet in stream.encode(frame):
                container.mux(packet)
            time.sleep(PERIOD_S)
        for packet in stream.encode(None):
            container.mux(packet)


if __name__ == "__main__":
    port, file, *numbers = sys.argv[1:]
    serve(int(port), file, *map(int, numbers))
