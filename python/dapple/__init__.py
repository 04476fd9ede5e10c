# SPDX-License-Identifier: Apache-2.0
"""Dapple: scenes that are read or made, edited and rendered to NumPy arrays.

    scene = dapple.load("room.pbrt")
    scene.lights["key"].intensity *= 2
    image = dapple.Session(scene, preset="preview").render()    # H x W x 3, float32, linear
    dapple.write("room.png", image)

`dapple.canopy` is light in layers of leaves, `dapple.plot` makes line plots as SVG.
"""
from . import _core
from ._core import SceneError, set_threads
from ._live import LiveFrame, LiveSession
from ._matrices import look_at, rotate, scale, translate
from ._scene import Gains, Item, Items, Scene, Session, denoise, load, parse, read, read_layers, write

__version__ = _core.version()
__all__ = ["Gains", "Item", "Items", "LiveFrame", "LiveSession", "Scene", "SceneError", "Session", "denoise", "load", "look_at", "parse", "read", "read_layers",
           "rotate", "scale", "set_threads", "translate", "write"]
