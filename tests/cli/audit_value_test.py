"""`edgewise audit` and what choosing is worth: the plain path of each request, beside planning and the chosen path. What its numbers must agree
with; none of them is a time that is judged. Needs EDGEWISE."""
import json
import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from running import Running  # noqa: E402

REQUESTS = [  # and the plain path of each
    (["render", "phantom:gaussians:24", "--mode", "mip", "--rotate", "10,5,0", "--size", "40x30"], "project.ray_cast/filter=foh/step=1"),
    (["render", "phantom:noise:24", "--mode", "xray", "--rotate", "20,30,0", "--size", "native", "--max-error", "0.05"], "project.ray_cast/filter=foh/step=1"),
    (["render", "phantom:sphere:20", "--mode", "mip", "--turntable", "5", "--size", "30x30"], "project.ray_cast/filter=foh/step=1"),
    (["render", "phantom:gaussians:20", "--mode", "mean", "--size", "30x30", "--max-time", "1s"], "project.ray_cast/filter=foh/step=1"),
    (["warp", "phantom:zone-plate:64", "--rotate", "20"], "warp.backward/filter=foh"),
    (["warp", "phantom:sphere:20", "--rotate", "10,20,30", "--max-error", "0.2"], "warp.backward/filter=foh"),
    (["filter", "phantom:sphere:20", "--op", "convolve", "--kernel", "gauss:1"], None),
]


class Value(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.report = cls.audit([{"args": args, "held_out": at < 2} for at, (args, _) in enumerate(REQUESTS)], "--repeat", "2")

    @classmethod
    def audit(cls, requests, *words):
        asked, out = cls.folder / "requests.json", cls.folder / "audit.json"
        asked.write_text(json.dumps({"requests": requests}))
        cls.run_it(cls(), "audit", asked, "-o", out, "--quiet", *words)
        return json.loads(out.read_text())

    def test_the_plain_path_is_what_linear_compares_with_whatever_the_budget(self):
        for entry, (_, plain) in zip(self.report["requests"], REQUESTS):
            self.assertEqual(entry["plain"] and entry["plain"]["steps"], plain and [plain], entry["args"])

    def test_it_is_run_as_often_as_the_chosen_one(self):
        for entry, (_, plain) in zip(self.report["requests"], REQUESTS):
            if plain:
                self.assertGreaterEqual(entry["plain"]["measured"]["runs"], 2)
                self.assertEqual(entry["plain_seconds"], entry["plain"]["measured"]["seconds"])
                self.assertGreaterEqual(entry["plain_seconds"], entry["plain"]["measured"]["least"])

    def test_value_is_plain_over_choosing_and_chosen(self):
        for entry, (_, plain) in zip(self.report["requests"], REQUESTS):
            self.assertGreaterEqual(entry["shared_seconds"], 0)
            self.assertGreaterEqual(entry["planning_seconds"], entry["shared_seconds"])
            if plain:
                paid = entry["planning_seconds"] - entry["shared_seconds"] + entry["chosen"]["measured"]["seconds"]
                self.assertAlmostEqual(entry["value"], entry["plain_seconds"] / paid, delta=1e-9 * entry["value"])
            else:
                self.assertEqual((entry["value"], entry["plain_seconds"]), (None, None))

    def test_where_it_is_chosen_both_are_one_path(self):
        for entry in self.report["requests"]:
            if entry["plain"] and entry["chosen"]["steps"] == entry["plain"]["steps"]:
                self.assertEqual(entry["plain"]["measured"], entry["chosen"]["measured"])

    def test_the_paths_that_are_judged_are_the_same_as_without_it(self):
        for entry in self.report["requests"]:
            self.assertEqual(entry["paths"], len(entry["measured_paths"]))
            steps = [tuple(path["steps"]) for path in entry["measured_paths"]]
            self.assertEqual(len(set(steps)), len(steps))

    def test_beyond_a_limit_it_is_run_by_itself(self):
        entry, = self.audit([{"args": REQUESTS[0][0] + ["--without", "project.ray_cast"]}], "--limit", "1", "--repeat", "2")["requests"]
        self.assertEqual(len(entry["measured_paths"]), 1)
        self.assertEqual(entry["plain"]["steps"], ["project.ray_cast/filter=foh/step=1"])
        self.assertGreater(entry["value"], 0)

    def test_the_summary_has_the_mean_of_those_that_have_one(self):
        for summary, entries in ((self.report["summary"], self.report["requests"]), (self.report["summary"]["held_out"], self.report["requests"][:2])):
            values = [entry["value"] for entry in entries if entry["value"] is not None]
            self.assertEqual(summary["value_requests"], len(values))
            self.assertAlmostEqual(summary["value_geomean"], math.exp(sum(map(math.log, values)) / len(values)), delta=1e-9)
            self.assertEqual(summary["value_least"], min(values))

    def test_without_any_the_summary_says_so(self):
        summary = self.audit([{"args": REQUESTS[-1][0]}], "--repeat", "1")["summary"]
        self.assertEqual((summary["value_requests"], summary["value_geomean"], summary["value_least"]), (0, None, None))


if __name__ == "__main__":
    unittest.main()
