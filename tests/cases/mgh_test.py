"""FreeSurfer's .mgh and .mgz, written and read beside their description. Needs EDGEWISE."""

import gzip
import json
import pathlib
import struct
import sys
import unittest

import numpy as np

root = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(root / "io"), str(root / "cli")]
import files
import format_writers as w
from running import Running

TYPES = {"u1": 0, "i4": 1, "f4": 3, "i2": 4, "u2": 10}
TURN = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, -1]])  # columns: where x, y and z point in RAS


def header(shape, kind, spacing=(0.9, 0.8, 1.2), columns=np.eye(3), centre=(10, 20, 30), good=1, version=1, frames=1):
    """shape: slowest first."""
    return struct.pack(">7ih15f", version, *shape[::-1], frames, kind, 0, good, *spacing, *np.asarray(columns).T.ravel(), *centre).ljust(284, b"\0")


def affine(shape, spacing, columns, centre):
    """Of index (x, y, z) into LPS: the sample of index extent / 2 lies at the centre."""
    steps = np.asarray(columns) * spacing
    origin = np.asarray(centre) - steps @ (np.array(shape[::-1]) / 2)
    flip = np.diag([-1, -1, 1])
    return flip @ steps, flip @ origin


class MghTest(Running):
    def put(self, name, data):
        (self.folder / name).write_bytes(data)
        return self.folder / name

    def info(self, path):
        return json.loads(self.run_it("info", path, "--json", "-", "--quiet").stdout)

    def values(self, path, *words):
        out = self.folder / "out.nrrd"
        self.run_it("warp", path, "-o", out, "--quiet", *words)
        return files.read(out)[..., 0]

    def expect_place(self, said, steps, origin, atol=1e-5):
        np.testing.assert_allclose(said["origin"], origin, atol=atol)
        np.testing.assert_allclose(np.array(said["direction"]).T * said["spacing"], steps, atol=atol)
        self.assertEqual(said["unit"], "mm")

    def test_types_and_packing(self):
        for dtype, kind in TYPES.items():
            for shape in ((3, 4, 5), (4, 1, 7)):
                v = (w.ramp(*shape, dtype="i4") % (250 if dtype == "u1" else 1000)).astype(dtype)
                whole = header(shape, kind) + v.astype(">" + dtype).tobytes() + b"tags behind the samples"
                for name, data in (("a.mgh", whole), ("a.mgz", gzip.compress(whole)), ("a.mgh.gz", gzip.compress(whole))):
                    with self.subTest(name, dtype=dtype, shape=shape):
                        path = self.put(name, data)
                        np.testing.assert_array_equal(self.values(path), v)
                        said = self.info(path)
                        self.assertEqual((said["spacing"], said["orientation"]), ([0.9, 0.8, 1.2], "RAS"))
                        self.expect_place(said, *affine(shape, (0.9, 0.8, 1.2), np.eye(3), (10, 20, 30)))

    def test_where_it_lies(self):
        v = w.ramp(3, 4, 5, dtype=">i2")
        coronal = np.array([[-1, 0, 0], [0, 0, 1], [0, -1, 0]])
        for columns in (np.eye(3), TURN, coronal, np.diag([-1, 1, 1])):
            said = self.info(self.put("a.mgh", header(v.shape, 4, (1.5, 2, 0.5), columns, (-3, 4, 0.25)) + v.tobytes()))
            self.expect_place(said, *affine(v.shape, (1.5, 2, 0.5), columns, (-3, 4, 0.25)))
        # Nothing said: FreeSurfer's own place.
        said = self.info(self.put("b.mgh", header(v.shape, 4, good=0) + v.tobytes()))
        self.expect_place(said, *affine(v.shape, (1, 1, 1), coronal, (0, 0, 0)))
        self.assertTrue(any("coronal" in text for text in said["warnings"]), said["warnings"])

    def test_frames_are_times(self):
        v = w.ramp(2, 3, 4, 5, dtype=">f4")
        path = self.put("a.mgz", gzip.compress(header(v.shape[1:], 3, frames=2, version=(2 << 8) + 1) + v.tobytes()))
        self.assertEqual(self.info(path)["times"], 2)
        for time in range(2):
            np.testing.assert_array_equal(self.values(path, "--time", time), v[time])
        self.run_it("warp", path, "-o", self.folder / "no.nrrd", code=2)

    def test_what_is_written_is_read(self):
        for dtype in ("u1", "i4", "f4", "i2", "u2", "f8"):
            v = (w.ramp(3, 4, 5, dtype="i4") % 250).astype("<" + dtype)
            sform = np.column_stack([TURN * (1.5, 2, 0.5), (7, -8, 9)])
            source = self.put("a.nii", w.nifti(v, sform=sform))
            for name in ("a.mgh", "a.mgz"):
                out = self.folder / name
                self.run_it("warp", source, "-o", out, "--quiet")
                np.testing.assert_array_equal(self.values(out), v)
                before, after = self.info(source), self.info(out)
                self.expect_place(after, np.array(before["direction"]).T * before["spacing"], before["origin"])
                raw = out.read_bytes()
                raw = gzip.decompress(raw) if name == "a.mgz" else raw
                kind = struct.unpack_from(">i", raw, 20)[0]
                self.assertEqual(kind, TYPES.get(dtype if dtype not in ("u2", "f8") else "f4"))
                stored = next(k for k, code in TYPES.items() if code == kind)
                np.testing.assert_array_equal(np.frombuffer(raw, ">" + stored, offset=284).reshape(v.shape), v)
        self.run_it("render", source, "-o", self.folder / "picture.mgz", code=2)

    def test_damaged_files_are_refused(self):
        v = w.ramp(3, 4, 5, dtype=">i2").tobytes()
        whole = header((3, 4, 5), 4) + v
        bad = {"cut.mgh": whole[:-1], "head.mgh": whole[:200], "empty.mgh": b"", "cut.mgz": gzip.compress(whole)[:-20],
               "no.mgz": b"\x1f\x8b\x08" + bytes(300), "version.mgh": header((3, 4, 5), 4, version=2) + v, "type.mgh": header((3, 4, 5), 7) + v,
               "negative.mgh": header((3, -4, 5), 4) + v, "frames.mgh": header((3, 4, 5), 4, frames=-1) + v, "zero.mgh": header((0, 4, 5), 4) + v,
               "huge.mgh": header((2**31 - 1,) * 3, 4) + v, "huge.mgz": gzip.compress(header((60000, 60000, 60000), 3) + v),
               "nan.mgh": header((3, 4, 5), 4, spacing=(1, float("nan"), 1)) + v, "flat.mgh": header((3, 4, 5), 4, spacing=(1, 0, 1)) + v,
               "line.mgh": header((3, 4, 5), 4, columns=np.ones((3, 3))) + v, "far.mgh": header((3, 4, 5), 4, centre=(0, float("inf"), 0)) + v}
        for name, data in bad.items():
            with self.subTest(name):
                said = self.run_it("info", self.put(name, data), code=4).stderr.decode()
                self.assertIn(name, said)


if __name__ == "__main__":
    unittest.main()
