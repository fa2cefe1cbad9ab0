"""Promised errors hold, and are not far above what is measured, where a few pixels that jump carry the error: modes with a level."""
import json
import pathlib
import sys
import unittest

import running
from running import DATA

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "benchmarks"))
import promises  # noqa: E402

ROUNDING = 2e-5  # f32 and weights of 14 bits: what edges promise in any case


class Promises(running.Running):
    def report(self, *words):
        return json.loads(self.run_it(*words, "-o", "null:", "--verify=all", "--json", "-").stdout)

    def check(self, *words):
        report = self.report(*words)
        promised, measured = report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"]
        self.assertLessEqual(measured, 1.1 * promised + 1e-9, words)
        if measured > ROUNDING:
            self.assertLessEqual(promised, 3 * measured, words)
        return promised, measured

    def test_silhouettes_that_few_drawn_pixels_meet(self):
        neuron, engine = DATA / "neuron/neuron.tif", DATA / "engine/engine.nii.gz"
        for volume, level, budget, size in ((neuron, 200, ".02", "240x240"), (neuron, 60, ".05", "240x240"), (engine, 200, ".02", "180x180")):
            self.check("render", volume, "--mode", "binary", "--isovalue", level, "--max-error", budget, "--size", size)

    def test_a_budget_below_one_jump_needs_a_path_without_any(self):
        # One of 48 x 48 pixels that jumps is an error of 0.02.
        for level in ("0.3", "0.55", "0.71"):
            promised, measured = self.check("render", "phantom:gaussians:48", "--mode", "binary", "--isovalue", level, "--rotate", "20,30,10",
                                            "--size", "48", "--max-error", "0.01")
            self.assertEqual(measured, 0)
            self.assertLess(promised, 0.01)

    def test_drawn_meshes(self):
        for volume, level, view in ((DATA / "ct_head/quarter.nhdr", 400, "20,30,0"), (DATA / "carotid/carotid.vtk", 180, "0,0,0"),
                                    ("phantom:marschner-lobb:41", .5, "60,10,0")):
            self.check("render", volume, "--mode", "surface", "--isovalue", level, "--rotate", view, "--size", "56x50", "--via",
                       "surface.draw", "--max-error", "9")

    def test_random_requests(self):
        """As benchmarks/promises.py draws them, of kinds whose pixels jump."""
        seed, count, kinds = 20, 40, ["binary", "surface", "mip", "composite", "warp-labels"]
        ran = [promises.run(seed, i, kinds, self.folder, 2) for i in range(count)]
        for each in ran:
            self.assertIn(each.code, (0, 3), each)
        judged = [each for each in ran if each.code == 0 and each.promised is not None and each.measured is not None]
        self.assertGreaterEqual(len(judged), count // 2)
        for each in judged:
            self.assertLessEqual(each.measured, 1.1 * each.promised + 1e-9, each)
            self.assertLessEqual(each.measured, each.budget, each)
        far = [each for each in judged if each.measured > ROUNDING and each.promised > 3 * each.measured]
        self.assertLessEqual(len(far), len(judged) // 10, far)


if __name__ == "__main__":
    unittest.main()
