"""`edgewise filter` beside scipy: every operation, kernel, border and type, on images and volumes. Needs EDGEWISE."""

import json
import subprocess
import unittest

import files
import numpy as np
from running import COMMAND, Running
from scipy import ndimage

BORDERS = {"zero": dict(mode="constant", cval=0), "clamp": dict(mode="nearest"), "mirror": dict(mode="mirror"), "wrap": dict(mode="wrap")}
TYPES = ["u1", "<i2", "<f4"]
EDGES = ["backward", "forward", "separable", "running", "recursive", "fourier", "runs", "van_herk", "median", "median_histogram"]


def ball(radius, axes):
    r = int(np.floor(radius))
    places = np.meshgrid(*[np.arange(-r, r + 1)] * axes, indexing="ij")
    return sum(p**2 for p in places) <= radius**2


def cross(radius, axes):
    r = int(np.floor(radius))
    places = np.meshgrid(*[np.arange(-r, r + 1)] * axes, indexing="ij")
    return sum((p != 0).astype(int) for p in places) <= 1


class Filter(Running):
    def setUp(self):
        super().setUp()
        self.random = np.random.default_rng(11)

    def data(self, shape, dtype):
        a = self.random.integers(0, 200, shape)
        return (a / 7).astype(dtype) if np.dtype(dtype).kind == "f" else a.astype(dtype)

    def filter(self, a, *words, code=0):
        """An array of two axes is an image, one of three a volume."""
        source, out = self.folder / "in.nrrd", self.folder / "out.nrrd"
        out.unlink(missing_ok=True)
        files.write_nrrd(source, a[None] if a.ndim == 2 else a, image=a.ndim == 2)
        done = self.run_it("filter", source, "-o", out, "--quiet", *words, code=code)
        return done.stderr.decode() if code else files.read(out).reshape(a.shape)

    def close_to(self, got, want, a, what):
        if np.dtype(a.dtype).kind == "f":
            np.testing.assert_allclose(got, want, rtol=1e-5, atol=1e-5 * max(1, np.abs(want).max()), err_msg=str(what))
        else:
            limits = np.iinfo(got.dtype)  # of derivatives a signed type
            np.testing.assert_array_equal(got, np.clip(np.rint(want), limits.min, limits.max).astype(got.dtype), err_msg=str(what))

    def test_sums(self):
        for axes, shape in ((2, (23, 31)), (3, (9, 11, 14))):
            kernels = {"box:2": np.full((5,) * axes, 1 / 5**axes), "sphere:2": ball(2, axes) / ball(2, axes).sum(), "cross:3": cross(3, axes) / cross(3, axes).sum(), "laplace": None}
            for number, (border, keys) in enumerate(BORDERS.items()):
                for dtype in TYPES[number % 3], TYPES[(number + 1) % 3]:
                    a = self.data(shape, dtype)
                    for name, kernel in kernels.items():
                        wide = a.astype("f8")
                        want = ndimage.laplace(wide, **keys) if kernel is None else ndimage.convolve(wide, kernel, **keys)
                        got = self.filter(a, "--op", "convolve", "--kernel", name, "--border", border)
                        self.close_to(got, want, a, (name, border, dtype, axes))
                    for axis, letter in ((axes - 1, "x"), (axes - 2, "y")):
                        if dtype == "u1":
                            continue
                        want = ndimage.sobel(a.astype("f8"), axis=axis, **keys)
                        self.close_to(self.filter(a, "--op", "correlate", "--kernel", f"sobel:{letter}", "--border", border), want, a, (letter, border, dtype))

    def test_gauss_as_scipy(self):
        for sigma in (0.7, 2, 3.3):
            a = self.data((40, 50), "<f4")
            got = self.filter(a, "--op", "convolve", "--kernel", f"gauss:{sigma}")
            self.close_to(got, ndimage.gaussian_filter(a.astype("f8"), sigma, mode="mirror"), a, sigma)
            b = self.data((12, 13, 20), "u1")
            got = self.filter(b, "--op", "convolve", "--kernel", f"gauss:{sigma}")
            self.close_to(got, ndimage.gaussian_filter(b.astype("f8"), sigma, mode="mirror"), b, sigma)

    def test_orders(self):
        functions = {"dilate": ndimage.grey_dilation, "erode": ndimage.grey_erosion, "open": ndimage.grey_opening, "close": ndimage.grey_closing, "tophat": ndimage.white_tophat}
        for axes, shape in ((2, (33, 47)), (3, (9, 10, 15))):
            footprints = {"box:2": np.ones((5,) * axes, bool), "sphere:3": ball(3, axes), "cross:2": cross(2, axes)}
            for border, keys in BORDERS.items():
                for number, (name, footprint) in enumerate(footprints.items()):
                    dtype = TYPES[(number + axes + len(border)) % 3]
                    a = self.data(shape, dtype)
                    for op, function in functions.items():
                        got = self.filter(a, "--op", op, "--kernel", name, "--border", border)
                        np.testing.assert_array_equal(got, function(a, footprint=footprint, **keys), err_msg=f"{op} {name} {border} {dtype}")
                    want = ndimage.median_filter(a, footprint=footprint, **keys)
                    if footprint.sum() % 2:
                        np.testing.assert_array_equal(self.filter(a, "--op", "median", "--kernel", name, "--border", border), want)

    def test_kernels_of_files(self):
        a = self.data((30, 41), "<f4")
        for shape in ((3, 5), (4, 6), (1, 7)):
            weights = self.random.normal(size=shape).astype("<f4")
            file = self.folder / "k.nrrd"
            files.write_nrrd(file, weights[None], image=True)
            for op, function in (("convolve", ndimage.convolve), ("correlate", ndimage.correlate)):
                got = self.filter(a, "--op", op, "--kernel", file)
                self.close_to(got, function(a.astype("f8"), weights.astype("f8"), mode="mirror"), a, (op, shape))
            got = self.filter(a, "--op", "dilate", "--kernel", file)
            self.close_to(got, ndimage.grey_dilation(a.astype("f8"), structure=weights.astype("f8"), mode="mirror"), a, shape)
            got = self.filter(a, "--op", "erode", "--kernel", file)
            self.close_to(got, ndimage.grey_erosion(a.astype("f8"), structure=weights.astype("f8"), mode="mirror"), a, shape)
        flat = self.random.integers(0, 2, (3, 5)).astype("u1")
        flat[1, 2] = 1
        files.write_nrrd(file, flat[None], image=True)
        np.testing.assert_array_equal(self.filter(a, "--op", "erode", "--kernel", file), ndimage.grey_erosion(a, footprint=flat, mode="mirror"))

    def test_every_edge_that_serves_agrees(self):
        a = self.data((90, 110), "<f4")
        for op, kernel in (("convolve", "box:6"), ("convolve", "gauss:5"), ("dilate", "box:6"), ("erode", "sphere:9"), ("median", "box:3")):
            plain = self.filter(a, "--op", op, "--kernel", kernel)
            served = 0
            for edge in EDGES:
                source, out = self.folder / "in.nrrd", self.folder / "out.nrrd"
                words = [COMMAND, "filter", source, "-o", out, "--json", "-", "--explain", "--quiet", "--op", op, "--kernel", kernel, "--via", f"filter.{edge}"]
                done = subprocess.run(words, capture_output=True, env=self.env)
                if done.returncode == 3:
                    continue
                self.assertEqual(done.returncode, 0, done.stderr)
                served += 1
                error = json.loads(done.stdout)["plan"]["predicted"]["error"]
                off = np.sqrt(np.mean((files.read(out).reshape(a.shape) - plain) ** 2)) / np.ptp(a)
                self.assertLessEqual(off, 2 * error + 1e-6, (edge, op, kernel))
            self.assertGreaterEqual(served, 2, (op, kernel))

    def test_a_name_of_several_jobs_means_that_of_this_one(self):
        a = self.data((9, 11), "<f4")
        words = ["--op", "convolve", "--kernel", "sphere:2"]
        np.testing.assert_array_equal(self.filter(a, *words, "--via", "backward"), self.filter(a, *words, "--via", "filter.backward"))

    def test_colour_and_type_stay(self):
        rgb = self.random.integers(0, 255, (20, 30, 3)).astype("u1")
        source, out = self.folder / "a.png", self.folder / "b.png"
        files.write_png(source, rgb)
        self.run_it("filter", source, "-o", out, "--op", "convolve", "--kernel", "box:1", "--quiet")
        got = files.read(out).reshape(rgb.shape)
        want = np.stack([np.rint(ndimage.uniform_filter(rgb[..., c].astype("f8"), 3, mode="mirror")) for c in range(3)], -1)
        np.testing.assert_array_equal(got, want)
        for dtype in ("<u4", "<i4", "<f8"):
            a = (self.random.integers(0, 2**30, (6, 7, 8))).astype(dtype)
            got = self.filter(a, "--op", "dilate", "--kernel", "box:1")
            self.assertEqual(got.dtype, np.dtype(dtype))
            np.testing.assert_array_equal(got, ndimage.grey_dilation(a, size=3, mode="mirror"))

    def verified(self, a, *words):
        """The measured error, and the predicted one."""
        source = self.folder / "in.nrrd"
        files.write_nrrd(source, a[None] if a.ndim == 2 else a, image=a.ndim == 2)
        done = self.run_it("filter", source, "-o", "null:", "--quiet", "--json", "-", "--verify=all", *words)
        report = json.loads(done.stdout)
        return report["measured"]["error"], report["plan"]["predicted"]["error"]

    def test_verified_by_what_shares_no_code(self):
        for axes, shape in ((2, (33, 41)), (3, (12, 13, 17))):
            a = self.data(shape, "<f4")
            for op in ("convolve", "correlate", "dilate", "erode", "open", "close", "tophat", "median"):
                for border in BORDERS:
                    kernel = "box:2" if border in ("zero", "wrap") else "sphere:2.3"
                    measured, predicted = self.verified(a, "--op", op, "--kernel", kernel, "--border", border)
                    self.assertEqual(measured["samples"], a.size)
                    self.assertLess(measured["nrmse"], 2e-7, (op, border, axes))
                    self.assertLess(predicted, 1e-5)

    def test_verifying_sees_what_is_approximate(self):
        """Deriche's waves are no Gaussian. What is predicted is a bound for any image: of noise, whose errors average, much is left."""
        a = self.random.random((60, 70)).astype("<f4")
        measured, predicted = self.verified(a, "--op", "convolve", "--kernel", "gauss:2", "--via", "recursive", "--max-error", "0.01")
        self.assertGreater(measured["nrmse"], 1e-5)
        self.assertLess(measured["nrmse"], predicted)
        self.assertLess(predicted, 0.01)

    def test_a_page_of_the_run(self):
        a = self.data((40, 50), "u1")
        files.write_nrrd(self.folder / "in.nrrd", a[None], image=True)
        page = self.folder / "r.html"
        self.run_it("filter", self.folder / "in.nrrd", "-o", "null:", "--op", "convolve", "--kernel", "gauss:2", "--via", "recursive",
                    "--max-error", "0.01", "--report", page, "--quiet")
        text = page.read_text()
        for words in ("place by place", "Error map", "filter.recursive"):
            self.assertIn(words, text)

    def test_verifying_that_would_take_hours_is_refused(self):
        a = self.data((60, 400, 400), "u1")
        source = self.folder / "in.nrrd"
        files.write_nrrd(source, a)
        done = self.run_it("filter", source, "-o", "null:", "--op", "close", "--kernel", "sphere:45", "--verify", code=2)
        self.assertIn("takes hours", done.stderr.decode())

    def test_hostile_words(self):
        a = self.data((8, 9), "u1")
        for words, said in ((["--op", "swirl", "--kernel", "box:1"], "swirl"), (["--op", "convolve", "--kernel", "box:-1"], "radius"), (["--op", "convolve", "--kernel", "box:1e9"], "places"),
                            (["--op", "convolve", "--kernel", "gauss:0"], "deviation"), (["--op", "dilate", "--kernel", "gauss:2"], "convolve"), (["--op", "convolve", "--kernel", "sobel:z"], "axes"),
                            (["--op", "convolve", "--kernel", "box"], "box:R"), (["--op", "convolve"], "--kernel"), (["--kernel", "box:1"], "--op"), (["--op", "median", "--kernel", "box:nan"], "nan"),
                            (["--op", "convolve", "--kernel", "box:1", "--border", "round"], "round")):
            self.assertIn(said, self.filter(a, *words, code=2))
            self.assertFalse((self.folder / "out.nrrd").exists())
        self.filter(a, "--op", "convolve", "--kernel", "no/such.nrrd", code=4)

    def test_one_sample_and_kernels_larger_than_the_input(self):
        for shape in ((1, 1), (1, 5), (3, 2)):
            a = self.data(shape, "<f4")
            for border, keys in BORDERS.items():
                got = self.filter(a, "--op", "convolve", "--kernel", "box:4", "--border", border)
                padded = np.pad(a.astype("f8"), 4, **{"zero": dict(mode="constant"), "clamp": dict(mode="edge"), "mirror": dict(mode="reflect"), "wrap": dict(mode="wrap")}[border])
                want = [[padded[y : y + 9, x : x + 9].mean() for x in range(shape[1])] for y in range(shape[0])]
                np.testing.assert_allclose(got, want, rtol=1e-5, err_msg=f"{shape} {border}")


if __name__ == "__main__":
    unittest.main()
