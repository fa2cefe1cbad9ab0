"""`--mode drr` through spectra beside f64 sums in numpy and scipy. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import unittest

import files
import numpy as np
from running import DATA, Running, native
from scipy.ndimage import map_coordinates

WATER = 0.0206  # attenuation [1 / mm]
SLICE = ["--via", "spectrum.slice"]
FINE = ["--via", "spectrum.forward/width=8/padding=2", *SLICE, "--max-error", "9", "--without", "store"]


def turn3(x, y, z):
    """About x, then y, then z."""
    (cx, sx), (cy, sy), (cz, sz) = ((np.cos(a), np.sin(a)) for a in np.radians((x, y, z)))
    return (np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
            @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]))


def body(shape, spacing):
    """Soft tissue with bone in it, air towards the faces [HU]; smooth in mm and along every axis."""
    random = np.random.default_rng(4)
    mm = [(np.arange(n) - (n - 1) / 2) * s for n, s in zip(shape, spacing[::-1])]
    a = np.zeros(shape)
    for height in (1900, 1700, 2600, 2100):
        at = [random.uniform(-0.1, 0.1) * n * s for n, s in zip(shape, spacing[::-1])]
        width = 2.2 * max(spacing)
        r2 = ((mm[0] - at[0])**2)[:, None, None] + ((mm[1] - at[1])**2)[:, None] + (mm[2] - at[2])**2
        a += height * np.exp(-r2 / (2 * width**2))
    a[a < 1e-3] = 0
    return (a - 1000).astype("<f4")


def tolerance(want, axes, width):
    """Of exponents up to the largest: what a spline through Gaussians has beyond 3/4 of a cycle along so many axes, on both sides.
    It keeps at most 0.01027 s^4 + 0.077 s^6 of what repeats about a whole cycle, s = sin(pi f), f the distance from it."""
    largest = -np.log(want.min())
    assert largest > 0.3, "there is something to see"
    return axes * 2 * (0.01027 * 3 / 16 / width**4 + 0.077 * 15 / 64 / width**6) * largest


class RadiographsBySpectra(Running):
    def picture(self, source, *words):
        out = self.folder / "out.nrrd"
        done = self.run_it("render", source, "-o", out, "--mode", "drr", "--json", "-", "--quiet", *native(words))
        self.report = json.loads(done.stdout)
        return files.read(out)[0, ..., 0].astype(float)

    def volume(self, a, spacing=(1, 1, 1), name="v.nii"):
        path = self.folder / name
        files.write_nifti(path, a, spacing=spacing)
        return path

    def test_axis_view_of_anisotropic_samples(self):
        spacing = (0.8, 0.8, 1.7)
        a = body((34, 60, 63), spacing)
        got = self.picture(self.volume(a, spacing), "--view", "z", *FINE)
        want = np.exp(-WATER * spacing[2] * (1 + a.astype(float) / 1000).sum(0))
        np.testing.assert_allclose(got, want, rtol=0, atol=tolerance(want, 2, 2.2 * 1.7 / 0.8))

    def test_oblique_views(self):
        for spacing, angles in (((1, 1, 1), (20, 35, -10)), ((0.9, 0.9, 1.4), (-50, 15, 70))):
            a, side, step = body((34, 40, 42), spacing), 48, 0.25
            got = self.picture(self.volume(a, spacing), "--rotate", ",".join(map(str, angles)), "--size", f"{side}x{side}",
                               "--spacing", "1", *FINE)
            turn, size, apart = turn3(*angles), np.array(a.shape[::-1]), np.array(spacing)
            deep = np.abs(turn[2]) @ (size * apart) / 2
            z = np.arange(-deep + step / 2, deep, step)
            at = np.arange(side) - (side - 1) / 2
            zz, yy, xx = np.meshgrid(z, at, at, indexing="ij")
            mm = np.tensordot(turn.T, np.stack([xx, yy, zz]), 1)
            p = mm / apart[:, None, None, None] + ((size - 1) / 2)[:, None, None, None]
            above = map_coordinates(1 + a.astype(float) / 1000, p[::-1], order=3, mode="constant")
            want = np.exp(-WATER * step * above.sum(0))
            np.testing.assert_allclose(got, want, rtol=0, atol=tolerance(want, 3, 2.2))

    def test_refuses_what_it_would_get_wrong(self):
        a = np.full((12, 13, 14), -1000, "<i2")
        a[4:8, 4:8, 4:8] = 50
        source, out = self.volume(a), self.folder / "o.nrrd"
        self.picture(source, *SLICE, "--max-error", "9")
        for low in (-1001, -1024, -3024):
            a[0, 0, 0] = low
            done = self.run_it("render", self.volume(a), "-o", out, "--mode", "drr", *SLICE, "--quiet", code=3)
            self.assertIn(f"drr cuts off some of the values from {low} to 50", done.stderr.decode())
            self.picture(source, "--max-error", "9")  # casts rays
        a[0, 0, 0] = -1000
        for words in (["--depth-cue", "0.01,exp"], ["--perspective", "20"]):
            with self.subTest(words):
                done = self.run_it("render", self.volume(a), "-o", out, "--mode", "drr", *SLICE, *words, "--quiet",
                                   code=2 if words[0] == "--depth-cue" else 3)
                self.assertTrue(done.stderr)

    def test_errors_are_as_predicted(self):
        smooth = self.volume(body((30, 33, 36), (1, 1, 1.3)), (1, 1, 1.3), "smooth.nii")
        flat = self.volume(np.zeros((20, 24, 22), "<i2"), name="flat.nii")
        for source, windows in ((DATA / "ct_chest" / "chest.nrrd", ("width=6/padding=2", )),
                                (DATA / "ct_head" / "quarter.nhdr", ("width=4/padding=1.25", )),
                                (smooth, ("width=3/padding=1.25", "width=5/padding=1.5")),
                                (flat, ("width=4/padding=1.25", ))):
            for window in windows:
                for angles in ("0,0,0", "10,20,0")[source.name[0] in "sf":]:
                    with self.subTest(source=source.name, window=window, angles=angles):
                        self.picture(source, "--rotate", angles, "--size", "64x64", "--verify", "--max-error", "9", "--via",
                                     f"spectrum.forward/{window}", *SLICE)
                        error = self.report["measured"]["error"]["nrmse"]
                        predicted = self.report["plan"]["predicted"]["error"]
                        self.assertLess(error, predicted)
                        self.assertGreater(error, predicted / 20)

    def planned(self, source, *words):
        done = self.run_it("plan", "render", source, "--mode", "drr", "--size", "64x64", "--spacing", "1", "--json", "-", "--quiet", *words)
        plan = json.loads(done.stdout)["plan"]
        return plan["predicted"]["seconds"], " ".join(step["transition"] for step in plan["steps"])

    def test_the_planner_takes_it_where_it_is_cheapest(self):
        source, taken_for = self.volume(body((64, 64, 64), (1, 1, 1)), name="larger.nii"), set()
        for views, error in ((1, "0.01"), (90, "0.0003")):
            words = ["--turntable", views, "--max-error", error]
            taken, path = self.planned(source, *words)
            by_slices, _ = self.planned(source, *words, *SLICE)
            without, _ = self.planned(source, *words, "--without", "spectrum.forward", "--without", "spectrum.wide")
            self.assertLessEqual(taken, 1.0001 * min(by_slices, without), (views, path))
            if "spectrum.slice" in path:
                taken_for.add(views)
        self.assertEqual(taken_for, {90})


if __name__ == "__main__":
    unittest.main()
