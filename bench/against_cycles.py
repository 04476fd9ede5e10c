# SPDX-License-Identifier: Apache-2.0
"""Dapple's path tracer against Blender's Cycles: the measured Cornell box, 512x512, 64 samples, one diffuse bounce, the same number of
threads. Times are those of rendering, without start-up and loading; the two pictures are compared, so that the work is the same."""
import json
import re
import shutil

import common

SCENE = common.ROOT / "scenes/cornell-box/cornell.pbrt"


def cycles(context, image):
    log = common.run(["blender", "-b", "--factory-startup", "-P", common.ROOT / "bench/cycles.py", "--", SCENE, image,
                      "--threads", context.threads])
    header = common.run(["oiiotool", "--info", "-v", image])
    minutes, seconds = re.search(r'cycles\.ViewLayer\.render_time: "(\d+):([\d.]+)"', header).groups()
    version = json.loads(next(line for line in log.splitlines() if line.startswith("{")))["blender"]
    return 60 * int(minutes) + float(seconds), version


def dapple(context, image):
    stats = common.render(context, SCENE, image, "--resolution", "512x512", "--pixel-samples", 64, "--bounces", 1, "--threads",
                          context.threads, "--float")
    return stats["render_seconds"]


def bench(context):
    if not shutil.which("blender"):
        raise common.Skip("Blender is not installed (scripts/bench --peers)")
    cycles_image, dapple_image = context.out / "cornell_cycles.exr", context.out / "cornell_dapple.exr"
    times = {"cycles": [], "dapple": []}
    for _ in range(context.repeats):
        seconds, version = cycles(context, cycles_image)
        times["cycles"].append(seconds)
        times["dapple"].append(dapple(context, dapple_image))
    difference = json.loads(common.run([context.program("image_diff"), dapple_image, cycles_image, "--brightest", 0.007, "--dilate", 2,
                                        "--block", 32, "--json"]))

    ratio = common.median(times["cycles"]) / common.median(times["dapple"])
    rows = [[name, f"{common.median(t):.2f} s", f"{100 * common.spread(t):.0f} %"]
            for name, t in ((f"Cycles {version}", times["cycles"]), ("Dapple", times["dapple"]))]
    text = (f"{SCENE.name} at 512x512, 64 samples, one bounce, {context.threads} threads, {context.repeats} runs in alternation.\n\n"
            + common.table(["renderer", "median", "half range"], rows)
            + f"\n\nDapple is **{ratio:.2f}** times as fast. Pictures: means differ by at most "
            f"{100 * max(map(abs, difference['mean_error'])):.2f} %, 32x32 block averages by {100 * difference['block_rmse']:.2f} %.")
    return {"seconds": times, "speed_ratio": ratio, "difference": difference}, text
