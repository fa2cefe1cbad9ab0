"""`--explain` and what it says of linear interpolation: the numbers that are compared are of one kind, and the words fit them.
Needs EDGEWISE."""
import re
import sys
import pathlib
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import files  # noqa: E402
from running import Running  # noqa: E402

NUMBER = r"([\d.e+-]+)(?: \([-\d.]+ dB\))?"
LINE = re.compile(rf"^linear on these data: error {NUMBER} by (\S+); of the plan {NUMBER}, (.*)$", re.M)
ROUNDED = 1.01  # numbers are told to three digits: at most half a percent each


class ExplainLikely(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        random = np.random.default_rng(8)
        z, y, x = np.mgrid[0:24, 0:28, 0:32]
        ball = 200 * (np.hypot(np.hypot(x - 16, y - 14), z - 12) < 9)
        waves = 100 * (1 + np.sin(x / 1.7) * np.cos(y / 2.3 + z / 3))
        cls.inputs = []
        for name, samples, spacing in (("ball", ball.astype("u1"), (1, 1, 1)), ("noise", random.normal(size=(20, 22, 26)).astype("<f4"), (1, 1, 1)),
                                       ("waves", waves.astype("<i2"), (0.7, 0.7, 2.5))):
            cls.inputs.append(cls.folder / f"{name}.nii")
            files.write_nifti(cls.inputs[-1], samples, spacing=spacing)

    def explained(self, *words):
        return self.run_it("plan", *words, "--explain").stdout.decode()

    def check(self, *words):
        """@return what is said of the plan, or nothing where no comparison was needed"""
        text = self.explained(*words)
        found = LINE.search(text)
        self.assertNotIn("is as good\n", text)
        if not found:
            self.assertNotIn("linear on these data", text, words)
            return None
        linear, plain, own, verdict = float(found[1]), found[2], float(found[3]), found[4]
        self.assertIn("that is likely; errors of steps and paths below are upper estimates", text)
        if verdict.startswith("as good: at most "):
            times = float(re.match(r"as good: at most ([\d.]+) times that$", verdict)[1])
            self.assertEqual(times, 1.05)
            self.assertLessEqual(own, times * linear * ROUNDED, text)
        elif verdict.startswith("less accurate"):
            self.assertGreater(own * ROUNDED, 1.05 * linear, text)
            self.assertIn("no path that may be taken is as good", verdict)
        else:
            self.assertEqual(verdict, "by no filter or step of linear")
        # Paths that are less accurate say by how much, in the same kind of number.
        for why in re.findall(r"\[less accurate than linear([^\]]*)\]", text):
            likely = re.fullmatch(r": likely ([\d.e+-]+)", why)
            self.assertTrue(likely, why)
            self.assertGreater(float(likely[1]) * ROUNDED, 1.05 * linear, text)
        # The row of the plain path, where it is no plan: alike.
        for row in text.splitlines():
            if f"  {plain}  [" in row:
                self.assertNotIn("less accurate", row)
        return verdict

    def test_no_default_plan_contradicts_itself(self):
        said = set()
        for file in self.inputs:
            for words in (("--mode", "mip"), ("--mode", "xray", "--rotate", "20,30,10"), ("--mode", "composite", "--rotate", "10,50,0"),
                          ("--mode", "shaded"), ("--mode", "mean"), ("--mode", "surface", "--isovalue", "0.5")):
                said.add(self.check("render", file, "--size", "40", *words))
            said.add(self.check("warp", file, "--rotate", "12,33,-21"))
            said.add(self.check("warp", file, "--scale", "1.3"))
        self.assertIn("as good: at most 1.05 times that", said)

    def test_what_is_not_as_good_is_not_called_so(self):
        for file in self.inputs:
            for via in ("filter=zoh/step=1", "filter=foh/step=2"):
                self.assertIn(self.check("render", file, "--size", "40", "--rotate", "10,20,30", "--via", f"project.ray_cast/{via}"),
                              ("by no filter or step of linear", None))

    def test_a_budget_of_its_own_is_no_comparison(self):
        for file in self.inputs:
            self.assertNotIn("linear on these data", self.explained("render", file, "--size", "40", "--max-error", "0.05"))


if __name__ == "__main__":
    unittest.main()
