"""Labels by their ids: 64 bits told apart, kept bit for bit, named and coloured as the file says; thin parts are seen. Needs EDGEWISE."""

import json
import re
import struct
import unittest

import numpy as np
from running import Running, native

KINDS = {"u1": "uint8", "i2": "int16", "i4": "int32", "u4": "uint32", "i8": "int64", "u8": "uint64", "f4": "float", "f8": "double"}
BASE = 864691135000000123  # of a connectome; f64 tells every 128th integer there


def nrrd(path, v, extra=""):
    v = np.ascontiguousarray(v)
    head = (f"NRRD0004\ntype: {KINDS[v.dtype.str[1:]]}\ndimension: 3\nsizes: {' '.join(map(str, v.shape[::-1]))}\nspacings: 1 1 1\n"
            f"encoding: raw\nendian: little\n{extra}\n")
    path.write_bytes(head.encode() + v.tobytes())
    return path


def read_nrrd(path):
    head, data = path.read_bytes().split(b"\n\n", 1)
    field = lambda name: re.search(rf"^{name}: (.*)$", head.decode(), re.M).group(1)
    kind = {name: code for code, name in KINDS.items()}[field("type")]
    return np.frombuffer(data, "<" + kind).reshape([int(n) for n in field("sizes").split()][::-1])


def ply(path):
    head, rest = path.read_bytes().split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    counts = [int(line.split()[2]) for line in lines if line.startswith("element")]
    kinds = {"uchar": "u1", "int": "<i4", "double": "<f8"}
    face = [("n", "u1"), ("v", "<i4", 3)]
    face += [(line.split()[2], kinds[line.split()[1]]) for line in lines if line.startswith("property") and line.split()[1] in kinds]
    faces = np.frombuffer(rest, np.dtype(face), counts[1], 24 * counts[0])
    return np.frombuffer(rest, "<f4", 6 * counts[0]).reshape(-1, 6)[:, :3].astype(float), faces, [line for line in lines if line.startswith("comment label")]


def volume(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def two_blocks(kind, first, second, shape=(6, 7, 9)):
    v = np.zeros(shape, kind)
    v[1:4, 2:5, 1:4] = first
    v[1:4, 2:5, 4:8] = second
    return v


class LabelIds(Running):
    def test_neighbours_of_64_bits_are_turned_bit_for_bit(self):
        cases = (("<u8", BASE, BASE + 1), ("<i8", BASE + 1, -BASE), ("<u8", 2 ** 64 - 1, 2 ** 64 - 2), ("<i8", -2 ** 63, 2 ** 63 - 1),
                 ("<i8", 2 ** 40, 2 ** 40 + 1))
        for kind, first, second in cases:
            v = two_blocks(kind, first, second)
            source = nrrd(self.folder / "in.nrrd", v)
            out = self.folder / "out.nrrd"
            with self.subTest((kind, first, second)):
                self.run_it("warp", source, "-o", out, "--labels", "--rotate", "0,0,180", "--quiet")
                np.testing.assert_array_equal(read_nrrd(out), v[:, ::-1, ::-1])
                self.assertEqual(read_nrrd(out).dtype, v.dtype)
                # Turned out of the grid no new id appears, and the value beyond the input is one that was asked for.
                self.run_it("warp", source, "-o", out, "--labels", "--rotate", "10,20,30", "--outside", "77", "--quiet")
                self.assertLessEqual(set(read_nrrd(out).ravel().tolist()), {0, 77, first, second})
                self.assertIn(first, read_nrrd(out))
                self.assertIn(second, read_nrrd(out))

    def test_formats_without_64_bits_are_refused_and_nifti_has_them(self):
        source = nrrd(self.folder / "in.nrrd", two_blocks("<i8", BASE, BASE + 1))
        done = self.run_it("warp", source, "-o", self.folder / "out.tif", "--labels", "--quiet", code=2)
        self.assertIn("64-bit integers", done.stderr.decode())
        out = self.folder / "out.nii"
        self.run_it("warp", source, "-o", out, "--labels", "--rotate", "0,0,180", "--quiet")
        data = out.read_bytes()
        self.assertEqual(struct.unpack_from("<hh", data, 70), (1024, 64))
        self.assertEqual(set(np.frombuffer(data, "<i8", offset=352).tolist()), {0, BASE, BASE + 1})
        self.run_it("warp", out, "-o", self.folder / "again.nrrd", "--labels", "--rotate", "0,0,180", "--quiet")
        np.testing.assert_array_equal(read_nrrd(self.folder / "again.nrrd"), read_nrrd(source))
        done = self.run_it("warp", source, "-o", self.folder / "a.nrrd", "--labels", "--outside", "0.5", code=2)
        self.assertIn("--outside 0.5", done.stderr.decode())

    def test_surfaces_are_named_by_all_digits(self):
        for kind, first, second in (("<u8", BASE, BASE + 1), ("<i8", -BASE - 1, -BASE), ("<u8", 2 ** 64 - 2, 2 ** 64 - 1)):
            source = nrrd(self.folder / "in.nrrd", two_blocks(kind, first, second))
            out = self.folder / "out.ply"
            report = json.loads(self.run_it("mesh", source, "-o", out, "--labels", "--json", "-", "--quiet").stdout)
            self.assertTrue(report["closed"])
            points, faces, comments = ply(out)
            # PLY has no integers of 64 bits: a place in the list of its comments stands for each.
            names = dict(line.split()[2:4] for line in comments[1:])
            got = {int(names[str(k)]): volume(points, faces["v"][faces["label"] == k]) for k in np.unique(faces["label"])}
            self.assertEqual(set(got), {first, second})
            self.assertAlmostEqual(got[first], 27, delta=0.05 * 27)
            self.assertAlmostEqual(got[second], 36, delta=0.05 * 36)
            self.run_it("mesh", source, "-o", self.folder / "out.obj", "--labels", "--quiet")
            groups = [line for line in (self.folder / "out.obj").read_text().splitlines() if line.startswith("g ")]
            self.assertEqual(groups, [f"g label_{first}", f"g label_{second}"])

    def picture(self, source, *words):
        out = self.folder / "p.nrrd"
        self.run_it("render", source, "-o", out, "--labels", "--mode", "surface", "--background", "none", "--shade", "none", "--quiet", *native(words))
        return read_nrrd(out)

    def test_pictures_tell_large_ids_apart(self):
        for kind, first, second in (("<u8", BASE, BASE + 1), ("<i4", 614454277, 614454278), ("<u4", 2 ** 32 - 2, 2 ** 32 - 1), ("<f4", 0.25, 1.5),
                                    ("<f8", 2.0 ** 45, 2.0 ** 45 + 1), ("<i8", -5, BASE)):
            source = nrrd(self.folder / "in.nrrd", two_blocks(kind, first, second))
            for path in ((), ("--via", "surface.draw"), ("--via", "label_cast")):
                with self.subTest((kind, first, path)):
                    got = self.picture(source, "--size", "90x70", *path)
                    self.assertEqual(len(np.unique(got[got[..., 3] > 0], axis=0)), 2)

    def test_more_labels_than_a_palette_has(self):
        v = np.arange(1, 20 ** 3 + 1, dtype="<i4").reshape(20, 20, 20) * 100003
        got = self.picture(nrrd(self.folder / "in.nrrd", v), "--view", "z")
        self.assertGreater(len(np.unique(got.reshape(-1, 4), axis=0)), 350)

    def test_a_file_brings_colours_and_names(self):
        extra = ("Segment0_Color:=1 0 0\nSegment0_LabelValue:=5\nSegment0_Name:=Left kidney\n"
                 "Segment12_LabelValue:=7\nSegment12_Color:=0 1 0.5\nSegment12_Name:=Vessel\n")
        for kind, first, second in (("u1", 5, 7), ("<i2", 5, 7), ("<f4", 5, 7), ("<i8", 5, 7)):
            source = nrrd(self.folder / "in.seg.nrrd", two_blocks(kind, first, second), extra)
            for path in (("--via", "surface.draw"), ("--via", "label_cast")):
                got = self.picture(source, "--size", "90x70", *path)
                colours = np.unique(got[got[..., 3] > 0], axis=0)
                np.testing.assert_allclose(colours, [[0, 1, 0.5, 1], [1, 0, 0, 1]], atol=1e-6)
            out = self.folder / "out.ply"
            self.run_it("mesh", source, "-o", out, "--labels", "--quiet")
            _, faces, comments = ply(out)
            self.assertEqual(comments, ["comment label 5 Left kidney", "comment label 7 Vessel"])
            for label, colour in ((5, (255, 0, 0)), (7, (0, 255, 128))):
                of = faces[faces["label"] == label]
                self.assertEqual({tuple(c) for c in zip(of["red"].tolist(), of["green"].tolist(), of["blue"].tolist())}, {colour})
            self.run_it("mesh", source, "-o", self.folder / "out.obj", "--labels", "--quiet")
            self.assertIn("# label_5: Left kidney\ng label_5\n", (self.folder / "out.obj").read_text())
        # A colour that is none, and a label that nobody names, take those of the palette.
        source = nrrd(self.folder / "in.seg.nrrd", two_blocks("u1", 5, 9), "Segment0_Color:=2 x\nSegment0_LabelValue:=5\n")
        got = self.picture(source)
        self.assertEqual(len(np.unique(got[got[..., 3] > 0], axis=0)), 2)

    def test_vessels_of_one_two_and_three_samples_are_seen_at_every_size(self):
        for axis, view in ((2, "z"), (1, "z"), (0, "x")):
            for thick in (1, 2, 3):
                v = np.zeros((32, 32, 32), "u1")
                box = [slice(12, 12 + thick)] * 3
                box[axis] = slice(4, 28)
                v[tuple(box)] = 3
                source = nrrd(self.folder / "in.nrrd", v)
                for size in (32, 64, 256, 500):
                    for words in ((), ("--via", "surface.draw")):
                        with self.subTest((axis, thick, size, words)):
                            got = self.picture(source, "--view", view, "--size", f"{size}x{size}", *words)
                            seen = (got[..., 3] > 0).sum() * (32 / size) ** 2
                            # Pixels are in or out: their rows may take half a row more or less at both sides.
                            edge = 32 / size * 24 if size % 32 else 0
                            self.assertAlmostEqual(seen, 24 * thick, delta=0.05 * 24 * thick + 2 * thick * 32 / size + edge)

    def test_thin_parts_stay_in_turntables(self):
        v = np.zeros((24, 24, 24), "u1")
        v[12, 12, 3:21] = 1
        v[5, 3:21, 3:21] = 2
        source = nrrd(self.folder / "in.nrrd", v)
        self.run_it("render", source, "-o", self.folder / "t_%d.nrrd", "--labels", "--mode", "surface", "--background", "none", "--shade", "none",
                    "--turntable", "4", "--size", "96x96", "--quiet")
        self.run_it("render", source, "-o", self.folder / "c_%d.nrrd", "--labels", "--mode", "surface", "--background", "none", "--shade", "none",
                    "--turntable", "4", "--size", "96x96", "--quiet", "--via", "label_cast")
        for i in range(4):
            seen, voxels = ((read_nrrd(self.folder / f"{name}_{i}.nrrd")[..., 3] > 0).sum() for name in "tc")
            self.assertAlmostEqual(seen / voxels, 1, delta=0.1)

    def test_smooth_says_how_much(self):
        v = np.zeros((20, 20, 20), "u1")
        z, y, x = np.mgrid[:20, :20, :20]
        v[(x - 9) ** 2 + (y - 9) ** 2 + (z - 9) ** 2 <= 36] = 1
        source = nrrd(self.folder / "in.nrrd", v)
        areas = []
        for smooth in ("0", "0.25", "0.5", "1"):
            report = json.loads(self.run_it("mesh", source, "-o", "null:", "--labels", "--smooth", smooth, "--json", "-", "--quiet").stdout)
            self.assertAlmostEqual(report["volume"], v.sum(), delta=0.05 * v.sum() if smooth != "0" else 0.01)
            areas.append(report["area"])
        self.assertEqual(areas, sorted(areas, reverse=True))
        default = json.loads(self.run_it("mesh", source, "-o", "null:", "--labels", "--json", "-", "--quiet").stdout)
        self.assertEqual(default["area"], areas[-1])
        voxels = self.picture(source, "--smooth", "0")
        np.testing.assert_array_equal(voxels[..., 3] > 0, v.any(0))
        for words, said in ((("--labels", "--smooth", "1.5"), "0 to 1"), (("--labels", "--smooth", "much"), "--smooth"),
                            (("--isovalue", "1", "--smooth", "1.5"), "0 to 1")):
            self.assertIn(said, self.run_it("mesh", source, "-o", "null:", *words, code=2).stderr.decode())

    def test_labels_are_closed_at_the_scans_ends(self):
        for shape, block in (((6, 9, 9), np.s_[:, 2:6, 3:7]), ((1, 9, 9), np.s_[:, 2:6, 3:7]), ((9, 1, 9), np.s_[2:6, :, 3:7]), ((1, 1, 1), np.s_[:])):
            for kind in ("u1", "<f4", "<u8"):
                v = np.zeros(shape, kind)
                v[block] = 2
                report = json.loads(self.run_it("mesh", nrrd(self.folder / "in.nrrd", v), "-o", "null:", "--labels", "--json", "-", "--quiet").stdout)
                self.assertTrue(report["closed"])
                self.assertAlmostEqual(report["volume"], (v > 0).sum(), delta=0.05 * (v > 0).sum())


if __name__ == "__main__":
    unittest.main()
