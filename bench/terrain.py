# SPDX-License-Identifier: Apache-2.0
"""A diffuse landscape of a million triangles: a heightfield of 1000x500 quads as one binary PLY, lit by a sun and an even sky."""
import math
import struct
from array import array

COLUMNS, ROWS = 1000, 500  # quads; two triangles each
SCENE = '''# Written by bench/terrain.py: {triangles} diffuse triangles.
LookAt 0 -260 140  0 0 0  0 0 1
Camera "perspective" "float fov" 45
Film "rgb" "integer xresolution" 512 "integer yresolution" 512 "string filename" "terrain.exr" "bool savefp16" false
PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
Sampler "independent" "integer pixelsamples" 16
Integrator "path" "integer maxdepth" 5
WorldBegin
LightSource "distant" "rgb L" [ 2.5 2.3 2.0 ] "point3 from" [ -2 -1 1.5 ] "point3 to" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ 0.4 0.5 0.7 ]
Material "diffuse" "rgb reflectance" [ 0.5 0.45 0.4 ]
Shape "plymesh" "string filename" "terrain.ply"
'''


def height(x, y):
    """Ridges of five octaves, in metres."""
    h, amplitude, frequency = 0.0, 24.0, 0.021
    for octave in range(5):
        h += amplitude * abs(math.sin(frequency * x + 1.7 * octave + math.sin(0.8 * frequency * y))
                             * math.cos(1.1 * frequency * y - 0.9 * octave))
        amplitude *= 0.45
        frequency *= 2.3
    return h


def write(folder):
    """Writes terrain.ply and terrain.pbrt to a folder; returns the path of the second."""
    vertices = array("f")
    for j in range(ROWS + 1):
        for i in range(COLUMNS + 1):
            x, y = 400.0 * (i / COLUMNS - 0.5), 400.0 * (j / ROWS - 0.5)
            vertices.extend((x, y, height(x, y)))
    face = struct.Struct("<Biii")
    faces = bytearray()
    for j in range(ROWS):
        for i in range(COLUMNS):
            a = j * (COLUMNS + 1) + i
            c = a + COLUMNS + 1
            faces += face.pack(3, a, a + 1, c + 1)
            faces += face.pack(3, a, c + 1, c)
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices) // 3}\nproperty float x\nproperty float y\n"
              f"property float z\nelement face {2 * ROWS * COLUMNS}\nproperty list uchar int vertex_indices\nend_header\n")
    with open(folder / "terrain.ply", "wb") as out:
        out.write(header.encode())
        vertices.tofile(out)
        out.write(faces)
    scene = folder / "terrain.pbrt"
    scene.write_text(SCENE.format(triangles=2 * ROWS * COLUMNS))
    return scene


def cached(context):
    """The scene in the folder of the results, written once."""
    scene = context.out / "terrain.pbrt"
    return scene if scene.exists() and (context.out / "terrain.ply").exists() else write(context.out)
