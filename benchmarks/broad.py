"""The attitude filter without a model of motion on BROAD, beside VQF: RMS errors over the phases of motion.

    python -m benchmarks.broad --data FOLDER

BROAD (Laidig, Caruso, Cereatti, Seel, Data 6 (7), 2021; CC BY 4.0; github.com/dlaidig/broad) has inertial
and optical records of a unit moved by hand, with breaks, vibration and magnets. FOLDER is its `data_mat`.
Trials of which the file is absent are left out; the last line has their number.

The errors are BROAD's: the angle of the rotation from the optical to the estimated attitude (total), its
part about the vertical (heading) and the rest (inclination), root mean square while the unit moves, then
the mean of the trials. The filter estimates no heading, so it has the inclination only. The samples are
messages (HIGHRES_IMU of an armed rover), and the attitude is read from the estimates, as for any vehicle.
VQF (PyPI `vqf`, where it is installed) runs with its defaults and each sample as it is: `6D` without,
`9D` with the magnetometer.

It ends with 1 when the mean inclination error is greater than VQF's 6D, or than 0.73 degrees without VQF.
"""

import argparse
import importlib
import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.io
from numpy.typing import NDArray

from autopilot_bridge.mavlink import definition, dialect
from estimators.attitude import AttitudeEstimator
from estimators.messages import message_class

TRIALS = 39
BOUND_DEG = 0.73

Array = NDArray[np.float64]


class Trial(NamedTuple):
    """A record: force (N, 3), m/s^2; rate (N, 3), rad/s; magnetic field (N, 3), uT; optical attitude (N, 4),
    w x y z, world (z up) from body; whether the unit moves (N,); Hz."""

    name: str
    force: Array
    rate: Array
    field: Array
    attitude: Array
    moves: NDArray[np.bool_]
    rate_hz: float


def trials(folder: Path) -> Iterator[Trial]:
    """Read the records one by one."""
    for file in sorted(folder.glob("*.mat")):
        data = scipy.io.loadmat(file, squeeze_me=True)
        yield Trial(
            name=file.stem,
            force=np.ascontiguousarray(data["imu_acc"]),
            rate=np.ascontiguousarray(data["imu_gyr"]),
            field=np.ascontiguousarray(data["imu_mag"]),
            attitude=data["opt_quat"],
            moves=data["movement"].astype(bool),
            rate_hz=float(data["sampling_rate"]),
        )


def up_in_body(attitude: Array) -> Array:
    """Unit vector up in the body (N, 3), from a quaternion world from body."""
    w, x, y, z = attitude.T
    return np.stack((2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)), axis=1)


def rms_deg(errors_rad: Array, trial: Trial) -> float:
    """Root mean square over the motion, where the optical attitude is known."""
    return float(np.degrees(np.sqrt(np.nanmean(errors_rad[trial.moves] ** 2))))


def inclination_rad(up: Array, trial: Trial) -> Array:
    """Angle between the estimated and the optical direction up."""
    distance = np.linalg.norm(up - up_in_body(trial.attitude), axis=1)
    return 2.0 * np.arcsin(np.clip(0.5 * distance, 0.0, 1.0))


def ours(trial: Trial) -> tuple[float, float]:
    """Inclination error, degrees; and its square over the stated variance, for each of the two axes."""
    estimator = AttitudeEstimator()
    heartbeat: Any = message_class(definition("HEARTBEAT"))
    heartbeat_fields = {field.name: 0 for field in definition("HEARTBEAT").wire_fields}
    kind = {"type": dialect.MAV_TYPE_GROUND_ROVER, "base_mode": dialect.MAV_MODE_FLAG_SAFETY_ARMED}
    estimator.handle(0, heartbeat(1, 1, **(heartbeat_fields | kind)))
    sample: Any = message_class(definition("HIGHRES_IMU"))
    fields = {field.name: 0 for field in definition("HIGHRES_IMU").wire_fields} | {"fields_updated": 63}
    names = ("xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro")
    up, variance = np.full((len(trial.force), 3), np.nan), np.full(len(trial.force), np.nan)
    for k, values in enumerate(np.hstack((trial.force, trial.rate)).tolist()):
        time_us = round((k + 1) * 1e6 / trial.rate_hz)
        fields.update(zip(names, values, strict=True))
        estimator.handle(time_us, sample(1, 1, **(fields | {"time_usec": time_us})))
        (estimate,) = estimator.estimates
        roll, pitch = estimate.roll_rad, estimate.pitch_rad
        up[k] = np.sin(pitch), -np.cos(pitch) * np.sin(roll), -np.cos(pitch) * np.cos(roll)
        variance[k] = estimate.roll_variance_rad2 + estimate.pitch_variance_rad2
    errors_rad = inclination_rad(up, trial)
    return rms_deg(errors_rad, trial), float(np.nanmean((errors_rad**2 / variance)[trial.moves]))


def vqf(trial: Trial) -> tuple[float, float, float, float]:
    """Inclination (6D), then total, heading and inclination (9D), degrees."""
    peer: Any = importlib.import_module("vqf")
    found = peer.VQF(1.0 / trial.rate_hz).updateBatch(trial.rate, trial.force, trial.field)
    w, x, y, z = found["quat9D"].T
    o_w, o_x, o_y, o_z = (trial.attitude * (1.0, -1.0, -1.0, -1.0)).T
    difference_w = w * o_w - x * o_x - y * o_y - z * o_z
    difference_z = w * o_z + x * o_y - y * o_x + z * o_w
    return (
        rms_deg(inclination_rad(up_in_body(found["quat6D"]), trial), trial),
        rms_deg(2.0 * np.arccos(np.clip(np.abs(difference_w), 0.0, 1.0)), trial),
        rms_deg(2.0 * np.arctan(np.abs(difference_z / difference_w)), trial),
        rms_deg(inclination_rad(up_in_body(found["quat9D"]), trial), trial),
    )


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, metavar="FOLDER", help="BROAD's data_mat")
    folder = parser.parse_args().data
    peer = importlib.util.find_spec("vqf") is not None
    write = sys.stdout.write
    write(f"{'RMS error, deg':42s} {'attitude':>8s}  {'over':>5s}  {'VQF 6D':>8s}  {'VQF 9D':>8s}\n")
    write(f"{'':42s} {'inclin.':>8s}  {'var.':>5s}  {'inclin.':>8s}")
    write(f"  {'total':>8s} {'heading':>8s} {'inclin.':>8s}\n")
    rows: list[tuple[float, ...]] = []
    for trial in trials(folder):
        rows.append((*ours(trial), *(vqf(trial) if peer else (np.nan,) * 4)))
        write(line(trial.name, rows[-1]))
        sys.stdout.flush()
    if not rows:
        parser.error(f"{folder} has no .mat file of BROAD")
    means = tuple(np.mean(rows, axis=0).tolist())
    write(line(f"mean of {len(rows)} of {TRIALS} trials", means))
    return int(means[0] > (means[2] if peer else BOUND_DEG))


def line(name: str, row: tuple[float, ...]) -> str:
    """A row of the table."""
    own, normalised, six, total, heading, inclination = row
    nine = f"{total:8.3f} {heading:8.3f} {inclination:8.3f}"
    return f"{name:42s} {own:8.3f}  {normalised:5.2f}  {six:8.3f}  {nine}\n"


if __name__ == "__main__":
    sys.exit(main())
