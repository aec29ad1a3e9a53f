"""Interactive plots of scenes for a page: tracks from above, series over time, fields at some moments.

Bokeh is of the extra `report`. Of the kept libraries whose script a page can carry its script is the smallest
(1.3 MB; Plotly's has 4.8 MB). Its plots share their axes, zoom and have hover texts.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.extras import library
from estimators.received import broken_at_gaps
from estimators.scene.scene import Scene
from estimators.scene_items import Entry, Field, Gaussian, Line, Placed, PointSet, Pose, Role, Value

__all__ = ["Plots", "interactive_plots", "script_tag"]

Array = NDArray[np.float64]

_MOST_POINTS: Final = 1500  # of a line: more than a screen has
_MOST_SET: Final = 500  # of the points of a belief
_MOMENTS: Final = 4
_PALETTE: Final = ("#1769aa", "#c2410c", "#15803d", "#7c3aed", "#b91c1c", "#0e7490", "#a16207", "#be185d")
_ROLES: Final = {
    Role.TRUTH: "#111827", Role.COMMANDED: "#9aa3af", Role.FENCE: "#b91c1c", Role.AREA: "#15803d",
    Role.FOUND: "#be185d", Role.MEASURED: "#a16207", Role.BELIEF: "#7c3aed", Role.ESTIMATE: "#1769aa",
}  # fmt: skip
_MOVING: Final = ("setpoint", "camera")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plots:
    """Plots for a page.

    Attributes:
        script: a `script` element that fills the others.
        parts: titles and `div` elements.
    """

    script: str
    parts: Sequence[tuple[str, str]]


def script_tag(path: Path) -> str:
    """The `script` elements with the library, for a page that needs no network.

    Raises:
        EstimatorError: Bokeh is not installed.
    """
    resources = library("bokeh.resources", path)
    text: str = resources.Resources(mode="inline", components=["bokeh"]).render_js()
    return text


def interactive_plots(path: Path, scenes: Mapping[str, Scene]) -> Plots:
    """Plots of one scene, or of several in comparison.

    Args:
        path: the page, for messages.
        scenes: by the name of the run.

    Raises:
        EstimatorError: Bokeh is not installed.
    """
    plotting = library("bokeh.plotting", path)
    library("bokeh.models", path)
    made: list[tuple[str, Any]] = [("Track from above", _from_above(plotting, scenes))]
    series = _series(scenes)
    shared: Any = None
    for title, lines in series.items():
        plot = _over_time(plotting, title, lines, shared)
        shared = shared or plot.x_range
        made.append((title, plot))
    for name, scene in scenes.items():
        made += [(title, plot) for title, plot in _moments(plotting, name if len(scenes) > 1 else "", scene)]
    script, divs = library("bokeh.embed", path).components(tuple(plot for _, plot in made), wrap_script=True)
    return Plots(script=script, parts=[(title, div) for (title, _), div in zip(made, divs, strict=True)])


def _from_above(plotting: Any, scenes: Mapping[str, Scene]) -> Any:
    plot = plotting.figure(
        height=560, sizing_mode="stretch_width", match_aspect=True, active_scroll="wheel_zoom",
        x_axis_label="east of home, m", y_axis_label="north of home, m",
        tooltips=[("", "$name"), ("", "@text")],
    )  # fmt: skip
    several = len(scenes) > 1
    for number, (name, scene) in enumerate(scenes.items()):
        end = scene.at(scene.span_us[1])
        for path, item in end.items():
            if path.split("/")[-1] not in _MOVING and (not several or number == 0):
                _draw_item(plot, path, item)
        tracks = [path.split("/") for path in scene.paths if path.startswith("vehicles/")]
        tracks = [parts for parts in tracks if len(parts) == 3 and parts[2] in ("estimate", "truth")]
        ids = list(dict.fromkeys(system_id for _, system_id, _ in tracks))
        for _, system_id, source in tracks:
            path, truth = f"vehicles/{system_id}/{source}", source == "truth"
            colour = _PALETTE[(number if several else ids.index(system_id)) % len(_PALETTE)]
            label = f"{name}: vehicle {system_id}" if several else f"vehicle {system_id}"
            _draw_track(plot, scene[path], f"{label}{', true' if truth else ', estimated'}", colour, truth)
        for path in scene.paths:
            if path.startswith("targets/") and not several:
                label = getattr(scene[path][-1].item, "label", path)
                _draw_track(plot, scene[path], label, _ROLES[Role.TRUTH], False, width=1.0)
    plot.legend.click_policy = "hide"
    plot.legend.background_fill_alpha = 0.8
    if len(plot.legend.items) > 12:
        plot.legend.visible = False
    return plot


def _draw_track(
    plot: Any, entries: Sequence[Entry], label: str, colour: str, truth: bool, *, width: float = 2.0
) -> None:
    time_s, places = _track(entries)
    if not len(time_s):
        return
    broken_s, broken = broken_at_gaps(time_s, places)
    texts = [f"{at:.1f} s, {-down:.1f} m high" for at, down in zip(broken_s, broken[:, 2], strict=True)]
    data = {"x": _small(broken[:, 1]), "y": _small(broken[:, 0]), "text": texts}
    plot.line("x", "y", source=_source(data), color=colour, width=width, alpha=0.95 if not truth else 0.7,
              line_dash="dashed" if truth else "solid", legend_label=label, name=label)  # fmt: skip
    plot.scatter(x=[places[-1, 1]], y=[places[-1, 0]], color=colour, size=7, name=f"{label}, at the end")


def _track(entries: Sequence[Entry]) -> tuple[Array, Array]:
    """Times and places of a pose, as many as a plot shows."""
    poses = [(entry.time_us, entry.item) for entry in entries if isinstance(entry.item, Pose)]
    poses = poses[:: max(1, len(poses) // _MOST_POINTS)]
    if not poses:
        return np.zeros(0), np.zeros((0, 3))
    return np.array([at * 1e-6 for at, _ in poses]), np.array([pose.pos_ned_m for _, pose in poses])


def _draw_item(plot: Any, path: str, item: Placed) -> None:
    name = getattr(item, "label", "") or path
    colour = _ROLES.get(getattr(item, "role", Role.ESTIMATE), "#111827")
    if isinstance(item, Line) and len(item.points_ned_m):
        points = item.drawn_ned_m
        plot.line(points[:, 1], points[:, 0], color=colour, width=3, alpha=0.6, name=name,
                  legend_label=_word(name))  # fmt: skip
    elif isinstance(item, PointSet) and len(item.points_ned_m):
        points = item.points_ned_m[:: max(1, len(item.points_ned_m) // _MOST_SET)]
        belief = item.role is Role.BELIEF
        labels = item.labels if len(item.labels) == len(points) else ("",) * len(points)
        data = {"x": _small(points[:, 1]), "y": _small(points[:, 0]), "text": list(labels)}
        plot.scatter("x", "y", source=_source(data), color=colour, size=3 if belief else 7, name=name,
                     alpha=0.4 if belief else 0.9, legend_label=_word(name))  # fmt: skip
    elif isinstance(item, Gaussian):
        outline = item.outline_ned_m()
        plot.patch(outline[:, 1], outline[:, 0], fill_alpha=0.15, color=colour, name=f"{name}, 3 sigma",
                   legend_label=_word(name))  # fmt: skip


def _word(path: str) -> str:
    return path.replace("vehicles/", "vehicle ").replace("/", " ")


def _series(scenes: Mapping[str, Scene]) -> dict[str, list[tuple[str, Array, Array, Array]]]:
    """Lines by the title of their plot: name, times s, values and standard deviations. Series of one name and
    unit share a plot.
    """
    found: dict[str, list[tuple[str, Array, Array, Array]]] = {}
    for name, scene in scenes.items():
        for path in scene.paths:
            samples = [(entry.time_us * 1e-6, entry.item) for entry in scene[path]]
            values = [(at, item) for at, item in samples if isinstance(item, Value)]
            if not values:
                continue
            parts = path.split("/")
            whose = f"vehicle {parts[1]}" if parts[0] == "vehicles" else " ".join(parts[:-1])
            what = " ".join(parts[2:] if parts[0] == "vehicles" else parts[-1:]).replace("_", " ")
            unit = values[0][1].unit
            values = values[:: max(1, len(values) // _MOST_POINTS)]
            columns = np.array([(at, item.value, item.sigma) for at, item in values]).T
            title = f"{what}, {unit}" if unit else what
            line = f"{name}: {whose}" if len(scenes) > 1 else whose
            found.setdefault(title, []).append((line, columns[0], columns[1], columns[2]))
    first = ("height", "error")
    return dict(sorted(found.items(), key=lambda item: (not item[0].startswith(first), item[0])))


def _over_time(
    plotting: Any, title: str, lines: Iterable[tuple[str, Array, Array, Array]], x_range: Any
) -> Any:
    shared = {} if x_range is None else {"x_range": x_range}
    plot = plotting.figure(
        height=200, sizing_mode="stretch_width", x_axis_label="vehicle time, s", y_axis_label=title,
        tooltips=[("", "$name"), ("time", "@x{0.0} s"), (title, "@y{0.000}")], **shared,
    )  # fmt: skip
    for number, (name, time_s, values, sigma) in enumerate(lines):
        colour = _PALETTE[number % len(_PALETTE)]
        x, y = broken_at_gaps(time_s, values)
        if np.isfinite(sigma).any():
            x, low, high = broken_at_gaps(time_s, *_band(title, values, sigma))
            plot.varea(x=_small(x), y1=_small(low), y2=_small(high), color=colour, alpha=0.15,
                       legend_label=f"{name}, 3 sigma")  # fmt: skip
        data = {"x": _small(x), "y": _small(y)}
        plot.line("x", "y", source=_source(data), color=colour, width=1.3, legend_label=name, name=name)
    plot.legend.click_policy = "hide"
    plot.legend.label_text_font_size = "8pt"
    plot.legend.background_fill_alpha = 0.7
    return plot


def _band(title: str, values: Array, sigma: Array) -> tuple[Array, Array]:
    """The band of three standard deviations: of an error it is around 0."""
    middle = np.zeros_like(values) if title.startswith("error") else values
    low = np.zeros_like(values) if title.startswith("error position") else middle - 3.0 * sigma
    return low, middle + 3.0 * sigma


def _moments(plotting: Any, name: str, scene: Scene) -> list[tuple[str, Any]]:
    """Fields at some moments from their first change to their last."""
    found = []
    for path in scene.paths:
        entries = [entry for entry in scene[path] if isinstance(entry.item, Field)]
        chosen = np.unique(np.linspace(0, len(entries) - 1, _MOMENTS).astype(int)) if entries else ()
        for number in chosen:
            entry = entries[number]
            item = entry.item
            assert isinstance(item, Field)
            stride = max(1, int(np.ceil(max(item.values.shape) / 200)))
            low, high = item.scale
            plot = plotting.figure(
                height=330, width=400, match_aspect=True, x_axis_label="east of home, m",
                y_axis_label="north of home, m", tooltips=[(item.unit, "@image{0.000}")],
            )  # fmt: skip
            rows, columns = item.values.shape
            plot.image(
                image=[np.asarray(item.values[::stride, ::stride], dtype=np.float32)], x=item.west_m,
                y=item.south_m, dw=columns * item.cell_m, dh=rows * item.cell_m, palette="Viridis256",
            )  # fmt: skip
            title = f"{_word(path)} at {entry.time_us * 1e-6:.0f} s, {item.unit} {low:.3g} to {high:.3g}"
            found.append((f"{name}: {title}" if name else title, plot))
    return found


def _source(data: Mapping[str, Any]) -> Any:
    return library("bokeh.models", Path("report.html")).ColumnDataSource(data=dict(data))


def _small(values: Array) -> NDArray[np.float32]:
    return np.asarray(values, dtype=np.float32)
