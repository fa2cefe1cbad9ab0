"""First hits that a cast steps over are rarer than the pixels that a preview draws: their error is predicted all the same."""

import math
import pathlib

from driving import DATA, Driven, main


class FirstHits(Driven):
    def predicted_and_measured(self, file, level, side, cast):
        done = self.report("render", pathlib.Path(DATA) / file, "-o", "null:", "--mode", "surface", "--isovalue", level, "--rotate", "20,30,0", "--size",
                           f"{side}x{side}", "--max-error", "9", "--via", f"project.ray_cast/{cast}", "--verify=all")
        return done["plan"]["predicted"]["error"], done["measured"]["error"]["nrmse"]

    def test_promises(self):
        for file, level, side in (("engine/engine.nii.gz", 90, 128), ("engine/engine.nii.gz", 90, 256), ("mr_brain/MR.nii.gz", 60, 192)):
            predicted, measured = self.predicted_and_measured(file, level, side, "filter=bspline3/step=1")
            with self.subTest(file=file, side=side, predicted=predicted, measured=measured):
                self.assertGreater(measured, 1e-3, "nothing is stepped over: the test shows nothing")
                self.assertLess(measured, predicted)
                # Some 512 rays are drawn, so fewer jumps than 3 in 512 are not told from none (95 %). A ray that jumps shows another
                # part of the surface; light from 0 to 1 has a standard deviation of at most 0.25, and two such differ by sqrt(2) of it.
                untold = math.sqrt(3 / 512 * 2 * 0.25**2)
                self.assertLess(predicted, 3 * measured + untold)

    def test_finer_steps_step_over_less(self):
        last = 1
        for step in ("1", "0.5", "0.25"):
            predicted, measured = self.predicted_and_measured("engine/engine.nii.gz", 90, 128, f"filter=bspline3/step={step}")
            self.assertLess(measured, 3 * predicted)
            self.assertLess(predicted, last)
            last = predicted


if __name__ == "__main__":
    main()
