"""What Rerun draws of a scene: entities by path, the layout, the page. 6 s; with its viewers slow."""

from urllib.request import urlopen

import numpy as np
import pytest

from estimators.scene_items import (
    Camera,
    Cleared,
    Entry,
    Field,
    Gaussian,
    Line,
    Origin,
    Picture,
    PointSet,
    Pose,
    Role,
    Text,
    Value,
)

rerun = pytest.importorskip("rerun", reason="Rerun is not installed: pip install 'flightstack[view]'")

LEVEL = (1.0, 0.0, 0.0, 0.0)


def a_scene(seconds=20):
    """Everything that a scene can have, of a vehicle that flies north at 5 m/s."""
    yield Entry("origin", 0, Origin(lat_deg=47.4, lon_deg=8.5, alt_m=490.0))
    area = np.array([(0.0, -50.0, 0.0), (100.0, -50.0, 0.0), (100.0, 50.0, 0.0), (0.0, 50.0, 0.0)])
    yield Entry("mission/area", 0, Line(points_ned_m=area, closed=True, role=Role.AREA, label="area"))
    yield Entry("vehicles/1/mode", 0, Text(text="mode AUTO", state="AUTO"))
    grid = np.zeros((10, 20), dtype=np.float32)
    for k in range(10 * seconds):
        time_us, north_m = 100_000 * k, 0.5 * k
        pose = Pose(pos_ned_m=(north_m, 0.0, -20.0), q_ned_from_frd=LEVEL)
        yield Entry("vehicles/1/estimate", time_us, pose)
        yield Entry("vehicles/1/truth", time_us, Pose(pos_ned_m=(north_m, 1.0, -20.0), role=Role.TRUTH))
        error = Value(value=1.0, unit="m", sigma=2.0, error=True)
        yield Entry("vehicles/1/error/position", time_us, error)
        if k % 10:
            continue
        grid[9, 19] = 0.01 * k  # the north-eastern corner
        field = Field(values=grid.copy(), south_m=0.0, west_m=-50.0, cell_m=5.0, unit="probability")
        yield Entry("mission/grid", time_us, field)
        covariance = np.diag([(50.0 - 0.2 * k) ** 2, 100.0])
        gaussian = Gaussian(mean_ned_m=(50.0, 20.0, 0.0), covariance_m2=covariance, label="target")
        yield Entry("mission/target", time_us, gaussian)
        points = PointSet(points_ned_m=area, weights=np.array([0.1, 0.2, 0.3, 0.4]))
        yield Entry("mission/particles", time_us, points)
        camera = Camera(
            pos_ned_m=(north_m, 0.0, -20.0),
            q_ned_from_camera=LEVEL,
            width_px=32,
            height_px=24,
            focal_px=(30.0, 30.0),
            centre_px=(16.0, 12.0),
        )
        yield Entry("vehicles/1/camera", time_us, camera)
        picture = Picture(pixels=np.full((24, 32, 3), 90, dtype=np.uint8), marks_px=np.array([[5.0, 6.0]]))
        yield Entry("vehicles/1/camera/picture", time_us, picture)
    yield Entry("mission/particles", 100_000 * 10 * seconds, Cleared())


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
