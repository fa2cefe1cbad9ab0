"""Crops and slices: `warp --clip` and `warp VOLUME -o s_%03d.png`, against numpy's slices and the places that headers say. Needs EDGEWISE."""

import json
import pathlib
import sys
import unittest

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parent.parent / "io")]
import files  # noqa: E402
import format_writers as w  # noqa: E402
from running import Running  # noqa: E402

AXES = np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]])  # rows: where x, y and z point, in RAS


def affine_of(data):
    """RAS of an index, by srow."""
    return np.frombuffer(data, "<f4", 12, 280).reshape(3, 4)


class Volumes(Running):
    def put(self, name, volume, spacing=(0.7, 0.9, 2.5), origin=(11, -7, 30), axes=AXES):
        path = self.folder / name
        path.write_bytes(w.nifti(volume, spacing=spacing, sform=[[*(axes[:, row] * spacing), origin[row]] for row in range(3)], units=2))
        return path


class Crops(Volumes):
    def test_samples_stay_and_stay_where_they_are(self):
        rng = np.random.default_rng(2)
        for name, dtype, (x0, y0, z0), (x1, y1, z1) in (("a.nii", "<i2", (3, 2, 1), (9, 6, 4)), ("b.nii", "u1", (0, 0, 0), (0, 7, 5)),
                                                        ("c.nii", "<f4", (5, 5, 5), (10, 7, 5)), ("d.nii", "<u2", (0, 0, 0), (10, 7, 5))):
            volume = rng.integers(0, 200, (6, 8, 11)).astype(dtype)
            path = self.put(name, volume)
            out = self.folder / ("crop_" + name)
            done = self.run_it("warp", path, "-o", out, "--clip", f"{x0},{y0},{z0},{x1},{y1},{z1}")
            data = out.read_bytes()
            part = files.read_nifti(data)[..., 0]
            self.assertEqual(part.dtype, volume.dtype)
            np.testing.assert_array_equal(part, volume[z0:z1 + 1, y0:y1 + 1, x0:x1 + 1])
            before, after = affine_of(path.read_bytes()), affine_of(data)
            np.testing.assert_allclose(after[:, :3], before[:, :3], atol=1e-6)
            np.testing.assert_allclose(after[:, 3], before[:, :3] @ [x0, y0, z0] + before[:, 3], atol=1e-5)
            self.assertNotIn(b"cut off", done.stderr)

    def test_with_a_view_the_box_is_of_the_file(self):
        volume = np.arange(6 * 8 * 11, dtype="<i2").reshape(6, 8, 11)
        path = self.put("v.nii", volume, axes=np.eye(3))
        out = self.folder / "front.nii"
        self.run_it("warp", path, "-o", out, "--view", "x", "--clip", "2,1,3,4,6,5")
        # Right and down are y and z; away from the eye is x.
        np.testing.assert_array_equal(files.read_nifti(out.read_bytes())[..., 0], volume[3:6, 1:7, 2:5].transpose(2, 0, 1))

    def test_content_that_turns_is_cropped_after_it(self):
        volume = np.random.default_rng(1).normal(size=(5, 9, 9)).astype("<f4")
        path = self.put("t.nii", volume, spacing=(1, 1, 1))
        whole, part = self.folder / "whole.nii", self.folder / "part.nii"
        self.run_it("warp", path, "-o", whole, "--rotate", "0,0,30", "--via", "warp.backward/filter=foh")
        self.run_it("warp", path, "-o", part, "--rotate", "0,0,30", "--via", "warp.backward/filter=foh", "--clip", "1,2,0,6,7,3")
        np.testing.assert_allclose(files.read_nifti(part.read_bytes()), files.read_nifti(whole.read_bytes())[0:4, 2:8, 1:7], atol=1e-5)

    def test_images_and_sizes(self):
        picture = np.random.default_rng(1).integers(0, 255, (20, 30, 3)).astype("u1")
        path = self.folder / "p.png"
        files.write_png(path, picture)
        out = self.folder / "q.png"
        self.run_it("warp", path, "-o", out, "--clip", "4,3,13,9")
        np.testing.assert_array_equal(files.read_png(out.read_bytes())[0], picture[3:10, 4:14])
        self.run_it("warp", path, "-o", out, "--clip", "4,3,13,9", "--size", "20")
        self.assertEqual(files.read_png(out.read_bytes()).shape, (1, 14, 20, 3))

    def test_refusals(self):
        path = self.put("r.nii", np.zeros((6, 8, 11), "<i2"))
        for clip, words in (("0,0,0,11,1,1", b"from 0 to 10"), ("3,0,0,2,1,1", b"at most the last"), ("0,0,0.5,1,1,1", b"whole numbers"),
                            ("0,0,1,1", b"X0,Y0,Z0"), ("-1,0,0,1,1,1", b"from 0 to 10")):
            self.assertIn(words, self.run_it("warp", path, "-o", "null:", "--clip=" + clip, code=2).stderr)
        for more in (["--size", "fit"], ["--move", "grid", "--rotate", "3,0,0"]):
            self.assertIn(b"--clip", self.run_it("warp", path, "-o", "null:", "--clip", "0,0,0,1,1,1", *more, code=2).stderr)


class Slices(Volumes):
    def test_a_folder_of_pictures(self):
        volume = np.random.default_rng(4).integers(0, 256, (5, 6, 7)).astype("u1")
        volume[0, 0, :2] = 0, 255
        for name, dtype in (("s.nii", "u1"), ("s16.nii", "<i2"), ("sf.nii", "<f4")):  # a view from 0 to 255, which is all of them
            path = self.put(name, volume.astype(dtype))
            done = self.run_it("warp", path, "-o", self.folder / f"{name}_%03d.png", "--json", "-")
            self.assertEqual(len(json.loads(done.stdout)["outputs"]), 5)
            for k in range(5):
                found = files.read_png((self.folder / f"{name}_{k:03d}.png").read_bytes())[0, ..., 0]
                np.testing.assert_array_equal(found, volume[k])

    def test_slices_of_volumes_lie_where_they_were(self):
        volume = np.random.default_rng(4).integers(0, 999, (4, 6, 7)).astype("<i2")
        path = self.put("n.nii", volume)
        self.run_it("warp", path, "-o", self.folder / "n_%d.nii", "--clip", "1,0,1,6,5,3")
        before = affine_of(path.read_bytes())
        for k in range(3):
            data = (self.folder / f"n_{k}.nii").read_bytes()
            np.testing.assert_array_equal(files.read_nifti(data)[0, ..., 0], volume[k + 1, :, 1:7])
            np.testing.assert_allclose(affine_of(data)[:, 3], before[:, :3] @ [1, 0, k + 1] + before[:, 3], atol=1e-5)
        self.assertFalse((self.folder / "n_3.nii").exists())

    def test_read_again_it_is_the_volume(self):
        volume = np.random.default_rng(4).integers(0, 65536, (12, 6, 7)).astype("<u2")
        path = self.put("a.nii", volume)
        folder = self.folder / "stack"
        folder.mkdir()
        self.run_it("warp", path, "-o", folder / "%d.tif")
        self.run_it("warp", folder, "-o", self.folder / "again.nii")
        np.testing.assert_array_equal(files.read_nifti((self.folder / "again.nii").read_bytes())[..., 0], volume)


if __name__ == "__main__":
    unittest.main()
