"""The rules by which firmware refuses to fly a stored mission, as functions of the items and its parameters.

The emulated autopilots refuse by them, and missions apply them before an upload.
"""
