"""Slices that lie evenly but for the digits that their positions are written with: nothing is said, and the step is that of the series;
of slices that lie unevenly by more it is said. Needs EDGEWISE."""
import unittest

import dicom_series_test as series
import numpy as np


class SliceDigits(series.SeriesCase):
    def told(self, places, digits=None, along=(0, 0, 1), **more):
        """What `info` says of slices at so many mm, written with so many digits behind the point."""
        pixels = series.ladder(len(places), 4, 5)
        sets = self.slices(pixels, places, along=along, **more)
        for e, place in zip(sets, places):
            if digits is not None:
                e[0x00200032] = ("DS", "\\".join(f"{place * a:.{digits}f}" for a in along))
        return self.info(self.series(sets))

    def even(self, told, step, room):
        self.assertEqual(told["warnings"], [])
        self.assertLessEqual(abs(told["spacing"][2] - step), room)

    def test_rounded_positions_are_even(self):
        # Rounding to d digits moves the first and the last slice by half a digit at most, so the step of n by a digit over n - 1.
        for step, digits, count in ((1.25, 1, 12), (0.625, 1, 40), (0.3333333, 2, 25), (0.0625, 3, 30), (5.03, 1, 20), (0.7, 1, 10)):
            with self.subTest(step=step, digits=digits):
                told = self.told([-37.1 + step * k for k in range(count)], digits)
                self.even(told, step, 1.001 * 10 ** -digits / (count - 1))

    def test_zeros_that_are_left_out_are_digits_all_the_same(self):
        places = [0.0, 1.25, 2.5, 3.75, 5.0]
        self.even(self.told(places), 1.25, 1e-9)  # written as 0, 1.25, 2.5, 3.75, 5
        # Two digits are said by 4.25: what is half a millimetre off is so.
        self.assertIn("unevenly", " ".join(self.told([0, 1, 2, 3, 4.25])["warnings"]))

    def test_an_oblique_stack_has_the_digits_of_its_three_numbers(self):
        along = np.array((0.48, 0.6, 0.64))
        orientation = np.concatenate((np.cross((0, 1, 0), along) / np.linalg.norm(np.cross((0, 1, 0), along)), (0, 0, 0)))
        orientation[3:] = np.cross(along, orientation[:3])
        step = 0.9
        told = self.told([step * k for k in range(15)], 1, tuple(along), orientation=tuple(orientation), spacing=(2, 2))
        self.even(told, step, 2 * 0.05 * along.sum() * 1.01 / 14)

    def test_more_than_a_digit_is_uneven(self):
        # Written with one digit: 0.1 mm is as much as rounding may be off.
        for places in ([0, 1.2, 2.4, 3.9, 4.8], [0, 2.5, 5.3, 7.5, 10], [0.0, 0.7, 1.4, 2.4, 2.8]):
            with self.subTest(places=places):
                self.assertIn("unevenly", " ".join(self.told(places, 1)["warnings"]))
        # The same with three digits is uneven by less.
        self.assertIn("unevenly", " ".join(self.told([0, 1.25, 2.55, 3.75, 5], 3)["warnings"]))

    def test_digits_as_large_as_the_step_are_taken_as_written(self):
        # A slice is missing, rather than that 0, 1 and 3 stand for 0, 1.5 and 3.
        for places, digits, extent in (([0, 1, 3], 0, 4), ([0, 1, 2, 4, 5], 0, 6), ([0, 0.1, 0.3], 1, 4), ([0, 2, 6, 8], 0, 5)):
            told = self.told(places, digits)
            self.assertEqual(told["extent"][2], extent)
            self.assertIn("missing", " ".join(told["warnings"]))
        self.assertIn("leans", " ".join(self.told([0, 3, 6, 9], 0, (0, 1 / 3, 1))["warnings"]))

    def test_powers_of_ten_are_digits_too(self):
        def told(words):
            sets = self.slices(series.ladder(len(words), 4, 5), range(len(words)))
            for e, word in zip(sets, words):
                e[0x00200032] = ("DS", f"0\\0\\{word}")
            return self.info(self.series(sets))

        self.even(told(["0", "1.3E0", "2.5e0", "3.8", "5.0E+00"]), 1.25, 0.026)
        self.assertIn("unevenly", " ".join(told(["0", "1.30E0", "2.500e0", "3800e-3", "5.00E+00"])["warnings"]))

    def test_places_of_missing_slices_are_told_without_the_digits(self):
        told = self.told([0, 0.6, 1.3, 2.5, 3.1, 3.8], 1)  # steps of 0.625, the fourth is missing
        self.assertEqual(told["extent"], [5, 4, 7])
        self.assertEqual(len(told["warnings"]), 1)
        self.assertIn("missing", told["warnings"][0])


if __name__ == "__main__":
    unittest.main()
