"""KML, GPX and GeoJSON of the places in a log.

Standards: OGC KML 2.2 with Google's `gx:Track`, GPX 1.1, RFC 7946. Heights are above mean sea level in KML
and GPX, as their readers take them; RFC 7946 wants them above the ellipsoid, so GeoJSON has none but those in
`properties`.
"""

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree

import numpy as np

from estimators.errors import LogError
from estimators.exports.features import FeatureKind, MapFeature, features_of, rows_of
from estimators.extras import library
from estimators.logs.new_file import new_file
from flightsim.foundation.plain_text import plain_text

if TYPE_CHECKING:
    from estimators.logs import Log

__all__ = ["MAP_FORMATS", "export_map"]

_LAST_UNIX_US: Final = 253_402_300_799_000_000  # the end of the year 9999, which dates have
_NAMESPACES: Final = {"": "http://www.opengis.net/kml/2.2", "gx": "http://www.google.com/kml/ext/2.2"}
_COLOURS: Final = {  # aabbggrr
    "truth": "ff271811", "estimate": "ffaa6917", "commanded": "ffafa39a", "found": "ff1c1cb9",
    "fence": "ff0c41c2", "area": "ff3d8015",
}  # fmt: skip


def export_map(log: "Log", path: Path, form: str) -> Mapping[str, int]:
    """Write the tracks, plans, areas and targets of a log; tracks with 5 points a second at most.

    Args:
        log: an open log.
        path: the file; it must not exist.
        form: one of `MAP_FORMATS`.

    Returns:
        Number of places of each kind.

    Raises:
        LogError: there is no position in it, or the file exists or can't be written.
        EstimatorError: the library of the format is not installed.
    """
    writer = MAP_FORMATS.get(form)
    if writer is None:
        raise LogError(f"no map in {form!r}; accepted: {', '.join(MAP_FORMATS)}")
    places = features_of(log)
    with new_file(path) as part:
        part.write_bytes(writer(places, path))
    return Counter(str(place.kind) for place in places)


def _time(unix_us: int) -> datetime | None:
    """A time of a record; None: not known, or in no year that a date has."""
    if not 0 < unix_us < _LAST_UNIX_US:
        return None
    return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=unix_us)


def _kml(places: Sequence[MapFeature], path: Path) -> bytes:
    simplekml = library("simplekml", path)
    kml = simplekml.Kml()
    for place in places:
        made = _KML[place.kind](kml, place, simplekml)
        made.style.linestyle.color = _COLOURS.get(place.role, "ff000000")
        made.style.linestyle.width = 2
        made.style.polystyle.fill = 0
    return _by_schema(kml.kml())


def _by_schema(text: str) -> bytes:
    """KML of simplekml as its schema wants it: ids that are no numbers, altitude modes of tracks first."""
    for prefix, uri in _NAMESPACES.items():
        ElementTree.register_namespace(prefix, uri)
    root = ElementTree.fromstring(text)
    for element in root.iter():
        if element.tag.endswith("}Style"):
            element.set("id", f"style{element.get('id')}")
        else:
            element.attrib.pop("id", None)
        if element.tag.endswith("}Track"):
            element[:] = sorted(element, key=lambda child: not child.tag.endswith("}altitudeMode"))
        if element.tag.endswith("}styleUrl") and element.text:
            element.text = f"#style{element.text.removeprefix('#')}"
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)


def _points(place: MapFeature, rows: slice = slice(None)) -> list[tuple[float, float, float]]:
    columns = place.lon_deg[rows], place.lat_deg[rows], np.nan_to_num(place.alt_m[rows])
    return list(zip(*(column.tolist() for column in columns), strict=True))


def _kml_track(kml: Any, place: MapFeature, simplekml: Any) -> Any:
    several = kml.newgxmultitrack(name=plain_text(place.name))
    for rows in rows_of(place):
        times = [_time(unix_us) for unix_us in place.unix_us[rows].tolist()]
        track = several.newgxtrack(name=plain_text(place.name))
        track.altitudemode = simplekml.AltitudeMode.absolute
        if all(time is not None for time in times):
            track.newwhen([time.isoformat() for time in times if time is not None])
        track.newgxcoord(_points(place, rows))
    return several


def _kml_line(kml: Any, place: MapFeature, simplekml: Any) -> Any:
    return kml.newlinestring(
        name=plain_text(place.name), coords=_points(place), altitudemode=simplekml.AltitudeMode.absolute
    )


def _kml_area(kml: Any, place: MapFeature, _simplekml: Any) -> Any:
    return kml.newpolygon(name=plain_text(place.name), outerboundaryis=_points(place))  # on the ground


def _kml_point(kml: Any, place: MapFeature, _simplekml: Any) -> Any:
    return kml.newpoint(name=plain_text(place.name), coords=_points(place))


_KML: Final[Mapping[FeatureKind, Callable[[Any, MapFeature, Any], Any]]] = {
    FeatureKind.TRACK: _kml_track,
    FeatureKind.LINE: _kml_line,
    FeatureKind.AREA: _kml_area,
    FeatureKind.POINT: _kml_point,
}


def _gpx(places: Sequence[MapFeature], path: Path) -> bytes:
    """Tracks, lines as routes, points as waypoints. GPX has no areas."""
    gpx = library("gpxpy.gpx", path)
    made = gpx.GPX()
    made.creator = "flightstack"
    for place in places:
        name, heights = plain_text(place.name), [h if np.isfinite(h) else None for h in place.alt_m.tolist()]
        where = list(zip(place.lat_deg.tolist(), place.lon_deg.tolist(), heights, strict=True))
        if place.kind is FeatureKind.POINT:
            made.waypoints.append(gpx.GPXWaypoint(*where[0], name=name, type=place.role))
        elif place.kind is FeatureKind.LINE:
            route = gpx.GPXRoute(name=name)
            route.points += [gpx.GPXRoutePoint(*point) for point in where]
            made.routes.append(route)
        elif place.kind is FeatureKind.TRACK:
            track = gpx.GPXTrack(name=name)
            times = [_time(unix_us) for unix_us in place.unix_us.tolist()]
            for rows in rows_of(place):
                points = zip(where[rows], times[rows], strict=True)
                track.segments.append(gpx.GPXTrackSegment([gpx.GPXTrackPoint(*p, time=t) for p, t in points]))
            made.tracks.append(track)
    text: str = made.to_xml(version="1.1")
    return text.encode()


def _geojson(places: Sequence[MapFeature], _path: Path) -> bytes:
    features = [
        {
            "type": "Feature",
            "geometry": _geometry(place),
            "properties": {"name": place.name, "kind": place.kind, "role": place.role, **_about(place)},
        }
        for place in places
    ]
    return (json.dumps({"type": "FeatureCollection", "features": features}, indent=1) + "\n").encode()


def _geometry(place: MapFeature) -> dict[str, Any]:
    positions = [[round(lon, 8), round(lat, 8)] for lon, lat, _ in _points(place)]
    if place.kind is FeatureKind.POINT:
        return {"type": "Point", "coordinates": positions[0]}
    if place.kind is FeatureKind.AREA:
        return {"type": "Polygon", "coordinates": [_counterclockwise(positions)]}
    if place.kind is FeatureKind.LINE:
        return {"type": "LineString", "coordinates": positions}
    lines = [positions[rows] for rows in rows_of(place)]
    lines = [line if len(line) > 1 else line * 2 for line in lines]  # a line has two positions
    return {"type": "MultiLineString", "coordinates": lines}


def _counterclockwise(ring: list[list[float]]) -> list[list[float]]:
    """A ring in the direction that RFC 7946 wants of an exterior one."""
    x, y = np.array(ring).T
    area = float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
    return ring if area > 0.0 else ring[::-1]


def _about(place: MapFeature) -> dict[str, Any]:
    heights: dict[str, Any] = {}
    if np.isfinite(place.alt_m).all():
        alt_m = [round(alt, 2) for alt in place.alt_m.tolist()]
        heights["alt_amsl_m"] = alt_m[0] if place.kind is FeatureKind.POINT else alt_m
    if place.kind is FeatureKind.TRACK:
        heights["unix_s"] = [round(unix_us * 1e-6, 3) for unix_us in place.unix_us.tolist()]
    return heights


MAP_FORMATS: Final[Mapping[str, Callable[[Sequence[MapFeature], Path], bytes]]] = {
    "kml": _kml,
    "gpx": _gpx,
    "geojson": _geojson,
}
"""Formats of maps."""
