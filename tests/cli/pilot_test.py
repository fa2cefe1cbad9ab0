"""--planner pilot and exhaustive: measured choices that keep their budgets, what is learned and kept, and --strict."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

EDGEWISE = os.environ["EDGEWISE"]
SPHERE = "phantom:marschner-lobb:32"


class Pilot(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.cache = self.folder / "cache/edgewise/wisdom.json"

    def run_it(self, *arguments):
        environment = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache"),
                       "XDG_CONFIG_HOME": str(self.folder / "config")}
        return subprocess.run([EDGEWISE, *map(str, arguments)], capture_output=True, text=True, env=environment)

    def report(self, *arguments):
        done = self.run_it(*arguments, "--json", "-", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_the_chosen_plan_keeps_its_error_and_carries_what_was_measured(self):
        for mode, error in (("mip", 0.05), ("xray", 0.05), ("composite", 0.02)):
            with self.subTest(mode=mode):
                report = self.report("render", SPHERE, "--mode", mode, "--rotate", "20,30,0", "--max-error", error,
                                     "--planner", "pilot", "-o", "null:", "--verify=all")
                self.assertEqual(report["planning"]["planner"], "pilot")
                self.assertLessEqual(report["measured"]["error"]["nrmse"], error)
                low, high = (report["plan"]["predicted"][k] for k in ("seconds_low", "seconds_high"))
                self.assertLess(low, high)

    def test_what_was_learned_is_kept_and_used(self):
        request = ("plan", "render", SPHERE, "--rotate", "20,30,0", "--max-error", "0.05", "--planner", "pilot")
        first = self.report(*request)
        learned = json.loads(self.cache.read_text())
        (entry,) = learned["requests"].values()
        path = " > ".join(s["transition"] + "".join(f"/{k}={v:g}" if isinstance(v, float) else f"/{k}={v}"
                                                    for k, v in s["parameters"].items())
                          for s in first["plan"]["steps"])
        self.assertIn(path, entry["paths"])
        # A number that only the file can know decides the next plan.
        slowest = max(entry["paths"], key=lambda p: max(entry["paths"][p]["seconds"], default=0))
        for name, each in entry["paths"].items():
            each["seconds"] = [1e-9 if name == slowest else 10.0] * 7
            each["given_up"] = 0
            each["error"] = each["low"] = each["high"] = 0.001
        self.cache.write_text(json.dumps(learned))
        again = self.report(*request)
        self.assertEqual([s["transition"] for s in again["plan"]["steps"]],
                         [s.split("/")[0] for s in slowest.split(" > ")])

    def test_other_samples_are_another_request(self):
        request = ("plan", "render", "--rotate", "20,30,0", "--planner", "pilot")
        self.report(*request, SPHERE)
        self.report(*request, "phantom:gaussians:32")
        self.assertEqual(len(json.loads(self.cache.read_text())["requests"]), 2)

    def test_a_broken_file_is_said_and_left_alone(self):
        self.cache.parent.mkdir(parents=True)
        self.cache.write_text('{"schema": 1, "requests": ')
        done = self.run_it("plan", "render", SPHERE, "--planner", "pilot")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("wisdom.json", done.stderr)
        self.assertEqual(self.cache.read_text(), '{"schema": 1, "requests": ')

    def write_stars(self, volume, side):
        """One sample in a thousand is bright."""
        stars = bytearray(side**3)
        stars[::1009] = b"\xff" * len(stars[::1009])
        header = f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {side} {side} {side}\nencoding: raw\n\n"
        volume.write_bytes(header.encode() + stars)

    def known(self, path):
        (entry,) = json.loads(self.cache.read_text())["requests"].values()
        return entry["paths"][path]

    def test_more_samples_decide_whether_a_budget_is_kept(self):
        # Thousands of draws leave the error of the nearest sample open.
        side, path = 96, "warp.backward/filter=zoh"
        volume = self.folder / "sparse.nrrd"
        self.write_stars(volume, side)
        request = ("warp", volume, "--rotate", "0,12,40", "--via", path, "-o", "null:")
        few = self.report(*request, "--max-error", 1, "--verify=8192")["measured"]["error"]
        true = self.report(*request, "--max-error", 1, "--verify=all")["measured"]["error"]["nrmse"]
        budget = 1.015 * true
        self.assertGreater((few["nrmse"] + few["high"]) / 2, budget)
        report = self.report(*request, "--max-error", budget, "--planner", "pilot", "--planning-time", 60)
        self.assertEqual(report["planning"]["planner"], "pilot")
        known = self.known(path)
        self.assertLessEqual((known["error"] + known["high"]) / 2, budget)
        self.assertGreater(known["samples"], 8192)

    def test_an_error_known_from_another_budget_is_measured_closer_and_the_path_timed(self):
        side, path = 96, "warp.backward/filter=zoh"
        volume = self.folder / "sparse.nrrd"
        self.write_stars(volume, side)
        request = ("warp", volume, "--rotate", "10,20,30", "--via", path, "-o", "null:")
        true = self.report(*request, "--max-error", 1, "--verify=all")["measured"]["error"]["nrmse"]
        pilot = ("--planner", "pilot", "--planning-time", 60)
        # So far below that a thousand samples tell: the path is not timed.
        self.assertEqual(self.run_it(*request, "--max-error", 0.3 * true, *pilot).returncode, 3)
        before = self.known(path)
        self.assertEqual(before["seconds"], [])
        self.report(*request, "--max-error", 1.1 * true, *pilot)
        closer = self.known(path)
        self.assertGreater(closer["samples"], before["samples"])
        self.assertLessEqual((closer["error"] + closer["high"]) / 2, 1.1 * true)
        self.assertTrue(closer["seconds"])
        # What is settled stays as it is.
        self.report(*request, "--max-error", 1.1 * true, *pilot)
        for key in ("error", "low", "high", "samples"):
            self.assertEqual(self.known(path)[key], closer[key])

    def test_exhaustive_measures_every_path(self):
        report = self.report("plan", "render", SPHERE, "--rotate", "20,30,0", "--planner", "exhaustive",
                             "--planning-time", "60", "--max-error", "1")
        (entry,) = json.loads(self.cache.read_text())["requests"].values()
        self.assertGreater(len(entry["paths"]), 20)
        self.assertEqual(report["plan"]["steps"][-1]["to"].split("/")[1], "picture")

    def test_a_demand_that_no_measurement_keeps_is_refused(self):
        done = self.run_it("render", SPHERE, "--max-error", "1e-9", "--rotate", "20,30,0", "--planner", "pilot", "-o",
                           "null:")
        self.assertEqual(done.returncode, 3)

    def test_samples_are_needed(self):
        done = self.run_it("plan", "render", "describe:64x64x64:u8", "--planner", "pilot")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--planner", done.stderr)

    def test_planning_time_is_for_measuring(self):
        done = self.run_it("plan", "render", SPHERE, "--planning-time", "1s")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--planning-time", done.stderr)


class Strict(unittest.TestCase):
    def test_a_broken_budget_writes_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "o.png"
            request = [EDGEWISE, "render", SPHERE, "-o", str(out), "--max-error", "1", "--quiet"]
            # No run is as short as a microsecond, and a profile that says so lets a plan be made.
            machine = pathlib.Path(folder) / "fast.json"
            machine.write_text(json.dumps({"schema": 1, "operation": 1e-15, "streamed": 1e-15, "gather": 1e-15,
                                           "start": 1e-12}))
            budget = ["--max-time", "1us", "--machine", str(machine)]
            done = subprocess.run([*request, *budget, "--strict"], capture_output=True, text=True)
            self.assertEqual((done.returncode, out.exists()), (1, False), done.stderr)
            done = subprocess.run([*request, *budget], capture_output=True, text=True)
            self.assertEqual((done.returncode, out.exists()), (0, True), done.stderr)


if __name__ == "__main__":
    unittest.main()
