"""Levels on plateaus, at the least or the largest value, and samples halfway between neighbours: rounding must not decide what is promised."""
import json
import unittest

import files
import numpy as np
import running

SPIKES = {"u1": (0, 255), "i2": (-1000, 4000), "f4": (-.7, 3.1)}
ROUNDING = 2e-5  # f32 and weights of 14 bits: what edges promise in any case


def spikes(dtype, shape, seed):
    """A few samples above a plateau."""
    low, high = SPIKES[dtype]
    rng = np.random.default_rng(seed)
    a = np.full(shape, low, dtype)
    a[rng.random(shape) < .01] = high
    return a


class Plateaus(running.Running):
    def report(self, a, mode, level, *words):
        path, out = self.folder / "in.nrrd", self.folder / "out.nrrd"
        files.write_nrrd(path, a)
        report = json.loads(self.run_it("render", path, "-o", out, "--mode", mode, "--isovalue", repr(float(level)), *words, "--verify=all",
                                        "--json", "-").stdout)
        told = report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"]
        self.assertLessEqual(told[1], told[0] + ROUNDING, (a.dtype, mode, level, words))
        return *told, files.read(out)

    def test_a_plateau_at_the_level_reaches_it(self):
        for seed, (dtype, shape) in enumerate((("u1", (9, 12, 10)), ("i2", (10, 10, 10)), ("f4", (8, 11, 14)))):
            a = spikes(dtype, shape, seed)
            for turn in ("0,0,0", "0,0,180", "180,0,0"):
                for level in (a.min(), a.max()):
                    size = ["--size", f"{shape[2]}x{shape[1]}", "--rotate", turn]
                    promised, measured, picture = self.report(a, "binary", level, *size)
                    if level == a.min():  # every ray, by any filter and as the spline has it
                        self.assertLessEqual(max(promised, measured), ROUNDING, (dtype, turn))
                        self.assertTrue((picture > .5).all(), (dtype, turn))

    def test_flat_tops_are_told_by_numpy(self):
        """Cells of 5 samples at the level: the ray through their middle reaches it, one far from them does not."""
        for dtype, level in (("u1", 200), ("i2", -300), ("f4", .1)):
            a = np.full((16, 15, 14), level - 100 if dtype != "f4" else -.5, dtype)
            a[4:9, 3:8, 5:10] = level
            for mode in ("binary", "surface"):
                _, _, picture = self.report(a, mode, level, "--size", "14x15", "--max-error", ".5")
                reached = picture.reshape(15, 14, -1).max(-1) > 0
                self.assertTrue(reached[4:7, 6:9].all(), (dtype, mode))
                self.assertFalse(reached[:, :3].any() or reached[10:].any(), (dtype, mode))

    def test_halfway_between_samples(self):
        rng = np.random.default_rng(4)
        for shape, size, turn in (((12, 12, 12), "13x13", "90,0,0"), ((9, 14, 11), "12x12", "0,90,0"), ((10, 8, 12), "11x9", "0,0,180")):
            a = rng.integers(0, 256, shape).astype(np.uint8)
            for mode in ("binary", "surface"):
                for level in (120, 230):
                    self.report(a, mode, level, "--size", size, "--rotate", turn, "--via", "project.ray_cast/filter=zoh", "--max-error", "9")


if __name__ == "__main__":
    unittest.main()
