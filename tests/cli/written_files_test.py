"""Files that users write: the examples of docs/files.md work as they stand, and an error in one names the field and what is right."""
import copy
import json
import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from running import Running  # noqa: E402

DOCS = pathlib.Path(__file__).parents[2] / "docs/files.md"
TRANSFER, TABLE, MACHINE = (json.loads(text) for text in re.findall(r"```json\n(.*?)```", DOCS.read_text(), re.S))


def changed(value, *path, to):
    value = copy.deepcopy(value)
    inner = value
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = to
    return value


class WrittenFiles(Running):
    def file(self, content):
        file = self.folder / "written.json"
        file.write_text(content if isinstance(content, str) else json.dumps(content))
        return file

    def render(self, content, code=0):
        return self.run_it("plan", "render", "phantom:gaussians:12", "--mode", "composite", "--transfer",
                           self.file(content), code=code).stderr.decode()

    def machine(self, content, code=0):
        return self.run_it("plan", "render", "phantom:gaussians:12", "--machine", self.file(content), code=code)

    def test_the_examples_work(self):
        self.render(TRANSFER)
        self.assertIn(b"machine workstation", self.machine(MACHINE).stdout)

    def test_an_error_in_a_transfer_function_names_the_field_and_what_is_right(self):
        for content, words in (
                (changed(TRANSFER, "points", 1, "opacity", to=1.5), ["points[1].opacity is 1.5", "from 0 to 1"]),
                (changed(TRANSFER, "points", 1, "color", to=[1, 2]), ["points[1].color is [1,2]", "three numbers", '"color": [1, 0.9, 0.8]']),
                (changed(TRANSFER, "points", 2, "value", to=-600), ["points[2].value is -600", "ascend"]),
                (changed(TRANSFER, "points", 0, to={"value": 1, "color": [0, 0, 0]}), ["points[0] has no 'opacity'", '"opacity": 0.05']),
                (changed(TRANSFER, "points", 0, "colour", to=[0, 0, 0]), ["points[0].colour", "color"]),
                (changed(TRANSFER, "units", to=2), ["units", "unit"]),
                (changed(TRANSFER, "unit", to=0), ["unit is 0"]),
                ({"unit": 1}, ["points", '"value": 300']),
                ('{"points": [{"value": 1e400, "opacity": 0, "color": [0, 0, 0]}]}', ["1e400"]),
                ('{"points": [\n{"value": 1,}]}', ["not JSON", "line 2"])):
            said = self.render(content, code=2)
            for word in ["written.json", *words]:
                self.assertIn(word, said)

    def test_an_error_in_a_machine_names_the_field_and_what_is_right(self):
        for content, words in (
                (changed(MACHINE, "operation", to="fast"), ["operation", 'is "fast"', "number from 0 to 1"]),
                (changed(MACHINE, "gather", to=-1), ["gather", "is -1", "0 to 1"]),
                (changed(MACHINE, "processors", to=0), ["processors", "is 0", "1 to"]),
                (changed(MACHINE, "procesors", to=4), ["procesors", "no such field", "processors"]),
                (changed(MACHINE, "schema", to=2), ["schema", '"schema": 1']),
                (changed(MACHINE, "levels", to=[{"bytes": "x", "streamed": 0, "gather": 0}]), ["levels.0.bytes"]),
                ('{"schema": 1, "operation": 1e400}', ["1e400"]),
                ('{"schema": 1,\n"name": }', ["not JSON", "line 2"])):
            said = self.machine(content, code=4).stderr.decode()
            for word in ["written.json", *words]:
                self.assertIn(word, said)


if __name__ == "__main__":
    unittest.main()
