"""Samples of wide types that few bits hold: results go through 8 and 16 bits and come out as they would from the wide type. Needs
EDGEWISE."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from scipy import ndimage

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "properties"))
import files  # noqa: E402

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
SHAPE = (7, 21, 26)


def inputs():
    rng = np.random.default_rng(3)
    few, more = rng.integers(0, 50, SHAPE), rng.integers(0, 40000, SHAPE)
    yield "i32, 50 values by 10^9", (few + 1_000_000_007).astype("i4")
    yield "u32, 40000 values at the upper end", (more.astype("i8") + 2 ** 32 - 40001).astype("u4")
    yield "i32, 40000 values below -10^9", (more - 1_500_000_001).astype("i4")
    yield "f64, 50 values that f32 rounds", few / 7 + 1 / 3
    yield "f64, a constant", np.full(SHAPE, -0.16371105966484736)


class WideValuesTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, self.folder)
        self.env = {**os.environ, "XDG_CONFIG_HOME": str(self.folder / "config"), "XDG_CACHE_HOME": str(self.folder / "cache")}

    def filtered(self, op, *via):
        out = self.folder / "out.nrrd"
        words = ["filter", self.folder / "in.nrrd", "-o", out, "--op", op, "--kernel", "box:1", "--border", "clamp", *via, "--quiet"]
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=100, env=self.env)
        if done.returncode == 3:  # these bits do not hold these values
            return None
        self.assertEqual(done.returncode, 0, done.stderr.decode(errors="replace"))
        return files.read_nrrd(out)[0]

    def test_values_are_those_of_the_wide_type(self):
        checked = 0
        for name, a in inputs():
            files.write_nrrd(self.folder / "in.nrrd", a, np.ones(3), None, np.zeros(3))
            for op, by in (("median", ndimage.median_filter), ("dilate", ndimage.maximum_filter)):
                want = by(a, 3, mode="nearest")
                for bits in ("", "u8", "u16"):
                    got = self.filtered(op, *(["--via", f"store.precision/type={bits}"] if bits else []))
                    if got is None:
                        self.assertTrue(bits)
                        continue
                    checked += 1
                    self.assertEqual(got.dtype, a.dtype)
                    # Eight bits of values that are not evenly spaced are rounded, as was asked for.
                    rounded = bits and a.dtype.kind == "f" and np.ptp(a) > 0
                    most = np.ptp(a) / 255 if rounded else 0
                    with self.subTest(name, op=op, bits=bits):
                        self.assertLessEqual(np.abs(got.astype(float) - want.astype(float)).max(), most)
        self.assertGreater(checked, 12)


if __name__ == "__main__":
    unittest.main()
