# SPDX-License-Identifier: Apache-2.0
"""Scenes, their sessions, pictures of files: what `import dapple` shows of them."""
from __future__ import annotations

import atexit
import os
from collections.abc import Mapping, MutableMapping
from typing import Any, Callable, Iterable, Iterator, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import SceneError

atexit.register(_core.end_renderings)  # of daemon threads
os.register_at_fork(after_in_child=_core.forget_renderings)

Image = NDArray[np.float32]
HeaderValue = Union[str, int, float, Sequence[float]]
ProgressCallback = Callable[[float, float, int], Optional[bool]]


# Types of parameters that an item need not have given yet.
_TYPES = {"scale": "float", "power": "float", "illuminance": "float", "fov": "float", "lensradius": "float",
          "focaldistance": "float", "roughness": "float", "radius": "float", "L": "rgb", "I": "rgb", "reflectance": "rgb",
          "transform": "float", "move": "float", "lookat": "float", "on": "bool", "visible": "bool", "type": "string",
          "material": "string", "filename": "string", "coneangle": "float", "conedeltaangle": "float", "from": "point3",
          "to": "point3", "iso": "float"}
_FLAGS = ("on", "visible")


def _declaration(name: str, value: Any, known: Optional[str]) -> str:
    if " " in name:
        return name
    if isinstance(value, str):
        kind = known.split()[0] if known and known.split()[0] in ("string", "texture", "spectrum") else "string"
        return f"{kind} {name}"
    if name in _TYPES and not (known and np.size(value) == 3):
        return f"{_TYPES[name]} {name}"
    if known:
        return known
    if isinstance(value, (bool, np.bool_)):
        return f"bool {name}"
    if isinstance(value, (int, np.integer)):
        return f"integer {name}"
    return f"{'rgb' if np.size(value) == 3 else 'float'} {name}"


class Item:
    """Something of a scene that can be edited: `item.scale *= 2`, `item["rgb L"] = 1, .5, .2`, `item.move(translate(1, 0, 0))`.

    Parameters are those of the scene language. Their types are those that the scene gave, else those that are usual
    for the name or follow from the value; `item["type name"]` says it."""

    def __init__(self, scene: _core.Scene, target: str, name: str) -> None:
        self.__dict__.update(_scene=scene, _target=target, _name=name)

    def __repr__(self) -> str:
        return f"<{self._target} {self._name!r}>"

    def __getitem__(self, name: str) -> Any:
        """The value that the scene gives; KeyError where it gives none."""
        found = self._scene.parameter(self._target, self._name, name.split()[-1])
        if found is None:
            raise KeyError(name)
        kind, value = found[0].split()[0], found[1]
        if isinstance(value, list) and len(value) == 1 and kind not in ("rgb", "spectrum"):
            value = value[0]
        if isinstance(value, list) and value and not isinstance(value[0], str):
            return np.array(value)
        return int(value) if kind == "integer" and isinstance(value, float) else value

    def __setitem__(self, name: str, value: Any) -> None:
        found = self._scene.parameter(self._target, self._name, name.split()[-1]) if self._target != "object" else None
        declaration = _declaration(name, value, found[0] if found else None)
        if declaration.split()[0] == "bool" and declaration.split()[-1] in _FLAGS:
            value = bool(value)
        self._scene.edit(self._target, self._name, {declaration: value})

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name == "intensity":
            name = "scale"
        try:
            return self[name]
        except KeyError:
            if name == "scale":
                return 1.0
            raise AttributeError(f"{self!r} has no parameter {name!r} in the scene") from None

    def __setattr__(self, name: str, value: Any) -> None:
        self["scale" if name == "intensity" else name] = value

    def edit(self, **params: Any) -> None:
        """Several parameters at once."""
        declared = {}
        for name, value in params.items():
            found = self._scene.parameter(self._target, self._name, name) if self._target != "object" else None
            declared[_declaration(name, value, found[0] if found else None)] = value
        self._scene.edit(self._target, self._name, declared)

    def place(self, matrix: ArrayLike) -> None:
        """Puts it where the 4 x 4 matrix takes its own space to."""
        self._scene.edit(self._target, self._name, {"float transform": np.asarray(matrix, dtype=float).T.ravel().tolist()})

    def move(self, matrix: ArrayLike) -> None:
        """Moves it from where it is by the 4 x 4 matrix, in the world."""
        self._scene.edit(self._target, self._name, {"float move": np.asarray(matrix, dtype=float).T.ravel().tolist()})

    def remove(self) -> None:
        self._scene.remove(self._target, self._name)


class Items(Mapping[str, Item]):
    """Things of a kind by their names: those that the file gives, else type:number."""

    def __init__(self, scene: _core.Scene, target: str) -> None:
        self._scene, self._target = scene, target

    def __getitem__(self, name: str) -> Item:
        try:
            self._scene.parameter(self._target, name, "")
        except SceneError as error:
            raise KeyError(str(error)) from None
        return Item(self._scene, self._target, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._scene.names(self._target))

    def __len__(self) -> int:
        return len(self._scene.names(self._target))


def _gain(value: ArrayLike) -> list[float]:
    gain = np.broadcast_to(np.asarray(value, dtype=float), 3)
    return [float(x) for x in gain]


class Gains(MutableMapping[str, NDArray[np.float64]]):
    """Factors on what each group of lights (`"string group"`) gives pictures: `gains["key"] = 2` or `= 2, 1, .5`. Read,
    they are arrays of three. None is ever taken out."""

    def __init__(self, names: Callable[[], Iterable[str]], get: Callable[[str], ArrayLike],
                 put: Callable[[str, list[float]], object]) -> None:
        self._names, self._get, self._put = names, get, put

    def __getitem__(self, group: str) -> NDArray[np.float64]:
        return np.array(_gain(self._get(group)))

    def __setitem__(self, group: str, gain: ArrayLike) -> None:
        self._put(group, _gain(gain))

    def __delitem__(self, group: str) -> None:
        raise TypeError("a gain is not taken out; set it to 1")

    def __iter__(self) -> Iterator[str]:
        return iter(self._names())

    def __len__(self) -> int:
        return len(list(self._names()))


def _gains_of(scene: _core.Scene) -> Gains:
    def get(group: str) -> ArrayLike:
        try:
            found = scene.parameter("group", group, "gain")
        except SceneError as error:
            raise KeyError(str(error)) from None
        return 1.0 if found is None else found[1]

    return Gains(lambda: scene.names("group"), get, lambda group, gain: scene.edit("group", group, {"rgb gain": gain}))


class Scene:
    """A scene that can be made, edited and rendered. `dapple.load()` reads one; `Scene()` is empty."""

    def __init__(self, core: Optional[_core.Scene] = None) -> None:
        self._core = core if core is not None else _core.Scene()
        for target, plural in (("light", "lights"), ("shape", "shapes"), ("object", "objects"), ("material", "materials"),
                               ("texture", "textures"), ("medium", "media")):
            setattr(self, plural, Items(self._core, target))
        for target in ("camera", "film", "integrator", "sampler"):
            setattr(self, target, Item(self._core, target, ""))
        self.gains = _gains_of(self._core)

    lights: Items
    shapes: Items
    objects: Items
    materials: Items
    textures: Items
    media: Items
    gains: Gains
    camera: Item
    film: Item
    integrator: Item
    sampler: Item

    def set_camera(self, type: str, placement: ArrayLike, params: Mapping[str, Any] = {}) -> None:
        """`placement`: 4 x 4 from camera to world, as of look_at(); `params`: {"float fov": 40}."""
        self._core.camera(type, dict(params), placement)

    def add_texture(self, name: str, kind: str, type: str, params: Mapping[str, Any] = {}) -> None:
        """`kind`: "spectrum" or "float"."""
        self._core.texture(name, kind, type, dict(params))

    def add_material(self, name: str, type: str, params: Mapping[str, Any] = {}) -> Item:
        self._core.material(name, type, dict(params))
        return self.materials[name]

    def add_light(self, name: str, type: str, params: Mapping[str, Any] = {}, placement: Optional[ArrayLike] = None) -> None:
        """`placement`: 4 x 4 from light to world."""
        self._core.light(name, type, dict(params), placement)

    def add_shape(self, type: str, params: Mapping[str, Any] = {}, name: str = "", material: str = "",
                  emission: Optional[Mapping[str, Any]] = None, placement: Optional[ArrayLike] = None) -> None:
        """Arrays of meshes are NumPy arrays: "point3 P" of N x 3 floats, "integer indices" of M x 3 integers.
        `emission`: parameters of an area light, {"rgb L": (5, 5, 5)}."""
        self._core.shape(type, dict(params), name, material, dict(emission) if emission is not None else None, placement)

    def add_object(self, name: str, shapes: Iterable[Mapping[str, Any]]) -> None:
        """A definition for instances; `shapes` are dictionaries of the arguments of add_shape()."""
        self._core.object(name, [(s["type"], dict(s.get("params", {})), s.get("name", ""), s.get("material", ""),
                                  s.get("emission"), s.get("placement")) for s in shapes])

    def add_instance(self, object: str, name: str = "", placement: Optional[ArrayLike] = None) -> None:
        self._core.instance(object, name, placement)

    def add(self, directives: str) -> None:
        """Directives of the scene language, as if they stood at the end of the file."""
        self._core.add(directives)

    def keep_dicing_camera(self) -> None:
        """Surfaces stay diced for the camera as it is now, so that moving it keeps what is built."""
        self._core.dicing_camera()

    def check(self) -> None:
        """Builds the scene; SceneError for what is wrong with it."""
        self._core.check()

    def write(self, path: Union[str, os.PathLike[str]]) -> None:
        """A scene file that includes the one that was loaded and repeats all changes."""
        self._core.write(os.fspath(path))

    @property
    def warnings(self) -> list[str]:
        return self._core.warnings()

    @property
    def files(self) -> list[str]:
        """Scene files, meshes and pictures read so far."""
        return self._core.files()

    def render(self, **options: Any) -> Image:
        """The picture alone, H x W x 3; options as of Session."""
        return Session(self, **options).render()


class Session:
    """How a scene is rendered. What is None or empty the scene says, then its preset."""

    def __init__(self, scene: Scene, *, preset: str = "", integrator: str = "", resolution: Optional[Sequence[int]] = None,
                 crop: Optional[Sequence[int]] = None, pixel_samples: Optional[int] = None,
                 max_pixel_samples: Optional[int] = None, seed: Optional[int] = None, denoise: Optional[bool] = None,
                 cache_mb: Optional[float] = None, time_limit: float = 0, noise_target: float = 0,
                 aovs: Sequence[str] = (), light_groups: bool = False,
                 progress: Optional[ProgressCallback] = None) -> None:
        """resolution: (width, height); crop: (x0, y0, x1, y1), pixels, the last excluded; time_limit: s of rendering;
        noise_target: relative RMSE; aovs: names as `dapple render --aov` takes them; progress(fraction, seconds,
        samples a pixel) is called some times a second, and stops the rendering by returning False."""
        self.scene = scene
        self.progress = progress
        self._options = dict(preset=preset, integrator=integrator, resolution=resolution, crop=crop,
                             pixel_samples=pixel_samples, max_pixel_samples=max_pixel_samples, seed=seed, denoise=denoise,
                             cache_mb=cache_mb, time_limit=time_limit, noise_target=noise_target, aovs=list(aovs),
                             light_groups=light_groups)
        self._layers: dict[str, Image] = {}
        self._statistics: dict[str, Any] = {}
        self._header: dict[str, HeaderValue] = {}

    def render(self) -> Image:
        """Renders the scene as it is now: H x W x 3, float32, linear. Nothing is copied. Ctrl-C interrupts it."""
        self._layers, self._statistics, self._header = self.scene._core.render(
            self._options, self.progress)
        return self._layers[""]

    @property
    def gains(self) -> Gains:
        """Those of the scene: they count from the next render()."""
        return self.scene.gains

    @property
    def aovs(self) -> dict[str, Image]:
        """All layers of the last rendering but the picture, H x W x C each, by their names ("albedo", "light.key")."""
        return {name: layer for name, layer in self._layers.items() if name}

    @property
    def statistics(self) -> dict[str, Any]:
        """Of the last rendering: pixel_samples, finished, seconds, build_seconds, rays, caches."""
        return self._statistics

    @property
    def header(self) -> dict[str, HeaderValue]:
        """What `dapple render` writes into the header of this picture, and `dapple denoise` reads there; for write().
        Matrices are 16 numbers, row by row; "dapple/window" is (x, y, width, height), the corner of a crop and the size
        of the film."""
        return self._header


def load(path: Union[str, os.PathLike[str]], strict: bool = False, keep_going: bool = False, lod: str = "") -> Scene:
    """Reads a scene file or a model. SceneError says what is wrong and where."""
    return Scene(_core.Scene.load(os.fspath(path), strict, keep_going, lod))


def parse(text: str, folder: Union[str, os.PathLike[str]] = "", strict: bool = False, keep_going: bool = False, lod: str = "") -> Scene:
    """A scene in memory; `folder` is where the files that it names lie."""
    return Scene(_core.Scene.parse(text, os.fspath(folder), strict, keep_going, lod))


def read(path: Union[str, os.PathLike[str]]) -> Image:
    """The picture of a file, H x W x C, float32, linear."""
    layers = read_layers(path)
    return layers.get("", next(iter(layers.values())))


def read_layers(path: Union[str, os.PathLike[str]]) -> dict[str, Image]:
    """All layers of a file by their names, "" the picture."""
    return _core.read(os.fspath(path))


def write(path: Union[str, os.PathLike[str]], image: ArrayLike, layers: Mapping[str, ArrayLike] = {},
          header: Mapping[str, HeaderValue] = {}) -> None:
    """Writes .exr (32-bit float, with all layers and the header, as Session.header) or .png (through sRGB); arrays are
    H x W x C."""
    _core.write(os.fspath(path), {"": image, **layers}, dict(header))


def denoise(image: ArrayLike, albedo: Optional[ArrayLike] = None, normal: Optional[ArrayLike] = None) -> Image:
    """The picture (H x W x 3, linear) without its noise; albedo and normals of the same shape keep its detail."""
    return _core.denoise(image, albedo, normal)
