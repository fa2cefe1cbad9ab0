"""`edgewise chart filter` and `edgewise advise filter`. Needs EDGEWISE."""

import json
import unittest

from running import Running

REQUEST = ["filter", "phantom:gaussians:20", "--op", "dilate", "--kernel", "sphere:2"]


class FilterChart(Running):
    def chart(self, *words, code=0):
        out = self.folder / "c.json"
        out.unlink(missing_ok=True)
        done = self.run_it("chart", *words, "-o", out, "--quiet", code=code)
        return done.stderr.decode() if code else json.loads(out.read_text())

    def test_every_path_is_run(self):
        report = self.chart(*REQUEST, "--repeat", "1")
        self.assertEqual(report["request"]["job"], "filter")
        points = report["points"]
        direct = [point for point in points if len(point["steps"]) == 1]
        self.assertGreaterEqual(len(direct), 3)  # backward, forward, by runs
        for point in direct:
            self.assertEqual(point["measured"]["error"]["max"], 0, point["steps"])
            self.assertEqual(point["predicted"]["error"], 0)
            self.assertGreater(point["measured"]["median"], 0)
        for point in points:
            self.assertEqual(point["measured"]["error"]["samples"], 20**3)
        self.assertEqual(sum(point["chosen"] for point in points), 1)

    def test_errors_are_those_of_a_run(self):
        words = ["filter", "phantom:gaussians:20", "--op", "convolve", "--kernel", "gauss:1.5"]
        for point in self.chart(*words, "--repeat", "1", "--verify=all")["points"]:
            if len(point["steps"]) > 1:
                continue
            done = self.run_it(*words, "-o", "null:", "--via", point["steps"][0], "--max-error", "1", "--verify=all", "--json", "-", "--quiet")
            error = json.loads(done.stdout)["measured"]["error"]
            self.assertEqual(point["measured"]["error"]["nrmse"], error["nrmse"], point["steps"])

    def test_a_page_and_a_table(self):
        outs = [self.folder / f"d.{end}" for end in ("html", "csv")]
        self.run_it("chart", *REQUEST, "--repeat", "1", "--quiet", *[word for out in outs for word in ("-o", out)])
        for out in outs:
            self.assertIn("filter.runs", out.read_text())

    def test_budgets_and_threads_are_swept(self):
        report = self.chart(*REQUEST, "--repeat", "1", "--sweep", "threads=1:2:1")
        self.assertEqual({point["at"] for point in report["points"]}, {1, 2})

    def test_what_a_filter_does_not_have_is_refused(self):
        self.assertIn("filter has no such option", self.chart(*REQUEST, "--sweep", "rotate.z=0:10:5", code=2))
        self.assertIn("--op", self.chart("filter", "phantom:gaussians:20", code=2))
        self.assertIn("--kernel", self.chart("filter", "phantom:gaussians:20", "--op", "erode", code=2))
        self.assertFalse((self.folder / "c.json").exists())

    def test_advice(self):
        report = json.loads(self.run_it("advise", *REQUEST, "--border", "wrap", "--json", "-").stdout)
        (request,) = report["requests"]
        self.assertEqual(request["request"], "filter phantom:gaussians:20 --op dilate --kernel sphere:2 --border wrap")
        self.assertGreater(request["seconds"], request["bound"])
        self.assertTrue(any("object/filtered" in arc["to"] for arc in report["missing_arcs"]))
        text = self.run_it("advise", *REQUEST).stdout.decode()
        for words in ("costs worth measuring", "missing edges", "times the bound"):
            self.assertIn(words, text)
        self.run_it("advise", "filter", "phantom:gaussians:20", code=2)


if __name__ == "__main__":
    unittest.main()
