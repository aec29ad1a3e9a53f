"""Pictures of what a camera sees: ground, sky, marks and targets, by the geometry of the detections.

Nothing of the simulation needs this package; whoever shows or keeps pictures imports it, in a process of its
own where the vehicle must not wait.
"""

from flightsim.picture.renderer import Renderer, Scenery

__all__ = ["Renderer", "Scenery"]
