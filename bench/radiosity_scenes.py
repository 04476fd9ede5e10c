# SPDX-License-Identifier: Apache-2.0
"""Scenes that bench/radiosity.py generates: the Cornell box with other shaders and lights, and a hall full of displaced objects."""
import random
import re

import common

CORNELL = common.ROOT / "scenes/cornell-box/cornell.pbrt"
NODES = 200  # of patterns in a network
COLORS = {"white": (.725, .71, .68), "red": (.63, .065, .05), "green": (.14, .45, .091)}


def network(prefix, seed, below=None):
    """Lines of NODES float patterns, the last of them named PREFIX with values in [.6, 1]: layers of noises, the second layer's over coordinates
    that the first warps, joined by arithmetic; the pattern `below` goes into the last."""
    rng = random.Random(seed)
    lines, layer, layers = [], [], 0

    def add(kind, parameters):
        name = prefix if len(lines) == NODES - 1 else f"{prefix}.{len(lines)}"
        lines.append(f'Texture "{name}" "float" "{kind}" {parameters}')
        return name

    def join(one, other):
        return add(rng.choice(["multiply", "add", "max", "subtract"]), f'"texture in1" "{one}" "texture in2" "{other}"')

    axes = []
    for axis in "xyz":
        metres = add("coordinate", f'"string which" "{axis}"')
        axes.append(add("multiply", f'"texture in1" "{metres}" "float in2" {rng.uniform(.005, .03):.4f}'))  # the box is 550 wide
    while len(lines) < NODES - 12:
        previous, layer, layers = layer, [], layers + 1
        for i in range(min(8, (NODES - 3 - len(lines)) // 5)):
            warp = axes[0]
            if layers == 2:
                offset = add("multiply", f'"texture in1" "{rng.choice(previous)}" "float in2" {rng.uniform(.2, .6):.3f}')
                warp = add("add", f'"texture in1" "{axes[0]}" "texture in2" "{offset}"')
            noise = add(rng.choice(["perlin", "perlin", "simplex", "worley"]), f'"texture x" "{warp}" "texture y" "{axes[1]}" "texture z" "{axes[2]}" '
                        f'"float scale" {rng.uniform(.3, 1.2):.3f}')
            eased = add("smoothstep", f'"texture in" "{noise}" "float low" -.6 "float high" 1.2')
            layer.append(join(eased, previous[i] if previous else noise))
    loose = [below] * bool(below) + previous[len(layer):] + layer  # what nothing has read yet
    end = loose.pop()
    while len(lines) < NODES - 2:
        end = join(end, loose.pop() if loose else layer[0])
    wave = add("sin", f'"texture in" "{end}"')
    add("remap", f'"texture in" "{wave}" "float inlow" -1 "float inhigh" 1 "float outlow" .6 "float outhigh" 1')
    assert len(lines) == NODES
    return lines


def networks(copies):
    """Lines of so many networks, of which each takes the value of the one before; the last is named network.COPIES."""
    return [line for i in range(1, copies + 1) for line in network(f"network.{i}", i, f"network.{i - 1}" if i > 1 else None)]


CORRIDOR = """NamedMaterial "white"
Shape "bilinearmesh" "point3 P" [0 0 -900  556 0 -900  0 0 0  556 0 0]
Shape "bilinearmesh" "point3 P" [0 548.8 -900  0 548.8 0  556 548.8 -900  556 548.8 0]
Shape "bilinearmesh" "point3 P" [0 0 -900  0 0 0  0 548.8 -900  0 548.8 0]
Shape "bilinearmesh" "point3 P" [556 0 -900  556 548.8 -900  556 0 0  556 548.8 0]
Shape "bilinearmesh" "point3 P" [0 0 -900  0 548.8 -900  556 0 -900  556 548.8 -900]
"""


def closed_cornell(folder):
    return write(folder / "cornell_closed.pbrt", CORNELL.read_text() + CORRIDOR)


def shaded_cornell(folder, copies):
    """The Cornell box with reflectances that networks modulate, and a corridor around the camera: every ray meets something."""
    lines = networks(copies)
    for name, rgb in COLORS.items():
        lines.append(f'Texture "{name}" "spectrum" "scale" "texture scale" "network.{copies}" "rgb tex" [{rgb[0]} {rgb[1]} {rgb[2]}]')
        lines.append(f'MakeNamedMaterial "{name}" "string type" "diffuse" "texture reflectance" "{name}"')
    text = re.sub(r"MakeNamedMaterial.*\n", "", CORNELL.read_text()).replace("WorldBegin\n", "WorldBegin\n" + "\n".join(lines) + "\n")
    text += CORRIDOR
    return write(folder / f"cornell_shaders_{copies}.pbrt", text)


def lit_cornell(folder, lights):
    """The Cornell box with so many small lamps under its ceiling, which together give the light of the one."""
    text = CORNELL.read_text()
    lamp = text.index("AttributeBegin")
    text = text[:lamp] + quad("white", 213, 548.8, 227, 130, 105)  # the hole of the lamp that was there
    columns = max(1, round(lights ** .5))
    rows = -(-lights // columns)
    side = 20
    scale = 130 * 105 / (lights * side * side)
    text += 'Material "diffuse" "rgb reflectance" [0 0 0]\n'
    text += f'AreaLightSource "diffuse" "rgb L" [{17 * scale:.6g} {12 * scale:.6g} {4 * scale:.6g}]\n'
    for i in range(lights):
        row, column = divmod(i, columns)
        x, z = 550 * (column + .5) / columns, 550 * (row + .5) / rows
        text += quad(None, x - side / 2, 548, z - side / 2, side, side)
    return write(folder / f"cornell_lights_{lights}.pbrt", text)


def quad(material, x, y, z, width, depth):
    """A horizontal quad that faces down."""
    points = f"{x} {y} {z}  {x + width} {y} {z}  {x + width} {y} {z + depth}  {x} {y} {z + depth}"
    named = f'NamedMaterial "{material}"\n' if material else ""
    return named + f'Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [{points}]\n'


HALL = '''# Written by bench/radiosity_scenes.py: {count} instances of a displaced subdivision surface in a closed hall with a ceiling of light.
LookAt 0 -12.5 9  0 0 0  0 0 1
Camera "perspective" "float fov" 60
Film "rgb" "integer xresolution" 512 "integer yresolution" 512 "string filename" "hall.exr" "bool savefp16" false
PixelFilter "box" "float xradius" .5 "float yradius" .5
Sampler "zsobol" "integer pixelsamples" 4
Integrator "distribution" "integer bounces" 3
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 6 5.6 5 ]
  Shape "bilinearmesh" "point3 P" [-5 -5 11.9  -5 5 11.9  5 -5 11.9  5 5 11.9]
AttributeEnd
Texture "grain" "float" "fbm" "integer octaves" 6 "float roughness" .6
Texture "bumps" "float" "scale" "texture tex" "grain" "float scale" .12
MakeNamedMaterial "sand" "string type" "diffuse" "rgb reflectance" [ .5 .45 .36 ]
MakeNamedMaterial "clay" "string type" "diffuse" "rgb reflectance" [ .62 .38 .26 ]
NamedMaterial "sand"
Shape "bilinearmesh" "point3 P" [-13 -13 -.6  13 -13 -.6  -13 13 -.6  13 13 -.6]
Shape "bilinearmesh" "point3 P" [-13 -13 12  -13 13 12  13 -13 12  13 13 12]
Shape "bilinearmesh" "point3 P" [-13 13 -.6  13 13 -.6  -13 13 12  13 13 12]
Shape "bilinearmesh" "point3 P" [13 -13 -.6  -13 -13 -.6  13 -13 12  -13 -13 12]
Shape "bilinearmesh" "point3 P" [-13 -13 -.6  -13 13 -.6  -13 -13 12  -13 13 12]
Shape "bilinearmesh" "point3 P" [13 13 -.6  13 -13 -.6  13 13 12  13 -13 12]
ObjectBegin "stone"
NamedMaterial "clay"
Shape "catmullclark" "point3 P" [-.7 -.7 -.7  .7 -.7 -.7  .7 .7 -.7  -.7 .7 -.7  -.7 -.7 .7  .7 -.7 .7  .7 .7 .7  -.7 .7 .7]
  "integer indices" [0 3 2 1  4 5 6 7  0 1 5 4  1 2 6 5  2 3 7 6  3 0 4 7]
  "texture displacement" "bumps" "float displacementbound" .3
ObjectEnd
'''


def hall(folder, side):
    """side x side displaced stones on the floor of a closed hall: every ray meets something."""
    rng = random.Random(1)
    lines = []
    for i in range(side):
        for j in range(side):
            x, y = (24 * ((k + .5 + rng.uniform(-.2, .2)) / side - .5) for k in (i, j))
            size = 16 / side * rng.uniform(.7, 1.1)
            lines += ["AttributeBegin", f"Translate {x:.3f} {y:.3f} 0 Rotate {rng.uniform(0, 360):.1f} {rng.gauss(0, 1):.3f} {rng.gauss(0, 1):.3f} 1",
                      f"Scale {size:.3f} {size:.3f} {size:.3f}", 'ObjectInstance "stone"', "AttributeEnd"]
    return write(folder / f"hall_{side}.pbrt", HALL.format(count=side * side) + "\n".join(lines) + "\n")


def write(path, text):
    path.write_text(text)
    return path
