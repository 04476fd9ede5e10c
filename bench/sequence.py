# SPDX-License-Identifier: Apache-2.0
"""Sequences: a camera that goes through a room for 30 frames, preset preview with another seed each, denoised frame by frame and with
neighbours. Temporal variation after reprojection (reprojection.py) beside that of converged frames, and display error (denoise.py). Of the
first frames there are two path-traced halves of other seeds: products of the two take their noise out of squares, for display errors as they
are rendered, for the variation of converged frames denoised. DAPPLE_SEQUENCE_SIZE another size than 240x135, DAPPLE_SEQUENCE_FRAMES fewer
frames, DAPPLE_SEQUENCE_CONVERGED of how many there are halves, DAPPLE_SEQUENCE_SAMPLES of each half."""
import math
import os
import re
from types import SimpleNamespace

import common

SHARED = common.ROOT.parent / "shared/scenes"
ROOM = "bedroom"
STEP = (-0.008, -0.002, -0.016)  # of the world in the camera's space, a frame, m
TURN = -0.15  # degrees a frame
NEIGHBOURS = (0, 1, 2)


def scene_at(frame, folder):
    """The room seen from a place of the path."""
    source = SHARED / ROOM / "scene-v4.pbrt"
    moved = f"Translate {' '.join(f'{s * frame:g}' for s in STEP)}\nRotate {TURN * frame:g} 0 1 0\nConcatTransform ["
    text, found = re.subn(r"^Transform \[", moved, source.read_text(), count=1, flags=re.M)
    assert found == 1
    text = re.sub(r'"(models|textures)/', rf'"{source.parent}/\1/', text)
    path = folder / f"{ROOM}_sequence.pbrt"
    path.write_text(text)
    return path


class HeaderCamera:
    """A frame's camera by the matrix worldToNDC in its header."""

    def __init__(self, path):
        import numpy as np
        import OpenImageIO as oiio

        image = oiio.ImageInput.open(str(path))
        spec = image.spec()
        self.matrix = np.array(spec.getattribute("worldToNDC")).reshape(4, 4)
        self.width, self.height = spec.width, spec.height
        image.close()
        # A pixel's width at depth 1: column y is a unit vector across the screen over its height.
        self.pixel = 1 / (np.linalg.norm(np.cross(self.matrix[:3, 1], self.matrix[:3, 3])) * self.height)

    def project(self, points):
        import numpy as np

        q = points @ self.matrix[:3] + self.matrix[3]
        with np.errstate(divide="ignore", invalid="ignore"):
            return q[..., 0] / q[..., 3] * self.width, q[..., 1] / q[..., 3] * self.height, q[..., 3]


def frames_of(geometry, lights):
    from reprojection import read_channels

    out = []
    for file, light in zip(geometry, lights):
        out.append(SimpleNamespace(camera=HeaderCamera(file), position=read_channels(file, "P.X", "P.Y", "P.Z"),
                                   normal=read_channels(file, "normal.X", "normal.Y", "normal.Z"),
                                   albedo=read_channels(file, "albedo.R", "albedo.G", "albedo.B"), light=light))
    return out


def shown(light, scale):
    from denoise import srgb

    return srgb(light * scale)


def variation(geometry, first, second=None):
    """RMS of second differences over time at the points seen, over sqrt(6): of the product of two sets of frames where there are two."""
    import numpy as np
    from reprojection import found_again

    total = count = 0
    maps = []
    for k in range(1, len(first) - 1):
        seen = frames_of(geometry[k - 1:k + 2], first[k - 1:k + 2])
        others = frames_of(geometry[k - 1:k + 2], second[k - 1:k + 2]) if second else seen

        def differences(f):
            before, there = found_again(f[1], f[0])
            after, also = found_again(f[1], f[2])
            return before - 2 * f[1].light + after, there & also

        a, there = differences(seen)
        b = differences(others)[0] if second else a
        total += np.sum((a * b)[there])
        count += there.sum() * 3
        maps.append(np.abs(np.where(there[..., None], a, 0)))
    return math.sqrt(max(0, total) / count / 6), count / sum(m.size for m in maps), maps


def write_strip(path, geometry, kinds):
    """Two frames of each kind, and 12 times their second differences."""
    import numpy as np
    import OpenImageIO as oiio
    from reprojection import write_pixels

    rows = []
    for lights in kinds:
        change = np.repeat(np.clip(12 * variation(geometry, lights)[2][0].mean(-1, keepdims=True), 0, 1), 3, -1)
        rows.append(np.concatenate([lights[1], lights[2], change], 1))
    pixels = np.ascontiguousarray((255 * np.clip(np.concatenate(rows), 0, 1) + 0.5).astype(np.uint8))
    write_pixels(path, oiio.ImageSpec(*pixels.shape[1::-1], 3, "uint8"), pixels)


def bench(context):
    try:
        import numpy as np
        from reprojection import read_channels
    except ImportError as error:
        raise common.Skip(f"{error} (packages python3-numpy and python3-openimageio)")
    if not (SHARED / ROOM / "scene-v4.pbrt").exists():
        raise common.Skip(f"no {ROOM} in ../shared/scenes")
    size = os.environ.get("DAPPLE_SEQUENCE_SIZE", "240x135")
    count = int(os.environ.get("DAPPLE_SEQUENCE_FRAMES", 30))
    halved = min(count, int(os.environ.get("DAPPLE_SEQUENCE_CONVERGED", 10)))
    samples = int(os.environ.get("DAPPLE_SEQUENCE_SAMPLES", 48))
    name = lambda kind, f: context.out / f"sequence_{ROOM}_{size}_{kind}.{f:04d}.exr"
    for f in range(1, count + 1):
        scene = scene_at(f - 1, context.out)
        common_options = ["--resolution", size, "--float", "--threads", context.threads, "--quiet"]
        if not name("preview", f).exists():
            common.render(context, scene, name("preview", f), "--integrator", "distribution", "--preset", "preview", "--seed", f, "--denoise",
                          "on", "--aov", "albedo,normal,depth,position", *common_options)
        for half in (1, 2) if f <= halved else ():
            if not name(f"path{half}", f).exists():
                common.render(context, scene, name(f"path{half}", f), "--integrator", "path", "--pixel-samples", samples, "--seed",
                              1000 * half + f, "--denoise", "on", *common_options)
    geometry = [name("preview", f) for f in range(1, count + 1)]
    halves, cleaned = ([[read_channels(name(f"path{half}", f), *(prefix + c for c in "RGB")) for f in range(1, halved + 1)] for half in (1, 2)]
                       for prefix in ("noisy.", ""))
    scale = 0.5 / max(np.quantile(sum(halves[0]) / halved, 0.7), 1e-9)
    halves, cleaned = ([[shown(light, scale) for light in half] for half in both] for both in (halves, cleaned))
    converged, points, _ = variation(geometry[:halved], *cleaned)
    rows, result = [["converged", f"{100 * converged:.3f} %", "", "1.00", ""]], {"converged": converged, "points": points}

    strips = {}

    def add(title, lights):
        lights = [shown(light, scale) for light in lights]
        noise = variation(geometry, lights)[0]
        error = math.sqrt(max(0, np.mean([((x - a) * (x - b)).mean() for x, a, b in zip(lights, *halves)])))
        worst = max(variation(geometry[k:k + 3], lights[k:k + 3])[0] for k in range(count - 2))
        rows.append([title, f"{100 * noise:.3f} %", f"{100 * worst:.3f} %", f"{noise / max(converged, 1e-9):.2f}", f"{100 * error:.2f} %"])
        strips[title] = lights[3:7]
        result[title] = {"variation": noise, "ratio": noise / max(converged, 1e-9), "display_error": error}

    add("as rendered", [read_channels(file, "noisy.R", "noisy.G", "noisy.B") for file in geometry])
    for n in NEIGHBOURS:
        common.run([context.program("dapple"), "denoise", "--frames", context.out / f"sequence_{ROOM}_{size}_preview.####.exr", "-o",
                    context.out / f"sequence_{ROOM}_{size}_denoised{n}.####.exr", "--range", f"1-{count}", "--neighbours", n, "--threads",
                    context.threads, "-q"])
        add(f"denoised, {n} neighbours each way" if n else "denoised one by one",
            [read_channels(name(f"denoised{n}", f), "R", "G", "B") for f in range(1, count + 1)])
    if count >= 7:
        write_strip(context.out / "sequence.png", geometry[3:7], list(strips.values())[:3])
    text = (f"{ROOM}, {size}, {count} frames, preset preview; what changes from frame to frame at the points seen ({100 * points:.0f} % of pixels), "
            f"in displayed values; converged: {halved} frames of {2 * samples} samples, denoised, their noise taken out; display error of {halved} frames.\n\n"
            + common.table(["frames", "temporal variation", "worst three frames", "of converged", "display error"], rows))
    return {"cases": result}, text
