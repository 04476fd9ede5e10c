# SPDX-License-Identifier: Apache-2.0
"""What caching the light that enters a subsurface body gains: scenes/bust with and without, in preview and in final quality."""
import common

SCENE = common.ROOT / "scenes/bust/bust.pbrt"
PREVIEW = ["--preset", "preview", "--diffuse-rays", 4, "--irradiance-interpolation", "off"]
FINAL = ["--preset", "final"]
# Name, options, size, crop; final quality without the cache is bearable in a crop alone, which does the cache no favour.
CASES = [
    ("preview, direct light", PREVIEW + ["--bounces", 0], "480x600", None),
    ("preview, 1 bounce", PREVIEW + ["--bounces", 1], "480x600", None),
    ("final, direct light", FINAL + ["--bounces", 0], "480x600", "190,180,254,244"),
]


def render(context, options, size, crop, cache):
    crop = ["--crop", crop] if crop else []
    s = common.render(context, SCENE, context.out / f"subsurface_{cache}.exr", "--integrator", "distribution", "--resolution", size, *options, *crop,
                      "--subsurface-cache", cache, "--threads", context.threads, "--float", "--quiet")
    return s


def bench(context):
    result, rows = [], []
    for name, options, size, crop in CASES:
        runs = {"off": [], "on": []}
        for _ in range(max(1, context.repeats // 2) if "preview" in name else 1):
            for cache in runs:
                runs[cache].append(render(context, options, size, crop, cache))
        # Processor time: other work on the machine counts less.
        seconds = {cache: common.median([r["cpu_seconds"] for r in of]) for cache, of in runs.items()}
        off, on = runs["off"][0], runs["on"][0]
        rays = {cache: sum(r["rays"].values()) for cache, r in (("off", off), ("on", on))}
        points = {cache: r["shading_points"]["diffuselighting"] for cache, r in (("off", off), ("on", on))}
        rows.append([name, f"{seconds['off']:.1f} s", f"{seconds['on']:.1f} s", f"{seconds['off'] / seconds['on']:.2f}", f"{rays['off'] / rays['on']:.2f}",
                     f"{points['off'] / points['on']:.2f}"])
        result.append({"name": name, "options": [str(o) for o in options], "crop": crop, "off": off, "on": on, "seconds": seconds})
    text = ("scenes/bust, 480 x 600 pixels; final in a crop on the face. Processor time of all threads, loading included.\n\n"
            + common.table(["", "without", "with the irradiance cache", "speed-up", "rays, ratio", "shading points, ratio"], rows))
    return {"cases": result}, text
