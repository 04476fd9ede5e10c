#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes lamps.pbrt: a floor of rooms with two lamps each, of which the camera's room has two and sees a few more through doorways."""
ROOMS_X, ROOMS_Y, SIDE, HEIGHT, DOOR, DOOR_HEIGHT, LAMP, THICK = 6, 3, 4.0, 3.0, 1.0, 2.1, 0.15, 0.05

HEAD = f"""# {ROOMS_X * ROOMS_Y} rooms with 2 lamps each (metres, z up), written by make_lamps.py. Most lamps are behind walls, wherever one stands.
LookAt 8.3 4.5 1.7  11 6.3 1.2  0 0 1
Camera "perspective" "float fov" 55
Film "rgb" "integer xresolution" 480 "integer yresolution" 270 "string filename" "lamps.exr"
Sampler "zsobol" "integer pixelsamples" 64
Integrator "path" "integer bounces" 4
WorldBegin
MakeNamedMaterial "wall" "string type" "diffuse" "rgb reflectance" [0.7 0.68 0.63]
MakeNamedMaterial "floor" "string type" "diffuse" "rgb reflectance" [0.35 0.25 0.18]
MakeNamedMaterial "wood" "string type" "coateddiffuse" "rgb reflectance" [0.4 0.2 0.1] "float roughness" 0.1
"""
FACES = "0 2 1 1 2 3  4 5 6 5 7 6  0 1 4 1 5 4  2 6 3 3 6 7  0 4 2 2 4 6  1 3 5 3 7 5"


def box(low, high):
    corners = [(high if i & 1 else low)[0:1] + (high if i & 2 else low)[1:2] + (high if i & 4 else low)[2:3] for i in range(8)]
    points = " ".join(f"{c:g}" for p in corners for c in p)
    return f'Shape "trianglemesh" "integer indices" [{FACES}] "point3 P" [{points}]'


def wall(along, at, begin, door):
    """From `begin`, SIDE long, at x = `at` along y, or at y = `at` along x."""
    def piece(a, b, z0, z1):
        low, high = ((at - THICK, a), (at + THICK, b)) if along == "y" else ((a, at - THICK), (b, at + THICK))
        return box((*low, z0), (*high, z1))
    if not door:
        return [piece(begin, begin + SIDE, 0, HEIGHT)]
    left, right = begin + (SIDE - DOOR) / 2, begin + (SIDE + DOOR) / 2
    return [piece(begin, left, 0, HEIGHT), piece(right, begin + SIDE, 0, HEIGHT), piece(left, right, DOOR_HEIGHT, HEIGHT)]


def lamp(x, y, color):
    z = HEIGHT - 0.3
    points = " ".join(f"{c:g}" for sx, sy in ((-1, -1), (-1, 1), (1, 1), (1, -1)) for c in (x + sx * LAMP, y + sy * LAMP, z))
    return ("AttributeBegin\n" f'AreaLightSource "diffuse" "rgb L" [{" ".join(f"{c:g}" for c in color)}]\n'
            f'Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [{points}]\nAttributeEnd')


def scene():
    lines = ['NamedMaterial "floor"', box((0, 0, -0.1), (ROOMS_X * SIDE, ROOMS_Y * SIDE, 0)), 'NamedMaterial "wall"',
             box((0, 0, HEIGHT), (ROOMS_X * SIDE, ROOMS_Y * SIDE, HEIGHT + 0.1))]
    for i in range(ROOMS_X + 1):
        for j in range(ROOMS_Y):
            lines += wall("y", i * SIDE, j * SIDE, 0 < i < ROOMS_X and (i + j) % 2 == 0)
    for j in range(ROOMS_Y + 1):
        for i in range(ROOMS_X):
            lines += wall("x", j * SIDE, i * SIDE, 0 < j < ROOMS_Y and i % 2 == 0)
    lines.append('NamedMaterial "wood"')
    for i in range(ROOMS_X):
        for j in range(ROOMS_Y):
            x, y = (i + 0.62) * SIDE, (j + 0.6) * SIDE
            lines += [box((x - 0.6, y - 0.4, 0.7), (x + 0.6, y + 0.4, 0.75)), box((x - 0.1, y - 0.1, 0), (x + 0.1, y + 0.1, 0.7))]
    for i in range(ROOMS_X):
        for j in range(ROOMS_Y):
            level = 8 + 4 * ((3 * i + 5 * j) % 4)
            lines += [lamp((i + 0.3) * SIDE, (j + 0.5) * SIDE, (level, 0.9 * level, 0.7 * level)),
                      lamp((i + 0.7) * SIDE, (j + 0.5) * SIDE, (0.8 * level, 0.9 * level, level))]
    return HEAD + "\n".join(lines) + "\n"


if __name__ == "__main__":
    from pathlib import Path
    (Path(__file__).parent / "lamps.pbrt").write_text(scene())
