# SPDX-License-Identifier: Apache-2.0
"""Live sessions: what they show, whose scene it is, and how they end."""
import contextlib
import os
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np

import dapple
from scene_test import ROOM


class LiveSessionTest(unittest.TestCase):
    def setUp(self):
        self.scene = dapple.parse(ROOM)

    def test_live_sessions(self):
        with tempfile.TemporaryDirectory() as folder:
            live = dapple.LiveSession(self.scene, pixel_samples=8)
            first = live.wait(60)
            self.assertTrue(first.settled)
            self.assertEqual(first.image.shape, (16, 24, 3))

            def change(scene):
                scene.lights["key"].intensity *= 3
                scene.camera.edit(fov=30)

            live.edit(change).result()
            second = live.wait(60)
            self.assertEqual(second.edits, 1)
            shot = os.path.join(folder, "shot.pbrt")
            live.write(shot)
            np.testing.assert_array_equal(dapple.load(shot).render(pixel_samples=8), second.image)
            with self.assertRaisesRegex(dapple.SceneError, "no light"):
                live.edit(lambda scene: scene._core.edit("light", "kay", {})).result()
            with self.assertRaisesRegex(dapple.SceneError, "division"):
                live.edit(lambda scene: 1 / 0).result()
            np.testing.assert_array_equal(live.wait(60).image, second.image)
            self.assertEqual(live.frame().reduction, 1)
            self.assertFalse(live.frame().image.flags.writeable)
            self.assertTrue(np.shares_memory(live.frame().image, live.wait().image))

    def test_a_scene_of_a_live_session_is_of_no_use_elsewhere(self):
        def refuses(use):
            with self.assertRaisesRegex(dapple.SceneError, "handed over"):
                use()

        with self.assertRaises(dapple.SceneError):
            dapple.LiveSession(self.scene, preset="nonsense")
        camera = self.scene.camera
        camera.edit(fov=40)  # nothing was lost
        with contextlib.closing(dapple.LiveSession(self.scene, pixel_samples=1)) as live:
            kept = []
            live.edit(lambda scene: (kept.append(scene), scene.camera.edit(fov=30))).result()
            self.assertIsNotNone(live.wait())
            for scene in (self.scene, kept[0]):
                refuses(lambda: list(scene.lights))
                refuses(lambda: scene.camera.edit(fov=20))
            refuses(lambda: camera.edit(fov=20))
            refuses(lambda: dapple.LiveSession(self.scene))
            refuses(lambda: dapple.Session(self.scene).render())

    def test_a_scene_that_is_rendered_is_not_handed_over(self):
        refused = []

        def progress(*_):
            for use in (lambda: dapple.LiveSession(self.scene), self.scene.render):
                with self.assertRaisesRegex(dapple.SceneError, "being rendered") as caught:
                    use()
                refused.append(caught.exception)
            return False

        dapple.Session(self.scene, pixel_samples=10**6, progress=progress).render()
        self.assertEqual(len(refused), 2)
        self.assertTrue(list(self.scene.lights))

    def test_edits_cannot_wait_for_their_session(self):
        live = dapple.LiveSession(self.scene, pixel_samples=1)
        errors = []

        def change(_):
            for use in (live.wait, live.close, lambda: live.write("never.pbrt"),
                        lambda: live.edit(lambda scene: None).result()):
                with self.assertRaises(dapple.SceneError) as caught:
                    use()
                errors.append(str(caught.exception))

        live.edit(change).result()
        self.assertEqual(len(errors), 4)
        self.assertFalse(os.path.exists("never.pbrt"))
        self.assertTrue(live.wait(60).settled)
        live.close()

    def test_a_session_is_closed_under_those_who_wait(self):
        live = dapple.LiveSession(self.scene, pixel_samples=10**6)
        errors = []

        def wait():
            try:
                live.wait()
            except dapple.SceneError as error:
                errors.append(str(error))

        threads = [threading.Thread(target=wait) for _ in range(3)]
        for thread in threads:
            thread.start()
        time.sleep(.2)
        late = live.edit(lambda scene: time.sleep(.3))
        never = live.edit(lambda scene: None)
        live.close()
        for thread in threads:
            thread.join(60)
        self.assertEqual(errors, ["the session is closed"] * 3)
        for edit in (late, never):
            try:
                edit.result()
            except dapple.SceneError as error:
                self.assertIn("closed", str(error))

    def test_sessions_end_with_their_owners(self):
        program = """
import gc, os, sys, threading, time
import dapple
scene = dapple.load(sys.argv[1])
if sys.argv[2] == "daemon":
    threading.Thread(target=lambda: scene.render(pixel_samples=10**6), daemon=True).start()
    time.sleep(.3)
elif sys.argv[2] == "fork":
    live = dapple.LiveSession(scene, pixel_samples=1)
    live.wait()
    child = os.fork()
    if child == 0:
        live = None
        gc.collect()
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
elif sys.argv[2] == "rendering":
    threading.Thread(target=lambda: scene.render(pixel_samples=10**6), daemon=True).start()
    time.sleep(.3)
    child = os.fork()
    if child == 0:
        dapple._core.end_renderings()
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
elif sys.argv[2] == "closing":  # while an edit asks for another one
    live = dapple.LiveSession(scene, pixel_samples=1)
    begun = threading.Event()
    def change(scene):
        later = live.edit(lambda scene: None)
        begun.set()
        time.sleep(.3)
        later.result()
    done = live.edit(change)
    begun.wait()
    live.close()
    try:
        done.result()
    except dapple.SceneError:
        pass
else:  # the last who holds it is an edit
    class Holder: pass
    holder = Holder()
    holder.live = dapple.LiveSession(scene, pixel_samples=1)
    gone = threading.Event()
    def change(scene, holder=holder):
        gone.wait(10)
        holder.live = None
    done = holder.live.edit(change)
    gone.set()
    try:
        done.result()
    except dapple.SceneError:
        pass
print("whole")
"""
        with tempfile.TemporaryDirectory() as folder:
            scene = os.path.join(folder, "room.pbrt")
            with open(scene, "w", encoding="utf-8") as f:
                f.write(ROOM)
            for how in ("daemon", "fork", "rendering", "closing", "own"):
                with self.subTest(how):
                    done = subprocess.run([sys.executable, "-c", program, scene, how], timeout=60, capture_output=True)
                    self.assertEqual((done.returncode, done.stdout, done.stderr), (0, b"whole\n", b""))

    def test_two_live_sessions_are_as_two_processes(self):
        program = """
import sys
import numpy as np
import dapple

def begin(seed):
    live = dapple.LiveSession(dapple.load(sys.argv[1]), integrator="distribution", seed=seed, pixel_samples=16)
    live.edit(lambda s: s.lights["key"].edit(scale=1 + seed))
    live.gains["sky"] = seed
    live.edit(lambda s: s.camera.edit(fov=40 + seed))
    return live

sessions = {seed: begin(int(seed)) for seed in sys.argv[3:]}
for seed, live in sessions.items():
    np.save(sys.argv[2] + seed, live.wait().image)
    live.close()
"""
        with tempfile.TemporaryDirectory() as folder:
            scene = os.path.join(folder, "room.pbrt")
            with open(scene, "w", encoding="utf-8") as f:
                f.write(ROOM)
            for kind, seeds in (("both", "12"), ("one", "1"), ("other", "2")):
                subprocess.run([sys.executable, "-c", program, scene, os.path.join(folder, kind), *seeds], check=True, timeout=120)
            pictures = {name: np.load(os.path.join(folder, name + ".npy")) for name in ("both1", "both2", "one1", "other2")}
        np.testing.assert_array_equal(pictures["both1"], pictures["one1"])
        np.testing.assert_array_equal(pictures["both2"], pictures["other2"])
        self.assertGreater(np.abs(pictures["one1"] - pictures["other2"]).max(), .01)


if __name__ == "__main__":
    unittest.main()
