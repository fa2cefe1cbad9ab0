"""`edgewise filter` beside scipy.ndimage and scipy.signal: random shapes of 1 to 3 axes, kernels, borders and types. Needs EDGEWISE."""

import os
import unittest

import files
import numpy as np
from running import Running
from scipy import ndimage, signal

SEED = int(os.environ.get("EDGEWISE_SEED", "35"))
ROUNDS = 33
BORDERS = {"zero": dict(mode="constant", cval=0), "clamp": dict(mode="nearest"), "mirror": dict(mode="mirror"), "wrap": dict(mode="wrap")}
TYPES = ["u1", "i1", "<u2", "<i2", "<u4", "<i4", "<f4", "<f8"]


class Trials(Running):
    def setUp(self):
        super().setUp()
        self.random = np.random.default_rng(SEED)

    def shape(self, axes, most):
        """Of an image or a volume of which all axes but so many have one sample."""
        sizes = [int(n) for n in self.random.integers(1, most + 1, axes)]
        return tuple([1] * (2 - axes) + sizes)

    def samples(self, shape, dtype):
        kind = np.dtype(dtype).kind
        if kind == "f":
            return self.random.normal(0, 20, shape).astype(dtype)
        limits = np.iinfo(dtype)
        # Sums of these fit into f64 exactly, and often not into the type: they are clipped.
        return self.random.integers(max(limits.min, -(2**30)), min(limits.max, 2**30), shape, dtype=dtype, endpoint=True)

    def filter(self, a, kernel, *words):
        source, out, file = (self.folder / name for name in ("in.nrrd", "out.nrrd", "k.nrrd"))
        image = a.ndim == 2
        files.write_nrrd(source, a[None] if image else a, image=image)
        files.write_nrrd(file, kernel[None] if image else kernel, image=image)
        self.run_it("filter", source, "-o", out, "--kernel", file, "--quiet", *words)
        got = files.read(out).reshape(a.shape)
        if a.dtype.kind == "u" and kernel.min() < 0 and kernel.sum() == 0 and {"convolve", "correlate"} & set(words):
            self.assertIn(got.dtype.kind, "if", "a derivative keeps its sign")
        else:
            self.assertEqual(got.dtype, a.dtype)
        return got

    def same(self, got, want, what, magnitude):
        """Integers exactly, f32 to 1e-5 of the magnitudes that are added up."""
        if got.dtype.kind == "f":
            np.testing.assert_allclose(got, want, rtol=0, atol=1e-5 * magnitude, err_msg=what)
        else:
            limits = np.iinfo(got.dtype)
            want = np.clip(np.rint(want), limits.min, limits.max)
            np.testing.assert_array_equal(got.astype("f8"), want, err_msg=what)

    def trial(self, number):
        axes = 1 + number % 3
        dtype, border = (str(self.random.choice(list(of))) for of in (TYPES, BORDERS))
        a = self.samples(self.shape(axes, {1: 300, 2: 60, 3: 16}[axes]), dtype)
        extent = self.shape(axes, {1: 25, 2: 9, 3: 5}[axes])
        return a, extent, BORDERS[border], border, f"trial {number} of seed {SEED}: {a.shape} {a.dtype} {extent} {border}"

    def test_sums(self):
        for number in range(ROUNDS):
            a, extent, keys, border, what = self.trial(number)
            weights = self.random.integers(-6, 7, extent).astype("<f4")
            if a.dtype.kind == "f":
                weights = self.random.normal(size=extent).astype("<f4")
            wide, kernel = a.astype("f8"), weights.astype("f8")
            magnitude = np.abs(kernel).sum() * np.abs(wide).max()
            for op, function in (("convolve", ndimage.convolve), ("correlate", ndimage.correlate)):
                # The centre of scipy's kernels is at floor(n / 2) too, of even n as well.
                self.same(self.filter(a, weights, "--op", op, "--border", border), function(wide, kernel, **keys), f"{what} {op}", magnitude)

    def test_sums_as_those_of_signals(self):
        """With zeros beyond the samples a convolution is that of signals, trimmed to the input about the kernel's centre."""
        for number in range(ROUNDS // 3):
            a, extent, _, _, what = self.trial(number)
            weights = self.random.integers(-6, 7, extent).astype("<f4")
            full = signal.convolve(a.astype("f8"), weights.astype("f8"), mode="full", method="direct")
            trimmed = full[tuple(slice(n // 2, n // 2 + m) for n, m in zip(extent, a.shape))]
            magnitude = np.abs(weights).sum() * np.abs(a.astype("f8")).max()
            self.same(self.filter(a, weights, "--op", "convolve", "--border", "zero"), trimmed, what, magnitude)

    def test_extremes(self):
        pairs = (("dilate", ndimage.grey_dilation), ("erode", ndimage.grey_erosion))
        for number in range(ROUNDS):
            a, extent, keys, border, what = self.trial(number)
            flat = self.random.random(extent) < 0.7
            flat[tuple(n // 2 for n in extent)] = True
            op, function = pairs[number // 3 % 2]
            got = self.filter(a, flat.astype("u1"), "--op", op, "--border", border)
            np.testing.assert_array_equal(got, function(a, footprint=flat, **keys), err_msg=f"{what} {op} flat")
            heights = self.random.integers(-9, 10, extent).astype("<f4")
            if len(set(np.unique(heights)) - {0}) <= 1:
                continue  # such a file is a mask, so a flat element
            want = function(a.astype("f8"), structure=heights.astype("f8"), **keys)
            got = self.filter(a, heights, "--op", op, "--border", border)
            self.same(got, want, f"{what} {op} grey", np.abs(a.astype("f8")).max() + 9)

    def test_medians(self):
        for number in range(ROUNDS // 3):
            a, extent, keys, border, what = self.trial(number)
            footprint = np.ones(tuple(n - 1 + n % 2 for n in extent), bool)
            got = self.filter(a, footprint.astype("u1"), "--op", "median", "--border", border)
            np.testing.assert_array_equal(got, ndimage.median_filter(a, footprint=footprint, **keys), err_msg=what)


if __name__ == "__main__":
    unittest.main()
