"""A scene with everything that one can have."""

import numpy as np

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
