"""What a warp writes: labels and large integers bit for bit, every type in every format, alpha, and rounding as part of the error. Needs EDGEWISE."""

import itertools
import json
import unittest

import files
import numpy as np
from running import Running
from scipy import ndimage

GENERATOR = np.random.default_rng(20)


def blobs(shape, values, dtype):
    """A label map of boxes on a background of 0."""
    a = np.zeros(shape, dtype)
    for value in values:
        low = [GENERATOR.integers(0, n - 2) for n in shape]
        size = [GENERATOR.integers(2, max(3, n // 2)) for n in shape]
        a[tuple(slice(i, i + n) for i, n in zip(low, size))] = value
    return a


def turned_nearest(a, degrees):
    """The nearest sample at the turned place, about the centre; 0 outside. z alone turns."""
    z, y, x = np.indices(a.shape)
    cx, cy = (a.shape[2] - 1) / 2, (a.shape[1] - 1) / 2
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    px = c * (x - cx) + s * (y - cy) + cx  # the inverse of clockwise on the screen (y down)
    py = -s * (x - cx) + c * (y - cy) + cy
    ix, iy = np.floor(px + 0.5).astype(int), np.floor(py + 0.5).astype(int)
    inside = (px >= -0.5) & (px <= a.shape[2] - 0.5) & (py >= -0.5) & (py <= a.shape[1] - 0.5)
    near = a[z, np.clip(iy, 0, a.shape[1] - 1), np.clip(ix, 0, a.shape[2] - 1)]
    # Where a place is half way between two samples either may be nearest.
    tie = (np.abs(px - np.floor(px) - 0.5) < 1e-6) | (np.abs(py - np.floor(py) - 0.5) < 1e-6)
    return np.where(inside, near, 0), tie


class Values(Running):
    def warp(self, source, out, *words, code=0):
        done = self.run_it("warp", source, "-o", out, "--quiet", *words, code=code)
        return done if code else files.read(out)

    def report(self, source, out, *words, code=0):
        return json.loads(self.run_it("warp", source, "-o", out, "--quiet", "--json", "-", *words, code=code).stdout)

    # --- labels and integers beyond f32

    LARGE = {"<u4": [576073732, 614454277, 16777217, 312782599, 4294967295], "<i4": [-2147483648, 2147483647, -16777217, 614454277],
             "<f8": [2.0**53 - 1, 614454277, 0.1, 1e300], "<u2": [65535, 1, 32768], "<i2": [-32768, 32767, -1], "u1": [255, 1], "i1": [-128, 127]}

    def test_exact_moves_change_no_bit(self):
        for dtype, values in self.LARGE.items():
            a = blobs((4, 5, 6), values, dtype)
            source, out = self.folder / "a.nrrd", self.folder / "out.nrrd"
            files.write_nrrd(source, a)
            for words, want in (((), a), (("--rotate", "0,0,180"), a[:, ::-1, ::-1]),
                                (("--rotate", "0,0,90", "--size", "fit"), np.rot90(a, -1, (1, 2))),
                                (("--scale", "1,1,-1"), a[::-1]),
                                (("--translate", "2,0,0"), np.concatenate([np.zeros_like(a[:, :, :2]), a[:, :, :-2]], 2))):
                got = self.warp(source, out, *words)[..., 0]
                self.assertEqual(got.dtype, np.dtype(dtype))
                np.testing.assert_array_equal(got, want, f"{dtype} {words}")

    def test_labels_stay_themselves_when_they_turn(self):
        for dtype, values in self.LARGE.items():
            a = blobs((6, 14, 17), values, dtype)
            want, tie = turned_nearest(a, 27)
            source, out = self.folder / "l.nrrd", self.folder / "out.nrrd"
            files.write_nrrd(source, a)
            got = self.warp(source, out, "--labels", "--rotate", "0,0,27")[..., 0]
            self.assertEqual(got.dtype, np.dtype(dtype))
            self.assertLessEqual(set(np.unique(got)), set(np.unique(a)) | {0})
            np.testing.assert_array_equal(got[~tie], want[~tie].astype(dtype))
            report = self.report(source, out, "--labels", "--rotate", "0,0,27", "--verify=all")
            self.assertEqual(report["measured"]["error"]["nrmse"], 0)

    def test_a_file_that_says_labels_needs_no_option(self):
        a = blobs((6, 14, 17), self.LARGE["<u4"], "<u4")
        source, out = self.folder / "intent.nii", self.folder / "out.nii"
        files.write_nifti(source, a, intent=1002)
        for words in ((), ("--rotate", "0,0,27"), ("--rotate", "10,20,30", "--spacing", "0.7")):
            got = self.warp(source, out, *words)
            self.assertLessEqual(set(np.unique(got)), set(np.unique(a)) | {0}, words)
            self.assertEqual(out.read_bytes()[68:70], (1002).to_bytes(2, "little"))
        self.warp(source, self.folder / "view.png", "--rotate", "0,0,27", "--size", "17x14x1")

    def test_labels_with_a_slope_keep_their_stored_numbers(self):
        a = blobs((6, 14, 17), range(-5, 5), "<i2")
        source, out = self.folder / "slope.nii", self.folder / "out.nii"
        files.write_nifti(source, a, intent=1002, slope=0.3, inter=-1.7)
        report = self.report(source, out, "--rotate", "0,0,27", "--outside", "-1.7", "--max-error", "0", "--verify=all")
        self.assertEqual(report["measured"]["error"]["nrmse"], 0)
        stored = np.frombuffer(out.read_bytes(), "<i2", offset=352)
        self.assertLessEqual(set(stored), set(range(-5, 5)))

    def test_outside_joins_the_labels(self):
        a = blobs((3, 9, 9), self.LARGE["<u4"], "<u4")
        source, out = self.folder / "o.nrrd", self.folder / "out.nrrd"
        files.write_nrrd(source, a)
        got = self.warp(source, out, "--labels", "--outside", "77", "--rotate", "0,0,45")
        self.assertEqual(got[0, 0, 0, 0], 77)
        done = self.warp(source, out, "--labels", "--outside", "-1", "--rotate", "0,0,45", code=2)
        self.assertIn(b"--outside", done.stderr)
        self.warp(source, out, "--labels", "--reference", "linear", code=2)

    def test_integers_that_f32_rounds_are_counted(self):
        """From 1e9 to 1e5 more: f32 has steps of 64 there, whose rounding is 64 / sqrt(12) of 1e5, 1.8e-4."""
        a = (10**9 + 100000 * GENERATOR.random((6, 12, 12))).astype("<i4")
        source, out = self.folder / "far.nrrd", self.folder / "out.nrrd"
        files.write_nrrd(source, a)
        words = ["--rotate", "0,0,27", "--reference", "linear", "--via", "warp.backward/filter=foh"]
        done = self.run_it("warp", source, "-o", out, *words, "--max-error", "1e-5", code=3)
        self.assertIn(b"i32", done.stderr)
        report = self.report(source, out, *words, "--max-error", "10", "--verify=all")
        self.assertGreater(report["measured"]["error"]["nrmse"], 1e-4)
        self.assertGreater(report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"])
        # Where f32 holds the integers it costs nothing.
        files.write_nrrd(source, a - 10**9)
        self.report(source, out, "--labels", "--rotate", "0,0,27", "--max-error", "0")

    def test_a_hint_where_labels_are_interpolated(self):
        out = self.folder / "out.nrrd"
        ball = (np.indices((16, 16, 16)) - 7.5)**2
        smooth = np.exp(-ball.sum(0) / 40)

        def warns(a, *words):
            source = self.folder / "hint.nrrd"
            files.write_nrrd(source, a)
            report = self.report(source, out, "--max-error", "1", "--via", "warp.backward/filter=foh", *words)
            return any("--labels" in text for text in report["warnings"])
        self.assertTrue(warns(blobs((16, 16, 16), range(1, 27), "u1"), "--rotate", "0,0,27"))
        self.assertTrue(warns(blobs((16, 16, 16), [614454277, 3, 12], "<u4"), "--rotate", "0,0,27"))
        self.assertFalse(warns(blobs((16, 16, 16), range(1, 27), "u1")), "nothing is interpolated")
        self.assertFalse(warns(blobs((16, 16, 16), range(1, 27), "u1").astype("<f4"), "--rotate", "0,0,27"))
        self.assertFalse(warns((20 * smooth).astype("u1"), "--rotate", "0,0,27"), "a dim picture")
        self.assertFalse(warns((1000 * smooth + 50 * GENERATOR.random(smooth.shape)).astype("<i2"), "--rotate", "0,0,27"))

    # --- every type in every format

    def test_every_type_in_every_format(self):
        """Read back by numpy; what cannot be written is exit 2 and names a format that can."""
        kinds = ["u1", "i1", "<u2", "<i2", "<u4", "<i4", "<f2", "<f4", "<f8"]
        # What holds the values: PNG and JPEG hold pictures, which are views of other types. OpenEXR's library takes a second to start:
        # each type is written by it once, each number of channels too, and one volume, which it refuses.
        written = 0
        by_exr = {("u1", True, 1), ("i1", True, 3), ("<u2", True, 2), ("<i2", True, 1), ("<u4", True, 3), ("<i4", True, 1), ("<f2", True, 1),
                  ("<f2", True, 3), ("<f4", True, 4), ("<f8", True, 3), ("u1", False, 1)}
        for kind, image, channels in itertools.product(kinds, (True, False), (1, 2, 3, 4)):
            if channels in (2, 4) and kind not in ("u1", "<u2", "<f4"):
                continue  # alpha is alpha in every type
            if not image and channels in (2, 4):
                continue
            a = GENERATOR.integers(0, 100, (1 if image else 3, 5, 6, channels)).astype(kind)
            if kind == "<f2":
                if not image:
                    continue
                source = self.folder / "a.exr"
                files.write_exr(source, a[0])
            else:
                source = self.folder / "a.nrrd"
                files.write_nrrd(source, a, image)
            for ending in (".nii", ".nrrd", ".mha", ".tif", ".exr", ".png", ".jpg"):
                if ending == ".exr" and (kind, image, channels) not in by_exr:
                    continue
                if kind == "<f2" and channels == 1 and ending not in (".exr", ".nrrd"):
                    continue  # reading it takes that second, and colours go everywhere
                label = f"{kind} {'image' if image else 'volume'} {channels} {ending}"
                out = self.folder / ("out" + ending)
                out.unlink(missing_ok=True)
                done = self.run_any("warp", source, "-o", out, "--quiet")
                self.assertIn(done.returncode, (0, 2), label)
                if done.returncode == 2:
                    self.assertRegex(done.stderr.decode(), r"\.nrrd.* can", label)
                    self.assertFalse(out.exists())
                    continue
                written += 1
                if ending == ".jpg":
                    continue
                got = files.read(out)
                self.assertEqual(got.shape[:3], a.shape[:3], label)
                if ending == ".png" and kind not in ("u1", "<u2"):
                    self.assertEqual(got.dtype, np.dtype("u1"), label)  # a view
                    continue
                held = {".tif": kinds, ".exr": ["<f2", "<f4"], ".png": ["u1", "<u2"]}.get(ending, [k for k in kinds if k != "<f2"])
                holds = kind if kind in held else "<f4"
                self.assertEqual(got.dtype.newbyteorder("<"), np.dtype(holds), label)
                np.testing.assert_array_equal(got, a, label)
        self.assertGreater(written, 150)

    def run_any(self, *words):
        import subprocess

        from running import COMMAND
        return subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=100, env=self.env)

    def test_half_floats_are_warped(self):
        a = (GENERATOR.random((20, 24, 3)) * 4).astype("<f2")
        source, out = self.folder / "half.exr", self.folder / "out.exr"
        files.write_exr(source, a)
        np.testing.assert_array_equal(self.warp(source, out)[0], a)
        got = self.warp(source, out, "--rotate", "90", "--size", "fit")
        np.testing.assert_array_equal(got[0], np.rot90(a, -1))
        self.assertEqual(self.warp(source, out, "--rotate", "20").dtype, np.dtype("<f2"))
        # A step of f16 is 2^-10 of the value: more than 1e-6 of the range.
        self.warp(source, out, "--rotate", "20", "--max-error", "1e-6", code=3)

    # --- alpha

    def test_colour_under_alpha_is_kept_where_samples_only_move(self):
        for kind in ("u1", "<u2"):
            for channels in (2, 4):
                a = GENERATOR.integers(0, np.iinfo(kind).max, (7, 9, channels), endpoint=True).astype(kind)
                a[::2, :, -1] = 0
                source, out = self.folder / "alpha.png", self.folder / "out.png"
                files.write_png(source, a)
                for words, want in (((), a), (("--rotate", "180"), a[::-1, ::-1]), (("--rotate", "90", "--size", "fit"), np.rot90(a, -1)),
                                    (("--scale", "-1,1"), a[:, ::-1]),
                                    (("--translate", "3,0"), np.concatenate([np.zeros_like(a[:, :3]), a[:, :-3]], 1))):
                    np.testing.assert_array_equal(self.warp(source, out, *words)[0], want, f"{kind} {channels} {words}")

    def test_colour_is_multiplied_where_samples_mix(self):
        """Left half opaque red, right half clear green: no green bleeds into what is seen."""
        a = np.zeros((16, 16, 4), "u1")
        a[:, :8] = 255, 0, 0, 255
        a[:, 8:] = 0, 255, 0, 0
        source, out = self.folder / "edge.png", self.folder / "out.png"
        files.write_png(source, a)
        got = self.warp(source, out, "--translate", "0.5,0", "--via", "warp.backward/filter=foh", "--max-error", "1")[0]
        self.assertTrue((got[:, 1:, 1] == 0).all())
        self.assertTrue((got[:, 8, 3] == 128).all() and (got[:, 8, 0] == 255).all())
        # Light in EXR is multiplied by alpha.
        light = self.warp(source, self.folder / "out.exr")[0]
        np.testing.assert_allclose(light, a * (a[..., 3:] / 255) * [1, 1, 1, 0] + [0, 0, 0, 1] * (a[..., 3:] / 255), rtol=1e-6)

    # --- rounding

    def dim(self, levels, dtype="u1"):
        """Smooth, over so many levels."""
        a = ndimage.gaussian_filter(GENERATOR.random((24, 24, 24)), 3)
        a = (a - a.min()) / (a.max() - a.min()) * levels
        path = self.folder / f"dim{levels}.nrrd"
        files.write_nrrd(path, np.rint(a).astype(dtype))
        return path, np.rint(a)

    def test_what_is_promised_is_the_file(self):
        source, a = self.dim(20)
        out = self.folder / "out.nrrd"
        out.unlink(missing_ok=True)
        words = ["--rotate", "0,0,30", "--via", "warp.backward/filter=bspline3", "--verify=all"]
        exact = self.report(source, self.folder / "exact.nrrd", *words, "--max-error", "0.001", "--bits", "32")
        self.assertLess(exact["measured"]["error"]["nrmse"], 1e-4)
        done = self.run_it("warp", source, "-o", out, *words, "--max-error", "0.005", code=3)
        self.assertIn(b"rounding to u8", done.stderr)
        self.assertFalse(out.exists())
        report = self.report(source, out, *words, "--max-error", "0.05")
        want = files.read(self.folder / "exact.nrrd").astype(float)
        z, y, x = np.indices(a.shape) - np.array([11.5] * 3)[:, None, None, None]
        c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
        inside = (np.abs(c * x + s * y) <= 12) & (np.abs(c * y - s * x) <= 12)
        difference = (files.read(out).astype(float) - want)[inside, 0]
        true = np.sqrt(np.mean(difference**2)) / report["measured"]["error"]["range"]
        self.assertGreater(true, 0.01)
        self.assertAlmostEqual(report["measured"]["error"]["nrmse"] / true, 1, delta=0.01)
        self.assertGreater(report["plan"]["predicted"]["error"], 0.98 * true)
        self.assertLess(report["plan"]["predicted"]["error"], 1.5 * true)

    def test_clipping_counts(self):
        """Between 0 and 255 the spline overshoots, and u8 cuts that off."""
        a = np.where(np.indices((16, 16, 16)).sum(0) % 4 < 2, 0, 255).astype("u1")
        source, out = self.folder / "steps.nrrd", self.folder / "out.nrrd"
        files.write_nrrd(source, a)
        words = ["--translate", "0.5,0,0", "--via", "warp.backward/filter=bspline3", "--verify=all", "--max-error", "1"]
        error = self.report(source, out, *words)
        bare = self.report(source, self.folder / "out32.nrrd", *words, "--bits", "32")
        self.assertLess(bare["measured"]["error"]["nrmse"], 1e-5)
        free = files.read(self.folder / "out32.nrrd").astype(float)
        cut = np.clip(np.rint(free), 0, 255)
        inside = np.s_[:, :, 0:16]
        true = np.sqrt(np.mean((cut - free)[inside]**2)) / error["measured"]["error"]["range"]
        self.assertGreater(true, 0.01)
        self.assertAlmostEqual(error["measured"]["error"]["nrmse"] / true, 1, delta=0.02)
        self.assertGreater(error["plan"]["predicted"]["error"], 0.98 * true)

    def test_copies_round_nothing(self):
        source, a = self.dim(5)
        out = self.folder / "out.nrrd"
        for words in ((), ("--rotate", "0,0,90"), ("--translate", "3,0,0"), ("--rotate", "0,0,30", "--reference", "nearest")):
            report = self.report(source, out, *words, "--max-error", "0", "--verify=all")
            self.assertEqual(report["plan"]["predicted"]["error"], 0, words)
            self.assertLess(report["measured"]["error"]["nrmse"], 1e-12, words)  # the reference's own rounding, f64
        for via in ("warp.backward/filter=foh", "warp.backward/filter=bspline3"):
            report = self.report(source, out, "--translate", "3,0,0", "--via", via, "--max-error", "1e-5", "--verify=all")
            self.assertLess(report["measured"]["error"]["nrmse"], 1e-5)
        np.testing.assert_array_equal(files.read(out)[:, :, 3:, 0], a[:, :, :-3])


if __name__ == "__main__":
    unittest.main()
