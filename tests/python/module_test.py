"""The module for Python: arrays in without a copy, results out, the command's numbers, errors by kind, threads, Ctrl-C. Needs EDGEWISE,
whose build has the module beside it."""

import gc
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import warnings
import weakref

import numpy as np
from scipy import ndimage

COMMAND = pathlib.Path(os.environ.get("EDGEWISE", "build/release/bin/edgewise"))
sys.path.insert(0, str(COMMAND.resolve().parent.parent / "python"))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "properties"))
import edgewise as ew  # noqa: E402
import files  # noqa: E402


def resident():
    with open("/proc/self/statm") as stream:
        return int(stream.read().split()[1]) * resource.getpagesize()


def write_channels(path, array):
    """NRRD of several channels, which are the last axis of the array."""
    axes = array.ndim - 1
    head = ["NRRD0004", f"type: {files.NRRD_TYPES[files.kind_of(array)]}", f"dimension: {array.ndim}", "sizes: " + " ".join(map(str, (array.shape[-1],) + array.shape[-2::-1])),
            "kinds: vector" + " domain" * axes, "spacings: nan" + " 1" * axes, "endian: little", "encoding: raw", "", ""]
    pathlib.Path(path).write_bytes("\n".join(head).encode() + array.tobytes())


class ModuleTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        rng = np.random.default_rng(5)
        cls.volume = ndimage.gaussian_filter(rng.random((20, 24, 28)), 2).astype("f4")

    def test_results_are_the_commands(self):
        rng = np.random.default_rng(1)
        env = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache")}
        for number in range(50):
            dtype = ["u1", "i2", "f4", "u2"][number % 4]
            shape = tuple(int(n) for n in rng.integers(5, 25, 3))
            array = rng.random(shape) if dtype == "f4" else rng.integers(0, 200, shape)
            array = array.astype(dtype)
            files.write_nrrd(self.folder / "in.nrrd", array, (1, 1, 1))
            angles = [round(float(a), 2) for a in rng.uniform(-90, 90, 3)]
            kind = ["mip", "xray", "warp", "median", "gauss"][number % 5]
            words, query = ["--max-error", "0.3"], {"max_error": .3}
            if kind in ("mip", "xray"):
                job, query = "render", {**query, "mode": kind, "rotate": angles, "size": "native"}
                words += ["--mode", kind, "--rotate", ",".join(map(str, angles)), "--size", "native"]
            elif kind == "warp":
                job, query = "warp", {**query, "rotate": angles}
                words += ["--rotate", ",".join(map(str, angles)), "--bits", "32"]
            else:
                job = "filter"
                query = {"op": "median" if kind == "median" else "convolve", "kernel": "box:1" if kind == "median" else "gauss:1.5"}
                words = ["--op", query["op"], "--kernel", query["kernel"], "--bits", "32"]
            made = ew.plan(array, job, **query)
            for step in made.steps:
                words += ["--via", step]
            out = self.folder / "out.nrrd"
            done = subprocess.run([COMMAND, job, self.folder / "in.nrrd", "-o", out, *words, "--quiet"], capture_output=True, text=True, env=env)
            self.assertEqual(done.returncode, 0, done.stderr)
            want, got = files.read_nrrd(out)[0], made.run()
            self.assertEqual(got.shape, want.shape, (number, kind))
            np.testing.assert_array_equal(got.astype("f4"), want.astype("f4"), f"{number} {kind} {made.steps}")

    def test_arrays_are_not_copied(self):
        array = np.zeros((256, 512, 512), "f4")  # 256 MiB
        array[100:110, 200:210, 300:310] = 1
        before = resident()
        volume = ew.Volume(array)
        made = ew.plan(volume, mode="mip", size="native", max_error=.1)
        picture = made.run()
        self.assertLess(resident() - before, 64 << 20)
        self.assertEqual(picture.max(), 1)
        self.assertEqual(volume.array().__array_interface__["data"][0], array.__array_interface__["data"][0])
        self.assertFalse(volume.array().flags.writeable)
        self.assertFalse(picture.flags.writeable)

    def test_results_keep_what_they_need(self):
        picture = ew.plan(self.volume.copy(), mode="mip", rotate=(10, 20, 0)).run()
        copy = picture.copy()
        gc.collect()
        ew.render(self.volume, mode="xray")
        np.testing.assert_array_equal(picture, copy)

    def test_copies_are_said(self):
        for array, word in ((self.volume.astype("f8"), "float64"), (self.volume.astype("i8"), "int64"), (self.volume[::2], None),
                            (self.volume[:, ::-1], "rows"), (self.volume.astype(">f4"), ">f4"), (np.asfortranarray(self.volume), "rows")):
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                got = ew.render(array, mode="mip", size="native", via=["project.ray_cast/filter=zoh/step=1"])
            copied = [str(one.message) for one in said if "copied" in str(one.message)]
            if word is None:
                continue
            self.assertTrue(copied and word in copied[0], (array.dtype, [str(one.message) for one in said]))
            np.testing.assert_array_equal(got, np.ascontiguousarray(array, "f4").max(0))

    def test_geometry_is_the_arrays(self):
        volume = ew.Volume(self.volume, spacing=(2, 1, 1.5))
        self.assertEqual((volume.shape, volume.spacing, volume.unit), (self.volume.shape, (2, 1, 1.5), "mm"))
        moved = ew.warp(volume, translate=(1.5, 2, 2), via=["warp.backward/filter=foh"], size=self.volume.shape)
        np.testing.assert_allclose(moved[2:-1, 3:-1, 2:-1], self.volume[1:-2, 1:-3, 1:-2], atol=1e-5)
        with self.assertRaises(ValueError):
            ew.Volume(self.volume, spacing=(1, 2))
        with self.assertRaises(ValueError):
            ew.Volume(np.zeros(5))

    def test_filters_are_scipys(self):
        kernel = np.random.default_rng(2).random((3, 5, 3))
        got = ew.filter(self.volume, op="correlate", kernel=kernel, border="clamp")
        want = ndimage.correlate(self.volume.astype("f8"), kernel, mode="nearest")
        np.testing.assert_allclose(got, want, rtol=1e-5)

    def test_surfaces(self):
        z, y, x = np.mgrid[:32, :32, :32] - 15.5
        vertices, triangles = ew.mesh((12 - np.sqrt(x * x + y * y + z * z)).astype("f4"), isovalue=2)
        radius = np.sqrt(((vertices - 15.5) ** 2).sum(1))
        np.testing.assert_allclose(radius, 10, atol=.05)
        self.assertLess(triangles.max(), len(vertices))

    def test_plans_run_again(self):
        made = ew.plan(self.volume, mode="mip", rotate=(10, 20, 0), turntable=5, max_error=.1)
        first = made.run()
        self.assertEqual((made.frames, first.shape[0], first.ndim), (5, 5, 3))
        np.testing.assert_array_equal(made.run(), first)
        other = made.with_input(np.ascontiguousarray(self.volume[::-1]))
        self.assertFalse(np.array_equal(other.run(), first))
        turned = made.with_views(rotate=(40, 0, 0), turntable=5)
        self.assertEqual(turned.run().shape[0], 5)
        np.testing.assert_array_equal(made.run(), first)
        with self.assertRaises(ValueError):
            made.with_input(self.volume[:5])

    def test_threads_at_once(self):
        made = ew.plan(self.volume, mode="xray", rotate=(10, 20, 0), max_error=.1)
        right, wrong = made.run(), []

        def work():
            for _ in range(20):
                if not np.array_equal(made.run(), right):
                    wrong.append(1)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertFalse(wrong)

    def test_nothing_is_kept(self):
        small = np.ascontiguousarray(self.volume[:12, :12, :12])
        made = ew.plan(small, mode="mip", max_error=.2, size="native")
        for _ in range(300):
            made.run()
        before = resident()
        for _ in range(3000):
            made.run()
        self.assertLess(resident() - before, 8 << 20)

    def test_errors_by_kind(self):
        with self.assertRaises(OSError):
            ew.read(self.folder / "none.nrrd")
        with self.assertRaises(ValueError):
            ew.plan(self.volume, zoom=0)
        with self.assertRaises(ValueError):
            ew.plan(self.volume, "paint")
        with self.assertRaises(TypeError):
            ew.plan(self.volume, no_such_keyword=1)
        with self.assertRaises(TypeError):
            ew.plan(self.volume, mode=["mip"])
        with self.assertRaises(ew.Infeasible) as none:
            ew.plan(self.volume, rotate=(10, 20, 0), max_error=1e-12)
        self.assertIsInstance(none.exception, ValueError)

    def test_nothing_is_ignored(self):
        for job, word, value in (("mesh", "rotate", (1, 2, 3)), ("mesh", "mode", "mip"), ("filter", "mode", "mip"), ("filter", "size", 8),
                                 ("warp", "mode", "mip"), ("warp", "window", (0, 1)), ("render", "outside", 1), ("render", "op", "median")):
            with self.assertRaises(TypeError, msg=(job, word)):
                ew.plan(self.volume, job, **{word: value})
        made = ew.plan(self.volume, mode="mip", size=(9, 11))
        self.assertEqual(made.with_views(rotate=(5, 6, 7)).run().shape, (9, 11))
        with self.assertRaises(TypeError):
            made.with_views(mode="xray")
        with self.assertRaises(ValueError):
            made.with_input(ew.Volume(self.volume, spacing=(1, 1, 9)))

    def test_what_is_no_number_is_refused(self):
        for kernel in (np.ones((3, 0, 3)), np.full((3, 3, 3), np.nan), np.full((3, 3, 3), np.inf), "gauss:x", "gauss:1,2", "gauss:2abc", "disk", "2"):
            with self.assertRaises(ValueError, msg=str(kernel)[:20]):
                ew.filter(self.volume, op="convolve", kernel=kernel)
        for keywords in (dict(spacing=-1), dict(spacing=0), dict(spacing=float("nan")), dict(origin=(0, float("inf"), 0)),
                         dict(direction=np.zeros((3, 3))), dict(direction=2 * np.eye(3))):
            with self.assertRaises(ValueError, msg=str(keywords)):
                ew.Volume(self.volume, **keywords)
        for keywords in (dict(spacing="abc"), dict(direction=5)):
            with self.assertRaises(TypeError, msg=str(keywords)):
                ew.Volume(self.volume, **keywords)
        for zoom in (1e300, 1e-300, 0, -1):
            with self.assertRaises(ValueError):
                ew.plan(self.volume, zoom=zoom, size=(8, 8))
        with self.assertRaises(ValueError):
            ew.plan(self.volume, spacing=(1e300, 1e300), size=(8, 8))

    def test_keywords_are_the_commands_options(self):
        """Every keyword means what the option of its name means: numbers, lists and arrays, and texts."""
        files.write_nrrd(self.folder / "in.nrrd", self.volume, (1, 1, 1))
        env = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache")}
        steps = np.array([np.eye(4), [[0, 1, 0, 2], [-1, 0, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]]])
        np.savetxt(self.folder / "path.txt", steps.reshape(2, 16))
        table = [
            ("render", dict(mode="xray", planes=[(1, 0, 0, -4), (0, 1, .5, -9)], slab=9.5), ["--mode", "xray", "--clip-plane", "1,0,0,-4", "--clip-plane", "0,1,.5,-9", "--slab", "9.5"]),
            ("render", dict(mode="mean", box=(3, 4, 5, 20, 18, 15), balls=(12, 12, 10, 7)), ["--mode", "mean", "--clip", "3,4,5,20,18,15", "--clip-ball", "12,12,10,7"]),
            ("render", dict(mode="composite", shade="phong", lights=[(0, 0, -1), "-1,0,-1,.5"], material=(.3, .6, .1, 7), background=(1, .5, 0)),
             ["--mode", "composite", "--shade", "phong", "--light", "0,0,-1", "--light=-1,0,-1,.5", "--material", ".3,.6,.1,7", "--background", "1,.5,0"]),
            ("render", dict(mode="surface", isovalue=.5, cue=(.01, "linear"), gradient="sobel"), ["--mode", "surface", "--isovalue", ".5", "--depth-cue", ".01,linear", "--gradient", "sobel"]),
            ("render", dict(mode="mip", perspective=30, eye=(14, 12, -60), look_at=np.array([14, 12, 9.5]), size=(21, 33)),
             ["--mode", "mip", "--perspective", "30", "--eye", "14,12,-60", "--look-at", "14,12,9.5", "--size", "33x21"]),
            ("render", dict(mode="xray", scale=1.25, path=steps), ["--mode", "xray", "--scale", "1.25", "--path", str(self.folder / "path.txt")]),
            ("render", dict(mode="minip", path=self.folder / "path.txt"), ["--mode", "minip", "--path", str(self.folder / "path.txt")]),
            ("warp", dict(crop=(2, 3, 4, 20, 18, 15), spacing=(2, 1, 1.5)), ["--clip", "2,3,4,20,18,15", "--spacing", "1.5,1,2"]),
            ("warp", dict(rotate=(10, 20, 30), grid_moves=True, max_error="30dB"), ["--rotate", "10,20,30", "--move", "grid", "--max-error", "30dB"]),
            ("filter", dict(op="gaussian", kernel=1.5), ["--op", "gaussian", "--kernel", "1.5"]),
            ("filter", dict(op="Grey-Dilation", kernel="disc:2", slices=True), ["--op", "dilate", "--kernel", "disc:2", "--slices"]),
            ("filter", dict(op="sobel"), ["--op", "sobel"]),
            ("radon", dict(angles=12), ["--angles", "12"]),
            ("radon", dict(angles=(0, 30, 75.5)), ["--angles", "0,30,75.5"]),
            ("radon", dict(angles=9, to="hough", threshold=.5), ["--angles", "9", "--to", "hough", "--threshold", ".5"]),
        ]
        for job, query, words in table:
            with self.subTest(job=job, query=str(query)), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                query = {**query} if job != "render" or "size" in query else {**query, "size": "native"}
                made = ew.plan(self.volume, job, **query)
                words = words + ([] if job != "render" or "size" in query and query["size"] != "native" else ["--size", "native"])
                for step in made.steps:
                    words += ["--via", step]
                got = made.run()
                frames = made.frames
                out = self.folder / ("out_%d.nrrd" if frames > 1 else "out.nrrd")
                done = subprocess.run([COMMAND, job, self.folder / "in.nrrd", "-o", out, *words, "--bits", "32", "--quiet"], capture_output=True, text=True, env=env)
                self.assertEqual(done.returncode, 0, done.stderr)
                want = np.stack([files.read_nrrd(str(out) % k)[0] for k in range(frames)]) if frames > 1 else files.read_nrrd(out)[0]
                if query.get("mode") in ("composite", "surface"):  # written over the background, [channel] last
                    want, got = want[..., :1], got[..., :1]
                    alpha = made.run()[..., 3:]
                    got = got + (1 - alpha) * query.get("background", (0, 0, 0))[0]
                    np.testing.assert_allclose(got, want.astype("f4"), atol=1e-6)
                    continue
                np.testing.assert_array_equal(got.astype("f4"), want.astype("f4"))

    def test_every_setting_is_in_the_help(self):
        for name in ("planes", "lights", "look_at", "grid_moves", "planning_time", "threshold", "decimate", "slices"):
            self.assertIn(f"  {name}", ew.plan.__doc__)
        for name in ("input_spacing", "orient", "series"):
            self.assertIn(f"  {name}", ew.read.__doc__)
        self.assertNotIn("--", ew.plan.__doc__.split("\n\n", 1)[1].replace("->", ""))

    def test_what_acts_on_nothing_is_refused(self):
        for word, value in (("bits", 8), ("out", "a.png"), ("legend", True), ("verify", True), ("time", 0), ("repeat", 3)):
            with self.assertRaises(TypeError, msg=word):
                ew.plan(self.volume, **{word: value})
        with self.assertRaises(TypeError):
            ew.read(self.folder / "in.nrrd", zoom=2)
        for keywords in (dict(zoom="x"), dict(planes=(1, 2, 3)), dict(path=np.eye(3)), dict(mode="mop"), dict(transfer="a.json", preset="ct-bone", mode="composite")):
            with self.assertRaises(ValueError, msg=str(keywords)):
                ew.plan(self.volume, **keywords)
        for keywords in (dict(zoom=object()), dict(shadows="maybe"), dict(zoom=[1, 2])):
            with self.assertRaises(TypeError, msg=str(keywords)):
                ew.plan(self.volume, **keywords)

    def test_reads_what_is_selected(self):
        files.write_nrrd(self.folder / "one.nrrd", self.volume, (1, 1, 1))
        read = ew.read(self.folder / "one.nrrd", input_spacing=(3, 2, 1.5), input_unit="um")
        np.testing.assert_allclose(read.spacing, (.003, .002, .0015))  # z, y, x, in millimetres as all that is read

    def test_half_floats_are_floats(self):
        half = self.volume.astype("f2")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            np.testing.assert_array_equal(ew.render(half, mode="composite", size=(16, 16)), ew.render(half.astype("f4"), mode="composite", size=(16, 16)))

    def test_control_c_ends(self):
        script = ("import sys; sys.path.insert(0, %r)\nimport numpy as np, edgewise as ew\n"
                  "p = ew.plan(np.random.default_rng(1).random((160,) * 3).astype('f4'), mode='mip', rotate=(10, 20, 0), turntable=400,"
                  " size='native', via=['project.ray_cast/filter=bspline3/step=0.5'])\nprint('begins', flush=True)\n"
                  "try:\n    p.run()\nexcept KeyboardInterrupt:\n    print('ended')\n") % str(pathlib.Path(ew.__file__).parent)
        child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
        self.assertEqual(child.stdout.readline().strip(), "begins")
        time.sleep(.3)
        child.send_signal(signal.SIGINT)
        out, _ = child.communicate(timeout=60)
        self.assertEqual(out.strip(), "ended")

    def test_integers_that_are_rounded_are_told(self):
        for dtype, value, rounds in (("i4", 1 << 24, False), ("i4", (1 << 24) + 1, True), ("u4", (1 << 31) + 1, True), ("i8", -(1 << 40), True),
                                     ("f8", 1e12, False)):
            array = np.zeros((4, 5, 6), dtype)
            array[1, 2, 3] = value
            with warnings.catch_warnings(record=True) as told:
                warnings.simplefilter("always")
                ew.Volume(array)
            self.assertEqual(["merge" in str(each.message) for each in told], [rounds], (dtype, value))

    def test_errors_say_which_keyword_and_what_would_do(self):
        with self.assertRaises(ew.RequestError) as wrong:
            ew.plan(self.volume, zoom=0)
        self.assertEqual(wrong.exception.field, "zoom")
        self.assertIsInstance(wrong.exception, ValueError)
        query = {"rotate": (20, 10, 0), "max_error": 1e-9}
        with self.assertRaises(ew.Infeasible) as none:
            ew.plan(self.volume, **query)
        self.assertTrue(none.exception.ways_out)
        for way in none.exception.ways_out:
            self.assertTrue(set(way) <= {"max_error", "max_time", "max_memory"}, way)
            ew.plan(self.volume, **{**query, **way})

    def test_errors_tell_the_limits(self):
        for job, query, least, greatest, allowed in (("render", dict(zoom=0), 1e-6, 1e6, ()),
                                                     ("render", dict(perspective=180), 0, 180, ()),
                                                     ("render", dict(threads=0), 1, 1024, ()),
                                                     ("render", dict(slab=-2), 0, None, ()),
                                                     ("render", dict(background=(0, 2, 0)), 0, 1, ("none",)),
                                                     ("warp", dict(max_error=-1), 0, None, ("linear",)),
                                                     ("warp", dict(minimize="tme"), None, None, ("time", "error", "memory")),
                                                     ("filter", dict(op="median", kernel="box:1", border="x"), None, None, ("zero", "clamp", "mirror", "wrap")),
                                                     ("mesh", dict(isovalue=.5, decimate=1.5), 0, 1, ())):
            with self.assertRaises(ew.RequestError, msg=str(query)) as wrong:
                ew.plan(self.volume, job, **query)
            error = wrong.exception
            self.assertEqual((error.field, error.least, error.greatest, error.allowed), (list(query)[-1], least, greatest, allowed))
        with self.assertRaises(ew.RequestError) as wrong:
            ew.plan(self.volume, "filter", op="medain", kernel="box:1")
        self.assertIn("median", wrong.exception.allowed)
        with self.assertRaises(ew.RequestError) as wrong:  # no limits: it says so
            ew.plan(self.volume, planes=(1, 2, 3))
        self.assertEqual((wrong.exception.least, wrong.exception.greatest, wrong.exception.allowed), (None, None, ()))

    def test_one_channel_of_several(self):
        rng = np.random.default_rng(7)
        env = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache")}
        for dtype, shape in (("u1", (9, 14, 11, 3)), ("f4", (8, 7, 12, 2)), ("i2", (30, 41, 4)), ("u2", (6, 5, 7, 5))):
            array = np.ascontiguousarray((rng.random(shape) * 200).astype(dtype))
            write_channels(self.folder / "channels.nrrd", array)
            job = "render" if array.ndim == 4 else "filter"
            query, words = (dict(mode="mip", size="native"), ["--mode", "mip", "--size", "native"]) if job == "render" else \
                (dict(op="median", kernel="box:1"), ["--op", "median", "--kernel", "box:1"])
            for number in range(shape[-1]):
                volume = ew.Volume(array, spacing=(1,) * (array.ndim - 1), channels=True)
                got = getattr(ew, job)(volume, channel=number, **query)
                np.testing.assert_array_equal(got, getattr(ew, job)(np.ascontiguousarray(array[..., number]), **query))
                out = self.folder / "channel.nrrd"
                done = subprocess.run([COMMAND, job, self.folder / "channels.nrrd", "-o", out, "--channel", str(number), *words, "--bits", "32", "--quiet"],
                                      capture_output=True, text=True, env=env)
                self.assertEqual(done.returncode, 0, done.stderr)
                np.testing.assert_array_equal(got.astype("f4"), files.read_nrrd(out)[0].astype("f4"))
                # The same of the file.
                np.testing.assert_array_equal(getattr(ew, job)(str(self.folder / "channels.nrrd"), channel=number, **query), got)
            for wrong, word in ((shape[-1], "counted from 0"), (-1, "whole number"), ("DAPI", "no names"), ("0,1", "merged"), (.5, "whole number")):
                with self.assertRaises(ValueError, msg=str(wrong)) as refused:
                    ew.plan(ew.Volume(array, channels=True), job, channel=wrong, **query)
                self.assertIn(word, str(refused.exception))
            with self.assertRaises(ew.RequestError) as refused:
                ew.plan(ew.Volume(array, channels=True), job, channel=shape[-1], **query)
            self.assertEqual((refused.exception.field, refused.exception.least, refused.exception.greatest), ("channel", 0, shape[-1] - 1))
            made = ew.plan(ew.Volume(array, channels=True), job, channel=1, **query)
            other = np.ascontiguousarray(array[::-1])
            want = getattr(ew, job)(np.ascontiguousarray(other[..., 1]), **query)
            np.testing.assert_array_equal(made.with_input(ew.Volume(other, channels=True)).run(), want)
            np.testing.assert_array_equal(made.with_input(other).run(), want)
        with self.assertRaises(ValueError):
            ew.plan(self.volume, channel=1)
        keywords = {"channel": 0, "mode": "mip"}
        ew.plan(self.volume, **keywords)
        self.assertEqual(keywords, {"channel": 0, "mode": "mip"})

    def test_types_of_filters_hang_on_no_path(self):
        rng = np.random.default_rng(8)
        chooses = [dict(op="median", kernel="box:1"), dict(op="dilate", kernel="sphere:2"), dict(op="erode", kernel="box:1"), dict(op="open", kernel="cross:1"),
                   dict(op="close", kernel="box:1")]
        computes = [dict(op="convolve", kernel="box:1"), dict(op="convolve", kernel="box:4"), dict(op="convolve", kernel="gauss:1.5"),
                    dict(op="correlate", kernel=rng.random((3, 3, 3))), dict(op="sobel"), dict(op="gradient"), dict(op="tophat", kernel="box:1"),
                    dict(op="dilate", kernel=rng.random((3, 3, 3)))]
        edges = ["backward", "forward", "separable", "running", "fourier", "fourier_levels", "median", "median_histogram", "runs", "van_herk", "ball_sequence/differs=1",
                 "recursive"]
        for dtype in ("u1", "i1", "u2", "i2", "f4"):
            for top in (3, 120):
                array = (rng.random((12, 13, 14)) * top).astype(dtype)
                for query in chooses + computes:
                    want, taken = np.dtype(dtype if any(query is one for one in chooses) else "f4"), 0
                    for via in [[]] + [["filter." + edge] for edge in edges]:
                        try:
                            result = ew.filter(array, via=via, **({"max_error": .5} if via else {}), **query)
                        except ew.Infeasible:
                            continue
                        taken += 1
                        self.assertEqual(result.dtype, want, (dtype, top, query, via))
                        self.assertFalse(result.flags.writeable)
                    self.assertGreater(taken, 1)

    def test_what_is_dropped_goes(self):
        def made():
            array = self.volume.copy()
            volume = ew.Volume(array)
            plan = ew.plan(volume, mode="mip", size="native", max_error=.2)
            result = plan.run()
            return {"array": array, "volume": volume, "plan": plan, "result": result}

        gc.collect()
        gc.disable()  # nothing here is a cycle
        self.addCleanup(gc.enable)
        for order in (("array", "volume", "plan", "result"), ("result", "plan", "volume", "array"), ("plan", "array", "result", "volume")):
            held = made()
            picture = held["result"].copy()
            seen = {name: weakref.ref(one) for name, one in held.items()}
            for place, name in enumerate(order):
                del held[name]
                # What nothing needs any more is gone; what others read stays.
                pinned = name == "array" and ("volume" in held or "plan" in held)
                self.assertEqual(seen[name]() is None, not pinned, (order, name))
                if "plan" in held:
                    np.testing.assert_array_equal(held["plan"].run(), picture)
                if "result" in held:
                    np.testing.assert_array_equal(held["result"], picture)
            self.assertEqual([name for name, one in seen.items() if one() is not None], [], order)

    def test_results_outlive_what_made_them_and_keep_nothing_else(self):
        array = np.random.default_rng(3).random((150, 150, 150)).astype("f4")  # 13 MB
        kept = []
        before = resident()
        for _ in range(20):
            kept.append(ew.render(array.copy(), mode="mip", size="native", max_error=.2))
        self.assertLess(resident() - before, 60 << 20)
        for picture in kept:
            np.testing.assert_array_equal(picture, kept[0])

    def test_daemon_threads_end_with_the_interpreter(self):
        script = ("import sys; sys.path.insert(0, %r)\nimport threading, time, numpy as np, edgewise as ew\n"
                  "v = np.random.default_rng(1).random((40,) * 3).astype('f4')\n"
                  "p = ew.plan(v, mode='mip', rotate=(10, 20, 0), turntable=%%d, size='native', max_error=.3)\n"
                  "def work():\n    while True:\n        %%s\n"
                  "for _ in range(2):\n    threading.Thread(target=work, daemon=True).start()\n"
                  "time.sleep(%%g)\n") % str(pathlib.Path(ew.__file__).parent)
        kinds = [(2, "p.run()"), (400, "p.run()"), (1, "ew.render(v, mode='xray', size=16, max_error=.3)"), (2, "p.with_views(rotate=(1, 2, 3)).run()"),
                 (1, "ew.Volume(np.asfortranarray(v)[::-1], spacing=(1, 2, 3)).array()")]
        for number, (frames, work) in enumerate(kinds):
            done = subprocess.run([sys.executable, "-W", "ignore", "-c", script % (frames, work, .05 + .04 * number)], capture_output=True, text=True, timeout=120)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""), (number, work))
        late = ("import sys; sys.path.insert(0, %r)\nimport atexit\n"
                "@atexit.register\ndef end():\n    try:\n        ew.Volume(np.zeros((3, 4, 5), 'f4'))\n    except RuntimeError as error:\n        print(error)\n"
                "import numpy as np, edgewise as ew\n") % str(pathlib.Path(ew.__file__).parent)
        done = subprocess.run([sys.executable, "-c", late], capture_output=True, text=True, timeout=60)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("interpreter ends", done.stdout)

    def test_facts_that_are_kept_change_nothing(self):
        query = {"rotate": (20, 10, 0), "size": 40, "max_error": 0.05}
        first = ew.render(self.volume, **query)
        changed = self.volume.copy()
        changed[5:9, 5:9, 5:9] += 1  # in the same shape, and then at the same address
        other = ew.render(changed, **query)
        np.testing.assert_array_equal(ew.render(self.volume, **query), first)
        changed[:] = self.volume
        np.testing.assert_array_equal(ew.render(changed, **query), first)
        self.assertFalse(np.array_equal(other, first))


if __name__ == "__main__":
    unittest.main()
