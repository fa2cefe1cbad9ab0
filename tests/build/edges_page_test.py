"""docs/edges.md lists the edges of this build: what `script/edges_page` makes of `edgewise list edges`. Needs EDGEWISE."""
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/edges.md"


def check(page):
    return subprocess.run([ROOT / "script/edges_page", "--check", "--page", page], capture_output=True, text=True)


def part(name):
    return re.search(rf"<!-- {name} -->\n(.*?)<!-- end {name} -->", PAGE.read_text(encoding="utf8"), flags=re.S).group(1)


def listed():
    """{name: (source, whether only --via brings it, kinds)} as the command says it in text; the page is made from its JSON."""
    text = subprocess.run([os.environ["EDGEWISE"], "list", "edges"], capture_output=True, text=True, check=True).stdout
    edges = {}
    for entry in re.split(r"^(?=\S)", text, flags=re.M)[1:]:
        name, source = re.match(r"(\S+): (.*)", entry).groups()
        kinds = {kind.partition("+")[0] for join in re.findall(r"^    (\S+) -> (\S+)$", entry, flags=re.M) for kind in join}
        edges[name] = (source.removesuffix(" (only by --via)"), source.endswith(" (only by --via)"), kinds)
    return edges


class EdgesPage(unittest.TestCase):
    def test_the_page_is_what_the_generator_makes(self):
        done = check(PAGE)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_each_edge_stands_once_with_its_source_and_its_kinds(self):
        edges = listed()
        self.assertGreater(len(edges), 80)
        rows = [re.split(r" *(?<!\\)\| *", row)[1:-1] for row in part("edges").splitlines() if row.startswith("| `")]
        self.assertEqual(sorted(row[0].strip("*`") for row in rows), sorted(edges))
        for name, start, end, _, source in rows:
            said, demanded, kinds = edges[name.strip("*`")]
            self.assertEqual(name.endswith("*"), demanded, name)
            self.assertEqual(source.replace("\\|", "|"), said, name)
            shown = set(re.findall(r"`([^`]+)`", start + end))
            self.assertLessEqual(shown, kinds, name)
            if " to " not in start + end:  # a span of kinds has its ends alone
                self.assertEqual(shown, kinds, name)

    def test_errors_are_of_edges_that_there_are(self):
        edges = listed()
        page = PAGE.read_text(encoding="utf8").partition("## Measured errors")[2]
        named = [word.partition("/")[0] for word in re.findall(r"`([a-z]+\.[a-z0-9_]+[^`\s]*)`", page)]
        self.assertGreater(len(named), 40)
        self.assertEqual([name for name in named if name not in edges], [])

    def test_a_page_that_is_behind_is_refused(self):
        text = PAGE.read_text(encoding="utf8")
        row = re.search(r"^\| `store\.crop`.*\n", text, flags=re.M).group(0)
        changes = {"an edge less": text.replace(row, ""), "an edge more": text.replace(row, row + row.replace("crop", "clip")),
                   "another source": text.replace("Westover 1990 |", "Westover 1991 |", 1),
                   "no star": text.replace("`project.hull_cast`*", "`project.hull_cast`"),
                   "another value": text.replace("`loss` 0.0625", "`loss` 0.125")}
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder) / "edges.md"
            for change, changed in changes.items():
                self.assertNotEqual(changed, text, change)
                page.write_text(changed, encoding="utf8")
                done = check(page)
                self.assertEqual(done.returncode, 1, change)
                self.assertIn("run script/edges_page", done.stderr)
                self.assertEqual(page.read_text(encoding="utf8"), changed, change)  # a check writes nothing


if __name__ == "__main__":
    unittest.main()
