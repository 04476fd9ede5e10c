# SPDX-License-Identifier: Apache-2.0
"""What the presets of distribution ray tracing cost and what error they leave on scenes made by others, beside path tracing."""
import json

import common

SHARED = common.ROOT.parent / "shared/scenes"
SCENES = {"cornell": common.ROOT / "scenes/cornell-box/cornell.pbrt", "staircase2": SHARED / "staircase2/scene-v4.pbrt",
          "classroom": SHARED / "classroom/scene-v4.pbrt", "forest-above": SHARED / "forest/forest-above.pbrt"}
PRESETS = {"draft": (2, [4]), "preview": (4, [16]), "final": (4, [64, "--max-pixel-samples", 1024])}  # bounces, camera samples: scenes may say others
SIZE = "128x96"
REFERENCE_SAMPLES, PEER_SAMPLES = 512, 16


def bench(context):
    rows, result = [], {}
    for name, scene in SCENES.items():
        if not scene.exists():
            continue
        frame = ["--resolution", SIZE, "--threads", context.threads, "--float"]
        for bounces in sorted({bounces for bounces, _ in PRESETS.values()}):
            reference = context.out / f"presets_{name}_{bounces}.exr"
            if not reference.exists():
                common.render(context, scene, reference, "--integrator", "path", "--bounces", bounces, "--pixel-samples", REFERENCE_SAMPLES, *frame)
        image = context.out / "presets.exr"

        def add(label, bounces, *options):
            stats = common.render(context, scene, image, "--bounces", bounces, *options, *frame)
            found = json.loads(common.run([context.program("image_diff"), image, context.out / f"presets_{name}_{bounces}.exr", "--times-median", 8,
                                           "--dilate", 2, "--block", 8, "--json"]))
            errors = [found["relative_rmse"], found["block_rmse"], max(found["mean_error"], key=abs)]
            rows.append([name, label, f"{stats['render_cpu_seconds']:.1f} s"] + [f"{100 * e:.1f} %" for e in errors])
            result[f"{name}, {label}"] = {"cpu_seconds": stats["render_cpu_seconds"], "rmse": errors[0], "block_rmse": errors[1], "mean_error": errors[2]}

        for preset, (bounces, samples) in PRESETS.items():
            add(preset, bounces, "--integrator", "distribution", "--preset", preset, "--pixel-samples", *samples)
        add(f"path, {PEER_SAMPLES} samples", 4, "--integrator", "path", "--pixel-samples", PEER_SAMPLES)
    if not rows:
        raise common.Skip("no scenes")
    text = (f"{SIZE} pixels, {context.threads} threads, processor time of rendering without loading; against path tracing with {REFERENCE_SAMPLES} samples at the same number of "
            "bounces, without what is 8 times as bright as the median. Small images are dear a pixel: the cache serves large ones as well.\n\n"
            + common.table(["scene", "preset", "processor time", "RMSE of pixels", "of 8x8 blocks", "of means"], rows))
    return {"presets": result}, text
