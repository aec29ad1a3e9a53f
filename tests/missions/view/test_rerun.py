"""What Rerun draws of a scene: entities by path, the layout, the page. 6 s; with its viewers slow."""

from urllib.request import urlopen

import numpy as np
import pytest

from estimators.scene_items import Field, Value
from tests.missions.view.a_scene import a_scene

rerun = pytest.importorskip("rerun", reason="Rerun is not installed: pip install 'flightstack[view]'")


def entities(path):
    """Paths of the entities in a file."""
    from rerun.chunk import RrdReader

    return {str(chunk.entity_path).strip("/") for chunk in RrdReader(path).stream()}


def test_entities_of_a_file_have_the_paths_of_the_entries(tmp_path):
    from missions.view.rerun_viewers import RerunFile

    scene, path = list(a_scene()), tmp_path / "scene.rrd"
    viewer = RerunFile(path)
    viewer.begin("a scene")
    for start in range(0, len(scene), 100):
        viewer.draw(scene[start : start + 100])
    viewer.finish()
    viewer.close()
    found = entities(path)
    assert {entry.path for entry in scene} <= found
    assert {"vehicles/1/trail/estimate", "vehicles/1/error/position/3_sigma"} <= found
    assert path.stat().st_size < 500_000


def test_north_east_is_the_upper_right_of_a_field():
    """The image of a grid has its first row at the top, which is y, east; its columns are x, north."""
    from missions.view.rerun_drawer import field_image

    values = np.zeros((3, 2))
    values[2, 1] = 1.0  # northernmost row, easternmost column
    image = field_image(Field(values=values, south_m=0.0, west_m=0.0, cell_m=1.0, unit=""))
    assert image.shape == (2, 3, 4)
    bright = np.unravel_index(np.argmax(image[..., 0]), (2, 3))
    assert bright == (0, 2)


def test_a_layout_has_a_plot_for_each_unit_with_errors_first():
    from missions.view.rerun_layout import Content, layout

    error, height = Value(value=1.0, unit="m", error=True), Value(value=1.0, unit="m")
    content = Content(
        places={"vehicles/1/estimate"},
        trails={"vehicles/1/trail/estimate"},
        series={"vehicles/1/error/position": error, "vehicles/1/height": height},
        bands={"vehicles/1/error/position"},
        states={"vehicles/1/mode"},
        texts={"vehicles/1/mode"},
    )
    blueprint = layout(content, "time", ((0.0, 0.0, -10.0), (100.0, 100.0, 0.0)))
    left, right = blueprint.root_container.contents
    assert [view.name for view in left.contents] == ["from above, north up", "in perspective"]
    tabs = right.contents[0]
    assert [tab.name for tab in tabs.contents] == ["errors", "vehicles"]
    assert content.copy() == content


@pytest.mark.slow
def test_the_page_is_served_on_this_machine_and_asks_for_nothing_elsewhere():
    from missions.view.rerun_viewers import RerunPage

    page = RerunPage(None)
    try:
        page.begin("a scene")
        page.draw(list(a_scene()))
        page.finish()
        with urlopen(page.where) as answer:
            text = answer.read().decode()
            policy = answer.headers["Content-Security-Policy"]
        assert "https://" not in text
        assert "connect-src 'self' http://127.0.0.1:" in policy
    finally:
        page.close()
