"""Search patterns as plane curves: pure geometry without I/O, time or vehicle.

A pattern is a `Curve` around its centre, in metres (north, east): `Lissajous`, and the IAMSAR patterns and
ergodic coverage as `Polyline` with rounded corners for flight (`Polyline.rounded`).
"""

from missions.patterns.curve import ArcLengthTable, Curve, Lap
from missions.patterns.ergodic import ergodic
from missions.patterns.iamsar import expanding_square, parallel_sweep, sector
from missions.patterns.lissajous import NAMED_PATTERNS, Lissajous, NamedPattern, named_lissajous
from missions.patterns.polyline import Polyline, RoundedPolyline

__all__ = [
    "NAMED_PATTERNS",
    "ArcLengthTable",
    "Curve",
    "Lap",
    "Lissajous",
    "NamedPattern",
    "Polyline",
    "RoundedPolyline",
    "ergodic",
    "expanding_square",
    "named_lissajous",
    "parallel_sweep",
    "sector",
]
