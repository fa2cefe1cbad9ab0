"""Padding of DICOM is no value for filters: it does not enter results, and stays padding. Compared with scipy on the samples
whose padding was replaced by hand. Needs EDGEWISE."""
import sys
import pathlib
import unittest

import numpy as np
from scipy import ndimage

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from dicom_series_test import SeriesCase  # noqa: E402

read_back = sys.modules["files"]
PADDING, AIR = -2000, -1000


class PaddedFilters(SeriesCase):
    def scan(self, shape=(5, 9, 8), seed=0, dtype="<i2"):
        """Values of CT in a round field of view; outside of it padding."""
        z, y, x = np.indices(shape)
        values = np.random.default_rng(seed).integers(-100, 300, shape)
        values[:, :, 2:4] = AIR
        outside = (y - shape[1] / 2 + 0.5) ** 2 + (x - shape[2] / 2 + 0.5) ** 2 > (min(shape[1:]) / 2) ** 2
        values[outside] = PADDING
        return values.astype(dtype), outside

    def put(self, values, places=None, intercept=-1024, stored="<i2", **more):
        raw = (values - intercept).astype(stored)
        tags = {0x00281052: ("DS", intercept), 0x00281053: ("DS", 1),
                0x00280120: ("SS" if stored == "<i2" else "US", int(PADDING - intercept))}
        places = range(len(values)) if places is None else places
        return self.series([{**e, **tags, **more} for e in self.slices(raw, places)])

    def filtered(self, folder, *words, warns=True):
        out = self.folder / "f.nrrd"
        done = self.run_it("filter", folder, "-o", out, *words)
        self.assertEqual("padding entered the filter as -1000" in done.stderr.decode(), warns, done.stderr)
        return read_back.read(out)[..., 0]

    def test_ordered_and_summed_neighbourhoods(self):
        for shape in (5, 9, 8), (3, 12, 7), (1, 10, 10):
            values, outside = self.scan(shape)
            folder = self.put(values)
            meant = np.where(outside, AIR, values).astype(float)
            box, cross = np.ones((3, 3, 3)), ndimage.generate_binary_structure(3, 1)
            for words, right in (
                    (("--op", "median", "--kernel", "box:1"), ndimage.median_filter(meant, footprint=box, mode="mirror")),
                    (("--op", "dilate", "--kernel", "cross:1"), ndimage.grey_dilation(meant, footprint=cross, mode="mirror")),
                    (("--op", "erode", "--kernel", "cross:1"), ndimage.grey_erosion(meant, footprint=cross, mode="mirror")),
                    (("--op", "convolve", "--kernel", "gauss:1"), ndimage.gaussian_filter(meant, 1, mode="mirror"))):
                right = np.where(outside, PADDING, right)
                got = self.filtered(folder, *words)
                # Sums are rounded to whole numbers.
                np.testing.assert_allclose(got, right, atol=0.51 if "gauss:1" in words else 0, err_msg=f"{shape} {words}")
                got = self.filtered(folder, *words, "--bits", "32")
                np.testing.assert_allclose(got, right, atol=0.02 if "gauss:1" in words else 0, err_msg=f"{shape} {words}")

    def test_derivatives_are_0_where_nothing_was_measured(self):
        values, outside = self.scan()
        meant = np.where(outside, AIR, values).astype(float)
        got = self.filtered(self.put(values), "--op", "correlate", "--kernel", "laplace", "--bits", "32")
        np.testing.assert_allclose(got, np.where(outside, 0, ndimage.laplace(meant, mode="mirror")), atol=0.1)

    def test_other_types_and_padding_of_each_slice(self):
        values, outside = self.scan(seed=3)
        folder = self.put(values, intercept=-3000, stored="<u2")
        right = ndimage.grey_dilation(np.where(outside, AIR, values), footprint=np.ones((3, 3, 3)), mode="mirror")
        got = self.filtered(folder, "--op", "dilate", "--kernel", "box:1")
        np.testing.assert_array_equal(got, np.where(outside, PADDING, right))
        # Slices of slopes of their own are values in f32.
        sets = []
        for k, e in enumerate(self.slices((values + 3000).astype("<u2"), range(5))):
            sets.append({**e, 0x00281052: ("DS", -3000), 0x00281053: ("DS", 1), 0x00280120: ("US", 1000)})
        sets[2].update({0x7fe00010: ("OW", ((values[2] + 4000) // 2).astype("<u2").tobytes()),
                        0x00281052: ("DS", -4000), 0x00281053: ("DS", 2)})
        values[2] = (values[2] + 4000) // 2 * 2 - 4000
        right = ndimage.grey_dilation(np.where(outside, AIR, values), footprint=np.ones((3, 3, 3)), mode="mirror")
        got = self.filtered(self.series(sets), "--op", "dilate", "--kernel", "box:1")
        np.testing.assert_array_equal(got, np.where(outside, PADDING, right))

    def test_a_missing_slice_is_padding_too(self):
        values, outside = self.scan((6, 9, 8))
        left = [0, 1, 2, 4, 5]
        meant = np.where(outside, AIR, values)
        meant[3] = AIR
        gone = outside.copy()
        gone[3] = True
        right = ndimage.median_filter(meant, footprint=np.ones((3, 3, 3)), mode="mirror")
        got = self.filtered(self.put(values[left], left), "--op", "median", "--kernel", "box:1")
        np.testing.assert_array_equal(got, np.where(gone, PADDING, right))

    def test_padding_lies_outside_of_a_mask(self):
        for seed, left in ((1, None), (2, [0, 1, 2, 4, 5])):
            values, outside = self.scan((6, 9, 8), seed)
            values[~outside & (values < 250)] = 0
            values[0, 4, 4] = -7  # the least value is no measurement of nothing
            mask = np.where(outside, 0, values) != 0
            gone = outside.copy()
            if left:
                mask[3], gone[3] = False, True
            folder = self.put(values if left is None else values[left], left)
            for op, right in (("dilate", ndimage.binary_dilation(mask, np.ones((3, 3, 3)))), ("erode", ndimage.binary_erosion(mask, np.ones((3, 3, 3))))):
                out = self.folder / "m.nrrd"
                self.run_it("filter", folder, "-o", out, "--op", f"binary_{op}", "--kernel", "box:1", "--border", "zero")
                np.testing.assert_array_equal(read_back.read(out)[..., 0] != 0, right & ~gone, err_msg=f"{seed} {op}")

    def test_a_view_of_it_is_black_and_files_without_padding_stay_as_they_were(self):
        values, outside = self.scan((1, 10, 10))
        out = self.folder / "v.png"
        self.run_it("filter", self.put(values), "-o", out, "--op", "median", "--kernel", "box:1", "--window", "-1000,300", "--bits", "8")
        self.assertFalse(read_back.read(out)[0, ..., 0][outside[0]].any())
        values[outside] = 50
        folder = self.put(values)
        got = self.filtered(folder, "--op", "median", "--kernel", "box:1", warns=False)
        np.testing.assert_array_equal(got, ndimage.median_filter(values, footprint=np.ones((1, 3, 3)), mode="mirror"))

    def test_lines_through_padding_add_air(self):
        values, outside = self.scan((1, 9, 9))
        folder, out = self.put(values), self.folder / "r.nrrd"
        other = np.where(outside, AIR, values)
        for path in folder, self.put(other):
            self.run_it("radon", path, "-o", out, "--angles", 12, "--quiet")
            sums = read_back.read(out)
            if path is folder:
                first = sums
        np.testing.assert_allclose(first, sums, rtol=1e-5, atol=0.1)


if __name__ == "__main__":
    unittest.main()
