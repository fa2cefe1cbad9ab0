"""Examples bring graphs of their own: their edges, jobs and kinds of data are known to no source of the library, and
they are written with what the library offers to every program."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIBRARY = ["graph", "planner", "runtime", "scene", "transitions", "engine", "cli", "reference", "io", "surface", 
           "measure", "transfer", "request", "settings", "presentation", "evaluation"]
# What an installed library has: headers of these folders (cmake/edgewise_install.cmake).
OFFERED = ["edgewise", "graph", "planner", "runtime", "scene", "transitions", "engine", "reference", "measure", "transfer", "request",
           "evaluation"]
EXAMPLES = sorted(file for file in (ROOT / "examples").iterdir() if file.suffix in (".cpp", ".hpp"))


def code_of(file):
    return re.sub(r"//[^\n]*", "", file.read_text())


def sources(folders):
    for folder in folders:
        for file in sorted((ROOT / folder).rglob("*")):
            if file.suffix in (".cpp", ".hpp", ".json"):
                yield file


def names():
    """What graphs of examples are made of: families of edges, and kinds of data."""
    found = set()
    for file in EXAMPLES:
        code = code_of(file)
        found |= set(re.findall(r'plain_edge\(\s*"([a-z_]+\.)', code))
        found |= set(re.findall(r'\.target = "([a-z_/]+)"', code))
    return found


class Examples(unittest.TestCase):
    def test_names_are_found(self):
        self.assertLessEqual({"matrix.", "matrix/product"}, names())

    def test_no_source_of_the_library_names_what_is_an_examples_own(self):
        hits = []
        for file in sources(LIBRARY):
            text = file.read_text() if file.suffix == ".json" else code_of(file)
            hits += [f"{file.relative_to(ROOT)}: {name}" for name in names() if f'"{name}' in text]
        self.assertEqual(hits, [])

    def test_matrices_are_nowhere_known(self):
        for file in sources(["graph", "planner", "runtime"]):
            self.assertNotRegex(code_of(file), r'"matrix[./]|matrix_(edge|product)|cblas|EDGEWISE_OPENBLAS', file)

    def test_what_they_include_is_theirs_or_offered(self):
        own = {file.name for file in EXAMPLES}
        for file in EXAMPLES:
            for header in re.findall(r'#include "([^"]+)"', file.read_text()):
                offered = header.split("/")[0] in OFFERED and (ROOT / header).is_file()
                self.assertTrue(header in own or offered, f"{file.name}: {header}")

    def test_each_is_short_enough_to_read(self):
        for file in EXAMPLES:
            if file.suffix == ".cpp":
                most = 100 if file.name == "http_tiles.cpp" else 80  # a server is a little longer
                self.assertLessEqual(len(file.read_text().splitlines()), most, file.name)


if __name__ == "__main__":
    unittest.main()
