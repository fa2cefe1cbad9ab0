"""How light is shown: composites, surfaces and binary pictures are colours from 0 to 1, not stretched to their range. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import DATA, Running

CAST = ("--via", "project.ray_cast/filter=foh/step=1", "--max-error", "9")


def shown(light, bits=8):
    """What pictures hold of light: rounded to nearest, halves to even."""
    full = 2**bits - 1
    return np.rint(np.clip(np.asarray(light, float) * full, 0, full)).astype(int)


class ShownLight(Running):
    def volume(self, a, name="v.nrrd"):
        files.write_nrrd(self.folder / name, np.asarray(a))
        return self.folder / name

    def transfer(self, *points):
        file = self.folder / "t.json"
        file.write_text(json.dumps({"points": [{"value": v, "opacity": a, "color": list(c)} for v, a, c in points], "unit": 1}))
        return file

    def box(self, kind="<f4", value=10):
        """8 x 6 samples of a value amid 0, throughout z."""
        a = np.zeros((7, 16, 20), kind)
        a[:, 5:11, 6:14] = value
        return self.volume(a)

    def picture(self, source, *words, name="p.png", says=None):
        quiet = () if says else ("--quiet",)
        done = self.run_it("render", source, "-o", self.folder / name, "--view", "z", *quiet, *words)
        if says is not None:
            self.assertIn(says, done.stderr.decode())
        return files.read(self.folder / name)[0]

    def test_a_background_is_as_asked(self):
        source = self.box()
        see = self.transfer((0, 0, [0, 0, 0]), (10, 0.7, [0.3, 0.5, 0.2]))
        for mode in (("composite", "--transfer", see), ("composite",), ("shaded",), ("surface", "--isovalue", "5"), ("binary", "--isovalue", "5")):
            for background in ((1, 1, 1), (0.5, 0.25, 0.9)):
                got = self.picture(source, "--mode", *mode, "--background", ",".join(map(str, background)), "--rotate", "0,20,0")
                for corner in (got[0, 0], got[0, -1], got[-1, 0], got[-1, -1]):
                    np.testing.assert_array_equal(corner, shown(background), mode)

    def test_a_plateau_has_its_colour(self):
        colour = np.array((0.31, 0.62, 0.111))
        see = self.transfer((0, 0, colour), (10, 1, colour))
        for kind in ("<f4", "u1", "<i2"):
            source = self.box(kind)
            for bits in (8, 16):
                got = self.picture(source, "--mode", "composite", "--transfer", see, "--size", "20x16", "--bits", bits, *CAST)
                np.testing.assert_array_equal(got[8, 10], shown(colour, bits))
                np.testing.assert_array_equal(got[0, 0], (0, 0, 0))
        # Half of the light of the plateau on white.
        see = self.transfer((0, 0, colour), (10, 1 - 0.5 ** (1 / 7), colour))
        got = self.picture(self.box(), "--mode", "composite", "--transfer", see, "--background", "1,1,1", "--size", "20x16", *CAST)
        self.assertLessEqual(np.abs(got[8, 10] - 255 * (0.5 * colour + 0.5)).max(), 0.51)

    def test_exposure_scales_before_it_clips(self):
        colour = np.array((0.31, 0.62, 0.111))
        words = ("--mode", "composite", "--transfer", self.transfer((0, 0, colour), (10, 1, colour)), "--size", "20x16", *CAST)
        source = self.box()
        for exposure in (0.5, 1, 2, 3.7):
            got = self.picture(source, *words, "--exposure", exposure)
            np.testing.assert_array_equal(got[8, 10], shown(np.float32(colour).astype(float) * exposure), exposure)
        # Alpha is no light: half of it stays half.
        words = ("--mode", "composite", "--transfer", self.transfer((0, 0, colour), (10, 1 - 0.5 ** (1 / 7), colour)), "--background", "none",
                 "--size", "20x16", *CAST)
        got = self.picture(source, *words, "--exposure", "2")
        self.assertLessEqual(np.abs(got[8, 10] - (*np.clip(510 * colour, 0, 255), 127.5)).max(), 1)
        a = np.zeros((9, 16, 20), "u1")
        a[2:7, 5:11, 6:14] = 10
        got = self.picture(self.volume(a), "--mode", "surface", "--isovalue", "5", "--shade", "none", "--exposure", "0.41", "--size", "20x16",
                           "--max-error", "9")
        np.testing.assert_array_equal(got[8, 10], shown([0.41] * 3))

    def test_values_stay_values(self):
        source = self.box()
        words = ("--mode", "composite", "--transfer", self.transfer((0, 0, [0, 0, 0]), (10, 0.4, [0.9, 0.5, 0.2])))
        self.picture(source, *words, name="plain.nrrd")
        for name, more in (("e.nrrd", ("--exposure", "3")), ("w.nrrd", ("--window", "0.1,0.3")), ("b.nrrd", ("--window", "0.3,0.9", "--exposure", "2"))):
            self.picture(source, *words, *more, name=name)
            self.assertEqual((self.folder / name).read_bytes(), (self.folder / "plain.nrrd").read_bytes(), more)

    def test_a_window_is_of_light(self):
        colour = np.array((0.3, 0.62, 0.2))
        source, see = self.box(), self.transfer((0, 0, colour), (10, 1, colour))
        words = ("--mode", "composite", "--transfer", see, "--size", "20x16", *CAST)
        light = np.float32(colour).astype(float)
        got = self.picture(source, *words, "--window", "0.1,0.7")
        np.testing.assert_array_equal(got[8, 10], shown((light - 0.1) / 0.6))
        got = self.picture(source, *words, "--window", "0.1,0.7", "--exposure", "1.5")
        self.assertLessEqual(np.abs(got[8, 10] - np.clip(255 * (1.5 * light - 0.1) / 0.6, 0, 255)).max(), 0.51)

    def test_films_do_not_breathe(self):
        # A bright rod behind a wall: some views see it, others do not.
        a = np.zeros((18, 18, 18), "u1")
        a[:, 4:14, 3:6] = 100
        a[:, 8:10, 12:14] = 255
        source = self.volume(a)
        see = self.transfer((0, 0, [0.2, 0.2, 0.2]), (100, 0.9, [0.25, 0.3, 0.2]), (255, 1, [1, 0.9, 0.8]))
        for words in (("composite", "--transfer", see), ("shaded", "--transfer", see), ("surface", "--isovalue", "50")):
            words = ("--mode", *words, "--background", "1,1,1", "--size", "40x40", "--turntable", "6")
            for name in ("f_%d.png", "f_%d.nrrd"):
                self.run_it("render", source, "-o", self.folder / name, "--view", "z", "--quiet", *words)
            for frame in range(6):
                got = files.read(self.folder / f"f_{frame}.png")[0]
                light = files.read(self.folder / f"f_{frame}.nrrd")[0].astype(float)
                np.testing.assert_array_equal(got, shown(light).reshape(got.shape), (words, frame))
                np.testing.assert_array_equal(got[0, 0], (255, 255, 255))

    def test_sparse_volumes_are_seen(self):
        # One line of voxels of the greatest value along the view, in ever more that are 0: the mean tells how dense it is.
        for sides, part in (((6, 3, 3), 1), ((6, 5, 5), 2), ((6, 7, 7), 4), ((6, 10, 10), 8), ((6, 21, 21), 16), ((6, 61, 61), 16)):
            a = np.zeros(sides, "u1")
            a[:, sides[1] // 2, sides[2] // 2] = 200
            share = 1 / (sides[1] * sides[2])
            self.assertEqual(part, min(16, 2 ** max(0, int(np.ceil(np.log2(1 / 16 / share))))))
            says = f"1/{part} of the smallest spacing" if part > 1 else ""
            done = self.run_it("render", self.volume(a), "-o", self.folder / "p.nrrd", "--view", "z", "--mode", "composite", "--size", f"{sides[2]}x{sides[1]}",
                               *CAST)
            self.assertEqual("smallest spacing" in done.stderr.decode(), part > 1)
            self.assertIn(says, done.stderr.decode())
            got = files.read(self.folder / "p.nrrd")[0][sides[1] // 2, sides[2] // 2]
            np.testing.assert_allclose(got.ravel(), [1 - 0.95 ** (6 * part)] * 3, atol=2e-4)
        # Between the ends of a window that is given, it is the mean between these.
        a = np.full((6, 7, 7), 1000, "<i2")
        a[:, 3, 3] = 3000
        got = self.picture(self.volume(a), "--mode", "composite", "--window", "1000,2000", "--size", "7x7", *CAST, name="p.nrrd")[3, 3]
        np.testing.assert_allclose(got.ravel(), [1 - 0.95 ** (6 * 4)] * 3, atol=2e-4)
        # A transfer function has its own opacities.
        got = self.picture(self.volume(a), "--mode", "composite", "--transfer", self.transfer((1000, 0, [1] * 3), (2000, 0.05, [1] * 3)), "--size", "7x7",
                           *CAST, name="p.nrrd")[3, 3]
        np.testing.assert_allclose(got.ravel(), [1 - 0.95**6] * 3, atol=2e-4)

    def test_a_neuron_is_bright(self):
        got = self.picture(next((DATA / "neuron").glob("*.tif*")), "--mode", "composite", "--size", "256")
        self.assertGreater(np.percentile(got, 99.9), 128)
        self.assertGreater((got > 100).mean(), 0.005)

    def test_refusals(self):
        source = self.box()
        for words, part in ((("--mode", "mip", "--exposure", "2"), "--exposure: of --mode composite"), (("--mode", "composite", "--exposure", "0"), "greater than 0"),
                            (("--mode", "composite", "--exposure", "-1"), "greater than 0"), (("--mode", "composite", "--exposure", "nan"), "--exposure"),
                            (("--mode", "drr", "--exposure", "1"), "--exposure")):
            self.assertIn(part, self.run_it("render", source, "-o", "null:", *words, code=2).stderr.decode(), words)


if __name__ == "__main__":
    unittest.main()
