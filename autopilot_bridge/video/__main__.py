"""`python -m autopilot_bridge.video CONTROL LISTEN`: the picture process, on sockets that it inherits.

It ends when the process that started it ends, for whatever reason.
"""

import asyncio
import contextlib
import signal
import socket
import sys

import cv2

from autopilot_bridge.video.messages import setup_from_json, unpack
from autopilot_bridge.video.rtsp_server import RtspServer
from autopilot_bridge.video.studio import Studio, open_line
from flightsim.foundation.operating_system import END_SIGNALS, lower_priority


async def _main(control: int, listen: int) -> None:
    reader, writer = await open_line(control)
    studio = Studio(reader, writer, setup_from_json(unpack(await reader.readline())))
    server = None
    if listen >= 0:
        rtsp = RtspServer(studio.streams)
        server = await asyncio.start_server(rtsp.accept, sock=socket.socket(fileno=listen))
    warming = asyncio.get_running_loop().create_task(studio.warm_up())
    await studio.serve()
    warming.cancel()
    with contextlib.suppress(ConnectionError):  # the vehicles' process has ended
        await writer.drain()
    if server is not None:
        server.close()


if __name__ == "__main__":
    for ending in END_SIGNALS:  # sent by a terminal; the vehicles' process handles them
        if ending != signal.SIGTERM:
            signal.signal(ending, signal.SIG_IGN)
    lower_priority()
    cv2.setNumThreads(1)
    asyncio.run(_main(int(sys.argv[1]), int(sys.argv[2])))
