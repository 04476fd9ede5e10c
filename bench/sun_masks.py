# SPDX-License-Identifier: Apache-2.0
"""How much of the sun is seen from every visible receiver of a forest's frame, by shadow rays and by layered depth masks, their making included."""
import json

import common

SETTINGS = {"8 cm, 128 levels, 16 rotations": ["--pitch", ".08", "--levels", "128", "--sets", "16"],
            "4 cm, 256 levels, 64 rotations": [],
            "2 cm, 256 levels, 64 rotations": ["--pitch", ".02"]}


def bench(context):
    scene = common.ROOT.parent / "shared/scenes/forest/forest-inside.pbrt"
    if not scene.exists():
        raise common.Skip(f"{scene} is absent")
    result, rows = {}, []
    for name, options in SETTINGS.items():
        r = json.loads(common.run([context.program("bench_sun_masks"), scene, "--repeats", context.repeats, "--threads", 1, *options]))
        result[name] = r
        v = r["visibility"]
        rows.append([name, f"{common.median(r['rays_cpu']):.2f} s", f"{common.median(r['masks_cpu']):.2f} s", f"{common.median(r['ratio_cpu']):.1f}",
                     f"{v['mean_rays']:.3f}, {v['mean_rays_a_slab_ahead']:.3f}, {v['mean_masks']:.3f}",
                     f"{100 * v['within_an_eighth']:.0f} %", f"{100 * v['within_a_slab_and_an_eighth']:.0f} %"])
    text = (f"{r['receivers']} receivers of 960 x 540 pixels, {r['samples']} samples of the sun each, {context.repeats} runs in alternation, processor time of one thread.\n\n"
            + common.table(["masks", "rays", "masks with their making", "ratio", "mean visibility by rays, by rays from a slab ahead, by masks",
                            "within 1/8 of the rays'", "or between the two"], rows))
    return result, text
