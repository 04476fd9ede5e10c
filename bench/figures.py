# SPDX-License-Identifier: Apache-2.0
"""The figures that no change may make worse: errors of each method on a small case, and instructions of five renders of other people's scenes.

No clock is read: errors are exact, and instructions, counted by valgrind's callgrind while samples are rendered, are the same within .1 % from
run to run. The values beside them are those of commit 5ae0395 (figures_baseline.json). DAPPLE_FIGURES, a part of a name, chooses some. Needs ../shared/scenes for the renders; figures without their scene are left out and named."""
import ctypes.util
import json
import math
import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import common
import flicker
import interpolation
import opacity

BASELINE = Path(__file__).with_name("figures_baseline.json")
WORSE = 0.03  # relative, from which on a figure is worse
SHARED = common.ROOT.parent / "shared"
CORNELL = common.ROOT / "scenes/cornell-box/cornell.pbrt"
BUST = common.ROOT / "scenes/bust/bust.pbrt"
FOREST = SHARED / "scenes/forest/forest-inside.pbrt"
SEEDS = (1, 2, 3)
# Name, scene, size for path and for distribution, whose instructions are many a pixel in small images; bounces. Four camera samples, and one.
RENDERS = [("cornell-measured", SHARED / "scenes/cornell-measured/cornell.pbrt", "64x64", "48x48", 3),
           ("staircase2", SHARED / "scenes/staircase2/scene-v4.pbrt", "64x48", "16x12", 2),
           ("classroom", SHARED / "scenes/classroom/scene-v4.pbrt", "64x36", "16x9", 1),
           ("veach-mis", SHARED / "scenes/veach-mis/scene-v4.pbrt", "64x36", "32x18", 2),
           ("forest-inside", FOREST, "64x36", "16x9", 1)]


def root_mean_square(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def needs(path):
    if not path.exists():
        raise common.Skip(f"{path} is absent")


def block_error(context, scene, size, reference_options, options, samples, compare=None):
    """Root mean square over SEEDS of the error of 8x8 blocks against two independent renderings, whose noise is taken off."""
    key = re.sub(r"[^a-z0-9]+", "_", f"{scene.stem} {size} {' '.join(map(str, reference_options))} {samples}".lower())
    pair = [context.out / f"figures_{key}_{seed}.exr" for seed in (101, 102)]
    frame = ["--resolution", size, "--float", "--quiet", "--threads", context.threads]
    for seed, image in zip((101, 102), pair):
        if not image.exists():
            common.render(context, scene, image, *reference_options, "--pixel-samples", samples, "--seed", seed, *frame)
    image, found = context.out / "figures.exr", []
    for seed in SEEDS:
        common.render(context, scene, image, *options, "--seed", seed, *frame)
        found.append(common.compare_without_noise(context, image, pair)[1])
    return root_mean_square(found)


def cornell(context, preset):
    return block_error(context, CORNELL, "128x128", ["--integrator", "path", "--bounces", 2], ["--integrator", "distribution", "--preset", preset, "--visible-points", "grids", "--bounces", 2], 1024)


def penumbra(context):
    """Ground behind the straight edge of a sheet 20 m above it, sun of even brightness in the zenith: the part of the disc that is seen, a circle's segment."""
    import numpy as np
    import OpenImageIO as oiio

    n, width, height, diameter = 512, 1.0, 20.0, 0.533
    with tempfile.TemporaryDirectory() as folder:
        mask, image = Path(folder) / "mask.exr", Path(folder) / "ground.exr"
        pixels = np.ones((n, n, 1), np.float32)
        pixels[:, :n // 2] = 0
        out = oiio.ImageOutput.create(str(mask))
        out.open(str(mask), oiio.ImageSpec(n, n, 1, "float"))
        out.write_image(pixels)
        out.close()
        common.run([context.program("dapple"), "penumbra", "--mask", mask, "--mask-width", width, "--height", height, "--sun-irradiance", 1, "--flat-sun", "--sun-diameter", diameter,
                    "-o", image, "--quiet"])
        found = oiio.ImageBuf(str(image)).get_pixels(oiio.FLOAT)[n // 2, :, 0]
    radius = height * math.tan(math.radians(diameter / 2))
    x = np.clip(((np.arange(n) + 0.5) / n - 0.5) * width / radius, -1, 1)
    right = 0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / math.pi
    inside = slice(n // 4, 3 * n // 4)  # where the sheet's other edges are not seen
    return float(np.sqrt(np.mean((found - right)[inside] ** 2)))


def masks(context):
    needs(FOREST)
    direct = ["--integrator", "path", "--bounces", 0]
    return block_error(context, FOREST, "160x90", direct, [*direct, "--sun-shadows", "masks", "--pixel-samples", 64], 256)


def canopy(context):
    """Largest error of reflectance and transmittance over the cases whose leaves have no mirror reflection, against another's adding and doubling."""
    import csv

    path = SHARED / "reference/canopy/mc_cases.csv"
    needs(path)
    names = {"sph": "spherical", "pla": "planophile", "ere": "erectophile", "plg": "plagiophile", "ext": "extremophile", "uni": "uniform", "hor": "horizontal"}
    worst, count = 0.0, 0
    for row in csv.reader(path.open()):
        if row[6] not in ("R", "T") or row[9] == "" or ":" not in row[1] or "spec" in row[0]:
            continue
        lai, angles = row[1].split(":", 1)
        if angles not in names:
            continue
        light = {"sky": {"type": "uniform", "irradiance_W_m2": [1]}} if row[5] == "dif" else {"sun": {"zenith_deg": float(row[5]), "irradiance_W_m2": [1 / math.cos(math.radians(float(row[5])))]}}
        case = {"layers": [{"bottom_m": 0, "top_m": 1, "leaf_area_index": float(lai), "leaf_angle_distribution": names[angles], "reflectance": [float(row[2])], "transmittance": [float(row[3])]}],
                "ground": {"reflectance": [float(row[4])]}, **light}
        solved = json.loads(subprocess.run([context.program("dapple"), "canopy", "solve", "-"], input=json.dumps(case), capture_output=True, text=True, check=True).stdout)
        found = (solved["albedo"]["actual"] if row[6] == "R" else solved["transmittance"]["total"])[0]
        worst, count = max(worst, abs(found - float(row[9]))), count + 1
    if count == 0:
        raise RuntimeError(f"{path} has no case that is understood")
    return worst


def opacity_cache(context):
    with tempfile.TemporaryDirectory() as folder:
        scene = opacity.grove(Path(folder), "space")
        return block_error(context, scene, "160x90", ["--integrator", "path", "--bounces", 0, "--opacity-cache", "off"], ["--integrator", "distribution", "--preset", "preview", "--visible-points", "grids", "--bounces", 0, "--opacity-cache", "on"], 512)


def subsurface(context):
    return block_error(context, BUST, "96x120", ["--integrator", "path", "--bounces", 1], ["--integrator", "distribution", "--preset", "preview", "--visible-points", "grids", "--bounces", 1], 1024)


def interpolated(context):
    with tempfile.TemporaryDirectory() as folder:
        room = interpolation.bumpy_room(Path(folder))
        return block_error(context, room, "96x72", ["--integrator", "path", "--bounces", 2], ["--integrator", "distribution", "--preset", "final", "--bounces", 2], 1024)


def flickering(context):
    """Change of indirect light from frame to frame while the camera moves by parts of a pixel, preset preview."""
    from reprojection import temporal_variation

    with tempfile.TemporaryDirectory() as folder:
        film = flicker.Film(context, folder)
        frames = [film.frame(place, 1, [])[0] for place in flicker.moves(film.camera["fov"])["parts of a pixel"]]
        return temporal_variation(frames).noise


def instructions(context, scene, path_size, distribution_size, bounces, integrator):
    """Of rendering alone, in thousands of millions. libhwy, which OpenImageIO pulls in, asks a clock when it is loaded that valgrind knows on some processors only: it gets another answer."""
    needs(scene)
    size, samples = (path_size, 4) if integrator == "path" else (distribution_size, 1)
    if not shutil.which("valgrind"):
        raise common.Skip("valgrind is not installed")
    with tempfile.TemporaryDirectory() as folder:
        environment, source, shim = dict(os.environ), Path(folder) / "clock.cpp", Path(folder) / "clock.so"
        source.write_text("namespace hwy { namespace platform { unsigned long TimerResolution() { return 1; } double InvariantTicksPerSecond() { return 1e9; } } }\n")
        if ctypes.util.find_library("hwy"):
            common.run(["g++", "-shared", "-fPIC", source, "-o", shim])
            environment["LD_PRELOAD"] = str(shim)
        out = Path(folder) / "callgrind.out"
        common.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", "--toggle-collect=dapple::render::RenderSession::run*", context.program("dapple"), "render", scene, "-o",
                    Path(folder) / "image.exr", "--threads", 1, "--resolution", size, "--pixel-samples", samples, "--bounces", bounces, "--integrator", integrator, *(["--visible-points", "grids"] if integrator == "distribution" else []), "--denoise",
                    "off", "--quiet"],
                   env=environment)
        return int(re.search(r"^(?:summary|totals): (\d+)", out.read_text(), re.M)[1]) / 1e9


FIGURES = {
    "Cornell box, preview, blocks": (lambda c: 100 * cornell(c, "preview"), "%"),
    "Cornell box, final, blocks": (lambda c: 100 * cornell(c, "final"), "%"),
    "penumbra of an edge, against its closed form": (lambda c: 100 * penumbra(c), "% of the open ground"),
    "masks of the sun in a forest, blocks": (lambda c: 100 * masks(c), "%"),
    "canopies, reflectance and transmittance": (lambda c: 1e6 * canopy(c), "millionths"),
    "opacity cache, blocks": (lambda c: 100 * opacity_cache(c), "%"),
    "subsurface, bust, blocks": (lambda c: 100 * subsurface(c), "%"),
    "irradiance interpolation, bumpy room, blocks": (lambda c: 100 * interpolated(c), "%"),
    "flicker, parts of a pixel": (lambda c: 100 * flickering(c), "%"),
    **{f"instructions, {name}, {integrator}": (lambda c, r=rest, i=integrator: instructions(c, *r, i), "thousand million")
       for name, *rest in RENDERS for integrator in ("path", "distribution")},
}


def bench(context):
    baseline = json.loads(BASELINE.read_text()) if BASELINE.exists() else {}
    only = os.environ.get("DAPPLE_FIGURES", "")  # part of a name: these alone
    rows, result, skipped = [], {}, []
    for name, (measure, unit) in FIGURES.items():
        if only not in name:
            continue
        try:
            value = measure(context)
        except common.Skip as reason:
            skipped.append(f"{name}: {reason}")
            continue
        result[name] = {"value": value, "unit": unit, "baseline": baseline.get(name)}
        before = baseline.get(name)
        change = "" if not before else f"{100 * (value / before - 1):+.1f} %" + (" **worse**" if value > before * (1 + WORSE) else "")
        rows.append([name, f"{before:.4g}" if before is not None else "", f"{value:.4g} {unit}", change])
    text = (f"Errors against path tracing over seeds {', '.join(map(str, SEEDS))}, the references' own noise taken off, or against closed forms; instructions of one thread while samples are "
            "rendered.\n\n" + common.table(["figure", "at 5ae0395", "now", "change"], rows) + "".join(f"\n\nLeft out: {s}." for s in skipped))
    return {"figures": result}, text
