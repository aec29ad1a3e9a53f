"""The tracking aircraft of the study `handoff`: its camera, its tracks, its operator, and its orbit.

Nothing of it reads the truth: it gets what its sensors and its picture give, and a person's answers. The
exception is the operator `watches`, which is an upper bound.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.handoff.aircraft_tracks import AircraftTracks
from estimators.handoff.designation import Designation
from estimators.handoff.process import TrackerReport
from estimators.orbit_target.relative_target import RelativeState
from estimators.relative_pose import LevelMotion
from estimators.vision.ground_points import CameraAxes, on_ground
from flightsim.foundation.vectors import LevelVector
from missions.planning.orbit_guidance import OrbitGuidance
from missions.studies.handoff_operator import Person, PersonParameters, Pixel, slip
from missions.studies.handoff_world import FOCAL_PX, PERSON_M, HandoffWorld, targets_of
from missions.studies.options import Operator

__all__ = ["SEARCH_ROLL_RAD", "Tracker", "orbit_roll"]

Array = NDArray[np.float64]

SEARCH_ROLL_RAD: Final = math.radians(15.0)
"""Of the circle that is flown while it is not known where the target is."""

_SURE: Final = 0.995  # with a smaller probability of the identity, which limits that of the decision, the
# operator is asked
_DOUBT_S: Final = 4.0  # for which it must be doubtful: looks may settle it
_ASK_AGAIN_S: Final = 15.0
_CLICKED_M: Final = 12.0  # a track that is this close to the clicked place is meant
_NOT_SEEN: Final = 0.9  # probability that a marked track is another target, when the person sees none
_WATCHES_S: Final = 5.0  # time that the operator who watches takes
_APART_M: Final = 10.0  # the one who watches distinguishes targets that are farther from each other


class Tracker:
    """The tracking aircraft.

    Args:
        world: what its sensors measure.
        tracks: of the moving objects.
        operator: who designates the target.
        pilot: of its orbit around the target.
        rng: of the person.

    Attributes:
        tracks: as given.
        designation: which of them is the target.
        person: the operator, as far as it is a model of a person.
    """

    def __init__(
        self,
        world: HandoffWorld,
        tracks: AircraftTracks,
        operator: Operator,
        pilot: OrbitGuidance,
        rng: np.random.Generator,
    ) -> None:
        self._world = world
        self.tracks = tracks
        self.designation = Designation()
        self._operator = operator
        self._pilot = pilot
        self.person = Person(PersonParameters(), rng)
        forward, right = world.cue()
        self._goal: Array = tracks.reckoning.placed(np.array([[forward, right]]))[0]
        self._doubtful_us: int | None = 0
        self._asked_us = -math.inf

    def step(self) -> tuple[LevelMotion, TrackerReport]:
        """Take a frame; returns the motion since the last one, and the report."""
        world, which, designation = self._world, HandoffWorld.TRACKER, self.designation
        motion = world.motion(which)
        self.tracks.move(1.0 / world.setting.rate_hz, motion)
        pointing = self._aim()
        frame = world.frame(which, pointing)
        if frame is not None:
            self.tracks.scan(world.time_us, frame.places, frame.covariances, looks=frame.looks)
            designation.update(world.time_us, self.tracks.places, self.tracks.looks, self.tracks.doubtful)
        if self._operator is Operator.WATCHES:
            self._watch()
        else:
            self._ask_person(pointing)
        if designation.expected is not None:
            self._goal = np.array(designation.expected)
        return motion, TrackerReport(
            tracks=self.tracks.level(), number=designation.number, identity=designation.probability
        )

    @property
    def roll_rad(self) -> float:
        """Commanded roll: an orbit around the target's track, or around where it is expected."""
        world, which = self._world, HandoffWorld.TRACKER
        return orbit_roll(
            self._pilot, world.time_us, self._aim(), world.ground_velocity(which), world.roll_rad(which)
        )

    def _aim(self) -> LevelVector:
        """Forward and right of the target's track, or of where it is expected."""
        if self._operator is Operator.WATCHES and self.designation.number is None:
            true = self._world.seen_from(HandoffWorld.TRACKER, self._world.targets)
            return float(true[0, 0]), float(true[0, 1])
        (place,) = self.tracks.reckoning.level(self._goal[None]).tolist()
        return place[0], place[1]

    # the operator as a person

    def _ask_person(self, pointing: LevelVector) -> None:
        world, designation, person = self._world, self.designation, self.person
        now_us = world.time_us
        doubtful = designation.number is None or designation.probability < _SURE
        if not doubtful:
            self._doubtful_us = None
        elif self._doubtful_us is None:
            self._doubtful_us = now_us
        if not person.waiting:
            first = not person.asked
            again = (
                self._operator is Operator.CONFIRMS
                and self._doubtful_us is not None
                and now_us - self._doubtful_us >= 1e6 * _DOUBT_S
                and now_us - self._asked_us >= 1e6 * _ASK_AGAIN_S
            )
            if not (first or again) or not person.ask(now_us):
                return
            self._asked_us = now_us
        camera = world.known_camera(HandoffWorld.TRACKER, pointing)
        places = self._in_picture(camera)
        marked = None if designation.number is None else places.get(designation.number)
        answer = person.look(now_us, world.picture(HandoffWorld.TRACKER, pointing), marked)
        if answer is None:
            return
        if answer.yes and designation.number is not None:
            number: int | None = designation.number
        elif answer.point is not None:
            number = self._clicked(camera, answer.point)
        else:
            if designation.number is not None:
                designation.refuse(designation.number, _NOT_SEEN)
            return
        if number is not None:
            self._designate(places, number, clear=answer.clear)

    def _in_picture(self, camera: CameraAxes) -> dict[int, Pixel]:
        """Where the tracks are in the picture, from its middle, by number."""
        level = self.tracks.level()
        if not level:
            return {}
        height_m = self._world.setting.heights_m[HandoffWorld.TRACKER]
        points = camera.project(np.column_stack((list(level.values()), np.full(len(level), height_m))))
        return {
            number: (FOCAL_PX * x, FOCAL_PX * y)
            for number, (x, y) in zip(level, points.tolist(), strict=True)
            if math.isfinite(x)
        }

    def _clicked(self, camera: CameraAxes, point: Pixel) -> int | None:
        """The track at a point of the picture; without one, the point is where the next track will be."""
        height_m = self._world.setting.heights_m[HandoffWorld.TRACKER]
        directions = camera.directions(np.array([point]) / FOCAL_PX)
        place = on_ground(directions, height_m, 0.0)[0][0]
        if not np.isfinite(place).all():
            return None
        off = {k: math.dist(place, there) for k, there in self.tracks.level().items()}
        number = min(off, key=lambda k: off[k], default=None)
        if number is not None and off[number] <= _CLICKED_M:
            return number
        x_m, y_m = self.tracks.reckoning.placed(place[None])[0].tolist()
        self.designation.designate_place(self._world.time_us, (x_m, y_m), 1.0 - self.person.parameters.lapse)
        return None

    def _designate(self, places: dict[int, Pixel], number: int, *, clear: bool) -> None:
        """Designate the track that the person means.

        Args:
            places: of the tracks in the picture.
            number: of the track.
            clear: the person saw no other one close to it: tracks that are close are of the same target.
        """
        p, designation = self.person.parameters, self.designation
        same, sure = {number, *designation.beside(number)}, 1.0 - p.lapse
        here = places.get(number)
        if here is None:
            sure = 0.5  # it has left the picture
        else:
            height_m = self._world.setting.heights_m[HandoffWorld.TRACKER]
            height_px = FOCAL_PX * PERSON_M / math.hypot(*self.tracks.level()[number], height_m)
            away_px = {k: math.dist(here, there) for k, there in places.items() if k not in same}
            if clear:
                same |= {k for k, away in away_px.items() if away < p.clear_px}
            for k in away_px.keys() - same:
                sure *= 1.0 - slip(away_px[k], height_px, p)
        designation.designate(
            self._world.time_us, number, self.tracks.places[number], sure, frozenset(same - {number})
        )

    # the operator who watches

    def _watch(self) -> None:
        """Designate the true target, when it has no track or its identity is doubtful."""
        world, designation, now_us = self._world, self.designation, self._world.time_us
        if designation.number is not None and designation.probability >= _SURE:
            self._doubtful_us = None
            return
        if self._doubtful_us is None:
            self._doubtful_us = now_us
        waited_s = (now_us - self._doubtful_us) * 1e-6
        close = np.hypot(*(world.targets[1:] - world.targets[0]).T) < _APART_M
        if waited_s < (_WATCHES_S if designation.count else 0.0) or close.any():
            return
        seen = world.apparent(HandoffWorld.TRACKER)
        for number, target in targets_of(self.tracks.level(), seen).items():
            if target == 0:
                designation.designate(now_us, number, self.tracks.places[number])


def orbit_roll(
    pilot: OrbitGuidance, time_us: int, target: LevelVector, velocity: tuple[float, float], roll_rad: float
) -> float:
    """Roll of the orbit guidance; everything in the level frame, in which the heading is 0."""
    state = RelativeState(
        time_us=time_us, offset_ne_m=target, offset_rate_ne_m_s=(-velocity[0], -velocity[1]), offset_std_m=0.0
    )
    return pilot.command(state, 0.0, roll_rad).roll_rad
