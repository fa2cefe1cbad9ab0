"""What was refused is folded by reason, in --explain and in the picture of the graph; --explain=all lists all. Needs EDGEWISE and EDGEWISE_DATA."""

import html
import json
import re
import unittest

from running import DATA, Running

REQUEST = ("render", DATA / "ct_chest/chest.nrrd", "--mode", "shaded", "--size", "64")


class Refusals(Running):
    def test_explain_counts_and_all_lists(self):
        report = json.loads(self.run_it("plan", *REQUEST, "--json", "-").stdout)
        refused = report["refused"]
        self.assertGreater(len(refused), 10)
        short = self.run_it("plan", *REQUEST).stdout.decode()
        everything = self.run_it("plan", *REQUEST, "--explain=all").stdout.decode()
        for refusal in refused:
            self.assertIn(f"  {refusal['transition']}: {refusal['reason']}\n", everything)
        counts = re.search(r"\nrefused: (?:(\d+) only by --via, )?(?:(\d+) follows? from another, )?(\d+) reasons?", short)
        self.assertTrue(counts, short[-2000:])
        lines = short[counts.end():].strip().split("\n")[1:]
        self.assertEqual(len(lines), int(counts[3]))
        self.assertLess(len(short.splitlines()), len(everything.splitlines()))
        reasons = {refusal["reason"] for refusal in refused}
        for line in lines:
            self.assertTrue(any(line.endswith(": " + reason) for reason in reasons), line)

    def test_another_value_of_explain_is_refused(self):
        self.run_it("plan", *REQUEST, "--explain=some", code=2)

    def drawn(self, *words):
        """The texts of a drawing of the graph."""
        self.run_it("graph", *words, "-o", self.folder / "g.svg")
        return [html.unescape(text) for text in re.findall(r"<text[^>]*>([^<]*)</text>", (self.folder / "g.svg").read_text())]

    def test_the_graph_is_not_drowned_in_refusals(self):
        texts = self.drawn(*REQUEST)
        self.assertEqual(len([text for text in texts if text.startswith("refused: ")]), 1)
        self.assertGreaterEqual(texts.count("object/scalar"), 2)
        # No reason twice.
        self.assertEqual(texts.count("no surface is asked for"), 1)

    def test_edges_have_errors_in_nrmse(self):
        """Of a path of one edge that is the error of the plan."""
        words = ("render", DATA / "ct_chest/chest.nrrd", "--mode", "mip", "--size", "64", "--via", "project.ray_cast/filter=foh/step=0.5")
        report = json.loads(self.run_it("plan", *words, "--json", "-").stdout)
        self.assertEqual(len(report["plan"]["steps"]), 1)
        shown = [float(number) for number in re.findall(r"NRMSE \+ ([\d.e+-]+)", " ".join(self.drawn(*words)))]
        error = report["plan"]["predicted"]["error"]
        self.assertTrue(any(abs(number - error) <= 0.06 * error for number in shown), (shown, error))


if __name__ == "__main__":
    unittest.main()
