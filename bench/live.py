#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Live sessions: how soon pictures come after edits, beside a fresh rendering of the edited scene.

    bench/run.py live
    PYTHONPATH=build/release/python bench/live.py [--scenes cornell,staircase2,kitchen,classroom] [--resolution 320x180] [--rounds 5]
    PYTHONPATH=build/release/python bench/live.py --list [--scenes ...]

For each scene and kind of edit: seconds from the edit to the first picture (an eighth of the resolution, one sample a pixel) and to the
settled one, medians of the rounds (first pictures: and the 99th percentile, which of few rounds is the last of them); seconds of a fresh session from reading to its first and settled picture; how many fills of the
radiosity cache the edit took, of those of the fresh session. `cancel`: from an edit to the end of what was under way. Not denoised.
`gain`: of the first light, which is a group of its own; `gain, while it renders`: from the gain to the frame that shows it.
Processor time stands beside the first pictures: half of it is what two idle processors would take. `frame()`: milliseconds that a call of it takes
while the picture is rendered, median, 99th percentile and longest of some thousand.

--list: twenty edits such as users make, one after the other, each settled; against a fresh session of the scene as it then is (of the first
and the last of them). In the end the geometric means of settled over fresh: with the two gains, and of the other eighteen alone. Times of settled pictures are those of
--clock: of the wall, or the process's processor time (`cpu`) on a machine that others use too.
"""
import argparse
import math
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

HERE = os.path.dirname(os.path.abspath(__file__))
SHARED = os.path.join(HERE, "../../shared/scenes")
SCENES = {"cornell": os.path.join(HERE, "../scenes/cornell-box/cornell.pbrt"),
          "staircase2": os.path.join(SHARED, "staircase2/scene-v4.pbrt"),
          "kitchen": os.path.join(SHARED, "kitchen/scene-v4.pbrt"),
          "classroom": os.path.join(SHARED, "classroom/scene-v4.pbrt")}
# Walls, something small, and something like a chair, of each.
THINGS = {"cornell": ("white", "red", "trianglemesh:8"), "staircase2": ("Wall", "SpotHolder", "plymesh:12"),
          "kitchen": ("Walls", "KettleGreen", "plymesh:157"), "classroom": ("Walls", "FlagRed", "plymesh:29")}


def edits(scene):
    """Kinds of edits, as functions of scene and round."""
    import dapple
    light, material, shape = list(scene.lights)[0], list(scene.materials)[0], list(scene.shapes)[-1]
    return {
        "camera": lambda s, k: s.camera.move(dapple.translate(*(0.002 * (-1) ** k * x for x in EXTENT))),
        "light": lambda s, k: s.lights[light].edit(scale=1 + 0.1 * (k + 1)),
        "material": lambda s, k: s.materials[material].edit(reflectance=(0.2 + 0.05 * k, 0.4, 0.5)),
        "object": lambda s, k: s.shapes[shape].move(dapple.translate(0, 0.001 * EXTENT[1], 0)),
    }


def user_edits(scene, name):
    """(what, edit) of the list; a gain is a number."""
    import dapple
    lights = list(scene.lights)
    key, lamp = lights[0], lights[-1]
    wall, small, chair = THINGS[name]
    x, y, z = (0.01 * e for e in EXTENT)

    def camera(dx, dy, dz):
        return lambda s: s.camera.move(dapple.translate(dx, dy, dz))

    def light(which, **params):
        return lambda s: s.lights[which].edit(**params)

    def colour(which, *rgb):
        return lambda s: s.materials[which].edit(reflectance=rgb)

    def move(dx, dy, dz):
        return lambda s: s.shapes[chair].move(dapple.translate(dx, dy, dz))

    return [("camera", camera(x, 0, 0)), ("camera", camera(0, y, z)), ("key light by its gain", 1.5), ("wall colour", colour(wall, .6, .5, .4)),
            ("chair moved", move(5 * x, 0, 0)), ("key light", light(key, scale=1.4)), ("camera", camera(-x, 0, z)), ("lamp off", light(lamp, on=False)),
            ("lamp on", light(lamp, on=True)), ("small thing's colour", colour(small, .2, .5, .3)), ("chair moved", move(0, 0, 5 * z)),
            ("wall colour", colour(wall, .5, .55, .6)), ("key light by its gain", .8), ("camera", camera(x, -y, 0)), ("chair hidden", lambda s: s.shapes[chair].edit(visible=False)),
            ("chair shown", lambda s: s.shapes[chair].edit(visible=True)), ("key light", light(key, scale=1.1)), ("small thing's colour", colour(small, .6, .2, .1)),
            ("wall colour", colour(wall, .7, .7, .65)), ("camera", camera(-x, y, -z))]


def settled_session(scene, options):
    """A session that has settled."""
    import dapple
    live = dapple.LiveSession(scene, **options)
    live.wait()
    return live


def bench_list(name, options, clock):
    """The twenty edits of a scene: a line each, and the geometric means."""
    import tempfile
    import dapple
    begin = clock()
    live = settled_session(load(name), options)
    fresh = clock() - begin
    times = []
    for count, (what, edit) in enumerate(user_edits(dapple.load(SCENES[name]), name), 1):
        begin, wall, cpu = clock(), time.monotonic(), time.process_time()
        if callable(edit):
            live.edit(edit).result()
        else:
            live.gains["key"] = edit
        first_picture(live, count)
        first, cpu = time.monotonic() - wall, time.process_time() - cpu
        live.wait()
        times.append((what, first, cpu, clock() - begin))
    with tempfile.TemporaryDirectory() as folder:
        live.write(os.path.join(folder, "edited.pbrt"))
        begin = clock()
        settled_session(dapple.load(os.path.join(folder, "edited.pbrt")), options)
        last = clock() - begin
    mean = (fresh + last) / 2
    for what, first, cpu, settled in times:
        print(f"| {name} | {what} | {first:.3f} | {cpu:.3f} | {settled:.2f} | {settled / mean:.2f} |")
    ratios = [settled / mean for _, _, _, settled in times]
    others = [settled / mean for what, _, _, settled in times if "gain" not in what]
    print(f"| {name} | fresh, first and last | - | - | {fresh:.2f}, {last:.2f} | all {statistics.geometric_mean(ratios):.2f}, "
          f"without gains {statistics.geometric_mean(others):.2f} |", flush=True)


EXTENT = (1, 1, 1)


def load(name):
    import dapple
    scene = dapple.load(SCENES[name])
    list(scene.lights.values())[0]["string group"] = "key"
    return scene


def bench_gains(live, count, rounds):
    """Seconds to settled frames, and to frames while it renders."""
    settled, meanwhile = [], []
    for k in range(rounds):
        begin = time.monotonic()
        live.gains["key"] = 1 + 0.2 * k
        count += 1
        frame = live.wait()
        settled.append(time.monotonic() - begin)
        assert frame.statistics["rays"] == 0
    for k in range(rounds):
        live.edit(lambda s: s.camera.edit()).result()  # the same view, rendered again
        count += 1
        while live.frame().edits < count or live.frame().reduction > 1:
            time.sleep(0.001)
        begin = time.monotonic()
        live.gains["key"] = 2 + 0.2 * k
        count += 1
        first_picture(live, count)
        meanwhile.append(time.monotonic() - begin)
        live.wait()
    return count, settled, meanwhile


def bench_frames(live, count):
    """Seconds of frame() during a rendering."""
    live.edit(lambda s: s.camera.edit()).result()  # the same view, rendered again
    waits, end = [], time.monotonic() + 600
    while time.monotonic() < end:
        begin = time.perf_counter()
        frame = live.frame()
        waits.append(time.perf_counter() - begin)
        if frame.edits > count and frame.settled:
            return count + 1, waits
        time.sleep(0.0005)
    raise RuntimeError("no frame has settled within 600 s")


def percentile(values, part):
    """The smallest value that so large a part of all does not exceed."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, math.ceil(part * len(ordered)) - 1)]


def both(values):
    """Median and 99th percentile."""
    return f"{statistics.median(values):.3f} ({percentile(values, 0.99):.3f})"


def fills(frame):
    return sum(c["fills"] for name, c in frame.statistics["caches"].items() if name in
               ("radiosity.coarse", "radiosity.medium", "radiosity.fine"))


def first_picture(live, edits_so_far):
    while True:
        frame = live.frame()
        if frame is not None and frame.edits >= edits_so_far:
            return frame
        time.sleep(0.001)


def bench(context):
    """In a process of its own: the package is the build's."""
    package = Path(context.program("dapple")).parent / "python"
    text = subprocess.run([sys.executable, __file__, "--rounds", str(context.repeats), "--threads", str(context.threads)], env=os.environ | {"PYTHONPATH": str(package)},
                          stdout=subprocess.PIPE, check=True, text=True).stdout
    return {"table": text}, text


def main():
    import dapple
    global EXTENT
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--resolution", default="320x180")
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--preset", default="preview")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--clock", choices=("wall", "cpu"), default="wall")
    o = parser.parse_args()
    dapple.set_threads(o.threads)
    options = dict(preset=o.preset, integrator="distribution", pixel_samples=o.samples, denoise=False,
                   resolution=tuple(int(n) for n in o.resolution.split("x")))
    print(f"{o.resolution}, {o.samples} samples a pixel, preset {o.preset}, {o.threads} threads; seconds")
    if o.list:
        print("| scene | edit | first picture | its processor time | settled | of a fresh session |")
        print("|---|---|---|---|---|---|")
        for name in o.scenes.split(","):
            if os.path.exists(SCENES[name]):
                EXTENT = (100, 100, 100) if name == "cornell" else (1, 1, 1)
                bench_list(name, options, time.process_time if o.clock == "cpu" else time.monotonic)
        return
    print("| scene | edit | first picture | its processor time | settled | fresh: first | fresh: settled | fills, of the fresh session's | cancel |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in o.scenes.split(","):
        if not os.path.exists(SCENES[name]):
            continue
        EXTENT = (100, 100, 100) if name == "cornell" else (1, 1, 1)
        begin = time.monotonic()
        live = dapple.LiveSession(load(name), **options)
        first_picture(live, 0)
        fresh_first = time.monotonic() - begin
        frame = live.wait()
        fresh_settled, fresh_fills = time.monotonic() - begin, fills(frame)
        m = statistics.median
        count, settled, meanwhile = bench_gains(live, 0, o.rounds)
        print(f"| {name} | gain | {both(settled)} | - | {m(settled):.2f} | {fresh_first:.2f} | {fresh_settled:.2f} | 0 % | - |")
        print(f"| {name} | gain, while it renders | {both(meanwhile)} | - | - | {fresh_first:.2f} | {fresh_settled:.2f} | - | - |", flush=True)
        for kind, change in edits(dapple.load(SCENES[name])).items():
            firsts, processor, settled, parts, cancels = [], [], [], [], []
            for k in range(o.rounds):
                begin, cpu = time.monotonic(), time.process_time()
                live.edit(lambda s: change(s, k)).result()
                count += 1
                first_picture(live, count)
                firsts.append(time.monotonic() - begin)
                processor.append(time.process_time() - cpu)
                frame = live.wait()
                settled.append(time.monotonic() - begin)
                parts.append(fills(frame) / max(fresh_fills, 1))
                live.edit(lambda s: s.camera.edit())  # the same view, rendered again
                time.sleep(0.3 * settled[-1])
                begin = time.monotonic()
                live.edit(lambda s: s.camera.edit()).result()
                cancels.append(time.monotonic() - begin)
                count += 2
                live.wait()
            print(f"| {name} | {kind} | {both(firsts)} | {both(processor)} | {m(settled):.2f} | {fresh_first:.2f} | {fresh_settled:.2f} | "
                  f"{100 * m(parts):.0f} % | {both(cancels)} |", flush=True)
        count, waits = bench_frames(live, count)
        print(f"{name}: frame() takes {1e3 * m(waits):.2f} ms, 99 % below {1e3 * percentile(waits, .99):.2f}, the longest of {len(waits)} {1e3 * max(waits):.2f}", flush=True)


if __name__ == "__main__":
    main()
