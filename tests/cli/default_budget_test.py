"""The default budget: as good as linear interpolation makes it, by the fastest path that is; and what a run says of itself."""
import json
import os
import pathlib
import re
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from running import Running  # noqa: E402

REQUESTS = [["render", name, "--mode", mode, "--rotate", angles, "--size", "48x48"]
            for name in ("phantom:gaussians:40", "phantom:marschner-lobb:32")
            for mode in ("mip", "xray", "composite") for angles in ("0,0,0", "20,-30,10", "3,170,2")]
REQUESTS += [["warp", name, "--rotate", angle] for name, angle in
             (("phantom:gaussians:24", "10,20,30"), ("phantom:zone-plate:64", "20"), ("phantom:noise:24", "0,0,90"))]
PLAIN = {"render": "project.ray_cast/filter=foh/step=1", "warp": "warp.backward/filter=foh"}


class DefaultBudget(Running):
    def report(self, *words, code=0, env=None):
        return json.loads(self.run_it(*words, "--json", "-", "--quiet", code=code, env=env).stdout)

    def steps(self, report):
        return [step["transition"] + "".join(f"/{k}={v}" for k, v in step["parameters"].items())
                for step in report["plan"]["steps"]]

    def test_no_default_result_is_of_nearest_samples(self):
        for request in REQUESTS:
            with self.subTest(request=request):
                report = self.report(*request, "-o", "null:")
                for step in report["plan"]["steps"]:
                    self.assertNotIn(step["parameters"].get("filter"), ("zoh", "me"))
                self.assertFalse([text for text in report["warnings"] if "as good as" in text])
                budget = report["request"]["budget"]
                self.assertEqual((budget["error"], budget["default"]), (None, "linear"))
                # Nobody asked for errors.
                self.assertIsNone(report["plan"]["predicted"]["error"])
                self.assertIsNone(report["plan"]["steps"][-1]["predicted"]["error"])
                self.assertTrue(all(plan["predicted"]["error"] is None for plan in report["front"]))

    def test_the_plan_is_the_same_whoever_asks(self):
        for request in REQUESTS:
            with self.subTest(request=request):
                steps = self.steps(self.report(*request, "-o", "null:"))  # perhaps without a look at the data
                for more in (["--verify"], ["--threads", "1"], ["--threads", "5"]):
                    self.assertEqual(self.steps(self.report(*request, "-o", "null:", *more)), steps, more)
                planned = self.report("plan", *request)
                self.assertEqual(self.steps(planned), steps)
                self.assertGreaterEqual(planned["plan"]["predicted"]["error"], 0)

    def test_results_are_as_accurate_as_linear_ones(self):
        # All samples are compared. The preview draws nearly all of so few pixels, so that what is allowed beyond 1.05 is
        # the chance of the draws that are left; a warp draws no more than 2048 points of 13824, whose errors scatter by
        # sqrt(2 / 2048) about the mean square: 0.05 is three standard deviations of the ratio of roots.
        for request in REQUESTS:
            with self.subTest(request=request):
                ours = self.report(*request, "-o", "null:", "--verify=all")["measured"]["error"]["nrmse"]
                plain = self.report(*request, "-o", "null:", "--verify=all", "--max-error", "9",
                                    "--via", PLAIN[request[0]])["measured"]["error"]["nrmse"]
                self.assertLessEqual(ours, 1.10 * plain + 1e-6)

    def test_the_explanation_says_how_inaccurate_linear_is(self):
        table = self.run_it("plan", *REQUESTS[1]).stdout.decode()
        said = re.search(r"linear on these data: error ([0-9.e-]+) \(.* dB\) by " + re.escape(PLAIN["render"]), table)
        self.assertTrue(said, table)
        true = self.report(*REQUESTS[1], "-o", "null:", "--verify=all", "--max-error", "9",
                           "--via", PLAIN["render"])["measured"]["error"]["nrmse"]
        self.assertLess(abs(float(said[1]) / true - 1), 0.25)  # a draw
        self.assertIn("budget: as good as linear (default)", table)
        self.assertIn("foh is linear interpolation", table)

    def test_labels_default_to_the_nearest_sample(self):
        file = self.folder / "labels.raw"
        np.random.default_rng(4).integers(0, 5, (12, 12, 12)).astype("u1").tofile(file)
        request = ["warp", f"raw:{file}:12x12x12:u8", "--reference", "nearest", "--rotate", "10,20,30"]
        out = self.folder / "labels.nrrd"
        report = self.report(*request, "-o", out)
        self.assertEqual(report["request"]["budget"]["default"], "linear")
        self.assertEqual(self.steps(report)[-1], "warp.backward/filter=zoh")
        self.assertIn(b", no new value\n", self.run_it(*request, "-o", out).stderr)

    def test_it_is_a_wish(self):
        done = self.run_it("render", "phantom:gaussians:24", "-o", "null:", "--rotate", "10,20,30",
                           "--via", "project.ray_cast/filter=zoh/step=2")
        self.assertIn(b"as good as linear", done.stderr)
        # With a time there is no default, but it can be typed.
        report = self.report("plan", "render", "phantom:gaussians:24", "--max-time", "10s")
        self.assertIsNone(report["request"]["budget"]["default"])
        report = self.report("plan", "render", "phantom:gaussians:24", "--max-time", "10s", "--max-error", "linear")
        self.assertEqual(report["request"]["budget"]["default"], "linear")

    def test_planning_is_the_sum_of_its_parts(self):
        for words in (["render", "phantom:noise:32", "-o", "null:"], ["plan", "warp", "phantom:noise:32", "--rotate", "1,2,3"]):
            planning = self.report(*words)["planning"]
            self.assertAlmostEqual(planning["seconds"], sum(planning["parts"].values()), delta=1e-9)
            self.assertGreater(planning["parts"]["search"], 0)
            self.assertGreater(planning["startup_seconds"], 0)
            self.assertLess(planning["startup_seconds"], 5)


class WhatARunSays(Running):
    def test_one_line_says_what_came_out(self):
        out = self.folder / "a.png"
        request = ["render", "phantom:gaussians:24", "-o", out, "--rotate", "10,20,30", "--size", "30x20"]
        lines = self.run_it(*request).stderr.decode().splitlines()
        self.assertEqual(len(lines), 1, lines)
        self.assertRegex(lines[0], rf"^edgewise: {re.escape(str(out))}, 30x20, .*(project|spectrum)\..*, "
                                   r"[0-9.]+ (us|ms|s), as good as linear$")
        self.assertRegex(self.run_it(*request, "--max-error", "0.2").stderr.decode(), r", error [0-9.e-]+ .*predicted\n$")
        self.assertRegex(self.run_it(*request, "--verify", "--max-error", "0.2").stderr.decode(),
                         r", error [0-9.e-]+ .*measured\n$")
        frames = self.run_it("render", "phantom:gaussians:24", "-o", self.folder / "f%d.png", "--turntable", "3").stderr
        self.assertIn(b"f0.png to ", frames)
        self.assertIn(b", 3 of ", frames)

    def test_quiet_says_nothing(self):
        done = self.run_it("render", "phantom:gaussians:24", "-o", self.folder / "q.png", "--quiet")
        self.assertEqual(done.stderr + done.stdout, b"")

    def test_guessed_times_are_said_where_times_matter(self):
        request = ["render", "phantom:gaussians:24", "-o", "null:"]
        self.assertNotIn(b"calibrate", self.run_it(*request).stderr)
        self.assertEqual(self.run_it(*request, "--max-time", "10s").stderr.count(b"edgewise calibrate"), 1)
        self.assertEqual(self.run_it(*request, "--max-time", "10s", "--quiet").stderr, b"")
        self.assertIn(b"`edgewise calibrate`", self.run_it(*request, "--explain").stdout)

    def test_a_machine_of_many_processors_says_for_how_many_a_plan_was_chosen(self):
        machine = self.folder / "many.json"
        # What does not speed up decides there, the rest here.
        machine.write_text(json.dumps({"schema": 1, "name": "many", "processors": 4096, "serial": 0.001, "start": 1e-4}))
        request = ["plan", "render", "phantom:gaussians:48", "--rotate", "10,20,30", "--max-error", "0.2",
                   "--machine", machine, "--threads", "2"]
        table = self.run_it(*request).stdout.decode()
        self.assertIn("chosen for the 4096 processors of machine many", table)
        units = {"us": 1e-6, "ms": 1e-3, "s": 1}
        rows = [(mark, float(number) * units[unit], line) for mark, number, unit, line in
                re.findall(r"^([>* ]) +([0-9.]+) (us|ms|s) +(.*)$", table.split("paths (")[1], re.M)]
        (chosen,) = [seconds for mark, seconds, _ in rows if mark == ">"]
        for mark, seconds, line in rows:
            if mark != ">" and seconds < chosen:
                self.assertNotIn("[no better]", line)

    def test_long_planning_is_said(self):
        request = ["render", "phantom:gaussians:96", "-o", "null:", "--max-error", "0.2", "--planner", "exhaustive",
                   "--planning-time", "4s"]
        self.assertIn(b"planning ...", self.run_it(*request).stderr)


if __name__ == "__main__":
    unittest.main()
