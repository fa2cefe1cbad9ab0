"""Shaded and composite pictures by default show no rings: against pictures with steps of 1/16, a plane, and a ball of
which the light has a closed form. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import unittest

import numpy as np
from files import read_tiff, write_nrrd
from running import DATA, Running
from scipy.ndimage import uniform_filter

LEVELS = 8  # of 255: what colours may differ by where samples lie
BUNDLED = ["mr_brain/MR.nii.gz", "ct_chest/chest.nrrd", "ct_head/quarter.nhdr", "engine/engine.nii.gz", "neuron/neuron.tif",
           "carotid/carotid.vtk", "hydrogen/hydrogen.vti"]


class Rings(Running):
    def picture(self, file, *options):
        """Colours as they are shown, 0 to 255 [y, x, 3], and the report."""
        out = self.folder / "picture.tif"
        done = self.run_it("render", file, "--size", "384", "-o", out, "--bits", "32", *options, "--json", "-")
        colours = read_tiff(out.read_bytes())
        return 255 * np.clip(np.squeeze(colours)[..., :3], 0, 1), json.loads(done.stdout)

    def step(self, report):
        return report["plan"]["steps"][-1]["parameters"]["step"]

    def test_bundled_data(self):
        for name in BUNDLED:
            for mode in ("shaded", "composite"):
                shown, report = self.picture(DATA / name, "--mode", mode)
                fine, _ = self.picture(DATA / name, "--mode", mode, "--via", "project.ray_cast/filter=foh/step=0.0625", "--max-error", "10")
                ring = np.abs(uniform_filter(shown - fine, (3, 3, 0)))
                with self.subTest(data=name, mode=mode):
                    # No step is shorter than 1/8: of data that are steeper some rings are left, and most are gone.
                    most = LEVELS
                    if self.step(report) == 0.125:
                        rough, _ = self.picture(DATA / name, "--mode", mode, "--via", "project.ray_cast/filter=foh/step=1")
                        most = max(most, np.quantile(np.abs(uniform_filter(rough - fine, (3, 3, 0))), 0.999) / 8)
                    self.assertLessEqual(np.quantile(ring, 0.999), most)

    def ball(self, n=64, radius=22, slope=40):
        z, y, x = np.indices((n, n, n)) - (n - 1) / 2
        values = np.clip(500 - slope * (np.sqrt(x**2 + y**2 + z**2) - radius), 0, 1000)
        write_nrrd(self.folder / "ball.nrrd", values.astype(np.float32))
        return self.folder / "ball.nrrd"

    def transfer(self, *points):
        file = self.folder / "transfer.json"
        file.write_text(json.dumps({"points": [{"value": v, "opacity": a, "color": [c, c, c]} for v, a, c in points], "unit": 1.0}))
        return file

    def test_a_ball_of_known_light(self):
        """Seen along z under a light at the eye: 0.2 + 0.8 n_z on its surface, where n_z = sqrt(1 - (rho / R)^2)."""
        file, radius, n = self.ball(), 22, 384
        place = (np.arange(n) + 0.5) * 64 / n - 32
        rho = np.hypot(*np.meshgrid(place, place))
        light = 255 * (0.2 + 0.8 * np.sqrt(np.maximum(0, 1 - (rho / radius) ** 2)))
        for half in (5, 10, 20):
            by = self.transfer((500 - half, 0, 1), (500 + half, 0.95, 1))
            shown, _ = self.picture(file, "--mode", "composite", "--shade", "phong", "--light", "0,0,-1", "--material", "0.2,0.8,0,1",
                                    "--transfer", by)
            off = uniform_filter(shown[..., 0] - light, 3)
            # What goes evenly, as the depth of the surface in its ramp, is no ring: a mean over seven samples.
            ring = off - uniform_filter(off, 41)
            with self.subTest(half=half):
                self.assertLessEqual(np.abs(ring[rho < 0.8 * radius]).max(), 2)
                self.assertLessEqual(np.abs(off[rho < 0.8 * radius]).max(), 5)

    def plane(self, slope, n=48):
        """A plane that rises along z from 0 to 1000, tilted so that samples meet it everywhere within a step."""
        z, y, x = np.indices((n, n, n)).astype(float)
        values = np.clip(slope * (z + 0.13 * x + 0.07 * y - 18), 0, 1000)
        write_nrrd(self.folder / "plane.nrrd", values.astype(np.float32))
        return self.folder / "plane.nrrd"

    def test_a_steep_function_takes_shorter_steps(self):
        gentle = ((0, 0, 0.2), (1000, 0.2, 1)), 1
        steep = ((300, 0, 0.1), (500, 0.6, 0.6), (700, 0.9, 1)), None
        for points, expected in (gentle, steep):
            by = self.transfer(*points)
            for slope in (60, 120, 250):
                shown, report = self.picture(self.plane(slope), "--mode", "composite", "--transfer", by)
                inside = shown[80:-80, 80:-80, 0]
                with self.subTest(points=points, slope=slope):
                    # The plane is flat: all pixels see the same, but for its ends.
                    self.assertLessEqual(inside.max() - inside.min(), LEVELS + 1)
                    if expected:
                        self.assertEqual(self.step(report), expected)
        by = self.transfer(*steep[0])
        _, report = self.picture(self.plane(250), "--mode", "composite", "--transfer", by)
        self.assertLess(self.step(report), 1)
        rough, _ = self.picture(self.plane(250), "--mode", "composite", "--transfer", by, "--via", "project.ray_cast/filter=foh/step=1")
        inside = rough[80:-80, 80:-80, 0]
        self.assertGreater(inside.max() - inside.min(), LEVELS)

    def test_who_asks_for_an_error_gets_that(self):
        by = self.transfer((300, 0, 0.1), (500, 0.6, 0.6), (700, 0.9, 1))
        _, report = self.picture(self.ball(), "--mode", "composite", "--transfer", by, "--max-error", "0.2")
        self.assertGreaterEqual(report["plan"]["steps"][-1]["parameters"].get("step", 1), 1)

    def test_modes_without_opacity_take_any_step(self):
        _, report = self.picture(self.plane(250), "--mode", "xray")
        self.assertNotIn("rings", self.run_it("plan", "render", self.folder / "plane.nrrd", "--mode", "xray").stdout.decode())

    def test_the_plan_says_why(self):
        self.plane(250)
        text = self.run_it("plan", "render", self.folder / "plane.nrrd", "--mode", "surface", "--isovalue", "500").stdout.decode()
        self.assertIn("steps of 0.25 at most: longer ones show rings", text)


if __name__ == "__main__":
    unittest.main()
