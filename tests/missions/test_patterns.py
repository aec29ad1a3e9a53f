"""Pattern geometry: boxes, closure, lengths, curvature, and the legs of the IAMSAR patterns."""

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import ellipe

from missions.errors import PlanError
from missions.patterns import (
    NAMED_PATTERNS,
    ArcLengthTable,
    Lap,
    Lissajous,
    Polyline,
    ergodic,
    expanding_square,
    named_lissajous,
    parallel_sweep,
    sector,
)
from missions.patterns.curve import curvature_per_m
from missions.patterns.lissajous import reduced_ratio

amplitudes = st.floats(1.0, 500.0)
terms = st.integers(1, 9)
phases = st.floats(-math.pi, math.pi)


@given(amplitudes, amplitudes, terms, terms, phases, phases)
def test_lissajous_stays_in_its_box_and_closes(ax, ay, rx, ry, px, py):
    curve = Lissajous(
        amplitude_x_m=ax, amplitude_y_m=ay, ratio_x=rx, ratio_y=ry, phase_x_rad=px, phase_y_rad=py
    )
    assert curve.closed
    assert curve.end == pytest.approx(2 * math.pi / math.gcd(rx, ry))
    points = curve.points(np.linspace(0.0, curve.end, 2001))
    assert np.abs(points[:, 0]).max() <= ay * (1 + 1e-12)
    assert np.abs(points[:, 1]).max() <= ax * (1 + 1e-12)
    assert points[0] == pytest.approx(points[-1], abs=1e-9 * max(ax, ay))
    first, _ = curve.derivatives(np.array([0.0, curve.end]))
    assert first[0] == pytest.approx(first[1], abs=1e-6 * max(ax * rx, ay * ry))


@given(amplitudes, amplitudes, terms, terms, phases)
def test_derivatives_are_those_of_the_points(ax, ay, rx, ry, px):
    curve = Lissajous(amplitude_x_m=ax, amplitude_y_m=ay, ratio_x=rx, ratio_y=ry, phase_x_rad=px)
    u = np.linspace(0.1, 5.0, 7)
    step = 1e-5
    before, after = curve.points(u - step), curve.points(u + step)
    first, second = curve.derivatives(u)
    scale = max(ax, ay) * max(rx, ry) ** 2
    assert (after - before) / (2 * step) == pytest.approx(first, abs=1e-6 * scale)
    assert (after - 2 * curve.points(u) + before) / step**2 == pytest.approx(second, abs=1e-3 * scale)


def test_axes_are_east_and_north():
    curve = Lissajous(amplitude_x_m=30.0, amplitude_y_m=20.0, ratio_x=1, ratio_y=2)
    ((north, east),) = curve.points(np.array([math.pi / 4]))
    assert (north, east) == pytest.approx((20.0, 30.0 * math.sin(math.pi / 4)))


@given(st.integers(1, 40), st.integers(1, 40), st.floats(0.01, 10.0))
def test_rational_frequency_ratio_is_found(a, b, frequency):
    fraction = Fraction(a, b)
    assert reduced_ratio(a * frequency, b * frequency) == (fraction.numerator, fraction.denominator)


def test_irrational_ratio_is_an_open_curve():
    curve = Lissajous.from_frequencies(
        amplitude_x_m=10.0, amplitude_y_m=10.0, frequency_x_rad_s=math.sqrt(2.0), frequency_y_rad_s=1.0
    )
    assert not curve.closed
    with pytest.raises(PlanError, match="only a closed pattern"):
        Lap(curve=curve)


def test_period_of_the_paper_frequencies():
    curve = Lissajous.from_frequencies(
        amplitude_x_m=1.0, amplitude_y_m=1.0, frequency_x_rad_s=math.pi / 2, frequency_y_rad_s=0.7 * math.pi
    )
    assert (curve.ratio_x, curve.ratio_y) == (5, 7)
    assert curve.natural_period_s(math.pi / 2) == pytest.approx(20.0)  # 5 turns of x at 4 s


@settings(deadline=None, max_examples=50)
@given(st.floats(10.0, 80.0), st.floats(10.0, 80.0))
def test_arc_length_and_curvature_of_an_ellipse(a, b):
    curve = Lissajous(amplitude_x_m=a, amplitude_y_m=b, phase_x_rad=math.pi / 2)
    table = ArcLengthTable.of(curve, spacing_m=min(a, b) / 20)
    big, small = max(a, b), min(a, b)
    assert table.length_m == pytest.approx(4 * big * ellipe(1 - (small / big) ** 2), rel=1e-4)
    u = table.u
    exact = a * b / ((a * np.sin(u)) ** 2 + (b * np.cos(u)) ** 2) ** 1.5
    assert np.abs(table.curvature_per_m) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("name", NAMED_PATTERNS)
def test_arc_length_of_named_patterns_against_quadrature(name):
    curve = named_lissajous(name, width_m=100.0, height_m=60.0)

    def speed(u):
        first, _ = curve.derivatives(np.array([u]))
        return float(np.hypot(*first[0]))

    pieces = np.linspace(0.0, curve.end, 65)
    exact = sum(quad(speed, a, b)[0] for a, b in itertools.pairwise(pieces))
    assert ArcLengthTable.of(curve).length_m == pytest.approx(exact, rel=1e-6)


def test_named_patterns_grow_and_none_runs_back_over_itself():
    lengths = []
    for name in NAMED_PATTERNS:
        curve = named_lissajous(name, width_m=100.0, height_m=100.0)
        assert not curve.retraced
        assert ArcLengthTable.of(curve).stops == ()
        lengths.append(ArcLengthTable.of(curve).length_m)
    assert lengths == sorted(lengths)
    assert lengths[0] == pytest.approx(100 * math.pi, rel=1e-6)


def test_retraced_curve_has_its_two_cusps_as_stops():
    curve = Lissajous(amplitude_x_m=50.0, amplitude_y_m=50.0, ratio_x=1, ratio_y=3)
    assert curve.retraced
    table = ArcLengthTable.of(curve)
    assert len(table.stops) == 2
    for k in table.stops:
        assert abs(table.points_m[k][1]) == pytest.approx(50.0, abs=0.1)


def test_curvature_turns_right_positive():
    east_then_south = np.array([[0.0, 1.0]]), np.array([[-1.0, 0.0]])
    assert curvature_per_m(*east_then_south)[0] == pytest.approx(1.0)


@given(st.integers(1, 4), st.floats(0.0, 0.99), st.sampled_from(["L1", "L2", "L3"]))
def test_laps_continue_the_curve(laps, start, name):
    curve = named_lissajous(name, width_m=80.0, height_m=80.0)
    lapped = Lap(curve=curve, laps=laps, start=start)
    once = ArcLengthTable.of(curve).length_m
    table = ArcLengthTable.of(lapped)
    assert table.length_m == pytest.approx(laps * once, rel=1e-4)
    assert table.points_m[0] == pytest.approx(curve.points(np.array([start * curve.end]))[0], abs=1e-6)
    assert table.points_m[0] == pytest.approx(table.points_m[-1], abs=1e-6)


@pytest.mark.parametrize("bad", [0.0, -5.0, math.nan, math.inf])
def test_empty_or_endless_patterns_are_refused(bad):
    with pytest.raises(PlanError, match="empty"):
        named_lissajous("L1", width_m=bad, height_m=10.0)
    for make in (
        lambda: sector(radius_m=bad),
        lambda: parallel_sweep(width_m=bad, height_m=10.0, spacing_m=2.0),
        lambda: expanding_square(size_m=100.0, spacing_m=bad),
    ):
        with pytest.raises(PlanError, match="more than 0"):
            make()


def test_unknown_named_pattern_lists_the_known():
    with pytest.raises(PlanError, match="'L9' is not known; there are L1, L2, L3, L4"):
        named_lissajous("L9", width_m=1.0, height_m=1.0)


def turns_deg(line: Polyline) -> list[float]:
    legs = np.diff(np.array(line.vertices_m), axis=0)
    courses = np.degrees(np.arctan2(legs[:, 1], legs[:, 0]))
    return [round(float((b - a + 180.0) % 360.0 - 180.0), 6) for a, b in itertools.pairwise(courses)]


@given(st.floats(5.0, 500.0), st.floats(-math.pi, math.pi))
def test_sector_search_legs_and_turns(radius, heading):
    line = sector(radius_m=radius, heading_rad=heading)
    r = radius
    assert line.leg_lengths_m == pytest.approx((r, r, 2 * r, r, 2 * r, r, r))
    assert turns_deg(line) == pytest.approx([120.0] * 6)
    assert line.closed
    assert line.vertices_m[0] == (0.0, 0.0)
    bearings = {round(math.degrees(math.atan2(e, n) - heading)) % 360 for n, e in line.vertices_m[1:-1]}
    assert bearings == {0, 60, 120, 180, 240, 300}


def test_second_sector_search_is_turned_thirty_degrees():
    line = sector(radius_m=100.0, passes=2)
    assert line.length_m == pytest.approx(1800.0)
    n, e = line.vertices_m[8]
    assert math.degrees(math.atan2(e, n)) == pytest.approx(30.0)


@given(st.floats(20.0, 300.0), st.floats(20.0, 300.0), st.floats(2.0, 15.0))
def test_parallel_sweep_leaves_no_strip_unseen(width, height, spacing):
    line = parallel_sweep(width_m=width, height_m=height, spacing_m=spacing)
    vertices = np.array(line.vertices_m)
    legs = line.leg_lengths_m
    long_legs, steps = legs[0::2], legs[1::2]
    assert long_legs == pytest.approx([max(width, height) - spacing] * len(long_legs))
    short = min(width, height)
    assert len(long_legs) == math.ceil(short / spacing - 1e-9)
    assert all(step <= spacing * (1 + 1e-9) for step in steps)
    across = np.abs(vertices[:, 1] if height >= width else vertices[:, 0]).max()
    assert across == pytest.approx(0.5 * short - 0.5 * short / len(long_legs))
    assert np.abs(vertices).max() <= 0.5 * max(width, height)


def test_parallel_sweep_too_wide_a_spacing_names_the_limit():
    with pytest.raises(PlanError, match="spacing below 40 m"):
        parallel_sweep(width_m=30.0, height_m=40.0, spacing_m=50.0)


@given(st.integers(1, 12), st.floats(2.0, 20.0))
def test_expanding_square_legs_and_turns(turns, spacing):
    line = expanding_square(size_m=turns * spacing * 1.001, spacing_m=spacing)
    expected = [spacing * (k // 2 + 1) for k in range(2 * turns)] + [turns * spacing]
    assert line.leg_lengths_m == pytest.approx(expected)
    assert turns_deg(line) == pytest.approx([90.0] * (2 * turns))
    assert np.ptp(np.array(line.vertices_m), axis=0).max() <= turns * spacing * 1.001


def test_later_passes_are_longer_and_joined():
    for make in (
        lambda n: expanding_square(size_m=60.0, spacing_m=10.0, passes=n),
        lambda n: parallel_sweep(width_m=60.0, height_m=60.0, spacing_m=10.0, passes=n),
    ):
        assert make(2).length_m >= 2 * make(1).length_m - 1e-9


@given(st.floats(0.3, 5.0))
def test_rounded_corners_stay_near_their_corners_and_turn_smoothly(corner):
    line = expanding_square(size_m=100.0, spacing_m=20.0)
    curve = line.rounded(corner)
    table = ArcLengthTable.of(curve)
    assert table.stops == ()
    for n, e in line.vertices_m[1:-1]:
        distance = np.hypot(table.points_m[:, 0] - n, table.points_m[:, 1] - e).min()
        assert distance <= corner * 1.01
    assert np.abs(np.diff(table.curvature_per_m)).max() < 0.2 * np.abs(table.curvature_per_m).max()
    assert table.length_m < line.length_m
    assert np.degrees(table.course_rad[-1] - table.course_rad[0]) == pytest.approx(90.0 * 10)


def test_sharp_corners_are_stops_and_turning_back_is_possible():
    line = Polyline(((0.0, 0.0), (50.0, 0.0), (50.0, 30.0), (50.0, 0.0)))
    assert len(ArcLengthTable.of(line).stops) == 2
    assert len(ArcLengthTable.of(line.rounded(1.0)).stops) == 1


def test_legs_of_no_length_are_refused():
    with pytest.raises(PlanError, match="leg of no length"):
        Polyline(((0.0, 0.0), (0.0, 0.0)))
    with pytest.raises(PlanError, match="fewer than two points"):
        Polyline(((0.0, 0.0),))


def test_ergodic_coverage_gives_each_part_of_the_area_its_share_of_the_time():
    curve = ergodic(width_m=120.0, height_m=80.0, spacing_m=8.0, length_m=12_000.0, heading_rad=0.4)
    assert curve.length_m == pytest.approx(12_000.0, abs=8.0)
    places = np.array(curve.vertices_m)
    assert np.abs(places).max(axis=0) == pytest.approx([40.0, 60.0], abs=8.0)  # single turns lead out
    inside = places[(np.abs(places) < (36.0, 56.0)).all(axis=1)]
    shares = np.histogram2d(inside[:, 0], inside[:, 1], bins=(3, 4), range=((-36, 36), (-56, 56)))[0]
    assert shares.min() > 0.6 * shares.mean() and shares.max() < 1.4 * shares.mean()
    legs = np.diff(places, axis=0)
    turns = np.abs(np.diff(np.unwrap(np.arctan2(legs[:, 1], legs[:, 0]))))
    assert turns.max() <= math.pi / 2.0 + 1e-9


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"spacing_m": 50.0}, "at most 40 m"),
        ({"length_m": math.nan}, "length nan"),
        ({"width_m": -1.0}, "width -1"),
    ],
)
def test_an_ergodic_pattern_that_does_not_fit_is_refused(changes, reason):
    sides = {"width_m": 120.0, "height_m": 80.0, "spacing_m": 8.0, "length_m": 500.0}
    with pytest.raises(PlanError, match=reason):
        ergodic(**sides | changes)
