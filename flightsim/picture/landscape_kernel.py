"""Ground and sky of a picture, ray by ray, compiled.

Everything on the ground is a function of the place alone, averaged over about what a pixel covers, so that it
neither swims nor flickers as the camera moves.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel
from flightsim.picture.ground_texture import LEVELS, TEXELS

Array = NDArray[np.float64]

# scenery
RUNWAY_LENGTH_M: Final = 0  # 0: there is none
RUNWAY_WIDTH_M: Final = 1
RUNWAY_COSINE: Final = 2  # of its heading
RUNWAY_SINE: Final = 3
VISIBILITY_M: Final = 4
SUN_NED: Final = slice(5, 8)
SCENERY: Final = 8

FIELD_M: Final = 100.0
_TRACK_M: Final = 3.0
_OCTAVES: Final = 4
_PER_TEXEL: Final = (1.0 / 0.03, 1.0 / 0.27, 1.0 / 2.4, 1.0 / 22.0)
_LOG_TEXEL: Final = (math.log2(0.03), math.log2(0.27), math.log2(2.4), math.log2(22.0))
_GRAIN: Final = (0.07, 0.08, 0.08, 0.06)
_AWAY: Final = float(1 << 40)  # whole patches that make every place positive, so that int() is the floor
_FIELDS_BGR: Final = np.array(
    [
        [52.0, 108.0, 86.0],
        [60.0, 128.0, 112.0],
        [72.0, 120.0, 128.0],
        [48.0, 96.0, 70.0],
        [84.0, 140.0, 146.0],
        [58.0, 116.0, 96.0],
        [76.0, 104.0, 118.0],
    ]
)
_MEAN_BGR: Final = _FIELDS_BGR.mean(axis=0)
_TRACK_BGR: Final = (128.0, 150.0, 164.0)
_ASPHALT_BGR: Final = (78.0, 76.0, 74.0)
_PAINT_BGR: Final = (232.0, 232.0, 232.0)
_HAZE_BGR: Final = (228.0, 216.0, 202.0)
_ZENITH_BGR: Final = (196.0, 128.0, 64.0)
_SUN_BGR: Final = (236.0, 250.0, 255.0)
_SUN_COSINE: Final = math.cos(math.radians(0.6))
_GLOW_COSINE: Final = math.cos(math.radians(15.0))
_PAD_M: Final = 3.0
_TERRAIN_STEPS: Final = 8


@kernel
def _grain(texture: NDArray[np.float32], north: float, east: float, footprint_m: float) -> float:
    """The sum of the octaves that are coarser than what a pixel covers."""
    value = 0.0
    detail = math.log2(footprint_m) + 0.5
    for octave in range(_OCTAVES):
        level = max(0, int(detail - _LOG_TEXEL[octave])) if detail > _LOG_TEXEL[octave] else 0
        if level >= LEVELS - 1:
            continue
        mask = (TEXELS >> level) - 1
        per_m = _PER_TEXEL[octave] / (1 << level)
        x = north * per_m + _AWAY
        y = east * per_m + _AWAY
        i, j = int(x), int(y)
        fx, fy = x - i, y - j
        i, j = i & mask, j & mask
        k, m = (i + 1) & mask, (j + 1) & mask
        a, b = texture[level, i, j], texture[level, k, j]
        a += (texture[level, i, m] - a) * fy
        b += (texture[level, k, m] - b) * fy
        value += _GRAIN[octave] * (a + (b - a) * fx)
    return value


@kernel
def _band(distance: float, half_width: float, footprint: float) -> float:
    """Share of a pixel's width, `distance` from the middle of a band, that the band covers."""
    low = max(distance - 0.5 * footprint, -half_width)
    high = min(distance + 0.5 * footprint, half_width)
    return max(0.0, high - low) / footprint


@kernel
def _home_mark(north: float, east: float, footprint: float) -> float:
    """The painted fraction of a pixel: a ring with an H whose legs point north."""
    radius = math.hypot(north, east)
    ring = _band(radius - (_PAD_M - 0.25), 0.25, footprint)
    legs = _band(abs(east) - 0.9, 0.2, footprint) * _band(north, 1.5, footprint)
    bar = _band(north, 0.2, footprint) * _band(east, 0.9, footprint)
    return min(1.0, ring + max(legs, bar))


@kernel
def _runway_paint(along: float, across: float, length_m: float, width_m: float, footprint: float) -> float:
    """Centre line of 20 m dashes, edges, and the bars of both thresholds."""
    inside = _band(along, 0.5 * length_m, footprint)
    dash = _band((along % 40.0) - 20.0, 10.0, footprint) * _band(across, 0.3, footprint)
    edge = _band(abs(across) - 0.5 * width_m + 0.8, 0.3, footprint)
    stripes = _band((abs(across) % 2.4) - 1.2, 0.6, footprint) * _band(across, 0.5 * width_m - 1.5, footprint)
    bars = stripes * _band(abs(along) - 0.5 * length_m + 12.0, 6.0, footprint)
    return min(1.0, inside * (dash + edge + bars))


@kernel
def _height_at(heights: Array, grid: Array, north: float, east: float) -> float:
    """Height of the ground, bilinear; beyond the edges that of the nearest edge."""
    rows, columns = heights.shape
    y = min(max((north - grid[0]) / grid[2], 0.0), rows - 1.0)
    x = min(max((east - grid[1]) / grid[2], 0.0), columns - 1.0)
    i, j = min(int(y), rows - 2), min(int(x), columns - 2)
    fy, fx = y - i, x - j
    south = heights[i, j] + (heights[i, j + 1] - heights[i, j]) * fx
    north_row = heights[i + 1, j] + (heights[i + 1, j + 1] - heights[i + 1, j]) * fx
    return float(south + (north_row - south) * fy)


@kernel
def paint_landscape(
    r_ned_from_mount: Array,
    eye_ned_m: Array,
    focal_px: float,
    centre_u_px: float,
    centre_v_px: float,
    scenery: Array,
    texture: NDArray[np.float32],
    heights: Array,
    grid: Array,
    out: NDArray[np.uint8],
) -> None:
    """Fill a picture (height, width, 3), BGR; pixel (i, j) shows the ray through its middle.

    `r_ned_from_mount` (3, 3) has the optical axis, the picture's right and its down as columns. `centre_u_px`
    and `centre_v_px` are where that axis meets the picture, which may be a part of a larger one. An eye at or
    under the ground sees it from 5 cm over it. `heights` (rows, columns) are those of the ground over a grid
    whose first place and spacing are `grid` (south, west, spacing); without rows it is level.
    """
    height, width = out.shape[0], out.shape[1]
    height_m = max(0.05, -eye_ned_m[2])
    sun = scenery[SUN_NED]
    length_m, width_m = scenery[RUNWAY_LENGTH_M], scenery[RUNWAY_WIDTH_M]
    colour = np.empty(3)
    for row in range(height):
        v = (row + 0.5 - centre_v_px) / focal_px
        for column in range(width):
            u = (column + 0.5 - centre_u_px) / focal_px
            stretch = math.sqrt(1.0 + u * u + v * v)
            dn = r_ned_from_mount[0, 0] + u * r_ned_from_mount[0, 1] + v * r_ned_from_mount[0, 2]
            de = r_ned_from_mount[1, 0] + u * r_ned_from_mount[1, 1] + v * r_ned_from_mount[1, 2]
            dd = r_ned_from_mount[2, 0] + u * r_ned_from_mount[2, 1] + v * r_ned_from_mount[2, 2]
            sine = dd / stretch  # of the depression
            if sine < 1e-4:
                up = math.sqrt(min(1.0, max(0.0, -sine)))
                toward = (dn * sun[0] + de * sun[1] + dd * sun[2]) / stretch
                glow = 0.0
                if toward > _SUN_COSINE:
                    glow = 1.0
                elif toward > _GLOW_COSINE:
                    glow = 0.5 * ((toward - _GLOW_COSINE) / (1.0 - _GLOW_COSINE)) ** 4
                for c in range(3):
                    sky = _HAZE_BGR[c] + (_ZENITH_BGR[c] - _HAZE_BGR[c]) * up
                    out[row, column, c] = np.uint8(sky + (_SUN_BGR[c] - sky) * glow)
                continue
            depth = height_m / dd
            if heights.shape[0] > 1:
                # fixed point: it converges where the ground is less steep than the ray
                for _ in range(_TERRAIN_STEPS):
                    at_n, at_e = eye_ned_m[0] + depth * dn, eye_ned_m[1] + depth * de
                    depth = max(0.05, height_m - _height_at(heights, grid, at_n, at_e)) / dd
            range_m = depth * stretch
            north, east = eye_ned_m[0] + depth * dn, eye_ned_m[1] + depth * de
            haze = 1.0 - math.exp(-range_m / scenery[VISIBILITY_M])
            footprint = max(1e-4, depth / focal_px / math.sqrt(sine))
            if haze > 0.98:
                for c in range(3):
                    ground = _MEAN_BGR[c]
                    out[row, column, c] = np.uint8(ground + (_HAZE_BGR[c] - ground) * haze)
                continue
            field_n, field_e = math.floor(north / FIELD_M), math.floor(east / FIELD_M)
            which = (int(field_n) * 73 + int(field_e) * 151 + (int(field_n) * int(field_e)) % 11 * 37) % 7
            far = min(1.0, footprint / (0.25 * FIELD_M))
            light = 1.0 + _grain(texture, north, east, footprint)
            near_n = 0.5 * FIELD_M - abs(north - (field_n + 0.5) * FIELD_M)
            near_e = 0.5 * FIELD_M - abs(east - (field_e + 0.5) * FIELD_M)
            track = 0.0
            if min(near_n, near_e) < 0.5 * (_TRACK_M + footprint):
                track = max(
                    _band(near_n, 0.5 * _TRACK_M, footprint), _band(near_e, 0.5 * _TRACK_M, footprint)
                )
            for c in range(3):
                ground = _FIELDS_BGR[which, c] + (_MEAN_BGR[c] - _FIELDS_BGR[which, c]) * far
                ground += (_TRACK_BGR[c] - ground) * track
                colour[c] = ground * light
            if length_m > 0.0:
                along = north * scenery[RUNWAY_COSINE] + east * scenery[RUNWAY_SINE]
                across = east * scenery[RUNWAY_COSINE] - north * scenery[RUNWAY_SINE]
                tarmac = 0.0
                if abs(across) < 0.5 * (width_m + footprint):
                    tarmac = _band(along, 0.5 * length_m + 20.0, footprint)
                    tarmac *= _band(across, 0.5 * width_m, footprint)
                if tarmac > 0.0:
                    paint = _runway_paint(along, across, length_m, width_m, footprint)
                    for c in range(3):
                        colour[c] += (_ASPHALT_BGR[c] * (0.6 + 0.4 * light) - colour[c]) * tarmac
                        colour[c] += (_PAINT_BGR[c] - colour[c]) * paint
            if abs(north) < _PAD_M + footprint and abs(east) < _PAD_M + footprint:
                paint = _home_mark(north, east, footprint)
                for c in range(3):
                    colour[c] += (_PAINT_BGR[c] - colour[c]) * paint
            for c in range(3):
                shade = colour[c] + (_HAZE_BGR[c] - colour[c]) * haze
                out[row, column, c] = np.uint8(min(255.0, max(0.0, shade)))
