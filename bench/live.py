#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Live sessions: how soon pictures come after edits, beside a fresh rendering of the edited scene.

    bench/run.py live
    PYTHONPATH=build/release/python bench/live.py [--scenes cornell,staircase2,kitchen,classroom,lamps] [--resolution 1280x720] [--rounds 5]
    PYTHONPATH=build/release/python bench/live.py --list [--scenes ...]
    PYTHONPATH=build/release/python bench/live.py --shader build/release/examples/plugins/libtoon.so [--scenes ...]
    PYTHONPATH=build/release/python bench/live.py --denoised [--scenes ...]

For each scene and kind of edit: seconds from the edit to the first picture (an eighth of the resolution, one sample a pixel), median of the rounds
and the 99th percentile, which of few rounds is the last of them; processor time of it, half of which is what two idle processors would take;
`cancel`: from an edit of the camera in the middle of that rendering to the end of what was under way. Then the processor time to the settled
picture, of that of fresh sessions from reading on (the mean of one before and one after all edits), and the fills of the radiosity cache, of the first fresh session's. Not denoised.
`gain`: of the first light's group, seconds to the settled picture; `gain, while it renders`: to the frame that shows it. `lamps`: scenes/lamps with 32
groups, for gains. The part of the light that the lamp gives is said: its gain is set to 0. `frame()`: milliseconds that a call of it takes
while the picture is rendered, median, 99th percentile and longest of some thousand. The load of the machine stands at the end of each scene.

--list: twenty edits such as users make, one after the other, each settled; against a fresh session of the scene as it then is (of the first
and the last of them). In the end the geometric means of settled over fresh: with the two gains, and of the other eighteen alone. Times of settled pictures are those of
--clock: of the wall, or the process's processor time (`cpu`) on a machine that others use too.

--shader: gains where all materials that have a name are this shader, of those with a postlighting stage: seconds and processor time to the first picture,
to the first of the whole frame and to the settled one, of the first gain and of the medians of those after it; the settled ones of a fresh session's too.

--denoised: after edits of the camera and of gains, seconds and processor time from the last noisy picture of all samples to the denoised one, medians.
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
          "classroom": os.path.join(SHARED, "classroom/scene-v4.pbrt"),
          "lamps": os.path.join(HERE, "../scenes/lamps/lamps.pbrt")}
ROOMS = [name for name in SCENES if name != "lamps"]
GROUPS = 32
# Shapes of area lights that are moved; the classroom's sun is moved itself.
LIGHTS = {"cornell": "trianglemesh:19", "staircase2": "disk:1", "kitchen": "trianglemesh:1", "classroom": None}
# Walls, something small, and something like a chair, of each.
THINGS = {"cornell": ("white", "red", "trianglemesh:8"), "staircase2": ("Wall", "SpotHolder", "plymesh:12"),
          "kitchen": ("Walls", "KettleGreen", "plymesh:157"), "classroom": ("Walls", "FlagRed", "plymesh:29")}


def edits(scene, name):
    """Kinds of edits, as functions of scene and round."""
    import dapple
    lights = list(scene.lights)
    key, lamp, moved = lights[0], lights[-1], LIGHTS[name]
    wall, small, chair = THINGS[name]

    def move_light(s, k):
        thing = s.shapes[moved] if moved else s.lights[key]
        thing.move(dapple.translate((-1) ** k * 0.02 * EXTENT[0], 0, 0) if moved else dapple.rotate((-1) ** k, (0, 1, 0)))

    return {
        "camera": lambda s, k: s.camera.move(dapple.translate(*(0.002 * (-1) ** k * x for x in EXTENT))),
        "light": lambda s, k: s.lights[key].edit(scale=1 + 0.1 * (k + 1)),
        "lamp": lambda s, k: s.lights[lamp].edit(scale=1 + 0.1 * (k + 1)),
        "light moved": move_light,
        "wall colour": lambda s, k: s.materials[wall].edit(reflectance=(0.2 + 0.4 / (k + 1), 0.4, 0.5)),
        "small thing's colour": lambda s, k: s.materials[small].edit(reflectance=(0.2 + 0.4 / (k + 1), 0.4, 0.5)),
        "object moved": lambda s, k: s.shapes[chair].move(dapple.translate(0, 0.001 * EXTENT[1], 0)),
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


def watch(live, edits_so_far, begin):
    """(frame, seconds and processor time to it) of the frames that show the edits, as far as they are seen."""
    def stage(frame):
        return frame.reduction, frame.pixel_samples, frame.settled

    frames = []
    while not frames or not frames[-1][0].settled:
        frame = live.frame()
        if frame is not None and frame.edits >= edits_so_far and (not frames or stage(frame) != stage(frames[-1][0])):
            frames.append((frame, time.monotonic() - begin[0], time.process_time() - begin[1]))
        live.wait(0.001)
    return frames


def bench_shader(name, options, rounds, shader):
    """Gains where all that has a name is drawn by the shader."""
    import dapple
    begin = time.monotonic(), time.process_time()
    scene = load(name)
    for material in list(scene.materials):
        if ":" not in material:
            scene.materials[material].edit(type="plugin", filename=os.path.abspath(shader))
    live = settled_session(scene, options)
    fresh = time.monotonic() - begin[0], time.process_time() - begin[1]
    times = []
    for k in range(rounds + 1):
        begin = time.monotonic(), time.process_time()
        live.gains["key"] = 1.1 + 0.1 * k
        frames = watch(live, k + 1, begin)
        whole = next(f for f in frames if f[0].reduction == 1)
        times.append([t for f in (frames[0], whole, frames[-1]) for t in f[1:]])
    for what, t in (("first gain", times[0]), ("gain", [statistics.median(of) for of in zip(*times[1:])])):
        print(f"| {name} | {what} | {t[0]:.3f} ({t[1]:.3f}) | {t[2]:.2f} ({t[3]:.2f}) | {t[4]:.2f} ({t[5]:.2f}) | {fresh[0]:.1f} ({fresh[1]:.1f}) | {t[5] / fresh[1]:.3f} |", flush=True)


def bench_denoised(name, options, rounds):
    """Denoising after settling."""
    live = settled_session(load(name), options | {"denoise": True})
    waits, count = {"camera": [], "gain": []}, 0
    for k in range(rounds):
        for what, wait in waits.items():
            begin = time.monotonic(), time.process_time()
            if what == "camera":
                live.edit(lambda s: s.camera.edit()).result()  # the same view, rendered again
            else:
                live.gains["key"] = 1.1 + 0.1 * k
            count += 1
            frames = watch(live, count, begin)
            noisy = [f for f in frames if not f[0].settled and f[0].reduction == 1 and f[0].pixel_samples == options["pixel_samples"]]
            wait.append([frames[-1][i] - noisy[-1][i] for i in (1, 2)])
    for what, wait in waits.items():
        wall, cpu = zip(*wait)
        print(f"| {name} | {what} | {both(wall)} | {both(cpu)} |", flush=True)


EXTENT = (1, 1, 1)


def load(name):
    import dapple
    scene = dapple.load(SCENES[name])
    lights = list(scene.lights.values())
    if name == "lamps":
        for k, light in enumerate(lights[1:]):
            light["string group"] = f"lamp-{k % (GROUPS - 2)}"  # beside "default" and the key
    elif len(lights) > 1:
        lights[-1]["string group"] = "lamp"
    lights[0]["string group"] = "key"
    return scene


def part_of_lamp(live, count):
    """Of the light of the settled picture."""
    if "lamp" not in live.gains:
        return count, 1
    before = live.wait().image.mean()
    live.gains["lamp"] = 0
    without = live.wait().image.mean()
    live.gains["lamp"] = 1
    live.wait()
    return count + 2, 1 - without / before


def bench_gains(live, count, rounds):
    """Seconds and processor time to settled frames, and seconds to frames while it renders."""
    settled, processor, meanwhile = [], [], []
    for k in range(rounds):
        begin, cpu = time.monotonic(), time.process_time()
        live.gains["key"] = 1 + 0.2 * k
        count += 1
        frame = live.wait()
        settled.append(time.monotonic() - begin)
        processor.append(time.process_time() - cpu)
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
    return count, settled, processor, meanwhile


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
        live.wait(0.001)  # which raises what is wrong with the scene


def bench(context):
    """In a process of its own: the package is the build's."""
    package = Path(context.program("dapple")).parent / "python"
    text = subprocess.run([sys.executable, __file__, "--rounds", str(context.repeats), "--threads", str(context.threads)], env=os.environ | {"PYTHONPATH": str(package)},
                          stdout=subprocess.PIPE, check=True, text=True).stdout
    return {"table": text}, text


def bench_first_pictures(live, change, count, rounds):
    """Seconds and processor time to first pictures, and seconds that cancelling takes."""
    firsts, processor, cancels = [], [], []
    for k in range(rounds):
        begin, cpu = time.monotonic(), time.process_time()
        live.edit(lambda s: change(s, k)).result()
        count += 1
        first_picture(live, count)
        firsts.append(time.monotonic() - begin)
        processor.append(time.process_time() - cpu)
        time.sleep(0.1 + 0.4 * k / rounds)
        begin = time.monotonic()
        live.edit(lambda s: s.camera.edit()).result()  # the same view, rendered again
        cancels.append(time.monotonic() - begin)
        count += 1
    return count, firsts, processor, cancels


def bench_scene(name, options, rounds):
    """The lines of a scene."""
    import dapple
    m, cpu = statistics.median, time.process_time
    begin, wall = cpu(), time.monotonic()
    live = dapple.LiveSession(load(name), **options)
    first_picture(live, 0)
    fresh_first = time.monotonic() - wall
    fresh_fills, fresh = fills(live.wait()), cpu() - begin
    count, settled, processor, meanwhile = bench_gains(live, 0, rounds)
    print(f"| {name} | gain, {len(list(live.gains))} groups | {both(settled)} | {both(processor)} | 0 | 0 % | - |")
    print(f"| {name} | gain, while it renders | {both(meanwhile)} | - | - | - | - |", flush=True)
    if name == "lamps":
        return
    count, part = part_of_lamp(live, count)
    lines = []
    for kind, change in edits(dapple.load(SCENES[name]), name).items():
        count, firsts, processor, cancels = bench_first_pictures(live, change, count, rounds)
        if kind == "camera":  # what it keeps is there
            live.wait()
        begin = cpu()
        live.edit(lambda s: change(s, rounds)).result()
        count += 1
        frame = live.wait()
        lines.append((kind, firsts, processor, cpu() - begin, fills(frame), cancels))
    count, waits = bench_frames(live, count)
    begin = cpu()
    settled_session(load(name), options)
    again = cpu() - begin
    for kind, firsts, processor, settled, filled, cancels in lines:
        print(f"| {name} | {kind} | {both(firsts)} | {both(processor)} | {2 * settled / (fresh + again):.2f} | {100 * filled / max(fresh_fills, 1):.0f} % | {both(cancels)} |")
    print(f"{name}: fresh: first picture {fresh_first:.2f} s, settled {fresh:.1f} and {again:.1f} s of processor time; the lamp has {100 * part:.1f} % of the light; "
          f"frame() takes {1e3 * m(waits):.2f} ms, 99 % below {1e3 * percentile(waits, .99):.2f}, the longest of {len(waits)} {1e3 * max(waits):.2f}; load {os.getloadavg()[0]:.1f}",
          flush=True)


def main():
    import dapple
    global EXTENT
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default="")
    parser.add_argument("--resolution", default="1280x720")
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--preset", default="preview")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--shader", default="")
    parser.add_argument("--denoised", action="store_true")
    parser.add_argument("--clock", choices=("wall", "cpu"), default="wall")
    o = parser.parse_args()
    dapple.set_threads(o.threads)
    options = dict(preset=o.preset, integrator="distribution", pixel_samples=o.samples, denoise=False,
                   resolution=tuple(int(n) for n in o.resolution.split("x")))
    print(f"{o.resolution}, {o.samples} samples a pixel, preset {o.preset}, {o.threads} threads; seconds")
    columns = "edit | first picture | its processor time | settled, of a fresh session | fills | cancel"
    if o.list:
        columns = "edit | first picture | its processor time | settled | of a fresh session"
    elif o.shader:
        columns = "edit | first picture | whole frame | settled | fresh | settled, of a fresh session"
    elif o.denoised:
        columns = "edit | denoised after settling | its processor time"
    print(f"| scene | {columns} |\n|{'---|' * (columns.count('|') + 2)}")
    for name in o.scenes.split(",") if o.scenes else ROOMS if o.list or o.shader or o.denoised else SCENES:
        if os.path.exists(SCENES[name]):
            EXTENT = (100, 100, 100) if name == "cornell" else (1, 1, 1)
            if o.list:
                bench_list(name, options, time.process_time if o.clock == "cpu" else time.monotonic)
            elif o.shader:
                bench_shader(name, options, o.rounds, o.shader)
            elif o.denoised:
                bench_denoised(name, options, o.rounds)
            else:
                bench_scene(name, options, o.rounds)


if __name__ == "__main__":
    main()
