"""Warps by phases of spectra, as a user asks for them, beside the trigonometric polynomial summed in numpy. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import Running

SHIFT, SHEARS, RESAMPLE = "warp.phase_shift", "warp.phase_shears", "warp.spectrum_resample"


def weights(places, n, m):
    """What each of n samples adds at each place, of frequencies that n and m samples both hold."""
    u = np.asarray(places)[:, None] - np.arange(n)
    least = min(n, m)
    total = np.ones_like(u, "f8")
    for j in range(1, least // 2 + 1):
        total += (1 if 2 * j == least else 2) * np.cos(2 * np.pi * j * u / n)
    return total / n


class FourierWarps(Running):
    def setUp(self):
        super().setUp()
        self.random = np.random.default_rng(3)
        self.source, self.out = self.folder / "in.nrrd", self.folder / "out.nrrd"

    def warp(self, a, *words, code=0):
        files.write_nrrd(self.source, a[None], image=True)
        self.out.unlink(missing_ok=True)
        done = self.run_it("warp", self.source, "-o", self.out, "--quiet", *words, code=code)
        return done.stderr.decode() if code else files.read(self.out)[0, ..., 0]

    def test_shifts(self):
        a = self.random.normal(size=(20, 31)).astype("<f4")
        got = self.warp(a, "--translate", "0.3,-2.25", "--size", "31x20", "--via", SHIFT, "--outside", "9")
        x, y = np.arange(31) - 0.3, np.arange(20) + 2.25
        want = weights(y, 20, 20) @ a.astype("f8") @ weights(x, 31, 31).T
        want[y > 19.5] = 9
        np.testing.assert_allclose(got, want, atol=1e-5)

    def test_scales(self):
        a = self.random.normal(size=(20, 30)).astype("<f4")
        for nx, ny in (60, 40), (15, 10), (45, 14):
            got = self.warp(a, "--size", f"{nx}x{ny}", "--spacing", f"{30 / nx},{20 / ny}", "--via", RESAMPLE)
            # Both centres are one.
            x, y = (np.arange(nx) - (nx - 1) / 2) * 30 / nx + 14.5, (np.arange(ny) - (ny - 1) / 2) * 20 / ny + 9.5
            want = weights(y, 20, ny) @ a.astype("f8") @ weights(x, 30, nx).T
            np.testing.assert_allclose(got, want, atol=1e-5)

    def test_a_turn_and_the_turn_back(self):
        y, x = np.mgrid[:60, :64]
        a = (np.exp(-((x - 33) ** 2 + (y - 27) ** 2) / 12) - 0.5 * np.exp(-((x - 28) ** 2 + (y - 33) ** 2) / 18)).astype("<f4")
        once = self.warp(a, "--rotate", "31", "--size", "64x60", "--via", SHEARS)
        self.assertGreater(np.abs(once - a).max(), 0.1)
        np.testing.assert_allclose(self.warp(once, "--rotate", "-31", "--size", "64x60", "--via", SHEARS), a, atol=1e-5)

    def test_the_error_is_measured_and_never_promised(self):
        a = self.random.normal(size=(40, 40)).astype("<f4")
        files.write_nrrd(self.source, a[None], image=True)
        done = self.run_it("warp", self.source, "-o", self.out, "--quiet", "--translate", "0.4,0.1", "--via", SHIFT, "--verify", "--json", "-")
        report = json.loads(done.stdout)
        self.assertIsNone(report["plan"]["predicted"]["error"])
        self.assertGreater(report["measured"]["error"]["nrmse"], 0)
        self.warp(a, "--translate", "0.4,0.1", "--via", SHIFT, "--max-error", "0.5", code=3)

    def test_refusals_say_why(self):
        a = self.random.normal(size=(20, 30)).astype("<f4")
        self.assertIn("37.02", self.warp(a, "--scale", "1.234", "--via", RESAMPLE, code=3))
        self.assertIn("sheared", self.warp(a, "--rotate", "10", "--via", SHIFT, code=3))
        a[3, 4] = np.nan
        self.assertIn("finite", self.warp(a, "--rotate", "10", "--via", SHEARS, code=3))


if __name__ == "__main__":
    unittest.main()
