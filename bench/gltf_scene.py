# SPDX-License-Identifier: Apache-2.0
"""A glTF scene that Blender exports (bench/blender_scene.py: pictures, metal, gloss, lamps, instances, a skin, a camera) as Dapple reads it, beside Cycles' picture of
the same scene in Blender: means, and 8x8 blocks away from highlights and the lamp. Needs Blender."""
import json

import common

SAMPLES = 256


def bench(context):
    folder = context.out / "gltf_scene"
    folder.mkdir(parents=True, exist_ok=True)
    model, theirs, ours = folder / "scene.glb", folder / "blender.exr", folder / "dapple.exr"
    common.blender("blender_scene.py", model, theirs, SAMPLES, context.threads)
    scene = folder / "scene.pbrt"
    common.run([context.program("dapple"), "convert", model, "-o", scene, "--resolution", "240x160"])
    scene.write_text(scene.read_text().replace("Camera ", 'PixelFilter "box" "float xradius" .5 "float yradius" .5\nCamera ', 1))
    common.render(context, scene, ours, "--integrator", "path", "--pixel-samples", SAMPLES, "--bounces", 4, "--float", "--threads",
                  context.threads, "-q")
    found = json.loads(common.run([context.program("image_diff"), ours, theirs, "--times-median", 6, "--dilate", 2, "--block", 8, "--json"]))
    mean = max(map(abs, found["mean_error"]))
    rows = [["mean, the worst channel", f"{100 * mean:.2f} %"], ["8x8 blocks, root mean square", f"{100 * found['block_rmse']:.2f} %"]]
    return {"mean": mean, "block": found["block_rmse"]}, common.table(["Dapple against Cycles", ""], rows)
