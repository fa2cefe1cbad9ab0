"""`render --channel 0,1,2`: channels of a microscope in one picture, beside the same channels rendered one by one and put together in
numpy. Needs EDGEWISE."""

import json
import pathlib
import struct
import subprocess
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "io"))
import files
import format_writers as w
from running import COMMAND, Running

TURNED = ("--rotate", "10,20,0", "--size", "45x32", "--quiet")
SHAPE = (3, 7, 20, 26)  # channel, z, y, x
# As OME writes them: red, green, blue and opacity in a signed number.
ORANGE, TEAL, VIOLET = "ff8000", "008080", "8000ff"


def balls():
    c, z, y, x = np.indices(SHAPE).astype(float)
    r = (x - 8 - 5 * c) ** 2 + (y - 10) ** 2 + (2 * (z - 3)) ** 2
    return (500 * (c + 1) * np.exp(-r / 30) + 40 * c).round().astype("<u2")


def colour_number(digits):
    return struct.unpack(">i", bytes.fromhex(digits + "ff"))[0]


def ome(volume, colours):
    """XYZCT; colours: six digits each, or None."""
    channels = "".join(f'<Channel ID="Channel:0:{i}" SamplesPerPixel="1"' + (f' Color="{colour_number(c)}"' if c else "") + "/>"
                       for i, c in enumerate(colours))
    c, z, y, x = volume.shape
    pixels = f'DimensionOrder="XYZCT" Type="uint16" SizeX="{x}" SizeY="{y}" SizeZ="{z}" SizeC="{c}" SizeT="1" ' \
             'PhysicalSizeX="0.2" PhysicalSizeY="0.2" PhysicalSizeZ="0.5"'
    text = w.described(w.ome(pixels, channels=channels))
    return w.tiff([w.tiff_page(p, more=text if i == 0 else None) for i, p in enumerate(volume.reshape(-1, y, x))])


def imagej(volume, colours=(), order="<"):
    """Channels run fastest. colours: the brightest entry of each lookup table."""
    c, z, y, x = volume.shape
    more = w.described(f"ImageJ=1.53t\nimages={c * z}\nchannels={c}\nslices={z}\nhyperstack=true\nmode=composite\n")
    if colours:
        tables = [np.outer(list(bytes.fromhex(one)), np.arange(256) / 255).round().astype("u1").tobytes() for one in colours]
        labels = ["first".encode("utf-16"), b"second"]  # parts of another kind come first

        def kind(name, count):
            return (name if order == ">" else name[::-1]) + struct.pack(order + "I", count)
        head = (b"IJIJ" if order == ">" else b"JIJI") + kind(b"labl", len(labels)) + kind(b"luts", len(tables))
        parts = [head, *labels, *tables]
        more[50838] = (4, [len(part) for part in parts])
        more[50839] = (1, list(b"".join(parts)))
    pages = volume.swapaxes(0, 1).reshape(-1, y, x)
    return w.tiff([w.tiff_page(p, order=order, more=more if i == 0 else None) for i, p in enumerate(pages)], order=order)


def colours_of(digits):
    return np.array([list(bytes.fromhex(one)) for one in digits]) / 255


def merged(pictures, colours, windows=None):
    """Values [frame, y, x] of each channel."""
    total = 0
    for values, colour, window in zip(pictures, colours, windows or [None] * len(colours)):
        low, high = window or (values.min(), values.max())
        total = total + np.clip((values.astype(float) - low) / (high - low), 0, 1)[..., None] * colour
    return np.minimum(total, 1)


class Merge(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.volume = balls()
        cls.ome = cls.folder / "cells.ome.tif"
        cls.ome.write_bytes(ome(cls.volume, (ORANGE, TEAL, VIOLET)))

    def report(self, *words, code=0):
        return json.loads(self.run_it("render", *words, "--json", "-", code=code).stdout)

    def alone(self, source, *words, channels=range(3), frames=1):
        pictures = []
        for channel in channels:
            name = "alone_%d.nrrd" if frames > 1 else "alone.nrrd"
            self.run_it("render", source, "-o", self.folder / name, "--channel", channel, *words)
            pictures.append(np.stack([files.read(self.folder / (name % i if frames > 1 else name))[0, ..., 0] for i in range(frames)]))
        return pictures

    def expect_bytes(self, file, expected):
        """Half a step of rounding, and that numbers on the way are f32."""
        got = files.read(file)[0].astype(float)
        self.assertEqual(got.shape, expected.shape)
        self.assertLessEqual(np.abs(got - 255 * expected).max(), 0.5 + 1e-3)

    def colours(self, source, *words):
        return [channel["colour"] for channel in self.report(source, "-o", "null:", *words, *TURNED)["channels"]]

    def test_a_picture_is_the_sum_of_its_channels(self):
        own = colours_of((ORANGE, TEAL, VIOLET))
        for words in (("--mode", "mip"), ("--mode", "xray"), ("--mode", "minip", "--view", "y"), ("--mode", "composite")):
            with self.subTest(words):
                self.run_it("render", self.ome, "-o", self.folder / "a.png", "--channel", "0,1,2", *words, *TURNED)
                # A composite over black has three equal colours, from 0 to 1.
                windows = [(0, 1)] * 3 if "composite" in words else None
                self.expect_bytes(self.folder / "a.png", merged(self.alone(self.ome, *words, *TURNED), own, windows)[0])

    def test_formats_of_values_hold_the_colours(self):
        expected = merged(self.alone(self.ome, *TURNED), colours_of((ORANGE, TEAL, VIOLET)))[0]
        for ending in (".nrrd", ".tif", ".exr", ".mha"):
            file = self.folder / ("colours" + ending)
            self.run_it("render", self.ome, "-o", file, "--channel", "all", *TURNED)
            got = files.read(file)[0]
            self.assertEqual((got.dtype, got.shape[-1]), (np.dtype("<f4"), 3), ending)
            self.assertLessEqual(np.abs(got - expected).max(), 4 * 2.0 ** -24, ending)
        self.run_it("render", self.ome, "-o", self.folder / "wide.png", "--channel", "all", "--bits", "16", *TURNED)
        self.assertLessEqual(np.abs(files.read(self.folder / "wide.png")[0] - 65535 * expected).max(), 0.51)

    def test_frames_share_their_windows(self):
        words = ("--turntable", "4", *TURNED)
        expected = merged(self.alone(self.ome, *words, frames=4), colours_of((ORANGE, TEAL, VIOLET)))
        report = self.report(self.ome, "-o", self.folder / "f_%d.png", "--channel", "0,1,2", *words)
        self.assertEqual([pathlib.Path(file).name for file in report["outputs"]], [f"f_{i}.png" for i in range(4)])
        for i in range(4):
            self.expect_bytes(self.folder / f"f_{i}.png", expected[i])
        for name in ("a.gif", "a.apng"):
            self.assertEqual(self.report(self.ome, "-o", self.folder / name, "--channel", "0,1,2", *words)["outputs"], [str(self.folder / name)])
        self.run_it("render", self.ome, "-o", self.folder / "a.png", "--channel", "0,1,2", *words, code=2)
        self.run_it("render", self.ome, "-o", self.folder / "a_%d.png", "--channel", "0,1,2", *words, "--fps", "3", code=2)

    def test_a_window_is_each_channels(self):
        own = colours_of((ORANGE, TEAL, VIOLET))
        pictures = self.alone(self.ome, *TURNED)
        self.run_it("render", self.ome, "-o", self.folder / "a.png", "--channel", "0,1,2", "--window", "50,900", *TURNED)
        self.expect_bytes(self.folder / "a.png", merged(pictures, own, [(50, 900)] * 3)[0])
        report = self.report(self.ome, "-o", self.folder / "a.png", "--channel", "0,1,2", "--window", "2%,98%", *TURNED)
        windows = [channel["window"] for channel in report["channels"]]
        for values, window in zip(pictures, windows):
            # The rank below, to 2^-24 of the range.
            np.testing.assert_allclose(window, np.percentile(values, (2, 98), method="lower"), atol=1e-3)
        self.expect_bytes(self.folder / "a.png", merged(pictures, own, windows)[0])

    def test_colours(self):
        self.assertEqual(self.colours(self.ome, "--channel", "2,0"), ["#" + VIOLET, "#" + ORANGE])
        self.assertEqual(self.colours(self.ome, "--channel", "0=red,2=#00ff80,1"), ["#ff0000", "#00ff80", "#" + TEAL])
        self.assertEqual(self.colours(self.ome, "--channel", "1=GREY"), ["#ffffff"])
        for name, data in (("none.ome.tif", ome(self.volume, (None,) * 3)), ("white.ome.tif", ome(self.volume, ("ffffff",) * 3)),
                           ("plain.tif", imagej(self.volume))):
            (self.folder / name).write_bytes(data)
            self.assertEqual(self.colours(self.folder / name, "--channel", "all"), ["#ff0000", "#00ff00", "#0000ff"], name)
        (self.folder / "half.ome.tif").write_bytes(ome(self.volume, (ORANGE, None, "ffffff")))
        self.assertEqual(self.colours(self.folder / "half.ome.tif", "--channel", "all"), ["#" + ORANGE, "#00ff00", "#ffffff"])
        for order in "<>":
            file = self.folder / "tables.tif"
            file.write_bytes(imagej(self.volume, ("00ff00", "ff00ff", "000000"), order))
            self.assertEqual(self.colours(file, "--channel", "all"), ["#00ff00", "#ff00ff", "#0000ff"], "black is none")
        # Tables of a length that the file does not have, or that say nothing of parts: no colours, and no harm.
        whole = imagej(self.volume, ("00ff00", "ff00ff", "00ffff"))
        for cut in (b"stul", struct.pack("<I", 768)):
            file.write_bytes(whole.replace(cut, b"\xff\xff\xff\x7f"))
            done = subprocess.run([COMMAND, "render", file, "-o", "null:", "--channel", "all", *TURNED], env=self.env, capture_output=True, timeout=60)
            self.assertIn(done.returncode, (0, 4), done.stderr)

    def test_report(self):
        report = self.report(self.ome, "-o", self.folder / "a.png", "--channel", "0,2", "--max-error", "0.02", "--max-time", "20", "--verify=256",
                             "--repeat", "3", *TURNED)
        self.assertEqual(report["request"]["channels"], [0, 2])
        self.assertEqual(report["request"]["budget"], {"error": 0.02, "default": None, "seconds": 20, "bytes": None})
        channels = report["channels"]
        self.assertEqual([channel["channel"] for channel in channels], [0, 2])
        for channel in channels:
            self.assertLessEqual(channel["plan"]["predicted"]["error"], 0.02)
            self.assertEqual(len(channel["measured"]["seconds"]), 3)
            self.assertTrue(channel["front"])
        own, all_of_it = [channel["measured"] for channel in channels], report["measured"]
        np.testing.assert_allclose(all_of_it["seconds"], np.sum([one["seconds"] for one in own], axis=0))
        self.assertEqual(all_of_it["error"]["nrmse"], max(one["error"]["nrmse"] for one in own))
        self.assertEqual([step["transition"] for step in all_of_it["steps"]], [s["transition"] for one in own for s in one["steps"]])
        self.assertEqual(report["plan"]["steps"], [step for channel in channels for step in channel["plan"]["steps"]])
        self.assertTrue(report["plan"]["steps"])
        predicted = report["plan"]["predicted"]
        self.assertAlmostEqual(predicted["seconds"], sum(channel["plan"]["predicted"]["seconds"] for channel in channels))
        self.assertEqual(predicted["error"], max(channel["plan"]["predicted"]["error"] for channel in channels))
        self.assertEqual(report["outputs"], [str(self.folder / "a.png")])
        self.assertEqual(set(report["planning"]["parts"]), {"statistics", "preset", "preview", "search", "pilot"})
        self.assertAlmostEqual(report["planning"]["seconds"], sum(report["planning"]["parts"].values()))

    def test_a_plan_alone(self):
        done = self.run_it("plan", "render", self.ome, "--channel", "0,1", *TURNED)
        for text in (b"channel 0 in #" + ORANGE.encode(), b"channel 1 in #" + TEAL.encode(), b"plan\n"):
            self.assertIn(text, done.stdout)
        report = json.loads(self.run_it("plan", "render", self.ome, "--channel", "0,1", *TURNED, "--json", "-").stdout)
        self.assertNotIn("measured", report)
        self.assertEqual(len(report["channels"]), 2)

    def test_threads_do_not_change_the_bytes(self):
        written = []
        for threads in ("1", "2", "7"):
            self.run_it("render", self.ome, "-o", self.folder / "t.png", "--channel", "all", "--threads", threads, *TURNED)
            written.append((self.folder / "t.png").read_bytes())
        self.assertEqual(len(set(written)), 1)

    def test_budgets_of_the_whole(self):
        report = self.report(self.ome, "-o", self.folder / "none.png", "--channel", "0,1", "--max-time", "1us", "--minimize", "time", *TURNED, code=3)
        self.assertIn("channel 0", report["error"]["message"])
        self.assertTrue(report["error"]["nearest"])
        self.assertIsNone(report["plan"])
        self.assertFalse((self.folder / "none.png").exists())
        self.run_it("render", self.ome, "-o", self.folder / "none.png", "--channel", "0,1", "--max-memory", "2MiB", *TURNED, code=3)

    def test_refusals(self):
        def why(*words, verb="render", out=("-o", "null:")):
            return self.run_it(verb, self.ome, *out, *words, *TURNED, code=2).stderr.decode()
        self.assertIn("3 channels", why("--channel", "0,3"))
        self.assertIn("twice", why("--channel", "0,1,0"))
        self.assertIn("no colour", why("--channel", "0=rot"))
        self.assertIn("no colour", why("--channel", "0=#12345"))
        self.assertIn("--channel", why("--channel", "0,"))
        self.assertIn("--channel", why("--channel", "=red"))
        self.assertIn("--preset", why("--channel", "0,1", "--mode", "shaded"))
        self.assertIn("--background", why("--channel", "0,1", "--mode", "composite", "--background", "1,1,1"))
        self.assertIn("alpha", why("--channel", "0,1", "--mode", "composite", "--background", "none"))
        self.assertIn("--trace", why("--channel", "0,1", "--trace", self.folder / "t.json"))
        self.assertIn("--report", why("--channel", "0,1", "--report", self.folder / "t.html"))
        self.assertIn("--channel all", why())
        self.assertIn("render", self.run_it("warp", self.ome, "-o", "null:", "--channel", "0,1", code=2).stderr.decode())
        self.assertIn("render", self.run_it("info", self.ome, "--channel", "0=red", code=2).stderr.decode())
        image = self.folder / "flat.png"
        files.write_png(image, np.zeros((4, 5, 3), "u1"))
        self.assertIn("image", self.run_it("render", image, "-o", "null:", "--channel", "all", code=2).stderr.decode())

    def test_a_volume_of_colours_comes_out_in_its_own(self):
        colours = np.moveaxis(self.volume // 8, 0, -1).astype("u1")
        files.write_nrrd(self.folder / "rgb.nrrd", colours)
        words = ("--view", "z", "--size", "native", "--window", "0,255", "--quiet")
        self.run_it("render", self.folder / "rgb.nrrd", "-o", self.folder / "rgb.png", "--channel", "all", *words)
        np.testing.assert_array_equal(files.read(self.folder / "rgb.png")[0], colours.max(0))


if __name__ == "__main__":
    unittest.main()
