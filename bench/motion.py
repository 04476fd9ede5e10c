# SPDX-License-Identifier: Apache-2.0
"""A fast-spinning textured object lit by a moving lamp: what motion costs over the still frame, and how far the image is from path tracing."""
import json
import tempfile
from pathlib import Path

import common

BOUNCES = 2
NO_INTERPOLATION = ["--irradiance-interpolation", "off"]
# Name, options: all at 16 camera samples a pixel.
CASES = [
    ("4, 4", ["--shadow-rays", 4, "--diffuse-rays", 4, *NO_INTERPOLATION]),
    ("16,4, 64,16", ["--shadow-rays", "16,4", "--diffuse-rays", "64,16", *NO_INTERPOLATION]),
    ("64,16, 256,36", ["--shadow-rays", "64,16", "--diffuse-rays", "256,36", *NO_INTERPOLATION]),
    ("preset preview: 4, 64,4, interpolated", ["--preset", "preview", "--visible-points", "grids"]),
    ("64,16, 256,36, interpolated", ["--shadow-rays", "64,16", "--diffuse-rays", "256,36"]),
]
SIZE, PATH_SIZE = "320x240", "160x120"
PATH_SAMPLES = 1024


def way(moving, start, end, turn):
    """From one transform to another, or still in between. start, end: translations; turn: degrees, axis."""
    at = lambda p, t: f"Translate {p[0]} {p[1]} {p[2]} Rotate {turn[0] * t} {turn[1]}"
    if moving:
        return f"ActiveTransform StartTime {at(start, 0)} ActiveTransform EndTime {at(end, 1)} ActiveTransform All"
    return at([(a + b) / 2 for a, b in zip(start, end)], .5)


def scene(folder, moving):
    text = f"""Film "rgb" "integer xresolution" 320 "integer yresolution" 240
PixelFilter "box"
LookAt 0 -4.6 1.6  0 0 1  0 0 1
Camera "perspective" "float fov" 42
WorldBegin
AttributeBegin
  {way(moving, (-1.2, -.6, 2.6), (1.2, -.2, 2.6), (0, "0 0 1"))}
  AreaLightSource "diffuse" "rgb L" [ 40 38 34 ]
  Shape "bilinearmesh" "point3 P" [ -.25 .25 0  .25 .25 0  -.25 -.25 0  .25 -.25 0 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]
Shape "bilinearmesh" "point3 P" [ -2 2 3  2 2 3  -2 -2 3  2 -2 3 ]
Shape "bilinearmesh" "point3 P" [ -2 2 0  2 2 0  -2 2 3  2 2 3 ]
Material "diffuse" "rgb reflectance" [ .7 .15 .1 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0  -2 2 0  -2 -2 3  -2 2 3 ]
Material "diffuse" "rgb reflectance" [ .1 .2 .7 ]
Shape "bilinearmesh" "point3 P" [ 2 2 0  2 -2 0  2 2 3  2 -2 3 ]
Texture "checks" "spectrum" "checkerboard" "float uscale" 6 "float vscale" 3 "rgb tex1" [ .9 .8 .1 ] "rgb tex2" [ .1 .4 .1 ]
AttributeBegin
  {way(moving, (-.1, 0, .75), (.1, 0, .75), (170, ".3 0 1"))}
  Material "diffuse" "texture reflectance" "checks"
  Scale 1 .35 .6
  Shape "sphere" "float radius" .7
AttributeEnd
"""
    path = folder / f"{'moving' if moving else 'still'}.pbrt"
    path.write_text(text)
    return path


def bench(context):
    result, rows = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scenes = {kind: scene(folder, kind == "moving") for kind in ("still", "moving")}
        common_options = ["--bounces", BOUNCES, "--threads", context.threads, "--float", "--quiet"]
        images = {kind: context.out / f"motion_{kind}.exr" for kind in ("path", "still", "moving")}
        common.render(context, scenes["moving"], images["path"], "--integrator", "path", "--pixel-samples", PATH_SAMPLES, "--resolution", PATH_SIZE, *common_options)
        for rays, options in CASES:
            options = [*options, "--integrator", "distribution", "--caustics", "on", "--pixel-samples", 16,
                       "--resolution", SIZE, *common_options]
            runs = {kind: [] for kind in scenes}
            for _ in range(context.repeats):
                for kind in scenes:
                    runs[kind].append(common.render(context, scenes[kind], images[kind], *options))
            seconds = {kind: common.median([r["render_cpu_seconds"] for r in of]) for kind, of in runs.items()}
            count = {kind: sum(of[0]["rays"].values()) for kind, of in runs.items()}
            points = {kind: of[0]["shading_points"]["diffuselighting"] for kind, of in runs.items()}
            # The lamp is bright streaks in both: it is left out, with what is beside it.
            error = json.loads(common.run([context.program("image_diff"), images["moving"], images["path"], "--times-median", 8, "--dilate", 2, "--json"]))
            result.append({"rays": rays, "runs": runs, "error": error})
            rows.append([rays, f"{seconds['still']:.2f} s", f"{seconds['moving']:.2f} s", f"{seconds['moving'] / seconds['still']:.2f}",
                         f"{count['moving'] / count['still']:.2f}", f"{points['moving'] / points['still']:.2f}", *errors(error)])
    text = (f"A spinning ellipsoid under a lamp that crosses the room, {SIZE}, 16 camera samples, {BOUNCES} bounces; processor time of all threads, medians of {context.repeats} runs "
            f"in alternation with the same scene in the middle of the motion. Errors against path tracing at {PATH_SIZE} with {PATH_SAMPLES} samples.\n\n"
            + common.table(["shadow and diffuse rays", "still", "moving", "ratio", "rays, ratio", "shading points, ratio", "means", "16 x 16 blocks", "worst block"], rows))
    return {"cases": result}, text


def errors(e):
    return [", ".join(f"{100 * x:+.2f}" for x in e["mean_error"]) + " %", f"{100 * e['block_rmse']:.2f} %", f"{100 * e['block_max']:.1f} %"]
