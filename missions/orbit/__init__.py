"""GPS-denied orbit of a ground target by roll commands: Tolman, Beard et al. 2021, section IV.

`line_of_sight` (equations 36 to 40), `relative_target` (the target against the aircraft, wind and target
motion included), `guidance` (equations 33 to 35), `tracker` (the three put together, sans-IO), `mission`.
"""
