#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes bust.obj, the cage of a Catmull-Clark surface: a cube's lattice blown up to a head, with bumps for features, on shoulders.

Usage: make_bust.py [OUT.obj]. Units: metres; z up, the face looks along -y; the statuette is 12 cm tall.
"""
import math
import pathlib
import sys

N = 18  # faces along an edge of the cube
HEAD = 0.032

# Bumps of the head's radius: direction (x, y, z), widths along x, y and z, height; x is mirrored.
BUMPS = [
    ((0, -1, -.10), (.11, .5, .20), .26),    # nose
    ((0, -1, -.26), (.15, .5, .08), .17),    # its tip
    ((.42, -1, .10), (.17, .5, .13), -.20),  # eye sockets
    ((.40, -1, .08), (.10, .5, .07), .13),   # eyes
    ((.36, -1, .30), (.34, .5, .09), .10),   # brows
    ((.60, -1, -.22), (.2, .5, .17), .08),   # cheeks
    ((0, -1, -.50), (.19, .5, .055), .10),   # upper lip
    ((0, -1, -.66), (.16, .5, .055), .11),   # lower lip
    ((0, -1, -.58), (.24, .5, .03), -.12),   # between them
    ((0, -1, -.98), (.26, .6, .16), .17),    # chin
    ((1, .20, -.02), (.6, .09, .28), .42),   # ears
    ((1, .08, -.03), (.6, .05, .18), -.12),
    ((0, .3, 1), (.7, .8, .5), -.10),        # crown
]


def head(d):
    """Point of the head in direction d."""
    r = 1.0
    for centre, width, height in BUMPS:
        length = math.sqrt(sum(c * c for c in centre))
        x = abs(d[0]) if centre[0] > 0 else d[0]
        e = [(v - c / length) / w for v, c, w in zip((x, d[1], d[2]), centre, width)]
        if d[1] * centre[1] >= 0 or abs(centre[1]) < .5:
            r += height * math.exp(-sum(v * v for v in e) / 2)
    jaw = 1 - .18 * max(0, -d[2])
    return [HEAD * r * s * v for s, v in zip((.78 * jaw, .92 * jaw, 1.12), d)]


def place(d):
    """The head, and below it neck and shoulders."""
    p = head(d)
    low = max(0.0, min(1.0, (-d[2] - .74) / .26))  # 0: head, 1: middle of the base
    if low == 0:
        return [p[0], p[1], p[2] + .085]
    # The cap around -z becomes, from its rim inwards: neck, shoulders, chest, base.
    radius = math.hypot(d[0], d[1])
    c, s = (d[0] / radius, d[1] / radius) if radius > 0 else (0, 0)
    profile = [(0, .019, .056), (.12, .0165, .049), (.28, .018, .042), (.4, .034, .035), (.52, .044, .026), (.66, .045, .012), (.78, .040, .0), (1, 0, 0)]
    for (a, ra, za), (b, rb, zb) in zip(profile, profile[1:]):
        if a <= low <= b:
            t = (low - a) / (b - a)
            r, z = ra + (rb - ra) * t, za + (zb - za) * t
            break
    wide = min(1, low / .4)
    return [c * r * (1 + .28 * wide), s * r * (1 - .30 * wide) + .006, z]


def main():
    index, vertices, faces = {}, [], []

    def vertex(key):
        if key not in index:
            index[key] = len(vertices) + 1
            v = [math.tan(math.pi / 4 * (2 * k / N - 1)) for k in key]
            length = math.sqrt(sum(c * c for c in v))
            vertices.append(place([c / length for c in v]))
        return index[key]

    for axis in range(3):
        for side in (0, N):
            for i in range(N):
                for j in range(N):
                    corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                    if side == 0:
                        corners.reverse()
                    keys = []
                    for a, b in corners:
                        key = [0, 0, 0]
                        key[axis], key[(axis + 1) % 3], key[(axis + 2) % 3] = side, a, b
                        keys.append(tuple(key))
                    faces.append([vertex(k) for k in keys])
    out = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).with_name("bust.obj")
    lines = [f"v {x * 1000:.2f} {y * 1000:.2f} {z * 1000:.2f}" for x, y, z in vertices]
    lines += ["f " + " ".join(map(str, f)) for f in faces]
    out.write_text("# millimetres; made by make_bust.py\n" + "\n".join(lines) + "\n")


main()
