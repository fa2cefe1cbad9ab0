"""FIGURES 75 to 79 of the thesis: errors of turned bodies against the angle, where they lie, noise, and magnified samples.

Of 75 to 77 the text prints numbers for 45 degrees (TABLE 22) and orders for all angles. 78 and 79 are photographs of data that are not
given: only what the text says of their filters is asserted, on the bundled angiography. tables21_22_test.cpp has the means of the
thesis's own multipass. Needs EDGEWISE and EDGEWISE_DATA."""

import functools
import itertools
import os
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(os.environ.get("EDGEWISE_TESTS", pathlib.Path(__file__).parents[1])) / "stability"))
from driving import DATA, Driven, grid, main, turn3, via  # noqa: E402

SIDE, WHITE = 128, 65535
ANGLES = (15, 45)
PATHS = {"zoh": "warp.backward/filter=zoh", "multipass": "warp.shear/filter=foh", "foh": "warp.backward/filter=foh"}


def sphere(at):
    return WHITE * np.maximum(0, 1 - np.sqrt(np.sum(np.square(at), 0)) / 32)


def cube(at):
    return np.where(np.abs(at).max(0) <= 31.5, float(WHITE), 0.0)


BODIES = {"cube": cube, "sphere": sphere}


class TurnedBodies(Driven):
    @functools.lru_cache(maxsize=None)
    def truth(self, body, degrees):
        back = np.linalg.inv(turn3(degrees, degrees, degrees)).astype("f8")
        return BODIES[body](np.einsum("ij,j...->i...", back, grid((SIDE,) * 3)))

    @functools.lru_cache(maxsize=None)
    def rays(self, body, name, degrees):
        """Sums of absolute differences along z [y, x]."""
        samples = np.rint(BODIES[body](grid((SIDE,) * 3))).astype("<u2")
        made = self.warp(samples, "--rotate", ",".join([str(degrees)] * 3), *via(PATHS[name]))
        return np.abs(made - self.truth(body, degrees)).sum(0)

    def test_figure_75_cube(self):
        # A ray enters the cube and leaves it, and at 45 degrees nearest samples are wrong there by one whole sample at most.
        self.assertEqual(self.rays("cube", "zoh", 45).max(), 131070)
        # The order of the three turns shows in that: by x, z, y or z, y, x five border samples fall on one ray (327675).
        self.assertAlmostEqual(self.rays("cube", "zoh", 45).mean(), 48372, delta=0.0005 * 48372)
        # The exact trilinear sums differ by 0.16 % from the printed mean. The printed maximum, 172078, is not reached
        # (docs/gallery.md): here only that it is larger than that of nearest samples, as in the figure.
        self.assertAlmostEqual(self.rays("cube", "foh", 45).mean(), 48309, delta=0.002 * 48309)
        self.assertTrue(131070 < self.rays("cube", "foh", 45).max() <= 172078)
        for degrees in ANGLES:
            self.assertLess(self.rays("cube", "foh", degrees).mean(), self.rays("cube", "multipass", degrees).mean())

    def test_figure_76_sphere(self):
        # The places of rays beside the rim and the tip, which rounding to 16 bits and the last bit of a turn move, decide a maximum.
        # By the exact turn, evaluated with numpy, it is 42032 and 3456: 0.35 % and 1.3 % from the printed ones.
        self.assertAlmostEqual(self.rays("sphere", "zoh", 45).max(), 41886, delta=0.004 * 41886)
        self.assertAlmostEqual(self.rays("sphere", "foh", 45).max(), 3501, delta=0.014 * 3501)
        self.assertAlmostEqual(self.rays("sphere", "zoh", 45).mean(), 3977, delta=0.001 * 3977)
        self.assertAlmostEqual(self.rays("sphere", "foh", 45).mean(), 259, delta=0.01 * 259)
        for degrees in ANGLES:  # the order of the curves
            most = [self.rays("sphere", name, degrees).max() for name in ("foh", "multipass", "zoh")]
            self.assertEqual(most, sorted(most), degrees)
        # "A mean error that remains the same across view angles": of nearest samples within what they have less beside the axes.
        for body, name in itertools.product(BODIES, ("zoh", "foh")):
            means = [self.rays(body, name, degrees).mean() for degrees in ANGLES]
            self.assertLess(max(means) / min(means), 1.1, (body, name))

    def test_figure_77_where_errors_lie(self):
        # "The zero order hold has more error on the sphere than the multipass shear, but less error on the cube."
        self.assertGreater(self.rays("sphere", "zoh", 45).mean(), self.rays("sphere", "multipass", 45).mean())
        self.assertLess(self.rays("cube", "zoh", 45).mean(), self.rays("cube", "multipass", 45).mean())
        # "Error ramped from the maximum errors": trilinear samples of the sphere stay in the lowest twelfth of that range.
        self.assertLess(self.rays("sphere", "foh", 45).max(), self.rays("sphere", "zoh", 45).max() / 12)
        # "Low error across the whole image": the share of the sphere's rays above a twentieth of that range, by numpy's own trilinear turn
        # 0.064. The multipass has a quarter of them there, nearest samples nearly all.
        far = np.hypot(*grid((SIDE, SIDE)))
        above = [np.mean(self.rays("sphere", name, 45)[far < 32] > 41886 / 20) for name in ("foh", "multipass", "zoh")]
        self.assertLess(above[0], 0.07)
        self.assertGreater(above[1], 3 * above[0])
        self.assertGreater(above[2], 0.9)
        # Outside the bodies there is nothing to be wrong about, nor a sample that reaches there.
        for name in PATHS:
            self.assertEqual(self.rays("sphere", name, 45)[far > 36].max(), 0, name)


class Angiography(Driven):
    """The thesis's 256 x 256 x 28 samples are not printed."""
    FILE = pathlib.Path(DATA) / "carotid/carotid.vtk"
    VIEW = ("--mode", "mip", "--rotate", "20,30,0", "--max-error", "9")

    def test_figure_78_the_maximum_keeps_the_noise_between_vessels(self):
        cast = via("project.ray_cast/filter=foh/step=1")
        most = self.render(self.FILE, *self.VIEW, "--spacing", "1", "--size", "96x96", *cast)
        mean = self.render(self.FILE, "--mode", "mean", *self.VIEW[2:], "--spacing", "1", "--size", "96x96", *cast)
        held = mean > 0
        quiet = held & (most < 0.6 * most.max())
        # Rays without a vessel: their maximum, the noise, has a quarter of the range (0.257 here), and is above the mean of the same ray by a
        # third (1.37 times).
        self.assertTrue((most[held] >= mean[held] * (1 - 1e-5)).all())
        self.assertGreater(np.median(most[quiet]), 0.2 * most.max())
        self.assertGreater(np.median(most[quiet] / mean[quiet]), 1.25)

    def test_figure_79_magnified_eight_times(self):
        at = ("--spacing", "0.125", "--size", "400x260")
        pictures = {hold: self.render(self.FILE, *self.VIEW, *at, *via(f"project.ray_cast/filter={hold}/step=1")).astype("f8")
                    for hold in ("zoh", "foh")}
        # Nearest samples: a pixel is a sample of the file. Most pixels have a neighbour with the same value; of linear ones nearly none have.
        samples = np.unique(np.frombuffer(self.FILE.read_bytes().split(b"LOOKUP_TABLE default\n", 1)[1], ">f4", count=76 * 49 * 45))
        self.assertTrue(np.isin(pictures["zoh"].astype("f4"), samples.astype("f4")).all())
        same = {hold: np.mean(np.diff(picture, axis=1) == 0) for hold, picture in pictures.items()}
        self.assertGreater(same["zoh"], 0.6)
        self.assertLess(same["foh"], 0.05)
        # A linear step to the next pixel is at most an eighth of the largest difference of samples along each of the three axes.
        values = np.frombuffer(self.FILE.read_bytes().split(b"LOOKUP_TABLE default\n", 1)[1], ">f4", count=76 * 49 * 45).reshape(45, 49, 76)
        steepest = sum(np.abs(np.diff(values.astype("f8"), axis=axis)).max() for axis in range(3)) / 8
        self.assertLess(np.abs(np.diff(pictures["foh"], axis=1)).max(), steepest)
        self.assertGreater(np.abs(np.diff(pictures["zoh"], axis=1)).max(), np.abs(np.diff(pictures["foh"], axis=1)).max() * 3)


if __name__ == "__main__":
    main()
