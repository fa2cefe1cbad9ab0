"""Legends with the unit of the values, montages whose gaps look as nothing does, planes that are verified. Needs EDGEWISE."""

import json
import pathlib
import re
import sys
import unittest

import numpy as np

root = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(root / "io"), str(root / "cli")]
import dicom_writing as dw  # noqa: E402
import files  # noqa: E402
import format_writers as w  # noqa: E402
from running import Running  # noqa: E402

GAP = 2


class Sheets(Running):
    def picture(self, *words):
        out = self.folder / "p.png"
        self.run_it(*words, "-o", out, "--quiet")
        return files.read_png(out.read_bytes())[0]

    def value_unit(self, path):
        return json.loads(self.run_it("info", path, "--json", "-").stdout)["value_unit"]


class Legends(Sheets):
    def dicom(self, name, modality="CT", kind="CT", more=None):
        folder = self.folder / name
        folder.mkdir()
        pixels = (np.arange(6 * 40 * 50) % 900).reshape(6, 40, 50).astype("<i2")
        for k, slice_ in enumerate(pixels):
            elements = dw.picture(slice_, kind, modality, (0, 0, 2 * k), number=k + 1, more=more)
            (folder / f"{k}.dcm").write_bytes(dw.file_of(elements))
        return folder

    def has_words(self, path, *words):
        """Whether letters stand above the strip of colours."""
        plain = self.picture(*words[:1], path, *words[1:], "--colormap", "jet")
        strip = self.picture(*words[:1], path, *words[1:], "--colormap", "jet", "--legend")[:, plain.shape[1]:].astype(int)
        coloured = (strip.max(axis=-1) - strip.min(axis=-1)) > 60
        columns = np.flatnonzero(coloured.sum(axis=0) > strip.shape[0] // 3)
        top = np.flatnonzero(coloured[:, columns].any(axis=1))[0]
        return bool((strip[:top, columns] > 100).any())

    def test_dicom(self):
        rescale = {0x00281052: ("DS", -24), 0x00281053: ("DS", 1)}
        for name, more, unit, how in (("ct", rescale, "HU", {}), ("hu", {**rescale, 0x00281054: ("LO", "HU")}, "HU", {}),
                                      ("us", {**rescale, 0x00281054: ("LO", "US")}, None, {}), ("mr", rescale, None, {"modality": "MR"}),
                                      ("pet", {**rescale, 0x00541001: ("CS", "BQML")}, "Bq/ml", {"modality": "PT", "kind": "PET"})):
            path = self.dicom(name, more=more, **how)
            self.assertEqual(self.value_unit(path), unit, name)
            shown = (("render", "--size", "200"), ("render", "--mode", "mean", "--size", "200"), ("warp", "--montage", "1x1", "--scale", "4", "--size", "fit"))
            for words in shown if name in ("ct", "mr") else shown[:1]:
                self.assertEqual(self.has_words(path, *words), unit is not None, (name, words))
        self.assertIn(" HU, mean", self.run_it("info", self.folder / "ct").stdout.decode())
        # Of an integral the unit is another, and of a share of light none.
        self.assertTrue(self.has_words(self.folder / "ct", "render", "--mode", "xray", "--size", "200"))
        self.assertFalse(self.has_words(self.folder / "ct", "render", "--mode", "drr", "--size", "200"))

    def test_others(self):
        volume = (np.arange(5 * 30 * 40) % 701).reshape(5, 30, 40).astype("<i2")
        head = "NRRD0004\ntype: int16\ndimension: 3\nsizes: 40 30 5\nendian: little\nencoding: raw\n"
        for name, line, unit in (("a", "", None), ("b", 'sample units: "kPa"\n', "kPa"), ("c", "sample units: HU\n", "HU"), ("d", "sampleunits: mg/ml\n", "mg/ml"),
                                 ("e", "sample units: " + "x" * 40 + "\n", None), ("f", "sample units: a\tb\n", None)):
            path = self.folder / f"{name}.nrrd"
            path.write_bytes((head + line + "\n").encode() + volume.tobytes())
            self.assertEqual(self.value_unit(path), unit, name)
            self.assertEqual(self.has_words(path, "render", "--view", "z", "--size", "200"), unit is not None, name)
        for name, text, unit in (("g", "cf=0\nc0=-7\nc1=0.5\nvunit=OD\n", "OD"), ("h", "cf=0\nc0=-7\nc1=0.5\nvunit=Gray Value\n", None), ("i", "", None)):
            path = self.folder / f"{name}.tif"
            tags = w.described("ImageJ=1.54f\nimages=5\nslices=5\n" + text)
            path.write_bytes(w.tiff([w.tiff_page(p.astype("u2"), more=tags if k == 0 else None) for k, p in enumerate(volume)]))
            self.assertEqual(self.value_unit(path), unit, name)


class Montages(Sheets):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        z, y, x = np.mgrid[0:14, 0:16, 0:18]
        ball = np.hypot(np.hypot(x - 8.5, y - 7.5), z - 6.5) < 5
        cls.ball = cls.folder / "ball.nrrd"
        files.write_nrrd(cls.ball, (40 + 160 * ball).astype("u1"))

    def check(self, sheet, columns, rows, count, colour):
        """Gaps, and places without a picture, all of one colour."""
        high, wide = (sheet.shape[0] + GAP) // rows - GAP, (sheet.shape[1] + GAP) // columns - GAP
        around = np.ones(sheet.shape[:2], bool)
        for i in range(count):
            y, x = (i // columns) * (high + GAP), (i % columns) * (wide + GAP)
            around[y:y + high, x:x + wide] = False
        self.assertTrue(around.any())
        np.testing.assert_array_equal(np.unique(sheet[around], axis=0), [colour])

    def frames(self, *words):
        return self.picture("render", self.ball, "--turntable", "5", "--size", "24", "--montage", "3x2", *words)

    def test_backgrounds(self):
        for background, colour in (("1,1,1", (255, 255, 255)), ("0,0,0", (0, 0, 0)), ("0.2,0.4,1", (51, 102, 255))):
            for mode in (("--mode", "shaded"), ("--mode", "surface", "--isovalue", "100")):
                self.check(self.frames(*mode, "--background", background), 3, 2, 5, colour)
        # What has no background is transparent.
        self.check(self.frames("--mode", "composite", "--background", "none"), 3, 2, 5, (0, 0, 0, 0))

    def test_values_look_as_rays_that_miss(self):
        for words in (("--mode", "mip"), ("--mode", "mip", "--window", "200,40"), ("--mode", "minip"), ("--mode", "xray"), ("--mode", "drr"),
                      ("--mode", "mean", "--window", "0,200"), ("--mode", "mip", "--colormap", "viridis"), ("--mode", "xray", "--colormap", "jet", "--window", "20000,0")):
            alone = self.picture("render", self.ball, "--turntable", "5", "--size", "24", "--perspective", "40", "--montage", "3x2", *words)
            # Its corners are beyond the volume in perspective: rays miss.
            self.check(alone, 3, 2, 5, alone[0, 0])
        white = self.frames("--mode", "mip", "--window", "200,40")
        self.check(white, 3, 2, 5, (255,))

    def test_slices(self):
        self.check(self.picture("warp", self.ball, "--montage", "4x4", "--window", "40,200"), 4, 4, 14, (0,))
        self.check(self.picture("warp", self.ball, "--montage", "4x4", "--window", "200,40"), 4, 4, 14, (255,))
        self.check(self.picture("warp", self.ball, "--montage", "4x4", "--window", "40,200", "--colormap", "viridis"), 4, 4, 14, (68, 1, 84))
        self.check(self.picture("warp", self.ball, "--montage", "4x4"), 4, 4, 14, (0,))

    def test_planes(self):
        def planes(*words):
            sheet = self.picture("render", self.ball, "--mpr", "8,7,6", "--size", "native", *words)
            return [tuple(part) for part in (sheet[0, 18], sheet[14, 0], sheet[-1, -1])]
        self.assertEqual(planes("--window", "0,255"), [(0,)] * 3)
        self.assertEqual(planes("--window", "255,0"), [(255,)] * 3)
        self.assertEqual(planes("--window", "0,255", "--colormap", "viridis"), [(68, 1, 84)] * 3)


class Planes(Sheets):
    def test_verify(self):
        random = np.random.default_rng(3)
        for dtype, extent in (("u1", (9, 11, 13)), ("<i2", (20, 8, 10)), ("<f4", (7, 15, 9))):
            path = self.folder / f"planes{dtype[-2:]}.nrrd"
            files.write_nrrd(path, random.integers(0, 200, extent).astype(dtype))
            place = ",".join(str(n // 2) for n in extent[::-1])
            # Planes of samples as they are: exact. Finer ones of linear samples are not.
            for words, exact in ((("--size", "native"), True), (("--size", "61"), False)):
                done = self.run_it("render", path, "-o", self.folder / "p.png", "--mpr", place, "--verify", *words)
                said = re.findall(r"^plane ([xyz])\nmeasured: .*, error ([\d.e+-]+)", done.stdout.decode(), re.M)
                self.assertEqual([plane for plane, _ in said], ["y", "x", "z"])
                for _, error in said:
                    self.assertEqual(float(error) < 1e-12, exact, said)  # 1e-12: places are in f64
                report = json.loads(self.run_it("render", path, "-o", self.folder / "p.png", "--mpr", place, "--verify", "--json", "-", *words).stdout)
                for plane, (_, error) in zip(report["planes"], said):
                    self.assertAlmostEqual(plane["measured"]["error"]["nrmse"], float(error), delta=0.01 * float(error))
                    self.assertTrue(plane["plan"]["steps"] is not None)

    def test_explain(self):
        path = self.folder / "e.nrrd"
        files.write_nrrd(path, np.random.default_rng(4).integers(0, 99, (9, 11, 13)).astype("u1"))
        text = self.run_it("render", path, "-o", self.folder / "p.png", "--mpr", "6,5,4", "--size", "40", "--explain").stdout.decode()
        for plane in "yxz":
            self.assertIn(f"plane {plane}\n", text)
        self.assertEqual(len(re.findall(r"^plan$", text, re.M)), 3)
        self.assertEqual(len(re.findall(r"^measured: ", text, re.M)), 3)

    def test_what_is_about_one_plan_is_refused_by_name(self):
        path = self.folder / "r.nrrd"
        files.write_nrrd(path, np.zeros((3, 4, 5), "u1"))
        for option in ("--report", "--trace", "--flow"):
            said = self.run_it("render", path, "-o", self.folder / "p.png", "--mpr", "1,1,1", option, self.folder / "r.html", code=2).stderr.decode()
            self.assertIn(f"{option}: is about one plan, and --mpr has three; --json has all of them", said)


if __name__ == "__main__":
    unittest.main()
