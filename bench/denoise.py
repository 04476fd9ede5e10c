# SPDX-License-Identifier: Apache-2.0
"""Denoising in rooms made by others: path tracing with and without, and the denoised preview. The error is that of what an eye sees: of colours
after sRGB, at an exposure that puts the 70 % quantile at a half, fireflies of the reference (8 times its median) left out. How much sooner:
processor time of path tracing without denoising at the same error, interpolated in log-log between its numbers of samples, over the time taken,
denoising in it and loading left out. DAPPLE_ROOMS, names with spaces between, chooses rooms; DAPPLE_ROOM_SIZE another size than 480x270."""
import math
import os

import common

SHARED = common.ROOT.parent / "shared/scenes"
ROOMS = ("living-room", "bedroom", "kitchen", "staircase2", "classroom")
PATH_SAMPLES, DENOISED_SAMPLES, REFERENCE_SAMPLES = (4, 16, 64, 256), 32, 2048


def srgb(x):
    import numpy as np

    x = np.clip(x, 0, 1)
    return np.where(x < 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)


def display_error(image, reference):
    """RMS of the difference as displayed, and the relative error of the mean."""
    import numpy as np

    lum = reference.mean(-1)
    seen = (lum > 0) & (lum < 8 * np.median(lum[lum > 0]))
    scale = 0.5 / max(np.quantile(lum, 0.7), 1e-9)
    error = math.sqrt(((srgb(image * scale) - srgb(reference * scale)) ** 2).mean())
    return error, image[seen].mean() / reference[seen].mean() - 1


def time_at(error, curve):
    """Where a curve of (time, error), log-log between its points and beyond its ends, has this error."""
    (t0, e0), (t1, e1) = curve[0], curve[1]
    for a, b in zip(curve, curve[1:]):
        (t0, e0), (t1, e1) = a, b
        if error >= b[1]:
            break
    if e0 == e1:
        return t0
    return t0 * (t1 / t0) ** (math.log(error / e0) / math.log(e1 / e0))


def bench(context):
    try:
        from reprojection import read_channels
    except ImportError as error:
        raise common.Skip(f"{error} (packages python3-numpy and python3-openimageio)")
    size = os.environ.get("DAPPLE_ROOM_SIZE", "480x270")
    rooms = [room for room in os.environ.get("DAPPLE_ROOMS", " ".join(ROOMS)).split() if (SHARED / room / "scene-v4.pbrt").exists()]
    if not rooms:
        raise common.Skip("no rooms in ../shared/scenes")
    rows, result, gains, against = [], {}, [], []
    for room in rooms:
        def render(name, *options):
            image = context.out / f"denoise_{room}_{name}.exr"
            stats = common.render(context, SHARED / room / "scene-v4.pbrt", image, "--resolution", size, "--threads", context.threads, "--float", *options)
            times = stats.get("denoise_seconds", {})
            # Both are parallel throughout.
            return image, stats["render_cpu_seconds"] + context.threads * (times.get("features", 0) + times.get("network", 0))

        reference = common.kept_render(context, f"denoise_{room}_reference", SHARED / room / "scene-v4.pbrt", "--resolution", size, "--float",
                                       "--integrator", "path", "--pixel-samples", REFERENCE_SAMPLES, "--seed", 77)
        wanted = read_channels(reference, "R", "G", "B")
        found = {}

        def add(name, *options):
            image, seconds = render(name.replace(" ", "_"), *options)
            found[name] = (seconds, *display_error(read_channels(image, "R", "G", "B"), wanted))

        for samples in PATH_SAMPLES:
            add(f"path {samples}", "--integrator", "path", "--pixel-samples", samples)
        denoised = f"path {DENOISED_SAMPLES} denoised"
        add(denoised, "--integrator", "path", "--pixel-samples", DENOISED_SAMPLES, "--denoise", "on")
        add("preview", "--integrator", "distribution", "--preset", "preview")
        add("preview denoised", "--integrator", "distribution", "--preset", "preview", "--denoise", "on")
        curve = [found[f"path {samples}"][:2] for samples in PATH_SAMPLES]
        for name, (seconds, error, mean) in found.items():
            gain = time_at(error, curve) / seconds
            rows.append([room, name, f"{seconds:.1f} s", f"{100 * error:.2f} %", f"{100 * mean:+.1f} %", f"{gain:.1f}"])
            result[f"{room}, {name}"] = {"cpu_seconds": seconds, "display_error": error, "mean_error": mean, "times_sooner": gain}
            if name == denoised:
                gains.append(gain)
            if name == "preview denoised":
                against.append(gain / gains[-1])
    mean = lambda values: math.exp(sum(map(math.log, values)) / len(values))
    text = (f"{size}, against path tracing with {REFERENCE_SAMPLES} samples.\n\n"
            + common.table(["room", "rendering", "processor time", "display error", "mean", "times sooner than path"], rows)
            + f"\n\nPath tracing with {DENOISED_SAMPLES} samples, denoised: **{mean(gains):.1f}** times sooner than path tracing at its error; the denoised preview "
              f"**{mean(against):.2f}** times that (geometric means).")
    return {"cases": result, "path_denoised_gain": mean(gains), "preview_over_path_denoised": mean(against)}, text
