"""Where the choice hangs on chance of the preview's draw, more is drawn: the cheaper path is found, and keeps its budget."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

EDGEWISE = os.environ["EDGEWISE"]
DATA = pathlib.Path(os.environ.get("EDGEWISE_DATA", pathlib.Path(__file__).resolve().parents[2] / "data"))
HEAD = DATA / "ct_head/quarter.nhdr"

# Drawing more pays over many runs.
MANY = ("--repeat", "1000")
# Request, budget on the error, the path that keeps it although the usual draws leave that open, and its filter.
STRADDLING = [
    (("warp", HEAD, "--rotate", "5,10,15"), "0.0096", "foh"),
    (("warp", HEAD, "--scale", "1.4"), "0.0288", "zoh"),
    (("warp", "phantom:shepp-logan:83", "--rotate", "2,2,40"), "0.114", "zoh"),
    (("warp", "phantom:zone-plate:900", "--rotate", "20"), "0.188", "zoh"),
]


class RefinedScene(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_it(self, *arguments, cache="cache"):
        environment = {**os.environ, "XDG_CACHE_HOME": str(self.folder / cache),
                       "XDG_CONFIG_HOME": str(self.folder / "config")}
        done = subprocess.run([EDGEWISE, *map(str, arguments)], capture_output=True, text=True, env=environment)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def report(self, *arguments, **options):
        return json.loads(self.run_it(*arguments, "--json", "-", **options))

    def plan(self, *arguments, **options):
        return self.report("plan", *arguments, **options)

    def usual_draws(self, *request):
        """With a budget that every path keeps there is no reason to draw more."""
        return self.plan(*request, "--max-error", "0.9")["scene"]["draws"]

    def test_the_cheaper_path_is_found_and_keeps_the_budget(self):
        for request, budget, hold in STRADDLING:
            with self.subTest(request=request):
                report = self.report(*request, "--max-error", budget, "--verify=all", *MANY, "-o", self.folder / "out.nrrd")
                self.assertGreaterEqual(report["scene"]["draws"], 3 * self.usual_draws(*request))
                (step,) = report["plan"]["steps"]
                self.assertEqual(step["transition"], "warp.backward")
                self.assertEqual(step["parameters"]["filter"], hold)
                self.assertLessEqual(report["plan"]["predicted"]["error"], float(budget))
                error = report["measured"]["error"]["nrmse"]
                self.assertLessEqual(error, report["plan"]["predicted"]["error"])

    def test_plans_are_the_same_cold_warm_and_on_one_thread(self):
        for request, budget, _ in STRADDLING:
            with self.subTest(request=request):
                plans = [self.plan(*request, "--max-error", budget, *MANY, *more, cache=cache)
                         for cache, more in (("cache", ()), ("cache", ()), ("none", ("--threads", "1")))]
                for other in plans[1:]:
                    self.assertEqual(other["scene"], plans[0]["scene"])
                    self.assertEqual([step["parameters"] for step in other["plan"]["steps"]],
                                     [step["parameters"] for step in plans[0]["plan"]["steps"]])
                    self.assertEqual(other["plan"]["predicted"]["error"], plans[0]["plan"]["predicted"]["error"])

    def test_more_is_drawn_only_where_it_may_pay(self):
        # The error leaves no doubt; nothing is cheaper; a picture of a millisecond saves less than rays take.
        for request, budget in [(("warp", HEAD, "--rotate", "5,10,15"), "0.015"),
                                (("warp", HEAD, "--rotate", "5,10,15"), "0.1"),
                                (("warp", "phantom:zone-plate:200", "--rotate", "20"), "0.19"),
                                (("render", "phantom:shepp-logan:64", "--rotate", "0,47,0", "--size", "90x90"), "0.13")]:
            with self.subTest(request=request, budget=budget):
                self.assertEqual(self.plan(*request, "--max-error", budget)["scene"]["draws"],
                                 self.usual_draws(*request))

    def test_one_run_pays_for_no_more_draws(self):
        for request, budget, _ in STRADDLING:
            with self.subTest(request=request):
                self.assertEqual(self.plan(*request, "--max-error", budget)["scene"]["draws"],
                                 self.usual_draws(*request))

    def test_a_budget_that_nothing_keeps_is_not_drawn_for(self):
        request = ("warp", "phantom:zone-plate:900", "--rotate", "20", "--via", "warp.backward/filter=zoh")
        loose = self.plan(*request, "--max-error", "0.9")
        budget = 0.97 * loose["plan"]["predicted"]["error"]
        environment = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache"),
                       "XDG_CONFIG_HOME": str(self.folder / "config")}
        done = subprocess.run([EDGEWISE, "plan", *request, "--max-error", f"{budget:.6f}"], capture_output=True, text=True,
                              env=environment)
        self.assertEqual(done.returncode, 3)
        self.assertIn("--max-error", done.stderr)

    def test_planning_says_what_it_drew_and_keeps_it(self):
        request, budget, _ = STRADDLING[0]
        self.assertIn("4 times the usual draws", self.run_it("plan", *request, "--max-error", budget, *MANY, cache="other"))
        scenes = self.folder / "other" / "edgewise" / "scenes"
        kept = {path.name: path.read_bytes() for path in scenes.glob("*-view-*.json")}
        self.assertEqual(len(kept), 2)  # of the usual draws, and of 4 times as many
        self.run_it("plan", *request, "--max-error", budget, *MANY, cache="other")
        self.assertEqual(kept, {path.name: path.read_bytes() for path in scenes.glob("*-view-*.json")})


if __name__ == "__main__":
    unittest.main()
