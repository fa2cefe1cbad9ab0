"""Promised errors hold, and are not far above what is measured, where a few pixels that jump carry the error: modes with a level."""
import json
import unittest

import running
from running import DATA

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
        for volume, level, budget, size in ((neuron, 200, ".02", "240x240"), (engine, 200, ".02", "180x180")):
            self.check("render", volume, "--mode", "binary", "--isovalue", level, "--max-error", budget, "--size", size)

    def test_a_budget_below_one_jump_needs_a_path_without_any(self):
        # One of 48 x 48 pixels that jumps is an error of 0.02.
        for level in ("0.3", "0.55", "0.71"):
            promised, measured = self.check("render", "phantom:gaussians:48", "--mode", "binary", "--isovalue", level, "--rotate", "20,30,10",
                                            "--size", "48", "--max-error", "0.01")
            self.assertLess(max(promised, measured), 0.01)

    def test_drawn_meshes(self):
        for volume, level, view in ((DATA / "ct_head/quarter.nhdr", 400, "20,30,0"), (DATA / "carotid/carotid.vtk", 180, "0,0,0"),
                                    ("phantom:marschner-lobb:41", .5, "60,10,0")):
            self.check("render", volume, "--mode", "surface", "--isovalue", level, "--rotate", view, "--size", "56x50", "--via",
                       "surface.draw", "--max-error", "9")


if __name__ == "__main__":
    unittest.main()
