"""Eyes that have a place (`render --eye --look-at`), against rays that are cut finely in numpy. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import unittest

import files
import numpy as np
from running import Running
from scipy import ndimage
from views_test import smooth, turn_of

CAST = ("--via", "project.ray_cast/filter=foh/step=0.25", "--max-error", "9", "--reference", "linear")
SPACING = (1, 0.7, 1.6)
STEP = 1 / 16  # of the rays in numpy
SIZE = (15, 12)  # width, height
FOV = 50


def words_of(eye, at=None, fov=FOV):
    """Arguments that begin with a minus are joined to their option."""
    words = [f"--perspective={fov}", "--eye=" + ",".join(map(str, eye))]
    return words if at is None else [*words, "--look-at=" + ",".join(map(str, at))]


def axes_of(along, up=(0, -1, 0)):
    """Right, down and away, in the file's axes: what is up is as far up as it can be."""
    away = np.array(along, float) / np.linalg.norm(along)
    right = np.cross(away, up)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(away, right), away])


class Eyes(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.volume = smooth((11, 16, 13))
        cls.source = cls.folder / "v.nrrd"
        files.write_nrrd(cls.source, cls.volume)
        cls.ball = cls.folder / "b.nrrd"
        z, y, x = np.meshgrid(*[np.arange(25) - 12] * 3, indexing="ij")
        files.write_nrrd(cls.ball, (12 - np.sqrt(x * x + y * y + z * z)).astype("<f4"))

    def picture(self, *words, source=None, out="p.nrrd", spacing=SPACING):
        self.run_it("render", source or self.source, "-o", self.folder / out, "--quiet", "--input-spacing", ",".join(map(str, spacing)),
                    *words)
        return files.read(self.folder / out)[0].astype(float)

    def refused(self, *words, code=2):
        return self.run_it("render", self.source, "-o", "null:", *words, code=code).stderr.decode()

    def rays(self, eye, axes, fov=FOV, size=SIZE, wide=1, deepest=None):
        """Values and depths along the rays of the eye, [y, x, cell]; NaN is outside."""
        spacing = np.array(SPACING)
        half = np.tan(np.radians(fov / 2))
        x, y = np.meshgrid((np.arange(size[0]) + 0.5) * 2 / size[1] - size[0] / size[1], (np.arange(size[1]) + 0.5) * 2 / size[1] - 1)
        along = np.stack([wide * x * half, y * half, np.ones(x.shape)], -1)
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        n = np.array(self.volume.shape[::-1])
        reach = np.linalg.norm(np.maximum(np.abs(eye), np.abs(n - np.array(eye))) * spacing) + 2
        t = np.arange(0, reach, STEP) + STEP / 2
        at = np.array(eye) + (along @ axes)[:, :, None] * t[:, None] / spacing
        inside = np.all((at >= -0.5) & (at <= n - 0.5), -1)
        if deepest is not None:
            inside &= along[..., 2:] * t <= deepest
        values = ndimage.map_coordinates(self.volume.astype(float), at[..., ::-1].reshape(-1, 3).T, order=1, mode="nearest")
        return np.where(inside, values.reshape(inside.shape), np.nan), along[..., 2:] * t

    def expect_as(self, words, values, least=20):
        """Integrals, and maxima of the rays that are not too short."""
        words = ("--size", "x".join(map(str, SIZE)), *words, *CAST)
        got = self.picture("--mode", "xray", *words)[..., 0]
        # A sum of middles is off by the ends of the rays, and where the field bends.
        np.testing.assert_allclose(got, STEP * np.nansum(values, -1), atol=2 * STEP * self.volume.max(), err_msg=str(words))
        many = STEP * np.isfinite(values).sum(-1) > 1
        self.assertGreaterEqual(many.sum(), least, words)
        if least:
            np.testing.assert_allclose(self.picture("--mode", "mip", *words)[..., 0][many], np.nanmax(values[many], -1), atol=0.03,
                                       err_msg=str(words))

    # --- against numpy

    def test_eyes_within_outside_and_on_samples(self):
        for eye, at in (((6.3, 7.1, 4.4), (3, 2, 9)),       # within
                        ((6, 7, 5), (6, 7, 9)),             # on a sample, along an axis
                        ((-0.5, -0.5, -0.5), (6, 8, 5)),    # on a corner
                        ((12.5, 7, 5), (2, 7, 5)),          # in a face
                        ((30, -12, 21), (6, 8, 5)),         # outside
                        ((6.3, 7.1, -4), (6.3, 9, 3)),      # before a face
                        ((-2, 3, 4), (-1, 15, 5))):         # beside it, along a face
            along = (np.array(at) - eye) * SPACING
            self.expect_as(words_of(eye, at), self.rays(eye, axes_of(along))[0])

    def test_without_look_at_the_view_and_the_turns_decide(self):
        eye = (6.3, 7.1, 4.4)
        self.expect_as(words_of(eye), self.rays(eye, np.eye(3))[0])
        self.expect_as((*words_of(eye), "--rotate", "20,30,10"), self.rays(eye, turn_of(20, 30, 10))[0])
        along_x = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]])
        self.expect_as((*words_of(eye), "--view", "x"), self.rays(eye, along_x)[0])

    def test_turns_are_about_the_eye(self):
        eye, at = (6.3, 7.1, 4.4), (3, 2, 9)
        towards = axes_of((np.array(at) - eye) * SPACING)
        self.expect_as((*words_of(eye, at), "--rotate", "0,0,40"), self.rays(eye, turn_of(0, 0, 40) @ towards)[0])
        self.picture(*words_of(eye, at), "--rotate", "5,10,15", "--size", "15x12", out="a.nrrd")
        for words in (("--about", "2,3,4"), ("--translate", "5,4,3"), ("--view", "z")):
            self.picture(*words_of(eye, at), "--rotate", "5,10,15", "--size", "15x12", *words, out="b.nrrd")
            self.assertEqual((self.folder / "a.nrrd").read_bytes(), (self.folder / "b.nrrd").read_bytes(), words)

    def test_a_turntable_looks_round(self):
        eye = (6.3, 7.1, 4.4)
        self.run_it("render", self.source, "-o", self.folder / "t%d.nrrd", "--input-spacing", ",".join(map(str, SPACING)), "--mode", "xray",
                    *words_of(eye), "--turntable", "3", "--size", "15x12", *CAST)
        for view in range(3):
            values = self.rays(eye, turn_of(0, 120 * view, 0))[0]
            np.testing.assert_allclose(files.read(self.folder / f"t{view}.nrrd")[0, ..., 0], STEP * np.nansum(values, -1),
                                       atol=2 * STEP * self.volume.max())

    def test_up_is_that_of_the_view(self):
        eye = (6.3, 7.1, 4.4)
        # --view x shows z downwards.
        self.expect_as((*words_of(eye, (3, 2, 9)), "--view", "x"), self.rays(eye, axes_of((np.array([3, 2, 9]) - eye) * SPACING, (0, 0, -1)))[0])
        # Straight down and up: right stays right.
        for at, axes in (((6.3, 12, 4.4), ((1, 0, 0), (0, 0, -1), (0, 1, 0))), ((6.3, 2, 4.4), ((1, 0, 0), (0, 0, 1), (0, -1, 0)))):
            self.expect_as(words_of(eye, at), self.rays(eye, np.array(axes, float))[0])
        # The same as a hair beside it.
        down = self.picture("--mode", "xray", *words_of(eye, (6.3, 12, 4.4)), "--size", "15x12", *CAST)
        beside = self.picture("--mode", "xray", *words_of(eye, (6.3, 12, 4.4 + 1e-7)), "--size", "15x12", *CAST)
        np.testing.assert_allclose(beside, down, atol=1e-4)

    def test_scale_zoom_and_size(self):
        eye, at = (6.3, 7.1, 4.4), (3, 2, 9)
        towards = axes_of((np.array(at) - eye) * SPACING)
        # Lengths are those of the screen, which a scale enlarges; what is seen is the same.
        values, _ = self.rays(eye, towards)
        got = self.picture("--mode", "xray", *words_of(eye, at), "--scale", "2", "--size", "15x12", *CAST)[..., 0]
        np.testing.assert_allclose(got, 2 * STEP * np.nansum(values, -1), atol=4 * STEP * self.volume.max())
        narrow = 2 * np.degrees(np.arctan(np.tan(np.radians(FOV / 2)) / 2))
        self.expect_as((*words_of(eye, at), "--zoom", "2"), self.rays(eye, towards, fov=narrow)[0])
        # The angle is from top to bottom, whatever the size and the pixels' shape.
        tall = self.rays(eye, towards, size=(9, 20))[0]
        got = self.picture("--mode", "xray", *words_of(eye, at), "--size", "9x20", *CAST)[..., 0]
        np.testing.assert_allclose(got, STEP * np.nansum(tall, -1), atol=2 * STEP * self.volume.max())
        # Pixels twice as wide show twice as much aside.
        values = self.rays(eye, towards, wide=2)[0]
        got = self.picture("--mode", "xray", *words_of(eye, at), "--spacing", "2,1", "--size", "15x12", *CAST)[..., 0]
        np.testing.assert_allclose(got, STEP * np.nansum(values, -1), atol=2 * STEP * self.volume.max())
        # As large from anywhere.
        for place in ((6, 7, 5), (400, -300, 20)):
            self.assertEqual(self.picture(*words_of(place)).shape, self.picture(*words_of(eye)).shape)

    def test_mirrored_and_sheared_content(self):
        eye = (6.3, 7.1, 4.4)
        self.expect_as((*words_of(eye), "--scale=-1,1,1"), self.rays(eye, np.diag([-1.0, 1, 1]))[0])

    def test_looking_away_and_from_far_there_is_nothing(self):
        for words in (words_of((6, 7, -9), (6, 7, -20)), words_of((40, 7, 5), (60, 7, 5)), words_of((1e6, 7, 5), (2e5, 9e5, 5), fov=10)):
            for mode, value in (("xray", 0), ("mip", self.volume.min()), ("composite", 0)):
                got = self.picture("--mode", mode, *words, "--size", "15x12")
                self.assertEqual(len(np.unique(got)), 1, (mode, words))
                self.assertEqual(got.flat[0], np.float32(value), (mode, words))
            done = self.run_it("render", self.source, "-o", "null:", *words, "--size", "15x12", "--verify=all", "--json", "-")
            report = json.loads(done.stdout)
            self.assertEqual(report["measured"]["error"]["nrmse"], 0, words)
            self.assertIn("nothing of the volume is in the picture", " ".join(map(str, report["warnings"])), words)

    def test_a_far_eye_sees_as_parallel_rays_do(self):
        # 1e5 away, with an angle whose picture is as high as the volume's.
        away, height = 1e5, 16 * 0.7
        words = words_of((6, 7.5, 5 - away / 1.6), (6, 7.5, 5), fov=2 * np.degrees(np.arctan(height / 2 / away)))
        got = self.picture("--mode", "xray", *words, "--size", "12x16", *CAST)
        flat = self.picture("--mode", "xray", "--view", "z", "--size", "12x16", "--spacing", "0.7", *CAST)
        np.testing.assert_allclose(got, flat, rtol=2e-4)

    # --- what goes with the eye

    def test_a_slab_begins_at_the_eye(self):
        eye, at = (6.3, 7.1, 4.4), (3, 2, 9)
        values, _ = self.rays(eye, axes_of((np.array(at) - eye) * SPACING), deepest=3.5)
        self.expect_as((*words_of(eye, at), "--slab", "3.5"), values)
        self.assertIn("--slab: keeps nothing", self.refused(*words_of((90, 7, 5), (6, 7, 5)), "--slab", "3"))

    def test_clips_are_as_from_anywhere(self):
        eye, at = (6.3, 7.1, 4.4), (3, 2, 9)
        values, depth = self.rays(eye, axes_of((np.array(at) - eye) * SPACING))
        whole = self.picture("--mode", "xray", *words_of(eye, at), "--size", "15x12", *CAST)
        same = self.picture("--mode", "xray", *words_of(eye, at), "--clip", "0,0,0,12,15,10", "--size", "15x12", *CAST)
        np.testing.assert_array_equal(whole, same)
        part = self.picture("--mode", "xray", *words_of(eye, at), "--clip", "0,0,0,12,15,4", "--size", "15x12", *CAST)
        self.assertLess(part.sum(), 0.5 * whole.sum())

    def test_light_falls_from_the_eye_on(self):
        eye, at = (6.3, 7.1, 4.4), (3, 2, 9)
        values, depth = self.rays(eye, axes_of((np.array(at) - eye) * SPACING))
        for cue, left in (("0.1", np.exp(-0.1 * depth)), ("0.08,linear", np.maximum(0, 1 - 0.08 * depth))):
            got = self.picture("--mode", "xray", *words_of(eye, at), "--depth-cue", cue, "--size", "15x12", *CAST)[..., 0]
            np.testing.assert_allclose(got, STEP * np.nansum(values * left, -1), atol=2 * STEP * self.volume.max())

    def test_from_within_a_surface_its_inside_is_seen(self):
        """A ball of radius 8 from its middle: the whole picture is its inside, lit from the eye. Triangles show the same."""
        words = (*words_of((12, 12, 12), (12, 12, 20)), "--mode", "surface", "--isovalue", "4", "--size", "15x12", "--max-error", "9",
                 "--background", "none", "--shade", "none")
        cast = self.picture(*words, "--via", "project.ray_cast", source=self.ball, spacing=(1, 1, 1))
        self.assertEqual(cast[..., 3].min(), 1)
        drawn = self.picture(*words, "--via", "surface", source=self.ball, spacing=(1, 1, 1))
        np.testing.assert_allclose(drawn, cast, atol=1e-3)
        # Farther out there is none: an eye in what is below the level, that looks away.
        words = (*words_of((12, 12, 22), (12, 12, 30)), *words[3:])
        self.assertEqual(self.picture(*words, source=self.ball, spacing=(1, 1, 1))[..., 3].max(), 0)

    def test_edges_that_need_parallel_rays_or_a_distance_say_so(self):
        words = (*words_of((6.3, 7.1, 4.4), (3, 2, 9)), "--max-error", "9")
        for edge, mode, reason in (("project.shear_warp_perspective", "mip", "inside the volume"), ("project.shear_warp", "mip", "finite distance"),
                                   ("project.shear_warp_perspective_runs", "composite", "inside the volume"),
                                   ("project.splat_ewa", "xray", "beside the eye or behind it"), ("spectrum.slice", "xray", "perspective")):
            done = self.run_it("render", self.source, "-o", "null:", "--mode", mode, *words, "--via", edge, code=3)
            self.assertIn(reason, done.stderr.decode(), edge)

    def test_promised_errors_hold(self):
        for words in (("--mode", "mip"), ("--mode", "xray", "--turntable", "3"), ("--mode", "composite", "--shade", "phong")):
            for eye in ((6.3, 7.1, 4.4), (-0.5, -0.5, -0.5)):
                done = self.run_it("render", self.source, "-o", "null:", *words, *words_of(eye, (6, 8, 6)), "--max-error", "0.03", "--verify=all",
                                   "--size", "40x30", "--json", "-")
                report = json.loads(done.stdout)
                self.assertLess(report["measured"]["error"]["nrmse"], 0.03, (words, eye))
                self.assertTrue(report["measured"]["kept"], (words, eye))
                self.assertNotIn("nothing of the volume", " ".join(map(str, report["warnings"])), (words, eye))

    def test_an_eye_in_a_face_is_before_it(self):
        """Rays that leave there meet nothing, whatever rounding makes of the place, and those that enter see what is behind the face."""
        for eye, at in (((-0.5, -0.5, -0.5), (-9, -9, -9)), ((12.5, 7, 5), (30, 7, 5)), ((6, 15.5, 5), (6, 40, 6)), ((6, 7, 10.5), (7, 7, 90))):
            words = (*words_of(eye, at, fov=30), "--rotate", "3,5,7", "--size", "9x9")
            self.assertEqual(self.picture("--mode", "minip", *words).min(), self.volume.max(), words)

    def test_threads_change_no_byte(self):
        written = set()
        for threads in ("1", "2", "7"):
            self.picture("--mode", "composite", "--shade", "phong", *words_of((6.3, 7.1, 4.4), (3, 2, 9)), "--size", "90x80", "--threads", threads)
            written.add((self.folder / "p.nrrd").read_bytes())
        self.assertEqual(len(written), 1)

    def test_one_voxel_a_plane_and_numbers_that_are_none(self):
        for shape, eye in (((1, 1, 1), (0, 0, 0)), ((1, 9, 9), (4, 4, 0)), ((9, 1, 9), (4, 0, 4))):
            files.write_nrrd(self.folder / "t.nrrd", np.full(shape, 3, "<f4"))
            # To the side, half a voxel at least lies ahead.
            got = self.picture("--mode", "xray", *words_of(eye, np.array(eye) + (0, 0, 1)), "--size", "9x9", source=self.folder / "t.nrrd",
                               spacing=(1, 1, 1))
            self.assertAlmostEqual(got[4, 4, 0], 3 * shape[0] / 2, 5, shape)
        holes = self.volume.copy()
        holes[4:6, 6:9, 5:8] = np.nan
        files.write_nrrd(self.folder / "n.nrrd", holes)
        for mode in ("mip", "composite"):
            got = self.picture("--mode", mode, *words_of((6, 7, 5), (3, 2, 9)), "--size", "15x12", source=self.folder / "n.nrrd")
            self.assertTrue(np.isfinite(got).all(), mode)

    # --- requests that make no sense

    def test_what_makes_no_sense_says_what_to_do(self):
        view = ("--perspective", "50")
        for words, says in ((("--eye", "6,7,5"), ("--eye", "--perspective FOV")),
                            ((*view, "--look-at", "6,7,5"), ("--look-at", "--eye X,Y,Z")),
                            (("--look-at", "6,7,5"), ("--look-at", "--eye X,Y,Z")),
                            ((*view, "--eye", "6,7"), ("--eye", "X,Y,Z")), ((*view, "--eye", "6,7,5,4"), ("--eye", "X,Y,Z")),
                            ((*view, "--eye", "6,nan,5"), ("--eye", "finite")), ((*view, "--eye", "6,inf,5"), ("--eye", "finite")),
                            ((*view, "--eye", "6,,5"), ("--eye", "''")), ((*view, "--eye", "1e7,7,5"), ("--eye", "centre")),
                            ((*view, "--eye", "6,7,5", "--look-at", "6,7"), ("--look-at", "X,Y,Z")),
                            ((*view, "--eye", "6,7,5", "--look-at", "6,nan,5"), ("--look-at", "finite")),
                            ((*view, "--eye", "6,7,5", "--look-at", "6,7,5"), ("--look-at", "another sample")),
                            ((*view, "--eye", "6,7,5", "--matrix", "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0.01,1"), ("--matrix", "0,0,0,1")),
                            (("--perspective", "180", "--eye", "6,7,5"), ("--perspective", "between 0 and 180"))):
            message = self.refused(*words)
            for part in says:
                self.assertIn(part, message, words)
        done = self.run_it("warp", self.source, "-o", "null:", "--eye", "6,7,5", code=2)
        self.assertIn("--eye", done.stderr.decode())

    def test_a_failure_is_told_in_json(self):
        done = self.run_it("render", self.source, "-o", "null:", "--eye", "6,7,5", "--json", "-", code=2)
        error = json.loads(done.stdout)["error"]
        self.assertEqual(error["code"], 2)
        self.assertIn("--perspective FOV", error["message"])


if __name__ == "__main__":
    unittest.main()
