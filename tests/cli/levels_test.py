"""First hits, binary pictures, sums of two samples, particles and depth cues of `render`, against closed forms and plain
loops in numpy. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import HEADLIGHT, Running, native
from scipy import ndimage
from views_test import rays, turn_of

GENERATOR = np.random.default_rng(35)
CAST = ("--via", "project.ray_cast/filter=foh/step=1", "--max-error", "9")


def follow(volume, turn, size, level):
    """The normal, by central differences of one sample, at the first place at which trilinear samples pass a level, [y, x, xyz],
    and where there is one, by small steps and bisection."""
    nz, ny, nx = volume.shape
    middle, top = np.array([nx - 1, ny - 1, nz - 1]) / 2, np.array([nx, ny, nz]) - 0.5

    def value(at):
        return ndimage.map_coordinates(volume.astype(float), at[..., ::-1].reshape(-1, 3).T, order=1,
                                       mode="nearest").reshape(at.shape[:-1]) - level

    def place(x, y, t):
        return np.stack([x, y, t], -1) @ turn + middle

    reach, step = np.linalg.norm([nx, ny, nz]) / 2 + 1, 1 / 64
    y, x = np.meshgrid(np.arange(size[1]) - (size[1] - 1) / 2, np.arange(size[0]) - (size[0] - 1) / 2, indexing="ij")
    hit, light, root = np.zeros(x.shape, bool), np.zeros(x.shape), np.zeros(x.shape)
    before = None
    for t in np.arange(-reach, reach, step):
        at = place(x, y, np.full(x.shape, t))
        inside = np.all((at >= -0.5) & (at <= top), -1)
        now = np.where(inside, value(at), np.nan)
        if before is not None:
            new = ~hit & (((before < 0) & (now >= 0)) | ((before >= 0) & (now < 0)))
            low, high = np.full(new.sum(), t - step), np.full(new.sum(), t)
            for _ in range(30 if new.any() else 0):
                half = (low + high) / 2
                same = (value(place(x[new], y[new], half)) >= 0) == (before[new] >= 0)
                low, high = np.where(same, half, low), np.where(same, high, half)
            root[new] = (low + high) / 2
            hit |= new
        before = now
    at = np.clip(place(x, y, root), 0, top - 0.5)
    gradient = np.stack([(value(at + d) - value(at - d)) / 2 for d in np.eye(3)], -1) @ turn.T
    normal = gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
    normal *= np.where(normal[..., 2:] > 0, -1, 1)  # towards the eye
    return normal, hit


def phong(normal, light=(0, 0, -1), material=(0.1, 0.7, 0.2, 10)):
    """[W93] EQ 51 of one light of intensity 1, for a parallel view."""
    a, d, s, n = material
    light = np.array(light) / np.linalg.norm(light)
    facing = normal @ light
    mirrored = 2 * facing[..., None] * normal - light
    return np.where(facing > 0, a + d * facing + s * np.maximum(0, -mirrored[..., 2]) ** n, a)


def premultiplied(picture):
    """As light arrives; files hold colours that are not multiplied by the opacity."""
    if picture.shape[-1] == 4:
        picture[..., :3] *= picture[..., 3:]
    return picture


class Levels(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.volume = (100 * ndimage.gaussian_filter(GENERATOR.random((21, 24, 27)), 2.5)).astype("<f4")
        cls.source = cls.folder / "v.nrrd"
        files.write_nrrd(cls.source, cls.volume)
        cls.level = float(np.quantile(cls.volume, 0.7))

    def render(self, *words, source=None, out="p.nrrd"):
        if "surface" in words and "--shade" not in words:
            words = (*words, *(HEADLIGHT[2:] if "--light" in words else HEADLIGHT))
        self.run_it("render", source or self.source, "-o", self.folder / out, "--quiet", *native(words))
        return premultiplied(files.read(self.folder / out)[0].astype(float))

    def refused(self, *words, code=2):
        return self.run_it("render", self.source, "-o", "null:", *words, code=code).stderr.decode()

    # --- binary

    def test_binary_is_a_threshold_of_the_largest(self):
        for level in (self.level, float(self.volume.max()), float(self.volume.min())):
            picture = self.render("--mode", "binary", "--isovalue", repr(level), "--background", "none", *CAST)
            expected = self.volume.max(0) >= level
            for channel in range(4):
                np.testing.assert_array_equal(picture[..., channel], expected)
        picture = self.render("--mode", "binary", "--isovalue", repr(self.level), "--background", "1,0.5,0", *CAST)
        np.testing.assert_array_equal(picture[..., 1], np.where(self.volume.max(0) >= self.level, 1, 0.5))

    def test_binary_of_falling_values(self):
        # Stored numbers whose slope is negative: value = 7 - stored.
        stored = GENERATOR.integers(0, 200, (6, 8, 9)).astype("u1")
        source = self.folder / "falls.nii"
        files.write_nifti(source, stored, slope=-0.5, inter=7)
        picture = self.render("--mode", "binary", "--isovalue", "-3", "--background", "none", "--view", "z", *CAST, source=source)
        np.testing.assert_array_equal(picture[..., 3], (7 - 0.5 * stored.astype(float)).max(0) >= -3)

    # --- the two highest samples

    def test_two_highest_along_an_axis(self):
        picture = self.render("--mode", "top2", *CAST)[..., 0]
        np.testing.assert_allclose(picture, np.sort(self.volume, 0)[-2:].sum(0), rtol=1e-6)
        picture = self.render("--mode", "top2", "--view", "x", *CAST)
        self.assertAlmostEqual(picture.max(), np.sort(self.volume, 2)[..., -2:].sum(-1).max(), 3)

    def test_two_highest_of_a_turned_view_are_one_unit_apart(self):
        words = ("--rotate", "20,35,10", "--mode", "top2", "--reference", "linear", *CAST)
        self.run_it("render", self.source, "-o", "null:", *words, "--verify=all", "--json", self.folder / "j.json")
        error = json.loads((self.folder / "j.json").read_text())["measured"]["error"]
        self.assertLess(error["nrmse"], 1e-5, "the reference takes the same samples")
        finer = self.run_it("render", self.source, "-o", "null:", *words[:6], "--via", "project.ray_cast/filter=foh/step=0.25",
                            "--max-error", "9", "--verify=all", "--json", "-")
        self.assertGreater(json.loads(finer.stdout)["measured"]["error"]["nrmse"], 0.01)

    # --- first hits

    def test_first_hits_are_those_of_small_steps(self):
        normal, hit = follow(self.volume, turn_of(25, 40, 15), (40, 36), self.level)
        for words, shade in (((), phong), (("--light", "-1,-2,-1.5"), lambda n: phong(n, (-1, -2, -1.5)))):
            picture = self.render("--mode", "surface", "--isovalue", repr(self.level), "--rotate", "25,40,15", "--size", "40x36",
                                  "--spacing", "1", "--background", "none", *words, "--via", "project.ray_cast/filter=foh/step=0.25",
                                  "--max-error", "9")
            expected = np.where(hit, shade(normal), 0)
            same = (picture[..., 3] == 1) == hit
            # Rays that graze the surface may pass it between two samples.
            self.assertGreater(same.mean(), 0.995)
            off = np.abs(picture[..., 0] - expected)[same]
            self.assertLess(np.sqrt((off ** 2).mean()), 2e-3)
            self.assertLess(np.median(off), 1e-5)

    def test_a_sphere_is_lit_as_its_formula_says(self):
        n, radius = 48, 17.0
        z, y, x = np.meshgrid(*[np.arange(n) - (n - 1) / 2] * 3, indexing="ij")
        source = self.folder / "ball.nrrd"
        files.write_nrrd(source, (radius - np.sqrt(x * x + y * y + z * z)).astype("<f4"))
        picture = self.render("--mode", "surface", "--isovalue", "0", "--rotate", "10,20,30", "--size", "48x48", "--spacing", "1",
                              "--background", "none", "--via", "project.ray_cast/filter=bspline3/step=0.5", "--max-error", "9",
                              source=source)
        py, px = np.meshgrid(*[np.arange(n) - (n - 1) / 2] * 2, indexing="ij")
        far = np.hypot(px, py)
        np.testing.assert_array_equal(picture[far < radius - 0.1][..., 3], 1)
        np.testing.assert_array_equal(picture[far > radius + 0.1][..., 3], 0)
        inner = far < 0.9 * radius
        cosine = np.sqrt(1 - (far[inner] / radius) ** 2)
        expected = 0.1 + 0.7 * cosine + 0.2 * np.maximum(0, 2 * cosine ** 2 - 1) ** 10
        self.assertLess(np.abs(picture[inner][..., 0] - expected).max(), 2e-3)

    def test_a_surface_is_open_where_the_volume_is_cut(self):
        # From inside it is seen from behind, by the same light.
        n, radius = 48, 17.0
        z, y, x = np.meshgrid(*[np.arange(n) - (n - 1) / 2] * 3, indexing="ij")
        source = self.folder / "ball.nrrd"
        files.write_nrrd(source, (radius - np.sqrt(x * x + y * y + z * z)).astype("<f4"))
        words = ("--mode", "surface", "--isovalue", "0", "--background", "none", "--via", "project.ray_cast/filter=foh/step=0.5",
                 "--max-error", "9")
        whole, behind = self.render(*words, source=source), self.render(*words, "--clip-plane", "0,0,1,-23.5", source=source)
        inner = np.hypot(y[0], x[0]) < 0.8 * radius
        np.testing.assert_allclose(behind[inner], whole[inner], atol=2e-3)

    def test_any_number_of_threads_and_the_predicted_error(self):
        words = ("--mode", "surface", "--isovalue", repr(self.level), "--rotate", "25,40,15", "--size", "60")
        pictures = [self.render(*words, "--threads", n) for n in (1, 2, 7)]
        np.testing.assert_array_equal(pictures[0], pictures[1])
        np.testing.assert_array_equal(pictures[0], pictures[2])
        done = self.run_it("render", self.source, "-o", "null:", *words, "--max-error", "0.05", "--verify=all", "--json", "-")
        report = json.loads(done.stdout)
        self.assertLessEqual(report["measured"]["error"]["nrmse"], 0.05)
        self.assertLessEqual(report["measured"]["error"]["nrmse"], 1.05 * report["plan"]["predicted"]["error"])

    def test_flat_and_gradient_facet(self):
        words = ("--mode", "surface", "--isovalue", repr(self.level), "--background", "none", "--max-error", "9")
        flat = self.render(*words, "--shade", "none")
        np.testing.assert_array_equal(flat[..., 0], flat[..., 3])
        lit = self.render(*words, "--via", "project.ray_cast/filter=foh/step=1")
        beside = self.render(*words, "--via", "shade.gradient/scheme=central", "--via", "project.gradient_cast/filter=foh/step=1")
        np.testing.assert_array_equal(lit[..., 3], beside[..., 3])
        self.assertLess(np.abs(lit - beside).max(), 0.02)

    def test_drawn_triangles_and_cast_rays_show_the_same_surface(self):
        for words in ((), ("--rotate", "20,40,0"), ("--perspective", "40"), ("--rotate", "20,40,0", "--clip-plane", "0,0,1,-10"),
                      ("--depth-cue", "0.05", "--rotate", "0,180,0")):
            words = ("--mode", "surface", "--isovalue", repr(self.level), "--background", "none", "--size", "60", "--max-error", "9", *words)
            cast = self.render(*words, "--via", "project.ray_cast/filter=foh/step=0.25")
            drawn = self.render(*words, "--via", "surface.draw/light=pixel")
            same = cast[..., 3] == drawn[..., 3]
            # A mesh ends at the outermost samples, rays half a voxel further.
            self.assertGreater(same.mean(), 0.93, words)
            both = same & (cast[..., 3] == 1)
            self.assertLess(np.median(np.abs(cast - drawn)[both]), 0.02, words)
        words = [word for word in words if word not in ("--max-error", "9")]
        gouraud = self.render(*words, "--via", "surface.draw/light=vertex")
        self.assertLess(np.median(np.abs(gouraud - drawn)[both]), 0.02)
        self.assertGreater(np.abs(gouraud - drawn).max(), 1e-4)
        many = self.run_it("render", self.source, "-o", self.folder / "t_%d.nrrd", "--turntable", "4", *words, "--via", "surface.draw/light=pixel",
                           "--verify", "--json", "-")
        report = json.loads(many.stdout)
        self.assertEqual([step["transition"] for step in report["plan"]["steps"]][-2:], ["surface.flying_edges", "surface.draw"])
        self.assertLessEqual(report["measured"]["error"]["low"], 2 * report["plan"]["predicted"]["error"])

    # --- depth cues

    def slab(self, value=3.0, shape=(30, 8, 8)):
        source = self.folder / "slab.nrrd"
        files.write_nrrd(source, np.full(shape, value, "<f4"))
        return source

    def test_integrals_with_a_depth_cue(self):
        length, value, k = 30, 3.0, 0.05
        for mode, scale in (("xray", length), ("mean", 1)):
            for kind, share in (("exp", (1 - np.exp(-k * length)) / (k * length)), ("linear", 20 / 2 / length)):
                picture = self.render("--mode", mode, "--depth-cue", f"{k},{kind}", "--via", "project.ray_cast/filter=foh/step=0.25",
                                      "--max-error", "9", source=self.slab())
                np.testing.assert_allclose(picture[..., 0], value * scale * share, rtol=2e-4)
        # Turned, the nearest corner is farther away; verified against the reference.
        for words in (("--rotate", "30,40,0"), ("--rotate", "30,40,0", "--perspective", "40"), ("--spacing", "2"), ("--scale", "0.5")):
            done = self.run_it("render", self.source, "-o", "null:", "--mode", "xray", "--depth-cue", "0.1", *words, "--via", "project.ray_cast/filter=foh/step=0.25",
                               "--reference", "linear", "--max-error", "9", "--verify=all", "--json", "-")
            self.assertLess(json.loads(done.stdout)["measured"]["error"]["nrmse"], 0.003, words)

    def test_a_turned_view_counts_from_its_nearest_corner(self):
        k, turn = 0.1, turn_of(30, 40, 0)
        sizes = np.array(self.volume.shape[::-1])
        nearest = min((turn @ (sizes / 2 * [a, b, c]))[2] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1))
        values = rays(self.volume, turn, (30, 28), 1 / 32, lambda at: np.full(at.shape[:-1], True))
        reach = np.linalg.norm(sizes) / 2 + 1
        depth = np.arange(-reach, reach, 1 / 32) + 1 / 64 - nearest
        expected = np.nansum(values * np.exp(-k * depth), -1) / 32
        picture = self.render("--mode", "xray", "--zero", "0", "--depth-cue", str(k), "--rotate", "30,40,0", "--size", "30x28",
                              "--spacing", "1", "--via", "project.ray_cast/filter=foh/step=0.25", "--max-error", "9")[..., 0]
        self.assertLess(np.abs(picture - expected).max(), 0.01 * expected.max())

    def test_composites_and_surfaces_with_a_depth_cue(self):
        transfer = self.folder / "t.json"
        transfer.write_text(json.dumps({"points": [{"value": 3, "opacity": 0.1, "color": [1, 0.5, 0.25]}], "unit": 1}))
        k = 0.05
        picture = self.render("--mode", "composite", "--transfer", transfer, "--depth-cue", str(k), "--background", "none",
                              "--via", "project.ray_cast/filter=foh/step=1", "--max-error", "9", source=self.slab())
        cells = np.arange(30)
        light = (0.1 * 0.9 ** cells * np.exp(-k * (cells + 0.5))).sum()
        np.testing.assert_allclose(picture[..., 0], light, rtol=1e-4)
        np.testing.assert_allclose(picture[..., 1], light / 2, rtol=1e-4)
        np.testing.assert_allclose(picture[..., 3], 1 - 0.9 ** 30, rtol=1e-5)
        ramp = self.folder / "ramp.nrrd"
        files.write_nrrd(ramp, np.broadcast_to(np.arange(30, dtype="<f4")[:, None, None], (30, 8, 8)).copy())
        picture = self.render("--mode", "surface", "--isovalue", "12.25", "--depth-cue", "0.1", "--background", "none", *CAST, source=ramp)
        np.testing.assert_allclose(picture[..., 0], np.exp(-0.1 * 12.75), rtol=1e-5)  # 1 of light: it is met straight on

    # --- particles

    def test_particles_scatter_by_their_phase(self):
        transfer = self.folder / "t.json"
        transfer.write_text(json.dumps({"points": [{"value": 3, "opacity": 0.1, "color": [0.2, 0.1, 0.05]}], "unit": 1}))
        words = ("--mode", "composite", "--transfer", transfer, "--shade", "particles", "--background", "none", *CAST)
        opacity = 1 - 0.9 ** 30
        for light, cosine in (("0,0,-1", -1), ("1,0,0", 0), ("0,0,1", 1), ("1,0,-1,0.5", -np.sqrt(0.5))):
            for g in (0, 0.4, -0.7):
                phase = (1 - g * g) / (1 + g * g - 2 * g * cosine) ** 1.5 * (0.5 if light.endswith("0.5") else 1)
                picture = self.render(*words, "--light", light, "--phase", str(g), source=self.slab())
                np.testing.assert_allclose(picture[..., 0], 0.2 * phase * opacity, rtol=1e-4)
                np.testing.assert_allclose(picture[..., 3], opacity, rtol=1e-5)
        unlit = self.render("--mode", "composite", "--transfer", transfer, "--background", "none", *CAST, source=self.slab())
        np.testing.assert_allclose(self.render(*words, source=self.slab()), unlit, rtol=1e-5)
        done = self.run_it("render", self.source, "-o", "null:", "--mode", "composite", "--shade", "particles", "--phase", "0.5",
                           "--rotate", "20,30,0", "--perspective", "50", "--reference", "linear", *CAST, "--verify=all", "--json", "-")
        self.assertLess(json.loads(done.stdout)["measured"]["error"]["nrmse"], 0.02)

    # --- what makes no sense

    def test_refusals(self):
        for words, part in ((("--mode", "surface"), "--isovalue V"), (("--mode", "binary"), "--isovalue V"),
                            (("--isovalue", "3"), "--mode surface, binary"), (("--mode", "surface", "--isovalue", "nan"), "finite"),
                            (("--mode", "mip", "--depth-cue", "1"), "--depth-cue"), (("--mode", "xray", "--depth-cue", "-1"), "at least 0"),
                            (("--mode", "xray", "--depth-cue", "1,cubic"), "cubic"), (("--mode", "xray", "--depth-cue", "1,exp,2"), "K,linear"),
                            (("--mode", "composite", "--phase", "0.1"), "particles"),
                            (("--mode", "composite", "--shade", "particles", "--phase", "1"), "between -1 and 1"),
                            (("--mode", "composite", "--shade", "particles", "--material", "1,0,0,1"), "--material"),
                            (("--mode", "surface", "--isovalue", "3", "--shade", "particles"), "particles"),
                            (("--mode", "top2", "--background", "none"), "--background")):
            self.assertIn(part, self.refused(*words), words)
        out = self.run_it("render", self.source, "-o", "null:", "--mode", "surface", "--isovalue", "1e6")
        self.assertIn("no surface", out.stderr.decode())
        self.refused("--mode", "surface", "--isovalue", "3", "--via", "project.shear_warp", code=3)


if __name__ == "__main__":
    unittest.main()
