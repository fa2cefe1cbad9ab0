"""`edgewise chart` and the pictures of `edgewise graph`: files, what they agree with, and the page in a real browser.
Needs EDGEWISE and EDGEWISE_DATA, gnuplot, graphviz and chromium (script/setup)."""

import csv
import json
import math
import signal
import subprocess
import time
import unittest
import xml.etree.ElementTree as ET

import numpy as np
from browser import Browser
from running import COMMAND, DATA, Running

REQUEST = ["render", DATA / "mr_brain/MR.nii.gz", "--mode", "mip", "--rotate", "20,30,0", "--size", "96x80"]
COLUMNS = "plan,predicted_seconds,measured_seconds,predicted_error,measured_error,predicted_bytes,measured_bytes,front"


def read_nrrd(file):
    head, data = file.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines()[1:] if ": " in line)
    if fields["encoding"] in ("gzip", "gz"):
        import zlib
        data = zlib.decompress(data, 47)
    kind = {"float": "<f4"}[fields["type"]]
    return np.frombuffer(data, kind).reshape([int(n) for n in fields["sizes"].split()][::-1])


def undisturbed(seconds):
    """The 0.2 quantile of runs, between two values by their distance."""
    ordered, at = sorted(seconds), 0.2 * (len(seconds) - 1)
    above = min(int(at) + 1, len(seconds) - 1)
    return ordered[int(at)] + (at - int(at)) * (ordered[above] - ordered[int(at)])


class Chart(Running):
    def chart(self, *words, outs=("c.json",), code=0):
        files = [self.folder / out for out in outs]
        self.run_it("chart", *words, "--quiet", *[word for file in files for word in ("-o", file)], code=code)
        return json.loads(files[0].read_text()) if outs[0].endswith(".json") else None


class OneChart(Chart):
    """All forms of one chart, which was measured once."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        outs = [word for end in ("json", "csv", "svg", "png", "html") for word in ("-o", cls.folder / f"c.{end}")]
        subprocess.run([COMMAND, "chart", *map(str, REQUEST), "--limit", "14", "--repeat", "3", "--verify=512", "--peer",
                        "rival,30ms,0.004", "--max-time", "20ms", "--quiet", *map(str, outs)], check=True, env=cls.env, timeout=200)
        cls.report = json.loads((cls.folder / "c.json").read_text())
        cls.browser = Browser()
        cls.addClassCleanup(cls.browser.close)

    def open(self, hash=""):
        self.browser.errors.clear()
        self.browser.colours("light")
        self.browser.call("Emulation.setEmulatedMedia", media="screen")
        # The same page with another hash would not be loaded again.
        self.browser.open("about:blank")
        self.browser.open(f"file://{self.folder}/c.html{hash}")
        self.assertEqual(self.browser.errors, [])

    def points(self):
        return self.report["points"]

    def test_the_report_has_what_scripts_read(self):
        self.assertEqual(self.report["schema"], 1)
        self.assertEqual(self.report["request"]["job"], "render")
        self.assertEqual(self.report["request"]["budget"]["seconds"], 0.02)
        self.assertEqual(len(self.points()), 14)
        self.assertEqual(self.report["peers"], [{"name": "rival", "seconds": 0.03, "error": 0.004}])
        for point in self.points():
            self.assertEqual([step["transition"] for step in point["plan"]["steps"]],
                             [step.split("/")[0] for step in point["steps"]])
            self.assertEqual(point["plan"]["predicted"], point["predicted"])
            self.assertEqual(len(point["measured"]["seconds"]), 3)
            self.assertAlmostEqual(point["measured"]["typical"], undisturbed(point["measured"]["seconds"]), delta=1e-12)
            self.assertEqual(point["measured"]["error"]["samples"], 512)
            self.assertGreater(point["measured"]["bytes"], 0)
        self.assertEqual(sum(point["chosen"] for point in self.points()), 1)

    def test_front_is_what_nothing_beats(self):
        values = [(p["measured"]["typical"], p["measured"]["error"]["nrmse"]) for p in self.points()]
        for point, (s, e) in zip(self.points(), values):
            beaten = any((t <= s and f <= e) and (t < s or f < e) for t, f in values)
            self.assertEqual(point["front"], not beaten, point["steps"])

    def test_measured_errors_are_those_of_a_run(self):
        # Of all samples: of a part, what is drawn follows the first result that is compared.
        points = self.chart(*REQUEST, "--limit", "4", "--repeat", "1", "--verify=all", outs=("all.json",))["points"]
        point = max(points, key=lambda p: p["measured"]["error"]["nrmse"])
        via = [word for step in point["steps"] for word in ("--via", step)]
        without = [] if any(s.startswith("store") for s in point["steps"]) else ["--without", "store"]
        run = json.loads(self.run_it(*REQUEST, "-o", "null:", "--verify=all", *via, *without, "--json", "-", "--quiet").stdout)
        self.assertEqual([s["transition"] for s in run["plan"]["steps"]], [s["transition"] for s in point["plan"]["steps"]])
        self.assertEqual(run["measured"]["error"]["nrmse"], point["measured"]["error"]["nrmse"])

    def test_csv_holds_the_numbers_of_the_report(self):
        lines = (self.folder / "c.csv").read_text().splitlines()
        self.assertEqual(lines[0], COLUMNS)
        rows = list(csv.DictReader(lines))
        self.assertEqual(len(rows), 14)
        for row, point in zip(rows, self.points()):
            self.assertEqual(row["plan"], " > ".join(point["steps"]))
            self.assertEqual(float(row["measured_seconds"]), point["measured"]["typical"])
            self.assertEqual(float(row["measured_error"]), point["measured"]["error"]["nrmse"])
            self.assertEqual(float(row["predicted_bytes"]), point["predicted"]["bytes"])
            self.assertEqual(row["front"], "1" if point["front"] else "0")

    def test_pictures_are_pictures(self):
        root = ET.parse(self.folder / "c.svg").getroot()
        self.assertTrue(root.tag.endswith("svg"))
        texts = " ".join(root.itertext())
        for word in ("rival", "chosen by the planner", "project.ray_cast", "time 20 ms"):
            self.assertIn(word, texts)
        self.assertTrue((self.folder / "c.png").read_bytes().startswith(b"\x89PNG"))

    def ticks(self, axis):
        """Value and place of every tick, from what a reader sees."""
        units = {"s": 1, "ms": 1e-3, "µs": 1e-6, "": 1}
        found = self.browser.value(f"[...document.querySelectorAll('#plot .axis.{axis} .tick')].map(t => "
                                   "[t.textContent, t.transform.baseVal[0].matrix[arguments_axis]])"
                                   .replace("arguments_axis", repr("e" if axis == "x" else "f")))
        pairs = []
        for text, place in found:
            number, _, unit = text.partition(" ")
            if number != "0":
                pairs.append((math.log10(float(number) * units[unit]), place))
        return np.array(pairs)

    def test_marks_are_where_the_report_says(self):
        self.open()
        places = {}
        for axis in "xy":
            ticks = self.ticks(axis)
            self.assertGreaterEqual(len(ticks), 3)
            slope, foot = np.polyfit(ticks[:, 0], ticks[:, 1], 1)
            # Ticks are written to three digits.
            self.assertLess(np.abs(slope * ticks[:, 0] + foot - ticks[:, 1]).max(), 0.6)
            places[axis] = lambda value, slope=slope, foot=foot: slope * math.log10(value) + foot
        marks = self.browser.value("[...document.querySelectorAll('.mark')].map(m => [Number(m.dataset.index), "
                                   "m.transform.baseVal[0].matrix.e, m.transform.baseVal[0].matrix.f])")
        self.assertEqual(sorted(mark[0] for mark in marks), list(range(14)))
        for index, x, y in marks:
            measured = self.points()[index]["measured"]
            self.assertAlmostEqual(x, places["x"](measured["typical"]), delta=0.7)
            self.assertAlmostEqual(y, places["y"](measured["error"]["nrmse"]), delta=0.7)

    def test_hover_and_click(self):
        self.open()
        index = next(i for i, p in enumerate(self.points()) if p["front"] and not p["chosen"])
        mark = f'.mark[data-index="{index}"]'
        self.browser.value(f"document.querySelector('{mark}').parentNode.append(document.querySelector('{mark}'))")
        self.browser.hover(mark)
        self.browser.wait_for("!document.querySelector('#tip').hidden")
        tip = self.browser.value("document.querySelector('#tip').textContent")
        for step in self.points()[index]["steps"]:
            self.assertIn(step, tip)
        self.browser.click(mark)
        self.browser.wait_for("document.querySelectorAll('#detail canvas').length >= 4")
        self.assertEqual(self.browser.value("location.hash"), f"#select={index}")
        self.assertEqual(self.browser.value("document.querySelector('#table tr.selected').dataset.index"), str(index))
        self.assertEqual(self.browser.errors, [])

    def test_the_picture_is_what_the_path_renders(self):
        index = max(range(14), key=lambda i: self.points()[i]["measured"]["error"]["nrmse"])
        self.open(f"#select={index}")
        self.browser.wait_for("document.querySelector('[data-picture=picture]')")
        shown = np.array(self.browser.value(
            "(() => { const c = document.querySelector('[data-picture=picture] canvas');"
            " return [...c.getContext('2d').getImageData(0, 0, c.width, c.height).data].filter((_, i) => i % 4 === 0); })()"))
        via = [word for step in self.points()[index]["steps"] for word in ("--via", step)]
        without = [] if any(s.startswith("store") for s in self.points()[index]["steps"]) else ["--without", "store"]
        self.run_it(*REQUEST, "-o", self.folder / "p.nrrd", "--quiet", *via, *without)
        values = read_nrrd(self.folder / "p.nrrd").reshape(80, 96).astype(float)
        black, white, scale, levels = self.browser.value(
            f"[layout.pictures.black, layout.pictures.white, layout.pictures.differences[{index}].scale, layout.pictures.levels]")
        expected = np.clip(255 * (values - black) / (white - black), 0, 255)
        # Half a level, and what the differences are rounded by: see charts/pictures.hpp.
        bound = 0.51 + 255 / (white - black) * scale * (1 / levels + 1 / (4 * levels**2))
        self.assertLess(np.abs(shown.reshape(80, 96) - expected).max(), bound)
        self.assertGreater(expected.std(), 20)

    def test_works_without_a_mouse(self):
        self.open()
        order = sorted(range(14), key=lambda i: self.points()[i]["measured"]["typical"])
        self.browser.value("document.querySelector('#theme').focus()")
        self.browser.press("Tab")
        focused = "document.activeElement.dataset.index"
        self.assertEqual(self.browser.value(focused), str(order[0]))
        self.assertFalse(self.browser.value("document.querySelector('#tip').hidden"))
        self.browser.press("ArrowRight")
        self.assertEqual(self.browser.value(focused), str(order[1]))
        self.browser.press("Enter")
        self.browser.wait_for("document.querySelector('#detail ol')")
        self.assertEqual(self.browser.value("state.selected"), order[1])
        self.browser.press("Escape")
        self.assertIsNone(self.browser.value("state.selected"))
        self.browser.press("Tab")
        self.assertEqual(self.browser.value("document.activeElement.type"), "checkbox")
        labels = self.browser.value("[...document.querySelectorAll('.mark')].map(m => m.getAttribute('aria-label'))")
        self.assertTrue(all(label and "error" in label for label in labels))
        self.browser.value("document.querySelectorAll('.mark')[0].focus()")
        self.browser.press("End")
        self.assertEqual(self.browser.value(focused), str(order[-1]))
        self.browser.press("Home")
        self.assertEqual(self.browser.value(focused), str(order[0]))

    def test_rows_open_and_close_by_keys(self):
        self.open()
        row = "document.activeElement.closest('tr').dataset.index"
        self.assertEqual(self.browser.value("document.querySelectorAll('#table tbody button[tabindex=\"0\"]').length"), 1)
        self.browser.value("document.querySelector('#table tbody button').focus()")
        self.browser.press("ArrowDown")
        index = self.browser.value(row)
        self.browser.press("Enter")
        self.browser.wait_for("document.querySelector('[data-picture=picture]')")
        self.assertEqual(self.browser.value("[String(state.selected), document.activeElement.id]"), [index, "detail"])
        top, bottom, height = self.browser.value("(r => [r.top, r.bottom, innerHeight])(document.activeElement.getBoundingClientRect())")
        self.assertTrue(-1 < top < height and (bottom < height + 1 or bottom - top > height))
        self.browser.press("Escape")
        self.assertEqual(self.browser.value(f"[state.selected, {row}]"), [None, index])

    def test_families_are_hidden_and_shown(self):
        self.open()
        family = self.points()[0]["family"]
        rest = sum(p["family"] != family for p in self.points())
        self.browser.click("#families label input")
        self.assertEqual(self.browser.value("document.querySelectorAll('.mark').length"), rest)
        self.assertEqual(self.browser.value("document.querySelectorAll('#table tbody tr').length"), rest)
        self.browser.click("#families label input")
        self.assertEqual(self.browser.value("document.querySelectorAll('.mark').length"), 14)

    def test_the_table_sorts(self):
        self.open()
        shown = "[...document.querySelectorAll('#table tbody tr')].map(r => Number(r.dataset.index))"
        error = lambda i: self.points()[i]["measured"]["error"]["nrmse"]  # noqa: E731
        self.browser.click('[data-column="measured error"]')
        self.assertEqual(self.browser.value(shown), sorted(range(14), key=lambda i: (error(i), i)))
        self.browser.click('[data-column="measured error"]')
        self.assertEqual(self.browser.value(shown), sorted(range(14), key=lambda i: (-error(i), i)))
        self.assertEqual(self.browser.value("document.querySelector('[aria-sort=descending]').textContent")[:14], "measured error")

    def test_light_dark_and_print(self):
        self.open("#select=1")
        back = "getComputedStyle(document.body).backgroundColor"
        light = self.browser.value(back)
        self.browser.colours("dark")
        dark = self.browser.value(back)
        self.assertNotEqual(light, dark)
        self.browser.click("#theme")
        self.browser.click("#theme")
        self.assertEqual(self.browser.value(back), light)
        self.browser.call("Emulation.setEmulatedMedia", media="print")
        self.assertEqual(self.browser.value(back), "rgb(255, 255, 255)")
        self.assertGreater(len(self.browser.pdf()), 20000)
        self.assertEqual(self.browser.errors, [])

    def test_nothing_is_cut_off_on_paper(self):
        self.open("#select=1")
        self.browser.wait_for("document.querySelector('[data-picture=difference]')")
        self.browser.colours("dark")
        self.browser.call("Emulation.setEmulatedMedia", media="print")
        for width in (718, 740):  # A4 and Letter within their margins [px]
            self.browser.call("Emulation.setDeviceMetricsOverride", width=width, height=1000, deviceScaleFactor=1, mobile=False)
            self.addCleanup(self.browser.call, "Emulation.clearDeviceMetricsOverride")
            self.assertLessEqual(self.browser.value("document.documentElement.scrollWidth"), width)
            self.assertLessEqual(*self.browser.value("(all => [all.scrollWidth, all.clientWidth])(document.querySelector('#all'))"))
        # What cannot be used on paper is not there, and what is white stays white.
        self.assertFalse(self.browser.value("[...document.querySelectorAll('#theme, .hint, input, footer')].some(e => e.offsetParent)"))
        self.assertTrue(self.browser.value("(c => [...c.getContext('2d').getImageData(0, 0, c.width, c.height).data]"
                                           ".some((value, i) => i % 4 === 3 && value < 20))"
                                           "(document.querySelector('[data-picture=difference] canvas'))"))

    def test_the_page_needs_no_network(self):
        self.open()
        self.assertEqual(self.browser.value("performance.getEntriesByType('resource').filter(e => !e.name.startsWith('data:')).length"), 0)
        self.assertLess((self.folder / "c.html").stat().st_size, 1 << 20)


class Requests(Chart):
    def test_what_cannot_be_is_refused_before_any_work(self):
        refused = self.run_it("chart", *REQUEST, "-o", self.folder / "a.json", "-o", self.folder / "a.pdf", code=2)
        for word in (b".pdf", b".html", b".svg", b".png", b".csv", b".json"):
            self.assertIn(word, refused.stderr)
        self.assertFalse((self.folder / "a.json").exists())
        self.run_it("chart", *REQUEST, code=2)
        self.run_it("chart", *REQUEST, "-o", self.folder / "no/a.json", code=2)
        self.run_it("chart", *REQUEST, "-o", self.folder / "a.json", "--limit", "0", code=2)
        self.run_it("chart", *REQUEST, "-o", self.folder / "a.json", "--peer", "x,1", code=2)
        self.assertIn(b"rotate", self.run_it("chart", *REQUEST, "-o", self.folder / "a.json", "--sweep", "mode=1:2:1", code=2).stderr)
        self.run_it("chart", *REQUEST, "-o", self.folder / "a.json", "--sweep", "rotate.z=1:2:-1", code=2)

    def test_programs_that_are_missing_are_named(self):
        env = {**self.env, "PATH": str(self.folder)}
        self.assertIn(b"gnuplot-nox", self.run_it("chart", *REQUEST, "-o", self.folder / "a.svg", code=1, env=env).stderr)
        self.assertIn(b"graphviz", self.run_it("graph", *REQUEST, "-o", self.folder / "a.svg", code=1, env=env).stderr)

    def test_budgets_are_drawn_and_not_applied(self):
        tight = ["render", "phantom:gaussians:24", "--rotate", "10,5,0", "--size", "24x24", "--repeat", "1"]
        free = self.chart(*tight)
        for budgets in (["--max-error", "1e-9", "--max-time", "1us"], ["--max-memory", "1MiB"]):
            bound = self.chart(*tight, *budgets)
            self.assertEqual({tuple(p["steps"]) for p in bound["points"]}, {tuple(p["steps"]) for p in free["points"]})
        self.assertEqual(bound["request"]["budget"]["bytes"], 1 << 20)

    def test_the_front_comes_first(self):
        request = ["render", "phantom:noise:24", "--rotate", "10,5,0", "--size", "24x24", "--repeat", "1"]
        every = self.chart(*request)
        front = {tuple(p["steps"]) for p in every["points"] if p["predicted_front"] or p["chosen"]}
        some = self.chart(*request, "--limit", len(front))
        self.assertEqual({tuple(p["steps"]) for p in some["points"]}, front)
        self.assertEqual(some["paths"], len(every["points"]))

    def test_an_interrupted_chart_keeps_what_it_has(self):
        out = self.folder / "i.json"
        words = ["chart", *REQUEST, "--repeat", "10000", "--quiet", "-o", out, "-o", self.folder / "i.html"]
        process = subprocess.Popen([COMMAND, *map(str, words)], env=self.env, stderr=subprocess.PIPE)
        time.sleep(4)
        process.send_signal(signal.SIGINT)
        begin = time.monotonic()
        process.communicate(timeout=30)
        self.assertLess(time.monotonic() - begin, 5)
        self.assertEqual(process.returncode, 130)
        report = json.loads(out.read_text())
        self.assertTrue(report["interrupted"])
        self.assertTrue(any(p["measured"] for p in report["points"]))

    def test_an_error_of_nothing_has_a_place(self):
        report = self.chart("warp", "phantom:checker:32", "--translate", "3,0", "--repeat", "1", outs=("z.json", "z.svg", "z.html"))
        self.assertTrue(any(p["measured"]["error"]["nrmse"] == 0 for p in report["points"]))
        self.assertIn("0", [t.strip() for t in ET.parse(self.folder / "z.svg").getroot().itertext()])

    def test_reports_on_standard_output(self):
        done = self.run_it("chart", "warp", "phantom:zone-plate:32", "--rotate", "5", "--repeat", "1", "-o", self.folder / "w.csv",
                           "--json", "-", "--quiet")
        self.assertEqual(json.loads(done.stdout)["request"]["job"], "warp")


class Pages(Chart):
    """Pages of other requests load too, and their pictures show."""

    def test_all_kinds(self):
        browser = Browser()
        self.addCleanup(browser.close)
        rows = {
            "volume": ["warp", "phantom:sphere:20", "--rotate", "10,20,30"],
            "image": ["warp", "phantom:zone-plate:300", "--rotate", "7"],
            "colour": ["render", "phantom:gaussians:24", "--mode", "composite", "--size", "300x200"],
            "turntable": ["render", "phantom:gaussians:16", "--turntable", "3", "--mode", "xray"],
            "sweep": ["warp", "phantom:zone-plate:40", "--sweep", "rotate=0:30:15", "--limit", "4"],
        }
        for name, words in rows.items():
            with self.subTest(name):
                self.chart(*words, "--repeat", "1", "--verify=128", outs=(f"{name}.html",))
                browser.errors.clear()
                browser.open(f"file://{self.folder}/{name}.html#select=0")
                browser.wait_for("document.querySelector('#detail ol')")
                if name != "sweep":
                    browser.wait_for("document.querySelectorAll('#detail .pictures canvas').length >= 3")
                    size = browser.value("[layout.pictures.width, layout.pictures.height]")
                    self.assertLessEqual(max(size), 256)
                self.assertEqual(browser.errors, [])

    def test_a_sweep(self):
        report = self.chart("warp", "phantom:zone-plate:40", "--sweep", "rotate=0:0.3:0.1", "--limit", "3", "--repeat", "1",
                            outs=("s.json", "s.csv", "s.svg", "s.png"))
        self.assertEqual(report["sweep"], {"option": "rotate", "values": [0, 0.1, 0.2, 0.3]})
        self.assertEqual(sorted({p["at"] for p in report["points"]}), [0, 0.1, 0.2, 0.3])
        self.assertLessEqual(len({tuple(p["steps"]) for p in report["points"]}), 3)
        self.assertTrue((self.folder / "s.csv").read_text().splitlines()[0].endswith(",front,rotate"))
        self.assertIn("rotate", " ".join(ET.parse(self.folder / "s.svg").getroot().itertext()))
        # At each value what was run is what the request with that value gives.
        alone = self.chart("warp", "phantom:zone-plate:40", "--rotate", "0.2", "--repeat", "1")
        errors = {tuple(p["steps"]): p["measured"]["error"]["nrmse"] for p in alone["points"]}
        for p in report["points"]:
            if p["at"] == 0.2:
                self.assertEqual(p["measured"]["error"]["nrmse"], errors[tuple(p["steps"])])

    def test_lines_of_a_sweep_are_told_apart(self):
        self.chart("render", "phantom:noise:16", "--size", "16x16", "--sweep", "rotate.z=0:40:20", "--repeat", "1", "--verify=64",
                   "--max-time", "100s", outs=("l.json", "l.html", "l.svg"))
        texts = [t.strip() for t in ET.parse(self.folder / "l.svg").getroot().itertext()]
        browser = Browser()
        self.addCleanup(browser.close)
        browser.open(f"file://{self.folder}/l.html")
        numbers = browser.value("courses.filter(c => c.number).map(c => c.number)")
        self.assertEqual(numbers, list(range(1, len(numbers) + 1)))
        self.assertEqual(browser.value("[...document.querySelectorAll('#courses li')].map(li => li.value)"), numbers)
        labelled = browser.value("[...document.querySelectorAll('#plot .number')].flatMap(t => t.textContent.split(', ')).map(Number)")
        self.assertEqual(sorted(labelled), sorted(2 * numbers))
        for number in numbers:
            self.assertTrue(any(str(number) in text.split(", ") for text in texts), number)
        # The far budget is said at the edge and takes no room.
        self.assertIn("↑ time budget 100 s", texts)
        self.assertLess(browser.value("layout.axes.seconds.high"), 10)
        # Keys stay in their panel: along a line, and to another at the same value.
        focused = "(e => [e.classList[1], points[e.dataset.index].at, courseOf.get(points[e.dataset.index]).number])(document.activeElement)"
        browser.value("document.querySelector('.mark.error[tabindex=\"0\"]').focus()")
        self.assertEqual(browser.value(focused), ["error", 0, 1])
        browser.press("ArrowRight")
        self.assertEqual(browser.value(focused), ["error", 20, 1])
        browser.press("ArrowUp")
        self.assertEqual(browser.value(focused)[:2], ["error", 20])
        browser.press("Enter")
        browser.wait_for("document.querySelectorAll('#plot .course.selected').length === 2")
        browser.press("Escape")
        browser.wait_for("document.querySelectorAll('#plot .course.selected').length === 0")
        self.assertEqual(browser.errors, [])

    def test_sweeps_of_parts_sizes_threads_frames_and_budgets(self):
        volume = ["render", "phantom:noise:16", "--repeat", "1", "--limit", "2", "--verify=64"]
        for sweep, key, values in (("rotate.z=0:20:10", None, [0, 10, 20]), ("size=8:24:8", None, [8, 16, 24]),
                                   ("threads=1:2:1", "threads", [1, 2]), ("frames=2:4:2", "frames", [2, 4]),
                                   ("max-error=0.01:0.21:0.1", None, [0.01, 0.11, 0.21]), ("size.x=8:16:8", None, [8, 16])):
            with self.subTest(sweep):
                extra = ["--size", "12x12"] if sweep.startswith("size.x") else []
                report = self.chart(*volume, *extra, "--sweep", sweep)
                self.assertEqual(report["sweep"]["values"], values)
                if key:
                    self.assertEqual(report["request"][key], values[0])

    def test_of_edges_between_the_same_vertices_the_chosen_one_is_bold(self):
        """A filter's edges all lead from the samples to the result."""
        request = ("filter", "phantom:noise:16", "--op", "convolve", "--kernel", "gauss:2")
        plan = json.loads(self.run_it("plan", *request, "--json", "-", "--quiet").stdout)
        chosen = plan["plan"]["steps"][0]["transition"]
        file = self.folder / "f.svg"
        self.run_it("graph", *request, "-o", file)
        text = file.read_text()
        arcs = [arc for arc in text.split('class="edge"')[1:] if 'stroke-width="3.2"' in arc]
        self.assertEqual(len(arcs), 1)
        self.assertIn(f">{chosen}<", arcs[0].split("</g>")[0])

    def test_the_graph_as_a_picture(self):
        file = self.folder / "g.svg"
        self.run_it("graph", *REQUEST, "-o", file)
        text = file.read_text()
        texts = " ".join(ET.fromstring(text[text.index("<svg"):]).itertext())
        plan = json.loads(self.run_it("plan", *REQUEST, "--json", "-", "--quiet").stdout)
        for step in plan["plan"]["steps"]:
            self.assertIn(step["transition"], texts)
        self.assertEqual(text.count('stroke-width="3.2"') // 2, len(plan["plan"]["steps"]))
        self.assertIn("stroke-dasharray", text)
        self.assertIn("spectrum.forward", texts)
        self.run_it("graph", "-o", file)
        ET.parse(file)


if __name__ == "__main__":
    unittest.main()
