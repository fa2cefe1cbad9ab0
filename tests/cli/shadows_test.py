"""Shadows and ambient occlusion of `render`, against closed forms. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from levels_test import premultiplied
from running import Running, native
from scipy import integrate

CAST = ("--via", "project.ray_cast/filter=foh/step=0.25", "--max-error", "9", "--background", "none")


class Shadows(Running):
    def source(self, volume, name="s.nrrd"):
        files.write_nrrd(self.folder / name, volume.astype("<f4"))
        return self.folder / name

    def transfer(self, *points):
        file = self.folder / "t.json"
        file.write_text(json.dumps({"points": [{"value": v, "opacity": a, "color": c} for v, a, c in points], "unit": 1}))
        return file

    def render(self, source, *words):
        self.run_it("render", source, "-o", self.folder / "p.nrrd", "--quiet", "--mode", "composite", *native(words))
        return premultiplied(files.read(self.folder / "p.nrrd")[0].astype(float))

    def test_light_is_attenuated_on_its_way_in_and_out(self):
        depth, opacity = 40, 0.06
        tau = -np.log1p(-opacity)
        source = self.source(np.full((depth, 9, 9), 1.0))
        words = ("--transfer", self.transfer((1, opacity, [0.5, 0.25, 1])), "--shade", "particles", "--shadows", *CAST)
        # From the eye: in and out by the same way.
        picture = self.render(source, *words, "--light", "head")
        np.testing.assert_allclose(picture[..., 0], 0.5 * (1 - np.exp(-2 * tau * depth)) / 2, rtol=3e-3)
        np.testing.assert_allclose(picture[..., 2], (1 - np.exp(-2 * tau * depth)) / 2, rtol=3e-3)
        np.testing.assert_allclose(picture[..., 3], 1 - np.exp(-tau * depth), rtol=1e-4)
        # From behind: what is left of all samples' light is the same.
        picture = self.render(source, *words, "--light", "0,0,1")
        np.testing.assert_allclose(picture[..., 2], tau * depth * np.exp(-tau * depth), rtol=3e-3)
        # From the side light goes through as many voxels as lie there.
        picture = self.render(source, *words, "--light", "-1,0,0")
        in_row = np.exp(-tau * (np.arange(9) + 0.5))
        np.testing.assert_allclose(picture[4, :, 2], in_row * (1 - np.exp(-tau * depth)), rtol=3e-3)
        # Two lights add up.
        both = self.render(source, *words, "--light", "-1,0,0,0.5", "--light", "0,0,-1,2")
        one, other = self.render(source, *words, "--light", "-1,0,0"), self.render(source, *words, "--light", "head")
        np.testing.assert_allclose(both[..., :3], 0.5 * one[..., :3] + 2 * other[..., :3], rtol=1e-4)

    def test_a_wall_keeps_light_from_what_lies_behind_it(self):
        volume = np.zeros((24, 24, 24))
        volume[:, :, 18:20] = 3  # a wall on the right
        volume[10:14, 4:20, 4:14] = 1
        source = self.source(volume)
        words = ("--transfer", self.transfer((0, 0, [1, 1, 1]), (1, 0.3, [1, 1, 1]), (3, 0.999, [1, 1, 1])),
                 "--shade", "particles", *CAST)
        lit = self.render(source, *words, "--light", "1,0,0")[12, 8, 0]
        shaded = self.render(source, *words, "--light", "1,0,0", "--shadows")[12, 8, 0]
        self.assertLess(shaded, 0.01 * lit)
        free = self.render(source, *words, "--light", "-1,0,0", "--shadows")[12, 5, 0]
        self.assertGreater(free, 0.3 * lit)
        # What is clipped away throws no shadow.
        cut = self.render(source, *words, "--light", "1,0,0", "--shadows", "--clip", "0,0,0,16,23,23")[12, 12, 0]
        self.assertGreater(cut, 0.3 * lit)

    def test_ambient_light_is_what_a_neighbourhood_leaves_of_it(self):
        # Deep in a medium every direction keeps exp(-tau R) of it; without gradients ambient light is all there is.
        depth, opacity, radius = 60, 0.05, 6.0
        tau = -np.log1p(-opacity)
        source = self.source(np.full((depth, 41, 41), 1.0))
        words = ("--transfer", self.transfer((1, opacity, [1, 1, 1])), "--shade", "phong", "--material", "0.8,0.1,0.1,10", *CAST)
        picture = self.render(source, *words, "--ambient-occlusion", str(radius))

        def left(z):  # mean over directions to a face at distance z
            toward = integrate.quad(lambda mu: np.exp(-tau * min(radius, z / mu)), 1e-9, 1)[0]
            return (toward + np.exp(-tau * radius)) / 2

        expected = 0.8 * integrate.quad(lambda z: tau * np.exp(-tau * z) * left(z), 0, depth, limit=200)[0]
        self.assertAlmostEqual(picture[20, 20, 0] / expected, 1, delta=0.01)
        free = self.render(source, *words)
        np.testing.assert_allclose(free[20, 20, 0], 0.8 * (1 - np.exp(-tau * depth)), rtol=1e-4)

    def test_predicted_errors_hold_and_threads_change_nothing(self):
        z, y, x = np.meshgrid(*[np.linspace(-1, 1, 32)] * 3, indexing="ij")
        source = self.source(np.maximum(0.8 - np.hypot(x, np.hypot(y, z)), 0.5 - np.hypot(x - 0.5, y + 0.4)) * 100, "b.nrrd")
        words = ("--mode", "composite", "--transfer", self.transfer((0, 0, [1, 0.9, 0.8]), (30, 0.5, [1, 0.5, 0.3])), "--shade", "phong",
                 "--light", "-1,-1,-1", "--shadows", "--ambient-occlusion", "4", "--rotate", "20,30,0", "--size", "24")
        for extra in ((), ("--perspective", "40"), ("--input-spacing", "1,1,2"), ("--clip-plane", "1,0,0,-12")):
            done = self.run_it("render", source, "-o", "null:", *words, *extra, "--max-error", "0.05", "--verify=all", "--json", "-")
            report = json.loads(done.stdout)
            measured, predicted = report["measured"]["error"]["nrmse"], report["plan"]["predicted"]["error"]
            self.assertLessEqual(measured, 0.05, extra)
            self.assertLessEqual(measured, 1.1 * predicted, extra)
        pictures = []
        for threads in (1, 2, 7):
            self.run_it("render", source, "-o", self.folder / "p.nrrd", *words, "--threads", threads)
            pictures.append((self.folder / "p.nrrd").read_bytes())
        self.assertEqual(pictures[0], pictures[1])
        self.assertEqual(pictures[0], pictures[2])

    @staticmethod
    def kept_back(towards_eye, towards_light):
        """The share of light that a flat surface, whose opacity rises to 0.9 within a sample, keeps from itself.
        @param towards_eye, towards_light  cosines between its normal and these"""
        depth = np.linspace(0, 8, 4001)
        step = depth[1]
        taken = np.cumsum(-np.log1p(-np.minimum(0.9 * depth, 0.9))) * step
        left = np.exp(-taken / towards_eye)
        seen = -np.diff(left)
        to_light = np.interp(depth - 2 * towards_light, depth, taken, left=0) / towards_light
        return np.sum(seen * (1 - np.exp(-to_light[1:])))

    def test_a_surface_is_not_in_its_own_shadow(self):
        """Shadows begin two samples towards the light, and have no rings; the side that faces away has no light."""
        for n, centre, light, dtype, shade in ((48, (23.5, 23.5, 23.5), (-0.5, -0.5, -1), "<f4", "phong"), (40, (19.2, 20.1, 18.7), (0, -0.3, -1), "<i2", "phong"),
                                               (56, (27.5, 26.8, 28.1), (1, 0.2, -0.6), "<f4", "torrance-sparrow")):
            z, y, x = np.mgrid[0:n, 0:n, 0:n].astype(float)
            away = np.sqrt((x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2)
            source = self.folder / "ball.nrrd"
            files.write_nrrd(source, np.round(100 * (0.4 * n - away)).astype(dtype))
            words = ("--transfer", self.transfer((0, 0, [1, 1, 1]), (100, 0.9, [1, 1, 1])), "--shade", shade, "--material", "0.2,0.8,0,10",
                     "--light", ",".join(map(str, light)), "--via", "project.ray_cast/filter=foh/step=0.125", "--max-error", "9", "--background", "none", "--view", "z")
            free, shaded = self.render(source, *words), self.render(source, *words, "--shadows")
            # The normal where a ray meets the ball: x right, y down, the eye at small z.
            v, u = np.mgrid[0:n, 0:n].astype(float)
            a, b = (u - centre[0]) / (0.4 * n), (v - centre[1]) / (0.4 * n)
            c = -np.sqrt(np.clip(1 - a * a - b * b, 0, 1))
            cosine = (a * light[0] + b * light[1] + c * light[2]) / np.linalg.norm(light)
            inside = a * a + b * b < 0.8
            facing = inside & (cosine > 0.4)
            self.assertGreater(facing.sum(), 50)
            expected = np.array([0.8 * k * self.kept_back(-w, k) for k, w in zip(cosine[facing], c[facing])])
            self.assertLess(np.abs((free - shaded)[facing][:, 0] - expected).max(), 0.04)
            # The side that faces away is in the ball's own shadow.
            behind = inside & (cosine < -0.3)
            if behind.any():
                self.assertLess(shaded[behind][:, 0].max(), 0.25)

    def test_refusals(self):
        source = self.source(np.arange(125).reshape(5, 5, 5))
        for words, part in ((("--mode", "composite", "--shadows"), "--shadows: of --mode composite with --shade"),
                            (("--mode", "composite", "--ambient-occlusion", "2"), "--ambient-occlusion: of --mode composite"),
                            (("--mode", "composite", "--shade", "particles", "--ambient-occlusion", "2"), "phong"),
                            (("--mode", "shaded", "--ambient-occlusion", "0"), "greater than 0"),
                            (("--mode", "surface", "--isovalue", "9", "--shadows"), "composite"),
                            (("--mode", "shaded", "--shadows") + ("--light", "0,1,-1") * 9, "at most 8")):
            error = self.run_it("render", source, "-o", "null:", *words, code=2).stderr.decode()
            self.assertIn(part, error, words)


if __name__ == "__main__":
    unittest.main()
