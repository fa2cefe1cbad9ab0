"""`--mode drr` beside exp(-0.0206 x the sum of max(0, 1 + HU / 1000)) in numpy. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import unittest

import files
import numpy as np
from running import DATA, Running, native


class Radiographs(Running):
    def picture(self, source, *words):
        out = self.folder / "out.nrrd"
        done = self.run_it("render", source, "-o", out, "--mode", "drr", "--json", "-", "--quiet", *native(words))
        self.report = json.loads(done.stdout)
        return files.read(out)[0, ..., 0]

    def volume(self, a, spacing=(1, 1, 1)):
        path = self.folder / "v.nii"
        files.write_nifti(path, a, spacing=spacing)
        return path

    def test_columns_of_one_value(self):
        columns = np.random.default_rng(1).integers(-1500, 2500, (9, 12)).astype("<i2")
        a = np.repeat(columns[None], 30, 0)
        got = self.picture(self.volume(a, (0.8, 0.8, 2.5)), "--view", "z", "--via", "project.ray_cast/filter=zoh/step=1")
        want = np.exp(-0.0206 * 30 * 2.5 * np.maximum(0, 1 + columns / 1000.0))
        np.testing.assert_allclose(got, want, rtol=2e-5)

    def test_water_and_air(self):
        for value, share in ((-1000, 1), (-3000, 1), (0, np.exp(-0.0206 * 40))):
            got = self.picture(self.volume(np.full((40, 8, 8), value, "<i2")), "--view", "z")
            np.testing.assert_allclose(got, share, rtol=1e-5)

    def test_rays_that_miss_keep_all_light(self):
        got = self.picture(self.volume(np.zeros((20, 20, 20), "<i2")), "--rotate", "0,0,45", "--size", "40x40", "--spacing", "1")
        self.assertEqual(got[0, 0], 1)
        self.assertLess(got[20, 20], 0.7)

    def test_error_of_a_chest_is_as_predicted(self):
        self.picture(DATA / "ct_chest" / "chest.nrrd", "--rotate", "10,20,0", "--size", "128x128", "--max-error", "0.02", "--verify")
        error, predicted = self.report["measured"]["error"], self.report["plan"]["predicted"]["error"]
        self.assertLess(error["low"], 2 * predicted)
        self.assertLess(error["nrmse"], 0.02)


if __name__ == "__main__":
    unittest.main()
