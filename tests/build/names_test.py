"""Edges, filters, modes and jobs are known by name in their own files alone, so that one more is a file pair and a line.

Facts of scenes are named once, by who measures them.
"""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ["graph", "planner", "runtime", "scene", "surface", "reference", "transitions", "measure", "transfer",
           "request", "settings", "presentation", "engine", "evaluation", "cli"]
# What SciPy, OpenCV and VTK always do, as paths.
OTHERS = ["cli/audit/audit_fixed.cpp"]


def sources(*folders):
    for folder in folders:
        for file in sorted((ROOT / folder).rglob("*")):
            if file.suffix in (".cpp", ".hpp"):
                yield file.relative_to(ROOT).as_posix()


def code_of(file):
    """Its text without comments and includes."""
    text = re.sub(r"//[^\n]*", "", (ROOT / file).read_text())
    return re.sub(r"#include[^\n]*", "", text)


def found(pattern, allowed, folders=FOLDERS):
    hits = []
    for file in sources(*folders):
        if any(file.startswith(each) for each in allowed):
            continue
        hits += [f"{file}: {hit.group(0)}" for hit in re.finditer(pattern, code_of(file))]
    return hits


def names_in(folder, pattern):
    """[(name, file)] of what the files of a folder define."""
    return [(hit.group(1), file) for file in sources(folder) for hit in re.finditer(pattern, code_of(file))]


class Names(unittest.TestCase):
    def test_edges_are_named_in_their_own_files(self):
        edges = names_in("transitions", r"\.name\s*=\s*\"([a-z]+\.[a-z_]+)\"")
        self.assertGreaterEqual(len(edges), 14)
        for name, file in edges:
            room = file.removesuffix(".cpp")
            self.assertEqual(found(rf"\"{re.escape(name)}[\"/]", [room, *OTHERS]), [], name)

    def test_filters_are_named_in_their_own_files_and_where_edges_list_what_they_try(self):
        filters = names_in("transitions/filters", r"\.name\s*=\s*\"([a-z0-9]+)\"")
        self.assertGreaterEqual(len(filters), 5)
        lists = r"(any_filter|one_of)\(\{[^}]*\}"
        hits = []
        for file in sources(*FOLDERS):
            # What is compared with by default is linear interpolation (graph/request.hpp: Like). Of a description the
            # errors of three usual filters are guessed.
            if file.startswith(("transitions/filters/", "graph/request.", "request/describe.")) or file in OTHERS:
                continue
            code = re.sub(lists, "", code_of(file))
            hits += [f"{file}: {name}" for name, _ in filters if f'"{name}"' in code]
        self.assertEqual(hits, [])

    def test_modes_are_named_in_their_own_files(self):
        modes = [name for name, _ in names_in("graph/modes", r"\.name\s*=\s*\"([a-z]+)\"")]
        self.assertGreaterEqual(len(modes), 6)
        # Statistics have a mean too, a filter is called so, and a request has a surface; its default is a mode.
        allowed = ["graph/modes/", "graph/request.hpp", "settings/light.cpp", "settings/kernel.cpp", "cli/info.cpp",
                   "engine/facts/facts_json.cpp", "graph/request_fields.hpp", "cli/session/report.cpp", "request/query.hpp"]
        names = "|".join(modes)
        self.assertEqual(found(rf"\"({names})\"|\bMode::({names})\b", allowed), [])

    def test_each_room_includes_only_what_it_may(self):
        """The engine never includes the command; the command no kernel, no edge, and nothing of measuring."""
        def includes(folder):
            for file in sources(folder):
                for header in re.findall(r'#include "([^"]+)"', (ROOT / file).read_text()):
                    yield file, header
        for folder in ("engine", "evaluation", "edgewise"):
            self.assertEqual([each for each in includes(folder) if each[1].startswith("cli/")], [])
        library = ["graph", "io", "planner", "runtime", "scene", "surface", "reference", "transitions", "charts",
                   "measure", "transfer", "request", "settings", "presentation"]
        above = ("cli/", "engine/", "evaluation/")
        for folder in library:
            self.assertEqual([each for each in includes(folder) if each[1].startswith(above)], [])
        self.assertEqual([each for each in includes("engine") if each[1].startswith("evaluation/")], [])
        # The list of all edges, and the filters that --help and list show, are no edges.
        allowed = ("transitions/catalogue.hpp", "transitions/filters/filter.hpp")
        rooms = ("transitions/", "measure/machine_probe", "measure/probe_fit", "measure/repeated",
                 "measure/watch")
        self.assertEqual([each for each in includes("cli") if each[1].startswith(rooms) and each[1] not in allowed],
                         [])

    def test_facts_are_read_by_what_declares_them(self):
        declared = []
        for file in sources(*FOLDERS):
            for group in re.finditer(r"constexpr Fact(?:Family)? [^;]*;", code_of(file)):
                declared += [(name, file) for name in re.findall(r'\w+\{"([^"]+)"\}', group.group(0))]
        self.assertGreaterEqual(len(declared), 25)
        names = [name for name, _ in declared]
        self.assertEqual(sorted(names), sorted(set(names)))
        # No scene is asked by a text, and no name of one fact stands in a second place.
        self.assertEqual(found(r'\b(fact|measured|FactName)\(\s*"[^"]*"', []), [])
        self.assertEqual(found(r'\b(facts|likely)(\.(at|find|contains|erase)\(|\[)\s*"[^"]*"', []), [])
        for name, file in declared:
            if "/" in name:
                self.assertEqual(found(rf'"{re.escape(name)}["/]', [file]), [], name)

    def test_the_environment_is_read_by_the_command_alone(self):
        """What it says reaches the library as values: threads, folders, files of programs."""
        library = [room for room in FOLDERS if room != "cli"] + ["io", "charts", "edgewise"]
        self.assertEqual(found(r"\b(secure_)?getenv\b|\bposix_spawnp\b|\bexecvpe?\b|\bexeclp\b", [], library), [])
        self.assertNotEqual(found(r"\bgetenv\b", [], ["cli"]), [])

    def test_jobs_answer_questions_themselves(self):
        """Engine and command ask a job what it is (graph/job.hpp); few places mean one job and no other."""
        rooms = ["request/", "settings/", "cli/request/"]  # where words and settings of each job are
        hits = found(r"\bJob::[a-z]+", rooms, ["engine", "measure", "transfer",
                     "request", "settings", "presentation", "evaluation", "cli"])
        self.assertLessEqual(len(hits), 7, hits)

    def test_the_library_knows_no_job(self):
        library = ["graph", "planner", "runtime", "scene", "surface", "reference", "transitions"]
        self.assertEqual(found(r"\bJob::[a-z]+", ["graph/job.", "graph/request.hpp"], library), [])


if __name__ == "__main__":
    unittest.main()
