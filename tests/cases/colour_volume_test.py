"""Volumes of colours: three or four channels that are one colour. Needs EDGEWISE."""

import json
import pathlib
import struct
import sys
import unittest

import numpy as np

root = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(root / "io"), str(root / "cli")]
import dicom_writing as dw
import files
import format_writers as w
from running import Running, native

COLOUR = (200, 100, 50)


def block(shape=(5, 12, 14), alpha=None, dtype="u1", scale=1):
    v = np.zeros((*shape, 3 if alpha is None else 4), dtype)
    v[1:4, 3:9, 3:10, :3] = np.array(COLOUR) * scale
    if alpha is not None:
        v[..., 3] = 255 * scale  # black around is opaque
        v[1:4, 3:9, 3:10, 3] = alpha * scale
    return v


def nifti_colours(v):
    head = bytearray(w.nifti(np.zeros(v.shape[:3], "u1"), code=128 if v.shape[3] == 3 else 2304, bits=8 * v.shape[3])[:352])
    return bytes(head) + v.tobytes()


def tiff_colours(v, order="<", planar=1, premultiplied=False):
    return w.tiff([w.tiff_page(p, order=order, planar=planar, extra=() if v.shape[3] == 3 else (1 if premultiplied else 2,)) for p in v], order)


def vtk_colours(v):
    z, y, x, c = v.shape
    return w.vtk(v.shape[:3], [f"POINT_DATA {x * y * z}", f"COLOR_SCALARS rgb {c}\n".encode() + v.tobytes()])


class ColourVolumeTest(Running):
    def put(self, name, data):
        (self.folder / name).write_bytes(data)
        return self.folder / name

    def info(self, path):
        return json.loads(self.run_it("info", path, "--json", "-", "--quiet").stdout)

    def picture(self, path, *words, ending=".png"):
        out = self.folder / ("picture" + ending)
        self.run_it("render", path, "-o", out, "--quiet", *native(words))
        return files.read(out)[0].astype(float)

    def expect_block(self, picture, colour, atol=1):
        """All that is not black has the colour, and there is as much of it as rays through the block."""
        lit = picture[picture.max(-1) > 0.9 * picture.max()]
        self.assertGreater(len(lit), 10)
        np.testing.assert_allclose(lit, np.broadcast_to(colour, lit.shape), atol=atol)
        self.assertEqual(picture.min(), 0)

    def sources(self, v):
        kind = "RGB-color" if v.shape[3] == 3 else "RGBA-color"
        yield self.put("a.tif", tiff_colours(v))
        yield self.put("b.tif", tiff_colours(v, ">", planar=2))
        yield self.put("a.nii", nifti_colours(v))
        yield self.put("a.nrrd", w.nrrd(v, f"kinds: {kind} domain domain domain"))
        yield self.put("a.vti", w.vti(v.shape[:3], v))
        yield self.put("a.vtk", vtk_colours(v))
        z, y, x, c = v.shape  # as text colours go from 0 to 1
        text = f"COLOR_SCALARS rgb {c}\n" + " ".join(map(str, (v / 255).ravel().tolist()))
        yield self.put("b.vtk", w.vtk(v.shape[:3], [f"POINT_DATA {x * y * z}", text], binary=False))

    def test_colours_keep_their_proportion(self):
        for source in self.sources(block()):
            with self.subTest(source.name):
                said = self.info(source)
                self.assertEqual((said["channels"], said["colour"]), (3, True))
                scale = 255 / COLOUR[0] if source.name == "b.vtk" else 1  # of floats the window ends at the largest
                for words in ((), ("--channel", "all")):
                    self.expect_block(self.picture(source, "--view", "z", *words), np.array(COLOUR) * scale)

    def test_modes_and_views(self):
        source = self.put("a.nii", nifti_colours(block()))
        for view in "xyz":
            # Pixels between samples are darker, of the same colour.
            picture = self.picture(source, "--view", view, "--size", "20x20", "--mode", "mip")
            lit = picture[picture[..., 0] > 100]
            self.assertGreater(len(lit), 10)
            np.testing.assert_allclose(lit / lit[:, :1], np.broadcast_to(np.array(COLOUR) / COLOUR[0], lit.shape), atol=0.01)
        # Rays along z meet the block in 3 of 5 samples, a mean is 3/5 of the colour, an integral thrice.
        self.expect_block(self.picture(source, "--view", "z", "--mode", "mean", "--size", "14x12"), np.array(COLOUR) * 3 / 5, atol=1.1)
        picture = self.picture(source, "--view", "z", "--mode", "xray", "--size", "14x12")
        brightest = picture.reshape(-1, 3)[picture.sum(-1).argmax()]
        np.testing.assert_allclose(brightest / brightest[0], np.array(COLOUR) / COLOUR[0], atol=0.01)
        np.testing.assert_allclose(self.picture(source, "--view", "z", "--mode", "minip"), 0)
        for mode in ("composite", "surface", "binary"):
            words = ("--isovalue", "50") if mode != "composite" else ()
            done = self.run_it("render", source, "-o", self.folder / "no.png", "--mode", mode, *words, code=2)
            self.assertRegex(done.stderr.decode(), "colours.*--mode mip.*--channel 0")
        self.run_it("render", source, "-o", self.folder / "one.png", "--mode", "composite", "--channel", "0", "--quiet")

    def test_frames_and_values(self):
        source = self.put("a.tif", tiff_colours(block()))
        self.run_it("render", source, "-o", self.folder / "f_%d.png", "--turntable", "3", "--size", "native", "--quiet")
        self.expect_block(files.read(self.folder / "f_0.png")[0].astype(float), COLOUR)
        values = self.picture(source, "--view", "z", ending=".nrrd")
        np.testing.assert_allclose(values.max((0, 1)), np.array(COLOUR) / 255, atol=1e-6)
        window = self.picture(source, "--view", "z", "--window", "0,400")
        self.expect_block(window, np.array(COLOUR) * 255 / 400)

    def test_other_types_share_one_window(self):
        for dtype, scale in (("<u2", 100), ("<f4", 1), ("<f4", 1 / 255), ("<u2", 1)):
            source = self.put("a.nrrd", w.nrrd(block(dtype=dtype, scale=scale), "kinds: RGB-color domain domain domain"))
            picture = self.picture(source, "--view", "z")
            lit = picture.reshape(-1, 3)[picture.sum(-1).argmax()]
            np.testing.assert_allclose(lit / lit[0], np.array(COLOUR) / COLOUR[0], atol=0.01, err_msg=f"{dtype} {scale}")

    def test_alpha_makes_transparent(self):
        for alpha in (255, 128, 0):
            for source in self.sources(block(alpha=alpha)):
                with self.subTest(source.name, alpha=alpha):
                    said = self.info(source)
                    self.assertEqual((said["channels"], said["colour"]), (4, True))
                    picture = self.picture(source, "--view", "z")
                    if alpha:
                        expected = np.array(COLOUR) * alpha / 255
                        # Of floats the window ends at the largest.
                        scale = 255 / expected[0] if source.name == "b.vtk" else 1
                        self.expect_block(picture, expected * scale, atol=1.5)
                    else:
                        self.assertEqual(picture.max(), 0)
        # Colours that are multiplied already stay as they are.
        source = self.put("m.tif", tiff_colours(block(alpha=200), premultiplied=True))
        self.expect_block(self.picture(source, "--view", "z"), COLOUR)

    def test_a_folder_of_pictures(self):
        folder = self.folder / "pictures"
        folder.mkdir(exist_ok=True)
        for i, page in enumerate(block()):
            files.write_png(folder / f"{i}.png", page)
        self.expect_block(self.picture(folder, "--view", "z"), COLOUR)

    def test_a_series_of_dicom(self):
        folder = self.folder / "series"
        folder.mkdir(exist_ok=True)
        for i, page in enumerate(block()):
            elements = dw.picture(page, colour=True, photometric="RGB", position=(0, 0, i), number=i + 1)
            (folder / f"{i}.dcm").write_bytes(dw.file_of(elements))
        self.assertTrue(self.info(folder)["colour"])
        self.expect_block(self.picture(folder, "--view", "z"), COLOUR)

    def test_channels_are_not_colours(self):
        """Of three measurements each has its own window, also when they were written by edgewise."""
        v = block()
        source = self.put("a.mha", w.metaimage(v, channels=3))
        self.assertFalse(self.info(source)["colour"])
        done = self.run_it("render", source, "-o", self.folder / "no.png", "--view", "z", code=2)
        self.assertIn("--channel all", done.stderr.decode())
        for ending in (".mha", ".nrrd", ".tif", ".nii"):
            out = self.folder / ("written" + ending)
            self.run_it("warp", source, "-o", out, "--quiet")
            self.assertFalse(self.info(out)["colour"], ending)
            self.expect_block(self.picture(out, "--view", "z", "--channel", "all"), (255, 255, 255))

    def test_colours_stay_colours_when_written(self):
        for alpha in (None, 128):
            v = block(alpha=alpha)
            source = self.put("a.nrrd", w.nrrd(v, f"kinds: RGB{'' if alpha is None else 'A'}-color domain domain domain"))
            for ending in (".nrrd", ".tif", ".nii"):
                out = self.folder / ("written" + ending)
                self.run_it("warp", source, "-o", out, "--quiet")
                self.assertTrue(self.info(out)["colour"], ending)
                np.testing.assert_array_equal(files.read(out), v)


if __name__ == "__main__":
    unittest.main()
