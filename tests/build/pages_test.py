"""Pages point to what is there: files, headings, folders of the sources, and the markers that a program writes between."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Words that had a meaning of their own here, and the field's words for them.
PRIVATE = {"lit": "shaded, or under light", "unlit": "without light", "rivals?": "alternative", "ways? out": "alternative, remedy", "told apart": "distinguished",
           "tells? (them|these|those) apart": "distinguish"}
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs/planner").glob("*.md"))]
ROOMS = "benchmarks|charts|cli|cmake|docs|engine|examples|graph|io|planner|reference|runtime|scene|script|surface|tests|transitions"


def text_of(page):
    """Without blocks of code."""
    return re.sub(r"```.*?```", "", page.read_text(encoding="utf8"), flags=re.S)


def headings(page):
    """As GitHub names them in addresses."""
    names = set()
    for heading in re.findall(r"^#+ (.*)$", text_of(page), flags=re.M):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        names.add(re.sub(r"[^\w\- ]", "", words).strip().replace(" ", "-"))
    return names


class Pages(unittest.TestCase):
    def test_links_lead_somewhere(self):
        seen = 0
        for page in PAGES:
            for link in re.findall(r"\]\(([^)\s]+)\)", text_of(page)):
                if link.startswith("http"):
                    continue
                seen += 1
                file, _, heading = link.partition("#")
                target = (page.parent / file).resolve() if file else page
                self.assertTrue(target.exists(), f"{page.name}: {link}")
                if heading and target.suffix == ".md":
                    self.assertIn(heading, headings(target), f"{page.name}: {link}")
        self.assertGreater(seen, 100)

    def test_sources_that_pages_name_exist(self):
        seen = 0
        for page in PAGES:
            for path in re.findall(rf"`((?:{ROOMS})/[\w./-]+)`", text_of(page)):
                if "..." in path or re.search(r"FAMILY|NAME", path):
                    continue
                seen += 1
                self.assertTrue((ROOT / path).exists(), f"{page.name}: {path}")
        self.assertGreater(seen, 100)

    def test_pages_use_the_words_of_the_field(self):
        for page in PAGES:
            prose = re.sub(r"`[^`]*`|\]\([^)]*\)", "", text_of(page))
            for word, usual in PRIVATE.items():
                found = re.search(rf"(?i)\b{word}\b.*", prose)
                self.assertFalse(found, f"{page.name}: say {usual}: {found and found.group(0)[:60]}")

    def test_sentences_of_the_design_are_short(self):
        lines = [line for line in text_of(ROOT / "docs/design.md").splitlines() if not line.startswith("|")]
        sentences = [each for line in lines for each in re.split(r"(?<=[.:;?])\s+", line)]
        self.assertGreater(len(sentences), 150)
        self.assertEqual([each for each in sentences if len(each.split()) > 32], [])

    def test_tables_of_performance_have_places(self):
        program = (ROOT / "benchmarks/performance.py").read_text(encoding="utf8")
        parts = re.search(r"for each in \(([\w, ]+)\)", program).group(1).split(", ")
        page = (ROOT / "docs/performance.md").read_text(encoding="utf8")
        for part in [*parts, "made by"]:
            self.assertRegex(page, rf"<!-- {part} -->\n(?s:.*?)<!-- end {part} -->")
        self.assertEqual(sorted([*parts, "made by"]), sorted(re.findall(r"<!-- ((?!end )[\w ]+) -->", page)))

    def test_the_readme_is_short_and_leads_on(self):
        lines = (ROOT / "README.md").read_text(encoding="utf8").splitlines()
        self.assertLessEqual(len(lines), 150)
        self.assertEqual([line for line in lines if len(line) > 250], [])
        self.assertTrue(any(re.match(r"script/test\b", line) for line in lines))  # what continuous integration runs
        linked = set(re.findall(r"\]\(docs/([\w/]+\.md)", "\n".join(lines)))
        self.assertEqual({page.name for page in (ROOT / "docs").glob("*.md")} - linked, set())


if __name__ == "__main__":
    unittest.main()
