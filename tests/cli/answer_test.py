"""The answer: margin, rivals, ways out that work as typed, advice. Needs EDGEWISE."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
SPHERE = ["render", "phantom:sphere:64", "--rotate", "10,20,0"]
UNITS = {"": 1, "us": 1e-6, "ms": 1e-3, "s": 1, "MiB": 2**20}


def number(text):
    digits, unit = re.fullmatch(r"([0-9.e+-]+?)([A-Za-z]*)", text).groups()
    return float(digits) * UNITS[unit]


class Answer(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, self.folder)
        self.environment = {**os.environ, "XDG_CONFIG_HOME": str(self.folder),
                            "XDG_CACHE_HOME": str(self.folder / "cache")}

    def run_it(self, words, code=0):
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=120, text=True,
                              env=self.environment, check=False)
        if code is not None:
            self.assertEqual(done.returncode, code, f"{words}: {done.stderr}")
        return done

    def report(self, words, code=0):
        return json.loads(self.run_it([*words, "--json", "-", "--quiet"], code).stdout)

    def plans(self, words):
        done = self.run_it(["plan", *words, "--json", "-", "--quiet"], None)
        # 1: short of memory already while the scene was looked at.
        self.assertIn(done.returncode, (0, 1, 3) if "--max-memory" in words else (0, 3), done.stderr)
        return done.returncode == 0

    # --- margin and rivals

    def test_three_rivals_and_what_they_lose(self):
        report = self.report(["plan", *SPHERE, "--max-error", 0.02])
        plan = report["plan"]
        self.assertGreaterEqual(len(report["rivals"]), 3)
        for rival in report["rivals"]:
            self.assertNotEqual(rival["steps"], [step["transition"] for step in plan["steps"]])
            for key in ("seconds", "bytes", "error"):
                self.assertAlmostEqual(rival["loses"][key],
                                       rival["predicted"][key] - plan["predicted"][key], delta=1e-9)
            self.assertEqual("error" in rival["breaks"], rival["predicted"]["error"] > 0.02)
        step = report["margin"]["steps"][0]
        self.assertGreaterEqual(step["factor"], 1)
        self.assertTrue(step["instead"])

    def test_margin_is_where_the_plan_turns(self):
        """A profile whose factor for the plan's edge is a little below or above the margin."""
        words = ["plan", *SPHERE, "--max-error", 0.02, "--threads", 1]
        self.run_it(["list", "machines"])
        profile = {"schema": 1, "name": "made", "processors": 1, "start": 0,
                   "factors": {"project.ray_cast": 1.0, "project.shear_warp": 1.0}}
        file = self.folder / "made.json"

        def planned(factor, edge=None):
            changed = json.loads(json.dumps(profile))
            if edge:
                changed["factors"][edge] = factor
            file.write_text(json.dumps(changed), encoding="utf-8")
            report = self.report([*words, "--machine", file])
            steps = [s["transition"] + "".join(f"/{k}={v:g}" if isinstance(v, float) else f"/{k}={v}"
                                               for k, v in s["parameters"].items())
                     for s in report["plan"]["steps"]]
            return steps, report

        steps, report = planned(1)
        turned = 0
        for step in report["margin"]["steps"]:
            if step["factor"] is None or step["factor"] > 1e5:
                continue
            self.assertEqual(planned(step["factor"] * 0.999, step["step"])[0], steps)
            self.assertEqual(planned(step["factor"] * 1.001, step["step"])[0], step["instead"])
            turned += 1
        self.assertGreater(turned, 0)

    def test_explanation_says_both(self):
        text = self.run_it(["plan", *SPHERE, "--max-error", 0.02]).stdout
        self.assertIn("\nmargin\n", text)
        self.assertIn("\nrivals\n", text)

    def test_prediction_beside_measurement(self):
        text = self.run_it([*SPHERE, "-o", "null:", "--explain", "--verify"]).stdout
        table = text[text.index("predicted            measured"):]
        for row in ("all steps", "peak memory", "error", "measured:"):
            self.assertIn(row, table)
        self.assertNotIn("not verified", table)
        self.assertNotIn("not planned", table)

    # --- ways out

    def relax(self, words):
        return self.report(["plan", *words], code=3)["error"]["relax"]

    def with_budgets(self, words, changes):
        changed = list(map(str, words))
        for option, value in changes.items():
            if option in changed:
                at = changed.index(option)
                changed[at:at + 2] = []
            if value is not None:
                changed += [option, value]
        return changed

    def check_budgets(self, words, size):
        relax = self.relax(words)["budgets"]
        self.assertTrue(relax)
        for changes in relax:
            self.assertEqual(len(changes), size, relax)
            self.assertTrue(self.plans(self.with_budgets(words, changes)), changes)
            for option, value in changes.items():
                if value is None:
                    continue
                # What a process holds before any sample differs by 1.5 MiB between runs, on either side.
                share = 0.97 if option == "--max-memory" else 0.99
                tighter = {**changes, option: f"{number(value) * share:.17g}"}
                self.assertFalse(self.plans(self.with_budgets(words, tighter)), tighter)
        return relax

    def test_one_budget_gives_way(self):
        found = self.check_budgets([*SPHERE, "--max-error", 0.00005], 1)
        self.assertEqual(set(found[0]), {"--max-error"})
        found = self.check_budgets([*SPHERE, "--max-time", "3us"], 1)
        self.assertEqual(set(found[0]), {"--max-time"})
        found = self.check_budgets([*SPHERE, "--max-error", 0.002, "--max-time", "40us"], 1)
        self.assertEqual({key for one in found for key in one}, {"--max-error", "--max-time"} if len(found) > 1
                         else set(found[0]))

    def test_memory_gives_way_where_samples_do_not_fit(self):
        for least in ("1MiB", "100MiB"):
            words = ["render", "phantom:sphere:320", "--rotate", "10,20,0", "--max-memory", least]
            found = self.check_budgets(words, 1)
            self.assertEqual(set(found[0]), {"--max-memory"})

    def test_two_budgets_give_way_together(self):
        self.check_budgets([*SPHERE, "--max-error", 0.00005, "--max-time", "3us"], 2)

    def test_the_message_says_it(self):
        done = self.run_it([*SPHERE, "-o", "null:", "--max-error", "0.00005"], 3)
        self.assertRegex(done.stderr, r"--max-error [0-9.e-]+ instead of 5e-05")

    def test_demands_that_must_go(self):
        words = [*SPHERE, "--without", "project", "--without", "store.crop", "--without", "spectrum"]
        sets = self.relax(words)["demands"]
        self.assertTrue(sets)
        for demands in sets:
            left = list(words)
            for demand in demands:
                at = next(i for i in range(len(left) - 1)
                          if left[i:i + 2] == [demand["option"], demand["value"]])
                left[at:at + 2] = []
            self.assertEqual(len(demands), 1)
            self.assertTrue(self.plans(left))

    def test_an_edge_that_refuses_must_go(self):
        relax = self.relax([*SPHERE, "--via", "spectrum.slice", "--without", "store.crop"])
        self.assertEqual(relax["demands"], [[{"option": "--via", "value": "spectrum.slice"}]])
        self.assertEqual(relax["missing"], [])

    # --- advise

    def test_advice_for_a_request(self):
        report = self.report(["advise", *SPHERE])
        self.assertEqual(len(report["requests"]), 1)
        worth = [cost["regret"] / cost["measuring"] for cost in report["costs"]]
        self.assertEqual(worth, sorted(worth, reverse=True))
        self.assertTrue(report["costs"])
        for cost in report["costs"]:
            self.assertGreater(cost["spread"], 0)
            self.assertAlmostEqual(cost["measuring"], 3 * cost["seconds"], delta=1e-9)
        seconds = report["requests"][0]["seconds"]
        self.assertGreater(seconds, report["requests"][0]["bound"])
        gains = [arc["gain"] for arc in report["missing_arcs"]]
        self.assertEqual(gains, sorted(gains, reverse=True))
        for arc in report["missing_arcs"]:
            self.assertAlmostEqual(arc["plan_seconds"] + arc["gain"], seconds, delta=1e-9)
            self.assertGreaterEqual(arc["plan_seconds"], report["requests"][0]["bound"] * 0.999)

    def test_advice_without_a_request_covers_the_usual_ones(self):
        report = self.report_of_all()
        self.assertGreater(len(report["requests"]), 5)
        self.assertTrue(report["costs"] and report["missing_arcs"])
        for arc in report["missing_arcs"]:  # one plane of a spectrum is read in less than the whole spectrum
            self.assertGreaterEqual(arc["seconds"], 2 * arc["bound"], arc)
        for each in report["requests"]:
            self.assertGreaterEqual(each["seconds"], each["bound"], each)
        self.assertEqual(report, self.report_of_all())
        text = self.run_it(["advise"]).stdout
        for part in ("costs worth measuring", "missing edges", "times the bound"):
            self.assertIn(part, text)

    def report_of_all(self):
        return json.loads(self.run_it(["advise", "--json", "-"]).stdout)

    def test_advice_where_nothing_fits_is_the_way_out(self):
        report = self.report(["advise", *SPHERE, "--max-time", "3us"], code=3)
        self.assertEqual(report["error"]["code"], 3)


if __name__ == "__main__":
    unittest.main()
