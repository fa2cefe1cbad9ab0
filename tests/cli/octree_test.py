"""Octrees and leaps over bricks: pictures are those of ray casting, but for what an octree tolerates, and errors are as predicted. No plan
takes them unasked. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import unittest

from running import DATA, Running, corner_of_mr_head

CT, MR = DATA / "ct_head/quarter.nhdr", DATA / "mr_brain/MR.nii.gz"
MODES = ["mip", "minip", "xray", "mean", "composite"]


class Octrees(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.corner = corner_of_mr_head(cls.folder)

    def report(self, *arguments):
        return json.loads(self.run_it("render", *arguments, "--json", "-", "-o", "null:").stdout)

    def through(self, head, tolerance, *more):
        return self.report(head, "--rotate", "20,30,0", "--size", "160", "--via", f"store.octree/tolerance={tolerance}",
                           "--max-error", "90", "--verify", *more)

    def test_errors_are_no_larger_than_predicted(self):
        for head in [CT, self.corner]:
            for mode in MODES:
                for tolerance in [0, 0.01]:
                    with self.subTest(head=head, mode=mode, tolerance=tolerance):
                        report = self.through(head, tolerance, "--mode", mode)
                        predicted, measured = report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"]
                        self.assertLess(measured, 1.05 * predicted)

    def test_pictures_are_those_of_ray_casting(self):
        for mode in ["mip", "minip", "composite"]:
            pictures = []
            for name, via in [("rays", ["project.ray_cast/filter=foh/step=1"]), ("leaps", ["project.distance_cast"]),
                              ("bricks", ["project.distance_cast/leap=1"]), ("octree", ["store.octree/tolerance=0"])]:
                out = self.folder / f"{mode}_{name}.nrrd"
                self.run_it("render", self.corner, "--rotate", "20,30,0", "--size", "160", "--mode", mode, "--max-error", "9",
                            "--without", "store.crop", "-o", out, *[word for edge in via for word in ("--via", edge)])
                pictures.append(out.read_bytes())
            self.assertEqual(pictures[0], pictures[1])
            self.assertEqual(pictures[0], pictures[2])
            if mode != "composite":
                self.assertEqual(pictures[0], pictures[3])

    def test_no_plan_takes_them_unasked(self):
        report = self.report(MR, "--mode", "mip", "--max-error", "0.5")
        names = [step["transition"] for step in report["plan"]["steps"]]
        for name in ["store.octree", "project.octree_cast", "project.distance_cast"]:
            self.assertNotIn(name, names)

    def test_more_threads_change_no_byte(self):
        pictures = []
        for threads in ("1", "2", "7"):
            out = self.folder / f"octree_{threads}.nrrd"
            self.run_it("render", CT, "--rotate", "10,70,0", "--mode", "xray", "--via", "store.octree/tolerance=0.02",
                        "--max-error", "90", "--threads", threads, "-o", out)
            pictures.append(out.read_bytes())
        self.assertEqual(pictures[0], pictures[1])
        self.assertEqual(pictures[0], pictures[2])


if __name__ == "__main__":
    unittest.main()
