# SPDX-License-Identifier: Apache-2.0
"""What the scripts that make pictures of docs/gallery share."""
import pathlib
import struct
import subprocess

root = pathlib.Path(__file__).resolve().parent.parent
gallery = root / "docs/gallery"


def strip(path):
    """Leaves of a PNG what is needed to see it: no texts, no times."""
    data = path.read_bytes()
    kept, at = [data[:8]], 8
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        if kind in (b"IHDR", b"PLTE", b"IDAT", b"IEND", b"sRGB", b"gAMA"):
            kept.append(data[at : at + 12 + length])
        at += 12 + length
    path.write_bytes(b"".join(kept))


def render(scene, out, *options):
    denoise = [] if "--denoise" in options else ["--denoise", "off"]
    subprocess.run([root / "build/release/dapple", "render", root / scene, "-o", out, "-q", *denoise, *map(str, options)], check=True)


def tool(out, *arguments):
    """Writes a PNG by oiiotool."""
    subprocess.run(["oiiotool", *map(str, arguments), "-d", "uint8", "-o", str(out)], check=True)
    strip(out)
