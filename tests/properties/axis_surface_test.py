"""First hits of surfaces seen along an axis beside scipy's splines: levels that samples have, rays through samples, hits where a
ray hardly touches the surface. Needs EDGEWISE."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import files  # noqa: E402

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
LIGHT = np.array([-.5, -.5, -1]) / np.linalg.norm([-.5, -.5, -1])
EYE = np.array([0, 0, -1.])
AMBIENT, DIFFUSE, SPECULAR, EXPONENT = .2, .9, .2, 20
EDGE_ON = 1 / 64


def light_of(gradient):
    """Of a gradient in screen space (docs/light.md)."""
    normal = gradient / np.linalg.norm(gradient)
    normal = -normal if normal @ LIGHT < 0 else normal
    facing, seen = normal @ LIGHT, np.clip((1 + normal @ EYE / EDGE_ON) / 2, 0, 1)
    return AMBIENT + seen * (DIFFUSE * facing + SPECULAR * max(0, 2 * facing * (normal @ EYE) - LIGHT @ EYE) ** EXPONENT)


class Spline:
    """The cubic spline through samples that are mirrored at the outermost ones, and held beyond them."""

    def __init__(self, samples):
        self.coefficients, self.last = ndimage.spline_filter(samples, 3, mode="mirror"), samples.shape[0] - 1

    def at(self, places):
        """places [n, 3] in x, y, z"""
        held = np.clip(places, 0, self.last)
        return ndimage.map_coordinates(self.coefficients, held[:, ::-1].T, order=3, mode="mirror", prefilter=False)

    def gradient(self, place, step=1e-5):
        """From inside where the place is at a face."""
        gradient = np.zeros(3)
        for axis in range(3):
            low, high = np.array(place), np.array(place)
            low[axis], high[axis] = max(0, place[axis] - step), min(self.last, place[axis] + step)
            a, b = self.at(np.array([low, high]))
            gradient[axis] = (b - a) / (2 * step)
        return gradient


def picture(samples, level, turn):
    """[y, x] light of first hits; 0: none."""
    n, field = samples.shape[0], Spline(samples)
    level -= 1e-6 * np.abs(samples).max()
    middle, t = (n - 1) / 2, np.concatenate([[-n / 2], np.arange(-n / 2 + 1 / 16, n / 2, 1 / 8), [n / 2]])
    lit = np.zeros((n, n))
    for y in range(n):
        for x in range(n):
            along = lambda t: (turn @ np.stack([np.full_like(t, x - middle), np.full_like(t, y - middle), t])).T + middle
            above = field.at(along(t)) >= level
            passed = np.nonzero(above[1:] != above[:-1])[0]
            if not len(passed):
                continue
            low, high = t[passed[0]], t[passed[0] + 1]
            for _ in range(40):
                half = (low + high) / 2
                if (field.at(along(np.array([half])))[0] >= level) == above[passed[0]]:
                    low = half
                else:
                    high = half
            lit[y, x] = light_of(turn.T @ field.gradient(along(np.array([high]))[0]))
    return lit


class AxisSurfaceTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, self.folder)
        self.env = {**os.environ, "XDG_CONFIG_HOME": str(self.folder / "config"), "XDG_CACHE_HOME": str(self.folder / "cache")}

    def rendered(self, samples, level, angles):
        files.write_nrrd(self.folder / "in.nrrd", samples, np.ones(3), None, np.zeros(3))
        words = ["render", self.folder / "in.nrrd", "-o", self.folder / "out.nrrd", "--mode", "surface", "--isovalue", repr(level),
                 "--rotate", ",".join(map(str, angles)), "--size", f"{samples.shape[0]}x{samples.shape[0]}", "--max-error", "10",
                 "--via", "project.ray_cast/filter=bspline3/step=0.125", "--quiet"]
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=100, env=self.env)
        self.assertEqual(done.returncode, 0, done.stderr.decode(errors="replace"))
        return files.read_nrrd(self.folder / "out.nrrd")[0][..., 0]

    def test_light_of_first_hits(self):
        rng = np.random.default_rng(11)
        off, pixels = [], 0
        for n, dtype, angles in ((15, "u1", (0, 0, 0)), (11, "f4", (0, 0, 90)), (14, "u2", (180, 0, 0)), (13, "i2", (90, 0, 0)), (12, "f4", (0, 270, 0))):
            smooth = ndimage.gaussian_filter(rng.standard_normal((n, n, n)), .8, mode="mirror")
            scaled = (smooth - smooth.min()) / np.ptp(smooth)
            samples = np.rint(20 * scaled).astype(dtype) if np.dtype(dtype).kind != "f" else (scaled * 7 - 3).astype(dtype)
            level = float(np.sort(samples, axis=None)[int(.7 * samples.size)])  # that of samples, of integers of many
            turn = np.rint(Rotation.from_euler("xyz", [-a for a in angles], degrees=True).as_matrix())
            got, want = self.rendered(samples, level, angles), picture(samples.astype(float), level, turn)
            with self.subTest(n=n, dtype=dtype, angles=angles):
                self.assertGreater((want > 0).sum(), n * n / 4)
                self.assertEqual(((got > 0) != (want > 0)).sum(), 0)
            off.append(np.abs(got - want).ravel())
            pixels += n * n
        off = np.concatenate(off)
        # Where a ray only touches the surface, at samples of the level, f32 tells a millionth of the values: that moves the hit by
        # some hundredths of how far it lies before the sample, and turns the light with it. None jumps to the other side.
        self.assertLess(off.max(), .05)
        self.assertLess((off > 1e-3).sum(), pixels / 30)


if __name__ == "__main__":
    unittest.main()
