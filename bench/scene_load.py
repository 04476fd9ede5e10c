# SPDX-License-Identifier: Apache-2.0
"""Loading a mesh of a million triangles against what no reader can avoid: reading the file (cat) and Embree's build."""
import time

import common
import terrain


def bench(context):
    scene = terrain.cached(context)
    mesh = scene.with_name("terrain.ply")
    cat, build, total = [], [], []
    for _ in range(context.repeats):
        start = time.perf_counter()
        common.run(["sh", "-c", f"cat '{mesh}' > /dev/null"])
        cat.append(time.perf_counter() - start)
        load = common.render(context, scene, context.out / "terrain_load.exr", "--resolution", "16x16", "--pixel-samples", 1,
                             "--threads", context.threads)["load_seconds"]
        build.append(load["acceleration"])
        total.append(load["total"])

    ratio = common.median(total) / (common.median(cat) + common.median(build))
    rows = [[name, f"{1000 * common.median(t):.0f} ms", f"{100 * common.spread(t):.0f} %"]
            for name, t in (("cat", cat), ("Embree's build", build), ("whole load", total))]
    text = (f"{mesh.stat().st_size / 1e6:.1f} MB, {context.threads} threads, {context.repeats} runs.\n\n"
            + common.table(["step", "median", "half range"], rows)
            + f"\n\nLoading takes **{ratio:.2f}** times as long as reading and building.")
    return {"seconds": {"cat": cat, "embree_build": build, "load": total}, "ratio": ratio}, text
