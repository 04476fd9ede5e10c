# SPDX-License-Identifier: Apache-2.0
"""What path tracing costs beyond its rays, and how both scale with threads, on the landscape of a million triangles."""
import json

import common
import terrain


def bench(context):
    scene = terrain.cached(context)
    result = json.loads(common.run([context.program("bench_path_rays"), scene, "--repeats", context.repeats, "--threads",
                                    context.threads]))
    rows, render, embree = [], {}, {}
    for threads, times in result["threads"].items():
        render[threads] = common.median(times["render"])
        packets, single = common.median(times["embree_packets"]), common.median(times["embree_single"])
        embree[threads] = min(packets, single)
        rows.append([threads, f"{render[threads]:.2f} s", f"{packets:.2f} s", f"{single:.2f} s",
                     f"{render[threads] / embree[threads]:.2f}"])
    many = str(context.threads)
    scaling = (render["1"] / render[many]) / (embree["1"] / embree[many])
    result["cost_ratio"] = {n: render[n] / embree[n] for n in render}
    result["scaling_against_embree"] = scaling
    text = (f"{result['rays'] / 1e6:.1f} million rays, {context.repeats} runs in alternation.\n\n"
            + common.table(["threads", "path tracing", "Embree, packets of 16", "Embree, single rays", "ratio to the faster"], rows)
            + f"\n\nFrom 1 to {many} threads path tracing gains **{100 * scaling:.1f} %** of what Embree alone gains.")
    return result, text
