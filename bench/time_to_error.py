# SPDX-License-Identifier: Apache-2.0
"""The radiosity cache with irradiance interpolation: time until an image of the measured Cornell box is as near as asked to its converged
path-traced picture, beside the path integrator and Blender's Cycles."""
import re
import shutil

import common

SCENE = common.ROOT / "scenes/cornell-box/cornell.pbrt"
SIZE, BOUNCES, REFERENCE_SAMPLES = 512, 8, 256
PEER_SAMPLES = 64
# Diffuse rays, shadow rays, accuracy, pixel samples, cache width.
SETTINGS = [("25,2", "4", 0.8, 4, 0.35), ("64,4", "4", 0.5, 4, 0.35), ("100,4", "4", 0.45, 8, 0.35), ("144,4", "9,4", 0.3, 16, 0.35),
            ("256,9,4", "16,9,4", 0.2, 16, 0.25), ("324,9,4", "16,9,4", 0.2, 16, 0.35)]
TARGETS = (0.05, 0.02)  # relative RMSE


def options(diffuse, shadow, accuracy, samples, width):
    return f"--diffuse-rays {diffuse} --shadow-rays {shadow} --irradiance-accuracy {accuracy} --pixel-samples {samples} --cache-width {width}"


def cached(context, image, setting, *frame):
    return common.render(context, SCENE, image, "--integrator", "distribution", "--irradiance-interpolation", "on", *options(*setting).split(),
                         "--threads", context.threads, "--float", *frame)


def times(context):
    pair, rows, result = common.path_traced_pair(context, SCENE, SIZE, BOUNCES, REFERENCE_SAMPLES), [], []
    frame = ["--resolution", f"{SIZE}x{SIZE}", "--bounces", BOUNCES]

    def add(name, seconds, image):
        rmse, block, mean = common.compare_without_noise(context, image, pair)
        rows.append([name, f"{seconds:.2f} s", f"{100 * rmse:.2f} %", f"{100 * block:.2f} %", f"{100 * mean:.2f} %"])
        result.append({"name": name, "seconds": seconds, "rmse": rmse, "block_rmse": block, "mean_error": mean})

    for setting in SETTINGS:
        image = context.out / "time_to_error_cached.exr"
        seconds = common.median([cached(context, image, setting, *frame)["render_seconds"] for _ in range(min(3, context.repeats))])
        add("cached, " + options(*setting), seconds, image)
    image = context.out / "time_to_error_path.exr"
    add(f"path, {PEER_SAMPLES} samples", common.render(context, SCENE, image, "--integrator", "path", "--pixel-samples", PEER_SAMPLES, "--threads",
                                                        context.threads, "--float", *frame)["render_seconds"], image)
    if shutil.which("blender"):
        image = context.out / "time_to_error_cycles.exr"
        common.run(["blender", "-b", "--factory-startup", "-P", common.ROOT / "bench/cycles.py", "--", SCENE, image, "--threads", context.threads,
                    "--resolution", SIZE, "--samples", PEER_SAMPLES, "--bounces", BOUNCES])
        header = common.run(["oiiotool", "--info", "-v", image])
        minutes, seconds = re.search(r'cycles\.ViewLayer\.render_time: "(\d+):([\d.]+)"', header).groups()
        add(f"Cycles, {PEER_SAMPLES} samples", 60 * int(minutes) + float(seconds), image)
    return rows, result


def ratios(frames):
    """Sentences: how many times sooner the cache reaches each target than the others would, whose errors fall with the square root of time."""
    text = []
    for target in TARGETS:
        enough = [f for f in frames if f["name"].startswith("cached") and f["rmse"] <= target]
        if not enough:
            text.append(f"No setting reaches {100 * target:.0f} %.")
            continue
        ours = min(f["seconds"] for f in enough)
        peers = ", ".join(f"{f['seconds'] * (f['rmse'] / target) ** 2 / ours:.0f} times as long by {f['name'].split(',')[0]}"
                          for f in frames if not f["name"].startswith("cached"))
        text.append(f"To {100 * target:.0f} %: {ours:.2f} s; {peers}.")
    return " ".join(text)


def bench(context):
    frames, errors = times(context)
    text = (f"Measured Cornell box, {SIZE}x{SIZE}, {BOUNCES} bounces, {context.threads} threads, against twice {REFERENCE_SAMPLES} samples of the "
            "path integrator, whose own noise is taken off; the light is left out. Errors of path tracers fall with the square root of their time.\n\n"
            + common.table(["rendering", "seconds", "RMSE of pixels", "of 8x8 blocks", "of means"], frames) + "\n\n" + ratios(errors))
    return {"errors": errors}, text
