"""Windows as people say them, and those that pictures get unasked. Needs EDGEWISE and EDGEWISE_DATA."""

import pathlib
import sys
import unittest

import files
import numpy as np
from running import DATA, Running

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "io"))
import dicom_writing  # noqa: E402

NAMED = {"lung": (1500, -600), "bone": (1800, 400), "soft": (400, 40), "brain": (80, 40), "angio": (600, 300)}


def grey(values, black, white, bits=8):
    full = 2**bits - 1
    return np.rint(np.clip((np.asarray(values, float) - black) * full / (white - black), 0, full)).astype(int)


def radiograph(values, black, white):
    """By the depth of what took the light away."""
    depth = -np.log(values.astype(float))
    return np.clip(255 * (depth + np.log(black)) / (np.log(black) - np.log(white)), 0, 255)


def slab(values, name, folder, kind="<i2"):
    """One slice of these values."""
    a = np.asarray(values).astype(kind)
    files.write_nrrd(folder / name, a.reshape(1, *a.shape))
    return folder / name


class WindowWords(Running):
    def picture(self, source, *words, name="p.png", quiet=("--quiet",), view=("--view", "z")):
        done = self.run_it("render", source, "-o", self.folder / name, *view, *quiet, *words)
        self.said = done.stderr.decode()
        return files.read(self.folder / name)[0, ..., 0]

    def ct(self, shift=0, name="ct.nrrd"):
        """Air, water and what lies between and beyond, in every value."""
        values = np.concatenate((np.full(2400, -1000), np.arange(-1024, 2200), np.full(2400, 20))) + shift
        values = np.pad(values, (0, -len(values) % 80), constant_values=shift + 30).reshape(-1, 80)
        return slab(values, name, self.folder), values

    # --- as they are said

    def test_width_and_level(self):
        source, values = self.ct()
        size = ("--size", f"{values.shape[1]}x{values.shape[0]}")
        for word, black, white in (("W400L40", -160, 240), ("w400l40", -160, 240), ("L40W400", -160, 240), ("W1500L-600", -1350, 150),
                                   ("w80.5l-0.25", -40.5, 40), ("W1L0", -0.5, 0.5)):
            for bits in (8, 16):
                got = self.picture(source, *size, "--window", word, "--bits", bits)
                np.testing.assert_array_equal(got, grey(values, black, white, bits), word)
        values = np.linspace(-1, 3, 48).reshape(6, 8)
        source = slab(values, "f.nrrd", self.folder, "<f4")
        got = self.picture(source, "--size", "8x6", "--window", "W2L0.5")
        np.testing.assert_array_equal(got, grey(np.float32(values), -0.5, 1.5))

    def test_planes_of_warps_too(self):
        source, values = self.ct()
        self.run_it("warp", source, "-o", self.folder / "w.png", "--window", "soft", "--quiet")
        np.testing.assert_array_equal(files.read(self.folder / "w.png")[0, ..., 0], grey(values, -160, 240))

    def test_high_before_low_inverts(self):
        source, values = self.ct()
        size = ("--size", f"{values.shape[1]}x{values.shape[0]}")
        got = self.picture(source, *size, "--window", "240,-160")
        np.testing.assert_array_equal(got, grey(values, 240, -160))
        self.assertEqual((got[values < -200].min(), got[values > 300].max()), (255, 0))
        low, high = np.percentile(values, (10, 90))
        got = self.picture(source, *size, "--window", "90%,10%")
        self.assertLessEqual(np.abs(got - grey(values, high, low)).max(), 1)
        # A ramp that is turned round: what is low is white and hides.
        a = np.zeros((5, 6, 6)) + 100
        a[:, 2:4, 2:4] = 25
        files.write_nrrd(self.folder / "r.nrrd", a.astype("u1"))
        got = self.picture(self.folder / "r.nrrd", "--mode", "composite", "--window", "100,0", "--size", "6", "--max-error", "9", "--via",
                           "project.ray_cast/filter=foh/step=1", name="r2.nrrd")
        self.assertAlmostEqual(got[2, 2], 0.75 * (1 - (1 - 0.05 * 0.75) ** 5), delta=2e-4)
        self.assertEqual(got[0, 0], 0)

    def test_names(self):
        source, values = self.ct()
        size = ("--size", f"{values.shape[1]}x{values.shape[0]}")
        for name, (width, level) in NAMED.items():
            for word in (name, name.upper()):
                got = self.picture(source, *size, "--window", word, quiet=())
                np.testing.assert_array_equal(got, grey(values, level - width / 2, level + width / 2), name)
                self.assertNotIn("--window", self.said)
        help_text = self.run_it("render", "--help-all").stdout.decode()
        for name, (width, level) in NAMED.items():
            self.assertIn(f"{name} W{width}L{level}", " ".join(help_text.split()))

    def test_names_know_shifted_units(self):
        source, values = self.ct(1024, "shifted.nrrd")
        size = ("--size", f"{values.shape[1]}x{values.shape[0]}")
        got = self.picture(source, *size, "--window", "lung", quiet=())
        np.testing.assert_array_equal(got, grey(values - 1024, -1350, 150))
        self.assertIn("plus 1024", self.said)
        # Width and level are numbers of the file.
        np.testing.assert_array_equal(self.picture(source, *size, "--window", "W1500L-600"), grey(values, -1350, 150))

    def test_names_warn_of_other_data(self):
        for i, values in enumerate((np.arange(200), np.linspace(0, 4000, 200), np.arange(200) - 300)):
            source = slab(values.reshape(10, 20), f"o{i}.nrrd", self.folder)
            got = self.picture(source, "--size", "20x10", "--window", "soft", quiet=())
            self.assertIn("do not look like", self.said)
            np.testing.assert_array_equal(got, grey(values.astype("<i2").reshape(10, 20), -160, 240))

    def test_refusals(self):
        source, _ = self.ct()
        for words, part in ((("--window", "3,3"), "LO and HI"), (("--window", "W0L3"), "width"), (("--window", "W-4L3"), "width"), (("--window", "lungs"), "lung"),
                            (("--window", "W4"), "W400L40"), (("--window", "W4Lx"), "--window"), (("--window", "1,2,3"), "LO,HI"), (("--window", "nan,1"), "--window"),
                            (("--window", "lung", "--mode", "xray"), "--mode xray"), (("--window", "bone", "--mode", "drr"), "--mode drr"),
                            (("--window", "bone", "--mode", "surface", "--isovalue", "3"), "--mode surface"),
                            (("--window", "bone", "--mode", "composite", "--preset", "ct-bone"), "transfer function")):
            self.assertIn(part, self.run_it("render", source, "-o", "null:", *words, code=2).stderr.decode(), words)
        for mode in ("mip", "minip", "mean", "composite", "shaded"):
            self.run_it("render", source, "-o", "null:", "--mode", mode, "--window", "bone", "--quiet")

    # --- unasked

    def body(self):
        """A cylinder of water with a rod of bone, in air."""
        z, y, x = np.meshgrid(np.arange(30), np.arange(40) - 19.5, np.arange(48) - 23.5, indexing="ij")
        a = np.where(np.hypot(x / 20, y / 15) < 1, 0.0, -1000)
        a[(np.hypot(x - 5, y) < 3)] = 1200
        files.write_nrrd(self.folder / "body.nrrd", a.astype("<i2"))
        return self.folder / "body.nrrd", a

    def test_bone_is_white_on_a_radiograph(self):
        source, a = self.body()
        words = ("--mode", "drr", "--view", "y", "--size", "48x30", "--input-unit", "mm")
        values = self.picture(source, *words, view=(), name="d.nrrd")
        left = np.exp(-0.0206 * np.maximum(0, 1 + a / 1000).sum(1))
        np.testing.assert_allclose(values, left, atol=2e-3)
        black, white = np.percentile(values, (99.5, 1), method="lower")
        for name in ("d.png", "d.tif"):
            got = self.picture(source, *words, "--bits", "8", view=(), name=name)
            self.assertLessEqual(np.abs(got - radiograph(values, black, white)).max(), 1)
        self.assertGreater(got[15, 28], 250)
        self.assertLess(got[15, 0], 5)
        self.assertLess(got[15, 10], got[15, 28])
        self.assertTrue(np.array_equal(self.picture(source, *words, "--window", "99.5%,1%", view=()), self.picture(source, *words, view=())))
        # Two values that are given are linear, and not turned round.
        got = self.picture(source, *words, "--window", "0,1", view=())
        np.testing.assert_array_equal(got, grey(values, 0, 1))
        self.assertGreater(got[15, 0], 250)

    def test_films_of_radiographs_have_one_window(self):
        source, _ = self.body()
        words = ("--mode", "drr", "--view", "y", "--size", "40x30", "--turntable", "4", "--input-unit", "mm", "--quiet")
        for name in ("f_%d.png", "f_%d.nrrd"):
            self.run_it("render", source, "-o", self.folder / name, *words)
        values = np.stack([files.read(self.folder / f"f_{i}.nrrd")[0, ..., 0] for i in range(4)])
        black, white = np.percentile(values, (99.5, 1), method="lower")
        for i in range(4):
            got = files.read(self.folder / f"f_{i}.png")[0, ..., 0]
            self.assertLessEqual(np.abs(got - radiograph(values[i], black, white)).max(), 1)

    def test_mips_of_an_mr_go_by_percentiles(self):
        source = DATA / "mr_brain" / "MR.nii.gz"
        words = ("--size", "160")
        values = self.picture(source, *words, view=(), name="m.nrrd")
        got = self.picture(source, *words, view=())
        black, white = np.percentile(values, (1, 99.9), method="lower")
        self.assertLessEqual(np.abs(got - np.clip(255 * (values - black) / (white - black), 0, 255)).max(), 1)
        self.assertTrue(np.array_equal(self.picture(source, *words, "--window", "1%,99.9%", view=()), got))
        # Others go by their range: of another mode, and what is no MR.
        for what, more in ((source, ("--mode", "mean")), (source, ("--mode", "xray")), (DATA / "ct_chest" / "chest.nrrd", ()), (self.body()[0], ())):
            values = self.picture(what, *words, *more, view=(), name="m.nrrd")
            got = self.picture(what, *words, *more, view=())
            self.assertLessEqual(np.abs(got - np.clip(255 * (values - values.min()) / (values.max() - values.min()), 0, 255)).max(), 0.51, (what, more))

    def test_dicom_says_what_is_an_mr(self):
        z, y, x = np.meshgrid(*[np.arange(12)] * 3, indexing="ij")
        a = (1000 * np.exp(-((x - 4) ** 2 + (y - 6) ** 2 + (z - 5) ** 2) / 20)).astype("<u2")
        a[3, 3, 3] = 4000
        for kind, percentiles in (("MR", True), ("CT", False)):
            folder = self.folder / f"series_{kind}"
            folder.mkdir()
            for k, pixels in enumerate(a):
                elements = dicom_writing.picture(pixels, kind=kind, position=(0, 0, k), number=k + 1)
                elements[0x00080018] = ("UI", f"1.2.9.{k + 1}")
                (folder / f"i{k:02}.dcm").write_bytes(dicom_writing.file_of(elements, dicom_writing.EXPLICIT))
            values = self.picture(folder, "--size", "24", view=(), name="m.nrrd")
            got = self.picture(folder, "--size", "24", view=())
            black, white = np.percentile(values, (1, 99.9) if percentiles else (0, 100), method="lower")
            self.assertLessEqual(np.abs(got - np.clip(255 * (values - black) / (white - black), 0, 255)).max(), 1, kind)
            self.assertEqual(white < values.max(), percentiles)

    def test_values_stay_values(self):
        source, _ = self.body()
        for mode in ("mip", "drr", "mean"):
            self.picture(source, "--mode", mode, name="plain.nrrd")
            for window in ("240,-160", "W400L40", "99%,3%"):
                self.picture(source, "--mode", mode, "--window", window, name="w.nrrd")
                self.assertEqual((self.folder / "w.nrrd").read_bytes(), (self.folder / "plain.nrrd").read_bytes(), (mode, window))


if __name__ == "__main__":
    unittest.main()
