"""A minute of random requests (fuzz.py), and the reference that judges them (contract.py) against closed forms."""

import math
import os
import pathlib
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import contract  # noqa: E402
import fuzz  # noqa: E402

# About a minute of two processors. A number, not a time: the same requests on every machine.
SEED = int(os.environ.get("EDGEWISE_FUZZ_SEED", "1"))
REQUESTS = int(os.environ.get("EDGEWISE_FUZZ_REQUESTS", "100"))


def volume(values, spacing=(1, 1, 1)):
    return contract.Volume(np.asarray(values, float), np.array(spacing, float), np.eye(3), np.zeros(3), False)


class ReferenceTest(unittest.TestCase):
    def test_a_spline_goes_through_its_samples(self):
        rng = np.random.default_rng(1)
        for shape in [(1, 1, 1), (2, 3, 1), (5, 2, 9)]:
            values = rng.random(shape)
            frames = contract.placements(volume(values), [], "z")
            answer = contract.warp(volume(values), frames[0], shape[::-1], (1, 1, 1), "spline", 0)
            np.testing.assert_allclose(answer.values, values, atol=1e-13)

    def test_lengths_through_a_box_seen_from_an_eye(self):
        ones = volume(np.ones((16, 16, 16)))
        frames = contract.placements(ones, [contract.affine(np.diag([1, 1, 2.0]))], "z")
        eye = contract.eye_of(ones, frames, 60, (16, 16), (1, 1))
        self.assertAlmostEqual(eye.distance, 16 + 8 / math.tan(math.radians(30)))
        answer = contract.render(ones, frames, (16, 16), (1, 1), contract.default_look(ones, "xray"), "spline", eye)
        # The ray is off the axis by half a pixel both ways, 1/16 of the picture's half height.
        self.assertAlmostEqual(answer.values[0, 7, 7], 32 * math.sqrt(1 + 2 * (math.tan(math.radians(30)) / 16) ** 2), places=9)

    def test_a_slab_keeps_its_transparency_whatever_its_spacing(self):
        for spacing in ((1, 1, 1), (.5, 2, 1.5)):
            slab = volume(np.ones((4, 3, 3)), spacing)
            look = contract.default_look(slab, "composite", points=[(0, .3, (1, .5, 0)), (2, .3, (1, .5, 0))], unit=2.0,
                                         background=(0, 0, 1))
            answer = contract.render(slab, contract.placements(slab, [], "z"), (1, 1), (1, 1), look, "linear")
            left = .7 ** (4 * spacing[2] / 2)
            np.testing.assert_allclose(answer.values[0, 0, 0], [1 - left, .5 * (1 - left), left], atol=1e-12)

    def test_a_turn_takes_right_to_down(self):
        values = np.zeros((1, 3, 3))
        values[0, 1, 2] = 1  # right of the centre
        turn = contract.affine(contract.rotation((0, 0, 90)))
        answer = contract.warp(volume(values), contract.placements(volume(values), [turn], "z")[0], (3, 3, 1), (1, 1, 1), "nearest", 0)
        self.assertEqual(answer.values[0, 2, 1], 1)

    def test_not_finite_is_outside(self):
        values = np.ones((5, 5, 5))
        values[2, 2, 2] = np.nan
        look = contract.default_look(volume(values), "xray")
        frames = contract.placements(volume(values), [], "z")
        for reference in ("nearest", "linear"):
            picture = contract.render(volume(values), frames, (5, 5), (1, 1), look, reference).values[0]
            self.assertAlmostEqual(picture[2, 2], 4)
            self.assertAlmostEqual(picture[2, 3], 5)


class FuzzTest(unittest.TestCase):
    def test_random_requests(self):
        faults, figures, ratios, done = fuzz.fuzz(SEED, 0, REQUESTS, float("inf"), fuzz.KINDS)
        told = "\n".join(f"[{fault.number}] {fault.kind}: {fault.detail}\n    {fault.line}\n    {fault.plan}" for fault in faults)
        print(fuzz.summary(faults, figures, ratios, done), file=sys.stderr)

        def count(*kinds):
            return sum(fault.kind in kinds for fault in faults)

        self.assertEqual(done, REQUESTS)
        self.assertGreater(figures["judged"], REQUESTS)
        self.assertEqual(count("fuzzer", "exit", "place", "size", "spacing", "header", "beyond", "not finite", "threads"), 0, told)
        self.assertEqual(count("budget, all drawn"), 0, told)
        self.assertLessEqual(count("budget"), .01 * done, told)
        self.assertLessEqual(count("prediction"), .03 * len(ratios), told)
        self.assertEqual(count("verify"), 0, told)


if __name__ == "__main__":
    unittest.main()
