"""Light that a picture holds against the light that came in: phase functions, surfaces, homogeneous media by every edge."""

import json

import numpy as np
from driving import ALONE, Driven, main, read_nrrd, write_nrrd


class Energy(Driven):
    def transfer(self, *points):
        """(value, opacity a voxel), white."""
        file = self.folder / "white.json"
        file.write_text(json.dumps({"unit": 1, "points": [{"value": float(v), "opacity": float(a), "color": [1, 1, 1]} for v, a in points]}))
        return ["--mode", "composite", "--transfer", file, "--background", "none"]

    def light_and_opacity(self, samples, *words):
        """Premultiplied light and opacity, [height, width] in f64. Files keep light that is not multiplied by its opacity."""
        made = self.render(samples, *words).astype("f8")
        made = made if made.shape[-1] == 4 else np.concatenate([made[..., :1]] * 3 + [made[..., -1:]], -1)
        return made[..., 0] * made[..., 3], made[..., 3]


class Particles(Energy):
    def test_all_directions_together_get_the_light_that_was_caught(self):
        """Where light is not attenuated on its way in, each ray of opacity A sends 4 pi Phi(cosine) A. Phi is a density over
        directions, so the mean over all of them is A, whatever g. Gauss's rule with n nodes leaves terms from g^2n on, as long as
        their factors, 4 n + 1: 4e-5 of 14 for 0.6, a few 1e-6 of 9 for 0.4."""
        samples = np.random.default_rng(1).random((9, 12, 11), "f4")
        words = [*self.transfer((0, 0.02), (1, 0.2)), "--shade", "particles", "--rotate", "20,30,0",
                 "--via", "project.ray_cast/filter=foh/step=1"]
        for g, count in ((0, 2), (0.4, 9), (-0.6, 14)):
            nodes, weights = np.polynomial.legendre.leggauss(count)
            sent = []
            for cosine in nodes:
                # The light comes from `light`; a ray goes along z, and -L.V is what it was turned by.
                light = f"{np.sqrt(1 - cosine * cosine):.9f},0,{cosine:.9f}"
                got, caught = self.light_and_opacity(samples, *words, "--phase", g, "--light", light)
                sent.append(got.sum())
            self.assertAlmostEqual(np.dot(weights, sent) / 2 / caught.sum(), 1, delta=2e-5, msg=str(g))

    def test_with_shadows_less_leaves_than_comes(self):
        """Light that was taken away on its way in is gone: of a thin ball nearly all that was caught leaves in some direction, of a
        thick one a part, and never more than came."""
        z, y, x = np.mgrid[:16, :16, :16] - 7.5
        ball = (x * x + y * y + z * z < 36).astype("f4")
        nodes, weights = np.polynomial.legendre.leggauss(6)
        left = []
        for opacity in (1e-3, 0.05, 0.3, 0.9):
            words = [*self.transfer((0, 0), (1, opacity)), "--shade", "particles", "--shadows", "--phase", "0.3",
                     "--via", "project.ray_cast/filter=foh/step=0.5"]
            sent = []
            for cosine in nodes:
                light = f"{np.sqrt(1 - cosine * cosine):.9f},0,{cosine:.9f}"
                got, caught = self.light_and_opacity(ball, *words, "--light", light)
                sent.append(got.sum())
            left.append(np.dot(weights, sent) / 2 / caught.sum())
        self.assertGreater(left[0], 0.98)  # a hundredth is lost on the way in, whose mean depth is 6 voxels
        self.assertLessEqual(max(left), 1 + 1e-3)
        self.assertEqual(left, sorted(left, reverse=True))


class Surfaces(Energy):
    def test_no_pixel_sends_more_than_its_light(self):
        """Material shares that add up to 1, white, lights that add up to 1: a ray of opacity A sends A at most."""
        z, y, x = np.mgrid[:20, :20, :20] - 9.5
        random = np.random.default_rng(2)
        scenes = {"noise": random.random((12, 12, 12), "f4"), "ball": np.clip(8 - np.sqrt(x * x + y * y + z * z), 0, 1).astype("f4")}
        lights = (["--light", "0,0,-1"], ["--light", "-1,-1,-1"], ["--light", "1,0,0.2,0.5", "--light", "0,1,-1,0.5"])
        for i, (name, samples) in enumerate(scenes.items()):
            for j, shade in enumerate(("phong", "torrance-sparrow")):
                for k, material in enumerate(("0.1,0.7,0.2,10", "0,0,1,1", "0,0,1,200", "0,1,0,1")):
                    # Every scene, shade and material meets every light.
                    for light in (lights[(2 * i + j + k) % 3],):
                        got, caught = self.light_and_opacity(samples, *self.transfer((0, 0.01), (1, 0.6)), "--shade", shade, "--material",
                                                             material, *light, "--rotate", "10,20,0", *ALONE)
                        # f32 and its arc cosines, 12 to 30 samples a ray.
                        self.assertLessEqual((got - caught).max(), 1e-5, (name, shade, material, light))
                        self.assertGreaterEqual(got.min(), 0)


# Gaussians of 0.6 voxels add up to 1 within (1 + 2 exp(-2 (pi 0.6)^2))^2 - 1 across the rays of any view, and so do depths.
RIPPLE = {"project.splat_ewa_sheets": (1 + 2 * np.exp(-2 * (np.pi * 0.6) ** 2)) ** 2 - 1}


class Media(Driven):
    def test_a_homogeneous_medium_is_one_by_every_edge(self):
        """1 - exp(-tau) in the middle of a slab, by all edges that come to a composite, at every step, to 1e-6: sums of 24 to 80
        numbers, each rounded to 2^-24 of what is left; and a ripple that an edge states. More is left than what ends a ray. A second, thinner medium by all edges
        that the first went through, each at one of the steps."""
        depth = 24
        slab, medium, out = (self.folder / name for name in ("slab.nrrd", "medium.json", "m.nrrd"))
        write_nrrd(slab, np.ones((depth, 9, 9), "f4"))
        swept, edges = set(), self.edges()
        for opacity in (0.2, 0.03):
            medium.write_text(json.dumps({"unit": 1, "points": [{"value": v, "opacity": opacity, "color": [1, 1, 1]} for v in (0, 2)]}))
            expected = -np.expm1(depth * np.log1p(-opacity))
            for nth, edge in enumerate(edges if opacity == 0.2 else [edge for edge in edges if edge["name"] in swept]):
                steps = (0.3, 0.7, 1, 2) if "step" in edge["parameters"] else (None,)
                for step in steps if opacity == 0.2 else (steps[nth % len(steps)],):
                    name = edge["name"] + (f"/step={step}" if step else "")
                    done = self.run_it("render", slab, "-o", out, "--mode", "composite", "--transfer", medium, "--max-error", "9",
                                       "--size", "native", "--via", name, code=None)
                    if done.returncode == 3 and opacity == 0.2:
                        break
                    self.assertEqual(done.returncode, 0, done.stderr)
                    swept.add(edge["name"])
                    made = read_nrrd(out)
                    # Depths that are off by a share r leave exp(-tau (1 - r)) in place of exp(-tau).
                    ripple = (1 - expected) * np.expm1(-np.log1p(-expected) * RIPPLE.get(edge["name"], 0))
                    self.assertAlmostEqual(float(made[made.shape[0] // 2, made.shape[1] // 2].flat[0]), expected, delta=1e-6 + ripple, msg=name)
        families = {name.split(".")[0] for name in swept}
        self.assertTrue({"project", "composite", "shade", "warp"} <= families, swept)

    def test_a_tree_of_composites_is_their_sequence(self):
        """Of random layers, however many: all orders of compositing are one picture to 2e-6, W roundings of what is left."""
        words = ["--mode", "composite", "--transfer", self.folder / "layers.json", "--background", "none"]
        orders = [edge["name"] for edge in self.edges() if any(join["from"] == "screen/classified" for join in edge["joins"])]
        self.assertGreaterEqual(len(orders), 5)
        for depth in (1, 2, 31, 65, 257):
            # Half of the light is left at the end, so that no order may end a ray before.
            (self.folder / "layers.json").write_text(json.dumps({"unit": 1, "points": [
                {"value": 0, "opacity": 0, "color": [0, 0.2, 1]}, {"value": 1, "opacity": 1.4 / max(depth, 2), "color": [1, 0.5, 0]}]}))
            samples = np.random.default_rng(depth).random((depth, 8, 9), "f4")
            pictures = [self.render(samples, *words, "--via", order).astype("f8") for order in orders]
            self.assertLess(pictures[0][..., -1].max(), 0.999)
            for order, picture in zip(orders[1:], pictures[1:]):
                self.assertLessEqual(np.abs(picture * picture[..., -1:] - pictures[0] * pictures[0][..., -1:]).max(), 2e-6, (depth, order))


if __name__ == "__main__":
    main()
