"""`edgewise radon` beside numpy: integrals along lines, Hough votes, their files, what is refused. Needs EDGEWISE."""

import json
import math
import subprocess
import unittest

import files
import numpy as np
from running import COMMAND, Running

SUMS = ["radon.backward", "radon.forward", "radon.fourier"]
COUNTS = ["hough.forward", "hough.backward"]


def direction(k, angles):
    """Cosine and sine of pi k / angles, as the command has them: from the nearest axis."""
    def turned(share):
        return (math.sqrt(0.5),) * 2 if share == 0.25 else (math.cos(math.pi * share), math.sin(math.pi * share))
    if 4 * k <= angles:
        return turned(k / angles)
    if 4 * k <= 3 * angles:
        left = angles - 2 * k
        c, s = turned(abs(left) / (2 * angles))
        return (-s if left < 0 else s), c
    c, s = turned((angles - k) / angles)
    return -c, s


def offsets_of(shape, spacing=(1, 1)):
    wide, high = (shape[1] + 1) * spacing[0], (shape[0] + 1) * spacing[1]
    return 2 * math.ceil(math.sqrt(wide * wide + high * high) / (2 * min(spacing))) + 1


def sinogram(a, angles, steps=32):
    """Integrals of the bilinear field by so many samples a step: rows of the image turned."""
    ny, nx = a.shape
    padded = np.pad(a.astype("f8"), 1)
    half = (offsets_of(a.shape) - 1) // 2
    t = (np.arange(-half * steps, half * steps) + 0.5) / steps
    rows = []
    for k in range(angles):
        c, s = direction(k, angles)
        r = np.arange(-half, half + 1)[:, None]
        x, y = r * c + t * s + (nx - 1) / 2, -r * s + t * c + (ny - 1) / 2
        x, y = np.clip(x, -1, nx - 1e-12), np.clip(y, -1, ny - 1e-12)
        i, j = np.floor(x).astype(int), np.floor(y).astype(int)
        u, v = x - i, y - j
        i, j = i + 1, j + 1
        i, j = np.minimum(i, nx), np.minimum(j, ny)
        f = (1 - v) * ((1 - u) * padded[j, i] + u * padded[j, i + 1]) + v * ((1 - u) * padded[j + 1, i] + u * padded[j + 1, i + 1])
        rows.append(f.sum(1) / steps)
    return np.array(rows)


def votes(a, angles, threshold):
    ny, nx = a.shape
    n = offsets_of(a.shape)
    y, x = np.nonzero(a.astype("f4") >= np.float32(threshold))
    rows = []
    for k in range(angles):
        c, s = direction(k, angles)
        place = (x - 0.5 * (nx - 1)) * c + (y - 0.5 * (ny - 1)) * -s + ((n - 1) // 2 + 0.5)
        rows.append(np.bincount(np.floor(place).astype(int), minlength=n))
    return np.array(rows)


class Radon(Running):
    def setUp(self):
        super().setUp()
        self.random = np.random.default_rng(7)
        self.source, self.out = self.folder / "in.nrrd", self.folder / "out.nrrd"

    def write(self, a):
        files.write_nrrd(self.source, a[None] if a.ndim == 2 else a, image=a.ndim == 2)

    def radon(self, a, *words):
        self.write(a)
        done = self.run_it("radon", self.source, "-o", self.out, "--quiet", "--explain", "--json", "-", *words)
        got = files.read(self.out)[..., 0]
        return (got[0] if a.ndim == 2 else got), json.loads(done.stdout)

    def test_integrals(self):
        # Midpoints of steps h are off where the slope jumps, twice a sample at most: by h^2 / 8 of a jump of 400.
        for shape, dtype in (((23, 31), "u1"), ((1, 1), "u1"), ((1, 9), "<i2"), ((16, 2), "<f4")):
            a = self.random.integers(0, 200, shape).astype(dtype)
            want = sinogram(a, 10)
            for edge in SUMS:
                got, report = self.radon(a, "--angles", 10, "--via", edge)
                self.assertEqual(got.shape, (10, offsets_of(shape)))
                said = report["plan"]["predicted"]["error"] * max(1, np.ptp(a.astype("f8"))) * math.hypot(shape[0] + 1, shape[1] + 1)
                off = np.sqrt(np.mean((got - want) ** 2))
                self.assertLessEqual(off, said + 2 * math.hypot(*shape) * 400 / 8 / 32**2, (edge, shape))

    def test_votes(self):
        for shape in ((23, 31), (40, 40), (1, 9)):
            a = self.random.integers(0, 200, shape).astype("u1")
            for angles in (4, 45):
                for edge in COUNTS:
                    got, report = self.radon(a, "--angles", angles, "--to", "hough", "--threshold", 120, "--via", edge)
                    np.testing.assert_array_equal(got, votes(a, angles, 120), err_msg=f"{shape} {angles} {edge}")
                    self.assertEqual(report["plan"]["predicted"]["error"], 0)

    def test_the_report_and_the_file_say_what_was_made(self):
        a = self.random.integers(0, 200, (20, 30)).astype("u1")
        got, report = self.radon(a, "--angles", 36)
        request = report["request"]
        self.assertEqual((request["job"], request["angles"], request["to"]), ("radon", 36, "sinogram"))
        self.assertNotIn("threshold", request)
        self.assertEqual(report["outputs"], [str(self.out)])
        # By default equal but for rounding: no transform.
        self.assertNotIn("fourier", json.dumps(report["plan"]["steps"]))
        header = self.out.read_bytes().split(b"\n\n")[0].decode()
        self.assertIn("type: float", header)
        _, report = self.radon(a, "--angles", 36, "--to", "hough", "--threshold", 50)
        self.assertEqual((report["request"]["to"], report["request"]["threshold"]), ("hough", 50))
        # A budget lets the transform serve.
        _, report = self.radon(self.random.integers(0, 200, (300, 300)).astype("u1"), "--angles", 180, "--max-error", "1%")
        self.assertEqual(report["plan"]["steps"][-1]["transition"], SUMS[2])

    def test_slices_of_a_volume_are_images(self):
        a = self.random.integers(0, 200, (3, 9, 14)).astype("<f4")
        got, _ = self.radon(a, "--angles", 7)
        for z in range(3):
            alone, _ = self.radon(a[z], "--angles", 7)
            np.testing.assert_array_equal(got[z], alone)

    def test_lengths_are_in_the_file_s_unit(self):
        a = self.random.integers(0, 200, (12, 15)).astype("<f4")
        plain, _ = self.radon(a, "--angles", 9)
        half, _ = self.radon(a, "--angles", 9, "--input-spacing", "0.5")
        np.testing.assert_array_equal(half, 0.5 * plain)

    def test_threads_and_pictures(self):
        a = self.random.integers(0, 200, (50, 40)).astype("u1")
        for words in (["--angles", 20, "--via", SUMS[2]], ["--angles", 20, "--to", "hough", "--threshold", 99]):
            one, _ = self.radon(a, *words, "--threads", 1)
            four, _ = self.radon(a, *words, "--threads", 4)
            np.testing.assert_array_equal(one, four)
        picture = self.folder / "sinogram.png"
        self.run_it("radon", self.source, "-o", picture, "--angles", 20, "--quiet")
        got = files.read(picture)
        self.assertEqual(got.shape, (1, 20, offsets_of(a.shape), 1))
        self.assertEqual((got.min(), got.max()), (0, 255))

    def test_what_is_not_finite(self):
        a = np.ones((9, 11), "<f4")
        a[4, 5] = np.nan
        got, _ = self.radon(a, "--angles", 6)
        self.assertTrue(np.isnan(got).any(1).all())
        self.assertTrue(np.isfinite(got).any(1).all())
        got, _ = self.radon(a, "--angles", 6, "--to", "hough", "--threshold", 1)
        np.testing.assert_array_equal(got.sum(1), 98)
        self.run_it("radon", self.source, "-o", self.out, "--angles", 6, "--via", SUMS[2], code=3)

    def test_plans_and_graphs(self):
        words = ["radon", "describe:512x512:u8", "--angles", 180]
        report = json.loads(self.run_it("plan", *words, "--json", "-").stdout)
        self.assertEqual(report["request"]["job"], "radon")
        self.assertIn("hough", self.run_it("graph", *words).stdout.decode())

    def test_verified_by_what_shares_no_code(self):
        for shape, dtype in (((33, 41), "<f4"), ((3, 9, 14), "u1"), ((1, 9), "<i2")):
            a = self.random.integers(0, 200, shape).astype(dtype)
            self.write(a)
            for edge in SUMS + COUNTS:
                hough = ["--to", "hough", "--threshold", 90] if edge in COUNTS else []
                done = self.run_it("radon", self.source, "-o", "null:", "--angles", 18, "--quiet", "--json", "-", "--verify=all", "--via", edge, *hough)
                report = json.loads(done.stdout)
                error, predicted = report["measured"]["error"], report["plan"]["predicted"]["error"]
                self.assertEqual(error["samples"], 18 * offsets_of(shape[-2:]) * (shape[0] if len(shape) > 2 else 1))
                self.assertLessEqual(error["nrmse"], predicted, (edge, shape))
                if edge in COUNTS:
                    self.assertEqual((error["nrmse"], error["max"]), (0, 0))

    def test_verifying_sees_what_is_approximate(self):
        """Of noise a transform that is cut early is off by more than rounding, and by less than it says; a budget in between is broken."""
        a = self.random.integers(0, 2, (96, 96)).astype("u1") * 255
        self.write(a)
        words = ["radon", self.source, "-o", "null:", "--angles", 60, "--quiet", "--json", "-", "--verify=all", "--via", "radon.fourier/cut=0.01"]
        report = json.loads(self.run_it(*words, "--max-error", "1%").stdout)
        error, predicted = report["measured"]["error"]["nrmse"], report["plan"]["predicted"]["error"]
        self.assertGreater(error, 1e-6)
        self.assertLess(error, predicted)
        # The same by numpy: the largest difference times the diagonal counts as 1.
        self.run_it(*[self.out if w == "null:" else w for w in words], "--max-error", "1%")
        got = files.read(self.out)[0, ..., 0]
        off = np.sqrt(np.mean((got - sinogram(a, 60)) ** 2)) / (255 * math.hypot(97, 97))
        # Midpoints of numpy's sum are off themselves, see test_integrals.
        self.assertLess(abs(off - error), 2 * 400 / 8 / 32**2 / 255)

    def test_samples_are_drawn_and_a_page_is_made(self):
        a = self.random.integers(0, 200, (90, 120)).astype("u1")
        self.write(a)
        done = self.run_it("radon", self.source, "-o", "null:", "--angles", 100, "--quiet", "--json", "-", "--verify=500")
        error = json.loads(done.stdout)["measured"]["error"]
        self.assertLess(error["samples"], 100 * offsets_of(a.shape))
        self.assertLess(error["nrmse"], 1e-7)
        page = self.folder / "r.html"
        self.run_it("radon", self.source, "-o", "null:", "--angles", 30, "--quiet", "--report", page)
        text = page.read_text()
        self.assertIn("grid line", text)
        # An error of 1 is that of --verify.
        self.assertIn(f"of the range {np.ptp(a.astype('f8')) * math.hypot(91, 121):.4g},", text)

    def test_hostile_words(self):
        a = self.random.integers(0, 200, (8, 9)).astype("u1")
        self.write(a)
        self.out.unlink(missing_ok=True)
        for words, said in (([], "--angles"), (["--angles", 0], "--angles"), (["--angles", "1e9"], "--angles"), (["--angles", "many"], "--angles"),
                            (["--angles", 3, "--to", "houhg"], "hough"), (["--angles", 3, "--to", "hough"], "--threshold"),
                            (["--angles", 3, "--threshold", 4], "hough"), (["--angles", 3, "--to", "hough", "--threshold", "nan"], "--threshold")):
            done = self.run_it("radon", self.source, "-o", self.out, "--quiet", *words, code=2)
            self.assertIn(said, done.stderr.decode(), words)
            self.assertFalse(self.out.exists())
        files.write_png(self.folder / "rgb.png", self.random.integers(0, 255, (8, 9, 3)).astype("u1"))
        done = subprocess.run([COMMAND, "radon", self.folder / "rgb.png", "-o", self.out, "--angles", "3"], capture_output=True, env=self.env)
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"--channel", done.stderr)
        self.run_it("radon", self.folder / "rgb.png", "-o", self.out, "--angles", 3, "--channel", 1, "--quiet")


if __name__ == "__main__":
    unittest.main()
