"""A survey of the true field: the content and the errors of a published magnetic map.

An aircraft flies parallel lines north and south and reads the total field along them; a few tie lines cross
them. Processing takes the daily variation out by a base station and levels the lines by their crossings,
which leaves an error of each line, and a grid is interpolated between the lines (Akima's splines, the usual
choice of bi-directional gridding). See Reeves, "Aeromagnetic Surveys" (2005), chapters 3 to 5.

So the published map differs from the truth by the field between the lines, by stripes along them, and by
noise. The survey states this difference as the standard deviation of its tie lines about its map.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import NotNegative, Positive
from flightsim.foundation.options import Options
from flightsim.payload.magnetic_map import MagneticMap

Array = NDArray[np.float64]

_SPEED_M_S: Final = 60.0
_TIE_SPACING: Final = 5.0  # of tie lines, in line spacings


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyParameters(Options):
    """A survey by a light aircraft at low height, processed with care.

    Attributes:
        line_spacing_m: distance of the lines, at most.
        noise_nt: one sigma of a point along a line, white.
        levelling_nt: one sigma of the level of a line, after levelling.
        diurnal_nt, diurnal_time_constant_s: Gauss-Markov; what the base station leaves of the daily
            variation.
        track_error_m, height_error_m: one sigma of the survey aircraft's distance from the line and the
            height that the readings are taken for; both Gauss-Markov along the line.
        wander_m: along-line distance in which these change.
        gradient_error_nt_m: one sigma of a line's vertical gradient.
    """

    line_spacing_m: Positive = 200.0
    noise_nt: NotNegative = 0.2
    levelling_nt: NotNegative = 0.6
    diurnal_nt: NotNegative = 0.4
    diurnal_time_constant_s: Positive = 600.0
    track_error_m: NotNegative = 4.0
    height_error_m: NotNegative = 4.0
    wander_m: Positive = 300.0
    gradient_error_nt_m: NotNegative = 0.003


def surveyed(
    truth: MagneticMap, parameters: SurveyParameters, *, seed: np.random.SeedSequence
) -> MagneticMap:
    """The map that a survey of the true field publishes, on the same grid, with its stated error.

    Args:
        truth: the field without targets. Where it has no data the published map has none.
        parameters: of the survey.
        seed: the survey's random stream.

    Returns:
        The published map; `error_nt` and `line_spacing_m` are the survey's own figures.
    """
    p = parameters
    whole = truth.without_holes()
    rng = np.random.Generator(np.random.PCG64(seed))
    north_m, east_m = truth.north_m, truth.east_m
    lines_m, spacing_m = _lines(east_m, p.line_spacing_m)
    readings_nt, gradients_nt_m = _flown(whole, p, rng, north_m, lines_m)
    total_nt = _between(lines_m, readings_nt, east_m)
    gradient_nt_m = _between(lines_m, gradients_nt_m, east_m)

    ties_m, _ = _lines(north_m, _TIE_SPACING * p.line_spacing_m)
    tie_nt, _ = _flown(whole, p, rng, east_m, ties_m, across=True)
    unnamed = replace(whole, total_field_nt=total_nt, vertical_gradient_nt_m=gradient_nt_m)
    on_map_nt = unnamed.interpolate(ties_m[None, :], east_m[:, None])
    error_nt = float(np.sqrt(np.mean((tie_nt - on_map_nt) ** 2)))

    missing = ~np.isfinite(truth.total_field_nt)
    total_nt[missing] = np.nan
    return replace(
        truth,
        total_field_nt=total_nt,
        vertical_gradient_nt_m=gradient_nt_m,
        error_nt=error_nt,
        line_spacing_m=spacing_m,
    )


def truth_behind(
    published: MagneticMap, parameters: SurveyParameters, *, seed: np.random.SeedSequence
) -> MagneticMap:
    """A true field of which a published map may be a survey: the map less an error drawn from the seed.

    The error is that of a survey with these parameters over the map itself, so what such a survey overlooks
    between its lines is as much as the map has of it. A stated error of the map scales it.

    Args:
        published: the map.
        parameters: of its survey, for values that the map does not contain.
        seed: the survey's random stream.
    """
    p = parameters
    if published.line_spacing_m is not None:
        p = replace(p, line_spacing_m=published.line_spacing_m)
    whole = published.without_holes()
    again = surveyed(whole, p, seed=seed)
    error_nt: Array = again.total_field_nt - whole.total_field_nt
    if published.error_nt is not None:
        size_nt = float(np.sqrt(np.mean(error_nt**2)))
        error_nt = error_nt * (published.error_nt / size_nt if size_nt > 0.0 else 0.0)
    return replace(whole, total_field_nt=whole.total_field_nt - error_nt)


def _lines(grid_m: Array, spacing_m: float) -> tuple[Array, float]:
    """Places of parallel lines that cover a grid, and their distance."""
    span_m = float(grid_m[-1] - grid_m[0])
    count = max(2, math.ceil(span_m / spacing_m - 1e-9) + 1)
    return np.linspace(grid_m[0], grid_m[-1], count), span_m / (count - 1)


def _flown(
    truth: MagneticMap,
    p: SurveyParameters,
    rng: np.random.Generator,
    along_m: Array,
    lines_m: Array,
    *,
    across: bool = False,
) -> tuple[Array, Array]:
    """Processed readings (points, lines) at `along_m` of each line, and vertical gradients.

    Args:
        across: the lines run east and `lines_m` are places north.
    """
    shape = (along_m.size, lines_m.size)
    step_m = float(along_m[1] - along_m[0])
    track_m = p.track_error_m * _gauss_markov(rng, shape, step_m / p.wander_m)
    height_m = p.height_error_m * _gauss_markov(rng, shape, step_m / p.wander_m)
    # One line after the other, up and down: the daily variation continues during the turns.
    running = _gauss_markov(
        rng, (along_m.size * lines_m.size, 1), step_m / _SPEED_M_S / p.diurnal_time_constant_s
    )
    diurnal = running.reshape(lines_m.size, along_m.size).T.copy()
    diurnal[:, 1::2] = diurnal[::-1, 1::2]
    level = rng.standard_normal(lines_m.size)
    error_nt = p.noise_nt * rng.standard_normal(shape) + p.levelling_nt * level + p.diurnal_nt * diurnal
    place_m = np.broadcast_to(along_m[:, None], shape), lines_m[None, :] + track_m
    north_m, east_m = (place_m[1], place_m[0]) if across else place_m
    north_m = np.clip(north_m, truth.north_m[0], truth.north_m[-1])
    east_m = np.clip(east_m, truth.east_m[0], truth.east_m[-1])
    here_nt = truth.interpolate(north_m, east_m)
    gradient_nt_m = truth.interpolate(north_m, east_m, truth.height_m + 1.0) - here_nt
    readings_nt = here_nt + gradient_nt_m * height_m + error_nt
    return readings_nt, gradient_nt_m + p.gradient_error_nt_m * rng.standard_normal(lines_m.size)


def _gauss_markov(rng: np.random.Generator, shape: tuple[int, int], steps: float) -> Array:
    """Unit-variance Gauss-Markov sequences down the columns; `steps` is step over correlation length."""
    decay = math.exp(-steps)
    drive = math.sqrt(-math.expm1(-2.0 * steps)) * rng.standard_normal(shape)
    out = np.empty(shape)
    out[0] = rng.standard_normal(shape[1])
    for row in range(1, shape[0]):
        out[row] = decay * out[row - 1] + drive[row]
    return out


def _between(lines_m: Array, values: Array, grid_m: Array) -> Array:
    """Values (points, lines) interpolated across evenly spaced lines, by Akima's cubics (1970)."""
    step_m = float(lines_m[1] - lines_m[0])
    last = lines_m.size - 1
    inner = np.diff(values, axis=1) / step_m
    if last == 1:
        secant = np.repeat(inner, 5, axis=1)
    else:  # two more at each end, as the parabola through the last three lines goes on
        low, high = inner[:, 0] - inner[:, 1], inner[:, -1] - inner[:, -2]
        before = np.column_stack((inner[:, 0] + 2.0 * low, inner[:, 0] + low))
        after = np.column_stack((inner[:, -1] + high, inner[:, -1] + 2.0 * high))
        secant = np.column_stack((before, inner, after))
    bend = np.abs(np.diff(secant, axis=1))
    left, right = bend[:, 2:], bend[:, :-2]
    total = left + right
    share = np.where(total > 1e-12, left / np.maximum(total, 1e-12), 0.5)
    slope = share * secant[:, 1:-2] + (1.0 - share) * secant[:, 2:-1]

    cell = np.clip(np.floor((grid_m - lines_m[0]) / step_m).astype(int), 0, last - 1)
    u = (grid_m - lines_m[cell]) / step_m
    cubic: Array = (
        (1.0 + 2.0 * u) * (1.0 - u) ** 2 * values[:, cell]
        + u * (1.0 - u) ** 2 * step_m * slope[:, cell]
        + u**2 * (3.0 - 2.0 * u) * values[:, cell + 1]
        + u**2 * (u - 1.0) * step_m * slope[:, cell + 1]
    )
    return cubic
