"""Random filters, lines, labels and thresholds (known_fuzz.py) whose results are known without the command. Needs EDGEWISE.

EDGEWISE_FUZZ_SEED and EDGEWISE_FUZZ_REQUESTS draw others, and more of them."""

import os
import pathlib
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import known_fuzz  # noqa: E402

SEED = int(os.environ.get("EDGEWISE_FUZZ_SEED", "1"))
REQUESTS = int(os.environ.get("EDGEWISE_FUZZ_REQUESTS", "100"))


class References(unittest.TestCase):
    def test_sums_are_those_of_scipy(self):
        rng = np.random.default_rng(2)
        for border, keys in known_fuzz.BORDERS.items():
            for shape, extent in (((9, 11), (4, 3)), ((6, 7, 5), (2, 5, 3))):
                a, w = rng.random(shape), rng.standard_normal(extent)
                for op in ("convolve", "correlate"):
                    got, _ = known_fuzz.filtered(a, op, w, np.ones(extent, bool), border)
                    np.testing.assert_allclose(got, getattr(known_fuzz.ndimage, op)(a, w, **keys), atol=1e-12, err_msg=f"{op} {border}")

    def test_lines_through_a_constant(self):
        """The field falls from its outermost samples to 0 within one sample: across it every line has the length n."""
        a = np.full((9, 9), 2.0)
        rows = known_fuzz.sinogram(a, 2, (1.0, 1.0), 17, 64)
        np.testing.assert_allclose(rows[:, 8], 18, atol=1e-3)
        np.testing.assert_allclose(rows[0, :3], 0, atol=1e-12)
        votes = known_fuzz.hough(a, 2, 1, (1.0, 1.0), 17)[0]
        np.testing.assert_array_equal(votes[0], [0] * 4 + [9] * 9 + [0] * 4)


class Fuzz(unittest.TestCase):
    def test_random_requests(self):
        faults, figures, ratios, done = known_fuzz.fuzz_known(SEED, 0, REQUESTS, float("inf"), list(known_fuzz.KINDS))
        told = "\n".join(f"[{fault.number}] {fault.kind}: {fault.detail}\n    {fault.line}\n    {fault.plan}" for fault in faults)
        print(known_fuzz.summary(faults, figures, ratios, done), file=sys.stderr)
        self.assertEqual(done, REQUESTS)
        # Pictures are of 26 x 26 pixels at most, results of some thousand samples: all of them are measured before anything is
        # promised, so that no promise is left to chance.
        self.assertEqual(faults, [], told)
        count, close, above, worst = known_fuzz.kept_promises(ratios)
        self.assertGreater(count, REQUESTS / 10)
        self.assertGreaterEqual(close, .95, told)
        self.assertLessEqual(above, .01, told)
        self.assertLess(worst, 1.1, told)


if __name__ == "__main__":
    unittest.main()
