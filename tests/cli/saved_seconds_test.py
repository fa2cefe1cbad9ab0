"""`plan.plain` and `planning.saved_seconds`: which path a plan is compared with, and what it is expected to save. They agree with the plan of
that path itself. Needs EDGEWISE."""
import json
import pathlib
import re
import struct
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import files  # noqa: E402
import merge_test  # noqa: E402
from running import Running  # noqa: E402


def step_of(step):
    values = {key: f"{value:g}" if isinstance(value, float) else value for key, value in step["parameters"].items()}
    return step["transition"] + "".join(f"/{key}={value}" for key, value in values.items())


class SavedSeconds(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        random = np.random.default_rng(5)
        z, y, x = np.mgrid[0:40, 0:44, 0:52]
        ball = 200 * (np.hypot(np.hypot(x - 26, y - 22), z - 20) < 15)
        waves = 100 * (1 + np.sin(x / 1.7) * np.cos(y / 2.3 + z / 3))
        cls.inputs = {}
        for name, samples, spacing in (("ball", ball.astype("u1"), (1, 1, 1)), ("noise", random.normal(size=(30, 37, 26)).astype("<f4"), (1, 1, 1)),
                                       ("waves", waves.astype("<i2"), (0.7, 0.7, 2.5))):
            cls.inputs[name] = cls.folder / f"{name}.nii"
            files.write_nifti(cls.inputs[name], samples, spacing=spacing)

    def planned(self, verb, *words):
        return json.loads(self.run_it("plan", verb, *words, "--json", "-", "--quiet").stdout)

    def check(self, verb, file, *words):
        """@return the report of a plan that agrees with the plan of its plain path"""
        report = self.planned(verb, file, *words)
        plain, saved = report["plan"]["plain"], report["planning"]["saved_seconds"]
        other = self.planned(verb, file, *words, "--via", plain, "--without", "store", "--without", "shade")
        self.assertEqual(list(map(step_of, other["plan"]["steps"])), [plain], words)
        self.assertEqual(other["plan"]["plain"], plain)
        self.assertAlmostEqual(other["planning"]["saved_seconds"], 0, delta=1e-12)
        mine, its = report["plan"]["predicted"]["seconds"], other["plan"]["predicted"]["seconds"]
        # Facts of a look may be those that an edge was asked for.
        self.assertAlmostEqual(saved, its - mine, delta=0.02 * its, msg=f"{words}")
        return report

    def test_the_plain_path_is_named_and_priced_as_its_own_plan_is(self):
        asked = (("--mode", "mip", "--size", "40"), ("--mode", "xray", "--size", "64", "--rotate", "20,30,10"), ("--mode", "composite", "--size", "40"),
                 ("--mode", "shaded", "--size", "40"), ("--mode", "mean", "--turntable", "24", "--size", "32"), ("--mode", "mip", "--size", "300", "--threads", "1"))
        for number, file in enumerate(self.inputs.values()):
            for words in asked[number::3]:
                self.assertRegex(self.check("render", file, *words)["plan"]["plain"], r"^project\.ray_cast/filter=foh/step=[\d.]+$")
            self.assertEqual(self.check("warp", file, "--rotate", "12,33,-21")["plan"]["plain"], "warp.backward/filter=foh")

    def test_of_labels_the_nearest_sample_is_plain(self):
        self.assertEqual(self.check("warp", self.inputs["ball"], "--rotate", "5,6,7", "--labels")["plan"]["plain"], "warp.backward/filter=zoh")

    def test_a_run_tells_the_same_although_nobody_looks_at_errors(self):
        for file in self.inputs.values():
            report = json.loads(self.run_it("render", file, "--mode", "mip", "--size", "40", "-o", "null:", "--json", "-", "--quiet").stdout)
            self.assertIsNone(report["plan"]["predicted"]["error"])
            self.assertEqual(report["plan"]["plain"], self.planned("render", file, "--mode", "mip", "--size", "40")["plan"]["plain"])
            self.assertIsInstance(report["planning"]["saved_seconds"], float)

    def test_runs_count_each(self):
        for file, words in zip(self.inputs.values(), (["--via", "project.ray_cast/filter=foh/step=2"], ["--via", "project.shear_warp"],
                                                       ["--via", "project.ray_cast/filter=keys/step=1"])):
            once = self.planned("render", file, "--mode", "mip", "--size", "40", *words)
            seven = self.planned("render", file, "--mode", "mip", "--size", "40", *words, "--repeat", "7")
            self.assertEqual(once["plan"]["steps"], seven["plan"]["steps"])
            self.assertNotEqual(once["planning"]["saved_seconds"], 0)
            self.assertAlmostEqual(seven["planning"]["saved_seconds"], 7 * once["planning"]["saved_seconds"], delta=1e-12)

    def test_null_where_nothing_is_compared_with(self):
        ball = self.inputs["ball"]
        for words in (("render", ball, "--mode", "mip", "--size", "40", "--max-error", "0.05"), ("warp", ball, "--rotate", "1,2,3", "--max-error", "0.1"),
                      ("filter", ball, "--op", "convolve", "--kernel", "gauss:1")):
            report = self.planned(*words)
            self.assertIsNone(report["plan"]["plain"], words)
            self.assertIsNone(report["planning"]["saved_seconds"], words)

    def test_without_a_plan_nothing_is_saved(self):
        done = self.run_it("plan", "warp", self.inputs["ball"], "--rotate", "1,2,3", "--max-memory", "20MiB", "--via", "warp.backward/filter=foh",
                           "--without", "warp", "--json", "-", "--quiet", code=3)
        report = json.loads(done.stdout)
        self.assertIsNone(report["plan"])
        self.assertIsNone((report["planning"] or {}).get("saved_seconds"))

    def test_explain_says_it_in_a_sentence(self):
        for file in self.inputs.values():
            for words in ((), ("--via", "project.ray_cast/filter=keys/step=1"), ("--via", "project.ray_cast/filter=foh/step=1", "--without", "store")):
                asked = ("render", file, "--mode", "mip", "--size", "60", "--rotate", "10,20,30", *words)
                saved = self.planned(*asked)["planning"]["saved_seconds"]
                text = self.run_it("plan", *asked, "--explain").stdout.decode()
                found = re.search(r"^choosing took [\d.]+ \w+; the plan is (.*)$", text, re.M)
                self.assertTrue(found, text)
                plain = "project.ray_cast/filter=foh/step=1"
                if saved == 0:
                    self.assertEqual(found[1], f"the plain path, {plain}")
                else:
                    said = "save [^ ]+ [^ ]+ against" if saved > 0 else "take [^ ]+ [^ ]+ more than"
                    self.assertRegex(found[1], f"^expected to {said} the plain path, {re.escape(plain)}$")
        text = self.run_it("plan", "render", self.inputs["ball"], "--mode", "mip", "--size", "60", "--max-error", "0.1", "--explain").stdout.decode()
        self.assertNotIn("choosing took", text)

    def test_a_pilot_tells_both_as_measured(self):
        report = json.loads(self.run_it("render", self.inputs["noise"], "--mode", "mip", "--size", "40", "--planner", "pilot", "--planning-time", "0.5s",
                                        "-o", "null:", "--json", "-", "--quiet").stdout)
        self.assertRegex(report["plan"]["plain"], "^project.ray_cast/filter=foh")
        self.assertIsInstance(report["planning"]["saved_seconds"], float)


class Several(Running):
    """Channels that are merged, and time points."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        random = np.random.default_rng(6)
        cls.series = cls.folder / "times.nii"
        files.write_nifti(cls.series, random.integers(0, 200, (3 * 16, 18, 20)).astype("u1"))
        head = bytearray(cls.series.read_bytes())
        struct.pack_into("<8h", head, 40, 4, 20, 18, 16, 3, 1, 1, 1)
        cls.series.write_bytes(bytes(head))
        cls.cells = cls.folder / "cells.tif"
        cls.cells.write_bytes(merge_test.imagej(merge_test.balls()))

    def test_time_points_count_each(self):
        words = ("render", self.series, "--mode", "mip", "--size", "30", "-o")
        one = json.loads(self.run_it(*words, "null:", "--time", "0", "--json", "-", "--quiet").stdout)
        all_of_them = json.loads(self.run_it(*words, self.folder / "t%d.png", "--time", "all", "--json", "-", "--quiet").stdout)
        self.assertEqual(one["plan"]["plain"], all_of_them["plan"]["plain"])
        if [s["transition"] for s in one["plan"]["steps"]] == [s["transition"] for s in all_of_them["plan"]["steps"]]:
            self.assertAlmostEqual(all_of_them["planning"]["saved_seconds"], 3 * one["planning"]["saved_seconds"], delta=1e-9)

    def test_channels_add_up(self):
        report = json.loads(self.run_it("plan", "render", self.cells, "--channel", "0,2", "--rotate", "10,20,0", "--size", "45x32", "--json", "-",
                                        "--quiet").stdout)
        each = report["channels"]
        self.assertEqual(len(each), 2)
        self.assertAlmostEqual(report["planning"]["saved_seconds"], sum(one["planning"]["saved_seconds"] for one in each), delta=1e-12)
        self.assertEqual({one["plan"]["plain"] for one in each}, {report["plan"]["plain"]})
        limited = json.loads(self.run_it("plan", "render", self.cells, "--channel", "0,2", "--rotate", "10,20,0", "--size", "45x32", "--max-error", "0.1",
                                         "--json", "-", "--quiet").stdout)
        self.assertIsNone(limited["planning"]["saved_seconds"])
        self.assertIsNone(limited["plan"]["plain"])


if __name__ == "__main__":
    unittest.main()
