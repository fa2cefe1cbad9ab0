"""Levels of detail: pictures through a volume of means. Errors are as predicted, the planner takes a level where it is allowed and pays,
and a default budget never does. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import unittest

import numpy as np
from running import DATA, Running, corner_of_mr_head

CT, MR = DATA / "ct_head/quarter.nhdr", DATA / "mr_brain/MR.nii.gz"


class Levels(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.corner = corner_of_mr_head(cls.folder)

    def report(self, *arguments):
        return json.loads(self.run_it("render", *arguments, "--json", "-", "-o", "null:").stdout)

    def through(self, head, level, step, *more):
        return self.report(head, "--rotate", "20,30,0", "--via", f"store.reduce/level={level}",
                           "--via", f"project.level_cast/step={step}", "--max-error", "9", "--verify", *more)

    def test_errors_are_as_predicted(self):
        for head in [CT, self.corner]:
            for mode in ["mip", "xray", "mean"]:
                for level, step in [(1, 2), (2, 4)]:
                    with self.subTest(head=head, mode=mode, level=level):
                        report = self.through(head, level, step, "--mode", mode)
                        predicted, measured = report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"]
                        # Promises are upper estimates of few draws; the issue asks for a factor of 2.
                        self.assertLess(measured, 1.05 * predicted)
                        self.assertGreater(measured, predicted / 2.5)

    def test_lit_and_composite_errors_are_as_predicted(self):
        for more in [["--mode", "composite"], ["--mode", "surface", "--isovalue", "300"]]:
            report = self.through(CT, 1, 2, *more)
            self.assertLess(report["measured"]["error"]["nrmse"], 1.05 * report["plan"]["predicted"]["error"])

    def test_coarser_levels_err_more(self):
        errors = [self.through(self.corner, level, 2**level, "--mode", "mip")["measured"]["error"]["nrmse"] for level in (1, 2, 3)]
        self.assertEqual(errors, sorted(errors))

    def test_levels_are_taken_only_where_an_error_is_allowed(self):
        names = lambda report: [step["transition"] for step in report["plan"]["steps"]]
        default = self.report(MR, "--mode", "xray", "--turntable", "36", "--size", "64")
        self.assertNotIn("store.reduce", names(default))
        # What is left of the paths is slower: a level pays at once.
        forced = ["--without", "project.shear_warp", "--without", "spectrum", "--without", "warp"]
        many = self.report(MR, "--mode", "xray", "--turntable", "36", "--max-error", "0.1", *forced)
        self.assertLess(many["plan"]["predicted"]["error"], 0.1)

    def test_more_threads_change_no_byte(self):
        pictures = []
        for threads in ("1", "2", "7"):
            out = self.folder / f"level_{threads}.nrrd"
            self.run_it("render", CT, "--rotate", "10,70,0", "--via", "store.reduce/level=2", "--threads", threads, "-o", out)
            pictures.append(out.read_bytes())
        self.assertEqual(pictures[0], pictures[1])
        self.assertEqual(pictures[0], pictures[2])

    def test_light_and_colour_keep_their_brightness(self):
        """A classified volume at half resolution is about as bright as at full."""
        means = []
        for via in (["shade.classify"], ["shade.classify", "store.reduce_colored"]):
            out = self.folder / "classified.nrrd"
            self.run_it("render", CT, "--mode", "composite", "--preset", "ct-bone", *[w for v in via for w in ("--via", v)], "-o", out)
            data = out.read_bytes()
            means.append(np.frombuffer(data[data.index(b"\n\n") + 2:], "<f4").mean())
        self.assertAlmostEqual(means[1] / means[0], 1, delta=0.05)


if __name__ == "__main__":
    unittest.main()
