"""What a viewer shows of a run, described without any viewer.

A scene is a sequence of entries (path, time, item) on the timeline of the run. Items are places and poses,
lines, points, Gaussians, fields (grids), pictures, values and texts (`estimators.scene_items`), in metres,
north east down of the scene's origin. Entries come from three sources:

* the messages of a run (`messages`): vehicles, truth, plans, fences, modes, texts; live or from any log,
* the estimators (`Estimator.shown`), beside what their estimates give by the names of their columns
  (`estimates`),
* the mission (`MissionFlight.shown`).

What the messages do not hold is kept in `flight.scene` beside the log of a run (`recording`), so that a live
and a recorded run give the same scene. `Scene.of_log` reads the scene of a run or log; viewers, reports and
MCAP draw it.
"""
