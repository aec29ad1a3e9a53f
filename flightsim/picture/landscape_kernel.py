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
_TEXEL_M: Final = (0.03, 0.27, 2.4, 22.0)
# by octave and level: texels in a metre, and the least footprint to which the level belongs
_PER_M: Final = np.array([[1.0 / texel_m / (1 << n) for n in range(LEVELS)] for texel_m in _TEXEL_M])
_FROM_M: Final = np.array([[texel_m * 2.0 ** (n - 0.5) for n in range(LEVELS)] for texel_m in _TEXEL_M])
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
_LEAST_SINE: Final = 1e-4  # of the depression of a ray that meets the ground

# rays of a row, and where they meet the ground
_NORTH: Final = 0
_EAST: Final = 1
_DOWN: Final = 2  # of a ray; its direction has a length of _STRETCH
_STRETCH: Final = 3
_SINE: Final = 4  # of its depression
_DEPTH: Final = 5  # along the optical axis
_RANGE: Final = 2  # of a place
_FOOTPRINT: Final = 3


@kernel
def _octave(
    texture: NDArray[np.float32],
    ground: Array,
    first: int,
    last: int,
    per_m: float,
    size: int,
    weight: float,
    grain: Array,
) -> None:
    """Add an octave to the grain of some pixels of a row: the texture (TEXELS * TEXELS) of one level, whose
    patch has `size` texels each way, between its texels.
    """
    mask = np.uint32(size - 1)
    for column in range(first, last):
        x = ground[_NORTH, column] * per_m + _AWAY
        y = ground[_EAST, column] * per_m + _AWAY
        whole_x, whole_y = np.floor(x), np.floor(y)
        fx, fy = x - whole_x, y - whole_y
        i, j = np.uint32(np.int32(whole_x - _AWAY)) & mask, np.uint32(np.int32(whole_y - _AWAY)) & mask
        k, m = (i + np.uint32(1)) & mask, (j + np.uint32(1)) & mask
        i, k = i * np.uint32(TEXELS), k * np.uint32(TEXELS)
        a, b = texture[i + j], texture[k + j]
        c = a + (texture[i + m] - a) * fy
        d = b + (texture[k + m] - b) * fy
        grain[column] += weight * (c + (d - c) * fx)


@kernel
def _grain(texture: NDArray[np.float32], ground: Array, grain: Array) -> None:
    """For a row of pixels (n,), the sum of the octaves that are coarser than what a pixel covers."""
    grain[:] = 0.0
    footprint = ground[_FOOTPRINT]
    for octave in range(_OCTAVES):
        last = level = 0
        while last < grain.shape[0]:
            first = last
            while level < LEVELS - 1 and footprint[first] >= _FROM_M[octave, level + 1]:
                level += 1
            while level > 0 and footprint[first] < _FROM_M[octave, level]:
                level -= 1
            last += 1
            while last < grain.shape[0] and not (
                (level < LEVELS - 1 and footprint[last] >= _FROM_M[octave, level + 1])
                or (level > 0 and footprint[last] < _FROM_M[octave, level])
            ):
                last += 1
            if level < LEVELS - 1:
                _octave(
                    texture[level].ravel(),
                    ground,
                    first,
                    last,
                    _PER_M[octave, level],
                    TEXELS >> level,
                    _GRAIN[octave],
                    grain,
                )


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
def _cast_rays(r_ned_from_mount: Array, u: Array, v: float, height_m: float, rays: Array) -> None:
    """The rays (6, n) of a row of pixels over level ground; `u` (n,) and `v` are their image coordinates.

    This loop and the next one have no branch, so that the compiler works on several pixels at once:
    `np.divide` does not check for zeros, and a ray that does not meet the ground has a depth without meaning.
    """
    r = r_ned_from_mount
    for column in range(u.shape[0]):
        x = u[column]
        stretch = math.sqrt(1.0 + x * x + v * v)
        down = r[2, 0] + x * r[2, 1] + v * r[2, 2]
        rays[_NORTH, column] = r[0, 0] + x * r[0, 1] + v * r[0, 2]
        rays[_EAST, column] = r[1, 0] + x * r[1, 1] + v * r[1, 2]
        rays[_DOWN, column] = down
        rays[_STRETCH, column] = stretch
        rays[_SINE, column] = np.divide(down, stretch)
        rays[_DEPTH, column] = np.divide(height_m, down)


@kernel
def _meet_ground(eye_ned_m: Array, focal_px: float, rays: Array, ground: Array) -> None:
    """Where rays meet the ground (4, n), by their depth."""
    eye_north, eye_east = eye_ned_m[0], eye_ned_m[1]
    for column in range(rays.shape[1]):
        depth = rays[_DEPTH, column]
        ground[_NORTH, column] = eye_north + depth * rays[_NORTH, column]
        ground[_EAST, column] = eye_east + depth * rays[_EAST, column]
        ground[_RANGE, column] = depth * rays[_STRETCH, column]
        footprint = np.divide(np.divide(depth, focal_px), math.sqrt(rays[_SINE, column]))
        ground[_FOOTPRINT, column] = max(1e-4, footprint)


@kernel
def _meet_terrain(eye_ned_m: Array, height_m: float, heights: Array, grid: Array, rays: Array) -> None:
    """Depths of rays over terrain in place of those over level ground.

    It is a fixed point, which converges where the ground is less steep than the ray.
    """
    for column in range(rays.shape[1]):
        if rays[_SINE, column] < _LEAST_SINE:
            continue
        depth = rays[_DEPTH, column]
        for _ in range(_TERRAIN_STEPS):
            at_n = eye_ned_m[0] + depth * rays[_NORTH, column]
            at_e = eye_ned_m[1] + depth * rays[_EAST, column]
            depth = max(0.05, height_m - _height_at(heights, grid, at_n, at_e)) / rays[_DOWN, column]
        rays[_DEPTH, column] = depth


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
    visibility_m = scenery[VISIBILITY_M]
    colour = np.empty(3)
    rays, ground_at, grain = np.empty((6, width)), np.empty((4, width)), np.empty(width)
    u = np.empty(width)
    for column in range(width):
        u[column] = (column + 0.5 - centre_u_px) / focal_px
    known_n = known_e = math.nan
    which = 0
    for row in range(height):
        _cast_rays(r_ned_from_mount, u, (row + 0.5 - centre_v_px) / focal_px, height_m, rays)
        if heights.shape[0] > 1:
            _meet_terrain(eye_ned_m, height_m, heights, grid, rays)
        _meet_ground(eye_ned_m, focal_px, rays, ground_at)
        _grain(texture, ground_at, grain)
        for column in range(width):
            sine = rays[_SINE, column]
            if sine < _LEAST_SINE:
                dn, de, dd = rays[_NORTH, column], rays[_EAST, column], rays[_DOWN, column]
                up = math.sqrt(min(1.0, max(0.0, -sine)))
                toward = (dn * sun[0] + de * sun[1] + dd * sun[2]) / rays[_STRETCH, column]
                glow = 0.0
                if toward > _SUN_COSINE:
                    glow = 1.0
                elif toward > _GLOW_COSINE:
                    glow = 0.5 * ((toward - _GLOW_COSINE) / (1.0 - _GLOW_COSINE)) ** 4
                for c in range(3):
                    sky = _HAZE_BGR[c] + (_ZENITH_BGR[c] - _HAZE_BGR[c]) * up
                    out[row, column, c] = np.uint8(sky + (_SUN_BGR[c] - sky) * glow)
                continue
            north, east = ground_at[_NORTH, column], ground_at[_EAST, column]
            haze = 1.0 - math.exp(-ground_at[_RANGE, column] / visibility_m)
            footprint = ground_at[_FOOTPRINT, column]
            if haze > 0.98:
                for c in range(3):
                    ground = _MEAN_BGR[c]
                    out[row, column, c] = np.uint8(ground + (_HAZE_BGR[c] - ground) * haze)
                continue
            field_n, field_e = math.floor(north / FIELD_M), math.floor(east / FIELD_M)
            if field_n != known_n or field_e != known_e:
                known_n, known_e = field_n, field_e
                which = (int(field_n) * 73 + int(field_e) * 151 + (int(field_n) * int(field_e)) % 11 * 37) % 7
            far = min(1.0, footprint / (0.25 * FIELD_M))
            light = 1.0 + grain[column]
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
