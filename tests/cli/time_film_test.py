"""`render --time all`: a film over time, a frame for each time point. Needs EDGEWISE."""

import json
import pathlib
import struct
import sys
import unittest

import files
import numpy as np
from gif_rate_test import gif_delays
from running import Running, native


def series(dtype="<i2", shape=(5, 9, 11, 13), scale=100):
    """A ball that moves and brightens, [t, z, y, x]: each time point has another range."""
    z, y, x = np.mgrid[:shape[1], :shape[2], :shape[3]].astype(float)
    a = np.zeros(shape)
    for t in range(shape[0]):
        r = np.sqrt((x - 3 - t) ** 2 + (y - 5) ** 2 + (z - 4) ** 2)
        a[t] = np.clip(4 - r, 0, 1) * (t + 1) * scale - (20 * t if np.issubdtype(np.dtype(dtype), np.signedinteger) else 0)
    return np.round(a).astype(dtype)


def write_nifti_series(path, a, spacing=(1, 1, 1)):
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 4, *a.shape[::-1], 1, 1, 1)
    struct.pack_into("<2h", head, 70, {"i2": 4, "u1": 2, "f4": 16}[a.dtype.str[1:]], 8 * a.dtype.itemsize)
    struct.pack_into("<5f", head, 76, 1, *spacing, 2)
    struct.pack_into("<2f", head, 108, 352, 1)
    struct.pack_into("<b", head, 123, 2 + 8)
    head[344:348] = b"n+1\0"
    path.write_bytes(bytes(head) + a.tobytes())


def write_hyperstack(path, a):
    """ImageJ's, [t, z, y, x] of u16: slices run faster than frames."""
    t, z, y, x = a.shape
    text = f"ImageJ=1.54f\nimages={t * z}\nslices={z}\nframes={t}\nhyperstack=true\nmode=grayscale\nspacing=1.0\n\0".encode()
    out, at = bytearray(b"II*\0\0\0\0\0"), 8
    out += text + b"\0" * (len(text) % 2)
    pages = []
    for page in a.reshape(-1, y, x):
        pages.append(len(out))
        out += page.astype("<u2").tobytes()
    link = 4
    for number, begin in enumerate(pages):
        struct.pack_into("<I", out, link, len(out))
        tags = [(256, 3, 1, x), (257, 3, 1, y), (258, 3, 1, 16), (259, 3, 1, 1), (262, 3, 1, 1), (273, 4, 1, begin), (277, 3, 1, 1), (278, 3, 1, y),
                (279, 4, 1, 2 * x * y)]
        if number == 0:
            tags.append((270, 2, len(text), at))
        tags.sort()
        out += struct.pack("<H", len(tags)) + b"".join(struct.pack("<HHII", *tag) for tag in tags)
        link = len(out)
        out += b"\0\0\0\0"
    path.write_bytes(bytes(out))


def write_zarr_series(folder, a):
    """OME-Zarr 0.4, a chunk a time point."""
    (folder / "0").mkdir(parents=True)
    axes = [{"name": "t", "type": "time"}] + [{"name": n, "type": "space", "unit": "micrometer"} for n in "zyx"]
    scale = {"type": "scale", "scale": [1, 1, 1, 1]}
    (folder / ".zgroup").write_text('{"zarr_format": 2}')
    (folder / ".zattrs").write_text(json.dumps(
        {"multiscales": [{"version": "0.4", "axes": axes, "datasets": [{"path": "0", "coordinateTransformations": [scale]}]}]}))
    (folder / "0" / ".zarray").write_text(json.dumps(
        {"zarr_format": 2, "shape": a.shape, "chunks": [1, *a.shape[1:]], "dtype": a.dtype.str, "compressor": None, "fill_value": 0, "order": "C",
         "filters": None, "dimension_separator": "."}))
    for t in range(a.shape[0]):
        (folder / "0" / f"{t}.0.0.0").write_bytes(a[t].tobytes())


class TimeFilm(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.values = series()
        cls.nifti = cls.folder / "series.nii"
        write_nifti_series(cls.nifti, cls.values)

    def report(self, source, out, *words, code=0):
        done = self.run_it("render", source, "--time", "all", "-o", self.folder / out, *native(words), "--json", "-", code=code)
        return json.loads(done.stdout)

    def test_frames_are_the_mips_of_the_time_points(self):
        unsigned = series("<u2")
        tiff, zarr = self.folder / "series.tif", self.folder / "series.zarr"
        write_hyperstack(tiff, unsigned)
        write_zarr_series(zarr, unsigned)
        for source, values in ((self.nifti, self.values), (tiff, unsigned), (zarr, unsigned)):
            with self.subTest(source=source.name):
                report = self.report(source, "f_%d.nrrd", "--view", "z")
                self.assertEqual((report["request"]["frames"], report["request"]["time"], len(report["outputs"])), (5, "all", 5))
                for t in range(5):
                    got = files.read(self.folder / f"f_{t}.nrrd")[0]
                    np.testing.assert_array_equal(got.reshape(11, 13), values[t].max(axis=0))

    def test_a_dynamic_series_of_dicom(self):
        cases = str(pathlib.Path(__file__).resolve().parent.parent / "cases")
        if cases not in sys.path:
            sys.path.append(cases)
        import make_cases
        case = make_cases.stopped_scan(self.folder)
        report = self.report(case["path"], "d_%d.nrrd", "--view", "z")
        self.assertEqual(report["request"]["frames"], 2)
        for t in range(2):
            got = files.read(self.folder / f"d_{t}.nrrd")[0]
            expected = np.asarray(case["values"][t]).max(axis=0)
            np.testing.assert_array_equal(got.reshape(expected.shape), expected)

    def test_one_window_over_all_of_them(self):
        report = self.report(self.nifti, "g_%d.png", "--view", "z")
        mips = self.values.max(axis=1).astype(float)
        low, high = mips.min(), mips.max()
        for t in range(5):
            got = files.read(self.folder / f"g_{t}.png")[0].astype(float).reshape(11, 13)
            self.assertLessEqual(np.abs(got - (mips[t] - low) / (high - low) * 255).max(), .5 + 1e-3)
        self.assertEqual(report["warnings"], [])

    def test_animations(self):
        for ending in ("gif", "apng"):
            report = self.report(self.nifti, f"t.{ending}", "--fps", "10")
            self.assertEqual(report["outputs"], [str(self.folder / f"t.{ending}")])
        self.assertEqual(gif_delays((self.folder / "t.gif").read_bytes()), [10] * 5)
        report = self.report(self.nifti, "fast.gif", "--fps", "100")
        self.assertTrue(any("frames are left out" in w for w in report["warnings"]))
        self.assertEqual(self.report(self.nifti, "t.mp4x", code=2)["plan"], None)

    def test_rays_that_miss_and_zeros_are_those_of_all(self):
        # The least value of all time points is -80, of the first 0.
        self.report(self.nifti, "m_%d.nrrd", "--rotate", "0,0,45")
        self.report(self.nifti, "x_%d.nrrd", "--mode", "xray", "--view", "z")
        for t in range(5):
            self.assertEqual(files.read(self.folder / f"m_{t}.nrrd")[0].flat[0], -80)
            got = files.read(self.folder / f"x_{t}.nrrd")[0].reshape(11, 13)
            np.testing.assert_allclose(got, (self.values[t].astype(float) + 80).sum(axis=0), rtol=1e-5, atol=1e-2)

    def test_composites_have_one_ramp_for_all(self):
        self.report(self.nifti, "c_%d.nrrd", "--mode", "composite", "--view", "z")
        ramp = self.folder / "ramp.json"
        low, high = int(self.values.min()), int(self.values.max())
        ramp.write_text(json.dumps({"points": [{"value": low, "opacity": 0, "color": [0, 0, 0]}, {"value": high, "opacity": .05, "color": [1, 1, 1]}],
                                    "unit": 1}))
        for t in range(5):
            self.run_it("render", self.nifti, "--time", t, "-o", self.folder / "one.nrrd", "--mode", "composite", "--view", "z", "--size", "native", "--transfer", ramp)
            np.testing.assert_allclose(files.read(self.folder / f"c_{t}.nrrd")[0], files.read(self.folder / "one.nrrd")[0], atol=1e-6)

    def test_windows_that_are_given(self):
        for window in ("0,400", "1%,99%"):
            self.report(self.nifti, "w_%d.png", "--view", "z", "--window", window)
            mips = self.values.max(axis=1).astype(float)
            low, high = (0, 400) if window == "0,400" else np.percentile(mips, (1, 99))
            for t in range(5):
                got = files.read(self.folder / f"w_{t}.png")[0].astype(float).reshape(11, 13)
                expected = np.clip((mips[t] - low) / (high - low), 0, 1) * 255
                self.assertLessEqual(np.abs(got - expected).max(), 1.5 if "%" in window else .501)

    def test_seconds_are_those_of_all_and_one_plan_serves_them(self):
        report = self.report(self.nifti, "s_%d.nrrd", "--repeat", "2", "--verify=all")
        self.assertEqual(len(report["measured"]["seconds"]), 2)
        self.assertIsNotNone(report["measured"]["error"])
        one = json.loads(self.run_it("plan", "render", self.nifti, "--time", "0", "--json", "-").stdout)
        planned = json.loads(self.run_it("plan", "render", self.nifti, "--time", "all", "--json", "-").stdout)
        self.assertEqual([s["transition"] for s in planned["plan"]["steps"]], [s["transition"] for s in one["plan"]["steps"]])
        self.assertAlmostEqual(planned["plan"]["predicted"]["seconds"] / one["plan"]["predicted"]["seconds"], 5, delta=1e-6)
        self.assertEqual(planned["request"]["frames"], 5)
        said = self.run_it("render", self.nifti, "--time", "all", "-o", "null:", "--explain").stdout.decode()
        self.assertIn("5 time points", said)

    def test_threads_change_no_byte(self):
        written = []
        for threads in ("1", "2", "7"):
            self.report(self.nifti, "n.gif", "--rotate", "10,20,30", "--size", "60", "--threads", threads)
            written.append((self.folder / "n.gif").read_bytes())
        self.assertEqual(written[0], written[1])
        self.assertEqual(written[0], written[2])

    def test_one_time_point_is_one_picture(self):
        path = self.folder / "single.nii"
        files.write_nifti(path, self.values[2])
        report = self.report(path, "single.png")
        self.run_it("render", path, "-o", self.folder / "plain.png", "--size", "native")
        self.assertEqual((self.folder / "single.png").read_bytes(), (self.folder / "plain.png").read_bytes())
        self.assertEqual(report["request"]["frames"], 1)

    def test_memory_holds_one_time_point(self):
        # 24 time points of 4 MB: all of them would take 96 MB.
        path = self.folder / "long.nii"
        write_nifti_series(path, np.zeros((24, 128, 128, 128), "<i2") + np.arange(24, dtype="<i2")[:, None, None, None])
        report = self.report(path, "long_%02d.png", "--size", "32x32", "--mode", "xray", "--max-memory", "90MiB", "--window", "0,1000")
        self.assertLess(report["measured"]["bytes"], 90 * 2 ** 20)
        self.assertEqual(len(report["outputs"]), 24)

    def test_what_makes_no_sense_says_so(self):
        for words, text in ((("--turntable", "4"), "5 time points, and 4 views"), (("--channel", "0,1"), "--time N"), (("--progressive",), "--time N"),
                            (("--trace", self.folder / "t.json"), "--time N")):
            report = self.report(self.nifti, "bad_%d.png", *words, code=2)
            self.assertIn(text, report["error"]["message"])
        self.assertIn("5 frames need a number", self.report(self.nifti, "bad.png", code=2)["error"]["message"])
        self.assertIn("no time points", self.run_it("render", "phantom:sphere:8", "--time", "all", "-o", "null:", code=2).stderr.decode())
        self.assertIn("--time", self.run_it("render", self.nifti, "--time", "every", "-o", "null:", code=2).stderr.decode())

    def test_budgets_count_for_all(self):
        report = self.report(self.nifti, "bad_%d.png", "--max-time", "0.001us", "--max-error", "linear", code=3)
        self.assertIsNone(report["plan"])
        report = self.report(self.nifti, "good_%d.png", "--max-time", "10s")
        self.assertEqual((report["request"]["budget"]["seconds"], report["measured"]["kept"]), (10, True))


if __name__ == "__main__":
    unittest.main()
