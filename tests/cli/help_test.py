"""`--help` of a verb fits a screen and tells the truth: its examples run, its options are there. Needs EDGEWISE and
EDGEWISE_DATA."""

import re
import shlex
import unittest

import numpy as np
from files import write_nrrd
from running import DATA, Running

VERBS = ["render", "warp", "filter", "mesh", "radon"]


class Help(Running):
    def help(self, verb, flag="--help"):
        return self.run_it(verb, flag).stdout.decode()

    def test_it_fits_a_screen(self):
        for verb in VERBS:
            lines = self.help(verb).splitlines()
            with self.subTest(verb=verb):
                self.assertLessEqual(len(lines), 40)
                self.assertLessEqual(max(map(len, lines)), 100)

    def test_its_options_are_there(self):
        for verb in VERBS:
            everything = self.help(verb, "--help-all")
            for option in re.findall(r"(?<![\w-])--?[a-z][a-z-]*", self.help(verb)):
                with self.subTest(verb=verb, option=option):
                    self.assertRegex(everything, rf"(?<![\w-]){option}\b")

    def test_all_options_are_in_groups(self):
        for verb in ("render", "warp"):
            everything = self.help(verb, "--help-all")
            for group in ("Geometry", "Budgets"):
                self.assertIn(group, everything)
            self.assertGreater(len(everything.splitlines()), 60)

    def files(self):
        """The files of the examples, by name."""
        labels = np.zeros((12, 14, 16), np.uint8)
        labels[3:9, 3:9, 3:9] = 1
        labels[3:9, 3:9, 9:13] = 2
        write_nrrd(self.folder / "seg.nrrd", labels)
        # A sinogram with its angles, as an earlier example writes it.
        self.run_it("warp", DATA / "coffee/coffee.png", "-o", self.folder / "photo.png", "--size", "60", "--channel", "0")
        self.run_it("radon", self.folder / "photo.png", "-o", self.folder / "sinogram.nrrd", "--angles", "60", "--bits", "32")
        return {"head.nii.gz": DATA / "mr_brain/MR.nii.gz", "ct/": DATA / "ct_chest/chest.nrrd", "stack.tif": DATA / "neuron/neuron.tif",
                "photo.png": self.folder / "photo.png", "seg.nrrd": self.folder / "seg.nrrd", "sinogram.nrrd": self.folder / "sinogram.nrrd"}

    def test_its_examples_run(self):
        files = self.files()
        for verb in VERBS:
            examples = re.findall(r"^  edgewise (.*)$", self.help(verb), re.M)
            self.assertEqual(len(examples), 5)
            for example in examples:
                words = shlex.split(example)
                self.assertEqual(words[0], verb)
                out = words.index("-o") + 1
                file = words[out]
                words[1] = files[words[1]]
                if file != "null:":
                    words[out] = self.folder / f"out_{file}"
                with self.subTest(example=example):
                    self.run_it(*words)
                    self.assertTrue(file == "null:" or words[out].exists())


if __name__ == "__main__":
    unittest.main()
