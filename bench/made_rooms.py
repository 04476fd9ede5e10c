#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Rooms and places that no constant was fitted to: scenes made by script, of any variant, rendered by default and by path tracing."""
import argparse
import sys
from pathlib import Path

import rooms_at_home
import rooms_in_public
import rooms_outside

KINDS = {**rooms_at_home.KINDS, **rooms_in_public.KINDS, **rooms_outside.KINDS}


def write(folder, kind, variant):
    """Writes a scene, unless it is there as it would be written, and returns its path."""
    path = Path(folder) / f"{kind}-{variant}.pbrt"
    text = KINDS[kind](variant).text()
    if not path.exists() or path.read_text() != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return path


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--write", required=True, metavar="FOLDER", help="only write the scenes")
    p.add_argument("--scenes", default=",".join(KINDS), help="kinds, with commas between [all]")
    p.add_argument("--variants", default="1", help="numbers, with commas between [1]")
    o = p.parse_args()
    for kind in o.scenes.split(","):
        for variant in o.variants.split(","):
            print(write(o.write, kind, int(variant)))


if __name__ == "__main__":
    sys.exit(main())
