"""Clips, turntables, paths and animations of `render`, against brute force in numpy. Needs EDGEWISE."""

import json
import struct
import unittest
import zlib

import files
import numpy as np
from running import Running, native, png
from scipy import ndimage

GENERATOR = np.random.default_rng(34)
CAST = ("--via", "project.ray_cast/filter=foh/step=1", "--max-error", "9")


def smooth(shape):
    return ndimage.gaussian_filter(GENERATOR.random(shape), 1).astype("<f4")


def chunks(data):
    at = 8
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0] == zlib.crc32(kind + body)
        yield kind, body
        at += 12 + length


def rays(volume, turn, size, step, kept, slab=None):
    """Values and cell lengths along the rays of a turned view of a volume of unit spacing, [y, x, cell]; NaN is outside.

    Rays are cut finely instead of exactly, so that nothing here knows how the program does it."""
    nz, ny, nx = volume.shape
    middle = np.array([nx - 1, ny - 1, nz - 1]) / 2
    reach = np.linalg.norm([nx, ny, nz]) / 2 + 1
    t = np.arange(-reach, reach, step) + step / 2
    y, x, depth = np.meshgrid((np.arange(size[1]) - (size[1] - 1) / 2), (np.arange(size[0]) - (size[0] - 1) / 2), t, indexing="ij")
    at = np.stack([x, y, depth], -1) @ turn + middle  # the inverse of a turn is its transpose
    inside = np.all((at >= -0.5) & (at <= np.array([nx, ny, nz]) - 0.5), -1) & kept(at)
    if slab is not None:
        inside &= np.abs(depth) <= slab / 2
    values = ndimage.map_coordinates(volume.astype(float), at[..., ::-1].reshape(-1, 3).T, order=1, mode="nearest").reshape(x.shape)
    return np.where(inside, values, np.nan)


def turn_of(a, b, c):
    """Rz(c) Ry(b) Rx(a) [degree]."""
    (ca, cb, cc), (sa, sb, sc) = np.cos(np.radians([a, b, c])), np.sin(np.radians([a, b, c]))
    return (np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]]) @ np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]]) @
            np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]]))


class Views(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.volume = smooth((13, 16, 19))
        cls.source = cls.folder / "v.nrrd"
        files.write_nrrd(cls.source, cls.volume)

    def picture(self, *words, source=None, out="p.nrrd"):
        self.run_it("render", source or self.source, "-o", self.folder / out, "--quiet", *native(words))
        return files.read(self.folder / out)[0, ..., 0].astype(float)

    def refused(self, *words, code=2, source=None):
        return self.run_it("render", source or self.source, "-o", "null:", *words, code=code).stderr.decode()

    # --- boxes along an axis: every mode is a sum over some of the samples

    BOX = (3, 2, 4, 14, 11, 9)

    def test_a_box_is_a_masked_column(self):
        x0, y0, z0, x1, y1, z1 = self.BOX
        part = self.volume[z0:z1 + 1]
        inside = np.zeros(self.volume.shape[1:], bool)
        inside[y0:y1 + 1, x0:x1 + 1] = True
        clip = ("--clip", ",".join(map(str, self.BOX)), *CAST)
        for mode, values, miss in (("mip", part.max(0), self.volume.min()), ("minip", part.min(0), self.volume.max()),
                                   ("xray", part.sum(0), 0), ("mean", part.mean(0), None), ("stddev", part.std(0), 0)):
            got = self.picture("--mode", mode, *clip)
            np.testing.assert_allclose(got[inside], values[inside], rtol=1e-5, atol=1e-5, err_msg=mode)
            if miss is not None:
                np.testing.assert_allclose(got[~inside], miss, rtol=1e-6, err_msg=mode)

    def test_a_composite_of_a_box_is_a_masked_product(self):
        x0, y0, z0, x1, y1, z1 = self.BOX
        low, high = float(self.volume.min()), float(self.volume.max())
        got = self.picture("--mode", "composite", "--clip", ",".join(map(str, self.BOX)), "--window", f"{low},{high}", *CAST)
        left, light = np.ones(self.volume.shape[1:]), np.zeros(self.volume.shape[1:])
        for plane in self.volume[z0:z1 + 1]:
            grey = (plane - low) / (high - low)
            light += left * 0.05 * grey * grey
            left *= 1 - 0.05 * grey
        inside = np.zeros(light.shape, bool)
        inside[y0:y1 + 1, x0:x1 + 1] = True
        np.testing.assert_allclose(got, np.where(inside, light, 0), atol=2e-4)

    def test_planes_and_a_box_of_one_set_are_the_same_bytes(self):
        x0, y0, z0, x1, y1, z1 = self.BOX
        planes = [(1, 0, 0, 0.5 - x0), (-2, 0, 0, 2 * x1 + 1), (0, 1, 0, 0.5 - y0), (0, -1, 0, y1 + 0.5), (0, 0, 0.5, 0.25 - z0 / 2),
                  (0, 0, -1, z1 + 0.5)]
        words = [word for plane in planes for word in ("--clip-plane", ",".join(map(str, plane)))]
        for turn in (("--rotate", "20,30,40"), ("--perspective", "30", "--rotate", "0,50,0")):
            for mode in ("mip", "composite"):
                box = self.picture("--mode", mode, *turn, "--clip", ",".join(map(str, self.BOX)), *CAST)
                self.assertTrue(np.array_equal(box, self.picture("--mode", mode, *turn, *words, *CAST)))

    def test_a_clip_of_everything_is_none(self):
        for turn in ((), ("--rotate", "20,30,40", "--turntable", "1")):
            self.picture(*turn, out="all.nrrd")
            for words in (("--clip", "0,0,0,18,15,12"), ("--clip-plane", "1,2,3,100"), ("--slab", "1000")):
                self.picture(*turn, *words, out="same.nrrd")
                self.assertEqual((self.folder / "same.nrrd").read_bytes(), (self.folder / "all.nrrd").read_bytes(), words)

    # --- oblique planes and slabs

    def expect_like_brute_force(self, turn, clip, kept, slab=None):
        size, step = (24, 22), 1 / 16
        words = ("--rotate", ",".join(map(str, turn)), "--size", "x".join(map(str, size)), "--spacing", "1", *clip,
                 "--via", "project.ray_cast/filter=foh/step=0.25", "--max-error", "9")
        values = rays(self.volume, turn_of(*turn), size, step, kept, slab)
        seen = np.isfinite(values)
        length = step * seen.sum(-1)
        # Cuts of the brute force are off by a sixteenth at either end: by as much of the largest value.
        got = self.picture("--mode", "xray", *words)
        np.testing.assert_allclose(got, step * np.nansum(values, -1), atol=2 * step * self.volume.max())
        self.assertTrue((got[length > 2 * step] > 0).all())
        many = length > 2
        self.assertGreater(many.sum(), 50)
        got = self.picture("--mode", "mean", *words)
        np.testing.assert_allclose(got[many], (step * np.nansum(values, -1)[many] / length[many]), atol=0.03)
        got = self.picture("--mode", "mip", *words)
        np.testing.assert_allclose(got[many], np.nanmax(values[many], -1), atol=0.03)
        self.assertTrue((got[length == 0] <= self.volume.max()).all())

    def test_an_oblique_plane(self):
        self.expect_like_brute_force((20, 30, 10), ("--clip-plane", "1,-2,0.5,9"), lambda p: p @ [1, -2, 0.5] + 9 >= 0)

    def test_several_planes_and_a_box_add_up(self):
        self.expect_like_brute_force((0, 0, 0), ("--clip", "2,0,0,16,15,12", "--clip-plane", "1,1,1,-8", "--clip-plane", "-1,0.3,1,10"),
                                     lambda p: (p @ [1, 1, 1] >= 8) & (p @ [-1, 0.3, 1] + 10 >= 0) & (p[..., 0] >= 1.5) & (p[..., 0] <= 16.5))

    def test_a_slab_of_a_turned_view(self):
        self.expect_like_brute_force((35, -20, 15), ("--slab", "5"), lambda p: np.ones(p.shape[:-1], bool), slab=5)

    def test_a_slab_is_in_the_files_unit(self):
        constant = self.folder / "c.nrrd"
        files.write_nrrd(constant, np.full((20, 20, 20), 2, "<f4"))
        for spacing in ("1", "0.5", "3"):
            thickness = 4.2 * float(spacing)
            got = self.picture("--mode", "xray", "--rotate", "10,20,0", "--input-spacing", spacing, "--slab", str(thickness), source=constant)
            self.assertAlmostEqual(got[got.shape[0] // 2, got.shape[1] // 2] / (2 * thickness), 1, 5)

    def test_translation_chooses_the_slab(self):
        one = self.picture("--mode", "mean", "--slab", "1", "--translate", "0,0,-3", *CAST)
        np.testing.assert_allclose(one, self.volume[9], rtol=1e-5)

    def test_every_path_that_is_left_shows_the_same(self):
        words = ("--mode", "mean", "--rotate", "20,30,10", "--clip-plane", "1,-2,0.5,3", "--max-error", "9")
        casts = [self.picture(*words, "--via", f"project.ray_cast/filter=bspline3/step={step}") for step in (0.25, 0.5)]
        inside = np.abs(casts[0]) > 0
        # The cut of a ray is where it is at any step.
        self.assertLess(np.sqrt(np.mean((casts[0] - casts[1])[inside] ** 2)), 0.02 * (self.volume.max() - self.volume.min()))
        for edge in ("shear_warp", "combine", "spectrum.slice"):
            self.assertIn("clip", self.refused(*words, "--via", edge, code=3), edge)

    def test_a_cropped_clip_is_the_clip(self):
        big = self.folder / "big.nrrd"
        files.write_nrrd(big, smooth((30, 60, 90)))
        words = ("--mode", "mean", "--rotate", "20,30,10", "--clip", "20,20,8,40,30,20", "--clip-plane", "1,1,1,-50", "--max-error", "9")
        cast = ("--via", "project.ray_cast/filter=bspline3/step=0.5")
        whole = self.picture(*words, *cast, "--without", "store.crop", source=big)
        crop = self.picture(*words, "--via", "store.crop", *cast, source=big)
        # What the prefilter sees of the new faces, 12 samples away.
        np.testing.assert_allclose(crop, whole, atol=2e-6)

    def test_the_error_is_that_of_the_clipped_reference(self):
        done = self.run_it("render", self.source, "-o", "null:", "--mode", "mean", "--rotate", "20,30,10", "--clip-plane", "1,-2,0.5,3",
                           "--slab", "7", "--max-error", "0.02", "--verify=all", "--json", "-")
        report = json.loads(done.stdout)
        self.assertLess(report["measured"]["error"]["nrmse"], 0.02)
        self.assertTrue(report["measured"]["kept"])

    def test_threads_change_no_byte(self):
        written = []
        for threads in (1, 2, 7):
            self.picture("--mode", "composite", "--rotate", "20,30,10", "--clip", "1,1,1,17,14,11", "--clip-plane", "1,-2,0.5,3", "--slab", "9",
                         "--size", "150x150", "--threads", str(threads), out=f"t{threads}.nrrd")
            written.append((self.folder / f"t{threads}.nrrd").read_bytes())
        self.assertEqual(len(set(written)), 1)

    def test_clips_that_make_no_sense(self):
        for words, says in ((("--clip", "1,2,3"), "X0,Y0,Z0,X1,Y1,Z1"), (("--clip", "9,0,0,1,5,5"), "X begins behind"),
                            (("--clip", "50,0,0,60,5,5"), "keeps nothing"), (("--clip", "0,0,nan,1,1,1"), "--clip"),
                            (("--clip-plane", "0,0,0,1"), "no direction"), (("--clip-plane", "1,1,1,-500"), "keeps nothing"),
                            (("--clip-plane", "1,1,1"), "A,B,C,D"), (("--clip-plane", "1,inf,1,0"), "--clip-plane"), (("--slab", "0"), "--slab"),
                            (("--slab", "-3"), "--slab"), (("--slab", "x"), "--slab"), (("--slab", "1", "--translate", "0,0,90"), "keeps nothing")):
            self.assertIn(says, self.refused(*words), words)

    # --- several views

    def test_an_arc_is_a_part_of_the_turn(self):
        words = ("--mode", "mean", "--size", "30x30", *CAST)
        for name, turn in (("arc", "3,90"), ("all", "12")):
            self.run_it("render", self.source, "-o", self.folder / f"{name}_%d.nrrd", "--turntable", turn, "--quiet", *words)
        self.assertFalse((self.folder / "arc_3.nrrd").exists())
        for view in range(3):
            arc, whole = (files.read(self.folder / f"{name}_{view}.nrrd") for name in ("arc", "all"))
            self.assertLess(np.abs(arc - whole).max(), 0.02)  # depths differ, and so do places of samples

    def test_a_path_of_turns_is_a_turntable(self):
        path = self.folder / "path.txt"
        turns = [turn_of(0, 360 * i / 5, 0) for i in range(5)]
        lines = ["# five views"]
        for i, turn in enumerate(turns):
            full = np.eye(4)
            full[:3, :3] = turn
            if i % 2:
                lines += ["", *(" ".join(map(repr, map(float, row))) for row in full), ""]
            else:
                lines.append(", ".join(map(repr, map(float, turn.ravel()))) + "  # in a line")
        path.write_text("\n".join(lines))
        words = ("--mode", "mip", "--rotate", "15,0,0", "--quiet", *CAST)
        self.run_it("render", self.source, "-o", self.folder / "p_%d.nrrd", "--path", path, *words)
        self.run_it("render", self.source, "-o", self.folder / "t_%d.nrrd", "--turntable", "5", *words)
        for view in range(5):
            a, b = (files.read(self.folder / f"{name}_{view}.nrrd") for name in "pt")
            self.assertLess(np.abs(a - b).max(), 1e-4)
        self.assertFalse((self.folder / "p_5.nrrd").exists())
        self.refused("--path", path, "--turntable", "3")
        self.refused("--path", path, "--path", path)
        self.refused("--path", self.folder / "none.txt")
        self.refused("--turntable", "3,0")

    # --- animations

    def gif(self, path):
        """Delays, and frames as bytes: structure alone; tests/io/animation_test.cpp decodes them."""
        data = path.read_bytes()
        self.assertEqual(data[:6], b"GIF89a")
        at = 13 + (3 << (data[10] & 7) + 1 if data[10] & 0x80 else 0)
        delays, frames = [], []

        def blocks(at):
            body = b""
            while data[at]:
                body += data[at + 1:at + 1 + data[at]]
                at += 1 + data[at]
            return body, at + 1
        while data[at] != 0x3B:
            if data[at] == 0x21:
                label = data[at + 1]
                body, at = blocks(at + 2)
                if label == 0xF9:
                    delays.append(struct.unpack("<H", body[1:3])[0])
            else:
                self.assertEqual(data[at], 0x2C)
                at += 10 + (3 << (data[at + 9] & 7) + 1 if data[at + 9] & 0x80 else 0)
                body, at = blocks(at + 1)
                frames.append(body)
        self.assertEqual(at + 1, len(data))
        return delays, frames

    def test_a_turntable_becomes_an_animation(self):
        words = ("--turntable", "6", "--mode", "mip", "--quiet", *CAST)
        self.run_it("render", self.source, "-o", self.folder / "f_%d.png", *words)
        report = json.loads(self.run_it("render", self.source, "-o", self.folder / "a.apng", *words, "--json", "-").stdout)
        self.assertEqual(report["outputs"], [str(self.folder / "a.apng")])
        pictures, head, times = [], b"", []
        for kind, body in chunks((self.folder / "a.apng").read_bytes()):
            if kind == b"IHDR":
                head = body
            elif kind == b"fcTL":
                pictures.append(b"")
                times.append(struct.unpack(">HH", body[20:24]))
            elif kind == b"IDAT":
                pictures[-1] += body
            elif kind == b"fdAT":
                pictures[-1] += body[4:]
        self.assertEqual(times, [(1, 15)] * 6)
        for i, picture in enumerate(pictures):
            chunk = [struct.pack(">I", len(body)) + kind + body + b"\0\0\0\0" for kind, body in ((b"IHDR", head), (b"IDAT", picture))]
            alone = png(b"\x89PNG\r\n\x1a\n" + b"".join(chunk))
            np.testing.assert_array_equal(alone, png((self.folder / f"f_{i}.png").read_bytes()))
        self.run_it("render", self.source, "-o", self.folder / "a.gif", *words, "--fps", "20")
        delays, frames = self.gif(self.folder / "a.gif")
        self.assertEqual((delays, len(frames)), ([5] * 6, 6))
        self.run_it("render", self.source, "-o", self.folder / "c.gif", "--turntable", "4", "--mode", "composite", "--quiet")
        self.assertEqual(len(self.gif(self.folder / "c.gif")[1]), 4)
        self.assertEqual([p.name for p in self.folder.iterdir() if ".part" in p.name], [])

    def test_one_picture_is_no_animation(self):
        for name in ("one.gif", "one.apng"):
            self.run_it("render", self.source, "-o", self.folder / name, "--quiet")
        self.assertEqual(self.gif(self.folder / "one.gif")[0], [])
        kinds = [kind for kind, _ in chunks((self.folder / "one.apng").read_bytes())]
        self.assertNotIn(b"acTL", kinds)
        self.run_it("render", self.source, "-o", self.folder / "n_%d.gif", "--turntable", "2", "--quiet")
        self.assertTrue((self.folder / "n_1.gif").exists())
        self.run_it("info", self.folder / "a.apng" if (self.folder / "a.apng").exists() else self.folder / "one.apng")

    def test_animations_are_the_same_bytes_for_any_number_of_threads(self):
        for name in ("t.gif", "t.apng"):
            written = []
            for threads in ("1", "2", "7"):
                self.run_it("render", self.source, "-o", self.folder / name, "--turntable", "5", "--mode", "composite", "--threads", threads,
                            "--window", "0,1", "--quiet")
                written.append((self.folder / name).read_bytes())
            self.assertEqual(len(set(written)), 1)

    def test_what_is_no_animation_needs_numbers(self):
        for name in ("a.png", "a.jpg", "a.nrrd"):
            done = self.run_it("render", self.source, "-o", self.folder / name, "--turntable", "3", code=2)
            self.assertIn(b"%03d", done.stderr)
        for words in (("-o", self.folder / "f_%d.gif", "--turntable", "3"), ("-o", self.folder / "one.gif"), ("-o", self.folder / "one.png")):
            self.assertIn(b"--fps", self.run_it("render", self.source, *words, "--fps", "5", code=2).stderr)
        for fps in ("0", "-1", "nan", "1000"):
            self.run_it("render", self.source, "-o", self.folder / "a.gif", "--turntable", "3", "--fps", fps, code=2)
        self.run_it("render", self.source, "-o", "-", "--turntable", "3", code=2)


if __name__ == "__main__":
    unittest.main()
