"""Surfaces of labels as pictures (`render --labels --mode surface`): by rays through voxels, and by triangles. Needs EDGEWISE."""

import json
import math
import unittest

import files
import numpy as np
from running import HEADLIGHT, Running, native

CAST = ("--via", "project.label_cast")
DRAWN = ("--via", "surface.draw/light=pixel")
FLAT = ("--shade", "none")


def colour(number):
    """Of the label that is so many from the smallest: hues apart by the golden ratio, light and dark by turns."""
    hue = 6 * math.fmod(0.08 + 0.61803398874989485 * number, 1)
    light = 0.95 if number % 2 == 0 else 0.75
    away = [math.fmod(5 - 2 * c + hue, 6) for c in range(3)]
    return [light * (1 - 0.65 * min(max(min(a, 4 - a), 0), 1)) for a in away]


def grown(mask):
    """With all pixels beside it, also across corners."""
    padded = np.pad(mask, 1)
    return np.max([padded[1 + y:padded.shape[0] - 1 + y, 1 + x:padded.shape[1] - 1 + x] for y in (-1, 0, 1) for x in (-1, 0, 1)], axis=0)


def cubes(kind="u1", first=1, second=2):
    """Two cubes that touch in the plane between x = 5 and 6."""
    v = np.zeros((12, 11, 13), kind)
    v[3:8, 3:8, 1:6] = first
    v[3:8, 3:8, 6:11] = second
    return v


class LabelSurface(Running):
    def write(self, volume, name="v.nrrd"):
        path = self.folder / name
        files.write_nrrd(path, volume)
        return path

    def picture(self, volume, *words, name="p.nrrd"):
        source = volume if not isinstance(volume, np.ndarray) else self.write(volume)
        self.run_it("render", source, "-o", self.folder / name, "--labels", "--mode", "surface", "--background", "none", "--quiet", *native(words))
        return files.read(self.folder / name)[0].astype(float)

    def expect_silhouettes_alike(self, one, other, pixels=1):
        """To so many pixels around the border."""
        a, b = one[..., 3] > 0, other[..., 3] > 0
        wide_a, wide_b = a, b
        for _ in range(pixels):
            wide_a, wide_b = grown(wide_a), grown(wide_b)
        self.assertTrue((a <= wide_b).all() and (b <= wide_a).all())

    def test_each_label_has_its_colour_and_its_place(self):
        v = cubes()
        for view, axis in (("z", 0), ("x", 2)):
            first = np.argmax(v > 0, axis)
            seen = np.take_along_axis(v, np.expand_dims(first, axis), axis).squeeze(axis)
            expected = np.array([[0, 0, 0, 0], [*colour(0), 1], [*colour(1), 1]])[seen]
            got = self.picture(v, "--view", view, *FLAT, *CAST)
            np.testing.assert_allclose(got, expected, atol=1e-7)
            drawn = self.picture(v, "--view", view, *FLAT, *DRAWN)
            self.expect_silhouettes_alike(got, drawn)
            # Away from rims, which are rounded, both show the same.
            inside = ~grown(got[..., 3] == 0)
            if view == "z":
                inside[:, 5:7] = False
            self.assertGreaterEqual(inside.sum(), 6)
            np.testing.assert_allclose(drawn[inside], got[inside], atol=1e-7)

    def test_turned_uneven_and_from_an_eye(self):
        for words in (("--rotate", "20,35,10"), ("--rotate", "-40,15,100", "--perspective", "40"),
                      ("--input-spacing", "1,0.7,2.2", "--rotate", "25,-40,0"),
                      ("--input-spacing", "1,0.7,2.2", "--rotate", "25,-40,0", "--perspective", "25")):
            with self.subTest(words):
                cast = self.picture(cubes(), *words, *FLAT, *CAST, "--size", "40")
                drawn = self.picture(cubes(), *words, *FLAT, *DRAWN, "--size", "40")
                # A vertex stays in its cell of samples: half a sample along each axis from a voxel's corner, 1.9 pixels at most.
                self.expect_silhouettes_alike(cast, drawn, 2)
                both = (cast[..., 3] > 0) & (drawn[..., 3] > 0)
                self.assertGreater(both.sum(), 60)
                differ = (np.abs(cast - drawn).max(-1) > 1e-6) & both
                self.assertLess(differ.sum(), 0.15 * both.sum())  # where one cube's sheet begins
                for picture in (cast, drawn):
                    kinds = np.unique(picture[picture[..., 3] > 0].round(6), axis=0)
                    self.assertLessEqual(len(kinds), 2)

    def test_the_reference_is_the_first_voxel(self):
        source = self.write(cubes())
        for words, most in (((), 1e-6), (("--rotate", "20,35,10", "--size", "50"), 0.05),
                            (("--clip-plane", "1,0.4,0.2,-5", "--rotate", "0,60,0", "--depth-cue", "0.03"), 0.05)):
            with self.subTest(words):
                done = self.run_it("render", source, "-o", "null:", "--labels", "--mode", "surface", "--quiet", "--verify=all", "--json", "-", *words, *CAST)
                report = json.loads(done.stdout)
                self.assertLessEqual(report["measured"]["error"]["nrmse"], most)
        done = self.run_it("render", source, "-o", "null:", "--labels", "--mode", "surface", "--quiet", "--verify=all", "--json", "-", *DRAWN)
        self.assertGreater(json.loads(done.stdout)["measured"]["error"]["nrmse"], 0.01)  # smoothed, and it says so

    def test_light_is_brightest_where_the_surface_faces_it(self):
        z, y, x = np.mgrid[:30, :30, :30] - 14.5
        ball = (x * x + y * y + z * z < 11 ** 2).astype("u1")
        for path in (CAST, DRAWN):
            got = self.picture(ball, *path, *HEADLIGHT)
            self.assertEqual(got[0, 0].tolist(), [0, 0, 0, 0])
            # Half a pixel beside the middle a ball's normal leans by 0.5 sqrt(2) / 11 = 0.064. That of its mesh may lean by half as much again:
            # the highlight, 0.2 cos(2 0.096)^10, then lacks 0.2 10 0.192^2 / 2 = 0.037.
            np.testing.assert_allclose(got[14, 14, :3], [0.8 * c + 0.2 for c in colour(0)], atol=0.037)
            self.assertLess(got[14, 5, 0], 0.75 * got[14, 14, 0])
            # A ball looks the same from the left and from the right, but for how its voxels lie.
            np.testing.assert_allclose(got[..., 0], got[:, ::-1, 0], atol=1e-5 if path is CAST else 0.05)

    def test_background_alone_is_an_empty_picture(self):
        v = np.zeros((5, 6, 7), "u1")
        for path in (CAST, DRAWN, ()):
            self.assertEqual(np.abs(self.picture(v, *path)).max(), 0)
        done = self.run_it("render", self.write(v), "-o", "null:", "--labels", "--mode", "surface")
        self.assertIn("all samples are 0, so there is no surface", done.stderr.decode())

    def test_one_voxel_and_one_plane(self):
        for shape in ((1, 1, 1), (1, 6, 7), (6, 1, 7), (2, 2, 2)):
            v = np.full(shape, 5, "u1")
            for path in (CAST, DRAWN, ("--via", "surface.nets/smooth=0", *DRAWN)):
                with self.subTest((shape, path)):
                    got = self.picture(v, *path, *FLAT, "--size", "24")
                    seen = got[got[..., 3] > 0]
                    self.assertGreater(len(seen), 20)
                    np.testing.assert_allclose(seen, [[*colour(0), 1]] * len(seen), atol=1e-7)

    def test_labels_at_the_ends_of_their_types(self):
        for kind, first, second in (("<u2", 7, 65535), ("<i2", -32768, 32767), ("<i2", -5, -4), ("<f4", 3, 99999), ("<i4", -70000, 8000000),
                                    ("<u4", 2, 100000), ("i1", -128, 127)):
            for path in (CAST, DRAWN):
                with self.subTest((kind, path)):
                    got = self.picture(cubes(kind, first, second), *path, *FLAT)
                    np.testing.assert_allclose(got[5, 3], [*colour(0), 1], atol=1e-7)
                    np.testing.assert_allclose(got[5, 8], [*colour(1), 1], atol=1e-7)
                    self.assertEqual(got[0, 0, 3], 0)

    def test_what_is_not_finite_is_no_label(self):
        v = cubes("<f4")
        v[0, 5, 8] = np.nan
        v[1, 5, 8] = np.inf
        for path in (CAST, DRAWN):
            got = self.picture(v, *path, *FLAT)
            np.testing.assert_allclose(got[5, 8], [*colour(1), 1], atol=1e-7)

    def test_threads_give_the_same_bytes(self):
        source = self.write(cubes())
        for path in (CAST, DRAWN):
            pictures = set()
            for threads in (1, 2, 7):
                self.picture(source, *path, "--rotate", "20,35,10", "--size", "120", "--threads", threads)
                pictures.add((self.folder / "p.nrrd").read_bytes())
            self.assertEqual(len(pictures), 1)

    def test_a_clip_cuts_labels_open_to_flat_faces(self):
        got = self.picture(cubes(), *CAST, *HEADLIGHT, "--clip", "0,0,5,12,10,11")
        # What faces the eye has all light of the one that is there.
        np.testing.assert_allclose(got[4:7, 2:5, :3], np.broadcast_to([0.8 * c + 0.2 for c in colour(0)], (3, 3, 3)), atol=1e-6)
        np.testing.assert_allclose(got[4:7, 8:10, :3], np.broadcast_to([0.8 * c + 0.2 for c in colour(1)], (3, 2, 3)), atol=1e-6)
        done = self.run_it("render", self.write(cubes()), "-o", "null:", "--labels", "--mode", "surface", *DRAWN, "--clip", "0,0,5,12,10,11", code=3)
        self.assertIn("a clip closes the labels that it cuts", done.stderr.decode())

    def test_an_isovalue_makes_one_white_surface_of_all_from_there_up(self):
        got = self.picture(cubes(), "--isovalue", "2", *FLAT)
        self.assertEqual(got[5, 8].tolist(), [1, 1, 1, 1])
        self.assertEqual(got[5, 3, 3], 0)

    def test_many_views_share_one_mesh(self):
        source = self.write(cubes())
        self.run_it("render", source, "-o", self.folder / "t_%d.png", "--labels", "--mode", "surface", "--turntable", "3", "--quiet", *DRAWN)
        done = self.run_it("plan", "render", source, "--labels", "--mode", "surface", "--turntable", "3", "--json", "-", *DRAWN)
        self.assertEqual([step["transition"] for step in json.loads(done.stdout)["plan"]["steps"]], ["surface.nets", "surface.draw"])
        self.assertEqual(len({(self.folder / f"t_{i}.png").read_bytes() for i in range(3)}), 3)

    def test_what_makes_no_sense_is_said(self):
        def message(volume, *words):
            return self.run_it("render", self.write(volume), "-o", "null:", *words, code=2).stderr.decode()

        self.assertIn("--mode surface: at which value? Expected --isovalue V, or --labels", message(cubes(), "--mode", "surface"))
        self.assertIn("--mode binary: at which value? Expected --isovalue V", message(cubes(), "--mode", "binary", "--labels"))
        self.assertIn("--preset: of --mode composite only", message(cubes(), "--mode", "surface", "--labels", "--preset", "labels"))


if __name__ == "__main__":
    unittest.main()
