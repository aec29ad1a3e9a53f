"""The estimator `magnetic-identification`: anomalies of the magnetic field, and which of them are targets.

Source: Lum, Rysdyk and Pongpunwattana 2005, section III; docs/magnetic_identification.md. Its inputs are the
readings of survey magnetometers, the positions of the vehicles, and the published map of the place.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, SURVEY_MAGNETOMETER_COMPONENT
from autopilot_bridge.mavlink.wire_units import degrees, metres
from estimators import wire
from estimators.input_guard import InputGuard
from estimators.interface import Estimator, Need, Outcome
from estimators.magnetic_identification.anomaly import Anomaly
from estimators.magnetic_identification.estimate import IdentificationEstimate
from estimators.magnetic_identification.identifier import Identifier, Progress
from estimators.magnetic_identification.parameters import IdentificationParameters
from estimators.messages import Message, is_a
from estimators.occupancy.placed_readings import ReadingCheck, ReadingPlacer
from estimators.occupancy.survey_map import SurveyMap, load_survey_map, map_error_of
from estimators.survey_magnetometer import TOTAL_FIELD_NAME
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.magnetics import magnetic_field_ned_gauss
from flightsim.foundation.options import option

__all__ = ["MagneticIdentificationEstimator", "MagneticIdentificationParameters", "field_direction"]

Array = NDArray[np.float64]

_POSITION_HZ: Final = 2.0
_PUBLISHED: Final = b"MAGTGT_P"


@dataclass(frozen=True, slots=True, kw_only=True)
class MagneticIdentificationParameters(IdentificationParameters):
    """Parameters of `MagneticIdentificationEstimator`."""

    map_file: Path | None = option(
        None, help="Published magnetic map (.npz); without one, no reading can be compared."
    )
    decimal_year: float = option(
        2026.0,
        least=2025.0,
        most=2030.0,
        help="Date of the main field (WMM-2025), whose direction dipoles need.",
    )

    def check_together(self) -> None:
        self.require_detectable()


class MagneticIdentificationEstimator(Estimator[MagneticIdentificationParameters]):
    """Compares the readings of all vehicles with the map, and identifies what differs.

    Attributes:
        identifier: the anomalies; None: there is no map.
        unplaced: number of readings without a position or a value on the map.
        implausible: number of readings that a magnetometer out of order makes: saturated or stuck.
    """

    NAME: ClassVar[str] = "magnetic-identification"
    PARAMETERS = MagneticIdentificationParameters
    TEAM: ClassVar[bool] = True
    EVENTS: ClassVar[bool] = True

    def __init__(self, parameters: MagneticIdentificationParameters | None = None) -> None:
        super().__init__(parameters)
        path = self.parameters.map_file
        self._map: SurveyMap | None = None if path is None else load_survey_map(path)
        self._guard = InputGuard()
        self.reset()

    @property
    def needs(self) -> tuple[Need, ...]:
        return (
            Need(messages=("NAMED_VALUE_FLOAT",), rate_hz=0.0, purpose="total magnetic field (MAG_NT)"),
            Need(
                messages=("GLOBAL_POSITION_INT",),
                rate_hz=_POSITION_HZ,
                wanted_rate_hz=10.0,
                purpose="places of the readings",
            ),
        )

    def reset(self) -> None:
        """Discard everything except the parameters and the map."""
        p, survey_map = self.parameters, self._map
        self._guard.reset()
        self._placers: dict[int, ReadingPlacer] = {}
        self._checks: dict[int, ReadingCheck] = {}
        self._off_map = self._on_map = 0
        self._estimates: tuple[IdentificationEstimate, ...] = ()
        self._reported_us: dict[int, int] = {}
        self.identifier: Identifier | None = None
        if survey_map is not None:
            self.identifier = Identifier(
                p,
                map_error=map_error_of(survey_map, p.map_error_nt),
                field_ned=field_direction(survey_map.home, p.decimal_year),
            )

    @property
    def implausible(self) -> int:
        return sum(check.implausible for check in self._checks.values())

    @property
    def unplaced(self) -> int:
        return self._off_map + sum(placer.dropped for placer in self._placers.values())

    def handle(self, time_us: int, message: Message) -> Outcome:
        if is_a(message, wire.NAMED_VALUE_FLOAT):
            if message.src_component != SURVEY_MAGNETOMETER_COMPONENT or message.name_ != TOTAL_FIELD_NAME:
                return Outcome.IGNORED
            return self._on_reading(time_us, message)
        if is_a(message, wire.GLOBAL_POSITION_INT) and message.src_component == AUTOPILOT_COMPONENT:
            return self._on_position(time_us, message)
        return Outcome.IGNORED

    def _on_reading(self, time_us: int, message: wire.NAMED_VALUE_FLOAT) -> Outcome:
        system, total_nt = message.src_system, message.value
        refused = self._guard.check(time_us, (system, "reading"), (total_nt,), leads=False)
        if refused is Outcome.TIME_JUMP:
            self.reset()
        elif refused is not None:
            return refused
        if not self._checks.setdefault(system, ReadingCheck()).accepts(total_nt):
            return Outcome.IMPLAUSIBLE
        placer = self._placer(system)
        if placer is None:
            return Outcome.WAITING
        placer.add_reading(time_us, total_nt)
        return refused or Outcome.USED

    def _on_position(self, time_us: int, message: wire.GLOBAL_POSITION_INT) -> Outcome:
        system = message.src_system
        place = (degrees(message.lat), degrees(message.lon), metres(message.alt))
        refused = self._guard.check(time_us, (system, "position"), place, leads=False)
        if refused is Outcome.TIME_JUMP:
            self.reset()
        elif refused is not None:
            return refused
        placer = self._placer(system)
        if placer is None or self._map is None or self.identifier is None:
            return Outcome.WAITING
        outcome = Outcome.USED
        self._estimates = ()
        for reading in placer.add_position(time_us, *place):
            map_nt = self._map.total_nt(reading.north_m, reading.east_m, reading.height_m)
            if math.isnan(map_nt):
                self._off_map += 1
                continue
            self._on_map += 1
            progress = self.identifier.take(system, reading, map_nt)
            if progress is not None and self._report(progress):
                outcome = Outcome.UPDATED
        return refused or outcome

    def _placer(self, system: int) -> ReadingPlacer | None:
        if self._map is None:
            return None
        placer = self._placers.get(system)
        if placer is None:
            placer = self._placers[system] = ReadingPlacer(self._map.frame())
        return placer

    def _report(self, progress: Progress) -> bool:
        """Make an estimate at the end of a pass, and at intervals during it."""
        sample, anomaly = progress.sample, progress.pass_ended or progress.anomaly
        if anomaly is None:
            return False
        last_us = self._reported_us.get(anomaly.number)
        due = last_us is None or sample.time_us - last_us >= self.parameters.report_s * 1e6
        if progress.pass_ended is None and not (due and anomaly.under_way):
            return False
        self._reported_us[anomaly.number] = sample.time_us
        self._estimates = (*self._estimates, estimate_of(anomaly, sample.time_us))
        return True

    @property
    def estimates(self) -> Sequence[IdentificationEstimate]:
        return self._estimates

    @property
    def origin(self) -> GeodeticPosition | None:
        """The map's home."""
        return None if self._map is None else self._map.home

    def publish(self) -> Sequence[MAVLinkMessage]:
        """NAMED_VALUE_FLOAT "MAGTGT_P": the probability that the newest anomaly is a target."""
        return [
            dialect.MAVLink_named_value_float_message(
                (estimate.time_us // 1000) & 0xFFFFFFFF, _PUBLISHED, estimate.probability
            )
            for estimate in self._estimates
        ]

    def remarks(self) -> Mapping[str, float | str]:
        if self.identifier is None:
            return {
                "warning": "no map: readings can't be compared; give map_file, the published magnetic map"
            }
        found: dict[str, float | str] = {
            "anomalies": float(self.identifier.started),
            "readings_unplaced": float(self.unplaced),
            "readings_implausible": float(self.implausible),
        }
        for anomaly in self.identifier.anomalies:
            found[f"anomaly_{anomaly.number}_probability"] = round(anomaly.probability, 4)
        warnings = []
        if self._off_map and not self._on_map:
            warnings.append(
                f"all {self._off_map} readings with a position are outside the map's data; is "
                f"{self.parameters.map_file} the map of this place?"
            )
        if self.implausible:
            warnings.append(
                f"{self.implausible} readings are stuck, or no field of the Earth; check the magnetometer"
            )
        if warnings:
            found["warning"] = "; ".join(warnings)
        return found


def estimate_of(anomaly: Anomaly, time_us: int) -> IdentificationEstimate:
    """The estimate of an anomaly."""
    newest = anomaly.trace[-1]
    return IdentificationEstimate(
        time_us=time_us,
        anomaly=anomaly.number,
        passes=anomaly.passes,
        probability=newest.probability,
        background=anomaly.background,
        confidence=newest.confidence,
        evidence=newest.evidence,
        modes=tuple(anomaly.modes()),
    )


def field_direction(home: GeodeticPosition, decimal_year: float) -> Array:
    """Direction (3,) of the Earth's field, NED (WMM-2025)."""
    field = magnetic_field_ned_gauss(home.lat_deg, home.lon_deg, home.alt_m, decimal_year)
    direction: Array = field / np.linalg.norm(field)
    return direction
