"""The estimator `relative-pose`: where another aircraft is, from ranges and both aircraft's sensors, without
GPS (Tolman et al. 2021, section III; docs/handoff.md).
"""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, Final

from autopilot_bridge.mavlink.vehicle_range import read_range_payload
from estimators import wire
from estimators.input_guard import InputGuard
from estimators.interface import Estimator, Need, Outcome
from estimators.messages import Message, is_a
from estimators.relative_pose.aircraft import AircraftState
from estimators.relative_pose.belief import PoseMeasurement, RelativePoseBelief
from estimators.relative_pose.estimate import RelativePoseEstimate
from estimators.relative_pose.gaussian_bank import GaussianBank
from estimators.relative_pose.parameters import RelativePoseSettings
from estimators.relative_pose.particle_belief import ParticlePose
from estimators.relative_pose.reported_aircraft import ReportedAircraft

_RANGE: Final = "range"
_STEP_US: Final = 200_000  # between ranges the pose is moved at this interval


class RelativePoseEstimator(Estimator[RelativePoseSettings]):
    """Fuses the ranges of one aircraft with the inertial, magnetic and pressure samples of both.

    Args:
        parameters: noise, numbers and limits.
        other: the other aircraft, which is advanced elsewhere; None: by its messages.

    Attributes:
        pose: the belief.
        own, other: both aircraft.
    """

    NAME: ClassVar[str] = "relative-pose"
    PARAMETERS = RelativePoseSettings
    TEAM: ClassVar[bool] = True

    def __init__(
        self, parameters: RelativePoseSettings | None = None, other: ReportedAircraft | None = None
    ) -> None:
        super().__init__(parameters)
        self.own, self.other = AircraftState(), other or AircraftState()
        self._guard = InputGuard()
        self.reset()

    @property
    def needs(self) -> tuple[Need, ...]:
        """The messages that both aircraft must send; the ranges come from `vehicle` alone."""
        ranges = Need(messages=("TUNNEL",), rate_hz=0.0, purpose="ranges of the radio", optional=True)
        return (*self.own.needs, ranges)

    def reset(self) -> None:
        """Discard everything except the parameters."""
        p = self.parameters
        self.pose: RelativePoseBelief = ParticlePose(p) if p.belief == "particles" else GaussianBank(p)
        self.own.reset()
        self.other.reset()
        self._guard.reset()
        self._moved_us: int | None = None
        self._number: int | None = None
        self._lost = self._ranges = 0
        self._converged_us: int | None = None
        self._estimates: tuple[RelativePoseEstimate, ...] = ()

    def handle(self, time_us: int, message: Message) -> Outcome:
        p = self.parameters
        if message.src_system not in (p.vehicle, p.other):
            return Outcome.IGNORED
        if is_a(message, wire.TUNNEL):
            return self._on_range(time_us, message)
        aircraft = self.own if message.src_system == p.vehicle else self.other
        if isinstance(aircraft, ReportedAircraft):
            return Outcome.IGNORED
        outcome = aircraft.take(time_us, message)
        if outcome is Outcome.TIME_JUMP:
            self.reset()
        elif outcome is Outcome.USED and aircraft is self.own and self._due(time_us):
            return self._step(time_us, math.nan)
        return outcome

    def _due(self, time_us: int) -> bool:
        return self._moved_us is not None and time_us - self._moved_us >= _STEP_US

    def _on_range(self, time_us: int, message: wire.TUNNEL) -> Outcome:
        measured = read_range_payload(message.payload_type, message.payload_length, message.payload)
        p = self.parameters
        if measured is None or message.src_system != p.vehicle or measured.to_system != p.other:
            return Outcome.IGNORED
        refused = self._guard.check(measured.time_us, _RANGE, (measured.range_m,), leads=False)
        if refused is Outcome.TIME_JUMP:
            self.reset()
            return refused
        if refused is not None:
            return refused
        if self._number is not None:
            self._lost += ((measured.number - self._number) & 0xFFFF) - 1
        self._number = measured.number
        self._ranges += 1
        return self._step(time_us, measured.range_m)

    def _step(self, time_us: int, range_m: float) -> Outcome:
        own, other = self.own, self.other
        for aircraft in (own, other):
            if aircraft.newest_us is None or time_us - aircraft.newest_us > aircraft.OLD_US:
                return Outcome.WAITING
        if not (own.moved and other.moved):
            return Outcome.WAITING
        own_motion, other_motion = own.motion(), other.motion(time_us)
        if self._moved_us is not None:
            self.pose.predict((time_us - self._moved_us) * 1e-6, own_motion, other_motion)
        self._moved_us = time_us
        turned = own.heading_rad - other.heading_rad
        self.pose.update(
            PoseMeasurement(
                range_m=range_m,
                down_m=own.height_m - other.height_m,
                heading_rad=math.remainder(turned, math.tau) if math.isfinite(turned) else math.nan,
            )
        )
        if not self.pose.known:
            return Outcome.WAITING
        converged = self.pose.converged
        if converged and self._converged_us is None:
            self._converged_us = time_us
        self._estimates = (
            RelativePoseEstimate(
                time_us=time_us,
                subject=self.parameters.vehicle,
                modes=tuple(self.pose.modes),
                converged=converged,
                resets=self.pose.resets,
            ),
        )
        return Outcome.UPDATED

    @property
    def estimates(self) -> Sequence[RelativePoseEstimate]:
        """The newest estimate."""
        return self._estimates

    def remarks(self) -> Mapping[str, float | str]:
        """Numbers of ranges and resets, consistency, and whether the pose has converged."""
        found: dict[str, float | str] = {
            "ranges": float(self._ranges),
            "ranges_lost": float(self._lost),
            "resets": float(self.pose.resets),
            "consistency": self.pose.consistency,
            "belief": self.parameters.belief,
        }
        if self._converged_us is None:
            found["note"] = "the pose has not converged"
        return found
