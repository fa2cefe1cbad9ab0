"""What people ask of `edgewise filter` every day, beside scipy and brute force. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import Running
from scipy import ndimage

MODES = {"zero": dict(mode="constant", cval=0), "clamp": dict(mode="nearest"), "mirror": dict(mode="mirror"), "wrap": dict(mode="wrap")}
PADS = {"zero": dict(mode="constant"), "clamp": dict(mode="edge"), "mirror": dict(mode="reflect"), "wrap": dict(mode="wrap")}


def lower_median(values):
    """Of all that are numbers, the lower of two in the middle."""
    values = np.sort(values[~np.isnan(values)])
    return values[(values.size - 1) // 2] if values.size else np.nan


def medians(a, footprint, border):
    reach = [n // 2 for n in footprint.shape]
    padded = np.pad(a, [(r, r) for r in reach], **PADS[border])
    out = np.empty(a.shape)
    for at in np.ndindex(a.shape):
        window = padded[tuple(slice(i, i + n) for i, n in zip(at, footprint.shape))]
        out[at] = lower_median(window[footprint])
    return out


class Everyday(Running):
    def setUp(self):
        super().setUp()
        self.random = np.random.default_rng(5)

    def filter(self, a, *words, code=0, spacing=None, unit="mm", out="out.nrrd"):
        """Of an array of two axes (an image) or three (a volume): result and messages."""
        source, result = self.folder / "in.nrrd", self.folder / out
        result.unlink(missing_ok=True)
        files.write_nrrd(source, a[None] if a.ndim == 2 else a, image=a.ndim == 2)
        given = ["--input-spacing", ",".join(map(str, spacing)), "--input-unit", unit] if spacing else []
        done = self.run_it("filter", source, "-o", result, *given, *words, code=code)
        said = done.stderr.decode()
        if code:
            self.assertFalse(result.exists())
            return None, said
        got = files.read(result)
        return got.reshape(a.shape if got.size == a.size else a.shape + (-1,)), said

    def kernel(self, weights):
        file = self.folder / "k.nrrd"
        files.write_nrrd(file, weights[None] if weights.ndim == 2 else weights, image=weights.ndim == 2)
        return file

    # NaN

    def test_medians_leave_nan_out(self):
        for shape, dtype, border in (((9, 11), "<f4", "mirror"), ((8, 7), "<f8", "zero"), ((5, 6, 7), "<f4", "wrap"), ((12, 5), "<f4", "clamp")):
            a = self.random.normal(size=shape).astype(dtype)
            a[self.random.random(shape) < 0.3] = np.nan
            a[tuple(slice(0, 4) for _ in shape)] = np.nan
            footprint = np.ones((3,) * len(shape), bool)
            got, _ = self.filter(a, "--op", "median", "--kernel", "box:1", "--border", border)
            np.testing.assert_array_equal(got, medians(a, footprint, border).astype(dtype), err_msg=str(shape))
            self.assertTrue(np.isnan(got).any() and np.isfinite(got).any())

    def test_infinities_are_ordered_by_medians(self):
        a = self.random.normal(size=(9, 9)).astype("<f4")
        a[2, 3], a[6, 6], a[4, 4] = np.inf, -np.inf, np.nan
        got, _ = self.filter(a, "--op", "median", "--kernel", "box:1")
        np.testing.assert_array_equal(got, medians(a, np.ones((3, 3), bool), "mirror").astype("<f4"))

    def test_nan_reaches_as_far_as_the_kernel(self):
        for shape in ((15, 17), (7, 8, 9)):
            a = self.random.normal(size=shape).astype("<f4")
            at = tuple(n // 2 for n in shape)
            a[at] = np.nan
            near = np.zeros(shape, bool)
            near[tuple(slice(i - 1, i + 2) for i in at)] = True
            for op in ("convolve", "dilate", "erode"):
                got, _ = self.filter(a, "--op", op, "--kernel", "box:1")
                np.testing.assert_array_equal(np.isnan(got), near, err_msg=op)

    # Kernels

    def test_a_mask_of_any_value_is_a_structuring_element(self):
        cross = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]])
        skew = np.array([[0, 0, 1], [1, 1, 0]])
        for mask, value, dtype in ((cross, 255, "u1"), (cross, 1, "<i2"), (skew, 7, "<u2"), (skew, -1, "<i2"), (cross, 0.5, "<f4")):
            a = self.random.integers(0, 200, (20, 23)).astype("u1")
            file = self.kernel((mask * value).astype(dtype))
            for op, function in (("dilate", ndimage.grey_dilation), ("erode", ndimage.grey_erosion)):
                got, said = self.filter(a, "--op", op, "--kernel", file)
                np.testing.assert_array_equal(got, function(a, footprint=mask, mode="mirror"), err_msg=f"{op} {value}")
                self.assertNotIn("heights", said)
            got, _ = self.filter(a, "--op", "median", "--kernel", self.kernel((cross * value).astype(dtype)))
            np.testing.assert_array_equal(got, ndimage.median_filter(a, footprint=cross, mode="mirror"))

    def test_heights_are_said_to_be_heights(self):
        a = self.random.integers(0, 100, (20, 23)).astype("<i2")
        heights = np.array([[0, 2, 0], [2, 5, 2], [0, 2, 0]])
        got, said = self.filter(a, "--op", "dilate", "--kernel", self.kernel(heights.astype("<i2")))
        np.testing.assert_array_equal(got, ndimage.grey_dilation(a, structure=heights, mode="mirror"))
        self.assertIn("heights", said)

    def test_lengths_on_anisotropic_grids(self):
        a = self.random.integers(0, 200, (12, 15, 16)).astype("<f4")
        spacing = (0.5, 0.75, 2.0)  # x, y, z
        got, _ = self.filter(a, "--op", "convolve", "--kernel", "gauss:1.5mm", spacing=spacing)
        want = ndimage.gaussian_filter(a.astype("f8"), [1.5 / s for s in spacing[::-1]], mode="mirror")
        np.testing.assert_allclose(got, want, rtol=2e-5, atol=1e-3)
        z, y, x = np.meshgrid(*[np.arange(-n, n + 1) for n in (1, 4, 6)], indexing="ij")
        ball = (x * 0.5) ** 2 + (y * 0.75) ** 2 + (z * 2.0) ** 2 <= 3**2 + 1e-9
        got, _ = self.filter(a, "--op", "dilate", "--kernel", "sphere:3mm", spacing=spacing)
        np.testing.assert_array_equal(got, ndimage.grey_dilation(a, footprint=ball, mode="mirror"))
        got, _ = self.filter(a, "--op", "erode", "--kernel", "sphere:3000um", spacing=spacing)
        np.testing.assert_array_equal(got, ndimage.grey_erosion(a, footprint=ball, mode="mirror"))
        got, _ = self.filter(a, "--op", "dilate", "--kernel", "box:1mm,1.5mm,2mm", spacing=spacing)
        np.testing.assert_array_equal(got, ndimage.grey_dilation(a, size=(3, 5, 5), mode="mirror"))

    def test_one_size_an_axis(self):
        a = self.random.normal(size=(9, 14, 15)).astype("<f4")
        got, _ = self.filter(a, "--op", "convolve", "--kernel", "gauss:2,1,0.5")
        np.testing.assert_allclose(got, ndimage.gaussian_filter(a.astype("f8"), (0.5, 1, 2), mode="mirror"), atol=2e-6)
        got, _ = self.filter(a, "--op", "convolve", "--kernel", "box:2,0,1")
        np.testing.assert_allclose(got, ndimage.uniform_filter(a.astype("f8"), (3, 1, 5), mode="mirror"), atol=2e-6)
        b = self.random.normal(size=(14, 15)).astype("<f4")
        got, _ = self.filter(b, "--op", "dilate", "--kernel", "cross:2,1")
        cross = np.zeros((3, 5), bool)
        cross[1], cross[:, 2] = True, True
        np.testing.assert_array_equal(got, ndimage.grey_dilation(b, footprint=cross, mode="mirror"))

    def test_lengths_need_a_unit(self):
        from pathlib import Path
        source = Path(self.folder) / "p.png"
        files.write_png(source, self.random.integers(0, 255, (9, 9, 3)).astype("u1"))
        done = self.run_it("filter", source, "-o", self.folder / "o.png", "--op", "convolve", "--kernel", "gauss:2mm", code=2)
        self.assertIn("no unit", done.stderr.decode())

    # Values

    def test_derivatives_of_unsigned_integers_keep_their_sign(self):
        for dtype, wide, shape in (("u1", "i2", (11, 12)), ("<u2", "i4", (11, 12)), ("u1", "i2", (5, 6, 7))):
            a = self.random.integers(0, np.iinfo(dtype).max + 1, shape).astype(dtype)
            got, said = self.filter(a, "--op", "correlate", "--kernel", "sobel:x")
            self.assertEqual(got.dtype.str[1:], wide)
            np.testing.assert_array_equal(got, ndimage.sobel(a.astype("i8"), axis=-1, mode="mirror"))
            self.assertIn("negative", said)
            got, _ = self.filter(a, "--op", "convolve", "--kernel", "laplace")
            np.testing.assert_array_equal(got, ndimage.laplace(a.astype("i8"), mode="mirror"))
        b = self.random.integers(0, 2**32, (6, 7)).astype("<u4")
        got, _ = self.filter(b, "--op", "correlate", "--kernel", "sobel:y")
        self.assertEqual(got.dtype.str[1:], "f4")
        np.testing.assert_allclose(got, ndimage.sobel(b.astype("f8"), axis=0, mode="mirror"), rtol=1e-6, atol=1e4)

    def test_a_picture_of_a_derivative_is_a_view(self):
        a = self.random.integers(0, 256, (11, 12)).astype("u1")
        got, said = self.filter(a, "--op", "correlate", "--kernel", "sobel:x", out="out.png")
        want = ndimage.sobel(a.astype("f8"), axis=-1, mode="mirror")
        want = np.rint((want - want.min()) / np.ptp(want) * 255)
        self.assertLessEqual(np.abs(got - want).max(), 1)
        self.assertIn("view", said)

    def test_what_is_cut_off_is_said(self):
        a = self.random.integers(0, 256, (11, 12)).astype("u1")
        sharpen = np.array([[0, -1, 0], [-1, 5, -1], [0, -1, 0]], "<f4")
        got, said = self.filter(a, "--op", "convolve", "--kernel", self.kernel(sharpen))
        want = ndimage.convolve(a.astype("f8"), sharpen, mode="mirror")
        np.testing.assert_array_equal(got, np.clip(want, 0, 255))
        self.assertIn(f"{np.sum((want < 0) | (want > 255))} of 132 values", said)
        _, said = self.filter(a, "--op", "convolve", "--kernel", "box:1")
        self.assertNotIn("cut off", said)

    # Slices, gradients, masks

    def test_slices(self):
        a = self.random.integers(0, 250, (4, 11, 12)).astype("u1")
        disc = np.hypot(*np.meshgrid(np.arange(-2, 3), np.arange(-2, 3))) <= 2
        for words, each in ((("--op", "median", "--kernel", "box:1"), lambda s: ndimage.median_filter(s, 3, mode="mirror")),
                            (("--op", "dilate", "--kernel", "sphere:2"), lambda s: ndimage.grey_dilation(s, footprint=disc, mode="mirror")),
                            (("--op", "convolve", "--kernel", "gauss:1"), lambda s: np.rint(ndimage.gaussian_filter(s.astype("f8"), 1, mode="mirror"))),
                            (("--op", "correlate", "--kernel", "sobel:y"), lambda s: ndimage.sobel(s.astype("i4"), axis=0, mode="mirror"))):
            got, _ = self.filter(a, "--slices", *words)
            np.testing.assert_array_equal(got, np.stack([each(s) for s in a]), err_msg=str(words))
        got, said = self.filter(a, "--op", "dilate", "--kernel", self.kernel(disc.astype("u1") * 255))
        np.testing.assert_array_equal(got, np.stack([ndimage.grey_dilation(s, footprint=disc, mode="mirror") for s in a]))
        self.assertIn("one plane", said)
        _, said = self.filter(a, "--slices", "--op", "correlate", "--kernel", "sobel:z", code=2)
        self.assertIn("axes", said)

    def test_length_of_the_gradient(self):
        for shape, dtype, spacing in (((9, 12, 13), "<f4", (0.5, 2.0, 3.0)), ((20, 21), "u1", (0.25, 1.5)), ((7, 8, 9), "<i2", None)):
            a = self.random.integers(0, 200, shape).astype(dtype)
            steps = (spacing or (1,) * len(shape))[::-1]
            wide = a.astype("f8")
            for words, along in (((), lambda k: ndimage.correlate1d(wide, [-0.5, 0, 0.5], axis=k, mode="mirror")),
                                 (("--kernel", "gauss:1.2"), lambda k: ndimage.gaussian_filter(wide, 1.2, order=[int(i == k) for i in range(len(shape))], mode="mirror")),
                                 (("--kernel", "sobel"), lambda k: ndimage.sobel(wide, axis=k, mode="mirror") / (2 * 4 ** (len(shape) - 1)))):
                want = np.sqrt(sum((along(k) / steps[k]) ** 2 for k in range(len(shape))))
                got, _ = self.filter(a, "--op", "gradient", *words, spacing=spacing)
                self.assertEqual(got.dtype, np.float32)
                np.testing.assert_allclose(got, want, rtol=2e-5, atol=2e-5 * want.max(), err_msg=f"{shape} {words}")
        _, said = self.filter(a, "--op", "gradient", "--kernel", "box:1", code=2)
        self.assertIn("morphological", said)

    def test_gradients_are_verified(self):
        source = self.folder / "g.nrrd"
        files.write_nrrd(source, self.random.normal(size=(9, 10, 11)).astype("<f4"))
        done = self.run_it("filter", source, "-o", "null:", "--quiet", "--op", "gradient", "--kernel", "gauss:1", "--verify=all", "--json", "-")
        self.assertLess(json.loads(done.stdout)["measured"]["error"]["nrmse"], 1e-6)

    def test_binary(self):
        functions = {"binary_dilate": ndimage.grey_dilation, "binary_erode": ndimage.grey_erosion, "binary_open": ndimage.grey_opening, "binary_close": ndimage.grey_closing}
        zero = {"binary_dilate": ndimage.binary_dilation, "binary_erode": ndimage.binary_erosion, "binary_open": ndimage.binary_opening, "binary_close": ndimage.binary_closing}
        for shape, dtype, value in (((20, 21), "u1", 255), ((9, 10, 11), "<i2", 1), ((15, 14), "<f4", 3), ((8, 9, 10), "u1", 1)):
            mask = self.random.random(shape) < 0.6
            r = 2
            ball = sum(p**2 for p in np.meshgrid(*[np.arange(-r, r + 1)] * len(shape), indexing="ij")) <= r * r
            for op in functions:
                for border in MODES:
                    got, _ = self.filter((mask * value).astype(dtype), "--op", op, "--kernel", "sphere:2", "--border", border)
                    want = functions[op](mask.astype("u1"), footprint=ball, **MODES[border])
                    np.testing.assert_array_equal(got, want * value, err_msg=f"{op} {border} {shape}")
                    self.assertEqual(got.dtype.str[1:], np.dtype(dtype).str[1:])
                np.testing.assert_array_equal(self.filter((mask * value).astype(dtype), "--op", op, "--kernel", "sphere:2", "--border", "zero")[0] != 0, zero[op](mask, ball), err_msg=op)

    def test_binary_of_many_values_and_holes(self):
        a = self.random.integers(0, 3, (12, 13)).astype("<f4") * 2.5
        a[self.random.random(a.shape) < 0.2] = np.nan
        mask = (a != 0) & ~np.isnan(a)
        got, _ = self.filter(a, "--op", "binary_dilation", "--kernel", "cross:1", "--border", "zero")
        np.testing.assert_array_equal(got, ndimage.binary_dilation(mask))
        skew = np.array([[0, 1, 1, 0], [1, 1, 0, 0]], "u1")
        got, _ = self.filter(a, "--op", "binary_erode", "--kernel", self.kernel(skew * 255), "--border", "zero")
        np.testing.assert_array_equal(got, ndimage.binary_erosion(mask, skew))

    # Openings and closings

    def test_openings_and_closings_are_ordered_and_idempotent(self):
        for number in range(36):
            border = ("mirror", "clamp", "wrap")[number % 3]
            axes = 2 + number % 2
            shape = tuple(self.random.integers(2, 14, axes))
            a = self.random.integers(0, 200, shape).astype(("u1", "<i2", "<f4")[number % 3 - 1])
            box = tuple(self.random.integers(1, 6 if axes == 2 else 4, axes))
            element = self.random.random(box) < 0.5
            element.flat[self.random.integers(element.size)] = True
            if number % 4 == 3:
                kernel = self.kernel(np.where(element, self.random.integers(1, 9, box), np.nan).astype("<f4"))
            else:
                kernel = self.kernel(element.astype("u1") * 255)
            words = ("--kernel", kernel, "--border", border)
            opened, closed = self.filter(a, "--op", "opening", *words)[0], self.filter(a, "--op", "closing", *words)[0]
            what = f"{number} {border} {shape} {element.astype(int).tolist()}"
            self.assertTrue((opened <= a).all() and (closed >= a).all(), what)
            np.testing.assert_array_equal(self.filter(opened, "--op", "open", *words)[0], opened, err_msg=what)
            np.testing.assert_array_equal(self.filter(closed, "--op", "close", *words)[0], closed, err_msg=what)
            source = self.folder / "in.nrrd"
            files.write_nrrd(source, a[None] if a.ndim == 2 else a, image=a.ndim == 2)
            done = self.run_it("filter", source, "-o", "null:", "--quiet", "--op", "close", *words, "--verify=all", "--json", "-")
            self.assertLess(json.loads(done.stdout)["measured"]["error"]["nrmse"], 1e-6, what)

    # Words

    def test_names_that_people_type(self):
        a = self.random.integers(0, 200, (15, 16)).astype("<f4")
        for said, meant in ((("--op", "gaussian", "--kernel", "2"), ("--op", "convolve", "--kernel", "gauss:2")),
                            (("--op", "Gaussian", "--kernel", "gaussian:2"), ("--op", "convolve", "--kernel", "gauss:2")),
                            (("--op", "blur", "--kernel", "box:2"), ("--op", "convolve", "--kernel", "box:2")),
                            (("--op", "mean", "--kernel", "1"), ("--op", "convolve", "--kernel", "box:1")),
                            (("--op", "opening", "--kernel", "ball:2"), ("--op", "open", "--kernel", "sphere:2")),
                            (("--op", "grey_closing", "--kernel", "disk:2"), ("--op", "close", "--kernel", "sphere:2")),
                            (("--op", "dilation", "--kernel", "square:1"), ("--op", "dilate", "--kernel", "box:1")),
                            (("--op", "white_tophat", "--kernel", "box:1"), ("--op", "tophat", "--kernel", "box:1")),
                            (("--op", "median-filter", "--kernel", "box:1"), ("--op", "median", "--kernel", "box:1")),
                            (("--op", "sobel", "--kernel", "x"), ("--op", "correlate", "--kernel", "sobel:x")),
                            (("--op", "sobel"), ("--op", "gradient", "--kernel", "sobel")),
                            (("--op", "laplacian"), ("--op", "convolve", "--kernel", "laplace"))):
            np.testing.assert_array_equal(self.filter(a, *said)[0], self.filter(a, *meant)[0], err_msg=str(said))

    def test_wrong_words_get_the_right_line(self):
        source = self.folder / "in.nrrd"
        files.write_nrrd(source, np.zeros((1, 5, 5), "u1"), image=True)
        for words, line in ((("--gaussian", "2"), "--op convolve --kernel gauss:2"), (("--gaussian=2mm",), "--op convolve --kernel gauss:2mm"),
                            (("--sigma", "1.5"), "gauss:1.5"), (("--median", "3"), "--op median --kernel box:3"), (("--opening",), "--op open --kernel"),
                            (("--laplacian",), "--kernel laplace"), (("--op", "gaussian"), "--op convolve --kernel gauss:S"),
                            (("--op", "median", "--kernel", "3"), "box:3"), (("--op", "gaussian", "--kernel", "sphere:2"), "gauss:S"), (("--op", "swirl", "--kernel", "box:1"), "convolve"),
                            (("--op", "gausian", "--kernel", "2"), "gaussian"), (("--op", "median", "--kernel", "bxo:1"), "did you mean box?"),
                            (("--op", "median", "--kernel", "box:2mm,2"), "one or the other")):
            done = self.run_it("filter", source, *(() if words[0] not in ("--op",) else ("-o", "null:")), *words, code=2)
            self.assertIn(line, done.stderr.decode(), words)
        # Where nobody gave an error, none is what an edge is refused for.
        done = self.run_it("filter", source, "-o", "null:", "--op", "median", "--kernel", "box:1", "--via", "filter.runs", code=3)
        self.assertNotIn("rounding", done.stderr.decode())


if __name__ == "__main__":
    unittest.main()
