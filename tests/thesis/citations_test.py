"""What is cited exists: sections, equations, figures, tables, lemmas and theorems of the thesis, and the papers that edges name.

contents.csv lists what the thesis has. Needs nothing built."""
import csv
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
ENDINGS = {".cpp", ".hpp", ".h", ".py", ".md", ".json", ".csv", ".txt", ".sh", ".html", ".js", ""}
LEFT_OUT = ("build", "docs/changes", "data", ".git", "tests/thesis/contents.csv", "tests/thesis/citations_test.py")
NUMBER = r"\d+(?:\.\d+)*(?!\.?\d)"
LIST = rf"{NUMBER}(?:(?:, and |, or |, | and | or | to |-|–){NUMBER})*"
KINDS = {"equation": r"EQ", "figure": r"FIGURES?", "table": r"TABLES?", "theorem": r"Theorems?", "lemma": r"Lemmas?",
         "definition": r"Definitions?", "chapter": r"[Cc]hapters?"}
KEY = r"(?:\[W93\]|\[W93(?=[ ,])|Wittenbrink 1993,|\bthesis,?(?:'s)?(?= \(?(?:\d\.\d|section|Appendix)))"
SECTION = r"(?<![\d.^])[1-6]\.\d+(?:\.\d+)?(?!\.?\d)"


def contents():
    found = {}
    with open(ROOT / "tests/thesis/contents.csv", newline="", encoding="utf8") as file:
        for row in csv.DictReader(file):
            ends = row["number"].split(" to ")
            numbers = map(str, range(int(ends[0]), int(ends[1]) + 1)) if len(ends) == 2 else ends
            found.setdefault(row["kind"], set()).update(numbers)
    return found


def texts():
    """(file, text) of what people read, lines of a comment joined."""
    rooms = [each for each in sorted(ROOT.iterdir()) if each.name not in LEFT_OUT]
    for file in [inner for room in rooms for inner in ([room] if room.is_file() else sorted(room.rglob("*")))]:
        name = file.relative_to(ROOT).as_posix()
        if file.suffix not in ENDINGS or name.startswith(LEFT_OUT) or not file.is_file():
            continue
        try:
            text = file.read_text(encoding="utf8")
        except UnicodeDecodeError:
            continue
        yield name, re.sub(r"\s*\n\s*(?:///?|#|\*)?\s*", " ", text)


def expanded(listed):
    """The numbers of "6", "6-9", "28 to 30", "62 and 63" and of lists of these."""
    numbers = []
    for part in re.split(r", and |, or |, | and | or ", listed):
        ends = re.split(r" to |-|–", part)
        if len(ends) == 2 and all(end.isdigit() for end in ends):
            numbers += map(str, range(int(ends[0]), int(ends[1]) + 1))
        else:
            numbers += ends
    return numbers


def named_of(text, word):
    """Numbers after a word that names their kind; the next section of a list is none of them."""
    for hit in re.finditer(rf"\b{word} ({LIST})", text):
        dotted = "." in hit.group(1).split(",")[0].split(" ")[0]
        yield from (number for number in expanded(hit.group(1)) if ("." in number) == dotted)


def sections_of(text):
    """(section, whether of an appendix) after a key of the thesis, up to the end of that reference."""
    for hit in re.finditer(KEY, text):
        reference = re.split(r"[;|\"\]]|\)(?!,)|[.:] |Error |Work ", text[hit.end():hit.end() + 160])[0]
        reference = re.sub(r"\b(?:Lemmas?|Theorems?) " + LIST, "", reference)
        appendix = "Appendix" in reference
        yield from ((number, appendix) for number in re.findall(SECTION, reference))


def wrong(text, existing, about_thesis):
    """What a text cites of the thesis that is not there."""
    missing = set()
    for kind, word in KINDS.items():
        if kind in ("theorem", "lemma", "definition", "chapter") and not about_thesis:
            continue
        missing |= {f"{kind} {number}" for number in named_of(text, word) if number not in existing[kind]}
    if about_thesis:
        for word, kind in ((r"(?:[Tt]ables?|TABLES?)", "table"), (r"[Ff]igures?", "figure")):
            missing |= {f"{kind} {number}" for number in named_of(text, word) if number not in existing[kind]}
        anywhere = existing["section"] | existing["appendix B"]
        missing |= {f"section {number}" for number in named_of(text, "[Ss]ections?") if "." in number and number not in anywhere}
    for number, appendix in sections_of(text):
        if number not in existing["appendix B" if appendix else "section"]:
            missing.add(f"{'Appendix B, ' if appendix else ''}{number}")
    return sorted(missing)


class Citations(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.existing = contents()

    def test_the_list_is_whole(self):
        for kind, last in (("figure", 98), ("table", 37), ("equation", 91), ("definition", 9), ("chapter", 6)):
            self.assertEqual(self.existing[kind], {str(n) for n in range(1, last + 1)}, kind)
        for number in self.existing["section"]:  # 3.6.6 is behind 3.6.5, in 3.6
            *above, last = number.split(".")
            if len(above) > 1:
                self.assertIn(".".join(above), self.existing["section"])
            if last != "1":
                self.assertIn(".".join([*above, str(int(last) - 1)]), self.existing["section"])

    def test_what_is_not_there_is_found(self):
        for text, missing in (
                ('source = "Wittenbrink 1993, 4.1.4, EQ 62 and 63"', ["4.1.4"]), ("[W93] 3.6.6, EQ 10 to 12, TABLE 6", []),
                ("thesis 4.1.4 | 0.0014", ["4.1.4"]), ("[W93] Appendix B, 2.8, FIGURE 96", ["Appendix B, 2.8"]), ("Source [W93] 2.2.6", ["2.2.6"]),
                ("[W93] EQ 90 to 92", ["equation 92"]), ("FIGURE 98 and 99", ["figure 99"]), ("[W93] TABLE 36, 37 and 38", ["table 38"]),
                ("[W93] Theorem 3.2", ["theorem 3.2"]), ("Lemmas 4.1 and 4.3 of the thesis", ["lemma 4.3"]),
                ("[W93] EQ 10 and 3.6.6 (multipass)", []), ("[W93] EQ 10 and 3.6.7 (multipass)", ["3.6.7"]), ("[W93, 3.8]", []),
                ("(thesis 5.2, FIGURE 87). 7.5 views", []), ("the thesis measured 7.9 ms against 8.4", []),
                ("[W93] 4.5 and 4.8; Levoy 1990, 9.9", ["4.8"]), ("thesis, section 2.9", ["2.9", "section 2.9"])):
            self.assertEqual(wrong(text, self.existing, "W93" in text or "thesis" in text), sorted(missing), text)

    def test_what_is_cited_exists(self):
        cited = 0
        for name, text in texts():
            about = re.search(r"\bthesis|W93|Wittenbrink", text) is not None
            missing = wrong(text, self.existing, about)
            self.assertEqual(missing, [], name)
            cited += sum(len(list(named_of(text, word))) for word in KINDS.values()) + len(list(sections_of(text)))
        self.assertGreater(cited, 300)

    def test_papers_that_edges_name_are_in_the_references(self):
        references = (ROOT / "docs/references.md").read_text(encoding="utf8")
        missing = set()
        for file in sorted((ROOT / "transitions").rglob("*.cpp")):
            for source in re.findall(r"\bsource =\s*((?:\"[^\"]*\"\s*)+)", file.read_text(encoding="utf8")):
                for part in re.sub(r"\"\s*\"|\"", "", source).split(";"):
                    name, year = re.search(r"([A-Z][\w-]+)", part.replace("van Herk", "Herk")), re.search(r"\b(1[89]\d\d|20\d\d)\b", part)
                    if year and name and "Wittenbrink" not in part and "W93" not in part:
                        rows = [row for row in references.splitlines() if name.group(1) in row and year.group(1) in row]
                        if not rows:
                            missing.add(f"{file.relative_to(ROOT)}: {part.strip()}")
        self.assertEqual(sorted(missing), [])


if __name__ == "__main__":
    unittest.main()
