#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the benchmarks named, or all, and writes OUT/NAME.md and OUT/NAME.json for each.

Each benchmark compares two things in one run, in alternation, and states the ratio of their medians: numbers of different machines, or of
the same machine at different times, say little.
"""
import argparse
import json
import sys

import against_cycles
import against_povray
import bare_rays
import canopy
import clean
import common
import constants
import equal_time
import denoise
import denoised_error
import figures
import flake_bricks
import flicker
import gltf_scene
import interpolation
import live
import made_rooms
import models
import motion
import opacity
import presets
import pruning
import radiosity
import scene_load
import sequence
import shafts
import subsurface
import sun_masks
import time_to_error

BENCHMARKS = {"against_cycles": against_cycles, "against_povray": against_povray, "bare_rays": bare_rays, "canopy": canopy, "clean": clean, "constants": constants, "denoise": denoise, "denoised_error": denoised_error, "equal_time": equal_time, "figures": figures, "flake_bricks": flake_bricks, "flicker": flicker, "gltf_scene": gltf_scene, "interpolation": interpolation, "live": live, "made_rooms": made_rooms, "models": models, "motion": motion,
              "opacity": opacity, "presets": presets, "pruning": pruning, "radiosity": radiosity, "scene_load": scene_load, "sequence": sequence, "shafts": shafts,
              "subsurface": subsurface, "sun_masks": sun_masks, "time_to_error": time_to_error}

TAKE_OPTIONS = ("flake_bricks", "made_rooms")  # their bench() has a second parameter


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(BENCHMARKS))
    parser.add_argument("--build", default=common.ROOT / "build/release", help="build folder")
    parser.add_argument("--out", default=common.ROOT / "out/bench", help="folder of the results")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    options, more = parser.parse_known_args()
    for name in options.names:
        if name not in BENCHMARKS:
            parser.error(f"no benchmark {name}; there are {', '.join(BENCHMARKS)}")
    if more and not (len(options.names) == 1 and options.names[0] in TAKE_OPTIONS):
        parser.error(f"unknown options {' '.join(more)}; options of their own have {', '.join(TAKE_OPTIONS)}, each run alone")

    context = common.Context(options.build, options.out, options.repeats, options.threads)
    for name in options.names or BENCHMARKS:
        try:
            result, text = BENCHMARKS[name].bench(context, more) if name in TAKE_OPTIONS else BENCHMARKS[name].bench(context)
        except common.Skip as reason:
            print(f"## {name}\n\nSkipped: {reason}.\n")
            continue
        result["machine"] = common.machine()
        text = f"## {name}\n\n{common.machine()}\n\n{text}\n"
        print(text, flush=True)
        (context.out / f"{name}.md").write_text(text)
        (context.out / f"{name}.json").write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    sys.exit(main())
