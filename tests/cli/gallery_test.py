"""docs/gallery.md: every command in it can still be planned, and every picture is there."""
import os
import pathlib
import re
import shlex
import subprocess
import unittest

EDGEWISE = os.environ["EDGEWISE"]
ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/gallery.md"
OF_CHARTS = ("-o", "--sweep", "--limit", "--quality")  # each with one word, not of `plan`


def planned(command):
    """`edgewise chart render FILE ... -o OUT` -> `plan render FILE ...`"""
    words = iter(shlex.split(command)[1:])
    kept = []
    for word in words:
        if word in OF_CHARTS:
            next(words)
        elif word != "chart":
            kept.append(word)
    return ["plan", *kept]


class Gallery(unittest.TestCase):
    def test_commands_are_understood(self):
        commands = re.findall(r"^edgewise (?:chart|render|warp) .*$", PAGE.read_text(), re.M)
        self.assertGreaterEqual(len(commands), 12)
        for command in commands:
            with self.subTest(command):
                done = subprocess.run([EDGEWISE, *planned(command), "--quiet"], cwd=ROOT, capture_output=True, text=True,
                                      timeout=60)
                self.assertEqual(done.returncode, 0, done.stderr)

    def test_pictures_are_there_and_made_by_a_command(self):
        text = PAGE.read_text()
        pictures = re.findall(r"!\[[^]]*\]\((gallery/[^)]*)\)", text)
        self.assertTrue(pictures)
        for picture in pictures:
            self.assertTrue((PAGE.parent / picture).exists(), picture)
            if picture.startswith("gallery/vtk_"):  # edgewise and VTK side by side
                maker = (ROOT / "benchmarks/gallery_vtk.py").read_text()
                self.assertIn("docs/gallery/vtk_{mode}.png", maker)
                self.assertIn(f'"{picture.removeprefix("gallery/vtk_").removesuffix(".png")}"', maker)
                self.assertIn("benchmarks/gallery_vtk.py\n```", text)
                continue
            if picture.startswith("gallery/default_"):  # a sheet of three commands, and its rows in the table
                name = picture.removeprefix("gallery/default_").removesuffix(".jpg")
                self.assertIn(f'    "{name}": (', (ROOT / "benchmarks/gallery_defaults.py").read_text())
                self.assertRegex(text, rf"\n\| {name} \| none \|.*\n\|  \| `--mode shaded` \|.*\n\|  \| `--mode composite` \|")
                continue
            if not picture.startswith("gallery/thesis"):
                self.assertIn(f"-o docs/{picture}", text)

    def test_each_kind_of_data_has_a_sheet(self):
        scenes = re.findall(r'^    "(\w+)": \(', (ROOT / "benchmarks/gallery_defaults.py").read_text(), re.M)
        self.assertGreaterEqual(len(scenes), 10)
        for name in scenes:
            self.assertIn(f"(gallery/default_{name}.jpg)", PAGE.read_text())

    def test_pictures_are_few_enough_for_a_clone(self):
        self.assertLess(sum(file.stat().st_size for file in (PAGE.parent / "gallery").iterdir()), 6e6)


if __name__ == "__main__":
    unittest.main()
