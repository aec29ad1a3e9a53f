"""Search with a shared occupancy map: cells, decisions, detections, the mission.

Source: Lum, Rysdyk and Pongpunwattana 2005, section IV; docs/papers.md.
"""
