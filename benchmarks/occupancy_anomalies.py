"""False anomalies and targets found by the detector of `occupancy`, over maps with the errors of a survey.

    python benchmarks/occupancy_anomalies.py [--seeds 8] [--km 44] [--errors 1 2.5] [--trusting]

Every seed makes a true field and a survey of it. A track of random turns crosses it without a target, then 12
straight passes cross a target of each kind at 0, 20, 40 and 60 m. Readings have the noise and drift of a
survey magnetometer. `--errors` multiplies the survey's noise, levelling and diurnal errors; `--trusting`
takes the map for the truth.
"""

import argparse
import math
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.occupancy.detection import Anomaly, AnomalyDetector, MapError
from estimators.tracking.metrics import rms
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    DipoleSignature,
    GaussianSignature,
    MagneticField,
    MagneticMap,
    Signature,
    SurveyParameters,
    SyntheticMapParameters,
    surveyed,
    synthetic_map,
)

Array = NDArray[np.float64]

HALF_M = 1600.0
HEIGHT_M = 80.0
STEP_M = 2.5  # 25 m/s, 10 readings a second
TURN_M = 100.0  # least radius
NOISE_NT, DRIFT_NT, DRIFT_READINGS = 0.2, 0.2, 6000.0
TARGET_NE_M = (300.0, -200.0)
NEAR_M = 150.0
OFFSETS_M = (0.0, 20.0, 40.0, 60.0)
COURSES = 3
PASS_M = 1400.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A true field, and what is published of it."""

    seed: int
    truth: MagneticMap
    published: MagneticMap
    trusting: bool

    def detector(self) -> AnomalyDetector:
        """As a mission sets it."""
        error_nt, spacing_m = self.published.error_nt or 0.0, self.published.line_spacing_m or 200.0
        stated = MapError(sigma_nt=error_nt, correlation_m=0.5 * spacing_m)
        return AnomalyDetector(threshold_nt=3.0, noise_nt=0.5, map_error=None if self.trusting else stated)

    def anomalies(self, track_ne_m: Array, signatures: list[Signature]) -> list[Anomaly]:
        """What one flight along a track shows."""
        north_m, east_m = track_ne_m.T
        rng = np.random.default_rng(self.seed)
        drift_nt, decay = 0.0, math.exp(-1.0 / DRIFT_READINGS)
        field_nt = MagneticField(self.truth, signatures).total_at_nt(north_m, east_m, HEIGHT_M)
        map_nt = self.published.interpolate(north_m, east_m, HEIGHT_M)
        detector, found = self.detector(), []
        for k, (white, drive) in enumerate(rng.standard_normal((len(track_ne_m), 2)).tolist()):
            drift_nt = decay * drift_nt + DRIFT_NT * math.sqrt(1.0 - decay**2) * drive
            reading_nt = float(field_nt[k]) + NOISE_NT * white + drift_nt
            anomaly = detector.update(
                100_000 * (k + 1), reading_nt, float(map_nt[k]), float(north_m[k]), float(east_m[k])
            )
            if anomaly is not None:
                found.append(anomaly)
        return found


def case_of(seed: int, errors: float, *, trusting: bool = False) -> Case:
    """A world and its survey."""
    streams, usual = RandomStreams(seed), SurveyParameters()
    truth = synthetic_map(
        SyntheticMapParameters(
            south_m=-HALF_M, north_m=HALF_M, west_m=-HALF_M, east_m=HALF_M, spacing_m=50.0, height_m=HEIGHT_M
        ),
        home=Home(),
        seed=streams.child("magnetic_map"),
    )
    survey = SurveyParameters(
        noise_nt=errors * usual.noise_nt,
        levelling_nt=errors * usual.levelling_nt,
        diurnal_nt=errors * usual.diurnal_nt,
    )
    published = surveyed(truth, survey, seed=streams.child("magnetic_survey"))
    return Case(seed=seed, truth=truth, published=published, trusting=trusting)


def wandering(seed: int, length_m: float) -> Array:
    """(n, 2) a track from goal to goal, with turns of an aircraft."""
    rng = np.random.default_rng(seed)
    north_m = east_m = heading_rad = 0.0
    goal = (0.0, 0.0)
    track = []
    for _ in range(round(length_m / STEP_M)):
        bearing_rad = math.atan2(goal[1] - east_m, goal[0] - north_m)
        turn_rad = math.remainder(bearing_rad - heading_rad, math.tau)
        heading_rad += max(-STEP_M / TURN_M, min(STEP_M / TURN_M, turn_rad))
        north_m += STEP_M * math.cos(heading_rad)
        east_m += STEP_M * math.sin(heading_rad)
        if math.dist((north_m, east_m), goal) < TURN_M:
            goal = tuple(rng.uniform(-0.75 * HALF_M, 0.75 * HALF_M, 2).tolist())
        track.append((north_m, east_m))
    return np.array(track)


def passes(seed: int) -> list[Array]:
    """Straight tracks by the target, at each offset."""
    along_m = np.arange(-0.5 * PASS_M, 0.5 * PASS_M, STEP_M)
    tracks = []
    for offset_m in OFFSETS_M:
        for course_rad in np.random.default_rng(seed).uniform(0.0, math.tau, COURSES):
            c, s = math.cos(course_rad), math.sin(course_rad)
            tracks.append(
                np.column_stack(
                    (TARGET_NE_M[0] + along_m * c - offset_m * s, TARGET_NE_M[1] + along_m * s + offset_m * c)
                )
            )
    return tracks


def targets(seed: int) -> dict[str, Signature]:
    """A target of each kind, both some 30 nT."""
    north_m, east_m = TARGET_NE_M
    return {
        "Gaussian": GaussianSignature(
            north_m=north_m,
            east_m=east_m,
            amplitude_nt=30.0,
            sigma_along_m=80.0,
            sigma_across_m=60.0,
            heading_rad=0.7 * seed,
        ),
        "dipole": DipoleSignature(
            north_m=north_m, east_m=east_m, height_m=-10.0, moment_ned_a_m2=(6e4, 2e4, 9e4)
        ),
    }


def seen(case: Case, target: Signature) -> int:
    """Passes by a target that show an anomaly there."""
    return sum(
        any(math.dist((a.north_m, a.east_m), TARGET_NE_M) <= NEAR_M for a in case.anomalies(track, [target]))
        for track in passes(case.seed)
    )


def main() -> None:
    """Print a line for each size of the survey's errors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--km", type=float, default=44.0)
    parser.add_argument("--errors", type=float, nargs="+", default=[1.0, 2.5])
    parser.add_argument("--trusting", action="store_true")
    given = parser.parse_args()
    for errors in given.errors:
        false, by_kind, error_nt, stated_nt = 0, {"Gaussian": 0, "dipole": 0}, [], []
        for seed in range(given.seeds):
            case = case_of(seed, errors, trusting=given.trusting)
            difference_nt = case.published.total_field_nt - case.truth.total_field_nt
            error_nt.append(rms(difference_nt))
            stated_nt.append(case.published.error_nt or 0.0)
            false += len(case.anomalies(wandering(seed, 1000.0 * given.km), []))
            for kind, target in targets(seed).items():
                by_kind[kind] += seen(case, target)
        flown_km = given.seeds * given.km
        flown = given.seeds * len(OFFSETS_M) * COURSES
        sys.stdout.write(
            f"map error {np.mean(error_nt):.2f} nT (stated {np.mean(stated_nt):.2f}): {false} false "
            f"anomalies in {flown_km:.0f} km, {false / flown_km:.3f} a km; passes that saw the target: "
            + ", ".join(f"{kind} {count} of {flown}" for kind, count in by_kind.items())
            + "\n"
        )
        sys.stdout.flush()


if __name__ == "__main__":
    main()
