"""Gains of the attitude filter chosen on three of the four recorded logs, and the errors on the fourth.

    python -m benchmarks.attitude_gains --logs FOLDER

FOLDER has px4_plane_mission, arduplane_loiter, px4_quad_offboard and arducopter_guided (.tlog). For each
gain k_p, with k_I = k_p^2 / 4, every log is replayed; the error is the mean squared error of roll plus
that of pitch against the autopilot, in the air. For each log the gain is chosen that has the least mean
logarithm of the errors of the other three, and its error is shown beside the one of the default gains.
"""

import argparse
import sys
from functools import partial
from pathlib import Path

import numpy as np

from estimators.attitude import AttitudeEstimator, AttitudeParameters
from estimators.comparison import comparisons
from estimators.log_replay import replay
from estimators.logs import open_log

LOGS = ("px4_plane_mission", "arduplane_loiter", "px4_quad_offboard", "arducopter_guided")
GAINS_1_S = (0.06, 0.08, 0.095, 0.11, 0.13, 0.16, 0.2)


def error_deg2(file: Path, parameters: AttitudeParameters) -> float:
    """Mean squared error of roll plus that of pitch against the autopilot."""
    found = replay(open_log(file), partial(AttitudeEstimator, parameters))
    (runner,) = found.fleet.runners.values()
    (compared,) = comparisons(found.logs, runner)
    errors = [compared.errors("autopilot", f"{angle}_rad")[compared.counted] for angle in ("roll", "pitch")]
    return sum(float(np.nanmean(np.degrees(error) ** 2)) for error in errors)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--logs", type=Path, required=True, metavar="FOLDER")
    files = [parser.parse_args().logs / f"{name}.tlog" for name in LOGS]
    absent = [str(file) for file in files if not file.is_file()]
    if absent:
        parser.error(f"{', '.join(absent)} not found")
    default = np.array([error_deg2(file, AttitudeParameters()) for file in files])
    errors = np.array(
        [
            [
                error_deg2(file, AttitudeParameters(gain_1_s=gain, bias_gain_1_s2=0.25 * gain * gain))
                for file in files
            ]
            for gain in GAINS_1_S
        ]
    )
    write = sys.stdout.write
    write(f"{'error, deg^2, by gain k_p, 1/s':30s}" + "".join(f"{gain:8.3f}" for gain in GAINS_1_S) + "\n")
    for k, name in enumerate(LOGS):
        write(f"{name:30s}" + "".join(f"{error:8.3f}" for error in errors[:, k]) + "\n")
    write(f"\n{'log left out':30s} {'gain':>7s} {'error':>7s} {'default':>8s}\n")
    for k, name in enumerate(LOGS):
        others = np.log(np.delete(errors, k, axis=1)).mean(axis=1)
        best = int(others.argmin())
        write(f"{name:30s} {GAINS_1_S[best]:7.3f} {errors[best, k]:7.3f} {default[k]:8.3f}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
