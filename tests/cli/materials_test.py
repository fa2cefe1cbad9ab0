"""Volumes of materials (Drebin, Carpenter, Hanrahan 1988): what a sample between two materials emits and hides. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import Running, native

RED, BLUE = (1, 0, 0), (0, 0, 1)
VIA = ("--via", "shade.materials")


class Materials(Running):
    def transfer(self, points):
        file = self.folder / "materials.json"
        file.write_text(json.dumps({"points": [{"value": v, "opacity": a, "color": c} for v, a, c in points], "unit": 1}))
        return file

    def picture(self, volume, *words):
        files.write_nrrd(self.folder / "v.nrrd", volume.astype("<f4"))
        out = self.folder / "out.nrrd"
        self.run_it("render", self.folder / "v.nrrd", "--mode", "composite", "--background", "none", *native(words), "-o", out)
        return files.read(out)[0].astype(float)

    def test_colours_are_mixed_by_what_materials_hide(self):
        file = self.transfer([(0, 0.2, RED), (50, 0.6, BLUE)])
        for value in (0, 10, 25, 50, 60):
            share = min(1, value / 50)
            of_red, of_blue = (1 - share) * 0.2, share * 0.6
            middle = self.picture(np.full((4, 6, 6), value), "--transfer", file, *VIA)[3, 3]
            opacity = of_red + of_blue
            # Four samples of the same colour; f32 has 24 bits, and a warp's weights are rounded too.
            np.testing.assert_allclose(middle[3], 1 - (1 - opacity) ** 4, atol=1e-5)
            np.testing.assert_allclose(middle[:3] / middle[:3].sum(), np.array([of_red, 0, of_blue]) / opacity, atol=1e-5)

    def test_surfaces_lie_where_opacity_changes(self):
        """Two materials that hide alike have no surface between them, and so only ambient light."""
        z = np.arange(16)[:, None, None] + np.zeros((16, 8, 8))
        words = ("--shade", "phong", "--rotate", "40,0,0", "--material", "0.2,0.8,0,1", *VIA)
        alike = self.picture(10 * z, "--transfer", self.transfer([(0, 0.3, (1, 1, 1)), (160, 0.3, (1, 1, 1))]), *words)
        seen = alike[..., 3] > 0.1
        self.assertGreater(seen.sum(), 20)
        light = alike[..., 0][seen]
        self.assertLess(light.max(), 0.2 * 1.02)
        differ = self.picture(10 * z, "--transfer", self.transfer([(0, 0.02, (1, 1, 1)), (160, 0.6, (1, 1, 1))]), *words)
        self.assertGreater(differ[..., 0].max(), 0.4)

    def test_it_is_measured_and_refused_where_it_cannot(self):
        files.write_nrrd(self.folder / "v.nrrd", np.random.default_rng(1).random((12, 12, 12)).astype("<f4"))
        file = self.transfer([(0, 0, RED), (1, 0.3, BLUE)])
        words = ("render", self.folder / "v.nrrd", "--mode", "composite", "--transfer", file, *VIA, "-o", "null:")
        report = json.loads(self.run_it(*words, "--verify", "--json", "-", "--max-error", "9").stdout)
        self.assertGreater(report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"] / 2)
        self.run_it(*words, "--perspective", "30", code=3)


if __name__ == "__main__":
    unittest.main()
