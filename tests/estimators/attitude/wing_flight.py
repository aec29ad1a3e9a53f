"""Flights of the embedded Aerosonde with turns to 45 degrees of bank in wind, and the filter beside them."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from autopilot_bridge.mavlink import FrameParser, dialect
from estimators.attitude import AttitudeEstimator
from estimators.interface import Outcome
from estimators.runner import Runner
from flightsim import truth as t
from flightsim.environment import Environment, Turbulence
from tests.flights.aircraft import AircraftFlight

PAPER_DEG2: Final = (3.067, 1.476)
"""Mean squared errors of roll and pitch (Tolman et al. 2021, Table I): two minutes, banks -10 to 25 deg."""
_RADIUS_M: Final = 70.0  # 45 degrees of bank at the Aerosonde's 26 m/s
_BANKS_DEG: Final = (45.0, -45.0, 0.0, 30.0, -30.0, 45.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightErrors:
    """Errors of one flight against the truth, in the air.

    Attributes:
        flavour, turbulence: of the flight.
        mean_square_deg2, mean_deg, worst_deg: of roll and pitch.
        normalised: mean squares of the errors over their variances; 1 is what a right covariance gives.
        bank_deg: greatest true bank.
    """

    flavour: str
    turbulence: str
    mean_square_deg2: tuple[float, float]
    mean_deg: tuple[float, float]
    worst_deg: tuple[float, float]
    normalised: tuple[float, float]
    bank_deg: float


def fly_turns(seed: int) -> FlightErrors:
    """Take-off, circles of 70 m both ways round, steps of bank, and a wide circle; some three minutes.

    Autopilot, wind and turbulence (light and moderate) change with the seed.
    """
    flavour = ("px4", "ardupilot")[seed % 2]
    turbulence = (Turbulence.LIGHT, Turbulence.MODERATE)[seed // 2 % 2]
    environment = Environment.from_wind(
        speed_m_s=4.0 + seed % 5, from_deg=37.0 * seed % 360.0, turbulence=turbulence
    )
    flight = AircraftFlight(flavour, seed=seed, environment=environment)
    seen = _Watch(flight)
    flight.fly(2.0)
    name, rate_hz = (
        (dialect.MAVLINK_MSG_ID_HIGHRES_IMU, 50.0)
        if flavour == "px4"
        else (dialect.MAVLINK_MSG_ID_RAW_IMU, 40.0)
    )
    flight.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, name, 1e6 / rate_hz)
    flight.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, dialect.MAVLINK_MSG_ID_SCALED_PRESSURE, 5e5)
    flight.take_off(100.0)
    for radius_m, height_m in ((_RADIUS_M, 100.0), (-_RADIUS_M, 110.0)):
        assert flight.circle(150.0, 150.0, height_m, radius_m) == 0
        flight.fly(25.0)
    _steps_of_bank(flight)
    assert flight.circle(150.0, 150.0, 100.0, 100.0) == 0
    flight.fly(20.0)
    return seen.errors(flavour, str(turbulence))


def _steps_of_bank(flight: AircraftFlight) -> None:
    wanted = [0.0]
    mask = 0x07 if flight.flavour == "px4" else 0x46  # ArduPlane: roll alone
    flight.repeat(20.0, lambda _: flight.attitude_setpoint(wanted[0], 3.0, 0.6, mask))
    flight.fly(0.5)
    flight.set_mode("offboard" if flight.flavour == "px4" else "guided")
    for bank_deg in _BANKS_DEG:
        wanted[0] = bank_deg
        flight.fly(8.0)
    flight.stop_repeating()


class _Watch:
    """Runs the filter on what the flight's link brings, and notes truth beside its estimates."""

    def __init__(self, flight: AircraftFlight) -> None:
        self._flight = flight
        self._runner = Runner(AttitudeEstimator(), system_id=1)
        self._parser = FrameParser()
        self._before = flight._link.on_receive
        self._rows: list[tuple[float, ...]] = []
        flight._link.on_receive = self._hear

    def _hear(self, data: bytes) -> None:
        assert self._before is not None
        self._before(data)
        landed = self._flight.newest.get("EXTENDED_SYS_STATE")
        airborne = landed is not None and landed.landed_state > dialect.MAV_LANDED_STATE_ON_GROUND
        for frame in self._parser.feed(data):
            if self._runner.feed(frame) is Outcome.UPDATED and airborne:
                (estimate,) = self._runner.estimator.estimates
                w, x, y, z = self._flight.truth[t.Q_NED_FROM_FRD]
                roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
                pitch = math.asin(2.0 * (w * y - z * x))
                self._rows.append((roll, pitch, *estimate.row()[:4]))

    def errors(self, flavour: str, turbulence: str) -> FlightErrors:
        rows = np.array(self._rows)
        error, variance = rows[:, 2:4] - rows[:, :2], rows[:, 4:6]
        error_deg = np.degrees(error)
        return FlightErrors(
            flavour=flavour,
            turbulence=turbulence,
            mean_square_deg2=tuple((error_deg**2).mean(axis=0).tolist()),
            mean_deg=tuple(error_deg.mean(axis=0).tolist()),
            worst_deg=tuple(np.abs(error_deg).max(axis=0).tolist()),
            normalised=tuple((error**2 / variance).mean(axis=0).tolist()),
            bank_deg=float(np.degrees(np.abs(rows[:, 0]).max())),
        )
