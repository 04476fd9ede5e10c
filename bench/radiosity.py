#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What shading on grids and the radiosity cache gain: times with and without the cache, and the error that the cache leaves.

Writes OUT/radiosity_TABLE.md and .json for each of the tables named, or all:
  cornell   the Cornell box at 0 to 3 bounces, preview and final rays, without and with the cache
  shaders   the box, closed, with networks of 200 patterns as reflectances, and what 64 camera samples cost against 4
  lights    2, 20 and 100 small lamps
  memory    thousands of displaced objects, and caches of parts of what all their entries take
  error     differences from path tracing against time, for values of --cache-width and for path tracing itself
"""
import argparse
import json
import os
import sys
from types import SimpleNamespace

import common
import radiosity_scenes as scenes

QUALITIES = {"preview": ((4, 4), (4, 4)), "final": ((64, 16), (1024, 16))}  # shadow and diffuse rays
FULL = dict(resolution=1024, preview_samples=16, final_samples=64, corridor=0, final_resolution=256, qualities=["preview", "final"], bounces=3, max_rays=3e8, shader_resolution=512, shader_rays=3e7, copies=[3],
            final_shader_resolution=128, light_resolution=512,
            lights=[2, 20, 100], halls=[(64, 800, .002, [1 / 2, 1 / 4]), (12, 128, .02, [1 / 2, 1 / 4, 1 / 10, 1 / 20, 0])], error_resolution=256, reference_samples=4096,
            errors=[2, 1, .5, .25, .125], path_samples=[4, 16, 64, 256])
QUICK = dict(FULL, resolution=128, final_resolution=32, bounces=2, max_rays=1e7, shader_resolution=96, shader_rays=2e6, final_shader_resolution=32, light_resolution=96, halls=[(12, 96, .02, [1 / 4, 0])],
             error_resolution=128, reference_samples=256, errors=[1, .5, .25], path_samples=[4, 16])


class Bench:
    """The program, its options, and the clock."""

    def __init__(self, context, clock, **sizes):
        self.context, self.clock, self.size = context, clock, SimpleNamespace(**sizes)

    def render(self, scene, *options, resolution, samples, bounces, rays=((4,), (4,)), cache=True, integrator="distribution", image=None,
               threads=None):
        image = image or self.context.out / "radiosity.exr"
        lists = []
        if integrator == "distribution":
            lists = ["--irradiance-interpolation", "off", "--radiosity-cache", "on" if cache else "off", "--shadow-rays", ",".join(map(str, rays[0])), "--diffuse-rays",
                     ",".join(map(str, rays[1]))]
        s = common.render(self.context, scene, image, "--integrator", integrator, *lists, "--resolution", f"{resolution}x{resolution}", "--bounces",
                          bounces, "--pixel-samples", samples, "--threads", threads or self.context.threads, "--float", "--quiet", *options)
        s["seconds"] = s["render_seconds" if self.clock == "wall" else "render_cpu_seconds"]
        return s

    def medians(self, runs):
        """Statistics of each run, in alternation, with the medians of their times."""
        repeats = [[run() for run in runs] for _ in range(self.context.repeats)]
        for i, first in enumerate(repeats[0]):
            first["seconds"] = common.median([r[i]["seconds"] for r in repeats])
        return repeats[0]

    def pair(self, scene, **what):
        return self.medians([lambda c=c: self.render(scene, cache=c, **what) for c in (False, True)])

    def compare(self, image, reference, *options):
        return json.loads(common.run([self.context.program("image_diff"), image, reference, "--json", *options]))


def traced(stats):
    """Rays that do not come from the camera."""
    return sum(stats["rays"].values()) - stats["rays"]["camera"]


def points(stats):
    return stats["shading_points"]["diffuselighting"]


def seconds(t):
    return f"{t:.2f} s" if t < 10 else f"{t:.0f} s" if t < 600 else f"{t / 60:.0f} min" if t < 36000 else f"{t / 3600:.1f} h"


def ratio(a, b):
    return f"{a / b:.3g}" if b else "-"


def pair_columns(without, cached):
    return [seconds(without["seconds"]), seconds(cached["seconds"]), ratio(without["seconds"], cached["seconds"]), ratio(traced(without), traced(cached)),
            ratio(points(without), points(cached))]


PAIR_HEADER = ["without", "with", "speed-up", "rays, ratio", "shading points, ratio"]


def rays_a_point(rays, bounces):
    """Rays of one visible point without a cache, if every diffuse ray meets something."""
    depth = lambda numbers, d: numbers[min(d, len(numbers) - 1)]
    total, hits = 0, 1
    for d in range(bounces + 1):
        total += hits * depth(rays[0], d)
        if d < bounces:
            hits *= depth(rays[1], d)
            total += hits
    return total


def from_crops(bench, scene, pixels, zero, rays, samples, bounces, max_rays):
    """Time and counts without the cache from small crops on a lattice, in proportion to visible shading points; None if that is too much."""
    cost = rays_a_point(rays, bounces) * 2  # visible points a pixel, where crops cut tiles
    counts = [n for n in (4, 3, 2) if n * n * 16 * cost <= max_rays]
    if not counts:
        return None
    n = counts[0]
    side = max(4, min(int((max_rays / cost) ** .5 / n), pixels // n) // 4 * 4)
    sums = []
    for b in (0, bounces):
        runs = []
        for i in range(n * n):
            x, y = (int((k + .5) * pixels / n) // 4 * 4 - side // 8 * 4 for k in (i % n, i // n))
            runs.append(bench.render(scene, "--crop", f"{x},{y},{x + side},{y + side}", threads=1, resolution=pixels, samples=samples, bounces=b,
                                     rays=rays, cache=False))
        sums.append({"time": sum(r["render_cpu_seconds"] for r in runs), "rays": sum(map(traced, runs)), "points": sum(map(points, runs))})
    direct, full = sums
    scale = points(zero) / direct["points"]
    share = 1 if bench.clock == "cpu" else bench.context.threads  # as if threads were used perfectly
    grow = lambda key: scale * (full[key] - direct[key])
    return {"seconds": zero["seconds"] + grow("time") / share, "rays": {"camera": 0, "diffuse": traced(zero) + grow("rays")},
            "shading_points": {"diffuselighting": points(zero) + grow("points")}, "extrapolated": f"{n * n} crops of {side} x {side} pixels"}


def pair_or_crops(bench, scene, zero, max_rays, *, resolution, rays, bounces, **what):
    """Statistics without and with the cache; those without may come from crops, or be None."""
    what.update(resolution=resolution, rays=rays, bounces=bounces)
    if rays_a_point(rays, bounces) * resolution ** 2 <= max_rays:
        return bench.pair(scene, **what)
    cached = bench.medians([lambda: bench.render(scene, **what)])[0]
    return from_crops(bench, scene, resolution, zero, rays, what["samples"], bounces, max_rays), cached


def columns_of(without, cached, crops):
    """Those of PAIR_HEADER. Adds to `crops` where times are from."""
    if without is None:
        return ["not run", seconds(cached["seconds"]), "-", "-", "-"]
    columns = pair_columns(without, cached)
    if "extrapolated" in without:
        columns[0] += " *"
        crops.add(without["extrapolated"])
    return columns


def crops_note(crops):
    return f"\n\n\\* Extrapolated in proportion to visible shading points, from {' or '.join(sorted(crops))}." if crops else ""


def cornell(bench):
    size, rows, result, crops = bench.size, [], [], set()
    scene = scenes.closed_cornell(bench.context.out) if size.corridor else scenes.CORNELL
    for quality in size.qualities:
        resolution, samples = (size.resolution, size.preview_samples) if quality == "preview" else (size.final_resolution, size.final_samples)
        what = dict(resolution=resolution, samples=samples, rays=QUALITIES[quality])
        zero = bench.pair(scene, bounces=0, **what)
        for bounces in range(size.bounces + 1):
            without, cached = pair_or_crops(bench, scene, zero[0], size.max_rays, bounces=bounces, **what) if bounces else zero
            rows.append([quality, bounces, *columns_of(without, cached, crops)])
            result.append({"quality": quality, "bounces": bounces, "without": without, "with": cached})
            print("|", " | ".join(map(str, rows[-1])), "|", file=sys.stderr, flush=True)
    text = (("The box with a corridor around the camera: every ray meets something. " if size.corridor else "")
            + f"Preview: {size.resolution} x {size.resolution}, 4 shadow and 4 diffuse rays, {size.preview_samples} camera samples; final: {size.final_resolution} x {size.final_resolution}, 64,16 and 1024,16 rays, {size.final_samples} camera samples. "
            "The ratio of rays, without camera rays, is what the cache could gain at most if shading and look-ups were free.\n\n"
            + common.table(["rays", "bounces"] + PAIR_HEADER, rows))
    return result, text + crops_note(crops)


def shaders(bench):
    size, folder = bench.size, bench.context.out
    direct = dict(resolution=size.shader_resolution, samples=4, bounces=0, cache=False)

    def cost(copies):
        scene = scenes.shaded_cornell(folder, copies)
        s = bench.render(scene, threads=1, **direct)
        running = min(1, s["seconds"] / s["render_seconds"])  # shading_seconds are wall time, of which others may have had a share
        return scene, 1e6 * s["shading_seconds"] * (running if bench.clock == "cpu" else 1) / points(s)

    probe = 16
    copies = max(1, round(probe * 30 / cost(probe)[1]))
    rows, result, crops = [], [], set()

    def add(quality, n, microseconds, bounces, without, cached):
        shares = [f"{100 * s['shading_seconds'] / (s['render_seconds'] * s['threads']):.0f} %" if s and "shading_seconds" in s else "-"
                  for s in (without, cached)]
        rows.append([quality, f"{microseconds:.2g} us", bounces, *shares, *columns_of(without, cached, crops)])
        result.append({"quality": quality, "networks": n, "microseconds": microseconds, "bounces": bounces, "without": without, "with": cached})
        print("|", " | ".join(map(str, rows[-1])), "|", file=sys.stderr, flush=True)

    for n in size.copies + [copies]:
        scene, microseconds = cost(n)
        what = dict(resolution=size.shader_resolution, samples=4, rays=((4,), (4,)))
        zero = bench.pair(scene, bounces=0, **what)
        for bounces in range(size.bounces + 1):
            pair = pair_or_crops(bench, scene, zero[0], size.shader_rays, bounces=bounces, **what) if bounces else zero
            add("preview", n, microseconds, bounces, *pair)
    what = dict(resolution=size.final_shader_resolution, samples=size.final_samples, rays=QUALITIES["final"])
    zero = bench.pair(scene, bounces=0, **what)
    for bounces in (1, 2):
        add("final", copies, microseconds, bounces, *pair_or_crops(bench, scene, zero[0], 2 * size.shader_rays, bounces=bounces, **what))
    text = (f"Networks of {scenes.NODES} patterns as reflectances, {', '.join(map(str, size.copies))} and {copies} in a row, in the Cornell box with a corridor around the camera: every ray meets something. "
            f"Preview: {size.shader_resolution} x {size.shader_resolution}, 4 shadow and 4 diffuse rays, 4 camera samples; "
            f"final: {size.final_shader_resolution} x {size.final_shader_resolution}, 64,16 and 1024,16 rays, {size.final_samples} camera samples.\n\n"
            + common.table(["rays", "shader a point", "bounces", "in shaders, without", "with"] + PAIR_HEADER, rows) + crops_note(crops))

    reuse = []
    for bounces in (0, 1, 2):
        few, many = bench.medians([lambda n=n: bench.render(scene, resolution=size.shader_resolution, samples=n, bounces=bounces) for n in (4, 64)])
        reuse.append([bounces, seconds(few["seconds"]), seconds(many["seconds"]), ratio(many["seconds"], few["seconds"]), points(few), points(many),
                      ratio(points(many), points(few))])
        result.append({"networks": copies, "bounces": bounces, "4 samples": few, "64 samples": many})
    text += (f"\n\nThe shader of {microseconds:.0f} us with 4 and with 64 camera samples a pixel, with the cache:\n\n"
             + common.table(["bounces", "4", "64", "ratio", "diffuselighting points at 4", "at 64", "ratio"], reuse))
    return result, text


def lights(bench):
    size, rows, result = bench.size, [], []
    for n in size.lights:
        scene = scenes.lit_cornell(bench.context.out, n)
        for bounces in (0, 2):
            without, cached = bench.pair(scene, resolution=size.light_resolution, samples=4, bounces=bounces)
            rows.append([n, bounces, *pair_columns(without, cached)])
            result.append({"lights": n, "bounces": bounces, "without": without, "with": cached})
    text = (f"{size.light_resolution} x {size.light_resolution}, 4 shadow and 4 diffuse rays, 4 camera samples.\n\n"
            + common.table(["lights", "bounces"] + PAIR_HEADER, rows))
    return result, text


def memory(bench):
    """Against a cache with room for all entries: at a large working set what keeps most of it, and the whole curve at a small one."""
    results, texts = [], []
    for stones, pixels, width, fractions in bench.size.halls:
        result, text = memory_curve(bench, stones, pixels, width, fractions)
        results += result
        texts.append(text)
    return results, "\n\n".join(texts)


def memory_curve(bench, stones, pixels, width, fractions):
    rows, result = [], []
    scene = scenes.hall(bench.context.out, stones)
    reference, image, cropped = (bench.context.out / f"radiosity_memory_{name}.exr" for name in ("reference", "image", "crop"))

    def render(megabytes, *options, to=image):
        return bench.medians([lambda: bench.render(scene, "--cache-mb", f"{megabytes:.4f}", "--cache-width", width, *options, resolution=pixels, samples=4, bounces=2,
                                                   rays=((4, 1), (16, 4)), image=to)])[0]

    def total(s, key):
        return sum(s["cache"][f"radiosity.{r}"][key] for r in ("coarse", "medium", "fine"))

    def row(name, s, time, same):
        rows.append([name, time, f"{100 * total(s, 'hits') / max(1, total(s, 'lookups')):.1f} %", total(s, "fills"), f"{total(s, 'lookups') / max(1, total(s, 'fills')):.3g}",
                     total(s, "evictions"), f"{total(s, 'bytes') / 1e6:.1f} MB", points(s), "yes" if same else "NO"])
        rows[-1][1:2] = [seconds(time), ratio(time, result[0]["seconds"] if result else time)]
        result.append({"stones": stones ** 2, "pixels": pixels, "cache": name, "seconds": time, "stats": s, "same_image": same})
        print("|", " | ".join(map(str, rows[-1])), "|", file=sys.stderr, flush=True)

    unlimited = render(4096, to=reference)
    everything = total(unlimited, "bytes") / 2 ** 20
    row("unlimited", unlimited, unlimited["seconds"], True)
    for f in fractions:
        if f > 0:
            s = render(everything * f)
            row(f"{everything * f:.3g} MB (1/{1 / f:.3g})", s, s["seconds"], bench.compare(image, reference)["relative_rmse"] == 0)
            continue
        spent, same, side = 0, True, 8
        corners = [(pixels * x // 4, pixels * y // 4) for x in (1, 3) for y in (1, 3)]
        for x, y in corners:
            crop = ["--crop", f"{x},{y},{x + side},{y + side}"]
            render(4096, *crop, to=cropped)
            s = render(0, *crop)
            spent += s["seconds"]
            same &= bench.compare(image, cropped)["relative_rmse"] == 0
        row("0 MB *", s, spent * pixels ** 2 / (len(corners) * side ** 2), same)
    text = (f"{stones ** 2} instances of a displaced subdivision surface in a closed hall, {pixels} x {pixels}, 2 bounces, 4,1 shadow and 16,4 diffuse rays, 4 camera samples, "
            f"`--cache-width {width}`: all entries take {everything:.3g} MB. The images are compared pixel for pixel.\n\n"
            + common.table(["cache", "time", "ratio", "hits", "fills", "look-ups a fill", "evictions", "peak", "shading points", "same image"], rows))
    if 0 in fractions:
        text += "\n\n\\* In proportion to pixels from 4 crops of 8 x 8; the counts are those of one of them."
    return result, text


def error(bench):
    size, rows, result = bench.size, [], []
    shadow, diffuse, bounces = (16, 4), (64, 16), 2
    reference, image = (bench.context.out / f"radiosity_{name}.exr" for name in ("reference", "error"))
    what = dict(resolution=size.error_resolution, bounces=bounces)
    bench.render(scenes.CORNELL, "--seed", 1, integrator="path", samples=size.reference_samples, image=reference, **what)

    def row(name, samples, *options, **more):
        s = bench.medians([lambda: bench.render(scenes.CORNELL, *options, samples=samples, image=image, **what, **more)])[0]
        d = bench.compare(image, reference, "--brightest", .007, "--dilate", 2)
        rows.append([name, seconds(s["seconds"]), f"{100 * max(map(abs, d['mean_error'])):.2f} %", f"{100 * d['block_rmse']:.2f} %",
                     f"{100 * d['relative_rmse']:.2f} %"])
        result.append({"name": name, "stats": s, "difference": d})

    for e in size.errors:
        row(f"cache-width {e}", 16, "--cache-width", e, rays=(shadow, diffuse))
    row("without the cache", 16, rays=(shadow, diffuse), cache=False)
    for n in size.path_samples:
        row(f"path, {n} samples", n, integrator="path")
    text = (f"The Cornell box, {size.error_resolution} x {size.error_resolution}, {bounces} bounces, 16,4 shadow and 64,16 diffuse rays, 16 camera samples, "
            f"against path tracing with {size.reference_samples} samples. Relative errors without the lamp: of the mean, of averages of 16 x 16 blocks, of pixels.\n\n"
            + common.table(["", "time", "mean", "blocks", "pixels"], rows))
    return result, text


TABLES = {"cornell": cornell, "shaders": shaders, "lights": lights, "memory": memory, "error": error}


def bench(context):
    """All tables at small sizes, for bench/run.py."""
    runner = Bench(common.Context(context.build, context.out, 1, context.threads), "wall", **QUICK)
    results, texts = {}, []
    for name, table in TABLES.items():
        results[name], text = table(runner)
        texts.append(f"### {name}\n\n{text}")
    return results, "\n\n".join(texts)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="TABLE", help=", ".join(TABLES))
    parser.add_argument("--quick", action="store_true", help="small sizes: all tables within 3 minutes on two processors")
    parser.add_argument("--build", default=common.ROOT / "build/release", help="build folder")
    parser.add_argument("--out", default=common.ROOT / "out/bench", help="folder of the results")
    parser.add_argument("--repeats", type=int, help="runs of each, of which the median counts (3; quick: 1)")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--clock", choices=["wall", "cpu"], default="wall", help="seconds of rendering, or of all processors meanwhile, "
                        "which say more where others use the machine")
    sizes = parser.add_argument_group("sizes")
    for name, value in FULL.items():
        if name == "halls":
            continue
        if isinstance(value, list):
            sizes.add_argument("--" + name.replace("_", "-"), nargs="+", type=type(value[0]) if name != "errors" else float)
        else:
            sizes.add_argument("--" + name.replace("_", "-"), type=type(value), help="rays above which times without the cache are extrapolated"
                               if name == "max_rays" else "1: the Cornell box is closed by a corridor around the camera" if name == "corridor" else None)
    options = parser.parse_args()
    for name in options.names:
        if name not in TABLES:
            parser.error(f"no table {name}; there are {', '.join(TABLES)}")

    context = common.Context(options.build, options.out, options.repeats or (1 if options.quick else 3), options.threads)
    chosen = {name: getattr(options, name) for name in FULL if getattr(options, name, None) is not None}
    runner = Bench(context, options.clock, **{**(QUICK if options.quick else FULL), **chosen})
    for name in options.names or TABLES:
        load = os.getloadavg()[0]
        rows, text = TABLES[name](runner)
        conditions = (f"{common.machine()}; {context.threads} threads, {options.clock} time, medians of {context.repeats}; load {load:.1f} at the start, "
                      f"{os.getloadavg()[0]:.1f} at the end")
        text = f"## {name}\n\n{conditions}\n\n{text}\n"
        print(text, flush=True)
        (context.out / f"radiosity_{name}.md").write_text(text)
        (context.out / f"radiosity_{name}.json").write_text(json.dumps({"machine": conditions, "rows": rows}, indent=2) + "\n")


if __name__ == "__main__":
    sys.exit(main())
