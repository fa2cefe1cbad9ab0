"""What ImageJ says of its TIFF files: calibrated values, signed 16 bits, units, origins, display ranges. Needs EDGEWISE."""

import json
import pathlib
import struct
import sys
import unittest

import numpy as np

root = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(root / "io"), str(root / "cli")]
import files
import format_writers as w
from running import Running


class ImageJTest(Running):
    def put(self, name, pages, text, order="<", big=False, more=None, size=None):
        tags = w.described("ImageJ=1.54f\n" + text)
        for tag in (more or {}, size or {}):
            tags.update(tag)
        path = self.folder / name
        path.write_bytes(w.tiff([w.tiff_page(p, order=order, more=tags if i == 0 else None) for i, p in enumerate(pages)], order, big))
        return path

    def info(self, path):
        return json.loads(self.run_it("info", path, "--json", "-", "--quiet").stdout)

    def values(self, path, *words, ending=".nrrd"):
        out = self.folder / ("out" + ending)
        self.run_it("warp", path, "-o", out, "--quiet", *words)
        return files.read(out)[..., 0]

    def test_a_straight_line_is_applied(self):
        for order in "<>":
            for dtype, c0, c1 in (("u1", -7, 0.5), ("u2", -32768, 1), ("u2", 10, -0.25), ("f4", 3, 2), ("u2", 0, 1e-3)):
                stored = w.ramp(3, 4, 5, dtype="i4") % (250 if dtype == "u1" else 1000) + (32000 if c0 == -32768 else 0)
                stored = stored.astype(dtype)
                text = f"images=3\nslices=3\ncf=0\nc0={float(c0)}\nc1={c1}\nvunit=Gray Value\n"
                path = self.put("a.tif", stored, text, order, big=order == ">")
                expected = stored.astype("f8") * c1 + c0
                with self.subTest(order=order, dtype=dtype, c0=c0, c1=c1):
                    np.testing.assert_allclose(self.values(path), expected, rtol=2.0 ** -23)
                    # Whole values stay whole, and what is written says the same when it is read again.
                    np.testing.assert_allclose(self.values(path, ending=".tif"), expected, rtol=2.0 ** -23)
                    self.run_it("warp", path, "-o", self.folder / "again.tif", "--quiet")
                    np.testing.assert_allclose(self.values(self.folder / "again.tif"), expected, rtol=2.0 ** -23)
                    low, high = self.info(path)["range"]
                    np.testing.assert_allclose((low, high), (expected.min(), expected.max()), rtol=1e-6)

    def test_signed_samples_are_whole_numbers(self):
        values = w.ramp(3, 4, 5, dtype="i4") - 1000
        path = self.put("a.tif", (values + 32768).astype("u2"), "images=3\nslices=3\ncf=0\nc0=-32768.0\nc1=1.0\nvunit=Gray Value\n")
        got = self.values(path)
        self.assertEqual(got.dtype, np.dtype("<i2"))
        np.testing.assert_array_equal(got, values)
        # A mode shows them too: the lowest sample of each ray.
        self.run_it("render", path, "-o", self.folder / "a.nrrd", "--mode", "minip", "--view", "z", "--size", "native", "--quiet")
        np.testing.assert_allclose(np.sort(files.read(self.folder / "a.nrrd").ravel()), np.sort(values.min(0).ravel()), atol=1e-3)
        # Samples that are signed in the file have nothing added.
        path = self.put("b.tif", values.astype("i2"), "images=3\nslices=3\ncf=0\nc0=-32768.0\nc1=1.0\n")
        np.testing.assert_array_equal(self.values(path), values)

    def test_a_stack_with_one_directory_is_calibrated(self):
        stored = (w.ramp(4, 3, 5, dtype="i4") + 31768).astype("u2")
        for order in "<>":
            tags = w.described("ImageJ=1.54f\nimages=4\nslices=4\ncf=0\nc0=-32768\nc1=1\nvunit=Gray Value\n")
            data = w.tiff([w.tiff_page(stored[0], order=order, more=tags)], order, tail=stored[1:].astype(order + "u2").tobytes())
            (self.folder / "one.tif").write_bytes(data)
            np.testing.assert_array_equal(self.values(self.folder / "one.tif"), stored.astype(int) - 32768)

    def test_other_functions_are_named(self):
        stored = w.ramp(3, 4, 5, dtype="<u2")
        for cf, name in ((1, "polynomial"), (7, "Rodbard"), (13, "recovery"), (21, "optical density"), (99, "not known")):
            said = self.info(self.put("a.tif", stored, f"images=3\nslices=3\ncf={cf}\nc0=1\nc1=2\nc2=3\nvunit=OD\n"))
            self.assertTrue(any(name in text and "as stored" in text for text in said["warnings"]), said["warnings"])
            np.testing.assert_array_equal(self.values(self.folder / "a.tif"), stored)
        for text in ("cf=20\nc0=5\nc1=2\n", "c0=5\nc1=2\n"):  # none
            self.assertEqual(self.info(self.put("a.tif", stored, "images=3\nslices=3\n" + text))["warnings"], [])
            np.testing.assert_array_equal(self.values(self.folder / "a.tif"), stored)
        for text in ("cf=0\nc0=5\n", "cf=0\nc0=nan\nc1=1\n", "cf=0\nc0=0\nc1=0\n"):
            said = self.info(self.put("a.tif", stored, "images=3\nslices=3\n" + text))
            self.assertTrue(any("no straight line" in text for text in said["warnings"]), said["warnings"])

    def test_units_and_origin(self):
        stored, size = w.ramp(3, 4, 5, dtype="<u2"), w.resolution((10, 1), (5, 1), 1)
        head = "images=3\nslices=3\n"
        cases = [  # text, spacing, origin [mm]
            ("unit=micron\nspacing=2\nxorigin=3\nyorigin=-4.5\nzorigin=1\n", (1e-4, 2e-4, 2e-3), (-3e-4, 9e-4, -2e-3)),
            ("unit=\\u00B5m\nspacing=2\nzunit=mm\nzorigin=2\n", (1e-4, 2e-4, 2), (0, 0, -4)),
            ("unit=nm\nyunit=um\nzunit=cm\nspacing=-0.5\n", (1e-7, 2e-4, 5), (0, 0, 0)),
        ]
        for text, spacing, origin in cases:
            said = self.info(self.put("a.tif", stored, head + text, size=size))
            self.assertEqual(said["unit"], "mm")
            np.testing.assert_allclose(said["spacing"], spacing, rtol=1e-9, err_msg=text)
            np.testing.assert_allclose(said["origin"], origin, rtol=1e-9, atol=1e-15, err_msg=text)
        # Slices whose unit is no length leave no length at all, and a word.
        said = self.info(self.put("a.tif", stored, head + "unit=micron\nzunit=sec\nspacing=2\n", size=size))
        self.assertEqual((said["unit"], said["spacing"]), (None, [0.1, 0.2, 2]))
        self.assertTrue(any("'sec'" in text for text in said["warnings"]), said["warnings"])
        # As ImageJ: pixels of no size are one unit large.
        self.assertEqual(self.info(self.put("a.tif", stored, head + "unit=um\nspacing=2\n"))["spacing"], [1e-3, 1e-3, 2e-3])
        # As ImageJ: dots a centimetre under micrometres.
        said = self.info(self.put("a.tif", stored, head + "unit=um\nspacing=2\n", size=w.resolution((10000, 1), (5000, 1), 3)))
        np.testing.assert_allclose(said["spacing"], (1e-3, 2e-3, 2e-3))

    def test_origins_outlive_tiff(self):
        path = self.put("a.tif", w.ramp(3, 4, 5, dtype="<u2"), "images=3\nslices=3\nunit=micron\nspacing=2\nxorigin=3\nzorigin=-1.5\n",
                        size=w.resolution((10, 1), (5, 1), 1))
        self.run_it("warp", path, "-o", self.folder / "b.tif", "--quiet")
        said = self.info(self.folder / "b.tif")
        np.testing.assert_allclose(said["origin"], (-3e-4, 0, 3e-3), rtol=1e-9)
        np.testing.assert_allclose(said["spacing"], (1e-4, 2e-4, 2e-3), rtol=1e-9)

    def merged(self, order, ranges, extra="", words=(), dtype="<u2", add=0):
        """Channel 0 is 1000 in a block and 60000 in one place, channel 1 is 500 in another block."""
        v = np.zeros((4, 2, 12, 16), "i4")
        v[:, 0, 2:6, 2:6] = 1000
        v[0, 0, 0, 15] = 20000
        v[:, 1, 7:11, 9:13] = 500
        v = (v + add).astype(dtype)
        more = {}
        if ranges:
            head = (b"IJIJ" if order == ">" else b"JIJI") + (b"rang" if order == ">" else b"gnar") + struct.pack(order + "I", 1)
            body = struct.pack(order + "4d", *ranges)
            more = {50838: (4, [len(head), len(body)]), 50839: (1, list(head + body))}
        text = "images=8\nchannels=2\nslices=4\nhyperstack=true\nmode=composite\n" + extra
        path = self.put("c.tif", v.reshape(8, 12, 16), text, order, more=more)
        self.run_it("render", path, "-o", self.folder / "c.png", "--channel", "all", "--view", "z", "--size", "16x12", "--quiet", *words)
        picture = files.read(self.folder / "c.png")[0].astype(float) / 255
        # Where the blocks are, whichever way the view is turned.
        return picture[..., 0].max(initial=0, where=picture[..., 1] == 0), picture[..., 1], picture

    def test_display_ranges_are_windows(self):
        for order in "<>":
            for words in ((), ("--mode", "mean")):
                red, green, picture = self.merged(order, (0, 1000, 0, 500), words=words)
                self.assertEqual((red, green.max()), (1, 1), (order, words))
                self.assertEqual((picture[..., 0] > .9).sum(), 17)  # the block and the hot pixel
            red, green, _ = self.merged(order, (0, 2000, 0, 1000))
            self.assertAlmostEqual(green.max(), 0.5, delta=0.5 / 255 + 1e-6)
        # What is asked for comes first; without ranges the hot pixel is white.
        self.assertAlmostEqual(self.merged("<", (0, 1, 0, 1), words=("--window", "0,5000"))[1].max(), 0.1, delta=0.5 / 255 + 1e-6)
        self.assertEqual((self.merged("<", None)[2][..., 0] > .1).sum(), 1)

    def test_display_ranges_are_of_stored_samples(self):
        # Shown from 31768 to 33768 as stored: from -1000 to 1000.
        line = "cf=0\nc0=-32768\nc1=1\nvunit=Gray Value\n"
        _, green, _ = self.merged("<", (32768, 33768, 32768, 33768), line, add=32768)
        self.assertAlmostEqual(green.max(), 0.5, delta=0.5 / 255 + 1e-6)

    def test_ranges_that_lie_do_no_harm(self):
        for ranges in ((5, 5, 7, 3), (float("nan"), 1, 0, float("inf"))):
            self.merged("<", ranges)


if __name__ == "__main__":
    unittest.main()
