"""The command as a user meets it: exit codes, messages, reports, files. Needs EDGEWISE."""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import numpy as np

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")


def run(*words, env=None, timeout=120):
    return subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=timeout,
                          env={**os.environ, **(env or {})})


def write_nrrd(path, array, spacing=(1, 1, 1)):
    names = {"u1": "uint8", "i2": "int16", "u2": "uint16", "f4": "float"}
    sizes = " ".join(map(str, array.shape[::-1]))
    spacings = " ".join(map(str, spacing[:array.ndim]))
    head = (f"NRRD0004\ntype: {names[array.dtype.str[1:]]}\ndimension: {array.ndim}\n"
            f"sizes: {sizes}\nspacings: {spacings}\nendian: little\nencoding: raw\n\n")
    pathlib.Path(path).write_bytes(head.encode() + array.tobytes())


def read_nrrd(path):
    head, data = pathlib.Path(path).read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines()[1:]
                  if ": " in line and not line.startswith("#"))
    types = {"uint8": "u1", "unsigned char": "u1", "uchar": "u1", "int16": "i2", "short": "i2",
             "uint16": "u2", "ushort": "u2", "unsigned short": "u2", "float": "f4"}
    sizes = [int(size) for size in fields["sizes"].split()]
    return np.frombuffer(data, "<" + types[fields["type"]]).reshape(sizes[::-1])


class Command(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, self.folder)
        # A home of its own: a profile of whoever runs the tests must not change their plans.
        self.env = {"XDG_CONFIG_HOME": str(self.folder / "config")}

    def run_it(self, *words, code=0, env=None):
        done = run(*words, env={**self.env, **(env or {})})
        self.assertEqual(done.returncode, code, f"{words}: {done.stderr.decode(errors='replace')}")
        return done

    def report(self, *words, code=0):
        done = self.run_it(*words, "--json", "-", "--quiet", code=code)
        return json.loads(done.stdout)

    def left(self):
        return sorted(path.name for path in self.folder.iterdir())


class Basics(Command):
    def test_no_arguments_is_help_on_standard_error(self):
        done = self.run_it(code=2)
        self.assertEqual(done.stdout, b"")
        self.assertIn(b"render", done.stderr)

    def test_help_and_version_are_on_standard_output(self):
        self.assertRegex(self.run_it("--version").stdout.decode(), r"^edgewise \d+\.\d+\.\d+\n$")
        for words in (["--help"], ["warp", "--help"], ["plan", "render", "--help"]):
            done = self.run_it(*words)
            self.assertGreater(len(done.stdout), 100)
            self.assertEqual(done.stderr, b"")

    def test_starts_quickly(self):
        seconds = []
        for _ in range(5):
            begin = time.perf_counter()
            self.run_it("--version")
            seconds.append(time.perf_counter() - begin)
        # 30 ms on an idle machine; starting a process from Python takes some of it.
        self.assertLess(min(seconds), 0.1)

    def test_unknown_words_are_answered(self):
        self.assertIn(b"render", self.run_it("sharpen", "x", code=2).stderr)
        done = self.run_it("warp", "phantom:cube:8", "-o", "null:", "--antialias", code=2)
        self.assertIn(b"--antialias", done.stderr)
        self.assertIn(b"warp --help", done.stderr)
        done = self.run_it("render", "phantom:cube:8", "-o", "null:", "--mode", "hologram", code=2)
        self.assertIn(b"mip, xray, mean, composite", done.stderr)

    def test_lists(self):
        for what in ("edges", "filters", "modes", "formats", "phantoms", "machines", "presets"):
            self.assertGreater(len(self.run_it("list", what).stdout), 3)
            entries = json.loads(self.run_it("list", what, "--json", "-").stdout)[what]
            self.assertTrue(all("name" in entry for entry in entries), what)
        self.run_it("list", "nothing", code=2)

    def test_graph_without_a_request(self):
        self.assertTrue(self.run_it("graph").stdout.startswith(b"digraph"))

    def test_graph_of_a_request(self):
        dot = self.folder / "g.dot"
        self.run_it("graph", "render", "phantom:sphere:16", "--rotate", "1,2,3", "-o", dot)
        self.assertIn("project.ray_cast", dot.read_text())
        file = self.folder / "g.json"
        self.run_it("graph", "warp", "phantom:sphere:16", "--rotate", "1,2,3", "-o", file)
        graph = json.loads(file.read_text())
        self.assertTrue(graph["edges"] and graph["vertices"])
        self.assertIsNotNone(graph["edges"][0]["cost"]["seconds"])


class Reports(Command):
    def check_predicted(self, predicted):
        self.assertLessEqual({"seconds", "bytes", "error"}, set(predicted))

    def test_render(self):
        out = self.folder / "p.png"
        report = self.report("render", "phantom:noise:32", "-o", out, "--rotate", "10,20,30",
                             "--verify=100", "--repeat", "3", "--max-error", "0.5")
        self.assertEqual(report["schema"], 1)
        self.assertEqual(report["request"]["job"], "render")
        self.assertEqual(report["request"]["mode"], "mip")
        self.assertEqual(report["request"]["budget"],
                         {"error": 0.5, "default": None, "seconds": None, "bytes": None})
        self.assertEqual(report["request"]["frames"], 1)
        for step in report["plan"]["steps"]:
            self.assertLessEqual({"transition", "from", "to", "parameters", "predicted"}, set(step))
            self.check_predicted(step["predicted"])
        self.check_predicted(report["plan"]["predicted"])
        self.assertTrue(report["front"])
        self.assertIsInstance(report["refused"], list)
        self.assertLessEqual({"seconds", "planner", "machine", "vertices", "edges"},
                             set(report["planning"]))
        measured = report["measured"]
        self.assertEqual(len(measured["seconds"]), 3)
        self.assertTrue(measured["kept"])
        self.assertLessEqual({"nrmse", "low", "high", "max", "range", "samples"},
                             set(measured["error"]))
        self.assertLessEqual(measured["error"]["low"], measured["error"]["nrmse"])
        self.assertLessEqual(measured["error"]["nrmse"], measured["error"]["high"])
        self.assertGreater(measured["bytes"], 1 << 20)
        self.assertEqual([step["transition"] for step in measured["steps"]],
                         [step["transition"] for step in report["plan"]["steps"]])
        self.assertEqual(report["outputs"], [str(out)])

    def test_front_is_written_as_via_takes_it(self):
        words = ["render", "phantom:noise:24", "-o", "null:", "--rotate", "10,20,30", "--size", "native"]
        for plan in self.report(*words)["front"][:4]:
            via = [word for step in plan["steps"] for word in ("--via", step)]
            forced = self.report(*words, *via, "--max-error", "9")
            texts = [step["transition"] for step in forced["plan"]["steps"]]
            self.assertEqual(texts, [step.split("/")[0] for step in plan["steps"]])

    def test_plan_has_neither_measured_nor_outputs(self):
        report = self.report("plan", "warp", "phantom:noise:16", "--rotate", "1,2,3")
        self.assertNotIn("measured", report)
        self.assertNotIn("outputs", report)
        self.assertTrue(report["plan"]["steps"])

    def test_plan_explains_as_a_table(self):
        table = self.run_it("plan", "render", "phantom:noise:16").stdout.decode()
        for word in ("plan", "paths", "error", "refused"):
            self.assertIn(word, table)

    def test_explanation_leaves_standard_output_to_the_report(self):
        done = self.run_it("warp", "phantom:noise:16", "-o", "null:", "--explain", "--json", "-")
        json.loads(done.stdout)
        self.assertIn(b"paths", done.stderr)

    def test_no_plan_is_exit_3_with_the_nearest(self):
        out = self.folder / "n.png"
        report = self.report("render", "phantom:noise:32", "-o", out, "--rotate", "3,4,5",
                             "--max-error", "1e-9", "--max-time", "1us", code=3)
        self.assertEqual(report["error"]["code"], 3)
        self.assertIsNone(report["plan"])
        self.assertTrue(report["error"]["nearest"])
        self.check_predicted(report["error"]["nearest"][0]["predicted"])
        self.assertEqual(self.left(), [])

    def test_a_bad_command_line_still_reports(self):
        report = self.report("warp", "phantom:noise:16", "-o", "null:", "--rotate", "nan,0,0",
                             code=2)
        self.assertEqual(report["error"]["code"], 2)
        report = self.report("warp", "phantom:noise:16", "-o", "null:", "--no-such", code=2)
        self.assertEqual(report["error"]["code"], 2)

    def test_a_budget_of_time_alone_asks_for_the_least_error(self):
        report = self.report("plan", "render", "phantom:noise:16", "--max-time", "10s")
        self.assertEqual(report["request"]["minimize"], "error")
        self.assertIsNone(report["request"]["budget"]["error"])

    def test_the_default_budget(self):
        for job in ("warp", "render"):
            budget = self.report("plan", job, "phantom:noise:16")["request"]["budget"]
            self.assertEqual(budget, {"error": None, "default": "linear", "seconds": None, "bytes": None})

    def test_the_variables_stand_for_the_options(self):
        words = ["plan", "render", "phantom:noise:16", "--json", "-"]
        threads = json.loads(self.run_it(*words, env={"EDGEWISE_THREADS": "3"}).stdout)
        self.assertEqual(threads["request"]["threads"], 3)
        both = self.run_it(*words, "--threads", "2", env={"EDGEWISE_THREADS": "3"}).stdout
        self.assertEqual(json.loads(both)["request"]["threads"], 2)
        self.run_it(*words, env={"EDGEWISE_THREADS": "none"}, code=2)
        self.run_it(*words, env={"EDGEWISE_MACHINE": "none"}, code=2)

    def test_names_that_are_not_text(self):
        name = os.fsencode(self.folder) + b"/\xff.nrrd"
        done = subprocess.run([COMMAND, "warp", "phantom:cube:8", "-o", name, "--json", "-"],
                              capture_output=True, env={**os.environ, **self.env})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(json.loads(done.stdout)["outputs"][0].endswith("\ufffd.nrrd"))
        self.assertTrue(os.path.exists(name))

    def test_trace_and_flow(self):
        trace, flow = self.folder / "t.json", self.folder / "f.dot"
        self.run_it("render", "phantom:noise:16", "-o", "null:", "--trace", trace, "--flow", flow)
        self.assertEqual(json.loads(trace.read_text())[0]["ph"], "X")
        self.assertIn("digraph", flow.read_text())


class Refusals(Command):
    def test_requests_that_make_no_sense(self):
        volume, image = "phantom:noise:16", "phantom:checker:16"
        cases = [["warp", volume, "--rotate", "30"], ["warp", volume, "--size", "0x0x0"],
                 ["warp", volume, "--matrix", "1,0,0,0,0,0,0,0,1"], ["render", image],
                 ["warp", volume, "--via", "no.such.edge"], ["warp", volume, "--max-error", "-1"],
                 ["warp", volume, "--via", "warp.backward/filter=none"],
                 ["warp", volume, "--orient", "RRR"], ["warp", volume, "--threads", "0"],
                 ["render", volume, "--window", "3,3"], ["render", volume, "--background", "2,0,0"],
                 ["render", volume, "--zero", "3"], ["warp", volume, "--channel", "4"],
                 ["warp", volume, "--seed", "-1"], ["warp", volume, "--repeat", "0"],
                 ["warp", volume, "--range", "0"], ["warp", volume, "--log", "loud"],
                 ["warp", volume, "--planner", "guess"], ["warp", "phantom:none:16"],
                 ["warp", "phantom:cube:0"]]
        for words in cases:
            done = self.run_it(*words, "-o", "null:", code=2)
            self.assertTrue(done.stderr.startswith(b"edgewise: "), words)
            self.assertEqual(done.stdout, b"")

    def test_outputs_are_checked_before_any_work(self):
        # The input is not there either: had it been looked for first, this would be exit 4.
        for out in ("absent/a.png", "a.xyz", "a", "%x.png"):
            self.run_it("render", "absent.nii", "-o", self.folder / out, code=2)
        self.run_it("render", "absent.nii", "-o", "null:", "--json", self.folder / "no/r.json",
                    code=2)
        done = self.run_it("render", "phantom:cube:16", "-o", self.folder / "a.png",
                           "--turntable", "3", code=2)
        self.assertIn(b"%03d", done.stderr)
        self.assertEqual(self.left(), [])

    def test_inputs_that_are_not_there(self):
        done = self.run_it("render", self.folder / "absent.nii", "-o", "null:", code=4)
        self.assertIn(b"absent.nii", done.stderr)

    def test_an_edge_that_cannot_serve_says_why(self):
        done = self.run_it("render", "phantom:noise:16", "-o", "null:", "--mode", "mip", "--rotate",
                           "3,4,5", "--via", "spectrum.slice", code=3)
        self.assertIn(b"spectrum.slice: ", done.stderr)

    def test_sizes_beyond_memory(self):
        for size in ("2000000x2000000x2000000", "30000x30000x30000"):
            self.run_it("warp", "phantom:noise:16", "-o", "null:", "--size", size, code=3)
        self.run_it("warp", "phantom:noise:16", "-o", "null:", "--max-memory", "1MiB", code=3)

    def test_quiet_leaves_errors_only(self):
        done = self.run_it("warp", "phantom:noise:16", "-o", "null:", "--quiet")
        self.assertEqual(done.stderr + done.stdout, b"")
        for verb in (("info", "phantom:noise:16"), ("compare", "phantom:noise:8", "phantom:cube:8")):
            self.assertEqual(self.run_it(*verb, "--quiet").stderr, b"")


class Files(Command):
    def test_the_identity_keeps_every_sample(self):
        rng = np.random.default_rng(1)
        for kind in ("u1", "i2", "u2", "f4"):
            samples = rng.integers(0, 200, (5, 6, 7)).astype("<" + kind)
            write_nrrd(self.folder / "a.nrrd", samples, (0.3, 0.7, 2))
            self.run_it("warp", self.folder / "a.nrrd", "-o", self.folder / "b.nrrd")
            result = read_nrrd(self.folder / "b.nrrd")
            self.assertEqual(result.dtype, samples.dtype)
            np.testing.assert_array_equal(result, samples)

    def test_quarter_turns_are_clockwise(self):
        samples = np.arange(30, dtype="u1").reshape(5, 6)
        write_nrrd(self.folder / "a.nrrd", samples)
        self.run_it("warp", self.folder / "a.nrrd", "-o", self.folder / "b.nrrd", "--rotate", "90",
                    "--size", "fit")
        np.testing.assert_array_equal(read_nrrd(self.folder / "b.nrrd"), np.rot90(samples, -1))

    def test_a_mip_along_z_is_the_largest_of_each_column(self):
        samples = np.random.default_rng(2).random((6, 7, 8), "f4")
        write_nrrd(self.folder / "a.nrrd", samples)
        self.run_it("render", self.folder / "a.nrrd", "-o", self.folder / "p.nrrd", "--size", "native",
                    "--via", "project.ray_cast/filter=foh/step=1")
        # Steps of one sample meet the centres; 3 roundings of f32.
        np.testing.assert_allclose(read_nrrd(self.folder / "p.nrrd"), samples.max(0), rtol=1e-6)

    def test_frames_are_numbered(self):
        self.run_it("render", "phantom:noise:16", "-o", self.folder / "f_%02d.png", "--turntable",
                    "3")
        self.assertEqual(self.left(), ["f_00.png", "f_01.png", "f_02.png"])

    def test_threads_change_no_byte(self):
        written = []
        for threads in (1, 2, 5):
            out = self.folder / f"t{threads}.nrrd"
            self.run_it("warp", "phantom:noise:40", "-o", out, "--rotate", "10,20,30", "--threads",
                        threads)
            written.append(out.read_bytes())
        self.assertEqual(len(set(written)), 1)

    def test_out_may_be_the_input(self):
        samples = np.arange(24, dtype="u1").reshape(2, 3, 4)
        write_nrrd(self.folder / "a.nrrd", samples)
        self.run_it("warp", self.folder / "a.nrrd", "-o", self.folder / "a.nrrd")
        np.testing.assert_array_equal(read_nrrd(self.folder / "a.nrrd"), samples)
        self.assertEqual(self.left(), ["a.nrrd"])

    def test_values_that_a_picture_cannot_hold_become_a_view(self):
        samples = np.linspace(-1000, 1000, 64).reshape(8, 8).astype("<i2")
        write_nrrd(self.folder / "a.nrrd", samples)
        self.run_it("warp", self.folder / "a.nrrd", "-o", self.folder / "b.png", "--window",
                    "-1000,1000")
        report = json.loads(self.run_it("info", self.folder / "b.png", "--json", "-").stdout)
        self.assertEqual((report["type"], report["range"]), ("u8", [0, 255]))

    def test_one_voxel_one_plane_and_a_constant_are_ordinary(self):
        for shape in ((1, 1, 1), (1, 5, 4), (4, 4, 4)):
            write_nrrd(self.folder / "a.nrrd", np.full(shape, 7, "u1"))
            self.run_it("warp", self.folder / "a.nrrd", "-o", self.folder / "b.nrrd", "--rotate",
                        "10,20,30")
            for mode in ("mip", "xray", "mean", "composite"):
                self.run_it("render", self.folder / "a.nrrd", "-o", self.folder / "b.png",
                            "--mode", mode, "--rotate", "10,20,30", "--verify")

    def test_one_plane_turns_by_one_angle(self):
        write_nrrd(self.folder / "a.nrrd", np.arange(12, dtype="u1").reshape(1, 3, 4))
        self.run_it("warp", self.folder / "a.nrrd", "-o", self.folder / "b.nrrd", "--rotate", "10")

    def test_an_interrupted_run_leaves_nothing_half_done(self):
        process = subprocess.Popen(
            [COMMAND, "render", "phantom:noise:64", "-o", str(self.folder / "i_%d.exr"), "--size",
             "3000x3000", "--turntable", "90", "--max-error", "9", "--via",
             "project.ray_cast/filter=bspline3/step=0.05"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(1.5)
        for number, code in ((signal.SIGTERM, 143),):
            process.send_signal(number)
            self.assertEqual(process.wait(timeout=15), code)
        for name in self.left():
            self.run_it("info", self.folder / name)


class Info(Command):
    def test_describes_a_volume(self):
        samples = np.zeros((4, 5, 6), "<i2")
        samples[1:3, 2, 3:5] = [[-3, 9], [4, 5]]
        write_nrrd(self.folder / "a.nrrd", samples, (0.5, 1, 2))
        report = json.loads(self.run_it("info", self.folder / "a.nrrd", "--json", "-").stdout)
        self.assertEqual(report["kind"], "volume")
        self.assertEqual(report["extent"], [6, 5, 4])
        self.assertEqual(report["spacing"], [0.5, 1, 2])
        self.assertEqual(report["type"], "i16")
        self.assertEqual(report["range"], [-3, 9])
        self.assertEqual(report["occupied_box"], [[3, 2, 1], [5, 3, 3]])
        self.assertAlmostEqual(report["occupied_fraction"], 4 / 120)
        self.assertAlmostEqual(report["mean"], samples.mean())
        self.assertEqual(report["non_finite"], 0)
        self.assertEqual(report["bytes"], 240)
        self.assertLessEqual({"channels", "times", "unit", "origin", "direction", "orientation"},
                             set(report))

    def test_describes_an_image_in_two_axes(self):
        report = json.loads(self.run_it("info", "phantom:checker:16", "--json", "-").stdout)
        self.assertEqual((report["kind"], len(report["extent"])), ("image", 2))

    def test_text(self):
        self.assertIn(b"extent", self.run_it("info", "phantom:cube:8").stdout)


class Compare(Command):
    def pair(self, a, b):
        write_nrrd(self.folder / "a.nrrd", a)
        write_nrrd(self.folder / "b.nrrd", b)
        return [self.folder / "a.nrrd", self.folder / "b.nrrd"]

    def test_measures(self):
        rng = np.random.default_rng(3)
        a, b = rng.random((4, 5, 6), "f4"), rng.random((4, 5, 6), "f4")
        report = json.loads(self.run_it("compare", *self.pair(a, b), "--json", "-").stdout)
        difference = a.astype("f8") - b
        nrmse = np.sqrt((difference ** 2).mean()) / np.ptp(a.astype("f8"))
        self.assertAlmostEqual(report["nrmse"], nrmse, places=12)
        self.assertAlmostEqual(report["psnr"], -20 * np.log10(nrmse), places=9)
        self.assertAlmostEqual(report["max"], np.abs(difference).max(), places=12)
        self.run_it("compare", *self.pair(a, b), "--max-error", nrmse * 1.01)
        self.run_it("compare", *self.pair(a, b), "--max-error", nrmse * 0.99, code=1)
        wide = json.loads(self.run_it("compare", *self.pair(a, b), "--range", "10", "--json",
                                      "-").stdout)
        self.assertAlmostEqual(wide["nrmse"], nrmse * np.ptp(a.astype("f8")) / 10, places=12)

    def test_equal_files_have_no_psnr(self):
        a = np.arange(8, dtype="u1").reshape(2, 2, 2)
        report = json.loads(self.run_it("compare", *self.pair(a, a), "--json", "-").stdout)
        self.assertEqual(report, {"schema": 1, "nrmse": 0.0, "psnr": None, "max": 0.0,
                                  "range": [0, 7]})

    def test_extents_must_agree(self):
        done = self.run_it("compare", *self.pair(np.zeros((2, 2, 2), "u1"),
                                                 np.zeros((2, 2, 3), "u1")), code=2)
        self.assertIn(b"3x2x2", done.stderr)

    def test_not_a_number_is_equal_to_itself_alone(self):
        a = np.ones((2, 2, 2), "f4")
        b = a.copy()
        b[0, 0, 0] = np.nan
        self.run_it("compare", *self.pair(b, b), "--max-error", "0")
        self.run_it("compare", *self.pair(a, b), "--max-error", "5", code=1)
        report = json.loads(self.run_it("compare", *self.pair(a, b), "--json", "-").stdout)
        self.assertIsNone(report["nrmse"])


class Calibrate(Command):
    def test_the_profile_is_used_from_then_on(self):
        self.run_it("calibrate", "--quick")
        profile = json.loads((self.folder / "config/edgewise/machine.json").read_text())
        self.assertIn("warp.backward", profile["factors"])
        report = self.report("plan", "warp", "phantom:noise:16")
        self.assertEqual(report["planning"]["machine"], profile["name"])
        self.check_probed(profile)
        shown = json.loads(self.run_it("list", "machines", "--json", "-").stdout)["machines"]
        self.assertIn(profile["levels"], [machine["levels"] for machine in shown])
        self.assertIn(b"a computed address (measured)", self.run_it("list", "machines").stdout)

    def check_probed(self, profile):
        """What rates refer to is of this machine, and one size of memory costs more than the last."""
        for name in ("operation", "streamed", "gather", "levels", "start"):
            self.assertTrue(profile["provenance"][name].startswith("measured 2"), name)
            self.assertGreaterEqual(profile["spreads"][name], 0, name)
            self.assertIn("rounds", profile["provenance"][name])
        for name in ("latency", "byte"):
            self.assertTrue(profile["provenance"][name].startswith("derived"), name)
            self.assertGreater(profile[name], 0)
        levels = profile["levels"]
        self.assertNotIn("bytes", levels[-1])
        for less, more in zip(levels, levels[1:]):
            self.assertLess(less["bytes"], more.get("bytes", float("inf")))
            self.assertLessEqual(less["streamed"], more["streamed"])
            self.assertLessEqual(less["gather"], more["gather"])
            self.assertLessEqual(less["line"], more["line"])
        self.assertEqual(levels[-1]["gather"], profile["gather"])
        self.assertGreater(profile["operation"], 1e-13)
        self.assertLess(profile["operation"], 1e-8)


if __name__ == "__main__":
    unittest.main()
