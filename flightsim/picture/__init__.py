"""Pictures of a camera's view: ground, sky, marks and targets, by the geometry of the detections.

The simulation does not need this package. A program that shows or stores pictures imports it, in a separate
process if the vehicle must not wait.
"""

from flightsim.picture.renderer import Renderer, Scenery

__all__ = ["Renderer", "Scenery"]
