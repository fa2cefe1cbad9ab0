"""Votes of a Hough transform through the spectrum: why radon.fourier refuses them. Needs EDGEWISE."""

import unittest

import files
import numpy as np
from running import Running

ANGLES = 11


def places(a, threshold):
    """For each angle the offsets of the samples that vote, from the lower end of line 0, and the number of lines."""
    height, width = a.shape
    lines = 2 * int(np.ceil(np.hypot(width + 1, height + 1) / 2)) + 1
    y, x = np.nonzero(a >= threshold)
    for k in range(ANGLES):
        t = np.pi * k / ANGLES
        yield (x - (width - 1) / 2) * np.cos(t) - (y - (height - 1) / 2) * np.sin(t) + (lines - 1) / 2, lines


def by_a_band(offsets, lines, cycles):
    """The slice theorem for votes: the transform of points along a ray of the plane, times that of a step's width (sinc), up
    to so many cycles an offset, at whole offsets."""
    period = 2 * lines
    f = np.arange(-int(cycles * period), int(cycles * period) + 1) / period
    spectrum = np.exp(-2j * np.pi * f[:, None] * offsets).sum(axis=1) * np.sinc(f)
    return (np.exp(2j * np.pi * f * np.arange(lines)[:, None]) @ spectrum).real / period


class HoughSpectrum(Running):
    def setUp(self):
        super().setUp()
        random = np.random.default_rng(8)
        self.a = random.normal(size=(40, 53)).astype("<f4")
        self.source, self.out = self.folder / "in.nrrd", self.folder / "out.nrrd"
        files.write_nrrd(self.source, self.a[None], image=True)

    def run_votes(self, *words, code=0):
        return self.run_it("radon", self.source, "-o", self.out, "--quiet", "--angles", ANGLES, "--to", "hough", "--threshold", 1,
                           *words, code=code)

    def test_refused_with_the_reason(self):
        text = self.run_votes("--via", "radon.fourier", code=3).stderr.decode()
        self.assertIn("0.32/sqrt(f)", text)

    def test_a_band_is_off_by_as_much_as_the_reason_says(self):
        self.run_votes()
        votes = files.read(self.out).reshape(ANGLES, -1)
        for cycles in 1, 4, 16:
            squares, count = 0, 0
            for k, (offsets, lines) in enumerate(places(self.a, 1)):
                self.assertEqual(votes.shape[1], lines)
                self.assertEqual(votes[k].sum(), len(offsets))
                if k == 0:  # offsets of rows and columns are no sample of all that there are
                    continue
                squares += np.square(by_a_band(offsets, lines, cycles) - votes[k]).sum()
                count += len(offsets)
            # Each vote is off by the step's frequencies beyond the band, over all lines: 2 int sinc^2 = 1 / (pi^2 f).
            self.assertAlmostEqual(np.sqrt(squares / count) * np.sqrt(cycles), 1 / np.pi, delta=0.05)


if __name__ == "__main__":
    unittest.main()
