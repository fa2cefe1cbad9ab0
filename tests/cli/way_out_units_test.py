"""Messages in the words of who typed: ways out in dB, percent, ms, MiB; lists of modes with all that --mode takes. Needs EDGEWISE."""

import json
import re
import unittest

from running import Running

SOURCE = ("render", "phantom:shepp-logan:32", "--rotate", "10,20,30", "--size", "40x40")


class WayOutUnits(Running):
    def way_out(self, option, typed, *more):
        """What is suggested instead of a budget that no plan keeps, which then works."""
        words = [*SOURCE, "-o", "null:", option, typed, *more]
        report = json.loads(self.run_it(*words, "--json", "-", code=3).stdout)
        message = report["error"]["message"]
        found = re.search(rf"{option} (\S+) instead of (\S+)", message)
        self.assertTrue(found, message)
        if typed[-1].isdigit() and option == "--max-error":
            self.assertEqual(float(found[2]), float(typed))
        else:
            self.assertEqual(found[2], typed)
        alone = [change[option] for change in report["error"]["relax"]["budgets"] if list(change) == [option]]
        self.assertEqual(alone, [found[1]])
        self.run_it(*[found[1] if word == typed else word for word in words])
        return found[1], message

    def test_errors_are_said_as_they_were_typed(self):
        as_number, _ = self.way_out("--max-error", "1e-9")
        least = float(as_number)
        for typed, unit in (("180dB", "dB"), ("175DB", "DB"), ("0.0000001%", "%")):
            with self.subTest(typed=typed):
                text, message = self.way_out("--max-error", typed)
                self.assertTrue(text.endswith(unit), text)
                value = float(text[:-len(unit)])
                error = value / 100 if unit == "%" else 10 ** (-value / 20)
                # Four digits, or a hundredth of a decibel: 0.12 %.
                self.assertTrue(least * .998 <= error <= least * 1.003, (error, least))
                nearest = re.search(r"error ([\d.e-]+) " + ("dB" if unit.lower() == "db" else "%"), message)
                self.assertTrue(nearest, message)
                if unit != "%":
                    self.assertIn(f"no plan keeps to an error of {float(typed[:-2]):.1f} dB", message)

    def test_a_decibel_more_is_no_way_out(self):
        text, _ = self.way_out("--max-error", "180dB")
        more = f"{float(text[:-2]) + .02:.2f}dB"
        self.run_it(*SOURCE, "-o", "null:", "--max-error", more, code=3)

    def test_times_and_memories_likewise(self):
        for typed, unit in (("0.0001ms", "ms"), ("0.1us", "us"), ("1e-7", ""), ("0.0000001s", "s")):
            with self.subTest(typed=typed):
                # Seconds of this size of a request differ from run to run by nothing: they are predicted.
                text, _ = self.way_out("--max-time", typed, "--max-error", "linear")
                self.assertTrue(re.fullmatch(r"[\d.e-]+" + unit, text), text)
        for typed, unit in (("1MiB", "MiB"), ("0.001GiB", "GiB"), ("1000kB", "kB"), ("1000000", "")):
            with self.subTest(typed=typed):
                report = json.loads(self.run_it(*SOURCE, "-o", "null:", "--max-memory", typed, "--json", "-", code=3).stdout)
                text = report["error"]["relax"]["budgets"][0]["--max-memory"]
                self.assertIn(f"--max-memory {text} instead of {typed}", report["error"]["message"])
                if typed == "1000kB":  # 40000 kB: longer than anyone reads
                    self.assertTrue(text.endswith("MiB"), text)
                else:
                    self.assertTrue(re.fullmatch(r"[\d.]+" + unit, text), text)

    def test_a_broken_budget_is_said_so(self):
        done = self.run_it("render", "phantom:noise:32", "--rotate", "10,20,30", "-o", "null:", "--max-error", "20dB", "--verify=all",
                           "--via", "project.ray_cast/filter=zoh/step=2", "--json", "-", code=None)
        report = json.loads(done.stdout)
        for warning in report["warnings"]:
            if "beyond the budget" in warning:
                self.assertRegex(warning, r"[\d.]+ dB .* is beyond the budget of 20.0 dB")
        if done.returncode == 3:
            self.assertRegex(report["error"]["message"], r"--max-error [\d.]+dB instead of 20dB")

    def run_it(self, *words, code=0, env=None):
        if code is not None:
            return super().run_it(*words, code=code, env=env)
        import subprocess

        from running import COMMAND
        return subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=200, env=self.env)


class Lists(Running):
    def test_the_list_of_modes_names_what_mode_takes(self):
        message = self.run_it(*SOURCE, "-o", "null:", "--mode", "banana", code=2).stderr.decode()
        listed = re.search(r"expected one of (.*)", message)[1].strip().split(", ")
        known = [mode["name"] for mode in json.loads(self.run_it("list", "modes", "--json", "-").stdout)["modes"]]
        self.assertEqual(sorted(set(known) - set(listed)), [])
        self.assertIn("shaded", listed)
        for mode in listed:  # each of them is taken
            level = ["--isovalue", "0.5"] if mode in ("surface", "binary") else []
            self.run_it(*SOURCE, "-o", "null:", "--mode", mode, *level, "--quiet")

    def test_a_mistyped_mode_gets_the_nearest(self):
        for typed, meant in (("shadad", "shaded"), ("shdaed", "shaded"), ("mpi", "mip"), ("surfac", "surface")):
            self.assertIn(f"did you mean {meant}?", self.run_it(*SOURCE, "-o", "null:", "--mode", typed, code=2).stderr.decode())


if __name__ == "__main__":
    unittest.main()
