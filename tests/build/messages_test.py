"""Messages of the library name settings, fields of a query; how the command calls these is its own.

A person who uses the library reads `zoom: 0 is not greater than 0`, one who types reads `--zoom: 0 ...`.
"""
import os
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMMAND = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
LIBRARY = ["engine", "measure", "transfer", "request", "settings", "presentation", "evaluation",
           "io", "graph", "transitions", "planner", "runtime", "scene", "reference", "surface", "charts"]
VERBS = ["render", "warp", "mesh", "filter", "radon", "plan", "info"]


def sources(folder):
    return sorted(file for file in (ROOT / folder).rglob("*") if file.suffix in (".cpp", ".hpp", ".in"))


def literals(file):
    """[(line, text)] of string literals outside comments."""
    for number, line in enumerate(file.read_text().splitlines(), 1):
        for hit in re.finditer(r'"((?:[^"\\]|\\.)*)"', re.sub(r"^\s*//.*", "", line)):
            yield number, hit.group(1)


def found(pattern):
    return [f"{file.relative_to(ROOT)}:{line}: {text}" for folder in LIBRARY for file in sources(folder)
            for line, text in literals(file) if re.search(pattern, text)]


def settings():
    return re.findall(r'"([a-z_]+)"', (ROOT / "graph/settings.hpp").read_text())


def renamed():
    """The options whose names do not follow from their settings, as rows of the table have them."""
    found = {}
    for file in sources("settings"):
        for row in file.read_text().split("QuerySetting{")[1:]:
            name, option = re.match(r'\s*"([a-z_]+)",', row), re.search(r'\.typed_as\("([a-z-]+)"\)', row)
            if name and option:
                found[name.group(1)] = ("-" if len(option.group(1)) == 1 else "--") + option.group(1)
    return found


class Texts(unittest.TestCase):
    def test_no_text_of_the_library_names_an_option(self):
        self.assertEqual(found(r"--[a-z]|(^|[ `'(])-o\b"), [])

    def test_no_text_of_the_library_names_the_command(self):
        self.assertEqual(found(r"`edgewise "), [])


class Options(unittest.TestCase):
    def test_every_setting_is_an_option(self):
        options = set()
        for verb in VERBS:
            done = subprocess.run([COMMAND, verb, "--help-all"], capture_output=True, text=True, check=True)
            options |= set(re.findall(r"(?<![\w-])(--?[a-z][a-z-]*)", done.stdout))
        names = renamed()
        self.assertGreaterEqual(len(names), 8)
        self.assertGreaterEqual(len(settings()), 70)
        missing = [name for name in settings() if names.get(name, "--" + name.replace("_", "-")) not in options]
        self.assertEqual(missing, [])


if __name__ == "__main__":
    unittest.main()
