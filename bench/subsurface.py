# SPDX-License-Identifier: Apache-2.0
"""What caching the light that enters a subsurface body gains: scenes/bust with and without, in preview and in final quality. And what a small
body costs the room that it stands in, which is traced as paths beside it: a ball in the Cornell box, of wax and diffuse."""
import common

SCENE = common.ROOT / "scenes/bust/bust.pbrt"
WIDTH, HEIGHT = 480, 600
PREVIEW = ["--preset", "preview", "--diffuse-rays", 4, "--irradiance-interpolation", "off"]
FINAL = ["--preset", "final"]
CROP, COLUMNS, ROWS = 16, 5, 6  # final quality without the cache is bearable in crops alone
# Name, options, whether all of it is rendered without the cache too.
CASES = [
    ("preview, direct light", PREVIEW + ["--bounces", 0], True),
    ("preview, 1 bounce", PREVIEW + ["--bounces", 1], True),
    ("final, direct light", FINAL + ["--bounces", 0], False),
    ("final, direct light, 64 shadow rays at all depths", FINAL + ["--bounces", 0, "--shadow-rays", 64], False),
]
BOX = common.ROOT / "scenes/cornell-box/cornell.pbrt"
BALLS = {"diffuse": '"diffuse" "rgb reflectance" [ .8 .6 .5 ]', "wax": '"subsurface" "rgb reflectance" [ .8 .6 .5 ] "rgb mfp" [ 10 6 3 ]'}


def render(context, options, cache, crop=None):
    crop = ["--crop", ",".join(map(str, crop))] if crop else []
    s = common.render(context, SCENE, context.out / f"subsurface_{cache}.exr", "--integrator", "distribution", "--resolution", f"{WIDTH}x{HEIGHT}", *options, *crop,
                      "--subsurface-cache", cache, "--threads", context.threads, "--float", "--quiet")
    # Processor time: other work on the machine counts less.
    return {"seconds": s["render_cpu_seconds"], "rays": sum(s["rays"].values()), "probes": s["rays"]["subsurface"],
            "points": s["shading_points"]["diffuselighting"]}


def from_crops(context, options, whole):
    """Without the cache, in proportion to probes, of which there are as many with and without: what sees no body is left out."""
    sums = dict.fromkeys(whole, 0)
    for i in range(COLUMNS * ROWS):
        x, y = WIDTH * (2 * (i % COLUMNS) + 1) // (2 * COLUMNS), HEIGHT * (2 * (i // COLUMNS) + 1) // (2 * ROWS)
        s = render(context, options, "off", (x, y, x + CROP, y + CROP))
        if s["probes"]:
            sums = {key: sums[key] + s[key] for key in sums}
    return {key: value * whole["probes"] / sums["probes"] for key, value in sums.items()}


def render_ball(context, kind):
    scene = context.out / f"ball-{kind}.pbrt"
    scene.write_text(f'Include "{BOX}"\nAttributeBegin\nMaterial {BALLS[kind]}\nTranslate 186 205 170\n'
                     'Shape "sphere" "float radius" 40\nAttributeEnd\n')
    s = common.render(context, scene, context.out / f"ball-{kind}.exr", "--integrator", "distribution", "--preset", "preview", "--pixel-samples", 16,
                      "--bounces", 4, "--denoise", "off", "--threads", context.threads, "--quiet")
    return {"seconds": s["render_cpu_seconds"], "rays": sum(s["rays"].values())}


def balls(context):
    runs = {kind: [] for kind in BALLS}
    for _ in range(context.repeats):
        for kind in BALLS:
            runs[kind].append(render_ball(context, kind))
    found = {kind: {**of[0], "seconds": common.median([r["seconds"] for r in of])} for kind, of in runs.items()}
    rows = [[kind, f"{of['seconds']:.2f} s", f"{of['seconds'] / found['diffuse']['seconds']:.2f}", f"{of['rays'] / found['diffuse']['rays']:.2f}"]
            for kind, of in found.items()]
    return found, ("A ball in the Cornell box, 256 x 256 pixels, preview, 16 samples, four bounces, processor time without loading.\n\n"
                   + common.table(["ball", "", "time, of diffuse", "rays, of diffuse"], rows))


def bench(context):
    result, rows = [], []
    for name, options, whole in CASES:
        repeats = max(1, context.repeats // 2) if whole else 1
        runs = {"off": [], "on": []}
        for _ in range(repeats):
            runs["on"].append(render(context, options, "on"))
            runs["off"].append(render(context, options, "off") if whole else from_crops(context, options, runs["on"][0]))
        off, on = ({**of[0], "seconds": common.median([r["seconds"] for r in of])} for of in (runs["off"], runs["on"]))
        rows.append([name, f"{off['seconds']:.0f} s" + ("" if whole else " *"), f"{on['seconds']:.0f} s"]
                    + [f"{off[key] / on[key]:.3g}" for key in ("seconds", "rays", "points")])
        result.append({"name": name, "options": [str(o) for o in options], "off": off, "on": on})
    text = (f"scenes/bust, {WIDTH} x {HEIGHT} pixels, processor time of all threads without loading.\n\n"
            + common.table(["", "without", "with the irradiance cache", "speed-up", "rays, ratio", "shading points, ratio"], rows)
            + f"\n\n\\* From {COLUMNS * ROWS} crops of {CROP} x {CROP} pixels, in proportion to probes.")
    found, of_balls = balls(context)
    return {"cases": result, "balls": found}, f"{text}\n\n{of_balls}"
