"""`edgewise radon` at angles of a list, and its way back, beside numpy and formulas. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import Running


def ramp(n):
    """The transform of |f| up to half a cycle, at distances from -(n - 1) to n - 1."""
    k = np.arange(-(n - 1), n)
    h = np.zeros(k.size)
    h[k == 0] = 0.25
    h[k % 2 == 1] = -1 / (np.pi * k[k % 2 == 1]) ** 2
    return h


def gaps(degrees):
    """Half of the gaps on both sides, round half a turn [radian]."""
    within = np.mod(degrees, 180)
    order = np.argsort(within, kind="stable")
    ring = within[order]
    half = (np.roll(ring, -1) - np.roll(ring, 1)) % 360
    half[0], half[-1] = ring[1] - ring[-1] + 180, ring[0] + 180 - ring[-2]
    weights = np.empty(ring.size)
    weights[order] = half / 2
    return np.deg2rad(weights)


def backprojected(rows, degrees, weights, shape, step=1.0):
    m = rows.shape[1]
    filtered = np.array([np.convolve(row, ramp(m))[m - 1 : 2 * m - 1] for row in rows]) / step
    y, x = np.meshgrid(*[np.arange(n) - (n - 1) / 2 for n in shape], indexing="ij")
    out = np.zeros(shape)
    for q, t, w in zip(filtered, np.deg2rad(degrees), weights):
        at = x * np.cos(t) - y * np.sin(t) + (m - 1) / 2
        out += w * np.interp(at, np.arange(-1, m + 1), np.concatenate([[0], q, [0]]), left=0, right=0)
    return out


def blobs(shape, places):
    y, x = np.meshgrid(*[np.arange(n) - (n - 1) / 2 for n in shape], indexing="ij")
    return sum(a * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * s * s)) for cx, cy, s, a in places)


class Inverse(Running):
    def setUp(self):
        super().setUp()
        self.random = np.random.default_rng(3)

    def radon(self, a, *words, code=0, spacing=None):
        source, out = self.folder / "in.nrrd", self.folder / "out.nrrd"
        out.unlink(missing_ok=True)
        files.write_nrrd(source, a[None] if a.ndim == 2 else a, image=a.ndim == 2)
        given = ["--input-spacing", ",".join(map(str, spacing)), "--input-unit", "mm"] if spacing else []
        done = self.run_it("radon", source, "-o", out, "--quiet", *given, *words, code=code)
        if code:
            return done.stderr.decode()
        got = files.read(out)[..., 0]
        return got[0] if a.ndim == 2 else got

    def test_a_list_of_angles_has_the_rows_of_even_ones(self):
        for shape, dtype in (((20, 31), "<f4"), ((33, 16), "u1"), ((3, 12, 13), "<i2")):
            a = self.random.integers(0, 100, shape).astype(dtype)
            even = self.radon(a, "--angles", "36")
            listed = self.radon(a, "--angles", "0,30,45,90,135,175")
            scale = np.abs(even).max()
            np.testing.assert_allclose(listed, even[..., [0, 6, 9, 18, 27, 35], :], atol=1e-6 * scale)
            beyond = self.radon(a, "--angles", "225,-45,180,390")
            np.testing.assert_allclose(beyond[..., 0, :], even[..., 9, ::-1], atol=1e-6 * scale)
            np.testing.assert_allclose(beyond[..., 1, :], even[..., 27, ::-1], atol=1e-6 * scale)
            np.testing.assert_allclose(beyond[..., 2, :], even[..., 0, ::-1], atol=1e-6 * scale)
            np.testing.assert_allclose(beyond[..., 3, :], even[..., 6, :], atol=1e-6 * scale)
            votes = self.radon(a, "--angles", "0,50,90", "--to", "hough", "--threshold", "40")
            self.assertTrue((votes.sum(-1) == (a >= 40).sum((-2, -1))[..., None]).all())

    def test_angles_that_the_file_does_not_hold_are_said(self):
        source, out = self.folder / "in.nrrd", self.folder / "out.nrrd"
        files.write_nrrd(source, np.ones((1, 6, 5), "f4"), image=True)
        for angles, said in (("3", False), ("0,60,120", False), ("0,10,20", True), ("90,0", True)):
            done = self.run_it("radon", source, "-o", out, "--angles", angles)
            self.assertEqual("needs --angles" in done.stderr.decode(), said, angles)
            done = self.run_it("radon", out, "-o", self.folder / "back.nrrd", "--inverse")
            self.assertIn("even angles", done.stderr.decode())
            done = self.run_it("radon", out, "-o", self.folder / "back.nrrd", "--inverse", "--angles", angles)
            self.assertNotIn("even angles", done.stderr.decode())

    def test_every_edge_takes_a_list(self):
        a = self.random.random((30, 27)).astype("<f4")
        words = ("--angles", "10,77.5,100,200,-33")
        want = self.radon(a, *words, "--via", "radon.backward")
        np.testing.assert_allclose(self.radon(a, *words, "--via", "radon.forward"), want, rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(self.radon(a, *words, "--via", "radon.fourier", "--max-error", "1%"), want, atol=0.02)
        source = self.folder / "in.nrrd"
        for to in ((), ("--to", "hough", "--threshold", "0.5")):
            done = self.run_it("radon", source, "-o", "null:", "--quiet", *words, *to, "--verify=all", "--json", "-")
            self.assertLess(json.loads(done.stdout)["measured"]["error"]["nrmse"], 1e-6)

    def test_the_way_back_is_the_sum_that_is_written(self):
        for rows, offsets, shape in ((7, 21, (9, 13)), (12, 30, (21, 20)), (1, 9, (5, 5))):
            a = self.random.normal(size=(rows, offsets)).astype("<f4")
            degrees = 180 * np.arange(rows) / rows
            want = backprojected(a.astype("f8"), degrees, np.full(rows, np.pi / rows), shape)
            got = self.radon(a, "--inverse", "--size", f"{shape[1]}x{shape[0]}")
            np.testing.assert_allclose(got, want, atol=1e-6 * np.abs(want).max())
        degrees = np.array([3, 10, 95, 170, 40.5])
        a = self.random.normal(size=(5, 17)).astype("<f4")
        want = backprojected(a.astype("f8"), degrees, gaps(degrees), (11, 12))
        got = self.radon(a, "--inverse", "--angles", ",".join(map(str, degrees)), "--size", "12x11")
        np.testing.assert_allclose(got, want, atol=1e-6 * np.abs(want).max())
        self.assertAlmostEqual(gaps(degrees).sum(), np.pi)

    def test_it_is_verified(self):
        a = self.random.normal(size=(3, 14, 25)).astype("<f4")
        files.write_nrrd(self.folder / "v.nrrd", a)
        done = self.run_it("radon", self.folder / "v.nrrd", "-o", "null:", "--quiet", "--inverse", "--verify=all", "--json", "-")
        report = json.loads(done.stdout)
        self.assertLess(report["measured"]["error"]["nrmse"], 1e-6)
        self.assertEqual(report["request"]["to"], "image")

    def test_there_and_back_again(self):
        """A smooth image has little beyond half a cycle a sample, where the ramp ends. Linear reading
        between offsets loses (pi f)^2 / 6 of frequency f, which is below 1.1 % at f = 0.08, twice the
        width of a blob of S = 4 in frequencies (1 / (2 pi S)), and its ghosts are of that order."""
        image = blobs((64, 64), ((5, -8, 4, 1), (-12, 10, 5, 0.6), (0, 0, 9, 0.5))).astype("<f4")
        for spacing in (None, (0.5, 0.5)):
            sinogram = self.radon(image, "--angles", "128", spacing=spacing)
            back = self.radon(sinogram, "--inverse", "--size", "64x64", spacing=None if spacing is None else (0.5, 1))
            self.assertLess(np.sqrt(np.mean((back - image) ** 2)) / np.ptp(image), 0.011)
        degrees = np.sort(self.random.permutation(360)[:200] / 2)
        sinogram = self.radon(image, "--angles", ",".join(map(str, degrees)))
        back = self.radon(sinogram, "--inverse", "--angles", ",".join(map(str, degrees)), "--size", "64")
        self.assertLess(np.sqrt(np.mean((back - image) ** 2)) / np.ptp(image), 0.02)

    def test_a_disc_from_its_formula(self):
        """Integrals of a disc of radius R are 2 sqrt(R^2 - r^2). Away from the rim, where the ramp's
        end rings, it is 1 inside and 0 outside."""
        radius, offsets = 40, 129
        r = np.arange(offsets) - (offsets - 1) / 2
        rows = np.tile(2 * np.sqrt(np.maximum(0, radius**2 - r**2)), (200, 1)).astype("<f4")
        got = self.radon(rows, "--inverse", "--size", "101")
        y, x = np.meshgrid(*[np.arange(101) - 50] * 2, indexing="ij")
        away = np.hypot(x, y)
        self.assertLess(np.abs(got[away < radius - 4] - 1).max(), 0.03)
        self.assertLess(np.abs(got[(away > radius + 4) & (away < 48)]).max(), 0.03)
        # Samples of a root add up to its integral but for about R^-3/2, and reading linearly loses about as much.
        self.assertLess(abs(got[away < radius - 10].mean() - 1), radius**-1.5)

    def test_sizes(self):
        for side in (31, 32, 45, 64, 100, 128):
            sinogram = self.radon(np.ones((side, side), "<f4"), "--angles", "8")
            back = self.radon(sinogram, "--inverse")
            self.assertEqual(back.shape[0], back.shape[1])
            self.assertIn(back.shape[0] - side, (0,) if side % 2 == 0 else (-1, 0, 1))

    def test_what_is_refused(self):
        a = np.ones((8, 21), "<f4")
        self.assertIn("8 rows", self.radon(a, "--inverse", "--angles", "9", code=2))
        self.assertIn("8 rows", self.radon(a, "--inverse", "--angles", "0,30", code=2))
        self.assertIn("--inverse", self.radon(a, "--angles", "8", "--size", "9", code=2))
        self.assertIn("--to", self.radon(a, "--inverse", "--to", "hough", code=2))
        self.assertIn("--angles", self.radon(a, "--angles", "0,x", code=2))
        a[3, 4] = np.nan
        self.assertIn("not finite", self.radon(a, "--inverse", code=3))


if __name__ == "__main__":
    unittest.main()
