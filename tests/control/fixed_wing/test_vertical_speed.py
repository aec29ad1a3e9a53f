"""Vertical speed by pitch alone: against lift in closed form, and flown."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot_bridge.control.fixed_wing import FixedWingParameters
from autopilot_bridge.control.fixed_wing import layout as c
from autopilot_bridge.control.fixed_wing.vertical import pitch_for_climb
from autopilot_bridge.navigation import layout as n
from flightsim.environment import CosineGust, Environment
from flightsim.foundation.records import new_record, the_record, viewed
from tests.control.fixed_wing.aerosonde import AEROSONDE
from tests.control.fixed_wing.rig import Rig
from tests.control.fixed_wing.test_lateral import packed

DT_S = 0.02
G_M_S2 = 9.80665
PARAMETERS = FixedWingParameters.for_envelope(AEROSONDE)
LOWEST, HIGHEST = math.radians(-20.0), math.radians(20.0)
DOWN = n.VEL_NED_M_S.start + 2
PITCH = n.EULER_RAD.start + 1
FORCE_DOWN = n.SPECIFIC_FORCE_FRD_M_S2.start + 2


class Law:
    """The law alone, at a state of motion."""

    def __init__(
        self, *, airspeed_m_s: float = 25.0, climb_m_s: float = 0.0, pitch_rad: float, bank_rad: float = 0.0
    ) -> None:
        self.nav, self.p, self.s = np.zeros(n.NAV_SIZE), packed(PARAMETERS), new_record(c.FixedWingState)
        self.motion = the_record(viewed(self.nav, n.NavigationState), n.NavigationState)
        self.nav[n.AIRSPEED_M_S] = self.s.eas = airspeed_m_s
        self.nav[DOWN] = -climb_m_s
        self.nav[PITCH] = pitch_rad
        self.s.eas_to_tas = 1.0
        self.s.roll_setpoint = bank_rad
        self.s.climb_flown = 1.0  # as if flown so for a while
        self.feel(self.load_factor(airspeed_m_s, pitch_rad - climb_m_s / airspeed_m_s))

    @staticmethod
    def load_factor(airspeed_m_s: float, angle_of_attack_rad: float) -> float:
        """Of the wing as modelled, in still air."""
        lifting_rad = angle_of_attack_rad - PARAMETERS.trim_pitch_rad + PARAMETERS.lift_angle_rad
        return lifting_rad / PARAMETERS.lift_angle_rad * (airspeed_m_s / PARAMETERS.airspeed_trim_m_s) ** 2

    def feel(self, load_factor: float) -> None:
        """What the accelerometers measure from now on."""
        self.nav[FORCE_DOWN] = -load_factor * G_M_S2

    def pitch(self, climb_m_s: float, lowest: float = LOWEST, highest: float = HIGHEST) -> float:
        return float(pitch_for_climb(self.motion, self.p, self.s, DT_S, climb_m_s, lowest, highest))


def level_pitch(airspeed_m_s: float, load_factor: float = 1.0) -> float:
    """Lift is weight times load factor: angle of attack over that of zero lift, as 1 over V^2."""
    lift = PARAMETERS.lift_angle_rad
    ratio = PARAMETERS.airspeed_trim_m_s / airspeed_m_s
    return PARAMETERS.trim_pitch_rad + lift * (load_factor * ratio**2 - 1.0)


@given(st.floats(18.0, 33.0), st.floats(0.0, 0.8))
def test_nothing_to_correct_is_the_pitch_of_level_flight(airspeed_m_s: float, bank_rad: float) -> None:
    pitch = level_pitch(airspeed_m_s, 1.0 / math.cos(bank_rad))
    law = Law(airspeed_m_s=airspeed_m_s, pitch_rad=pitch, bank_rad=bank_rad)
    assert law.pitch(0.0) == pytest.approx(pitch, abs=1e-12)


@given(st.floats(-3.0, 3.0))
def test_a_climb_that_is_flown_tilts_the_pitch_by_its_path(climb_m_s: float) -> None:
    pitch = level_pitch(25.0) + climb_m_s / 25.0
    law = Law(climb_m_s=climb_m_s, pitch_rad=pitch)
    assert law.pitch(climb_m_s) == pytest.approx(pitch, abs=1e-12)


def test_a_gust_is_answered_by_the_lift_of_the_moment() -> None:
    """The airspeed of now counts, not the filtered one: a lull asks for more angle of attack at once."""
    law = Law(pitch_rad=level_pitch(25.0))
    law.nav[n.AIRSPEED_M_S] = 20.0
    law.feel(law.load_factor(20.0, level_pitch(25.0)))  # the wing feels the same lull
    missing = level_pitch(20.0) - level_pitch(25.0)
    # the error of the pitch is added once more, so that it follows sooner
    assert law.pitch(0.0) == pytest.approx(level_pitch(25.0) + 2.0 * missing)


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_more_climb_is_never_less_pitch(first: float, second: float) -> None:
    low, high = sorted((first, second))
    pitches = [Law(pitch_rad=level_pitch(25.0)).pitch(climb) for climb in (low, high)]
    assert pitches[0] <= pitches[1] + 1e-12


def test_acceleration_is_limited_and_so_is_the_angle_of_attack() -> None:
    law = Law(pitch_rad=level_pitch(25.0))
    pitch = float(pitch_for_climb(law.motion, law.p, law.s, 0.0, 20.0, -3.0, 3.0))
    # the error of the pitch counts twice
    assert pitch - level_pitch(25.0) == pytest.approx(2.0 * 0.8 * PARAMETERS.lift_angle_rad)
    stalling = Law(airspeed_m_s=10.0, pitch_rad=0.0)  # below the stall speed: no more than the wing carries
    most = (PARAMETERS.airspeed_trim_m_s / PARAMETERS.airspeed_stall_m_s) ** 2
    highest = PARAMETERS.trim_pitch_rad + PARAMETERS.lift_angle_rad * (most - 1.0)
    pitch = float(pitch_for_climb(stalling.motion, stalling.p, stalling.s, 0.0, 0.0, -3.0, 3.0))
    assert pitch <= 2.0 * highest + 1e-9


@settings(deadline=None)
@given(st.floats(-0.3, 0.3), st.floats(-8.0, 8.0), st.floats(-4.0, 4.0))
def test_stays_within_its_limits(pitch_rad: float, climb_m_s: float, load_factor: float) -> None:
    law = Law(pitch_rad=pitch_rad)
    law.feel(load_factor)
    low, high = math.radians(0.0), math.radians(4.0)
    for _ in range(250):
        assert low <= law.pitch(climb_m_s, low, high) <= high
    assert abs(law.s.liftless_pitch) <= 0.2


@given(st.floats(-0.05, 0.05))
def test_lift_that_a_downdraught_takes_is_made_up_by_pitch(gust_rad: float) -> None:
    """Felt as lift that the pitch does not explain; at once a part, in the end all of it."""
    pitch = level_pitch(25.0)
    law = Law(pitch_rad=pitch)
    law.feel(law.load_factor(25.0, pitch - gust_rad))
    law.pitch(0.0)
    assert law.s.liftless_pitch == pytest.approx(gust_rad / 11.0, abs=1e-12)  # 0.02 s of a lag of 0.2 s
    for _ in range(100):
        law.pitch(0.0)
    assert law.s.liftless_pitch == pytest.approx(gust_rad, abs=1e-5)
    assert law.pitch(0.0) == pytest.approx(pitch + 2.0 * gust_rad, abs=1e-4)


def test_forces_that_are_not_known_change_nothing() -> None:
    law = Law(pitch_rad=level_pitch(25.0))
    law.s.liftless_pitch = 0.02
    law.nav[FORCE_DOWN] = math.nan
    law.pitch(0.0)
    assert law.s.liftless_pitch == 0.02


def test_takes_over_from_the_pitch_flown_so_far() -> None:
    law = Law(pitch_rad=0.1)
    law.nav[FORCE_DOWN] = math.nan
    law.s.climb_flown, law.s.pitch_setpoint = 0.0, 0.1
    assert law.pitch(0.0) == pytest.approx(0.1, abs=1e-9)
    assert law.s.climb_flown == 1.0


def test_unknown_airspeed_and_climb_leave_a_pitch() -> None:
    law = Law(pitch_rad=level_pitch(25.0))
    law.nav[n.AIRSPEED_M_S] = law.nav[DOWN] = math.nan
    assert law.pitch(0.0) == pytest.approx(level_pitch(25.0))


def flown(rig: Rig, climb_m_s: float, duration_s: float) -> np.ndarray:
    """Climb rates, 50 a second, of so long with pitch for the climb and a throttle that is given."""
    rig.set(height_rate_m_s=climb_m_s, throttle=0.6, heading_rad=0.0)
    return -rig.run(duration_s)[:, DOWN]


def test_climb_rates_are_flown_within_a_second() -> None:
    rig = Rig(AEROSONDE)
    flown(rig, -1.5, 4.0)
    climbs = flown(rig, -0.5, 3.0)
    assert np.abs(climbs[60:] + 0.5).max() < 0.2 and np.abs(climbs[100:] + 0.5).max() < 0.1
    assert climbs.max() < -0.25  # overshoots by less than a quarter
    assert np.argmax(climbs > -0.75) * DT_S < 0.8


@pytest.mark.parametrize("gust_m_s", [4.0, -4.0])
@pytest.mark.slow
def test_a_gust_along_the_path_moves_the_sink_little(gust_m_s: float) -> None:
    """Held by pitch alone; flying on with the pitch as it was would change the sink by 2 m/s and more."""
    gust = CosineGust(start_s=6.0, velocity_ned_m_s=(gust_m_s, 0.0, 0.0), rise_s=0.7, hold_s=1.0, fall_s=0.7)
    rig = Rig(AEROSONDE, environment=Environment(gusts=(gust,)))
    flown(rig, -1.0, 6.0)
    climbs = flown(rig, -1.0, 3.5)
    assert np.abs(climbs + 1.0).max() < 0.8
    assert np.sqrt(np.mean((climbs + 1.0) ** 2)) < 0.4


@pytest.mark.parametrize("gust_m_s", [2.5, -2.5])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_a_downdraught_moves_the_sink_little(gust_m_s: float) -> None:
    """Answered by the sink alone, without the lift that is felt, it changed it by 1.3 m/s."""
    gust = CosineGust(start_s=6.0, velocity_ned_m_s=(0.0, 0.0, gust_m_s), rise_s=0.3, hold_s=1.0, fall_s=0.3)
    rig = Rig(AEROSONDE, environment=Environment(gusts=(gust,)))
    flown(rig, -1.0, 6.0)
    climbs = flown(rig, -1.0, 3.0)
    assert np.abs(climbs + 1.0).max() < 0.9
    assert np.sqrt(np.mean((climbs + 1.0) ** 2)) < 0.5
