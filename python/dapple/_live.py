# SPDX-License-Identifier: Apache-2.0
"""Live sessions: scenes that are edited while they are rendered."""
from __future__ import annotations

import atexit
import os
import threading
import weakref
from typing import Any, Callable, Optional, Union

from numpy.typing import ArrayLike

from . import _core
from ._core import SceneError
from ._scene import Gains, HeaderValue, Image, Scene, Session


class LiveFrame:
    """A picture of a live session as far as it has come: `image` H x W x 3, float32, linear; `aovs` a dictionary of
    layers; all of them read-only, since they are the session's own; `reduction`: its pixels are so many pixels of the
    film wide; `pixel_samples`; `edits`: how many it shows; `settled`: it is the whole picture; `seconds` since the last
    of these edits; `statistics`; `header` as Session.header."""

    def __init__(self, values: dict[str, Any]) -> None:
        layers = values["layers"]
        self.image: Image = layers[""]
        self.aovs: dict[str, Image] = {name: layer for name, layer in layers.items() if name}
        self.statistics: dict[str, Any] = values["statistics"]
        self.header: dict[str, HeaderValue] = values["header"]
        self.reduction: int = values["reduction"]
        self.pixel_samples: int = values["pixel_samples"]
        self.edits: int = values["edits"]
        self.settled: bool = values["settled"]
        self.seconds: float = values["seconds"]


_open_sessions: weakref.WeakSet[LiveSession] = weakref.WeakSet()


@atexit.register
def _close_sessions() -> None:  # while their threads can still call Python
    for session in list(_open_sessions):
        session.close()


def _abandon_sessions() -> None:  # whose threads a forked process does not have
    for session in list(_open_sessions):
        session._core.abandon()


os.register_at_fork(after_in_child=_abandon_sessions)


class LiveSession:
    """Renders a scene in the background while it is edited. It takes the scene, which is to be used no more by itself.

        live = dapple.LiveSession(scene, preset="draft")
        live.edit(lambda scene: scene.camera.edit(fov=35))
        live.gains["key"] = 2
        image = live.wait().image"""

    def __init__(self, scene: Scene, **options: Any) -> None:
        """Options as of Session, but progress."""
        session = Session(scene, **options)
        self._known_gains: dict[str, ArrayLike] = dict(scene.gains)
        # What is not done yet, in its order: edits with the gains after them, if they succeed, and gains that were set.
        self._under_way: list[tuple[_core.Edit, dict[str, ArrayLike], bool]] = []
        self._refusal: Optional[SceneError] = None
        self._lock = threading.Lock()
        self._core = _core.LiveSession(scene._core, session._options)
        _open_sessions.add(self)

    def edit(self, change: Callable[[Scene], object]) -> _core.Edit:
        """A transaction: `change` is called soon, on the session's thread, with the scene; all of it counts or nothing.
        `.result()` of what is returned waits until the scene is built, and raises its error."""

        after: dict[str, ArrayLike] = {}

        def changed(core: _core.Scene) -> None:
            scene = Scene(core)
            change(scene)
            after.update(scene.gains)

        with self._lock:
            self._look_at_done()
            done = self._core.edit(changed)
            self._under_way.append((done, after, False))
            return done

    def _look_at_done(self) -> None:
        while self._under_way and self._under_way[0][0].done():
            done, gains, is_put = self._under_way.pop(0)
            try:
                done.result()
                self._known_gains = {**self._known_gains, **gains} if is_put else gains
            except Exception as error:  # of edits their owners know
                if is_put and self._refusal is None and isinstance(error, SceneError):
                    self._refusal = error

    def _raise_refusal(self) -> None:
        refusal, self._refusal = self._refusal, None
        if refusal is not None:
            raise refusal

    @property
    def gains(self) -> Gains:
        """Of light groups. One that is set shows at once, in frames of what has been sampled: nothing is traced for it.
        If it is refused, the next one that is set or wait() raises the error."""

        def known() -> dict[str, ArrayLike]:
            with self._lock:
                self._look_at_done()
                gains = self._known_gains
                for _, more, is_put in self._under_way:
                    if is_put:
                        gains = {**gains, **more}
                return gains

        def put(group: str, gain: list[float]) -> None:
            with self._lock:
                self._look_at_done()
                self._raise_refusal()
                if group not in self._known_gains and not self._under_way:
                    raise KeyError(group)
                self._under_way.append((self._core.gain(group, gain), {group: gain}, True))

        return Gains(known, lambda group: known()[group], put)

    def frame(self) -> Optional[LiveFrame]:
        """The latest; None before the first."""
        values = self._core.frame()
        return None if values is None else LiveFrame(values)

    def wait(self, seconds: float = 1e9) -> Optional[LiveFrame]:
        """Waits for the settled picture of all edits so far; None after `seconds`. Raises the error of a scene that cannot
        be rendered, or of a gain that was set and refused."""
        values = self._core.wait(seconds)
        with self._lock:
            self._look_at_done()
            self._raise_refusal()
        return None if values is None else LiveFrame(values)

    def write(self, path: Union[str, os.PathLike[str]]) -> None:
        """As Scene.write()."""
        self._core.write(os.fspath(path))

    def close(self) -> None:
        """Ends the session, with what it renders."""
        self._core.close()
