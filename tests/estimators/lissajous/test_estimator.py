"""`LissajousEstimator` on made flights whose motion is known in closed form."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import definition
from estimators.interface import Outcome
from estimators.lissajous import LissajousEstimator, LissajousParameters
from estimators.lissajous.model import AXIS, axis, correct, predict
from estimators.messages import message_class
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

HOME = GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)
FRAME = LocalFrame(HOME)
OMEGA_X, OMEGA_Y = 0.11, 0.17  # east, north
POSITION_M, VELOCITY_M_S = 0.3, 0.1


def made(name: str, system: int = 1, component: int = 1, **values):
    found = definition(name)
    kind = message_class(found)
    filled = {
        field.name: (0,) * field.length if field.length and field.code != "s" else 0
        for field in found.wire_fields
    }
    return kind(system, component, **(filled | values))  # type: ignore[call-arg]


def home(system: int = 1, place: GeodeticPosition = HOME):
    return made(
        "HOME_POSITION",
        system,
        latitude=round(place.lat_deg * 1e7),
        longitude=round(place.lon_deg * 1e7),
        altitude=round(place.alt_m * 1e3),
    )


def true_motion(t: float, omega=(OMEGA_X, OMEGA_Y)):
    """(north, its rate, east, its rate)."""
    x, y = omega
    return (
        30.0 * math.sin(y * t),
        30.0 * y * math.cos(y * t),
        40.0 * math.cos(x * t),
        -40.0 * x * math.sin(x * t),
    )


def gps(t: float, motion, system: int = 1):
    north, north_m_s, east, east_m_s = motion
    lat_deg, lon_deg, _ = FRAME.geodetic_from_ned(north, east, 0.0)
    return made(
        "GPS_RAW_INT",
        system,
        time_usec=round(t * 1e6),
        fix_type=3,
        lat=round(lat_deg * 1e7),
        lon=round(lon_deg * 1e7),
        alt=500_000,
        vel=round(100.0 * math.hypot(north_m_s, east_m_s)),
        cog=round(math.degrees(math.atan2(east_m_s, north_m_s)) % 360.0 * 100.0) % 36000,
    )


def parameters(**chosen):
    return LissajousParameters(
        **{
            "omega_x_rad_s": OMEGA_X,
            "omega_y_rad_s": OMEGA_Y,
            "position_sigma_m": POSITION_M,
            "velocity_sigma_m_s": VELOCITY_M_S,
            "acceleration_psd_m2_s3": 1e-5,
        }
        | chosen
    )


def errors(estimator: LissajousEstimator, *, seed: int = 0, omega=(OMEGA_X, OMEGA_Y), duration_s=200.0):
    """RMS errors of position and velocity over the second half of a noisy flight with irregular samples."""
    rng = np.random.default_rng(seed)
    estimator.handle(0, home())
    t, off = 0.0, []
    while t < duration_s:
        t += float(rng.uniform(0.05, 0.4))
        motion = np.array(true_motion(t, omega))
        noise = rng.normal(size=4) * (POSITION_M, VELOCITY_M_S, POSITION_M, VELOCITY_M_S)
        assert estimator.handle(round(t * 1e6), gps(t, motion + noise)) is Outcome.UPDATED
        e = estimator.estimates[0]
        if t > 0.5 * duration_s:
            off.append(np.array([e.north_m, e.north_m_s, e.east_m, e.east_m_s]) - motion)
    square = np.mean(np.square(off), axis=0)
    return math.sqrt(square[0] + square[2]), math.sqrt(square[1] + square[3])


def test_with_the_right_frequencies_the_filter_is_far_better_than_the_samples() -> None:
    unfiltered = errors(LissajousEstimator(parameters(form="measurement")))
    kalman = errors(LissajousEstimator(parameters(form="kalman")))
    assert unfiltered[0] == pytest.approx(POSITION_M * math.sqrt(2.0), rel=0.1)
    assert kalman[0] < 0.35 * unfiltered[0] and kalman[1] < 0.35 * unfiltered[1]


def test_wrong_frequencies_are_allowed_for_and_corrected() -> None:
    """The paper's ordering when the frequencies are off, and what its future work adds."""
    omega = (OMEGA_X * 1.04, OMEGA_Y * 0.97)
    epsilon = (0.04 * OMEGA_X) ** 2 / OMEGA_X
    found = {}
    for name, chosen in {
        "N": {"form": "measurement"},
        "K": {"form": "kalman"},
        "P": {"epsilon_rad_s": epsilon},
        "F": {"epsilon_rad_s": epsilon, "frequency": True},
    }.items():
        estimator = LissajousEstimator(parameters(off_pattern_gate=0.0, **chosen))
        found[name] = errors(estimator, omega=omega)
    assert found["F"][0] < found["P"][0] < found["N"][0] < found["K"][0]
    e = estimator.estimates[0]
    assert e.omega_x_rad_s == pytest.approx(omega[0], rel=2e-3)
    assert e.omega_y_rad_s == pytest.approx(omega[1], rel=2e-3)
    assert abs(e.omega_x_rad_s - omega[0]) < 4.0 * e.omega_x_sigma_rad_s
    # where the flight ends the pattern is over, and what was learned is lost
    estimator.handle(300_000_000, gps(300.0, (0.0, 0.0, 0.0, 0.0)))
    assert estimator.estimates[0].omega_x_rad_s == OMEGA_X
    assert estimator.remarks()["omega_x_rad_s"] == pytest.approx(omega[0], rel=2e-3)


def test_the_estimator_is_the_kernels() -> None:
    """The same samples through the compiled model that the study runs give the same state to the last bit."""
    p = parameters(epsilon_rad_s=1e-3, off_pattern_gate=0.0, orientation_rad=0.0)
    estimator = LissajousEstimator(p)
    estimator.handle(0, home())
    noise = np.diag([POSITION_M**2, VELOCITY_M_S**2] * 2)
    state, spread, last = np.zeros(4), np.zeros((4, 4)), None
    for k in range(50):
        t_us = 200_000 * k + 1000 * (k * k % 7)
        message = gps(1e-6 * t_us, true_motion(1e-6 * t_us))
        assert estimator.handle(t_us, message) is Outcome.UPDATED
        north, east, _ = estimator.track.pattern.frame.ned_from_geodetic(
            1e-7 * message.lat, 1e-7 * message.lon, 500.0
        )
        angle = math.radians(0.01 * message.cog)
        speed = 0.01 * message.vel
        measured = np.array([north, speed * math.cos(angle), east, speed * math.sin(angle)])
        if last is None:
            state[:], spread[:] = measured, noise
        else:
            dt = 1e-6 * (t_us - last)
            q, process, axes = p.acceleration_psd_m2_s3, np.zeros((4, 4)), np.zeros((2, AXIS))
            for i, omega in enumerate((OMEGA_X, OMEGA_Y)):
                axis(0, omega, dt, axes[i])
                block = [[q * dt**3 / 3.0, q * dt**2 / 2.0], [q * dt**2 / 2.0, q * dt]]
                process[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = block
            uncertain = np.diag([1e-3 * OMEGA_X, 1e-3 * OMEGA_Y])
            predict(state, spread, axes, process, uncertain, np.zeros((2, 2)))
            correct(state, spread, measured, noise, np.zeros((4, 12)))
        last = t_us
    assert np.array_equal(estimator.track.filter.state, state)
    assert np.array_equal(estimator.track.filter.covariance, spread)


@pytest.mark.parametrize("source", ["gps", "global", "local"])
def test_every_source_says_the_same(source: str) -> None:
    estimator = LissajousEstimator(parameters(source=source, form="measurement"))
    motion = true_motion(3.0)
    north, north_m_s, east, east_m_s = motion
    lat_deg, lon_deg, _ = FRAME.geodetic_from_ned(north, east, 0.0)
    estimator.handle(0, home())
    message = {
        "gps": gps(3.0, motion),
        "global": made(
            "GLOBAL_POSITION_INT",
            lat=round(lat_deg * 1e7),
            lon=round(lon_deg * 1e7),
            vx=round(100 * north_m_s),
            vy=round(100 * east_m_s),
        ),
        "local": made("LOCAL_POSITION_NED", x=north, y=east, vx=north_m_s, vy=east_m_s),
    }[source]
    assert estimator.handle(3_000_000, message) is Outcome.UPDATED
    e = estimator.estimates[0]
    assert (e.north_m, e.east_m) == pytest.approx((north, east), abs=0.02)
    assert (e.north_m_s, e.east_m_s) == pytest.approx((north_m_s, east_m_s), abs=0.01)
    assert e.course_rad == pytest.approx(math.atan2(east_m_s, north_m_s), abs=0.01)
    (published,) = estimator.publish()
    assert published.get_type() == "LOCAL_POSITION_NED_COV"
    assert published.x == pytest.approx(north, abs=0.02) and published.vy == pytest.approx(east_m_s, abs=0.01)  # type: ignore[attr-defined]
    assert published.covariance[0] == pytest.approx(POSITION_M**2)  # type: ignore[attr-defined]
    assert published.covariance[30] == pytest.approx(VELOCITY_M_S**2)  # type: ignore[attr-defined]
    assert math.isnan(published.z)  # type: ignore[attr-defined]


def test_without_home_it_waits_and_a_given_centre_needs_only_its_height() -> None:
    estimator = LissajousEstimator(parameters())
    assert estimator.handle(0, gps(0.0, true_motion(0.0))) is Outcome.WAITING
    assert estimator.estimates == ()


def test_home_that_moves_takes_the_state_along() -> None:
    """PX4 sets home anew on arming."""
    estimator = LissajousEstimator(parameters())
    estimator.handle(0, home())
    for k in range(20):
        estimator.handle(k * 200_000, gps(0.2 * k, true_motion(0.2 * k)))
    before = estimator.estimates[0]
    lat_deg, lon_deg, alt_m = FRAME.geodetic_from_ned(5.0, -3.0, 0.0)
    moved = home(place=GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m))
    assert estimator.handle(3_900_000, moved) is Outcome.USED
    x, y = estimator.track.filter.state[0], estimator.track.filter.state[2]
    north, east = estimator.track.pattern.north_east(x, y)
    assert (north, east) == pytest.approx((before.north_m - 5.0, before.east_m + 3.0), abs=0.02)


def test_late_repeated_and_foreign_samples_are_left_out() -> None:
    estimator = LissajousEstimator(parameters())
    estimator.handle(0, home())
    first = gps(1.0, true_motion(1.0))
    assert estimator.handle(1_000_000, first) is Outcome.UPDATED
    state = estimator.track.filter.state.copy()
    assert estimator.handle(1_000_000, first) is Outcome.REPEATED
    assert estimator.handle(800_000, gps(0.8, true_motion(0.8))) is Outcome.LATE
    assert estimator.handle(1_200_000, made("ATTITUDE")) is Outcome.IGNORED
    assert estimator.handle(1_200_000, first._replace(src_component=191)) is Outcome.IGNORED
    assert estimator.handle(1_200_000, first._replace(fix_type=1, lat=1)) is Outcome.WAITING
    assert np.array_equal(estimator.track.filter.state, state)


def test_a_long_silence_starts_anew() -> None:
    estimator = LissajousEstimator(parameters())
    estimator.handle(0, home())
    estimator.handle(0, gps(0.0, true_motion(0.0)))
    assert estimator.handle(60_000_000, gps(60.0, true_motion(60.0))) is Outcome.TIME_JUMP
    assert estimator.estimates[0].north_m == pytest.approx(true_motion(60.0)[0], abs=0.02)
    assert estimator.track.filter.covariance[0, 0] == pytest.approx(POSITION_M**2)


def test_leaving_the_pattern_restarts_the_filter() -> None:
    estimator = LissajousEstimator(parameters(form="kalman"))
    estimator.handle(0, home())
    for k in range(100):
        estimator.handle(k * 200_000, gps(0.2 * k, true_motion(0.2 * k)))
    assert estimator.remarks()["off_pattern"] == 0.0
    away = (80.0, 0.0, 80.0, 0.0)
    estimator.handle(20_000_000, gps(20.0, away))
    e = estimator.estimates[0]
    assert (e.north_m, e.east_m) == pytest.approx((80.0, 80.0), abs=0.02)
    assert estimator.remarks()["off_pattern"] == pytest.approx(1.0 / 101.0)
    assert "warning" not in estimator.remarks()


def test_a_pattern_that_is_not_flown_is_warned_of() -> None:
    """Round a circle of 300 m at 25 m/s, about a place 400 m off."""
    estimator = LissajousEstimator(parameters())
    estimator.handle(0, home())
    for k in range(200):
        t, w = 0.2 * k, 25.0 / 300.0
        c, s = math.cos(w * t), math.sin(w * t)
        estimator.handle(round(1e6 * t), gps(t, (400.0 + 300.0 * c, -25.0 * s, 300.0 * s, 25.0 * c)))
    assert "check omega_x_rad_s" in estimator.remarks()["warning"]  # type: ignore[operator]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"form": "best"}, "form 'best' is not one of measurement, kalman, proposed"),
        ({"source": "vision"}, "source 'vision' is not one of gps, global, local"),
        ({"omega_x_rad_s": 0.0}, "omega_x_rad_s 0 is not possible; ask for more than 0"),
        ({"epsilon_rad_s": -1.0}, "epsilon_rad_s -1 is not possible; ask for 0 or more"),
        ({"frequency": True, "form": "kalman"}, "needs form=proposed"),
        ({"centre_lat_deg": 47.0}, "go together"),
        ({"centre_lat_deg": 99.0, "centre_lon_deg": 0.0}, "centre_lat_deg 99 is not in -90..90"),
        ({"orientation_rad": math.nan}, "orientation_rad nan is not a finite number"),
        ({"position_sigma_m": 0.0}, "position_sigma_m 0 is not possible"),
    ],
)
def test_wrong_parameters_are_named(wrong, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        LissajousParameters(**wrong)
