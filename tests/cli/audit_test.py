"""`edgewise audit`: what its numbers must agree with, what it refuses, how it ends. Needs EDGEWISE."""

import json
import math
import os
import pathlib
import shutil
import signal
import statistics
import subprocess
import tempfile
import time
import unittest

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
REQUESTS = pathlib.Path(__file__).resolve().parents[2] / "benchmarks/audit_requests.json"

TINY = [
    ["render", "phantom:noise:24", "--mode", "xray", "--rotate", "20,30,0", "--size", "native", "--max-error", "0.05"],
    ["render", "phantom:gaussians:24", "--rotate", "10,5,0", "--size", "40x30", "--max-error", "0.1"],
    ["warp", "phantom:zone-plate:64", "--rotate", "20"],
    ["warp", "phantom:sphere:20", "--rotate", "10,20,30", "--max-error", "0.2", "--without", "store"],
]


class Audit(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, self.folder)
        self.env = {**os.environ, "XDG_CONFIG_HOME": str(self.folder / "config"),
                    "XDG_CACHE_HOME": str(self.folder / "cache")}
        self.requests, self.out = self.folder / "requests.json", self.folder / "audit.json"

    def write(self, requests):
        self.requests.write_text(json.dumps({"requests": requests}))

    def run_it(self, *words, code=0):
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=300, env=self.env)
        self.assertEqual(done.returncode, code, f"{words}: {done.stderr.decode(errors='replace')}")
        return done

    def audit(self, requests, *words, code=0):
        self.write(requests)
        self.run_it("audit", self.requests, "-o", self.out, "--quiet", *words, code=code)
        return json.loads(self.out.read_text())

    def paths_of_plan(self, args):
        """Path texts of `plan`'s table, which lists all there are when they are few."""
        words = self.run_it("plan", *args, "--quiet").stdout.decode().split("\npaths (")[1]
        count = int(words.split(";")[0].split(" ")[0])
        return count


class Report(Audit):
    @classmethod
    def setUpClass(cls):
        cls.report = None

    def tiny(self):
        if Report.report is None:
            Report.report = self.audit([{"args": args, "held_out": i % 2 == 0, "name": f"r{i}"}
                                        for i, args in enumerate(TINY)])
        return Report.report

    def test_every_path_there_is_was_run(self):
        for entry in self.tiny()["requests"]:
            self.assertEqual(entry["paths"], self.paths_of_plan(entry["args"]))
            paths = entry["measured_paths"]
            self.assertEqual(entry["paths"], len(paths))
            self.assertEqual(len({" ".join(path["steps"]) for path in paths}), len(paths))
            for path in paths:
                self.assertTrue(path.get("cancelled") or path["measured"]["seconds"] > 0, path)

    def test_demands_hold_for_every_path(self):
        for path in self.tiny()["requests"][3]["measured_paths"]:
            self.assertFalse([step for step in path["steps"] if step.startswith("store.")])

    def test_the_chosen_path_is_the_plan_and_is_run_to_the_end(self):
        for entry in self.tiny()["requests"]:
            plan = json.loads(self.run_it("plan", *entry["args"], "--json", "-", "--quiet").stdout)["plan"]
            chosen = [path for path in entry["measured_paths"] if path.get("chosen")]
            self.assertEqual(len(chosen), 1)
            self.assertEqual([step["transition"] for step in plan["steps"]],
                             [step.split("/")[0] for step in chosen[0]["steps"]])
            self.assertEqual(entry["chosen"]["steps"], chosen[0]["steps"])
            measured = chosen[0]["measured"]
            self.assertGreaterEqual(measured["runs"], 5)

    def undisturbed(self, seconds):
        """The 0.2 quantile, between two values by their distance."""
        ordered, at = sorted(seconds), 0.2 * (len(seconds) - 1)
        above = min(int(at) + 1, len(seconds) - 1)
        return ordered[int(at)] + (at - int(at)) * (ordered[above] - ordered[int(at)])

    def test_seconds_are_the_low_quantile_of_the_runs(self):
        for entry in self.tiny()["requests"]:
            for path in (entry["chosen"], entry["best"]):
                measured = path["measured"]
                self.assertEqual(len(measured["all_seconds"]), measured["runs"])
                self.assertAlmostEqual(measured["seconds"], self.undisturbed(measured["all_seconds"]), delta=1e-12)
                self.assertAlmostEqual(measured["least"], min(measured["all_seconds"]), delta=1e-12)

    def test_regret_is_that_of_the_fastest_path_within_the_budgets(self):
        for entry in self.tiny()["requests"]:
            budget = entry["budget"]["error"]
            chosen, paths = entry["chosen"], [p for p in entry["measured_paths"] if p["measured"]]
            within = [p for p in paths if p["as_good"]] if budget is None else [
                p for p in paths if p["measured"]["error"]["nrmse"] <= budget or
                (p.get("chosen") and p["measured"]["error"]["low"] <= budget)]
            if not within:
                least = min(paths, key=lambda p: p["measured"]["error"]["nrmse"])["measured"]["error"]["high"]
                within = [p for p in paths if p["measured"]["error"]["low"] <= least]
            fastest = min(p["measured"]["seconds"] for p in within)
            self.assertAlmostEqual(entry["regret"], chosen["measured"]["seconds"] / fastest, delta=1e-9)
            self.assertEqual(entry["best"]["measured"]["seconds"], fastest)
            if any(p.get("chosen") for p in within):
                self.assertGreaterEqual(entry["regret"], 1)
            self.assertAlmostEqual(entry["predicted_over_measured"],
                                   chosen["predicted"]["seconds"] / chosen["measured"]["seconds"], delta=1e-9)
            for path in paths:  # who might have won was run to the end
                if path in within and path["measured"]["least"] < 1.2 * fastest:
                    self.assertGreaterEqual(path["measured"]["runs"], 5)

    def test_errors_are_those_of_verify(self):
        entry = self.tiny()["requests"][0]
        path = min((p for p in entry["measured_paths"] if p["measured"]), key=lambda p: p["measured"]["error"]["nrmse"])
        words = [word for step in path["steps"] for word in ("--via", step)]
        words += [] if any(step.startswith("store.") for step in path["steps"]) else ["--without", "store"]
        report = json.loads(self.run_it(*entry["args"], *words, "--max-error", "1", "-o", "null:", "--json", "-",
                                        "--quiet", "--verify").stdout)
        self.assertEqual([s["transition"] for s in report["plan"]["steps"]],
                         [s.split("/")[0] for s in path["steps"]])
        for key in ("nrmse", "low", "high", "samples", "range"):
            self.assertEqual(report["measured"]["error"][key], path["measured"]["error"][key])

    def test_summary_agrees_with_the_requests(self):
        report = self.tiny()
        summary, entries = report["summary"], report["requests"]
        regrets = [entry["regret"] for entry in entries]
        ratios = [entry["predicted_over_measured"] for entry in entries]
        self.assertEqual(report["schema"], 1)
        self.assertEqual(summary["requests"], 4)
        self.assertEqual(summary["failed"], 0)
        self.assertAlmostEqual(summary["regret_median"], statistics.median(regrets))
        self.assertAlmostEqual(summary["regret_geomean"], math.exp(statistics.mean(map(math.log, regrets))))
        self.assertEqual(summary["regret_max"], max(regrets))
        self.assertAlmostEqual(summary["time_ratio_median"], statistics.median(ratios))
        self.assertEqual(summary["violations"],
                         sum(not (e["error_within_budget"] and e["bytes_within_budget"]) for e in entries))
        self.assertGreaterEqual(summary["fixed_path"]["regret_geomean"], 1)
        self.assertTrue(-1 <= summary["kendall_tau"] <= 1)
        self.assertEqual(summary["held_out"]["requests"], 2)
        self.assertEqual(summary["held_out"]["regret_max"], max(regrets[0], regrets[2]))

    def test_the_default_budget_is_no_demand(self):
        entry = self.tiny()["requests"][2]  # rings up to half a sample wide: linear samples err a lot
        self.assertEqual((entry["budget"]["default"], entry["budget"]["error"]), ("linear", None))
        self.assertGreater(entry["chosen"]["measured"]["error"]["nrmse"], 0.01)
        self.assertTrue(entry["error_within_budget"])
        self.assertNotIn("filter=zoh", " ".join(entry["chosen"]["steps"]))

    def test_memory_is_counted_as_predicted(self):
        for entry in self.tiny()["requests"]:
            measured, predicted = entry["chosen"]["measured"], entry["chosen"]["predicted"]
            self.assertLessEqual(predicted["bytes"], predicted["bytes_high"])
            self.assertLess(measured["bytes"], predicted["bytes_high"] * 1.05)
            self.assertGreater(measured["bytes"], predicted["bytes_high"] / 2)
            resident = measured["resident_bytes"]
            if resident is not None:  # what the system says is below what is reserved
                self.assertLess(resident, predicted["bytes_high"])
                self.assertGreater(resident, 4 << 20)
                # Of some 20 MiB: the pages of the code that a path happens to touch.
                self.assertLess(abs(resident / predicted["bytes"] - 1), 0.3)

    def test_rules_of_other_libraries_are_judged_where_they_apply(self):
        others = {rule["library"]: rule for rule in self.tiny()["summary"]["others"]}
        self.assertEqual(set(others), {"SciPy", "OpenCV", "VTK"})
        families = [entry["family"] for entry in self.tiny()["requests"]]
        self.assertEqual(others["SciPy"]["requests"], sum(f.startswith("warp") for f in families))
        self.assertEqual(others["OpenCV"]["requests"], sum(f.startswith("warp 2D") for f in families))
        self.assertEqual(others["VTK"]["requests"], sum(f.startswith("render") for f in families))
        for rule in others.values():
            self.assertLessEqual(rule["serves"], rule["requests"])
            if rule["requests"]:
                self.assertGreater(rule["regret_geomean"], 0)
            else:
                self.assertIsNone(rule["regret_geomean"])


class Options(Audit):
    def test_limit_keeps_the_chosen_path(self):
        report = self.audit([{"args": TINY[0]}], "--limit", "3", "--repeat", "1")
        entry = report["requests"][0]
        self.assertEqual(entry["paths"], 3)
        self.assertGreater(entry["all_paths"], 3)
        self.assertTrue(any(path.get("chosen") for path in entry["measured_paths"]))
        again = self.audit([{"args": TINY[0]}], "--limit", "3", "--repeat", "1")["requests"][0]
        self.assertEqual([p["steps"] for p in entry["measured_paths"]], [p["steps"] for p in again["measured_paths"]])

    def test_options_are_defaults_of_requests(self):
        report = self.audit([{"args": TINY[0]}, {"args": TINY[0] + ["--threads", "2"]}],
                            "--threads", "1", "--limit", "1", "--repeat", "1")
        self.assertEqual([entry["threads"] for entry in report["requests"]], [1, 2])

    def test_memory_budgets_end_with_their_request(self):
        report = self.audit([{"args": TINY[1] + ["--max-memory", "40MiB"]},
                             {"args": ["warp", "phantom:gaussians:140", "--rotate", "1,2,3"]}],
                            "--limit", "2", "--repeat", "1", "--verify", "2000")
        self.assertEqual(len(report["requests"][1]["measured_paths"]), 2)

    def test_json_goes_to_standard_output(self):
        self.write([{"args": TINY[2]}])
        done = self.run_it("audit", self.requests, "-o", self.out, "--json", "-", "--limit", "1", "--repeat", "1")
        self.assertEqual(json.loads(done.stdout), json.loads(self.out.read_text()))


class Failures(Audit):
    def test_filters_are_judged_too(self):
        args = ["filter", "phantom:zone-plate:64", "--op", "convolve", "--kernel", "gauss:3"]
        report = self.audit([{"args": args}], "--repeat", 2)
        request, = report["requests"]
        self.assertEqual(request["family"], "filter 2D")
        paths = {path["steps"][0].split("/")[0]: path for path in request["measured_paths"] if len(path["steps"]) == 1}
        self.assertLessEqual({"filter.backward", "filter.forward", "filter.separable", "filter.fourier"}, set(paths))
        for name, path in paths.items():
            # All but `recursive` give the sums themselves.
            if name != "filter.recursive" and path["measured"]:
                self.assertLess(path["measured"]["error"]["nrmse"], 1e-5, path)

    def test_a_bad_request_does_not_stop_the_others(self):
        report = self.audit([{"args": ["render", "no such file"]}, {"args": TINY[2]},
                             {"args": ["warp", "phantom:noise:20", "--rotate", "1,2,3", "--max-error", "1e-9",
                                       "--via", "warp.backward/filter=zoh"]},
                             {"args": ["render", "phantom:noise:20", "--mode", "no such mode"]},
                             {"args": ["info", "phantom:noise:20"]},
                             {"args": ["warp", "phantom:noise:20", "--no-such-option"]}],
                            "--limit", "2", "--repeat", "1", code=4)
        codes = [entry.get("error", {}).get("code", 0) for entry in report["requests"]]
        self.assertEqual(codes, [4, 0, 3, 2, 2, 2])
        self.assertIn("no such mode", report["requests"][3]["error"]["message"])
        self.assertIn("--no-such-option", report["requests"][5]["error"]["message"])
        self.assertEqual((report["summary"]["requests"], report["summary"]["failed"]), (1, 5))

    def test_a_bad_request_file_is_refused_by_its_field(self):
        for text, said in (("{", "parse"), ("[]", "requests"), ('{"requests": 3}', "requests"),
                           ('{"requests": []}', "empty"), ('{"requests": [7]}', "requests[0]"),
                           ('{"requests": [{"args": ["warp"]}, {"args": "warp"}]}', "requests[1].args"),
                           ('{"requests": [{"args": ["warp", 5]}]}', "requests[0].args[1]"),
                           ('{"requests": [{"args": ["warp"], "held_out": 1}]}', "requests[0].held_out"),
                           ('{"requests": [{"args": ["warp"], "nmae": "x"}]}', "requests[0].nmae")):
            self.requests.write_text(text)
            done = self.run_it("audit", self.requests, "-o", self.out, code=4)
            self.assertIn(said, done.stderr.decode())
            self.assertIn(str(self.requests), done.stderr.decode())
            self.assertFalse(self.out.exists())

    def test_what_cannot_be_read_or_written_is_said_before_any_work(self):
        self.run_it("audit", self.folder / "none.json", "-o", self.out, code=4)
        self.write([{"args": TINY[0]}])
        self.run_it("audit", self.requests, "-o", self.folder / "none/audit.json", code=2)
        self.run_it("audit", self.requests, code=2)
        for words in (["--limit", "0"], ["--repeat", "x"], ["--verify", "-3"]):
            self.run_it("audit", self.requests, "-o", self.out, *words, code=2)

    def test_an_interrupted_audit_keeps_what_is_done(self):
        self.write([{"args": TINY[2]}] +
                   [{"args": ["render", "phantom:noise:150", "--rotate", "1,2,3", "--max-error", "0.001",
                              "--turntable", "4"]}] * 40)
        process = subprocess.Popen([COMMAND, "audit", str(self.requests), "-o", str(self.out), "--log", "error"],
                                   stderr=subprocess.PIPE, env=self.env)
        line = process.stderr.readline()  # the first request is done
        self.assertIn(b"request 1 of 41", line)
        time.sleep(1)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(20), 130)
        process.stderr.close()
        report = json.loads(self.out.read_text())
        self.assertTrue(report["interrupted"])
        self.assertGreaterEqual(len(report["requests"]), 1)
        self.assertLess(len(report["requests"]), 41)
        self.assertGreaterEqual(report["requests"][0]["regret"], 1)


class Bundled(unittest.TestCase):
    def test_there_are_enough_requests(self):
        requests = json.loads(REQUESTS.read_text())["requests"]
        self.assertGreaterEqual(len(requests), 60)
        self.assertGreaterEqual(sum(request.get("held_out", False) for request in requests), 24)
        texts = {" ".join(request["args"]) for request in requests}
        self.assertEqual(len(texts), len(requests))


if __name__ == "__main__":
    unittest.main()
