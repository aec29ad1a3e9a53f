"""The start files that PX4 finds in place of its own: the airframe of a vehicle, and its MAVLink links.

PX4's start script (`etc/init.d-posix/rcS`) takes the airframe by its number (`PX4_SYS_AUTOSTART`) from
`airframes/`, starts the simulator's link by `px4-rc.mavlinksim`, and the MAVLink links by `px4-rc.mavlink`.
Its `etc` is shown to it as links to the files of the build, with these three in place of its own. Values are
set as defaults, so that one that equals PX4's own default counts too, and after those of the simulator's
start file.
"""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from flightsim.airframe import AirframeKind

AIRFRAME_NUMBER: Final = 22000
"""Of the airframe: PX4 keeps 22000 and above for its users."""

_SIMULATOR: Final = "px4-rc.mavlinksim"
_LINKS: Final = "px4-rc.mavlink"
_DEFAULTS: Final[Mapping[AirframeKind, str]] = {
    AirframeKind.MULTICOPTER: "rc.mc_defaults",
    AirframeKind.FIXED_WING: "rc.fw_defaults",
}
_DATA_RATE: Final = 4_000_000  # bytes/s: no limit, as on PX4's own links of a simulation
_MODES: Final[Mapping[str, str]] = {"onboard": " -m onboard", "gcs": "", "payload": " -m onboard"}
# what PX4's own simulation sends to a ground station beside the mode's streams, Hz
_GCS_RATES: Final[Mapping[str, int]] = {
    "POSITION_TARGET_LOCAL_NED": 50,
    "LOCAL_POSITION_NED": 50,
    "GLOBAL_POSITION_INT": 50,
    "ATTITUDE": 50,
    "ATTITUDE_QUATERNION": 50,
    "ATTITUDE_TARGET": 50,
    "SERVO_OUTPUT_RAW_0": 50,
    "RC_CHANNELS": 20,
    "OPTICAL_FLOW_RAD": 10,
}


def write_start_files(
    build: Path,
    folder: Path,
    *,
    kind: AirframeKind,
    system_id: int,
    parameters: Mapping[str, float],
    links: Mapping[str, tuple[int, int]],
) -> Path:
    """Write the `etc` of one vehicle, in place of an earlier one.

    Args:
        build: PX4's build folder.
        folder: an existing folder; `etc` is made in it.
        kind: class of vehicle.
        system_id: its MAVLink system id.
        parameters: values of the airframe, by name.
        links: UDP ports by role, (of PX4, of the other end).

    Returns:
        The `etc`.
    """
    own = folder / "px4" / "etc"
    if own.exists():
        shutil.rmtree(own)
    scripts = own / "init.d-posix"
    (scripts / "airframes").mkdir(parents=True)
    for entry in (build / "etc").iterdir():
        if entry.name != scripts.name:
            (own / entry.name).symlink_to(entry)
    for entry in (build / "etc" / scripts.name).iterdir():
        if entry.name not in ("airframes", _SIMULATOR, _LINKS):
            (scripts / entry.name).symlink_to(entry)
    _write(scripts / "airframes" / f"{AIRFRAME_NUMBER}_flightstack", f". ${{R}}etc/init.d/{_DEFAULTS[kind]}")
    _write(
        scripts / _SIMULATOR,
        f". '{build / 'etc' / scripts.name / _SIMULATOR}'",
        f"param set MAV_SYS_ID {system_id}",  # its own is that of the instance
        *_set(parameters),
    )
    _write(scripts / _LINKS, *_links(links))
    return own


def _write(path: Path, *lines: str) -> None:
    path.write_text("\n".join(["#!/bin/sh", *lines, ""]), encoding="utf-8")


def _set(parameters: Mapping[str, float]) -> list[str]:
    """A whole number is written without a point: PX4 refuses one for an integer parameter."""
    return [
        f"param set-default {name} {int(value) if value == int(value) else value}"
        for name, value in parameters.items()
    ]


def _links(links: Mapping[str, tuple[int, int]]) -> list[str]:
    lines = []
    for role, (own, other) in links.items():
        lines.append(f"mavlink start -x -u {own} -r {_DATA_RATE} -o {other}{_MODES[role]}")
        if role == "gcs":
            lines += [f"mavlink stream -r {rate} -s {name} -u {own}" for name, rate in _GCS_RATES.items()]
    return lines
