"""`flightstack sitl`: simulated vehicles for external clients."""

from pathlib import Path
from typing import Final

import click

from autopilot_bridge.video.parameters import VideoParameters
from missions.base.run_options import ServedWorldOptions
from missions.cli.declared_options import declared_options
from missions.cli.later import body_in
from missions.cli.options import FIRMWARE_HELP, STRICT_HELP, WORLD_HELP
from missions.cli.signing import key_option
from missions.cli.view_option import view_option

_BODIES: Final = "missions.cli.bodies.sitl"


_DECLARED: Final = (*declared_options(ServedWorldOptions), *declared_options(VideoParameters))


@click.command(params=[*_DECLARED, key_option()])
@click.option("--world", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE", help=WORLD_HELP)
@click.option("--firmware", metavar="NAME[=BUILD]", help=FIRMWARE_HELP)
@click.option(
    "--link",
    "links",
    multiple=True,
    help="Link with onboard streams instead of the usual ports; with --count, all vehicles share it.",
)
@click.option("--gcs-link", "gcs_links", multiple=True, help="Link with ground-station streams.")
@click.option("--camera", is_flag=True, help="Every vehicle carries a camera on a gimbal.")
@click.option(
    "--target",
    "targets",
    multiple=True,
    metavar="NORTH,EAST[,SPEED,HEADING]",
    help="Target on the ground for cameras: m from home, m/s and degrees. Repeat for more.",
)
@click.option(
    "--map",
    "map_file",
    metavar="FILE",
    help="Magnetic map (.npz, as `fly occupancy` publishes it); every vehicle carries a survey magnetometer.",
)
@click.option(
    "--map-target",
    metavar="NORTH,EAST",
    help="Place of a target's magnetic signature, m from the map's home.",
)
@click.option(
    "--signing-store",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="File that keeps keys that clients set, and times, over restarts.",
)
@click.option(
    "--video",
    metavar="[HOST:]PORT|off",
    help="Address of the cameras' video (RTSP). [default: 127.0.0.1, from port 8554 on]",
)
@click.option(
    "--pictures",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="New folder for photos and videos that the cameras take.",
)
@click.option(
    "--storage",
    metavar="DIR|none",
    help="Folder that keeps the vehicles' memory cards: logs, parameters, plans, files. "
    "none: in memory, no logs. [default: a temporary folder, gone at the end]",
)
@click.option("--params", type=click.Path(dir_okay=False), help="Parameter file (.params or .parm).")
@click.option("--strict-params", is_flag=True, help=STRICT_HELP)
@click.option("--log", metavar="FILE", help="New .tlog for what the vehicles say, and the truth.")
@view_option()
@click.option(
    "--firmware-logs",
    type=click.Path(path_type=Path, file_okay=False, exists=True),
    metavar="FOLDER",
    help="Folder for the logs of a real firmware (.ulg, .bin) and what it prints.",
)
@click.option(
    "--ready-file",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="File with the lines of the links, made when they are open, and removed at the end.",
)
@click.option("--no-wait", is_flag=True, help="ArduPilot: don't wait for a client on the first port.")
@body_in(_BODIES)
def sitl() -> None:
    """Simulated vehicles (SITL) for external clients: QGroundControl, MAVSDK, MAVProxy, DroneKit, mavutil.

    Opens the ports that clients of the firmware use by default, prints them, and runs until Ctrl-C.

    Exit codes: 0 stopped, 1 a vehicle failed, or the log, a picture or the signing keys could not be
    written, 2 usage, 130 interrupted while it started.
    """
