"""The estimator `lissajous`: a vehicle's motion along a Lissajous pattern from its position messages.

Source: Steckenrider, Leamy, Furukawa 2020 (SSRR), section III-B; docs/lissajous_estimation.md.
"""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators import wire
from estimators.input_guard import InputGuard
from estimators.interface import Estimator, Need, Outcome
from estimators.lissajous.estimate import LissajousEstimate
from estimators.lissajous.model import MOTION, course, course_variance
from estimators.lissajous.motion_filter import off_pattern_remarks
from estimators.lissajous.parameters import Form, LissajousParameters
from estimators.lissajous.pattern_frame import PatternFrame, PositionReader, Track, values_of
from estimators.messages import Message, is_a
from flightsim.foundation.geodesy import GeodeticPosition

_NEEDED_HZ: Final = 2.0
_WANTED_HZ: Final = 10.0
_COVARIANCE_OF: Final = {(0, 0): 0, (0, 1): 1, (0, 3): 3, (0, 4): 4, (1, 1): 9, (1, 3): 11, (1, 4): 12}
_COVARIANCE_OF.update({(3, 3): 24, (3, 4): 25, (4, 4): 30})
"""Places of x, y, vx, vy in LOCAL_POSITION_NED_COV's upper triangle of nine rows, by row and column."""


class LissajousEstimator(Estimator[LissajousParameters]):
    """State, course and, on request, frequencies of one vehicle that flies a Lissajous pattern.

    Attributes:
        track: the filter in the pattern's frame.
    """

    NAME: ClassVar[str] = "lissajous"
    PARAMETERS = LissajousParameters

    def __init__(self, parameters: LissajousParameters | None = None) -> None:
        super().__init__(parameters)
        self._guard = InputGuard(max_gap_us=round(1e6 * self.parameters.max_gap_s))
        self._estimates: tuple[LissajousEstimate, ...] = ()
        self._distance_sum = 0.0
        self._distance_count = 0
        self._surest: LissajousEstimate | None = None
        self._start()

    def _start(self) -> None:
        self.track = Track(self.parameters)
        self._reader = PositionReader(self.parameters.source)

    @property
    def needs(self) -> tuple[Need, ...]:
        """A position message and, unless the pattern's centre is specified, the home position."""
        position = Need(
            messages=(self._reader.message,),
            rate_hz=_NEEDED_HZ,
            wanted_rate_hz=_WANTED_HZ,
            purpose="position and velocity over ground",
        )
        home = Need(messages=("HOME_POSITION",), rate_hz=0.0, purpose="home, the centre of the pattern")
        return (position, home)

    def handle(self, time_us: int, message: Message) -> Outcome:
        """Process one message; only messages of the autopilot itself are used."""
        name = type(message).name
        if message.src_component != AUTOPILOT_COMPONENT or name not in (
            self._reader.message,
            "HOME_POSITION",
        ):
            return Outcome.IGNORED
        if is_a(message, wire.HOME_POSITION):
            if not self._reader.take_home(message):
                return Outcome.IMPLAUSIBLE
            if self._reader.home is not None:
                self.track.place_pattern(PatternFrame(self.parameters, self._reader.home))
            return Outcome.USED
        values = values_of(message)
        refused = self._guard.check(time_us, name, values)
        if refused is Outcome.TIME_JUMP:
            self.track.filter.reset()
        elif refused is not None:
            return refused
        fix = self._reader.read(message)
        if fix is None or not self.track.take(time_us, fix):
            return refused or Outcome.WAITING
        self._report(message.src_system)
        return refused or Outcome.UPDATED

    def _report(self, subject: int) -> None:
        track = self.track
        assert track.pattern is not None and track.filter.time_us is not None
        motion = track.filter
        if not motion.distance > self.parameters.off_pattern_gate > 0.0:
            self._distance_sum += motion.distance
            self._distance_count += 1
        state, covariance = track.pattern.motion_ned(motion.state, motion.covariance)
        omega_x, omega_y = motion.omega_rad_s
        if self.parameters.frequency:
            sigmas = [math.sqrt(max(0.0, float(motion.covariance[MOTION + i, MOTION + i]))) for i in (0, 1)]
        else:
            drift_rad_s = self.parameters.epsilon_rad_s if self.parameters.form is Form.PROPOSED else 0.0
            sigmas = [math.sqrt(drift_rad_s * omega) for omega in (omega_x, omega_y)]
        self._estimates = (
            LissajousEstimate(
                time_us=motion.time_us or 0,
                subject=subject,
                north_m=float(state[0]),
                north_m_s=float(state[1]),
                east_m=float(state[2]),
                east_m_s=float(state[3]),
                course_rad=course(state),
                course_variance_rad2=course_variance(state, covariance),
                omega_x_rad_s=omega_x,
                omega_y_rad_s=omega_y,
                omega_x_sigma_rad_s=sigmas[0],
                omega_y_sigma_rad_s=sigmas[1],
                covariance=covariance,
            ),
        )
        best = self._surest
        if best is None or sum(sigmas) < best.omega_x_sigma_rad_s + best.omega_y_sigma_rad_s:
            self._surest = self._estimates[0]

    def reset(self) -> None:
        """Discard everything except parameters and counters."""
        self._guard.reset()
        self._estimates = ()
        self._distance_sum, self._distance_count = 0.0, 0
        self._surest = None
        self._start()

    @property
    def estimates(self) -> Sequence[LissajousEstimate]:
        """The newest estimate."""
        return self._estimates

    @property
    def origin(self) -> GeodeticPosition | None:
        """The pattern's centre."""
        pattern = self.track.pattern
        return None if pattern is None else pattern.frame.origin

    def publish(self) -> Sequence[MAVLinkMessage]:
        """LOCAL_POSITION_NED_COV, relative to the pattern's centre; height and acceleration are not
        estimated.
        """
        if not self._estimates:
            return ()
        e = self._estimates[0]
        unknown = math.nan
        covariance = [unknown] * 45
        order = {0: 0, 1: 2, 3: 1, 4: 3}  # the message's x, y, vx, vy in the estimate's (x, vx, y, vy)
        for (row, column), place in _COVARIANCE_OF.items():
            covariance[place] = float(e.covariance[order[row], order[column]])
        return (
            dialect.MAVLink_local_position_ned_cov_message(
                e.time_us,
                dialect.MAV_ESTIMATOR_TYPE_GPS,
                e.north_m,
                e.east_m,
                unknown,
                e.north_m_s,
                e.east_m_s,
                unknown,
                unknown,
                unknown,
                unknown,
                covariance,
            ),
        )

    def remarks(self) -> Mapping[str, float | str]:
        """Mean squared normalised innovation (4 when the noise is as assumed), the share of samples that were
        off the pattern, and the frequencies at the time of their smallest uncertainty, because the vehicle
        has left the pattern at the end.
        """
        best = self._surest
        omega_x, omega_y = (
            self.track.filter.omega_rad_s if best is None else (best.omega_x_rad_s, best.omega_y_rad_s)
        )
        mean = self._distance_sum / self._distance_count if self._distance_count else math.nan
        return {
            "form": self.parameters.form.value + ("+frequency" if self.parameters.frequency else ""),
            "normalised_innovation": mean,
            **off_pattern_remarks(self.track.filter.off_pattern),
            "omega_x_rad_s": omega_x,
            "omega_y_rad_s": omega_y,
        }
