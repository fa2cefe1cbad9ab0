"""Clips by balls of `render`, against chords and brute force in numpy. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import Running
from views_test import rays, smooth, turn_of

CAST = ("--via", "project.ray_cast/filter=foh/step=1", "--max-error", "9")
NEAREST = ("--via", "project.ray_cast/filter=zoh/step=1", "--max-error", "9")


def words_of(*balls):
    return [word for ball in balls for word in ("--clip-ball", ",".join(map(str, ball)))]


class Balls(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.volume = smooth((13, 16, 19))
        cls.source = cls.folder / "v.nrrd"
        files.write_nrrd(cls.source, cls.volume)
        cls.constant = cls.folder / "c.nrrd"
        files.write_nrrd(cls.constant, np.full((40, 41, 42), 2, "<f4"))

    def picture(self, *words, source=None, out="p.nrrd"):
        size = () if "--size" in words else ("--size", "native")
        self.run_it("render", source or self.source, "-o", self.folder / out, "--quiet", *words, *size)
        return files.read(self.folder / out)[0, ..., 0].astype(float)

    # --- closed forms

    def test_the_xray_of_a_constant_is_twice_its_chords(self):
        size = np.array([30, 28])
        right, down = np.meshgrid(*[np.arange(n) - (n - 1) / 2 for n in size])
        middle = np.array([20.5, 20, 19.5])
        for spacing in ((1, 1, 1), (0.7, 1, 1.6)):
            for turn in ((0, 0, 0), (20, 30, 10), (90, 0, 45)):
                for centre, radius in ((middle, 9.3), (middle + (1.5, -2, 0.75), 8)):
                    got = self.picture("--mode", "xray", "--rotate", ",".join(map(str, turn)), "--input-spacing", ",".join(map(str, spacing)),
                                       "--size", "x".join(map(str, size)), "--spacing", "1", *words_of((*centre, radius)), source=self.constant)
                    away = turn_of(*turn) @ ((centre - middle) * spacing)
                    square = (right - away[0]) ** 2 + (down - away[1]) ** 2
                    chord = 2 * np.sqrt(np.maximum(0, radius ** 2 - square))
                    np.testing.assert_allclose(got, 2 * chord, rtol=1e-6, atol=0, err_msg=str((spacing, turn, radius)))

    def test_the_eyes_rays_have_chords(self):
        # Square pixels about the middle; rays of one field of view, of which the middle one goes through the centre.
        got = self.picture("--mode", "xray", "--perspective", "30", "--size", "31x31", *words_of((20.5, 20, 19.5, 6)), source=self.constant)
        self.assertAlmostEqual(got[15, 15] / 24, 1, 6)
        self.assertGreater((got == 0).sum(), 100)
        self.assertLessEqual(got.max(), 24.0001)
        mean = self.picture("--mode", "mean", "--perspective", "30", "--size", "31x31", *words_of((20.5, 20, 19.5, 6)), source=self.constant)
        np.testing.assert_allclose(mean[got > 0], 2, rtol=1e-6)

    def test_balls_that_leave_a_lens(self):
        got = self.picture("--mode", "xray", *words_of((20.5, 20, 16, 6), (20.5, 20, 24, 6)), source=self.constant)
        self.assertAlmostEqual(got[20, 20 if got.shape[1] == 41 else got.shape[1] // 2] / 8, 1, 1)
        self.assertAlmostEqual(got.max() / 8, 1, 1)

    # --- nearest samples along an axis: sums over voxels, each as long as the ray has of it in the ball

    def overlaps(self, centre, radius):
        """Of each voxel, how long the ray through its middle along z is in the ball."""
        nz, ny, nx = self.volume.shape
        z, y, x = np.meshgrid(np.arange(nz), np.arange(ny), np.arange(nx), indexing="ij")
        half = np.sqrt(np.maximum(0, radius ** 2 - (x - centre[0]) ** 2 - (y - centre[1]) ** 2))
        return np.maximum(0, np.minimum(z + 0.5, centre[2] + half) - np.maximum(z - 0.5, centre[2] - half)) * (half > 0)

    def test_modes_are_sums_of_the_voxels_that_are_kept(self):
        centre, radius = (9.2, 7.6, 6.3), 5.15
        length = self.overlaps(centre, radius)
        kept, v = length > 0, self.volume.astype(float)
        inside = length.sum(0) > 0
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = (length * v).sum(0) / length.sum(0)
            deviation = np.sqrt((length * (v - mean) ** 2).sum(0) / length.sum(0))
        low, high = v.min(), v.max()
        light, left = np.zeros(inside.shape), np.ones(inside.shape)
        for plane, part in zip(v, length):
            grey = (plane - low) / (high - low)
            opacity = 1 - (1 - 0.05 * grey) ** part
            light, left = light + left * opacity * grey, left * (1 - opacity)
        for mode, values, more in (("mip", np.where(kept, v, -1).max(0), ()), ("minip", np.where(kept, v, 9).min(0), ()),
                                   ("xray", (length * v).sum(0), ()), ("mean", mean, ()), ("stddev", deviation, ()),
                                   ("composite", light, ("--window", f"{float(low)},{float(high)}"))):
            got = self.picture("--mode", mode, *words_of((*centre, radius)), *more, *NEAREST)
            np.testing.assert_allclose(got[inside], values[inside], rtol=2e-5, atol=2e-5, err_msg=mode)

    def test_voxels_outside_are_as_if_they_were_no_numbers(self):
        centre, radius = (9.2, 7.6, 6.3), 5.15
        length = self.overlaps(centre, radius)
        files.write_nrrd(self.folder / "n.nrrd", np.where(length > 0, self.volume, np.nan).astype("<f4"))
        inside = length.sum(0) > 0
        for mode in ("mip", "minip", "top2"):
            cut = self.picture("--mode", mode, *words_of((*centre, radius)), *NEAREST)
            absent = self.picture("--mode", mode, *NEAREST, source=self.folder / "n.nrrd")
            self.assertTrue(np.array_equal(cut[inside], absent[inside]), mode)

    def test_a_surface_is_open_at_the_ball(self):
        # As at a plane: from within the surface nothing of it is seen, and what lies before it changes nothing.
        z, y, x = np.meshgrid(*[np.arange(41) - 20] * 3, indexing="ij")
        files.write_nrrd(self.folder / "b.nrrd", (12 - np.sqrt(x * x + y * y + z * z)).astype("<f4"))
        words = ("--mode", "surface", "--isovalue", "1", "--background", "none", "--max-error", "9", "--via", "project.ray_cast/filter=foh/step=0.5")

        def picture(*more):
            self.run_it("render", self.folder / "b.nrrd", "-o", self.folder / "s.nrrd", "--quiet", *words, *more, "--size", "native")
            return files.read(self.folder / "s.nrrd")[0].astype(float)

        self.assertEqual(picture(*words_of((20, 20, 20, 9)))[..., 3].max(), 0)
        whole = picture()
        self.assertGreater((whole[..., 3] > 0).sum(), 300)
        np.testing.assert_allclose(picture(*words_of((20, 20, 20, 15))), whole, atol=1e-3 * whole.max())
        # A ball around a point of the surface shows a cap of it.
        cap = picture(*words_of((20, 20, 9, 4)))[..., 3]
        far = np.hypot(x[0], y[0])
        self.assertTrue((cap[far > 4] == 0).all())
        self.assertTrue((cap[far < 3] == whole[..., 3].max()).all())

    # --- turned, and together with other clips

    def test_a_ball_a_box_a_plane_and_a_slab_add_up(self):
        balls = ((9, 8, 6, 6.5), (11, 7, 5, 7))
        turn, size, step = (20, 30, 10), (24, 22), 1 / 16

        def kept(p):
            inside = (p @ [1, -2, 0.5] + 9 >= 0) & (p[..., 0] >= 3.5)
            for *centre, radius in balls:
                inside &= ((p - centre) ** 2).sum(-1) <= radius ** 2
            return inside

        values = rays(self.volume, turn_of(*turn), size, step, kept, slab=8)
        words = ("--rotate", "20,30,10", "--size", "24x22", "--spacing", "1", *words_of(*balls), "--clip-plane", "1,-2,0.5,9", "--clip",
                 "4,0,0,18,15,12", "--slab", "8", "--via", "project.ray_cast/filter=foh/step=0.25", "--max-error", "9")
        got = self.picture("--mode", "xray", *words)
        np.testing.assert_allclose(got, step * np.nansum(values, -1), atol=2 * step * self.volume.max())
        many = step * np.isfinite(values).sum(-1) > 2
        self.assertGreater(many.sum(), 20)
        np.testing.assert_allclose(self.picture("--mode", "mip", *words)[many], np.nanmax(values[many], -1), atol=0.03)

    def test_a_ball_of_everything_is_none(self):
        self.picture("--rotate", "20,30,40", out="all.nrrd")
        self.picture("--rotate", "20,30,40", *words_of((9, 7, 6, 100)), out="same.nrrd")
        self.assertEqual((self.folder / "same.nrrd").read_bytes(), (self.folder / "all.nrrd").read_bytes())

    def test_a_cropped_ball_is_the_ball(self):
        big = self.folder / "big.nrrd"
        files.write_nrrd(big, smooth((30, 60, 90)))
        words = ("--mode", "mean", "--rotate", "20,30,10", "--input-spacing", "1,1,2", *words_of((30, 20, 14, 10)), "--max-error", "9")
        cast = ("--via", "project.ray_cast/filter=bspline3/step=0.5")
        whole = self.picture(*words, *cast, "--without", "store.crop", source=big)
        crop = self.picture(*words, "--via", "store.crop", *cast, source=big)
        np.testing.assert_allclose(crop, whole, atol=2e-6)

    def test_predicted_errors_hold(self):
        for words in (("--mode", "mean", "--rotate", "20,30,10"), ("--mode", "mip", "--perspective", "40"),
                      ("--mode", "composite", "--rotate", "20,30,10"), ("--mode", "xray", "--turntable", "3", "--slab", "9")):
            done = self.run_it("render", self.source, "-o", "null:", *words, *words_of((9, 8, 6, 6)), "--max-error", "0.03", "--verify=all",
                               "--json", "-")
            report = json.loads(done.stdout)
            self.assertLess(report["measured"]["error"]["nrmse"], 0.03, words)
            self.assertTrue(report["measured"]["kept"], words)

    def test_shadows_end_at_the_ball(self):
        words = ("--mode", "composite", "--shade", "phong", "--light", "-1,-1,-1", "--shadows", "--background", "none", "--size", "40x40")
        self.run_it("render", self.source, "-o", self.folder / "all.nrrd", "--quiet", *words, "--max-error", "9", "--size", "native")
        self.run_it("render", self.source, "-o", self.folder / "cut.nrrd", "--quiet", *words, *words_of((9, 8, 6, 4)), "--max-error", "9", "--size", "native")
        whole, cut = (files.read(self.folder / f"{name}.nrrd")[0].astype(float) for name in ("all", "cut"))
        self.assertLess((cut[..., 3] > 0).sum(), (whole[..., 3] > 0).sum())
        self.assertGreater((cut[..., 3] > 0).sum(), 20)

    def test_threads_change_no_byte(self):
        written = []
        for threads in (1, 2, 7):
            self.picture("--mode", "composite", "--rotate", "20,30,10", *words_of((9, 8, 6, 6), (12, 8, 6, 7)), "--size", "150x150", "--threads",
                         str(threads), out=f"t{threads}.nrrd")
            written.append((self.folder / f"t{threads}.nrrd").read_bytes())
        self.assertEqual(len(set(written)), 1)

    def test_edges_that_cannot_say_so(self):
        for edge in ("shear_warp", "combine", "spectrum.slice"):
            done = self.run_it("render", self.source, "-o", "null:", "--mode", "mean", "--rotate", "20,30,10", *words_of((9, 8, 6, 6)), "--via",
                               edge, "--max-error", "9", code=3)
            self.assertIn("clip", done.stderr.decode(), edge)

    def test_one_voxel_and_thin_volumes(self):
        for shape in ((1, 1, 1), (1, 9, 9), (9, 1, 9)):
            files.write_nrrd(self.folder / "t.nrrd", np.full(shape, 3, "<f4"))
            middle = [(n - 1) / 2 for n in shape[::-1]]
            got = self.picture("--mode", "xray", "--size", "9x9", *words_of((*middle, 0.4)), source=self.folder / "t.nrrd")
            self.assertAlmostEqual(got[4, 4] / 2.4, 1, 5, shape)

    def test_balls_that_make_no_sense(self):
        for words, says in ((("--clip-ball", "1,2,3"), "X,Y,Z,R"), (("--clip-ball", "9,8,6,0"), "radius"), (("--clip-ball", "9,8,6,-1"), "radius"),
                            (("--clip-ball", "9,8,nan,3"), "--clip-ball"), (("--clip-ball", "9,8,6,inf"), "--clip-ball"),
                            (("--clip-ball", "50,8,6,3"), "keeps nothing"), (("--clip-ball", "4,8,6,2", "--clip-ball", "14,8,6,2"), "keeps nothing"),
                            (("--clip-ball", "4,8,6,2", "--clip", "12,0,0,18,15,12"), "keeps nothing")):
            done = self.run_it("render", self.source, "-o", "null:", *words, code=2)
            self.assertIn(says, done.stderr.decode(), words)


if __name__ == "__main__":
    unittest.main()
