# SPDX-License-Identifier: Apache-2.0
"""How much indirect light flickers under a moving camera: the measured Cornell box, a camera that moves by parts of a pixel and one that moves
along a path of 30 frames, with and without the radiosity cache. Writes pictures of how the first frames of each differ."""
import math
import re
import tempfile
from pathlib import Path
from types import SimpleNamespace

import common
from box_scene import read_scene

SCENE = common.ROOT / "scenes/cornell-box/cornell.pbrt"
SIZE, BOUNCES, BOUND = 192, 2, 1 / 5
FOUR_RAYS = ["--diffuse-rays", "4", "--irradiance-interpolation", "off"]
CASES = {  # name: (options, whether the seed goes with the frame)
    "preview": ([], False),
    "cached, 4 rays, no interpolation": (FOUR_RAYS, False),
    "uncached, 4 rays, seeds of frames": ([*FOUR_RAYS, "--radiosity-cache", "off"], True),
    "uncached, 4 rays, one seed": ([*FOUR_RAYS, "--radiosity-cache", "off"], False),
}
UNCACHED = "uncached, 4 rays, seeds of frames"  # what the bound is a part of
RANGE = 0.5  # of the mean light, at which the colours of difference pictures saturate


def moves(fov):
    """Where the camera is, in mm from the scene's own place: {name: [(right, up, forward)]}"""
    pixel = 1080 * 2 * math.tan(math.radians(fov) / 2) / SIZE  # in the middle of the box
    return {"parts of a pixel": [(0.31 * f * pixel, 0.17 * f * pixel, 0) for f in range(8)],
            "path": [(2.3 * f, 0, 5 * f) for f in range(30)]}


def write_difference(path, change):
    """A change relative to the mean light as a picture: blue darker, red brighter, white the same."""
    import numpy as np
    import OpenImageIO as oiio

    grey = np.clip(change.mean(axis=-1) / RANGE, -1, 1)
    picture = np.stack([1 - np.clip(-grey, 0, 1), 1 - abs(grey), 1 - np.clip(grey, 0, 1)], axis=-1)
    pixels = np.ascontiguousarray((255 * picture + 0.5).astype(np.uint8))
    out = oiio.ImageOutput.create(str(path))
    if not out or not out.open(str(path), oiio.ImageSpec(*pixels.shape[1::-1], 3, "uint8")) or not out.write_image(pixels):
        raise RuntimeError(f"{path} could not be written")
    out.close()


class Film:
    """Renders frames."""

    def __init__(self, context, folder):
        self.context, self.folder, self.direct = context, Path(folder), {}
        _, self.camera = read_scene(SCENE)

    def render(self, move, name, *options):
        eye = [a + b for a, b in zip(self.camera["eye"], move)]
        look = [a + b for a, b in zip(self.camera["look"], move)]
        place = "  ".join(" ".join(map(repr, v)) for v in (eye, look, self.camera["up"]))
        text, found = re.subn(r"^LookAt .*$", f"LookAt {place}", SCENE.read_text(), flags=re.M)
        assert found == 1
        scene, image = self.folder / "frame.pbrt", self.folder / f"{name}.exr"
        scene.write_text(text)
        stats = common.render(self.context, scene, image, "--integrator", "distribution", "--preset", "preview", "--visible-points", "grids", "--resolution",
                              f"{SIZE}x{SIZE}", "--float", "--threads", self.context.threads, "--quiet", *options)
        return image, (eye, look, self.camera["up"], self.camera["fov"]), stats["render_cpu_seconds"]

    def frame(self, move, seed, options):
        """A frame for temporal_variation, and the processor seconds of its picture. Direct light, the same without bounces, is taken off."""
        from reprojection import Camera, read_channels

        if (move, seed) not in self.direct:
            self.direct[move, seed] = read_channels(self.render(move, "direct", "--bounces", 0, "--seed", seed)[0], "R", "G", "B")
        image, place, seconds = self.render(move, "all", "--bounces", BOUNCES, "--seed", seed, "--aov", "position,normal,albedo", *options)
        aovs = {"position": ("P.X", "P.Y", "P.Z"), "normal": ("normal.X", "normal.Y", "normal.Z"), "albedo": ("albedo.R", "albedo.G", "albedo.B")}
        return SimpleNamespace(camera=Camera(*place, SIZE, SIZE, mirrored=True),
                               **{name: read_channels(image, *channels) for name, channels in aovs.items()},
                               light=read_channels(image, "R", "G", "B") - self.direct[move, seed]), seconds


def bench(context):
    try:
        import OpenImageIO  # noqa: F401
        from reprojection import temporal_variation
    except ImportError as error:
        raise common.Skip(f"{error} (packages python3-numpy and python3-openimageio)")
    rows, result = [], []
    with tempfile.TemporaryDirectory() as folder:
        film = Film(context, folder)
        for move, places in moves(film.camera["fov"]).items():
            found = {}
            for name, (options, seeds) in CASES.items():
                frames, seconds = zip(*(film.frame(place, f + 1 if seeds else 1, options) for f, place in enumerate(places)))
                found[name] = temporal_variation(frames), sum(seconds) / len(seconds)
                write_difference(context.out / f"flicker_{move.split()[0]}_{list(CASES).index(name)}.png", found[name][0].map)
            for name, (v, seconds) in found.items():
                ratio = v.noise / found[UNCACHED][0].noise
                rows.append([move, name, f"{100 * v.noise:.2f} %", f"{ratio:.3f} (1 / {1 / ratio:.1f})", f"{100 * max(v.pairs):.2f} %",
                             f"{seconds:.2f} s"])
                result.append({"camera": move, "name": name, "noise": v.noise, "ratio": ratio, "pairs": v.pairs, "points": v.points,
                               "cpu_seconds": seconds})
    points = min(r["points"] for r in result)
    worst = max(r["ratio"] for r in result if r["name"] == "preview")
    text = (f"Indirect light ({BOUNCES} bounces) of the measured Cornell box, {SIZE}x{SIZE}, preset preview: what changes from frame to "
            f"frame at the points seen (reprojected; at least {100 * points:.0f} % of pixels), relative to the mean; the worst two frames; "
            "processor time a frame.\n\n"
            + common.table(["camera moves by", "rendering", "change", "of uncached with seeds of frames", "worst frames", "processor time"],
                           rows)
            + f"\n\nPreset preview as it is: at most **{worst:.3f}** of the uncached preview (bound {BOUND:g}).")
    return {"cases": result}, text
