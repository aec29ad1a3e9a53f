"""GPS-denied orbit of a ground target by roll commands: Tolman, Beard et al. 2021, section IV.

`line_of_sight` (equations 36 to 40), `relative_target` (the target relative to the aircraft, including wind
and target motion), `guidance` (equations 33 to 35), `tracker` (the combination of these three, sans-IO),
`mission`.
"""
