"""Colour maps, legends, scale bars and montages: pixels against tables and sizes that are written here, not read from the command. Needs EDGEWISE."""

import json
import pathlib
import struct
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import files  # noqa: E402
from running import Running  # noqa: E402

# matplotlib's, at 0, 1/4, 1/2, 3/4 and 1 (its rows 0, 64, 128, 191, 255), as documented.
ENDS = {"viridis": ((68, 1, 84), (253, 231, 37)), "magma": ((0, 0, 4), (252, 253, 191)), "inferno": ((0, 0, 4), (252, 255, 164)),
        "plasma": ((13, 8, 135), (240, 249, 33)), "grey": ((0, 0, 0), (255, 255, 255)), "jet": ((0, 0, 128), (128, 0, 0)),
        "hot": ((11, 0, 0), (255, 255, 255))}


def hot(v):
    return np.stack([np.interp(v, (0, 0.365079), (0.0416, 1)), np.interp(v, (0.365079, 0.746032), (0, 1)), np.interp(v, (0.746032, 1), (0, 1))], -1)


def jet(v):
    return np.stack([np.interp(v, (0.35, 0.66, 0.89, 1), (0, 1, 1, 0.5)), np.interp(v, (0.125, 0.375, 0.64, 0.91), (0, 1, 1, 0)),
                     np.interp(v, (0, 0.11, 0.34, 0.65), (0.5, 1, 1, 0))], -1)


class Looks(Running):
    def ramp(self, name="ramp.nrrd", dtype="u1", step=1):
        """A volume of one slice whose x-th column is x."""
        path = self.folder / name
        files.write_nrrd(path, np.tile((np.arange(256) * step).astype(dtype), (1, 8, 1)))
        return path

    def picture(self, *words, ending="png"):
        out = self.folder / f"p.{ending}"
        self.run_it(*words, "-o", out)
        return files.read_png(out.read_bytes())[0]

    def test_maps(self):
        path = self.ramp()
        stack = self.folder / "stack.nrrd"
        files.write_nrrd(stack, np.tile(np.arange(256, dtype="<f4") * 3 - 100, (4, 8, 1)))
        for name, (first, last) in ENDS.items():
            for words in (("warp", path), ("render", stack, "--mode", "mip", "--view", "z", "--spacing", "1"), ("render", stack, "--mode", "mean", "--view", "z", "--spacing", "1")):
                found = self.picture(*words, "--colormap", name)
                self.assertEqual(found.shape, (8, 256, 3))
                np.testing.assert_allclose(found[0, 0], first, atol=1)
                np.testing.assert_allclose(found[0, -1], last, atol=1)
        share = np.arange(256) / 255
        for name, formula in (("hot", hot), ("jet", jet)):
            # Between rows of 256 the formula bends at most by a step of its steepest slope, 4.4 levels at a corner.
            np.testing.assert_allclose(self.picture("warp", path, "--colormap", name)[0], 255 * formula(share), atol=2.5)

    def test_windows_and_files(self):
        path = self.ramp()
        rows = [(255, 0, 0), (0, 255, 0), (0, 0, 255)]
        expected = np.stack([np.interp(np.arange(256), (0, 127.5, 255), part) for part in zip(*rows)], -1)
        kinds = {"a.csv": "r,g,b\n" + "\n".join(",".join(map(str, row)) for row in rows), "a.json": json.dumps(rows),
                 "a.lut": "\n".join(f"{i} {r} {g} {b}" for i, (r, g, b) in enumerate(rows)), "b.csv": "1;0;0\n0;1;0\n0;0;1\n",
                 "c.json": json.dumps({"points": [{"value": v, "opacity": 1, "color": [c / 255 for c in row]} for v, row in zip((5, 6, 7), rows)]})}
        for name, text in kinds.items():
            (self.folder / name).write_text(text)
            np.testing.assert_allclose(self.picture("warp", path, "--colormap", self.folder / name)[3], expected, atol=1.01, err_msg=name)
        planes = self.folder / "imagej.lut"
        planes.write_bytes(bytes(range(256)) + bytes(range(255, -1, -1)) + bytes(256))
        found = self.picture("warp", path, "--colormap", planes)[0]
        np.testing.assert_allclose(found, np.stack([np.arange(256), 255 - np.arange(256), 0 * np.arange(256)], -1), atol=1)
        low = self.picture("warp", path, "--colormap", "viridis", "--window", "100,200")[0]
        np.testing.assert_array_equal(low[:101], np.tile(ENDS["viridis"][0], (101, 1)))
        np.testing.assert_array_equal(low[200:], np.tile(ENDS["viridis"][1], (56, 1)))

    def test_legends_stand_beside(self):
        path = self.ramp()
        stack = self.folder / "tall.nrrd"
        files.write_nrrd(stack, np.tile((np.arange(160) * 7).astype("<i2"), (3, 200, 1)))
        plain = self.picture("render", stack, "--view", "z", "--spacing", "1", "--colormap", "magma")
        both = self.picture("render", stack, "--view", "z", "--spacing", "1", "--colormap", "magma", "--legend")
        self.assertEqual(both.shape[0], 200)
        self.assertGreater(both.shape[1], 160 + 20)
        np.testing.assert_array_equal(both[:, :160], plain)
        strip = both[:, 160:]
        # The colours go from the last at the top to the first at the bottom.
        column = max(range(strip.shape[1]), key=lambda x: len(np.unique(strip[:, x], axis=0)))
        lit = np.flatnonzero(strip[:, column].any(axis=1))
        np.testing.assert_allclose(strip[lit[0], column], ENDS["magma"][1], atol=2)
        self.assertLess(strip[lit[-1], column].sum(), 12)
        self.assertTrue((strip == 255).all(axis=-1).any())  # letters
        grey = self.picture("render", stack, "--view", "z", "--spacing", "1", "--legend")
        np.testing.assert_array_equal(grey[0, :160, 0], grey[0, :160, 2])

    def test_scale_bars_have_their_length(self):
        for size, spacing, unit, length, pixels in (((200, 100), 0.5, "mm", 20, 40), ((400, 300), 0.001, "mm", 0.1, 100), ((90, 120), 2, "mm", 20, 10)):
            path = self.folder / "scaled.nii"
            files.write_nifti(path, np.full((1, size[1], size[0]), 100, "u1"), spacing=(spacing, spacing, spacing))
            found = self.picture("warp", path, "--scale-bar", "--window", "0,255")
            white = (found.reshape(size[1], size[0], -1)[..., 0] == 255)
            longest = max(self.runs(row) for row in white)
            self.assertEqual(longest, pixels, (size, spacing))
        for words in (("render", path), ("render", path, "--mode", "xray"), ("render", path, "--mode", "composite", "--background", "none")):
            self.picture(*words, "--view", "z", "--scale-bar")

    def test_scale_bars_are_seen_on_any_picture(self):
        path = self.folder / "flat.nii"
        for value, ink, rim in ((0, 255, 0), (100, 255, 0), (160, 0, 255), (255, 0, 255)):
            files.write_nifti(path, np.full((1, 120, 200), value, "u1"), spacing=(0.5, 0.5, 0.5))
            found = self.picture("warp", path, "--scale-bar", "--window", "0,255").reshape(120, 200, -1)[..., 0]
            row = max(range(120), key=lambda y: self.runs(found[y] == ink) if (found[y] != ink).any() else 0)
            bar = np.flatnonzero(found[row] == ink)
            bar = bar[(bar < 100)]
            self.assertEqual((bar[0], len(bar)), (8, 40), value)  # 20 mm; 8: height of the letters
            self.assertEqual((found[row, 7], found[row, 48]), (rim, rim), value)
        # Bright at the bar alone, in colours.
        volume = np.zeros((4, 100, 200), "u1")
        volume[:, 50:, :100] = 250
        files.write_nifti(path, volume, spacing=(1, 1, 1))
        found = self.picture("render", path, "--view", "z", "--spacing", "1", "--window", "0,250", "--colormap", "viridis", "--scale-bar").reshape(100, 200, -1)
        self.assertTrue(((found[:, :100] == 0).all(axis=-1)).any())  # viridis has no black

    def test_depths_are_told_in_a_unit_that_suits_them(self):
        volume = np.random.default_rng(3).integers(0, 256, (20, 80, 100)).astype("u1")
        strips = []
        for spacing, unit in ((0.5, 2), (0.0005, 2), (0.5, 3)):  # 10 mm, 10 um, 10 um
            path = self.folder / "depth.nii"
            files.write_nifti(path, volume, spacing=(spacing,) * 3)
            raw = bytearray(path.read_bytes())
            raw[123] = unit
            path.write_bytes(bytes(raw))
            strips.append(self.picture("render", path, "--view", "z", "--size", "400x320", "--depth-colour", "--legend")[:, 400:])
        micro, other = strips[1], strips[2]
        np.testing.assert_array_equal(micro, other)
        # The numbers are the same; the unit is not.
        line = 18  # of letters, from above
        wide = strips[0].shape[1]  # of "mm", which is shorter
        np.testing.assert_array_equal(strips[0][line:], micro[line:, :wide])
        self.assertTrue((strips[0][:line] != micro[:line, :wide]).any())

    @staticmethod
    def runs(row):
        best = run = 0
        for lit in row:
            run = run + 1 if lit else 0
            best = max(best, run)
        return best

    def test_montages(self):
        path = self.folder / "m.nrrd"
        volume = np.random.default_rng(1).integers(0, 256, (24, 10, 14)).astype("u1")
        volume[0, 0, :2] = 0, 255
        files.write_nrrd(path, volume)
        found = self.picture("warp", path, "--montage", "4x3")
        self.assertEqual(found.shape, (3 * 12 - 2, 4 * 16 - 2, 1))
        for i in range(12):
            y, x = 12 * (i // 4), 16 * (i % 4)
            np.testing.assert_array_equal(found[y:y + 10, x:x + 14, 0], volume[2 * i + 1])
        # Fewer slices than places: all of them, in order.
        found = self.picture("warp", path, "--clip", "0,0,3,13,9,5", "--montage", "2x2", "--window", "0,255")
        for i in range(3):
            np.testing.assert_array_equal(found[12 * (i // 2):][:10, 16 * (i % 2):][:, :14, 0], volume[3 + i])
        frames = self.folder / "f_%d.png"
        self.run_it("render", path, "-o", frames, "--turntable", "6", "--size", "20")
        sheet = self.picture("render", path, "--turntable", "6", "--size", "20", "--montage", "3x2")
        for i in range(6):
            one = files.read_png(pathlib.Path(str(frames) % i).read_bytes())[0]
            h, w = one.shape[:2]
            np.testing.assert_array_equal(sheet[(h + 2) * (i // 3):][:h, (w + 2) * (i % 3):][:, :w], one)
        self.assertIn(b"do not fit", self.run_it("render", path, "-o", self.folder / "x.png", "--turntable", "7", "--montage", "3x2", code=2).stderr)

    def test_depth(self):
        rng = np.random.default_rng(6)
        hue = np.array([(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)])
        for dtype, extent in (("u1", (7, 9, 12)), ("<f4", (16, 5, 6)), ("<i2", (3, 20, 8))):
            volume = rng.permutation(int(np.prod(extent))).reshape(extent)
            volume = (volume % 250 if dtype == "u1" else volume).astype(dtype)
            path = self.folder / f"depth{dtype[-1]}.nrrd"
            files.write_nrrd(path, volume)
            for view, along in (("z", 0), ("y", 1), ("x", 2)):
                high = float(volume.max())
                found = self.picture("render", path, "--view", view, "--spacing", "1", "--depth-colour", "--window", f"0,{high}", "--via", "project.ray_cast/filter=foh/step=1")
                looked = np.flip(volume, along) if view == "y" else volume  # y is seen against
                share = (looked.argmax(along) + 0.5) / extent[along]
                light = looked.max(along) / high
                colour = np.stack([np.interp(share, np.linspace(0, 1, 5), part) for part in hue.T], -1)
                np.testing.assert_allclose(found, 255 * colour * light[..., None], atol=1.01, err_msg=f"{dtype} {view}")
        wide = self.picture("render", path, "--view", "z", "--spacing", "0.1", "--depth-colour", "--legend")
        self.assertGreater(wide.shape[1], 80)
        self.assertIn(b"mip", self.run_it("render", path, "-o", self.folder / "o.png", "--mode", "xray", "--depth-colour", code=2).stderr)

    def test_three_planes(self):
        for dtype, extent, place in (("u1", (9, 11, 13), (3, 7, 2)), ("<i2", (20, 6, 8), (0, 5, 19)), ("<f4", (4, 30, 5), (4, 0, 0))):
            volume = np.random.default_rng(3).integers(0, 256, extent).astype(dtype)
            path = self.folder / f"planes{dtype[-1]}.nrrd"
            files.write_nrrd(path, volume)
            x, y, z = place
            found = self.picture("render", path, "--mpr", f"{x},{y},{z}", "--window", "0,255", "--size", "native")[..., 0]
            nz, ny, nx = extent
            self.assertEqual(found.shape, (nz + 2 + ny, nx + 2 + ny))
            np.testing.assert_array_equal(found[:nz, :nx], volume[:, y, :])
            np.testing.assert_array_equal(found[:nz, nx + 2:], volume[:, :, x])
            np.testing.assert_array_equal(found[nz + 2:, :nx], volume[z])
            coloured = self.picture("render", path, "--mpr", f"{x},{y},{z}", "--window", "0,255", "--colormap", "viridis", "--scale-bar", "--legend")
            self.assertEqual(coloured.shape[2], 3)
        # Thick slices become as tall as they are.
        nifti = self.folder / "thick.nii"
        files.write_nifti(nifti, volume, spacing=(1, 1, 3))
        self.assertEqual(self.picture("render", nifti, "--mpr", "1,1,1", "--size", "native").shape[0], 3 * 4 + 2 + 30)
        self.assertEqual(self.picture("render", nifti, "--mpr", "1,1,1", "--size", "60").shape[0], 2 * (12 + 30) + 2)
        done = self.run_it("render", path, "-o", self.folder / "o.png", "--mpr", "1,1,1", "--json", "-")
        self.assertEqual(len(json.loads(done.stdout)["planes"]), 3)
        for words in (["--mpr", "5,0,0"], ["--mpr", "1,1"], ["--mpr", "1,1,0.5"], ["--mpr", "1,1,1", "--rotate", "3,0,0"], ["--mpr", "1,1,1", "--view", "x"]):
            self.assertIn(b"--", self.run_it("render", path, "-o", self.folder / "o.png", *words, code=2).stderr)

    def test_refusals(self):
        path = self.ramp("r.nrrd")
        (self.folder / "bad.csv").write_text("1,2\n3,4\n")
        (self.folder / "short.csv").write_text("1,0,0\n")
        (self.folder / "many.csv").write_text("1,0,300\n1,1,1\n")
        for words, said in ((["--colormap", "viridiss"], b"viridis"), (["--colormap", self.folder / "bad.csv"], b"line 1"), (["--colormap", self.folder / "short.csv"], b"at least 2"),
                            (["--colormap", self.folder / "many.csv"], b"255"), (["--colormap", "jet", "--bits", "16"], b"8 bits"), (["--montage", "4"], b"4x3"), (["--montage", "0x3"], b"--montage")):
            self.assertIn(said, self.run_it("warp", path, "-o", self.folder / "o.png", *words, code=2).stderr, words)
        self.assertIn(b"colours of its own", self.run_it("render", path, "-o", self.folder / "o.png", "--mode", "composite", "--colormap", "jet", code=2).stderr)
        self.run_it("warp", path, "-o", self.folder / "o.exr", "--colormap", "jet", code=2)
        for words in (["--montage", "3x3"], ["--colormap", "jet", "--legend", "--scale-bar"]):
            for job in ("warp", "render"):
                self.run_it(job, "phantom:sphere:16", "-o", "null:", *words)
        self.assertIn(b"%03d", self.run_it("warp", "phantom:sphere:16", "-o", self.folder / "o.png", code=2).stderr)


if __name__ == "__main__":
    unittest.main()
