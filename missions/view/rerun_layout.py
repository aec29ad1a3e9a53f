"""The layout of Rerun's views, from what a scene has."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Final

import rerun.blueprint as rrb

from estimators.scene_items import Value
from flightsim.foundation.vectors import Vector

__all__ = ["Content", "layout"]

_MOST_PLOTS: Final = 6  # in a tab
_UNITS: Final = ("m", "deg", "m/s")
_MARGIN: Final = 1.25
_WHOLE: Final = rrb.TimeAxis(
    view_range=rrb.TimeRange(start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.infinite())
)


@dataclass(slots=True)
class Content:
    """The paths of what was drawn, by what shows it.

    Attributes:
        places: in the map.
        trails: in the map, from the beginning on.
        pictures: each in a view of its own.
        series: over time, with a first sample.
        bands: of the series, those with a band.
        states: bands over time.
        texts: events.
    """

    places: set[str] = field(default_factory=set)
    trails: set[str] = field(default_factory=set)
    pictures: set[str] = field(default_factory=set)
    bands: set[str] = field(default_factory=set)
    states: set[str] = field(default_factory=set)
    texts: set[str] = field(default_factory=set)
    series: dict[str, Value] = field(default_factory=dict)

    def copy(self) -> "Content":
        """The same, which does not grow."""
        return replace(self, **{item.name: getattr(self, item.name).copy() for item in fields(self)})

    def __bool__(self) -> bool:
        return bool(self.places or self.series or self.texts or self.pictures)


def layout(content: Content, timeline: str, extent: tuple[Vector, Vector] | None) -> rrb.Blueprint:
    """Map from above and in perspective on the left; pictures, plots, states and events on the right.

    Args:
        content: what was drawn.
        timeline: name of the timeline.
        extent: least and largest north, east and down of what was drawn; None: nothing has a place.
    """
    right: list[Any] = []
    shares: list[float] = []
    if content.pictures:
        views = [rrb.Spatial2DView(origin=path, name=_words(path)) for path in sorted(content.pictures)]
        right.append(rrb.Horizontal(*views) if len(views) <= 2 else rrb.Grid(*views))
        shares.append(2.0)
    if content.series:
        right.append(rrb.Tabs(*_plots(content)))
        shares.append(4.0)
    if content.states:
        right.append(
            rrb.StateTimelineView(contents=sorted(content.states), name="modes and phases", time_view=_WHOLE)
        )
        shares.append(2.0)
    if content.texts:
        right.append(rrb.TextLogView(contents=sorted(content.texts), name="events"))
        shares.append(1.3)
    side = rrb.Vertical(*right, row_shares=shares)
    parts = [side] if not content.places else [_maps(content, timeline, extent), side]
    return rrb.Blueprint(
        rrb.Horizontal(*parts, column_shares=[3.0, 2.0][: len(parts)]) if right else parts[0],
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=timeline, play_state="following"),
        auto_views=False,
    )


def _maps(content: Content, timeline: str, extent: tuple[Vector, Vector] | None) -> Any:
    start, end = rrb.TimeRangeBoundary.infinite(), rrb.TimeRangeBoundary.cursor_relative()
    ranges = rrb.VisibleTimeRanges(timeline=timeline, start=start, end=end)
    overrides: Mapping[str, Any] = dict.fromkeys(sorted(content.trails), ranges)
    above, beside = None, None
    if extent is not None:
        (south, west, top), (north, east, _) = extent
        middle = [0.5 * (south + north), 0.5 * (west + east), 0.0]
        size_m = _MARGIN * max(north - south, east - west, 20.0)
        above = rrb.EyeControls3D(
            position=[middle[0], middle[1], top - size_m], look_target=middle, eye_up=[1.0, 0.0, 0.0]
        )
        beside = rrb.EyeControls3D(
            position=[middle[0] - 0.8 * size_m, middle[1], top - 0.5 * size_m],
            look_target=middle,
            eye_up=[0.0, 0.0, -1.0],
        )
    contents = ["+ /**", "- /**/3_sigma"]
    return rrb.Tabs(
        *(
            rrb.Spatial3DView(origin="/", contents=contents, name=name, overrides=overrides, eye_controls=eye)
            for name, eye in (("from above, north up", above), ("in perspective", beside))
        )
    )


def _plots(content: Content) -> list[Any]:
    """Tabs by what the series are of, errors first, with a plot for each unit."""
    groups: dict[str, dict[str, list[str]]] = {}
    by_unit = sorted(content.series.items(), key=lambda own: (_unit_rank(own[1].unit), own[0]))
    for path, item in by_unit:
        group = "errors" if item.error else _group(path)
        groups.setdefault(group, {}).setdefault(item.unit or path.rpartition("/")[2], []).append(path)
    names = sorted(groups, key=lambda name: (name != "errors", name))
    return [rrb.Vertical(*_plots_of(groups[name], content), name=name) for name in names]


def _plots_of(by_unit: Mapping[str, Sequence[str]], content: Content) -> list[Any]:
    views = []
    for unit, paths in list(by_unit.items())[:_MOST_PLOTS]:
        bands = [f"{path}/3_sigma" for path in paths if path in content.bands]
        name = ", ".join(dict.fromkeys(_words(path.rpartition("/")[2]) for path in paths))
        has_unit = any(content.series[path].unit for path in paths)
        views.append(
            rrb.TimeSeriesView(
                contents=[*paths, *bands],
                name=f"{name}, {unit}" if has_unit else name,
                plot_legend=rrb.Corner2D.LeftTop,
                axis_x=_WHOLE,
            )
        )
    return views


def _unit_rank(unit: str) -> int:
    """Heights and distances are above angles, speeds and the rest."""
    return _UNITS.index(unit) if unit in _UNITS else len(_UNITS)


def _group(path: str) -> str:
    parts = path.split("/")
    return "vehicles" if parts[0] == "vehicles" else _words(" ".join(parts[:-1][-2:] or parts))


def _words(path: str) -> str:
    return path.replace("_", " ").replace("/", " ")
