"""Runs the command as a user does, for the tests of this folder whose runs share a folder. Needs EDGEWISE and EDGEWISE_DATA."""

import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
DATA = pathlib.Path(os.environ.get("EDGEWISE_DATA", "data"))


class Running(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        # A home of its own: a profile of whoever runs the tests must not change their plans.
        cls.env = {**os.environ, "XDG_CONFIG_HOME": str(cls.folder / "config"), "XDG_CACHE_HOME": str(cls.folder / "cache")}

    def run_it(self, *words, code=0, env=None):
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=200, env=env or self.env)
        self.assertEqual(done.returncode, code, f"{words}: {done.stderr.decode(errors='replace')}")
        return done
