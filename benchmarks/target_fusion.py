"""Two quadrotors on Lissajous patterns localise a ground target: unfiltered, Kalman filter, proposed.

    python benchmarks/target_fusion.py [--seeds 20] [--first 0] [--epsilon 3e-5] [--heading course]
                                         [--workers N]

Every seed is a flight in an embedded world (PX4, iris): both vehicles fly the pattern in its natural time
law, at a pace of their own that differs from the nominal one by chance, as the paper's drones do (variance
epsilon times the frequency); their cameras look at a place around which a tagged target circles. The base
station hears both vehicles' receivers, gimbals and cameras, and nothing else. The errors are of truth, root
mean square over the detections of the pattern. The exit code is 1 when the means are not proposed < Kalman <
unfiltered. docs/lissajous_estimation.md explains.
"""

import argparse
import math
import statistics
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from autopilot_bridge.clock import LoopClock, VirtualTimeLoop, run
from autopilot_bridge.mavlink import Frame, FrameParser, Packet, definition
from autopilot_bridge.mavlink.wire_units import degrees
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.sitl.truth import TARGET_SYSTEM
from autopilot_bridge.tlog import TlogWriter
from estimators import wire
from estimators.interface import Estimator
from estimators.messages import read_as
from estimators.runner import Runner
from estimators.target_fusion import TargetFusionEstimator, TargetFusionParameters
from estimators.tracking.metrics import rms
from flightsim.environment import Environment
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.operating_system import processors
from flightsim.foundation.random_streams import RandomStreams
from flightsim.payload import (
    CameraParameters,
    Circle,
    GimbalParameters,
    GroundTargetParameters,
    PayloadParameters,
)
from flightsim.world_spec import WorldSpec, team
from missions.base.options import FlightOptions, Via
from missions.flown.run_folder import EPOCH_UNIX_US
from missions.pattern_search.flight import fly_pattern
from missions.patterns.curve import Lap
from missions.patterns.lissajous import Lissajous
from missions.studies import Pool, Study, run_study
from missions.studies.study import run_of
from missions.vehicle.concurrency import run_concurrently
from missions.vehicle.connection import Connection
from missions.vehicle.notes import PATTERN
from missions.vehicle.vehicle import Vehicle

FORMS = ("measurement", "kalman", "proposed", "frequency")
RECEIVED = frozenset(
    definition(name).message_id
    for name in (
        "GPS_RAW_INT",
        "HOME_POSITION",
        "ATTITUDE",
        "GIMBAL_DEVICE_ATTITUDE_STATUS",
        "LANDING_TARGET",
        "SYSTEM_TIME",
    )
)
ALTITUDE_M = 20.0
TAG = 7


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What is flown.

    Attributes:
        half_width_m, half_height_m: of the pattern, east and north.
        ratio_x, ratio_y: its frequencies.
        period_s: nominal, once round.
        epsilon_rad_s: variance of the true frequencies over themselves.
        duration_s: of the pattern.
        target_north_m, target_east_m: middle of the target's circle, from the first vehicle's home.
        wind_m_s: steady, with light turbulence.
    """

    half_width_m: float = 40.0
    half_height_m: float = 30.0
    ratio_x: int = 1
    ratio_y: int = 2
    period_s: float = 70.0
    epsilon_rad_s: float = 3e-5
    duration_s: float = 150.0
    target_north_m: float = 35.0
    target_east_m: float = 50.0
    wind_m_s: float = 3.0

    @property
    def omega_rad_s(self) -> tuple[float, float]:
        """Nominal frequencies, east and north."""
        fundamental = math.tau / self.period_s
        return self.ratio_x * fundamental, self.ratio_y * fundamental

    def curve(self) -> Lissajous:
        """The pattern, often enough round."""
        return Lissajous(
            amplitude_x_m=self.half_width_m,
            amplitude_y_m=self.half_height_m,
            ratio_x=self.ratio_x,
            ratio_y=self.ratio_y,
            phase_x_rad=0.5 * math.pi,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorded:
    """A flight as it was received, with the truth.

    Attributes:
        frames: what the base station hears of the vehicles, in order.
        truth: (n, 3), time s, north and east of the target from the first vehicle's home.
        start_us, end_us: of the pattern, that part which both fly.
    """

    frames: list[Frame]
    truth: np.ndarray[Any, np.dtype[np.float64]]
    start_us: int
    end_us: int


class Ears:
    """Keeps what comes from the vehicles; one for both, so that the order is that of arrival."""

    def __init__(self, log: TlogWriter | None) -> None:
        self.frames: list[Frame] = []
        self._log = log

    def take(self, frame: Frame, time_us: int) -> None:
        self.frames.append(frame)
        if self._log is not None:
            self._log.write(EPOCH_UNIX_US + time_us, frame.raw)


class Ear:
    """One link's recorder: of several hundred messages a second it keeps what the base station listens to."""

    acts = False

    def __init__(self, ears: Ears) -> None:
        self._ears = ears

    def record(self, packet: Packet, time_us: int) -> None:
        for frame in packet:
            if frame.message_id in RECEIVED:
                self._ears.take(frame, time_us)


def paces(seed: int) -> tuple[float, float]:
    """How far each vehicle's frequency is off the nominal one, in standard deviations."""
    first, second = RandomStreams(seed).generator("benchmark", "pace").standard_normal(2).tolist()
    return first, second


def fly(seed: int, setting: Setting, log: Path | None = None) -> Recorded:
    """Fly both vehicles and record what is said."""
    pace = paces(seed)
    camera = CameraParameters(pixel_noise_px=0.3, tag_range=True, latency_s=0.1)
    payload = PayloadParameters(gimbal=GimbalParameters(), camera=camera)
    target = GroundTargetParameters(
        motion=Circle(
            north_m=setting.target_north_m, east_m=setting.target_east_m, radius_m=6.0, speed_m_s=0.5
        ),
        size_m=1.0,
        tag_id=TAG,
    )
    vehicles = tuple(
        replace(vehicle, payload=payload) for vehicle in team(2, model="iris", autopilot="px4", parameters={})
    )
    sitl = Sitl(
        WorldSpec(
            vehicles=vehicles,
            seed=seed,
            targets=(target,),
            air=Environment.from_wind(
                speed_m_s=setting.wind_m_s, from_deg=240.0, turbulence="light" if setting.wind_m_s else "none"
            ),
        )
    )
    home = sitl.spec.place
    frame = LocalFrame(GeodeticPosition(lat_deg=home.lat_deg, lon_deg=home.lon_deg, alt_m=home.alt_m))
    truth: list[tuple[float, float, float]] = []
    parser = FrameParser()

    def on_truth(time_us: int, raw: bytes) -> None:
        for parsed in parser.feed(raw):
            if parsed.system_id == TARGET_SYSTEM:
                m = read_as(parsed, wire.HIL_STATE_QUATERNION)
                north, east, _ = frame.ned_from_geodetic(degrees(m.lat), degrees(m.lon), home.alt_m)
                truth.append((1e-6 * m.time_usec, north, east))

    sitl.on_truth(on_truth)
    loop = VirtualTimeLoop(sitl.advance, lambda: sitl.time_us, max_time_us=1_000_000_000)
    links = [sitl.connect(index) for index in range(2)]
    writer = TlogWriter(log) if log is not None else None
    ears = Ears(writer)
    lat_deg, lon_deg, _ = frame.geodetic_from_ned(setting.target_north_m, setting.target_east_m, 0.0)
    phases: list[tuple[int, int]] = []

    async def fly_one(index: int) -> None:
        async with Connection(links[index], LoopClock(), Ear(ears)) as connection:
            vehicle = Vehicle(connection)
            await vehicle.wait_ready()
            vehicle.payload.point_gimbal_at(lat_deg, lon_deg, home.alt_m)
            vehicle.payload.set_gimbal_rate(25.0)
            # the paper's truth: w ~ N(nominal, epsilon nominal), here one pace for both axes
            nominal = setting.omega_rad_s[0]
            omega = nominal + math.sqrt(setting.epsilon_rad_s * nominal) * pace[index]
            options = FlightOptions(
                altitude_m=ALTITUDE_M,
                vehicles=2,
                index=index,
                via=Via.SETPOINTS,
                period_s=setting.period_s * nominal / omega,
                search_time_s=setting.duration_s,
                centre=GeodeticPosition(lat_deg=home.lat_deg, lon_deg=home.lon_deg, alt_m=home.alt_m),
            )
            # half a pattern apart, and more laps than the time is for
            laps = 2.0 + setting.duration_s / setting.period_s
            await fly_pattern(vehicle, options, Lap(curve=setting.curve(), laps=laps, start=0.5 * index))
            found = vehicle.notes.phase(PATTERN)
            assert found is not None
            phases.append((found.start_us, found.end_us))

    async def fly_both() -> None:
        await run_concurrently([fly_one(0), fly_one(1)])

    try:
        run(fly_both(), loop)
    finally:
        sitl.close()
        loop.close()
        if writer is not None:
            writer.close()
    return Recorded(
        frames=ears.frames,
        truth=np.array(truth),
        start_us=max(start for start, _ in phases) + 5_000_000,
        end_us=min(end for _, end in phases) - 5_000_000,
    )


def base_station(form: str, setting: Setting, **chosen: Any) -> TargetFusionEstimator:
    """The estimator as it would be set for this pattern. All forms use the same noise."""
    omega_x, omega_y = setting.omega_rad_s
    values: dict[str, Any] = {
        "form": "proposed" if form == "frequency" else form,
        "frequency": form == "frequency",
        "omega_x_rad_s": omega_x,
        "omega_y_rad_s": omega_y,
        "epsilon_rad_s": setting.epsilon_rad_s,
        "position_sigma_m": 0.2,
        "velocity_sigma_m_s": 0.07,
        "acceleration_psd_m2_s3": 3e-4,
        "size_sigma_rad": 0.0002,
        "yaw_sigma_rad": 0.02,
        "walk_m_sqrt_s": 3.0,
    } | chosen
    return TargetFusionEstimator(TargetFusionParameters(**values))


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """How far off the target's place was, over the pattern."""

    rmse_m: float
    median_m: float
    detections: int
    sigmas: float


def score(recorded: Recorded, estimator: Estimator[Any]) -> Score:
    """Feed a flight to an estimator; root mean square of the horizontal error over its estimates."""
    runner = Runner(estimator)
    for frame in recorded.frames:
        runner.feed(frame)
    table = runner.tables["TargetEstimate"]
    times = table.time_us
    kept = (times >= recorded.start_us) & (times <= recorded.end_us)
    true_north, true_east = (
        np.interp(1e-6 * times[kept], recorded.truth[:, 0], recorded.truth[:, column]) for column in (1, 2)
    )
    north, east = table["north_m"][kept] - true_north, table["east_m"][kept] - true_east
    off = np.hypot(north, east)
    accepted = np.hypot(table["north_sigma_m"][kept], table["east_sigma_m"][kept])
    return Score(
        rmse_m=rms(off),
        median_m=float(np.median(off)),
        detections=int(kept.sum()),
        sigmas=rms(off / accepted),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """RMSE of each form, and the number of detections, of one seed's flight."""

    measurement: float
    kalman: float
    proposed: float
    frequency: float
    detections: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Flown:
    """A trial: one seed's flight by a setting, looked at by every form."""

    setting: Setting
    heading: str
    first: int

    def __call__(self, _parameters: object, seed: int) -> Errors:
        recorded = fly(self.first + run_of(seed)[1], self.setting)
        scores = {
            form: score(recorded, base_station(form, self.setting, heading=self.heading)) for form in FORMS
        }
        errors = {form: found.rmse_m for form, found in scores.items()}
        return Errors(**errors, detections=scores["proposed"].detections)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--epsilon", type=float, default=Setting().epsilon_rad_s)
    parser.add_argument("--heading", choices=["course", "yaw"], default="course")
    parser.add_argument("--workers", type=int, default=processors(), help="processes")
    arguments = parser.parse_args()
    if min(arguments.seeds, arguments.workers) < 1 or arguments.first < 0:
        parser.error("--seeds and --workers from 1, --first from 0")
    if not 0.0 <= arguments.epsilon <= 0.01:
        parser.error("--epsilon from 0 to 0.01")
    setting = Setting(epsilon_rad_s=arguments.epsilon)
    study = Study(
        name="target-fusion",
        trial=Flown(setting=setting, heading=arguments.heading, first=arguments.first),
        row=Errors,
    )
    with tempfile.TemporaryDirectory() as folder:
        results = run_study(
            study, runs=arguments.seeds, engine=Pool(arguments.workers), out=f"{folder}/study", picture=False
        ).results
    for failed in results.without_row():
        say(f"trial {failed['trial']}: {failed['error']}")
        return 1
    found = {form: results.values(form)[0].tolist() for form in FORMS}
    detections, took_s = results.values("detections")[0], results.timing["wall_time_s"].to_pylist()
    say(f"{'seed':>5}" + "".join(f"{form:>13}" for form in FORMS) + f"{'detections':>12}{'wall s':>8}")
    for k in range(arguments.seeds):
        line = "".join(f"{found[form][k]:13.3f}" for form in FORMS)
        say(f"{arguments.first + k:5d}{line}{detections[k]:12.0f}{took_s[k]:8.1f}")
    means = {form: statistics.fmean(values) for form, values in found.items()}
    say(f"{'mean':>5}" + "".join(f"{means[form]:13.3f}" for form in FORMS))
    for order in (("proposed", "kalman", "measurement"), ("proposed", "kalman"), ("kalman", "measurement")):
        rising = [list(errors) == sorted(errors) for errors in zip(*(found[f] for f in order), strict=True)]
        say(f"{' < '.join(order)} in {sum(rising)} of {len(rising)} flights")
    return 0 if means["proposed"] < means["kalman"] < means["measurement"] else 1


def say(line: str) -> None:
    """A line on the standard output, at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
