#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Live sessions: how soon pictures come after edits, beside a fresh rendering of the edited scene.

    bench/run.py live
    PYTHONPATH=build/release/python bench/live.py [--scenes cornell,staircase2,kitchen] [--resolution 320x180] [--rounds 5]

For each scene and kind of edit: seconds from the edit to the first picture (an eighth of the resolution, one sample a pixel) and to the
settled one, medians of the rounds; seconds of a fresh session from reading to its first and settled picture; how many fills of the
radiosity cache the edit took, of those of the fresh session. `cancel`: from an edit to the end of what was under way. Not denoised.
`gain`: of the first light, which is a group of its own; `gain, while it renders`: from the gain to the frame that shows it.
"""
import argparse
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
          "kitchen": os.path.join(SHARED, "kitchen/scene-v4.pbrt")}


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
    o = parser.parse_args()
    dapple.set_threads(o.threads)
    options = dict(preset=o.preset, integrator="distribution", pixel_samples=o.samples, denoise=False,
                   resolution=tuple(int(n) for n in o.resolution.split("x")))
    print(f"{o.resolution}, {o.samples} samples a pixel, preset {o.preset}, {o.threads} threads; seconds")
    print("| scene | edit | first picture | settled | fresh: first | fresh: settled | fills, of the fresh session's | cancel |")
    print("|---|---|---|---|---|---|---|---|")
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
        print(f"| {name} | gain | {m(settled):.3f} | {m(settled):.2f} | {fresh_first:.2f} | {fresh_settled:.2f} | 0 % | - |")
        print(f"| {name} | gain, while it renders | {m(meanwhile):.3f} | - | {fresh_first:.2f} | {fresh_settled:.2f} | - | - |", flush=True)
        for kind, change in edits(dapple.load(SCENES[name])).items():
            firsts, settled, parts, cancels = [], [], [], []
            for k in range(o.rounds):
                begin = time.monotonic()
                live.edit(lambda s: change(s, k)).result()
                count += 1
                first_picture(live, count)
                firsts.append(time.monotonic() - begin)
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
            print(f"| {name} | {kind} | {m(firsts):.3f} | {m(settled):.2f} | {fresh_first:.2f} | {fresh_settled:.2f} | "
                  f"{100 * m(parts):.0f} % | {m(cancels):.3f} |", flush=True)


if __name__ == "__main__":
    main()
