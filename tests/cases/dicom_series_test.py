"""Series of which slices are there twice, or not at all: what is read, where it lies, and what is said. Files are written by
tests/io/dicom_writing.py, which shares nothing with the readers. Needs EDGEWISE."""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

TESTS = pathlib.Path(__file__).parent.parent
sys.path[:0] = [str(TESTS / "io"), str(TESTS / "cli")]
import dicom_writing as dw  # noqa: E402
import files as read_back  # noqa: E402
from dicom_writing import file_of, picture  # noqa: E402

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")


def ladder(*shape, dtype="<i2", first=5):
    """Sample i is (11 i + first) mod 997."""
    return ((np.arange(np.prod(shape)) * 11 + first) % 997).reshape(shape).astype(dtype)


class SeriesCase(unittest.TestCase):
    """Writes series and runs the command on them."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, self.folder)
        self.env = {**os.environ, "XDG_CONFIG_HOME": str(self.folder / "c"), "XDG_CACHE_HOME": str(self.folder / "k")}
        self.count = 0

    def series(self, data_sets, syntaxes=None):
        """A folder with a file for each data set; bytes are files already."""
        self.count += 1
        folder = self.folder / f"s{self.count}"
        folder.mkdir()
        for i, e in enumerate(data_sets):
            data = e if isinstance(e, bytes) else file_of(e, (syntaxes or {}).get(i, dw.EXPLICIT))
            (folder / f"i{i:03}.dcm").write_bytes(data)
        return folder

    def slices(self, pixels, places, numbers=None, along=(0, 0, 1), uid=None, **more):
        """Data sets of slices at so many mm along a direction, with UIDs and numbers of their own."""
        sets = []
        for k, (samples, place) in enumerate(zip(pixels, places)):
            number = (numbers or range(1, len(pixels) + 1))[k]
            e = picture(samples, position=tuple(place * a for a in along), number=number, **more)
            e[0x00080018] = ("UI", f"1.2.9.{self.count}.{uid or 0}.{k + 1}")
            sets.append(e)
        return sets

    def run_it(self, *words, code=0):
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, env=self.env, timeout=60)
        self.assertEqual(done.returncode, code, (words, done.stderr.decode()))
        return done

    def info(self, path, *words):
        return json.loads(self.run_it("info", path, "--json", "-", *words).stdout)

    def samples(self, path, *words, verb="warp"):
        out = self.folder / "out.nrrd"
        self.run_it(verb, path, "-o", out, "--quiet", *words)
        return read_back.read(out)

    def refused(self, path):
        return self.run_it("info", path, code=4).stderr.decode()


class Copies(SeriesCase):
    def test_files_that_are_there_twice_are_one_volume(self):
        for shape, dtype, along in (((5, 6, 5), "<i2", (0, 0, 1)), ((3, 4, 7), "u1", (0, 0, 2.5)), ((4, 5, 3), "<u2", (0, 0, -1))):
            pixels = ladder(*shape, dtype=dtype)
            sets = self.slices(pixels, range(shape[0]), along=along)
            # All twice; one three times; the copies first.
            for twice in (sets + sets, [sets[1], *sets, sets[1]], [*sets[::-1], *sets]):
                folder = self.series(twice)
                told = self.info(folder)
                self.assertEqual((told["extent"], told["times"]), ([*shape[::-1]], 1))
                self.assertIn("once more", " ".join(told["warnings"]))
                self.assertIn(f"{len(twice) - shape[0]} of {len(twice)}", " ".join(told["warnings"]))
                right = pixels[::-1] if along[2] < 0 else pixels
                np.testing.assert_array_equal(self.samples(folder)[..., 0], right)

    def test_copies_under_new_uids_or_in_another_syntax_are_copies(self):
        pixels = ladder(4, 6, 5)
        first, again = self.slices(pixels, range(4)), self.slices(pixels, range(4), uid=7)
        folder = self.series(first + again)
        self.assertEqual((self.info(folder)["times"], self.info(folder)["extent"]), (1, [5, 6, 4]))
        packed = [{**e, 0x7fe00010: dw.fragments([dw.rle(p)])} for e, p in zip(first, pixels)]
        folder = self.series(first + packed, {k: dw.RLE for k in range(4, 8)})
        self.assertEqual(self.info(folder)["times"], 1)
        np.testing.assert_array_equal(self.samples(folder)[..., 0], pixels)

    def test_copies_of_a_series_of_times(self):
        pixels = ladder(6, 4, 5)
        sets = self.slices(pixels, [0, 1, 2] * 2)
        folder = self.series(sets + sets)
        self.assertEqual((self.info(folder, "--time", 0)["times"], self.info(folder, "--time", 0)["extent"]), (2, [5, 4, 3]))
        for time in 0, 1:
            np.testing.assert_array_equal(self.samples(folder, "--time", time)[..., 0], pixels[3 * time:3 * time + 3])

    def test_what_only_looks_alike_stays(self):
        """Equal samples with numbers, times or echoes of their own are no copies; nor are different samples under one UID."""
        pixels = ladder(3, 4, 5)
        still = [pixels, pixels]
        numbered = self.slices(np.concatenate(still), [0, 1, 2] * 2)
        echoes = self.slices(np.concatenate(still), [0, 1, 2] * 2, numbers=[1, 2, 3] * 2)
        for e, echo in zip(echoes, [1, 1, 1, 2, 2, 2]):
            e[0x00180086] = ("IS", f"{echo}")
        moments = self.slices(np.concatenate(still), [0, 1, 2] * 2, numbers=[1, 2, 3] * 2)
        for e, second in zip(moments, [1, 1, 1, 2, 2, 2]):
            e[0x00080032] = ("TM", f"12000{second}")
        one_uid = self.slices(ladder(6, 4, 5), [0, 1, 2] * 2, numbers=[1, 2, 3] * 2)
        for e in one_uid:
            e[0x00080018] = ("UI", "1.2.9.9")
        for sets in numbered, echoes, moments, one_uid:
            told = self.info(self.series(sets), "--time", 0)
            self.assertEqual((told["times"], told["extent"], told["warnings"]), (2, [5, 4, 3], []))
        # A tool that gave all its files one UID: slices at other places, or of which no place is known.
        for places in ([0, 2, 4, 6], None):
            sets = self.slices(ladder(4, 4, 5), places or [0] * 4)
            for e in sets:
                e[0x00080018] = ("UI", "1.2.9.9")
                if places is None:
                    del e[0x00200032], e[0x00200013]
            self.assertEqual(self.info(self.series(sets))["extent"], [5, 4, 4])

    def test_one_place_twice_with_other_samples_is_still_refused(self):
        said = self.refused(self.series(self.slices(ladder(4, 6, 5), [0, 1, 1, 2])))
        self.assertIn("i001.dcm", said)
        self.assertIn("i002.dcm", said)


class MissingSlices(SeriesCase):
    def test_a_missing_slice_leaves_its_place_empty(self):
        for dtype, step, gone, along in (("<i2", 1, [3], (0, 0, 1)), ("u1", 2.5, [1, 5], (0, 0, 1)), ("<u2", 0.7, [4, 5], (0, 0, -1)),
                                         ("<i2", 3, [2], (0, 1, 0))):
            n = 9
            pixels = ladder(n, 4, 5, dtype=dtype) % 200 + 1
            left = [k for k in range(n) if k not in gone]
            sets = self.slices(pixels[left], [step * k for k in left], along=along, modality="MR",
                               **({"orientation": (1, 0, 0, 0, 0, -1)} if along[1] else {}))
            folder = self.series(sets)
            told = self.info(folder)
            self.assertEqual(told["extent"], [5, 4, n])
            np.testing.assert_allclose(told["spacing"], [1, 1, step])
            said = " ".join(told["warnings"])
            self.assertIn(f"{len(gone)} of {n} slices", said)
            np.testing.assert_allclose(told["origin"], np.array(along) * step * (0 if along[2] >= 0 else n - 1), atol=1e-9)
            right = pixels.copy()
            right[gone] = 0
            if along[2] < 0:
                right = right[::-1]
            np.testing.assert_array_equal(self.samples(folder)[..., 0], right)

    def test_the_place_of_a_slice_of_ct_counts_as_air(self):
        pixels = np.full((6, 6, 5), 40, "<i2")
        pixels[:, 0] = -1000
        places = [0, 1, 2, 4, 5]
        scale = {0x00281052: ("DS", -1024), 0x00281053: ("DS", 1)}
        raw = (pixels + 1024).astype("<u2")
        sets = [{**e, **scale} for e in self.slices(raw[places], places)]
        folder = self.series(sets)
        self.assertEqual(self.samples(folder)[3, :, :, 0].tolist(), [[-1000] * 5] * 6)
        # Along z: five slices of 1 mm of 40 HU above air.
        picture_ = self.samples(folder, "--mode", "xray", "--view", "z", "--size", "native", verb="render")
        values = np.sort(np.unique(np.round(np.squeeze(picture_), 3)))
        np.testing.assert_allclose(values, [0, 5 * 1040], atol=0.5)
        self.assertAlmostEqual(self.info(folder)["range"][0], -1000)
        # With padding of its own the place is padding.
        for e in sets:
            e[0x00280120] = ("US", 7)
        folder = self.series(sets)
        self.assertEqual(set(self.samples(folder)[3].ravel()), {7 - 1024})
        self.assertAlmostEqual(self.info(folder)["range"][0], -1000)

    def test_a_place_that_is_empty_at_all_times(self):
        pixels = ladder(8, 4, 5)
        folder = self.series(self.slices(pixels, [0, 1, 2, 4] * 2, modality="MR"))
        for time in 0, 1:
            got = self.samples(folder, "--time", time)[..., 0]
            np.testing.assert_array_equal(got[[0, 1, 2, 4]], pixels[4 * time:4 * time + 4])
            self.assertEqual(set(got[3].ravel()), {0})

    def test_slopes_of_their_own_and_enhanced_objects(self):
        pixels = ladder(4, 4, 5)
        slopes, places = [1, 0.5, 2, 4], [0, 2, 6, 8]
        sets = self.slices(pixels, places, kind="PET")
        for e, slope in zip(sets, slopes):
            e.update({0x00281052: ("DS", 0), 0x00281053: ("DS", slope)})
        right = np.zeros((5, 4, 5))
        right[[0, 1, 3, 4]] = pixels * np.array(slopes)[:, None, None]
        np.testing.assert_allclose(self.samples(self.series(sets))[..., 0], right)

        def frames_at(places):
            frames = [{0x00209113: ("SQ", [{0x00200032: ("DS", (0, 0, place))}])} for place in places]
            e = picture(ladder(len(places), 4, 5), "enhanced MR", more={0x52009230: ("SQ", frames)})
            path = self.folder / "e.dcm"
            path.write_bytes(file_of(e))
            return path
        path = frames_at([0, 1.5, 6, 3, 9, 7.5])
        told = self.info(path)
        self.assertEqual((told["extent"], told["spacing"]), ([5, 4, 7], [1, 1, 1.5]))
        self.assertIn("4.5 mm", " ".join(told["warnings"]))
        np.testing.assert_array_equal(self.samples(path)[[0, 1, 2, 4, 5, 6], ..., 0], ladder(6, 4, 5)[[0, 1, 3, 2, 5, 4]])

    def test_colours_are_black_where_a_slice_is_missing(self):
        pixels = ladder(3, 4, 5, 3, dtype="u1") % 200 + 1
        folder = self.series(self.slices(pixels, [0, 1, 3], photometric="RGB", colour=True))
        got = self.samples(folder)
        np.testing.assert_array_equal(got[[0, 1, 3]], pixels)
        self.assertFalse(got[2].any())

    def test_too_many_missing_slices_are_refused_before_anything_is_made(self):
        for places in ([0, 1, 2, 3, 50], [0, 1, 2, 1e9], [0, 1, 2, 1e15], [0, 1, 5, 6, 10, 11]):
            said = self.refused(self.series(self.slices(ladder(len(places), 4, 5), places)))
            self.assertIn("mm apart", said)
        # A third is taken.
        self.assertEqual(self.info(self.series(self.slices(ladder(4, 4, 5), [0, 1, 2, 5])))["extent"], [5, 4, 6])

    def test_uneven_slices_on_no_grid_are_told(self):
        told = self.info(self.series(self.slices(ladder(5, 4, 5), [0, 3, 6, 10.4, 13.4])))
        self.assertEqual(told["extent"], [5, 4, 5])
        self.assertIn("unevenly", " ".join(told["warnings"]))
        self.assertIn("1.4 mm", " ".join(told["warnings"]))
        # A little unevenness is no missing slice.
        told = self.info(self.series(self.slices(ladder(5, 4, 5), [0, 3.05, 6, 9, 12])))
        self.assertEqual((told["extent"], told["spacing"][2]), ([5, 4, 5], 3))


if __name__ == "__main__":
    unittest.main()
