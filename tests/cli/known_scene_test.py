"""What is measured of data is kept from run to run: plans and facts are the same with and without, and never those of
other data."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time
import unittest

import numpy as np

EDGEWISE = os.environ["EDGEWISE"]


def without_bytes(json_value):
    """Predicted bytes begin with what the process holds, which differs between any two runs."""
    if isinstance(json_value, dict):
        return {key: without_bytes(value) for key, value in json_value.items() if key not in ("bytes", "bytes_high")}
    return [without_bytes(value) for value in json_value] if isinstance(json_value, list) else json_value


class KnownScene(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.scenes = self.folder / "cache/edgewise/scenes"

    def run_it(self, *arguments, cache=None):
        environment = {**os.environ, "XDG_CACHE_HOME": str(cache or self.folder / "cache"),
                       "XDG_CONFIG_HOME": str(self.folder / "config")}
        done = subprocess.run([EDGEWISE, *map(str, arguments)], capture_output=True, text=True, env=environment)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def report(self, *arguments, **options):
        return json.loads(self.run_it(*arguments, "--json", "-", **options).stdout)

    def plan(self, *arguments, **options):
        report = self.report("plan", *arguments, **options)
        for key in ("seconds", "parts", "startup_seconds"):  # that planning took
            del report["planning"][key]
        return without_bytes(report)

    def raw(self, samples, old=True):
        """A file, last changed long enough ago that its facts are kept."""
        path = self.folder / "a.raw"
        samples.tofile(path)
        if old:
            time.sleep(3.1)
        return f"raw:{path}:{'x'.join(str(n) for n in reversed(samples.shape))}:f32"

    def kept(self):
        return {path.name: path.read_bytes() for path in self.scenes.glob("*.json")} if self.scenes.is_dir() else {}

    def test_plans_and_facts_are_the_same_cold_and_warm(self):
        requests = [("render", "phantom:marschner-lobb:64", "--mode", mode, "--rotate", "10,20,30")
                    for mode in ("mip", "xray", "mean", "composite")]
        requests.append(("warp", "phantom:shepp-logan:80", "--rotate", "1,2,3", "--reference", "linear"))
        for request in requests:
            with self.subTest(request=request):
                before = self.kept()
                cold = self.plan(*request, "--max-error", "0.3")
                kept = self.kept()
                self.assertGreater(len(kept), len(before))
                warm = self.plan(*request, "--threads", "1", "--max-error", "0.2")
                self.assertEqual(kept, self.kept())  # nothing was measured anew
                plain = self.plan(*request, "--threads", "1", "--max-error", "0.2", cache=self.folder / "none")
                shutil.rmtree(self.folder / "none")
                self.assertEqual(warm, plain)
                self.assertEqual(cold, self.plan(*request, "--max-error", "0.3"))
        for name in ("phantom:shepp-logan:64", "phantom:zone-plate:500"):
            cold = self.report("info", name)
            self.assertEqual(cold, self.report("info", name))
            self.assertEqual(cold, self.report("info", name, cache=self.folder / "none"))

    def test_a_warm_plan_takes_its_facts_from_the_file(self):
        request = ("render", "phantom:marschner-lobb:64", "--rotate", "10,20,30")
        self.plan(*request)
        (file,) = self.scenes.glob("*-view-*.json")
        item = json.loads(file.read_text())
        item["fact"]["range"] = 123.5
        file.write_text(json.dumps(item))
        self.assertEqual(self.plan(*request)["scene"]["range"], 123.5)
        self.assertNotEqual(self.plan(*request[:2], "--rotate", "10,20,31")["scene"]["range"], 123.5)
        file.write_text("{")
        self.assertNotEqual(self.plan(*request)["scene"]["range"], 123.5)

    def test_a_changed_file_is_measured_anew(self):
        random = np.random.default_rng(1)
        volume = random.random((64, 64, 64)).astype("<f4")
        name = self.raw(volume)
        first = self.report("info", name)
        self.assertTrue(self.kept())
        times = os.stat(self.folder / "a.raw")
        volume[3, 4, 5] = 9
        self.raw(volume, old=False)
        # Not even with the same size and the same time of writing.
        os.utime(self.folder / "a.raw", ns=(times.st_atime_ns, times.st_mtime_ns))
        self.assertEqual(self.report("info", name)["range"][1], 9)
        self.assertLess(first["range"][1], 1)
        before = self.kept()
        self.report("info", name)
        self.assertEqual(before, self.kept())  # so new that another change might leave the same times
        time.sleep(3.1)
        self.assertEqual(self.report("info", name)["range"][1], 9)
        self.assertEqual(set(before), set(self.kept()))  # in the place of the old ones
        self.assertNotEqual(before, self.kept())
        self.assertEqual(self.report("info", name)["range"][1], 9)

    def test_a_part_of_a_file_is_other_data(self):
        volume = np.random.default_rng(2).random((96, 64, 64)).astype("<f4")
        volume[:32] += 3
        whole = self.raw(volume)
        part = f"raw:{self.folder / 'a.raw'}:64x64x64:f32:{4 * 32 * 64 * 64}"
        for _ in range(2):
            self.assertGreater(self.report("info", whole)["range"][1], 3)
            self.assertLess(self.report("info", part)["range"][1], 1)

    def test_no_folder_to_keep_facts_in_is_no_error(self):
        file = self.folder / "file"
        file.write_text("not a folder")
        request = ("render", "phantom:marschner-lobb:48", "--rotate", "10,20,30")
        plain = self.plan(*request)
        self.assertEqual(plain, self.plan(*request, cache=file))
        done = self.run_it("plan", *request, cache=file)
        self.assertNotIn("cache", done.stderr)
        self.assertEqual(self.report("info", request[1]), self.report("info", request[1], cache=file))

    def test_opaque_rays_are_part_of_what_a_plan_knows(self):
        points = [{"value": 0, "opacity": 0, "color": [0, 0, 0]}, {"value": 1, "opacity": 1, "color": [1, 1, 1]}]
        (self.folder / "t.json").write_text(json.dumps({"points": points}))
        request = ("render", "phantom:cube:64", "--mode", "composite")
        solid = self.plan(*request, "--transfer", self.folder / "t.json")["scene"]
        thin = self.plan(*request)["scene"]
        self.assertGreater(solid["rays"]["opaque"], 0.05)
        self.assertLess(solid["rays"]["taken"], 0.9 * solid["rays"]["samples"])
        self.assertEqual(thin["rays"]["opaque"], 0)


if __name__ == "__main__":
    unittest.main()
