"""`edgewise filter --time all`: a series in, a series out. Needs EDGEWISE."""

import json
import struct
import unittest

import numpy as np
from running import Running
from scipy import ndimage

NIFTI = {2: "u1", 4: "<i2", 512: "<u2", 8: "<i4", 16: "<f4"}


def write_nifti(path, a):
    """[t, z, y, x]."""
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 4, *a.shape[::-1], 1, 1, 1)
    code = next(k for k, v in NIFTI.items() if np.dtype(v) == a.dtype)
    struct.pack_into("<2h", head, 70, code, 8 * a.dtype.itemsize)
    struct.pack_into("<5f", head, 76, 1, 2, 2, 3, 1.5)
    struct.pack_into("<3f", head, 108, 352, 1, 0)
    struct.pack_into("<b", head, 123, 2)
    head[344:348] = b"n+1\0"
    path.write_bytes(bytes(head) + a.tobytes())


def read_nifti(path):
    data = path.read_bytes()
    dims = struct.unpack_from("<8h", data, 40)
    code, = struct.unpack_from("<h", data, 70)
    return np.frombuffer(data, NIFTI[code], offset=352).reshape(dims[4:0:-1]), struct.unpack_from("<4f", data, 76)


def write_nrrd(path, a, types={"u1": "uint8", "<i2": "int16", "<f4": "float"}):
    name = next(v for k, v in types.items() if np.dtype(k) == a.dtype)
    head = (f"NRRD0004\ntype: {name}\ndimension: 4\nsizes: {' '.join(map(str, a.shape[::-1]))}\nspacings: 0.5 0.5 2 nan\n"
            "kinds: domain domain domain time\nendian: little\nencoding: raw\n\n")
    path.write_bytes(head.encode() + a.tobytes())


def read_nrrd(path, types={"uint8": "u1", "int16": "<i2", "float": "<f4"}):
    head, _, body = path.read_bytes().partition(b"\n\n")
    fields = dict(line.split(": ", 1) for line in head.decode().split("\n") if ": " in line)
    return np.frombuffer(body, types[fields["type"]]).reshape([int(n) for n in fields["sizes"].split()][::-1]), fields


class Series(Running):
    def setUp(self):
        super().setUp()
        self.random = np.random.default_rng(9)

    def test_every_time_point_by_itself(self):
        for shape, dtype in (((3, 5, 6, 7), "<i2"), ((2, 1, 9, 8), "u1"), ((4, 4, 5, 6), "<f4")):
            a = self.random.integers(0, 200, shape).astype(dtype)
            write_nifti(self.folder / "s.nii", a)
            self.run_it("filter", self.folder / "s.nii", "-o", self.folder / "o.nii", "--op", "dilate", "--kernel", "box:1", "--time", "all")
            got, pixdim = read_nifti(self.folder / "o.nii")
            self.assertEqual(got.dtype, a.dtype)
            np.testing.assert_array_equal(got, np.stack([ndimage.grey_dilation(v, size=3, mode="mirror") for v in a]))
            self.assertEqual(pixdim[1:], (2, 2, 3))
            # What was written is read again as a series, and so is NRRD.
            self.run_it("filter", self.folder / "o.nii", "-o", self.folder / "o.nrrd", "--op", "median", "--kernel", "box:1", "--time", "all", "--quiet")
            want = np.stack([ndimage.median_filter(v, size=3, mode="mirror") for v in got])
            np.testing.assert_array_equal(read_nrrd(self.folder / "o.nrrd")[0], want)
            self.run_it("filter", self.folder / "o.nrrd", "-o", self.folder / "p.nii.gz", "--op", "erode", "--kernel", "box:1", "--time", "all", "--quiet")

    def test_of_nrrd(self):
        a = self.random.integers(0, 250, (3, 4, 5, 6)).astype("u1")
        write_nrrd(self.folder / "s.nrrd", a)
        done = self.run_it("filter", self.folder / "s.nrrd", "-o", self.folder / "o.nrrd", "--op", "sobel", "--kernel", "x", "--time", "all")
        got, fields = read_nrrd(self.folder / "o.nrrd")
        self.assertEqual(fields["kinds"].split()[-1], "time")
        np.testing.assert_array_equal(got, np.stack([ndimage.sobel(v.astype("i4"), axis=2, mode="mirror") for v in a]))
        self.assertEqual(done.stderr.decode().count("negative"), 1)

    def test_the_report_is_that_of_a_filter(self):
        a = self.random.integers(0, 250, (3, 4, 5, 6)).astype("u1")
        write_nrrd(self.folder / "s.nrrd", a)
        words = ("filter", self.folder / "s.nrrd", "-o", self.folder / "o.nrrd", "--kernel", "gauss:1", "--op", "convolve", "--time", "all", "--json", "-")
        said = json.loads(self.run_it(*words).stdout)
        self.assertEqual((said["schema"], said["times"], said["outputs"]), (1, 3, [str(self.folder / "o.nrrd")]))
        self.assertEqual(said["request"]["job"], "filter")
        self.assertTrue(said["plan"]["steps"][0]["transition"].startswith("filter."))
        self.assertGreater(said["measured"]["seconds"][0], 0)
        planned = json.loads(self.run_it("plan", *words[:2], *words[4:]).stdout)
        self.assertEqual(planned["plan"]["steps"][0]["transition"], said["plan"]["steps"][0]["transition"])
        failed = json.loads(self.run_it(*words, "--max-error", "400dB", code=3).stdout)
        self.assertEqual(failed["error"]["code"], 3)
        self.assertTrue(failed["error"]["nearest"])

    def test_what_is_refused(self):
        a = self.random.integers(0, 250, (3, 4, 5, 6)).astype("u1")
        write_nrrd(self.folder / "s.nrrd", a)
        words = ("--op", "median", "--kernel", "box:1")
        done = self.run_it("filter", self.folder / "s.nrrd", "-o", self.folder / "o.tif", *words, "--time", "all", code=2)
        self.assertIn(".nii", done.stderr.decode())
        done = self.run_it("filter", self.folder / "s.nrrd", "-o", self.folder / "none.nrrd", *words, code=2)
        self.assertIn("time", done.stderr.decode())
        self.assertFalse((self.folder / "none.nrrd").exists())
        done = self.run_it("warp", self.folder / "s.nrrd", "-o", self.folder / "none.nrrd", "--time", "all", code=2)
        self.assertIn("filter", done.stderr.decode())


if __name__ == "__main__":
    unittest.main()
