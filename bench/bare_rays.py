# SPDX-License-Identifier: Apache-2.0
"""What path tracing and cached distribution ray tracing cost beyond their rays, and how both scale with threads: paths on the landscape of a
million triangles, the cache in the Cornell box and on that landscape, with 4 shadow and 4 diffuse rays and one camera sample."""
import json

import common
import radiosity_scenes
import terrain


def bench(context):
    landscape = terrain.cached(context)
    cached = ["--integrator", "distribution", "--samples", 1]
    cases = [("path tracing, landscape", [landscape])]
    for bounces in (1, 2, 3):
        cases.append((f"cache, Cornell box, {bounces} bounce{'s' * (bounces > 1)}", [radiosity_scenes.CORNELL, "--size", 1024, "--bounces", bounces, *cached]))
    cases.append(("cache, landscape, 3 bounces", [landscape, "--size", 1024, "--bounces", 3, *cached]))
    results, rows, many = {}, [], str(context.threads)
    for name, arguments in cases:
        result = json.loads(common.run([context.program("bench_bare_rays"), *map(str, arguments), "--repeats", context.repeats, "--threads", context.threads]))
        render, embree = {}, {}
        for threads, times in result["threads"].items():
            render[threads] = common.median(times["render"])
            packets, single = common.median(times["embree_packets"]), common.median(times["embree_single"])
            embree[threads] = min(packets, single)
            rows.append([name, f"{result['rays'] / 1e6:.1f}", threads, f"{render[threads]:.2f} s", f"{packets:.2f} s", f"{single:.2f} s",
                         f"{render[threads] / embree[threads]:.2f}"])
        result["cost_ratio"] = {n: render[n] / embree[n] for n in render}
        result["scaling_against_embree"] = (render["1"] / render[many]) / (embree["1"] / embree[many])
        rows[-1].append(f"{100 * result['scaling_against_embree']:.1f} %")
        results[name] = result
    text = (f"{context.repeats} runs in alternation. Scaling: what rendering gains from {many} threads, of what Embree alone gains.\n\n"
            + common.table(["", "million rays", "threads", "rendering", "Embree, packets of 16", "Embree, single rays", "ratio to the faster", "scaling"],
                           [r + [""] * (8 - len(r)) for r in rows]))
    return results, text
