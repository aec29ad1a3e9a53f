"""What a take-off and a landing need to know beyond the firmware's parameters.

Neither firmware has parameters for these values. Unless an attribute names another source, its value was
chosen with `benchmarks/aircraft_landings.py`: many landings of several aircraft in wind and turbulence.
"""

import math
from dataclasses import dataclass

from flightsim.foundation.checks import Count, Finite, Positive
from flightsim.foundation.options import Options


@dataclass(frozen=True, slots=True, kw_only=True)
class ClimbOutParameters(Options):
    """The climb-out of a take-off.

    Attributes:
        reached_m: the take-off is done this far below its height.
        capture_s: time of climb before the height in which climb-rate control becomes height control.
        climb_share: share of the greatest climb rate that is commanded, so that throttle remains for control.
        fast_share: above this multiple of the climb-out's airspeed there is more power than the climb takes.
        low_m: height over the ground below which the wing tips have no room (half a wing span, of small
            aircraft).
        left_ground_m: height over the start from which the aircraft counts as in the air.
    """

    reached_m: Positive = 1.5
    capture_s: Positive = 3.0
    climb_share: Positive = 0.9
    fast_share: Positive = 1.15
    low_m: Positive = 2.0
    left_ground_m: Positive = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LandingParameters(Options):
    """Circle, approach, go-around and roll-out of a landing.

    Attributes:
        calm_m_s: less wind than this does not choose the direction of the landing.
        runway_near_home_m: within this distance of home, a landing in calm air takes the runway's direction.
        shallow_share: a leg shallower than this share of the landing angle is flown level until the slope.
        shortest_leg_m: a shorter leg is no approach.
        entry_height_m: the circle is left within this distance of its height.
        entry_course_rad: the circle is left within this angle of the approach's course.
        entry_share: the circle is left within this share of its radius around the entry.
        before_entry_radii: a leg is taken up from this many loiter radii before its beginning.
        along_leg_share: a leg is taken up no later than after this share of its length.
        too_high_m: farther above the entry the aircraft circles down first.
        blind_m: below this height over the ground a landing without a position continues straight ahead.
        free_bank_m: above this height over the ground the bank is not limited for the wing tips.
        low_m: height over the ground of the smallest limits of bank and dive (half a wing span, of small
            aircraft).
        short_final_m: below this height over the ground pitch flies the path and throttle the airspeed.
        missed_m: still in the air this far beyond the place, the aircraft goes around.
        aside_m: on short final this far beside the runway, the aircraft goes around.
        beyond_s: the aircraft goes around where it would touch down farther beyond the place than it flies in
            this time at the approach's airspeed.
        decided_m: below this height over the ground it lands all the same.
        go_arounds: number of go-arounds because of a late touch; the next landing is completed.
        slope_gain: of the height error on the slope, which is held more tightly than heights elsewhere (PX4:
            FW_LND_THRTC_SC).
        dive_free_m: above this height over the ground the nose may go down as far as anywhere.
        dive_low_rad: lowest pitch of the approach at `low_m`.
        latest_flare_share: the flare begins at the latest this share of FW_LND_FL_TIME before the ground.
        standing_m_s: at a lower ground speed the aircraft stands.
        brake_after_s: the brakes are applied this long after the touch.
        nose_down_s: time in which the nose comes down after the touch.
        bounced_m: so high over the ground after the touch the aircraft flies again.
        bounce_s: a bounce happens within this time of the touch.
    """

    calm_m_s: Positive = 1.0
    runway_near_home_m: Positive = 300.0
    shallow_share: Positive = 0.5
    shortest_leg_m: Positive = 30.0
    entry_height_m: Positive = 4.0
    entry_course_rad: Positive = math.radians(20.0)
    entry_share: Positive = 0.4
    before_entry_radii: Positive = 1.5
    along_leg_share: Positive = 0.3
    too_high_m: Positive = 25.0
    blind_m: Positive = 30.0
    free_bank_m: Positive = 15.0
    low_m: Positive = 2.0
    short_final_m: Positive = 12.0
    missed_m: Positive = 40.0
    aside_m: Positive = 20.0
    beyond_s: Positive = 0.75
    decided_m: Positive = 0.12
    go_arounds: Count = 3
    slope_gain: Positive = 0.4
    dive_free_m: Positive = 25.0
    dive_low_rad: Finite = math.radians(-1.0)
    latest_flare_share: Positive = 0.6
    standing_m_s: Positive = 1.5
    brake_after_s: Positive = 1.5
    nose_down_s: Positive = 1.0
    bounced_m: Positive = 0.3
    bounce_s: Positive = 3.0

    def check_together(self) -> None:
        if not (self.low_m < self.free_bank_m and self.low_m < self.dive_free_m):
            raise ValueError(
                f"low_m = {self.low_m} is not below free_bank_m = {self.free_bank_m} and dive_free_m = "
                f"{self.dive_free_m}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class FlareParameters(Options):
    """The flare.

    Attributes:
        align_m: below this height over the ground the nose is turned onto the runway's course.
        touch_m: below this height of the wheels, by the rangefinder, for `touch_s` the aircraft touches: a
            shorter time is a gust.
        touch_s: see `touch_m`.
        still_m_s: with less vertical speed for `still_s` the aircraft stands on the ground.
        still_s: see `still_m_s`.
        still_m: it stands only below this height by the rangefinder, whose ground may be grass.
        shortest_s: no touch is accepted before this time.
        long_s: a flare that lasts longer has reached ground that is higher than assumed.
        pitch_blend_s: time in which the limits of the pitch close in on those of the flare.
        pitch_free_m: above this height over the ground a gust may ask for a lower nose than the flare's.
        pitch_free_rad_m: the lowest pitch decreases by this angle for each metre above `pitch_free_m`.
        height_gain: of the height error, over the time constant of the pitch.
        lead: time constants of the pitch by which the path is led.
        firmest_m_s: greatest sink over that of the touch, at the ground.
        firmer_1_s: and more for each metre of height.
        late_1_s: sink added for each metre flown beyond the place.
        late_m_s: greatest sink added for that (ArduPilot: TECS_LAND_SRC).
        softest_share: smallest sink, as a share of that of the touch.
        airspeed_share: share of the approach's airspeed that is held in the flare.
        head_wind_share: share of the head wind at the touch that is added to it (ArduPlane: LAND_WIND_COMP
            adds half of it).
        power_share: share of the trim throttle that flies the glide slope.
        power_gain: throttle for each share of the airspeed that is missing.
    """

    align_m: Positive = 1.0
    touch_m: Positive = 0.12
    touch_s: Positive = 0.1
    still_m_s: Positive = 0.25
    still_s: Positive = 0.6
    still_m: Positive = 0.5
    shortest_s: Positive = 1.0
    long_s: Positive = 6.0
    pitch_blend_s: Positive = 1.0
    pitch_free_m: Positive = 0.4
    pitch_free_rad_m: Positive = math.radians(3.0)
    height_gain: Positive = 0.5
    lead: Positive = 1.2
    firmest_m_s: Positive = 0.6
    firmer_1_s: Positive = 0.5
    late_1_s: Positive = 0.06
    late_m_s: Positive = 0.8
    softest_share: Positive = 0.5
    airspeed_share: Positive = 0.94
    head_wind_share: Positive = 0.25
    power_share: Positive = 0.6
    power_gain: Positive = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceWindParameters(Options):
    """The wind assumed close to the ground.

    Attributes:
        roughness_m: roughness length of open country with grass (MIL-F-8785C, paragraph 3.7.3.2); ten times
            that lowers the share of the wind at 5 m by 0.16.
        known_at_m: the filter's wind is the wind from this height over the ground up.
        lowest_known_m: smallest height at which an approach can know the wind.
        ahead_s: an engine's spin-up, and the time that the airspeed needs to follow.
        lowest_m: power that is commanded at a lower height acts after the touch.
        corrected_s: time constant of the correction by the measured airspeed: longer than gusts close to the
            ground, shorter than the last part of the slope.
    """

    roughness_m: Positive = 0.05
    known_at_m: Positive = 30.0
    lowest_known_m: Positive = 5.0
    ahead_s: Positive = 1.5
    lowest_m: Positive = 0.5
    corrected_s: Positive = 6.0
