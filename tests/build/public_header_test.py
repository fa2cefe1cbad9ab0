"""What programs include compiles alone, with g++ and with clang, under warnings of theirs and without options of ours. Needs EDGEWISE,
whose build folder says where headers are."""

import json
import os
import pathlib
import shlex
import shutil
import subprocess
import tempfile
import unittest

COMMAND = pathlib.Path(os.environ.get("EDGEWISE", "build/release/bin/edgewise")).resolve()
HEADERS = ["edgewise/edgewise.hpp", "edgewise/volume.hpp", "engine/prepared.hpp"]
COMPILERS = [name for name in ("g++", "clang++-14", "clang++") if shutil.which(name)]


def folders():
    """Where the examples that include these headers find them."""
    for entry in json.loads((COMMAND.parent.parent / "compile_commands.json").read_text()):
        if entry["file"].endswith("examples/cine.cpp"):
            words = shlex.split(entry["command"])
            found = [word for word in words if word.startswith(("-I", "-D"))]
            for at, word in enumerate(words):
                if word == "-isystem":
                    found += words[at:at + 2]
            return found
    raise AssertionError("examples/cine.cpp is not built here")


class PublicHeader(unittest.TestCase):
    def test_compiles_alone(self):
        self.assertIn("g++", COMPILERS)
        where = folders()
        with tempfile.TemporaryDirectory() as folder:
            for header in HEADERS:
                source = pathlib.Path(folder) / "alone.cpp"
                source.write_text(f"#include <{header}>\n")
                for compiler in COMPILERS[:2]:
                    done = subprocess.run([compiler, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Wconversion", "-Werror", *where, source],
                                          capture_output=True, text=True)
                    self.assertEqual(done.returncode, 0, f"{compiler} {header}:\n{done.stderr[:2000]}")


if __name__ == "__main__":
    unittest.main()
