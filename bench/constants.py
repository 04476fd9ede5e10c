# SPDX-License-Identifier: Apache-2.0
"""What the fitted numbers of each method do at half and double: errors against path tracing, rays, and processor time, on a few scenes.

The numbers are constants of structs (*Numbers, in *_numbers.h). A copy of the sources is built in OUT/constants in which those that are measured are read from the
environment instead, once for all variants; the shipped program knows nothing of that. DAPPLE_CONSTANTS, parts of names such as CacheNumbers,ray_width, chooses some.
What was measured before, by the same sources, is kept in OUT/constants/measured.json. Needs ../shared/scenes.

Two structs are not here, since nothing asks for their methods in these renders: PruningNumbers (--lod; docs/design/measurements/033-pruned-leaves.md), and
LeafNumbers, which decide which forests of a million samples and more end paths in leaves (docs/design/044), none at this size."""
import hashlib
import json
import math
import os
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor

import common
from common import ROOT

SCENES = ROOT.parent / "shared/scenes"
SIZE, BOUNCES, REFERENCE_SAMPLES, SEEDS = "96x54", 4, 768, (1, 2)
ROOMS = {name: SCENES / name / "scene-v4.pbrt" for name in ("living-room", "kitchen", "bedroom")}
FORESTS = {"forest-inside": SCENES / "forest/forest-inside.pbrt"}
CLASSROOM = {"classroom": SCENES / "classroom/scene-v4.pbrt"}
# Struct, number, lower and upper value, scenes. Cosines are halved and doubled in their distance to 1.
MEASURED = [
    ("CacheNumbers", "first_filled_rays", 0.0625, 0.25, ROOMS | CLASSROOM | FORESTS), ("CacheNumbers", "filled_rays", 0.25, 1, ROOMS), ("CacheNumbers", "open_widths", 0.25, 1, ROOMS), ("CacheNumbers", "most_growth", 1.5, 6, ROOMS), ("CacheNumbers", "least_growth", 0.5, 2, ROOMS), ("CacheNumbers", "growth_of_one_ray", 6, 24, ROOMS),
    ("CacheNumbers", "largest_cell", 16, 64, ROOMS), ("CacheNumbers", "near_lights", 0.5, 2, ROOMS), ("CacheNumbers", "most_effort", 32, 128, ROOMS),
    ("CacheNumbers", "common_cells", 512, 2048, ROOMS), ("CacheNumbers", "many_origins_effort", 2, 8, ROOMS), ("CacheNumbers", "widest_cone", 0.25, 1, ROOMS),
    ("CacheNumbers", "least_coats", 0.15, 0.6, ROOMS), ("CacheNumbers", "scattered_share", 2, 8, FORESTS), ("CacheNumbers", "group_width", 0.875, 3.5, FORESTS),
    ("CacheNumbers", "most_group_width", 0.175, 0.7, FORESTS),
    ("InterpolationNumbers", "least_cosine", 0.9, 0.6, ROOMS), ("InterpolationNumbers", "tolerance", 0.125, 0.5, ROOMS),
    ("InterpolationNumbers", "finest_reach", 2, 8, ROOMS), ("InterpolationNumbers", "two_steps_beyond", 2, 8, ROOMS),
    ("InterpolationNumbers", "ray_width", 0.125, 0.5, ROOMS), ("InterpolationNumbers", "most_glints", 0.025, 0.1, ROOMS),
    ("InterpolationNumbers", "first_wide", 2, 4, ROOMS), ("InterpolationNumbers", "most_rays", 512, 2048, ROOMS), ("InterpolationNumbers", "unserved_share", 2, 8, ROOMS),
    ("GridNumbers", "most_refined", 2, 8, ROOMS), ("GridNumbers", "finer_than", 0.6, 2.4, ROOMS), ("GridNumbers", "diced_spacing", 0.4, 1.6, ROOMS),
    ("GridNumbers", "least_rays", 2, 8, ROOMS | FORESTS), ("GridNumbers", "points_of_hemisphere", 8, 32, FORESTS), ("GridNumbers", "widest_spread", 0.125, 0.5, ROOMS),
    ("HemisphereNumbers", "rings_without_last", 3, 12, ROOMS),
    ("LinkNumbers", "margin", 0.02, 0.08, ROOMS), ("LinkNumbers", "height", 0.015, 0.06, ROOMS), ("LinkNumbers", "like_normals", 0.85, 0.4, ROOMS | FORESTS),
    ("LinkNumbers", "near_plane", 0.15, 0.6, ROOMS | FORESTS),
    ("DirectNumbers", "lights_apart", 3, 12, ROOMS),
    ("DirectNumbers", "least_alpha", 0.4, 1.6, ROOMS | CLASSROOM), ("DirectNumbers", "most_alpha", 0.8, 3.2, ROOMS | CLASSROOM), ("DirectNumbers", "glint_alpha", 1.6, 6.4, ROOMS | CLASSROOM),
    ("LearningNumbers", "least_gaining", 0.125, 0.5, ROOMS), ("LearningNumbers", "trials_around", 1, 4, ROOMS), ("LearningNumbers", "points_around", 2, 8, ROOMS),
    ("LearningNumbers", "pays_below", 0.35, 1.4, ROOMS), ("LearningNumbers", "by_luminance", 0.2, 0.8, ROOMS), ("LearningNumbers", "by_area", 0.025, 0.1, ROOMS),
    ("LearningNumbers", "least_class", 0.05, 0.2, ROOMS), ("LearningNumbers", "least_sky", 0.05, 0.2, ROOMS), ("LearningNumbers", "least_visibility", 0.05, 0.2, ROOMS),
    ("LearningNumbers", "most_odds", 16, 64, ROOMS),
    ("RegionNumbers", "most_points", 32, 128, ROOMS), ("RegionNumbers", "least_points", 6, 24, ROOMS), ("RegionNumbers", "reach", 0.125, 0.5, ROOMS),
    ("RegionNumbers", "least_share", 0.025, 0.1, ROOMS), ("RegionNumbers", "fine_above", 4, 16, ROOMS), ("RegionNumbers", "even_below", 1, 4, ROOMS),
    ("LightTreeNumbers", "least_cosine", 0.025, 0.1, ROOMS), ("LightTreeNumbers", "radius_share", 0.0625, 0.25, ROOMS), ("LightTreeNumbers", "strong_share", 0.03125, 0.125, ROOMS),
]
READER = """// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <cstring>

namespace dapple {

template <class T>
T varied(const char* name, T value) {
  const char* const text = std::getenv("DAPPLE_VARIED");
  const size_t length = std::strlen(name);
  return text && std::strncmp(text, name, length) == 0 && text[length] == '=' ? T(std::strtod(text + length + 1, nullptr)) : value;
}

}  // namespace dapple
"""
DECLARATION = re.compile(r"static constexpr (float|double|int|uint32_t) ([^;{\[]+);")


def read_from_environment(header, struct, names):
    """The header with those numbers no longer constants."""
    def declare(match):
        parts = [part.split("=", 1) for part in match[2].split(",")]
        if not any(name.strip() in names for name, _ in parts):
            return match[0]
        return " ".join(f"static inline const {match[1]} {name.strip()} = varied<{match[1]}>(\"{struct}::{name.strip()}\", {value.strip()});" if name.strip() in names
                        else f"static constexpr {match[1]} {name.strip()} = {value.strip()};" for name, value in parts)

    begin, end = re.search(rf"struct {struct} {{.*?\n}};", header, re.DOTALL).span()
    return header[:begin].replace("#pragma once\n", "#pragma once\n\n#include \"dapple/base/varied.h\"\n", 1) + DECLARATION.sub(declare, header[begin:end]) + header[end:]


def value_now(header, struct, name):
    body = re.search(rf"struct {struct} {{.*?\n}};", header, re.DOTALL)[0]
    return re.search(rf"[ ,]{name} = ([^,;]+)", body)[1]


def headers():
    return {re.search(r"struct (\w+Numbers) {", path.read_text())[1]: path for path in sorted((ROOT / "src/dapple").glob("*/*_numbers.h"))}


def build(folder):
    """The program whose numbers are read from the environment, and the name of its sources."""
    source = folder / "source"
    tracked = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "src", "apps", "cmake", "data", "CMakeLists.txt", "CMakePresets.json"], cwd=ROOT,
                             stdout=subprocess.PIPE, check=True, text=True).stdout
    names = hashlib.sha256()
    varied = {struct: {name for s, name, *_ in MEASURED if s == struct} for struct in headers()}
    texts = {"src/dapple/base/varied.h": READER.encode()}
    for name in filter(None, tracked.split("\0")):
        if (ROOT / name).is_file():
            texts[name] = (ROOT / name).read_bytes()
    for struct, path in headers().items():
        if varied[struct]:
            texts[str(path.relative_to(ROOT))] = read_from_environment(path.read_text(), struct, varied[struct]).encode()
    for name, text in sorted(texts.items()):
        names.update(name.encode() + text)
        target = source / name
        if not target.exists() or target.read_bytes() != text:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(text)
    for path in (source / "src").rglob("*"):
        if path.is_file() and str(path.relative_to(source)) not in texts:
            path.unlink()
    common.run(["cmake", "--preset", "release", "-DDAPPLE_TESTS=OFF", "-DDAPPLE_BENCH=OFF", "-DDAPPLE_PYTHON=OFF"], cwd=source)
    common.run(["cmake", "--build", "--preset", "release", "-j", os.cpu_count(), "--target", "dapple"], cwd=source)
    return source / "build/release", names.hexdigest()[:16]


def references(context, name, scene):
    return common.path_traced(context, f"constants_{name}_path", scene, "--bounces", BOUNCES, "--pixel-samples", REFERENCE_SAMPLES, "--resolution", SIZE,
                              seeds=(101, 202), threads=context.threads)


def measure(context, varied, name, scene, value=None):
    """Of a scene with STRUCT::NUMBER=VALUE: relative errors of pixels and of 8x8 blocks, rays, processor seconds, and a name of the images."""
    pair = references(context, name, scene)
    environment = {k: v for k, v in os.environ.items() if k != "DAPPLE_VARIED"} | ({"DAPPLE_VARIED": value} if value else {})

    def of_seed(seed):
        image, stats = context.out / f"constants_{seed}.exr", context.out / f"constants_{seed}.json"
        common.run([varied / "dapple", "render", scene, "-o", image, "--stats", stats, "--denoise", "off", "--integrator", "distribution", "--bounces", BOUNCES, "--preset", "preview",
                    "--resolution", SIZE, "--seed", seed, "--float", "--quiet", "--threads", 1], env=environment)
        bits = subprocess.run(["oiiotool", "--hash", image], stdout=subprocess.PIPE, check=True).stdout
        counted = json.loads(stats.read_text())
        return common.compare_without_noise(context, image, pair)[:2], sum(counted["rays"].values()), counted["render_cpu_seconds"], bits

    with ThreadPoolExecutor(context.threads) as pool:
        errors, rays, seconds, bits = zip(*pool.map(of_seed, SEEDS))
    pixels, blocks = (math.sqrt(sum(e[i] ** 2 for e in errors) / len(errors)) for i in (0, 1))
    return {"pixels": pixels, "blocks": blocks, "rays": sum(rays) / len(SEEDS), "seconds": sum(seconds) / len(SEEDS), "images": hashlib.sha256(b"".join(bits)).hexdigest()[:16]}


def change(now, then):
    """In words: of rays, of processor time, of errors of pixels and of blocks, in %."""
    if now["images"] == then["images"]:
        return "same images"
    return " ".join(f"{100 * (then[k] / now[k] - 1):+.0f}" for k in ("rays", "seconds", "pixels", "blocks"))


def bench(context):
    if not SCENES.exists():
        raise common.Skip(f"{SCENES} is absent")
    if not shutil.which("oiiotool"):
        raise common.Skip("there is no oiiotool")
    parts = os.environ.get("DAPPLE_CONSTANTS", "").split(",")
    chosen = [m for m in MEASURED if any(part in f"{m[0]}::{m[1]}" for part in parts)]
    folder = context.out / "constants"
    varied, sources = build(folder)
    kept = folder / "measured.json"
    known = json.loads(kept.read_text()) if kept.exists() else {}
    known = known if known.get("sources") == sources else {"sources": sources}

    def of(name, scene, value=None):
        key = f"{name} {value or 'as it is'}"
        if key not in known:
            known[key] = measure(context, varied, name, scene, value)
            kept.write_text(json.dumps(known, indent=1))
        return known[key]

    where, rows = headers(), []
    for struct, number, low, high, scenes in chosen:
        for name, scene in scenes.items():
            now = of(name, scene)
            rows.append([f"`{struct}::{number}`", value_now(where[struct].read_text(), struct, number), name] +
                        [f"{value:g}: {change(now, of(name, scene, f'{struct}::{number}={value}'))}" for value in (low, high)])
    now = {name: of(name, scene) for *_, scenes in chosen for name, scene in scenes.items()}
    text = (f"Preset preview without denoiser, {SIZE}, {BOUNCES} bounces, one thread, seeds {', '.join(map(str, SEEDS))}, against path tracing with {REFERENCE_SAMPLES} samples. A cell: the value; "
            "what rays, processor time, errors of pixels, and of 8 x 8 blocks change by, in %.\n\n" +
            common.table(["scene", "rays", "processor time", "pixels", "blocks"], [[n, f"{m['rays'] / 1e6:.2f} M", f"{m['seconds']:.1f} s", f"{100 * m['pixels']:.1f} %", f"{100 * m['blocks']:.2f} %"] for n, m in now.items()]) + "\n\n" +
            common.table(["number", "now", "scene", "at half", "at double"], rows))
    return known, text
