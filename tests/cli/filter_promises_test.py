"""What `edgewise filter` and `edgewise radon` promise of errors, beside scipy in f64: kernels of all kinds and sizes, types, borders.

Needs EDGEWISE."""

import json
import math
import unittest

import files
import numpy as np
from running import Running
from scipy import ndimage, signal


class Promises(Running):
    def setUp(self):
        super().setUp()
        self.random = np.random.default_rng(91)
        self.source, self.out, self.file = (self.folder / name for name in ("in.nrrd", "out.nrrd", "k.nrrd"))

    def filter(self, a, kernel, *words, code=0):
        """(result, predicted, measured); `kernel`: weights, or the name of one."""
        image = a.ndim == 2
        files.write_nrrd(self.source, a[None] if image else a, image=image)
        name = kernel
        if not isinstance(kernel, str):
            files.write_nrrd(self.file, kernel[None] if image else kernel, image=image)
            name = self.file
        done = self.run_it("filter", self.source, "-o", self.out, "--kernel", name, "--quiet", "--json", "-", "--verify=all", *words, code=code)
        report = json.loads(done.stdout)
        if code:
            return None, report, None
        return files.read(self.out).reshape(a.shape), report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"]

    def holds(self, got, want, predicted, measured, what):
        """Promised at least what is measured, here and by the command, and at most three times that."""
        true = math.sqrt(np.mean((got.astype("f8") - want) ** 2)) / (np.ptp(want) or 1)
        # Sums of the reference in f64 go another way round: 2^-50 of results.
        slack = 1e-14 * np.abs(want).max() / (np.ptp(want) or 1)
        self.assertLessEqual(true, predicted + slack, what)
        self.assertAlmostEqual(true, measured, delta=.01 * measured + slack, msg=what)
        if measured > 1e-12:
            self.assertLessEqual(predicted, 3 * measured, what)

    def kernels(self, shape):
        signed = self.random.normal(size=shape)
        yield "signed", np.float32(signed)
        yield "positive", np.float32(self.random.random(shape))
        if signed.size > 1:
            yield "difference", np.float32(signed - signed.mean())

    def test_kernels_of_all_sizes(self):
        """The offset makes sums large that cancel in the difference."""
        a = np.float32(5 + self.random.random((70, 61)))
        for k in (3, 9, 31, 63):
            for name, w in self.kernels((k, k)):
                # In f64 by transforms: off by 1e-15 of what is added up.
                want = signal.fftconvolve(a.astype("f8"), w.astype("f8"))[k // 2:k // 2 + 70, k // 2:k // 2 + 61]
                for edge in ("backward", "forward", "fourier"):
                    words = ["--op", "convolve", "--border", "zero", "--via", f"filter.{edge}", "--max-error", "1e6"]
                    got, predicted, measured = self.filter(a, w, *words)
                    self.holds(got, want, predicted, measured, f"{edge} {k} {name}")

    def test_products_of_lines(self):
        for shape, extents in (((50, 61), (5, 9)), ((12, 17, 15), (3, 5, 7))):
            a = np.float32(self.random.normal(40, 1, shape))
            for of in (self.random.random, self.random.standard_normal):
                lines = [of(n) for n in extents]
                w = lines[0]
                for line in lines[1:]:
                    w = np.multiply.outer(w, line)
                w = np.float32(w)
                want = ndimage.correlate(a.astype("f8"), w.astype("f8"), mode="mirror")
                got, predicted, measured = self.filter(a, w, "--op", "correlate", "--max-error", "1e-3")
                self.holds(got, want, predicted, measured, f"{shape}")

    def test_a_budget_of_rounding_finds_a_plan_for_large_random_kernels(self):
        a = np.float32(self.random.random((128, 128)))
        w = np.float32(self.random.normal(size=(63, 63)))
        for budget in ("1e-4", "1e-6"):
            _, predicted, measured = self.filter(a, w, "--op", "convolve", "--max-error", budget)
            self.assertLessEqual(measured, predicted)
            self.assertLessEqual(predicted, float(budget))
        _, report, _ = self.filter(a, w, "--op", "convolve", "--max-error", "1e-12", code=3)
        self.assertIsNone(report["plan"])

    def test_types_and_borders_in_volumes(self):
        modes = {"zero": dict(mode="constant", cval=0), "clamp": dict(mode="nearest"), "mirror": dict(mode="mirror"), "wrap": dict(mode="wrap")}
        for dtype, border in zip(("u1", "<i2", "<u2", "<f4", "<i4", "<f8"), list(modes) * 2):
            a = self.random.normal(100, 25, (11, 13, 12)).astype(dtype)
            for name, w in self.kernels((3, 5, 2)):
                want = ndimage.correlate(a.astype("f8"), w.astype("f8"), **modes[border])
                got, predicted, measured = self.filter(a, w, "--op", "correlate", "--border", border, "--bits", "32", "--max-error", "1e6")
                # What f32 in the file makes of results in f64 comes on top.
                rounded = 6e-8 * np.abs(want).max() / np.ptp(want)
                true = math.sqrt(np.mean((got - want) ** 2)) / np.ptp(want)
                self.assertLessEqual(true, predicted + rounded, f"{dtype} {border} {name}")
                self.assertLessEqual(measured, predicted + 1e-15, f"{dtype} {border} {name}")
                if measured > 1e-12:
                    self.assertLessEqual(predicted, 3 * measured, f"{dtype} {border} {name}")

    def test_what_writing_rounds_is_promised_and_measured(self):
        a = self.random.integers(0, 256, (40, 50)).astype("u1")
        want = ndimage.gaussian_filter(a.astype("f8"), 1.5, mode="mirror", truncate=4)
        for words in ((), ("--max-error", "0.01")):
            got, predicted, measured = self.filter(a, "gauss:1.5", "--op", "convolve", *words)
            self.holds(got, want, predicted, measured, words)
            self.assertAlmostEqual(measured, 1 / math.sqrt(12) / np.ptp(want), delta=.1 * measured)
        got, predicted, measured = self.filter(a, "gauss:1.5", "--op", "convolve", "--bits", "32")
        self.holds(got, want, predicted, measured, "values")
        self.assertLess(predicted, 1e-6)
        # Half a step of rounding is more than was allowed, whatever the path.
        self.filter(a, "gauss:1.5", "--op", "convolve", "--max-error", "1e-4", code=3)

    def test_what_is_exact_is_promised_exact(self):
        a = self.random.integers(0, 256, (40, 50)).astype("u1")
        for words in (("--op", "median"), ("--op", "dilate"), ("--op", "open"), ("--op", "erode", "--border", "zero")):
            _, predicted, measured = self.filter(a, "box:1", *words, "--max-error", "0.001")
            self.assertEqual((predicted, measured), (0, 0), words)
        whole = self.random.integers(0, 3, (3, 3)).astype("<f4")
        _, predicted, measured = self.filter(a.astype("<i4"), whole, "--op", "convolve", "--max-error", "0.001")
        self.assertEqual((predicted, measured), (0, 0))

    def test_running_sums_and_recursions(self):
        for a in (np.float32(1e4 + self.random.random((60, 200))), np.float32(np.exp(self.random.uniform(-15, 5, (60, 200))))):
            want = ndimage.uniform_filter(a.astype("f8"), 9, mode="mirror")
            got, predicted, measured = self.filter(a, "box:4", "--op", "convolve", "--via", "filter.running")
            self.holds(got, want, predicted, measured, "running")
            want = ndimage.gaussian_filter(a.astype("f8"), 3, mode="mirror", truncate=4)
            got, predicted, measured = self.filter(a, "gauss:3", "--op", "convolve", "--via", "filter.recursive", "--max-error", "1e6")
            self.holds(got, want, predicted, measured, "recursive")

    def test_a_derivative_of_a_constant_has_no_range_of_rounding(self):
        _, predicted, measured = self.filter(np.full((20, 20), .1, "<f4"), "laplace", "--op", "correlate", "--bits", "32")
        self.assertLess(measured, 1e-6)
        self.assertLessEqual(measured, predicted)

    def test_a_ball_by_a_sequence_says_how_far_it_is_off(self):
        a = self.random.integers(0, 256, (50, 50)).astype("u1")
        y, x = np.mgrid[-6:7, -6:7]
        want = ndimage.grey_dilation(a, footprint=x * x + y * y <= 36, mode="mirror").astype("f8")
        got, predicted, measured = self.filter(a, "sphere:6", "--op", "dilate", "--via", "filter.ball_sequence", "--max-error", "1")
        self.holds(got, want, predicted, measured, "sequence")

    def test_explaining_changes_no_path(self):
        """The default asks for nothing that would have to be measured."""
        a = np.float32(self.random.random((90, 90)))
        for k in (3, 15, 31):
            files.write_nrrd(self.source, a[None], image=True)
            files.write_nrrd(self.file, np.float32(self.random.normal(size=(1, k, k))), image=True)
            words = ("filter", self.source, "-o", self.out, "--op", "convolve", "--kernel", self.file, "--quiet", "--json", "-")
            plans = [[step["transition"] for step in json.loads(self.run_it(*words, *more).stdout)["plan"]["steps"]] for more in ((), ("--verify",), ())]
            self.assertEqual(plans[0], plans[1])
            self.assertEqual(plans[0], plans[2])

    def test_lines(self):
        for shape, dtype in (((40, 31), "u1"), ((25, 60), "<f4"), ((2, 9), "<i2")):
            a = self.random.normal(90, 30, shape).astype(dtype)
            files.write_nrrd(self.source, a[None], image=True)
            for edge in ("backward", "forward", "fourier"):
                for angles in (1, 7, 40):
                    done = self.run_it("radon", self.source, "-o", self.out, "--angles", angles, "--via", f"radon.{edge}", "--verify=all",
                                       "--max-error", "1e6", "--quiet", "--json", "-")
                    report = json.loads(done.stdout)
                    predicted, measured = report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"]
                    self.assertLessEqual(measured, predicted + 1e-15, f"{edge} {shape} {angles}")
                    if measured > 1e-12:
                        self.assertLessEqual(predicted, 3 * measured, f"{edge} {shape} {angles}")


if __name__ == "__main__":
    unittest.main()
