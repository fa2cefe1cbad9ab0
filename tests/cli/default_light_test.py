"""The light that a request gets unasked: a key light over the viewer's left shoulder, and ambient light that fills shadows. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import Running

L = np.array((-0.5, -0.5, -1)) / np.sqrt(1.5)  # screen space: x right, y down, z away from the eye
A, D, S, N = 0.2, 0.9, 0.2, 20
EXPLICIT = ("--light", "-0.5,-0.5,-1", "--material", "0.2,0.9,0.2,20")
CAST = ("--via", "project.ray_cast/filter=foh/step=0.25", "--max-error", "9")


def phong(normal, light=L, strength=1.0, ambient=A):
    """Of white, seen along z."""
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    facing, mirrored = normal @ light, 2 * (normal @ light) * -normal[2] + light[2]
    return ambient + (strength * (D * facing + S * max(0, mirrored) ** N) if facing > 0 else 0)


class DefaultLight(Running):
    def volume(self, a, name="v.nrrd"):
        files.write_nrrd(self.folder / name, np.asarray(a, "<f4"))
        return self.folder / name

    def plane(self, normal):
        """Values that fall along a direction (x, y, z), 0 in the middle."""
        z, y, x = np.meshgrid(*[np.arange(25) - 12.0] * 3, indexing="ij")
        return self.volume(-(normal[0] * x + normal[1] * y + normal[2] * z) / np.linalg.norm(normal))

    def transfer(self, *points):
        file = self.folder / "t.json"
        file.write_text(json.dumps({"points": [{"value": v, "opacity": a, "color": list(c)} for v, a, c in points], "unit": 1}))
        return file

    def picture(self, source, *words, name="p.nrrd"):
        self.run_it("render", source, "-o", self.folder / name, "--view", "z", "--quiet", *words)
        return files.read(self.folder / name)[0]

    def test_planes_are_lit_from_the_upper_left(self):
        for normal in ((0, 0, -1), (-0.5, -0.5, -1), (0.5, 0.5, -1), (-1, 0, -1), (0, -1, -1), (1, 0, -1), (0, 1, -1), (0.9, 0.8, -1)):
            source = self.plane(normal)
            light = phong(normal)
            words = ("--mode", "surface", "--isovalue", "0", "--size", "25", "--max-error", "9")
            self.assertAlmostEqual(self.picture(source, *words)[12, 12, 0], light, delta=2e-3)
            got = int(self.picture(source, *words, name="p.png")[12, 12, 0])
            self.assertLessEqual(abs(got - np.clip(255 * light, 0, 255)), 1)
        self.assertGreater(phong((-1, -1, -1)), phong((1, 1, -1)) + 0.5)
        # White that faces the eye is nearly white.
        self.assertGreater(255 * phong((0, 0, -1)), 235)

    def test_a_white_plane_that_faces_the_light_is_white(self):
        source = self.plane(L)
        words = ("--mode", "surface", "--isovalue", "0", "--size", "25", "--max-error", "9", "--material", "0,1,0,1")
        self.assertAlmostEqual(self.picture(source, *words)[12, 12, 0], 1, delta=1e-3)
        self.assertEqual(int(self.picture(source, *words, name="p.png")[12, 12, 0]), 255)
        away = self.picture(self.plane((0.5, 0.5, -0.4)), *words)[12, 12, 0]
        self.assertLess(away, 0.01)

    def test_head_is_the_light_at_the_eye(self):
        for normal in ((0, 0, -1), (1, 1, -1), (-1, 0.5, -1)):
            source = self.plane(normal)
            words = ("--mode", "surface", "--isovalue", "0", "--size", "25", "--max-error", "9")
            head = np.array((0, 0, -1.0))
            got = self.picture(source, *words, "--light", "head")
            self.assertAlmostEqual(got[12, 12, 0], phong(normal, head), delta=2e-3)
            for same in ("0,0,-1", "HEAD", "0,0,-7,1"):
                self.assertTrue(np.array_equal(self.picture(source, *words, "--light", same), got), same)

    def test_the_default_is_what_its_numbers_say(self):
        z, y, x = np.meshgrid(*[np.linspace(-1, 1, 20)] * 3, indexing="ij")
        source = self.volume(100 * np.maximum(0, 1 - np.hypot(x, np.hypot(y, z))))
        see = ("--transfer", self.transfer((0, 0, (1, 0.9, 0.8)), (60, 0.6, (1, 0.8, 0.7))))
        for words in (("composite", *see, "--shade", "phong"), ("composite", *see, "--shade", "torrance-sparrow"), ("surface", "--isovalue", "30"),
                      ("xray", "--shade", "lambert"), ("mean", "--shade", "hemisphere")):
            plain = self.picture(source, "--mode", *words, "--size", "30")
            self.assertTrue(np.array_equal(self.picture(source, "--mode", *words, "--size", "30", *EXPLICIT), plain), words)
            self.assertFalse(np.array_equal(self.picture(source, "--mode", *words, "--size", "30", "--light", "head"), plain), words)
        words = ("--mode", "composite", *see, "--shade", "particles", "--phase", "0.4", "--size", "30")
        self.assertTrue(np.array_equal(self.picture(source, *words, *EXPLICIT[:2]), self.picture(source, *words)))

    def test_shadows_of_particles(self):
        depth, opacity = 20, 0.06
        tau, path = -np.log1p(-opacity), np.sqrt(1.5)
        source = self.volume(np.full((depth, 61, 61), 1.0))
        words = ("--mode", "composite", "--transfer", self.transfer((1, opacity, (0.5, 0.25, 1))), "--shade", "particles", "--shadows", "--background",
                 "none", "--size", "61", *CAST)
        key = (1 - np.exp(-tau * depth * (1 + path))) / (1 + path)
        got = self.picture(source, *words)[30, 30]
        # Columns of the light's grid begin up to half a step outside the face: a quarter on average.
        np.testing.assert_allclose(got[:3] * got[3], key * np.array((0.5, 0.25, 1)), rtol=tau / 4)

    def test_what_lies_in_the_shade_is_not_black(self):
        # A screen far before a wall, towards the light from where the eye looks.
        a = np.zeros((30, 40, 40))
        a[20:] = np.clip(np.arange(10), 0, 4)[:, None, None] * 25  # rises over four samples
        a[2:5, 2:16, 2:16] = 100
        source = self.volume(a)
        words = ("--mode", "composite", "--transfer", self.transfer((0, 0, (1, 1, 1)), (40, 0, (1, 1, 1)), (60, 0.999, (1, 1, 1))), "--shade", "phong",
                 "--size", "40", *CAST)
        shade = (18, 18)  # the key light comes from 18 - 9.5, 18 - 9.5 at the screen's depth
        unlit = self.picture(source, *words)[shade][0]
        self.assertAlmostEqual(unlit, phong((0, 0, -1)), delta=0.03)
        got = self.picture(source, *words, "--shadows")[shade][0]
        self.assertAlmostEqual(got, A + 0.25, delta=0.02)
        self.assertAlmostEqual(self.picture(source, *words, "--shadows", "--light", "-0.5,-0.5,-1")[shade][0], A + 0.25, delta=0.02)
        self.assertAlmostEqual(self.picture(source, *words, "--shadows", *EXPLICIT)[shade][0], A, delta=0.02)
        lit = self.picture(source, *words, "--shadows")[34, 34][0]
        self.assertGreater(lit, got + 0.1)

    def test_shadows_keep_what_is_promised(self):
        z, y, x = np.meshgrid(*[np.linspace(-1, 1, 28)] * 3, indexing="ij")
        source = self.volume(np.maximum(0.8 - np.hypot(x, np.hypot(y, z)), 0.5 - np.hypot(x - 0.5, y + 0.4)) * 100)
        see = self.transfer((0, 0, (1, 0.9, 0.8)), (30, 0.5, (1, 0.5, 0.3)))
        for words in (("--shade", "phong"), ("--shade", "particles"), ("--shade", "torrance-sparrow", "--ambient-occlusion", "4"),
                      ("--shade", "phong", "--perspective", "40")):
            done = self.run_it("render", source, "-o", "null:", "--mode", "composite", "--transfer", see, *words, "--shadows", "--rotate", "20,30,0", "--size",
                               "24", "--max-error", "0.05", "--verify=all", "--json", "-")
            report = json.loads(done.stdout)
            measured, predicted = report["measured"]["error"]["nrmse"], report["plan"]["predicted"]["error"]
            self.assertLessEqual(measured, 0.05, words)
            self.assertLessEqual(measured, 1.1 * predicted, words)

    def test_bone_is_nearly_white(self):
        bone = np.full((20, 24, 24), -1000.0)
        bone[6:, 4:20, 4:20] = 1800
        got = self.picture(self.volume(bone), "--mode", "composite", "--shade", "phong", "--preset", "ct-bone", "--background", "1,1,1", "--size", "24",
                           name="p.png")
        # The edge of the preset's bone is (0.82, 0.64, 0.46) at 250 HU, (0.93, 0.86, 0.72) at 450; the light at it is 0.94.
        self.assertGreater(int(got[12, 12, 0]), 0.94 * 0.82 * 255)
        self.assertGreater(int(got[12, 12, 2]), 0.94 * 0.46 * 255)
        np.testing.assert_array_equal(got[0, 0], (255, 255, 255))

    def test_words(self):
        source = self.plane((0, 0, -1))
        for light in ("foot", "1,2", "heads", "0,0,0"):
            self.assertIn("--light", self.run_it("render", source, "-o", "null:", "--mode", "shaded", "--light", light, code=2).stderr.decode(), light)


if __name__ == "__main__":
    unittest.main()
