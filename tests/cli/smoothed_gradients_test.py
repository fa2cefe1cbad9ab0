"""Gradients smoothed against noise: Sobel's operator by scipy, promises, and who gets them unasked. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import unittest

import files
import numpy as np
from preset_kinds_test import angiogram, ct, cells, grid
from running import Running, corner_of_mr_head, native
from scipy import ndimage

SOBEL = ("--gradient", "sobel")
LIT = ("--light", "head", "--material", "0.1,0.9,0,1")


def sobel(a):
    """Along z, y and x, of differences by one sample."""
    return [ndimage.sobel(a, axis, mode="nearest") / 32 for axis in range(3)]


def tissue(deviation, n=44, seed=5):
    """A head of 230 mm: skin, dark bone and two tissues, as soft as a scanner's samples; noise of the magnitude, in shares of the window."""
    z, y, x = grid(n)
    r = np.sqrt((x / .78) ** 2 + (y / .9) ** 2 + ((z - .05) / .85) ** 2)
    a = np.where((r < 1) | ((np.hypot(x, y + .1) < .45) & (z < 0)), .8, 0)
    for within, value in ((.93, .35), (.9, .1), (.82, .5), (.6, .9), (.3, .45)):
        a[r < within] = value
    a = ndimage.gaussian_filter(a, .8)
    two = np.random.default_rng(seed).normal(0, .9 * deviation, (2, *a.shape))
    return 900 * np.hypot(a + two[0], two[1])


class Smoothed(Running):
    def setUp(self):
        self.source = self.folder / "v.nrrd"

    def volume(self, shape=(9, 11, 13), dtype="<f4"):
        a = np.random.default_rng(3).integers(0, 200, shape).astype(dtype)
        a[0] = 0  # so that rays begin below the level
        files.write_nrrd(self.source, a)
        return a.astype(float)

    def picture(self, *words, source=None):
        out = self.folder / "p.nrrd"
        done = self.run_it("render", source or self.source, "-o", out, "--view", "z", "--json", "-", *native(words))
        self.report = json.loads(done.stdout)
        self.said = done.stderr.decode()
        return files.read(out)[0].astype(float)

    def shaded(self, source, *words):
        done = self.run_it("render", source, "-o", "null:", "--mode", "shaded", "--size", "24", "--json", "-", *words)
        self.report = json.loads(done.stdout)
        self.said = done.stderr.decode()
        return self.report["request"]

    def head(self, deviation, dtype="<f4", **keys):
        path = self.folder / f"head{deviation}{np.dtype(dtype).name}.nii"
        a = tissue(deviation, **keys)
        files.write_nifti(path, a.clip(0, 255 if dtype == "u1" else None).astype(dtype), spacing=[230 / a.shape[0]] * 3)
        return path

    # --- against scipy

    def first_hits(self, a, level):
        """Where each ray along z first reaches the level, of those that begin below it."""
        above = a >= level
        k = above.argmax(0)
        y, x = np.nonzero(above.any(0) & ~above[0])
        k = k[y, x]
        before, behind = a[k - 1, y, x], a[k, y, x]
        return y, x, k - 1 + (level - before) / (behind - before)

    def lit(self, gradients, hits, spacing=(1, 1, 1)):
        y, x, z = hits
        g = np.array([ndimage.map_coordinates(of, (z, y, x), order=1, mode="nearest") / s for of, s in zip(gradients, spacing)])
        return .1 + .9 * np.abs(g[0]) / np.sqrt((g * g).sum(0))

    def test_surfaces_are_lit_by_sobels_operator(self):
        for dtype, shape in (("<f4", (9, 11, 13)), ("u1", (12, 10, 9)), ("<i2", (7, 16, 11)), ("<f8", (9, 8, 10))):
            a = self.volume(shape, dtype)
            hits = self.first_hits(a, 150)
            self.assertGreater(len(hits[0]), 40)
            cast = ("--mode", "surface", "--isovalue", "150", *LIT, "--via", "project.ray_cast/filter=foh/step=1", "--max-error", "9")
            got = self.picture(*cast, *SOBEL)[hits[0], hits[1], 0]
            # The level lies a little below 150; places of 8 and 16 bits have weights of 14 bits.
            np.testing.assert_allclose(got, self.lit(sobel(a), hits), atol=2e-3)
            self.assertEqual(self.report["request"]["gradient"], "sobel")
            plain = self.picture(*cast)[hits[0], hits[1], 0]
            central = [ndimage.correlate1d(a, [-.5, 0, .5], axis, mode="nearest") for axis in range(3)]
            np.testing.assert_allclose(plain, self.lit(central, hits), atol=2e-3)
            self.assertEqual(self.report["request"]["gradient"], "central")
            self.assertGreater(np.abs(plain - got).mean(), .03)

    def test_uneven_spacing_turns_them(self):
        a = self.volume()
        y, x, z = self.first_hits(a, 150)
        # A ray looks at places a quarter of a sample apart.
        seen = np.linspace(0, .3, 7)[:, None]
        wide = (ndimage.map_coordinates(a, np.broadcast_arrays(z + seen + 1e-6, y, x), order=1) >= 150).all(0)
        hits = y[wide], x[wide], z[wide]
        self.assertGreater(wide.sum(), 40)
        got = self.picture("--mode", "surface", "--isovalue", "150", *LIT, *SOBEL, "--input-spacing", "1,1,2", "--max-error", "9",
                           "--via", "project.ray_cast/filter=foh/step=0.5")
        np.testing.assert_allclose(got[hits[0], hits[1], 0], self.lit(sobel(a), hits, (2, 1, 1)), atol=3e-3)

    def test_opacities_go_by_them_as_well(self):
        """A slab of one sample, of which each pixel has the opacity of its gradient's length."""
        a = np.random.default_rng(4).integers(0, 200, (1, 12, 14)).astype("<f4")
        files.write_nrrd(self.source, a)
        transfer = self.folder / "t.json"
        transfer.write_text(json.dumps({"points": [{"value": 0, "opacity": .5, "color": [1, 1, 1]}], "unit": 1,
                                        "gradient": [{"magnitude": 0, "opacity": 0}, {"magnitude": 120, "opacity": 1}]}))
        got = self.picture("--mode", "composite", "--transfer", transfer, "--background", "none", *SOBEL, "--max-error", "9",
                           "--via", "project.ray_cast/filter=foh/step=1")[..., 3]
        length = np.sqrt(sum(g * g for g in sobel(a.astype(float))))[0]
        np.testing.assert_allclose(got, .5 * np.minimum(1, length / 120), atol=1e-4)

    def test_gradients_beside_the_samples_are_the_same(self):
        path = corner_of_mr_head(self.folder)
        words = ("--mode", "composite", "--preset", "mr-head", "--shade", "phong", "--rotate", "20,30,5", *SOBEL, "--max-error", "9")
        direct = self.picture(*words, "--via", "project.ray_cast/filter=foh/step=1", source=path)
        beside = self.picture(*words, "--via", "shade.gradient/scheme=sobel", "--via", "project.gradient_cast/filter=foh/step=1", source=path)
        # 16 bits a component. Where a surface is seen edge on, light turns 32 times as fast as its normal.
        self.assertLess(np.quantile(np.abs(direct - beside), .99), 2e-3)
        self.assertLess(np.abs(direct - beside).max(), 1e-2)
        # A cast that was not asked to read them does not.
        self.picture(*words[:-4], "--max-error", "9", "--via", "project.ray_cast/filter=foh/step=1", source=path)
        self.assertNotIn("shade.gradient", [step["transition"] for step in self.report["plan"]["steps"]])
        # Each filter's own values: nearest samples, trilinear ones and splines differ in these alone.
        for filter, most in (("zoh", .2), ("bspline3", .1)):
            other = self.picture(*words, "--via", f"project.ray_cast/filter={filter}/step=1", source=path)
            self.assertLess(np.sqrt(((direct - other) ** 2).mean()), most)

    # --- promises

    def test_promises_hold(self):
        path = corner_of_mr_head(self.folder)
        cast = "project.ray_cast/filter={}/step={}"
        surface = ("--mode", "surface", "--isovalue", "110")
        shaded = ("--mode", "composite", "--preset", "mr-head", "--shade", "phong")
        for words in ((*shaded, "--via", cast.format("foh", .5)), (*shaded, "--via", cast.format("bspline3", 1)),
                      (*surface, "--via", cast.format("foh", .5)), (*shaded, "--via", cast.format("zoh", .5)), (*shaded, "--via", "shade.gradient/scheme=sobel"),
                      (*shaded, "--reference", "linear", "--via", cast.format("foh", .5))):
            done = self.run_it("render", path, "-o", "null:", "--size", "48", "--rotate", "20,30,5", *SOBEL, *words, "--max-error", "9",
                               "--verify=all", "--json", "-")
            report = json.loads(done.stdout)
            measured, promised = report["measured"]["error"]["nrmse"], report["plan"]["predicted"]["error"]
            self.assertLessEqual(measured, 1.1 * promised, words)
            self.assertLess(promised, .2, words)

    def test_the_reference_smooths(self):
        """What is cast is near the reference of its own scheme, and pictures of the two are far from each other."""
        path = corner_of_mr_head(self.folder)
        words = ("--mode", "composite", "--preset", "mr-head", "--shade", "phong", "--reference", "linear", "--max-error", "9",
                 "--via", "project.ray_cast/filter=foh/step=0.125")
        pictures, errors = [], []
        for way in ((), SOBEL):
            pictures.append(self.picture(*words, *way, "--verify=400", source=path))
            errors.append(self.report["measured"]["error"]["nrmse"])
        apart = np.sqrt(((pictures[0] - pictures[1]) ** 2).mean())
        for error in errors:
            self.assertLess(error, apart / 3)

    def test_bytes_do_not_depend_on_threads(self):
        path = corner_of_mr_head(self.folder)
        for words in ((), ("--via", "shade.gradient/scheme=sobel")):
            pictures = [self.picture("--mode", "shaded", "--preset", "mr-head", *SOBEL, *words, "--rotate", "9,30,5", "--threads", n, source=path).tobytes()
                        for n in (1, 2)]
            self.assertEqual(pictures[0], pictures[1])

    # --- who gets them unasked

    def test_noisy_mr_gets_them(self):
        for deviation, dtype in ((.03, "<f4"), (.06, "<i2"), (.06, "u1"), (.045, "<u2")):
            a = self.head(deviation, dtype, n=44 if dtype != "<u2" else 57)
            if dtype == "u1":
                a = self.folder / "bytes.nii"
                files.write_nifti(a, (tissue(deviation) / 4).clip(0, 255).astype("u1"), spacing=[230 / 44] * 3)
            request = self.shaded(a)
            self.assertEqual((request["preset"], request["gradient"]), ("mr-head", "sobel"), (deviation, dtype))
            self.assertLess(abs(request["noise"] - deviation), .2 * deviation + .002, (deviation, dtype))
            self.assertIn("gradients smoothed (noise", self.said.splitlines()[-1])

    def test_clean_mr_does_not(self):
        for deviation, dtype in ((0, "<f4"), (.01, "<f4"), (.01, "<i2")):
            request = self.shaded(self.head(deviation, dtype))
            self.assertEqual((request["preset"], request["gradient"]), ("mr-head", "central"))
            self.assertLess(abs(request["noise"] - deviation), .2 * deviation + .003)
            self.assertNotIn("smoothed", self.said)

    def test_other_data_do_not(self):
        for name, a, side in (("ct", ct(90), 400), ("angio", (angiogram(.1) * 1500).astype("<f4"), 85), ("cells", cells(), .017)):
            path = self.folder / f"{name}.nii"
            files.write_nifti(path, a, spacing=[side / a.shape[0]] * 3)
            request = self.shaded(path)
            self.assertNotEqual(request["preset"], "mr-head")
            self.assertEqual(request["gradient"], "central")
            self.assertNotIn("smoothed", self.said)

    def test_what_somebody_says_holds(self):
        noisy, clean = self.head(.06), self.head(0)
        self.assertEqual(self.shaded(noisy, "--gradient", "central")["gradient"], "central")
        self.assertEqual(self.shaded(noisy, "--gradient", "auto")["gradient"], "sobel")
        self.assertEqual(self.shaded(clean, "--gradient", "SOBEL")["gradient"], "sobel")
        self.assertEqual(self.shaded(noisy, "--preset", "mr-head")["gradient"], "central")
        mip = json.loads(self.run_it("render", noisy, "-o", "null:", "--json", "-").stdout)["request"]
        self.assertNotIn("gradient", mip)
        done = self.run_it("render", noisy, "-o", "null:", "--mode", "shaded", "--explain", "--report", self.folder / "r.html")
        self.assertRegex(done.stdout.decode(), r"gradients smoothed \(noise \d.* % of the window\), as it seems to be an MR of a head")
        self.assertIn("gradients smoothed", (self.folder / "r.html").read_text())

    def test_facts_are_kept_apart(self):
        """What is measured for one scheme and kept is not taken for the other."""
        path = corner_of_mr_head(self.folder)
        promised = []
        for words in (SOBEL, (), SOBEL, ()):
            done = self.run_it("render", path, "-o", "null:", "--mode", "shaded", "--preset", "mr-head", "--size", "48", "--max-error", "0.3", *words,
                               "--via", "project.ray_cast/filter=foh/step=1", "--json", "-")
            promised.append(json.loads(done.stdout)["plan"]["predicted"]["error"])
        self.assertEqual(promised[:2], promised[2:])
        self.assertNotEqual(promised[0], promised[1])

    # --- who cannot

    def test_refusals(self):
        self.volume()
        surface, shaded = ("--mode", "surface", "--isovalue", "150"), ("--mode", "shaded", "--preset", "general")
        for words, reason in (((*surface, "--via", "shade.depth"), "smoothed"), ((*surface, "--via", "surface.draw"), "smoothed"),
                              ((*shaded, "--via", "shade.classify"), "smoothed"), ((*shaded, "--via", "shade.gradient/scheme=central"), "smoothed"),
                              (("--mode", "xray", "--shade", "lambert", "--via", "spectrum.gradients"), "smoothed")):
            done = self.run_it("render", self.source, "-o", "null:", *words, *SOBEL, code=3)
            self.assertIn(reason, done.stderr.decode(), words)
        for words, reason in ((("--mode", "mip"), "--gradient"), (("--mode", "composite"), "--shade phong"), ((*shaded, "--shade", "none"), "--gradient")):
            done = self.run_it("render", self.source, "-o", "null:", *words, *SOBEL, code=2)
            self.assertIn(reason, done.stderr.decode(), words)
        done = self.run_it("render", self.source, "-o", "null:", *shaded, "--gradient", "sobal", code=2)
        self.assertIn("sobel", done.stderr.decode())


if __name__ == "__main__":
    unittest.main()
