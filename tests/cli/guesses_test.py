"""What is guessed is said, and what is known is not: orientation, values beyond the input, samples that are left out. Needs EDGEWISE."""

import json
import pathlib
import struct
import sys
import unittest

import files
import numpy as np
from running import Running

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "io"))
import dicom_writing as dw  # noqa: E402


def body(shape=(20, 24, 28), dtype="<i2"):
    """A ball of soft tissue with bone in air, in Hounsfield units with a little noise that is the same each time."""
    z, y, x = np.mgrid[tuple(slice(-1, 1, n * 1j) for n in shape)]
    r = np.sqrt(x * x + y * y + z * z)
    noise = (np.arange(r.size).reshape(r.shape) * 7919 % 31 - 15)
    return (np.where(r < .8, 40, -985) + np.where(r < .2, 700, 0) + noise).astype(dtype)


class Guesses(Running):
    def report(self, *words):
        done = self.run_it(*words, "--json", "-")
        report = json.loads(done.stdout)
        return report, " ".join(report["warnings"]), done.stderr.decode().strip().split("\n")[-1]

    def nifti(self, a, name="a.nii", anatomical=True, spacing=(1, 1, 1)):
        path = self.folder / name
        files.write_nifti(path, a, spacing=spacing)
        if anatomical:  # a qform of no turn
            data = bytearray(path.read_bytes())
            struct.pack_into("<h", data, 252, 1)
            path.write_bytes(bytes(data))
        return path

    # --- where the front is

    def test_a_side_of_what_does_not_say_how_it_lies_is_guessed(self):
        silent = self.nifti(body(), "silent.nii", anatomical=False)
        files.write_nrrd(self.folder / "silent.nrrd", body())
        for path in (silent, self.folder / "silent.nrrd"):
            for view in ("front", "back", "left", "right", "top", "bottom", "coronal", "Sagittal", "axial"):
                _, warnings, _ = self.report("render", path, "-o", "null:", "--view", view)
                self.assertIn(f"--view {view}", warnings)
                self.assertIn("--orient", warnings)
            self.assertIn("--orient", self.report("warp", path, "-o", "null:", "--view", "left")[1])

    def test_a_side_of_what_says_it_is_none(self):
        silent = self.nifti(body(), "silent.nii", anatomical=False)
        for words in ((self.nifti(body()), "--view", "front"), (silent, "--view", "front", "--orient", "RAS"), (silent, "--view", "x"),
                      (silent, "--view", "Z"), (silent,), ("phantom:sphere:16", "--view", "left")):
            self.assertNotIn("--orient", self.report("render", words[0], "-o", "null:", *words[1:])[1], words)

    def test_the_last_line_says_where_one_looks(self):
        silent = self.nifti(body(), "silent.nii", anatomical=False)
        self.assertIn("along z", self.report("render", silent, "-o", "null:")[2])
        for words in ((self.nifti(body()),), (silent, "--view", "z"), (silent, "--orient", "LPS")):
            self.assertNotIn("along z", self.report("render", words[0], "-o", "null:", *words[1:])[2], words)

    # --- what lies beyond the input

    def filled(self, path, *words, turn="0,0,20"):
        """What is said to fill a turned volume, after what a corner of it holds was compared with that."""
        out = self.folder / "filled.nrrd"
        report, warnings, last = self.report("warp", path, "-o", out, "--rotate", turn, *words)
        value = report["request"]["outside"]
        if value is not None:
            self.assertEqual(files.read(out)[10, 0, 0, 0], value)
            self.assertIn(f"{value:g} beyond the input", last)
        else:
            self.assertNotIn("beyond the input", last)
        return value

    def test_a_ct_is_filled_with_its_air(self):
        a = body()
        for dtype in ("<i2", "<f4"):
            path = self.nifti(a.astype(dtype))
            self.assertEqual(self.filled(path), a.min())
            self.assertEqual(self.filled(path, "--outside", "-5"), -5)
            self.assertEqual(self.filled(path, turn="0,10,30"), a.min())

    def test_padding_is_no_air(self):
        for padding in (-2000, -3024):
            a = body()
            a[:, :3] = padding
            a[:, -2:] = padding
            self.assertEqual(self.filled(self.nifti(a)), a[a > padding].min())

    def test_padding_that_dicom_names_is_no_air(self):
        for padding in (-1500, -1024, -1003):
            pixels = body((8, 12, 10))
            pixels[pixels == padding] += 1
            pixels[:, :2] = padding
            folder = self.folder / f"dicom{-padding}"
            folder.mkdir()
            for k, plane in enumerate(pixels):
                e = dw.picture(plane, position=(0, 0, k), number=k + 1, more={0x00280120: ("SS", padding)})
                (folder / f"{k}.dcm").write_bytes(dw.file_of(e))
            out = self.folder / "out.nrrd"
            report, _, _ = self.report("warp", folder, "-o", out, "--rotate", "0,0,20")
            self.assertEqual(report["request"]["outside"], pixels[pixels != padding].min())

    def test_a_ct_without_air_is_filled_with_its_least_value_where_dicom_says_what_it_is(self):
        pixels = (np.arange(8 * 8 * 8).reshape(8, 8, 8) % 100 + 7).astype("<i2")
        for modality, expected in (("CT", 7), ("MR", 0), ("PT", 0)):
            folder = self.folder / modality
            folder.mkdir()
            for k, plane in enumerate(pixels):
                (folder / f"{k}.dcm").write_bytes(dw.file_of(dw.picture(plane, modality=modality, position=(0, 0, k), number=k + 1)))
            self.assertEqual(self.report("warp", folder, "-o", self.folder / "out.nrrd", "--rotate", "0,0,20")[0]["request"]["outside"], expected)

    def test_all_else_is_filled_with_0(self):
        rng = np.random.default_rng(3)
        waves = rng.normal(0, 600, (16, 16, 16)).astype("<f4")  # seismic traces, velocities: values of both signs, air nowhere
        shifted = (body() + 1024).astype("<u2")
        for a in (waves, shifted, rng.integers(0, 255, (16, 16, 16)).astype("u1")):
            self.assertEqual(self.filled(self.nifti(a)), 0)
        self.assertEqual(self.filled(self.nifti(body()), "--labels"), 0)

    def test_where_nothing_is_filled_nothing_is_said(self):
        path = self.nifti(body())
        for words in ((), ("--rotate", "0,0,180"), ("--view", "left"), ("--size", "14x12x10"), ("--rotate", "90,0,0", "--size", "fit")):
            report, _, last = self.report("warp", path, "-o", self.folder / "out.nrrd", *words)
            self.assertIsNone(report["request"]["outside"], words)
            self.assertNotIn("beyond", last)

    def test_pictures_are_filled_too(self):
        files.write_png(self.folder / "a.png", np.full((12, 16, 1), 200, "u1"))
        report, _, last = self.report("warp", self.folder / "a.png", "-o", self.folder / "b.png", "--rotate", "10")
        self.assertEqual(report["request"]["outside"], 0)
        self.assertIn("0 beyond the input", last)
        _, warnings, _ = self.report("warp", self.folder / "a.png", "-o", self.folder / "b.png", "--rotate", "10", "--outside", "300")
        self.assertIn("255 is written", warnings)
        self.assertNotIn("is written", self.report("warp", self.folder / "a.png", "-o", self.folder / "b.png", "--rotate", "10", "--outside", "9")[1])

    # --- what is left out

    def test_reductions_are_told_once(self):
        path = self.nifti(body((40, 48, 56)))
        files.write_png(self.folder / "p.png", np.zeros((60, 80, 3), "u1"))
        for words, apart in ((("warp", path, "--size", "28"), 2), (("warp", path, "--scale", "0.5"), 2), (("warp", path, "--spacing", "1,1,2.5"), 2.5),
                             (("warp", self.folder / "p.png", "--size", "40"), 2), (("render", path, "--mode", "xray", "--size", "16"), 3.5),
                             (("render", path, "--mode", "composite", "--turntable", "3", "--size", "14"), None)):
            report, warnings, _ = self.report(words[0], words[1], "-o", "null:", *words[2:])
            self.assertEqual(warnings.count("of the input apart"), 1, words)
            if apart:
                self.assertIn(f" {apart:g} samples of the input apart", warnings)
            self.assertIn("gauss:", warnings)
            self.assertNotIn("antialias", warnings)
        self.assertNotIn("apart", self.report("render", "phantom:gaussians:24", "-o", "null:", "--mode", "xray", "--size", "12")[1])  # a formula
        # The brightest that no ray meets has a sentence of its own.
        _, warnings, _ = self.report("render", path, "-o", "null:", "--size", "14")
        self.assertIn("bright samples", warnings)
        self.assertNotIn("of the input apart", warnings)
        self.assertNotIn("gauss", self.report("warp", path, "-o", "null:", "--size", "14", "--labels")[1])

    def test_what_is_as_fine_is_not_told(self):
        thick = self.nifti(body((10, 40, 44)), "thick.nii", spacing=(.8, .8, 7))
        fine = self.nifti(body(), "fine.nii")
        for words in (("warp", thick, "--rotate", "10,20,5"), ("warp", fine, "--rotate", "45,45,45"), ("warp", fine, "--scale", "0.7"),
                      ("warp", fine, "--size", "56"), ("render", thick,), ("render", thick, "--view", "left"), ("render", fine, "--size", "20"),
                      ("render", fine, "--rotate", "30,40,50", "--mode", "composite")):
            self.assertNotIn("of the input apart", self.report(words[0], words[1], "-o", "null:", *words[2:])[1], words)

    # --- what a type cuts off

    def test_values_that_a_type_cuts_off_are_counted(self):
        a = (body((12, 12, 12)).astype(int) * 20).clip(-32768, 32767).astype("<i2")
        path = self.nifti(a)
        out = self.folder / "out.nrrd"
        _, warnings, _ = self.report("filter", path, "-o", out, "--op", "convolve", "--kernel", "laplace")
        self.assertIn("were cut off", warnings)
        self.assertIn("--bits 32", warnings)
        beyond = int(warnings.split(f" of {a.size} values")[0].split()[-1])
        padded = np.pad(a.astype(float), 1, mode="reflect")
        exact = sum(np.roll(padded, s, k) for k in range(3) for s in (1, -1)) - 6 * padded
        exact = exact[1:-1, 1:-1, 1:-1]
        self.assertEqual(beyond, np.sum((exact < -32768) | (exact > 32767)))
        _, warnings, _ = self.report("filter", path, "-o", out, "--op", "convolve", "--kernel", "laplace", "--bits", "32")
        self.assertNotIn("cut off", warnings)
        np.testing.assert_allclose(files.read(out)[..., 0], exact, atol=1e-5 * np.abs(exact).max())

    def test_derivatives_of_bytes_keep_their_sign(self):
        a = np.random.default_rng(5).integers(0, 256, (10, 10, 10)).astype("u1")
        for kernel in ("laplace", "sobel:x"):
            _, warnings, _ = self.report("filter", self.nifti(a), "-o", self.folder / "out.nrrd", "--op", "convolve", "--kernel", kernel)
            self.assertNotIn("cut off", warnings)
            self.assertLess(files.read(self.folder / "out.nrrd").min(), 0)


if __name__ == "__main__":
    unittest.main()
