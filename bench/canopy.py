# SPDX-License-Identifier: Apache-2.0
"""Time of the plane-parallel solver, and how it grows with nodes, slabs and modes; a plot of that beside the tables."""
import json
import re
import sys

import common

sys.path.insert(0, str(common.ROOT / "python/dapple"))  # the package itself needs what is compiled
import plot  # noqa: E402

GROWTH = {"nodes": "nodes a hemisphere (8 slabs, 4 modes)", "slabs": "different slabs (8 nodes, 4 modes)", "modes": "modes (8 nodes, 8 slabs)"}
CDISORT_MS = {"one_wavelength_fluxes": {8: 0.022, 16: 0.070, 32: 0.28}, "one_wavelength_radiances": {8: 0.23, 16: 0.67, 32: 6.0}}


def measure(context):
    """Milliseconds of each repetition, by benchmark and argument."""
    text = common.run([context.program("bench_canopy"), f"--benchmark_repetitions={context.repeats}", "--benchmark_enable_random_interleaving=true",
                       "--benchmark_min_time=0.05", "--benchmark_format=json"])
    times = {}
    for run in json.loads(text)["benchmarks"]:
        if run["run_type"] != "iteration":
            continue
        match = re.match(r"(\w+)(?:/\w+:(\d+))?", run["name"])
        key = (match[1], int(match[2] or 0))
        clock = "real_time" if run["name"].endswith("real_time") else "cpu_time"
        times.setdefault(key, []).append(run[clock])
    return times


def bench(context):
    times = measure(context)
    medians = {key: common.median(values) for key, values in times.items()}
    rows = ["| benchmark | argument | ms, median | spread | cdisort, ms (elsewhere) |", "|---|---|---|---|---|"]
    for (name, argument), value in sorted(medians.items()):
        if name.startswith("cost_of_"):
            continue
        peer = CDISORT_MS.get(name, {}).get(argument)
        rows.append(f"| {name} | {argument or ''} | {value:.3g} | {100 * common.spread(times[name, argument]):.0f} % | {peer if peer else ''} |")
    panels = []
    for what, label in GROWTH.items():
        points = sorted((argument, value) for (name, argument), value in medians.items() if name == f"cost_of_{what}")
        reference = dict(points)[8 if what != "modes" else 4]
        rows += ["", f"RGB, three channels; cost against {label}:", "", "| " + what + " | ms, median | of the middle |", "|---|---|---|"]
        rows += [f"| {n} | {ms:.3g} | {ms / reference:.2f} |" for n, ms in points]
        x, y = zip(*points)
        panel = plot.Panel(f"Solver: {what}", label, "ms, one thread", log_x=True, log_y=True).line(x, y, "operators, RGB")
        slope = {"nodes": 3}.get(what, 1)
        panels.append(panel.line(x, [y[-1] * (n / x[-1]) ** slope for n in x], f"{what} to the power {slope}", "4 4"))
    (context.out / "canopy.svg").write_text(plot.figure(panels))
    result = {"milliseconds": [{"name": name, "argument": argument, "median": medians[name, argument], "all": values} for (name, argument), values in times.items()]}
    return result, "\n".join(rows) + "\n\nPlot: canopy.svg."
