# SPDX-License-Identifier: Apache-2.0
"""Dapple's radiosity cache with irradiance interpolation against POV-Ray's radiosity: time until a picture of the measured Cornell box is as
near as asked to the converged one. POV-Ray is held against its own finest settings, since its area lights differ a little; Dapple against
path tracing."""
import json
import math
import shutil
from typing import NamedTuple

import common
import time_to_error
from box_scene import read_scene

SCENE, SIZE, BOUNCES = time_to_error.SCENE, time_to_error.SIZE, time_to_error.BOUNCES
TARGETS = (0.05, 0.04, 0.035, 0.03, 0.025)  # relative RMSE
FADE = 0.1  # mm; POV-Ray's light falls off with 2 / (1 + (distance / FADE)^2)


class Setting(NamedTuple):
    count: int
    error_bound: float
    nearest_count: int
    pretrace_end: float
    lights: int  # in a row of the area light
    adaptive: int
    antialias: tuple

    def __str__(self):
        return (f"count {self.count} error_bound {self.error_bound} nearest_count {self.nearest_count} pretrace_end {self.pretrace_end}, "
                f"area_light {self.lights} x {self.lights} adaptive {self.adaptive}, {' '.join(self.antialias)}")


COARSE, FINE = ("+A0.1", "+R2"), ("+A0.1", "+R3")
# The best for their time of 24 that were tried. Finer ones come no nearer: their means differ from each other by 1 to 2 %.
SETTINGS = [Setting(35, 1.8, 5, 0.04, 4, 1, COARSE), Setting(50, 1, 5, 0.02, 4, 1, COARSE), Setting(50, 0.6, 5, 0.02, 6, 1, COARSE),
            Setting(100, 0.5, 5, 0.02, 8, 1, FINE), Setting(400, 0.5, 10, 0.01, 8, 1, FINE), Setting(400, 0.3, 20, 0.01, 8, 2, FINE)]
FINEST = Setting(1600, 0.3, 15, 0.01, 8, 2, ("+A0.0", "+R3"))


def vector(values):
    return "<" + ", ".join(f"{v:.9g}" for v in values) + ">"


def area_light(corners, emission, s):
    """A parallelogram that emits equally in all directions. The spotlight's tightness 1 is the cosine at the light."""
    first, second, _, last = corners
    sides = [[b - a for a, b in zip(first, end)] for end in (second, last)]
    centre = [sum(c) / 4 for c in zip(*corners)]
    area = math.hypot(*sides[0]) * math.hypot(*sides[1])
    colour = [e * area / (2 * math.pi * FADE**2) for e in emission]
    below = [centre[0], centre[1] - 1, centre[2]]
    return (f"light_source {{ {vector(centre)} rgb {vector(colour)} spotlight point_at {vector(below)} radius 90 falloff 90 tightness 1 "
            f"area_light {vector(sides[0])}, {vector(sides[1])}, {s.lights}, {s.lights} adaptive {s.adaptive} jitter area_illumination on "
            f"fade_distance {FADE} fade_power 2 }}")


def povray_scene(shapes, camera, s):
    """The box with its light under the ceiling, facing down. Rays do not gather from the emitting surface what the light source sends."""
    lines = ["#version 3.7;",
             "global_settings { assumed_gamma 1 ambient_light 0 max_trace_level 20 adc_bailout 1e-5 radiosity { "
             f"count {s.count} error_bound {s.error_bound} nearest_count {s.nearest_count} "
             f"pretrace_start .08 pretrace_end {s.pretrace_end} recursion_limit {BOUNCES} always_sample off gray_threshold 0 adc_bailout 1e-5 }} }}",
             f"camera {{ location {vector(camera['eye'])} right -x up y angle {camera['fov']} look_at {vector(camera['look'])} }}"]
    for corners, indices, reflectance, emission in shapes:
        faces = [[vector(corners[i]) for i in indices[k : k + 3]] for k in range(0, len(indices), 3)]
        triangles = " ".join("triangle { " + ", ".join(face) + " }" for face in faces)
        if emission:
            lines += [f"mesh {{ {triangles} pigment {{ rgb {vector(emission)} }} finish {{ ambient 0 diffuse 0 emission 1 }} "
                      "no_shadow no_radiosity }", area_light(corners, emission, s)]
        else:
            lines.append(f"mesh {{ {triangles} pigment {{ rgb {vector(reflectance)} }} finish {{ ambient 0 diffuse 1 }} }}")
    return "\n".join(lines) + "\n"


def povray(context, setting, image):
    """Wall and processor seconds."""
    scene = image.with_suffix(".pov")
    scene.write_text(povray_scene(*read_scene(SCENE), setting))
    arguments = ["povray", f"+I{scene}", f"+O{image}", "+FE", f"+W{SIZE}", f"+H{SIZE}", "-D", f"+WT{context.threads}", *setting.antialias]
    _, *seconds = common.timed(lambda: common.run(arguments))
    return seconds


def finest(context):
    """POV-Ray's picture at its finest setting, kept for the next time, and what it took."""
    image, record = context.out / "povray_finest.exr", context.out / "povray_finest.json"
    if image.exists() and record.exists():
        took = json.loads(record.read_text())
        if took["setting"] == str(FINEST):
            return image, took
    wall, cpu = povray(context, FINEST, image)
    took = {"setting": str(FINEST), "wall_seconds": wall, "cpu_seconds": cpu}
    record.write_text(json.dumps(took) + "\n")
    return image, took


def at_equal_error(ours, theirs):
    """Rows of target, times and ratio of processor times; '-' where a renderer's settings do not reach so far, or are all better."""
    rows, found = [], []
    for target in TARGETS:
        cpu, wall = ([common.seconds_to(target, [(f["rmse"], f[clock]) for f in frames]) for frames in (ours, theirs)]
                     for clock in ("cpu_seconds", "wall_seconds"))
        ratios = [t[1] / t[0] if None not in t else None for t in (cpu, wall)]
        found.append({"rmse": target, "cpu_seconds": cpu, "wall_seconds": wall, "cpu_ratio": ratios[0], "wall_ratio": ratios[1]})
        show = lambda value, unit="": "-" if value is None else f"{value:.2f}{unit}"
        rows.append([f"{100 * target:g} %"])
        for clock, ratio in zip((cpu, wall), ratios):
            rows[-1] += [*(show(t, " s") for t in clock), show(ratio)]
    return rows, found


def bench(context):
    if not shutil.which("povray"):
        raise common.Skip("POV-Ray is not installed (scripts/bench --peers)")
    reference, took = finest(context)
    pair = common.path_traced_pair(context, SCENE, SIZE, BOUNCES, time_to_error.REFERENCE_SAMPLES)
    apart = common.compare_without_noise(context, reference, pair)
    image = context.out / "against_povray.exr"
    frame = ["--resolution", f"{SIZE}x{SIZE}", "--bounces", BOUNCES]
    runs = {}
    for s in SETTINGS:
        runs["POV-Ray", str(s)] = lambda s=s: povray(context, s, image), lambda: common.compare(context, image, reference)
    for s in time_to_error.SETTINGS:
        runs["Dapple", time_to_error.options(*s)] = (lambda s=s: common.timed(lambda: time_to_error.cached(context, image, s, *frame))[1:],
                                                     lambda: common.compare_without_noise(context, image, pair))
    repeats, seconds, errors = min(3, context.repeats), {name: [] for name in runs}, {}
    for _ in range(repeats):
        for name, (run, error) in runs.items():
            seconds[name].append(run())
            errors[name] = error()
    frames = [dict(zip(("renderer", "setting", "wall_seconds", "cpu_seconds", "rmse", "block_rmse", "mean_error"),
                       (*name, *(common.median(t) for t in zip(*seconds[name])), *errors[name]))) for name in runs]
    ours, theirs = ([f for f in frames if f["renderer"] == name] for name in ("Dapple", "POV-Ray"))

    rows = [[f["renderer"], f["setting"], f"{f['cpu_seconds']:.2f} s", f"{f['wall_seconds']:.2f} s",
             *(f"{100 * f[e]:.2f} %" for e in ("rmse", "block_rmse", "mean_error"))] for f in frames]
    ratios, found = at_equal_error(ours, theirs)
    text = (f"Measured Cornell box, {SIZE}x{SIZE}, {BOUNCES} bounces, {context.threads} threads, medians of {repeats} runs of the whole programs, "
            f"in turn; the light is left out. POV-Ray against its own finest setting ({FINEST}; {took['cpu_seconds']:.0f} s of processor time, "
            f"{took['wall_seconds']:.0f} s, and {100 * apart[0]:.1f} % from path tracing, means {100 * apart[2]:.1f} %); Dapple "
            f"against twice {time_to_error.REFERENCE_SAMPLES} samples of the path integrator, whose own noise is taken off.\n\n"
            + common.table(["renderer", "setting", "processor time", "wall", "RMSE of pixels", "of 8x8 blocks", "of means"], rows)
            + "\n\nTime to equal RMSE, between the best settings on straight lines in log-log ('-' where they do not reach so far); above 1 "
            "Dapple is sooner:\n\n"
            + common.table(["RMSE", "Dapple, processor", "POV-Ray, processor", "ratio", "Dapple, wall", "POV-Ray, wall", "ratio"], ratios))
    return {"frames": frames, "finest": {**took, "from_path_tracing": apart[0]}, "equal_error": found}, text
