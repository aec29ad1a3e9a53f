"""The search patterns of the IAMSAR Manual (volume II, chapter 5): the patterns with which the Lissajous
paper compares.

All are centred on the datum. Turns are to starboard (right), and the first leg heads along `heading_rad`.
"""

import math

from missions.errors import PlanError
from missions.patterns.polyline import Polyline


def _checked(name: str, value_m: float) -> float:
    if not (math.isfinite(value_m) and value_m > 0.0):
        raise PlanError(f"{name} {value_m:g} m leaves nothing to search; ask for more than 0 m")
    return value_m


def sector(*, radius_m: float, heading_rad: float = 0.0, passes: int = 1) -> Polyline:
    """Sector search (VS): six sectors, all turns are 120 degrees, and each pass crosses the datum three
    times.

    From the datum out along `heading_rad`, across, back through the datum and so on: legs of r, r, 2r, r, 2r,
    r, r. Each further pass is turned 30 degrees to starboard, as in the manual.
    """
    r = _checked("sector search radius", radius_m)
    if passes < 1:
        raise PlanError(f"{passes} passes can't be flown; ask for at least 1")
    # around the circle: out to 0, across to 60, through to 240, across to 300, through to 120, across to
    # 180, home
    rim = [
        (r * math.cos(math.radians(d)), r * math.sin(math.radians(d))) for d in (0, 60, 240, 300, 120, 180)
    ]
    one = Polyline(((0.0, 0.0), *rim, (0.0, 0.0))).rotated(heading_rad)
    whole = one
    for k in range(1, passes):
        whole = whole.then(one.rotated(math.radians(30.0) * k))
    return whole


def parallel_sweep(
    *, width_m: float, height_m: float, spacing_m: float, heading_rad: float = 0.0, passes: int = 1
) -> Polyline:
    """Parallel sweep (PS) of a rectangle: legs along its longer side, `spacing_m` apart.

    It begins half a spacing inside one corner, and the legs are half a spacing from all sides, so that every
    point is within half a spacing of a leg. The spacing is reduced to a whole number of legs. Each further
    pass flies back the same legs.

    Args:
        width_m: side across `heading_rad` (east for 0).
        height_m: side along `heading_rad` (north for 0).
        spacing_m: largest distance between legs.
    """
    width, height = _checked("search area width", width_m), _checked("search area height", height_m)
    spacing = _checked("track spacing", spacing_m)
    if passes < 1:
        raise PlanError(f"{passes} passes can't be flown; ask for at least 1")
    long_m, short_m = max(width, height), min(width, height)
    if spacing >= long_m:
        raise PlanError(
            f"track spacing {spacing:g} m leaves no leg in an area of {width:g} m by {height:g} m; "
            f"ask for a spacing below {long_m:g} m"
        )
    legs = math.ceil(short_m / spacing - 1e-9)
    pitch = short_m / legs
    half = 0.5 * (long_m - spacing)
    vertices: list[tuple[float, float]] = []
    for k in range(legs):
        across = -0.5 * short_m + (k + 0.5) * pitch
        ends = (-half, half) if k % 2 == 0 else (half, -half)
        vertices += [(along, across) if height >= width else (across, along) for along in ends]
    one = Polyline(tuple(vertices)).rotated(heading_rad)
    whole = one
    for k in range(1, passes):
        whole = whole.then(one.reversed() if k % 2 else one)
    return whole


def expanding_square(
    *, size_m: float, spacing_m: float, heading_rad: float = 0.0, passes: int = 1
) -> Polyline:
    """Expanding square search (SS): from the datum outwards; all turns are 90 degrees to starboard.

    Legs of s, s, 2s, 2s, 3s, 3s, ... as long as they fit in the square `size_m`, then one last leg to
    close the outermost square. Each further pass starts at the datum again, turned 45 degrees.
    """
    size = _checked("search area size", size_m)
    spacing = _checked("track spacing", spacing_m)
    if spacing > size:
        raise PlanError(
            f"track spacing {spacing:g} m is larger than the area of {size:g} m; ask for at most {size:g} m"
        )
    if passes < 1:
        raise PlanError(f"{passes} passes can't be flown; ask for at least 1")
    turns = max(1, math.floor(size / spacing + 1e-9))  # the longest legs are this many spacings
    north = east = 0.0
    vertices = [(north, east)]
    heading = 0
    for k in range(2 * turns + 1):
        length = spacing * min(k // 2 + 1, turns)
        north += length * (1, 0, -1, 0)[heading]
        east += length * (0, 1, 0, -1)[heading]
        vertices.append((north, east))
        heading = (heading + 1) % 4
    one = Polyline(tuple(vertices)).rotated(heading_rad)
    whole = one
    for k in range(1, passes):
        whole = whole.then(one.rotated(math.radians(45.0) * k))
    return whole
