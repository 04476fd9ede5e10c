# SPDX-License-Identifier: Apache-2.0
"""Frames through cut-out leaves without the opacity cache, with it, and with a plain decoded mask where alpha is a picture."""
import json
import math
import random
import tempfile
from pathlib import Path

import common

LEAVES = 6000  # of a tree

# A leaf's outline, with holes that some noises eat into it. Of u and v alone, or in space: then every leaf has its own.
PATTERN = """
Texture "u" "float" "coordinate" "string which" "u"
Texture "v" "float" "coordinate" "string which" "v"
Texture "du" "float" "remap" "texture in" "u" "float outlow" -1
Texture "dv" "float" "remap" "texture in" "v" "float outlow" -1
Texture "du2" "float" "multiply" "texture in1" "du" "texture in2" "du"
Texture "dv2" "float" "multiply" "texture in1" "dv" "texture in2" "dv"
Texture "du4" "float" "multiply" "texture in1" "du2" "float in2" 2.2
Texture "r2" "float" "add" "texture in1" "du4" "texture in2" "dv2"
Texture "cells" "float" "worley" PLACE "string output" "edge" "float scale" 5
Texture "eaten" "float" "fbm" PLACE "integer octaves" 8
Texture "veined" "float" "turbulence" PLACE "integer octaves" 8
Texture "warped" "float" "add" "texture in1" "u" "texture in2" "veined"
Texture "torn" "float" "fbm" "texture x" "warped" "texture y" "v" "float z" .5 "integer octaves" 8
Texture "half" "float" "add" "texture in1" "eaten" "texture in2" "torn"
Texture "both" "float" "add" "texture in1" "half" "texture in2" "veined"
Texture "all" "float" "multiply" "texture in1" "both" "texture in2" "cells"
Texture "ragged" "float" "add" "texture in1" "r2" "texture in2" "all"
Texture "leaf" "float" "smoothstep" "texture in" "ragged" "float low" .95 "float high" .9
"""
PLACES = {"uv": '"texture x" "u" "texture y" "v" "float z" .5', "space": ""}


def cards(rng, count):
    """A crown of leaf cards in a ball of 2 m at 3 m height."""
    points, uv, indices = [], [], []
    while len(points) < 4 * count:
        c = [rng.uniform(-2, 2) for _ in range(3)]
        if math.hypot(*c) > 2:
            continue
        a, b = rng.uniform(0, 2 * math.pi), rng.uniform(-.7, .7)
        x = (math.cos(a) * .08, math.sin(a) * .08, 0)
        y = (-math.sin(a) * .11 * math.cos(b), math.cos(a) * .11 * math.cos(b), .11 * math.sin(b))
        n = len(points)
        for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            points.append([c[k] + i * x[k] + j * y[k] + (3 if k == 2 else 0) for k in range(3)])
            uv.append([(i + 1) / 2, (j + 1) / 2])
        indices += [n, n + 1, n + 2, n, n + 2, n + 3]
    flat = lambda rows: " ".join(f"{v:.5g}" for row in rows for v in row)
    return f'"point3 P" [ {flat(points)} ] "point2 uv" [ {flat(uv)} ] "integer indices" [ {" ".join(map(str, indices))} ]'


def grove(folder, place):
    rng = random.Random(1)
    text = f"""Film "rgb" "integer xresolution" 480 "integer yresolution" 270
LookAt 0 -14 4  0 0 2.6  0 0 1
Camera "perspective" "float fov" 40
PixelFilter "box"
WorldBegin
LightSource "distant" "rgb L" [ 3 2.8 2.5 ] "point3 from" [ -.52 -.37 .77 ]
LightSource "infinite" "rgb L" [ .25 .35 .55 ]
{PATTERN.replace("PLACE", PLACES[place])}
Material "diffuse" "rgb reflectance" [ .3 .25 .2 ]
Shape "bilinearmesh" "point3 P" [ -40 -40 0  40 -40 0  -40 40 0  40 40 0 ]
ObjectBegin "tree"
  Material "diffusetransmission" "rgb reflectance" [ .05 .11 .04 ] "rgb transmittance" [ .04 .1 .02 ]
  Shape "trianglemesh" {cards(rng, LEAVES)} "texture alpha" "leaf"
ObjectEnd
"""
    for _ in range(12):
        x, y = rng.uniform(-6, 6), rng.uniform(-4, 8)
        text += f'AttributeBegin Translate {x:.2f} {y:.2f} 0 Rotate {rng.uniform(0, 360):.0f} 0 0 1 ObjectInstance "tree" AttributeEnd\n'
    path = folder / f"grove-{place}.pbrt"
    path.write_text(text)
    return path


def bench(context):
    result, rows = {}, []

    def measure(name, scene, *options):
        r = json.loads(common.run([context.program("bench_opacity"), scene, "--repeats", context.repeats, "--threads", context.threads, *options]))
        result[name] = r
        d, c = r["difference"], r["cache"]
        mask = [f"{common.median(r['mask']):.2f} s", f"{common.median(r['on_to_mask']):.2f}"] if "mask" in r else ["", ""]
        rows.append([name, f"{r['microseconds_a_hit']:.2f} us", f"{common.median(r['off']):.2f} s", f"{common.median(r['on']):.2f} s",
                     f"{common.median(r['off_to_on']):.2f}", *mask, f"{100 * c['hits'] / max(c['lookups'], 1):.1f} %", f"{c['bytes'] / 2 ** 20:.1f} MB",
                     f"{100 * d['mean']:+.3f} %, {100 * d['blocks']:.2f} %"])

    with tempfile.TemporaryDirectory() as folder:
        for place in PLACES:
            scene = grove(Path(folder), place)
            kind = "pattern over u, v" if place == "uv" else "pattern in space"
            measure(f"{kind}, 4 shadow rays", scene, "--rays", 4)
            measure(f"{kind}, 16 shadow rays", scene, "--rays", 16)
            measure(f"{kind}, 64 shadow rays", scene, "--rays", 64)
            measure(f"{kind}, ambient occlusion, 8 rays", scene, "--integrator", "ao", "--rays", 8)
        forest = common.ROOT.parent / "shared/scenes/forest/forest-cutout.pbrt"
        if forest.exists():
            measure("picture, 4 shadow rays", forest, "--rays", 4)
            measure("picture, ambient occlusion, 8 rays", forest, "--integrator", "ao", "--rays", 8)
            measure("picture, path tracing", forest, "--integrator", "path", "--bounces", 1)
    text = (f"User processor time of rendering, filling included, {context.repeats} runs in alternation, 480 x 270 pixels, 4 samples.\n\n"
            + common.table(["opacity", "a hit", "without", "with", "gain", "plain mask", "with / mask", "hits", "memory", "image: mean, blocks of 16 x 16"], rows))
    return result, text
