"""angles: every function over a grid of angles and limits, including the ends of the circle."""

import hashlib
from math import pi

import angles
from referee import show

GRID = [-9.5, -2 * pi, -5, -pi, -3, -pi / 2, -0.25, 0, 1e-9, 0.25, pi / 2, 3, pi, 5, 2 * pi, 7.5, 20]
CIRCLE = [each for each in GRID if -pi <= each <= pi]

for name in ("normalize_angle_positive", "normalize_angle", "two_pi_complement"):
    show(name, [repr(getattr(angles, name)(each)) for each in GRID])
show("shortest", [repr(angles.shortest_angular_distance(a, b)) for a in GRID for b in GRID])
for name in (
    "shortest_angular_distance_with_limits",
    "shortest_angular_distance_with_large_limits",
    "_find_min_max_delta",
):
    function = getattr(angles, name)
    for left in GRID:
        found = [
            function(a, left, right) if name[0] == "_" else function(a, b, left, right)
            for a in CIRCLE
            for b in CIRCLE
            for right in GRID
        ]
        show(name, left, found[7::700], hashlib.md5(repr(found).encode()).hexdigest())
show(
    angles.shortest_angular_distance_with_limits(-0.5, 0.5, 0.25, -0.25),
    angles.shortest_angular_distance_with_limits(-0.5, 0.5, -0.25, 0.25),
)
