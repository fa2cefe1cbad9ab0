"""`--report FILE.html` of warp and render: the page in a real browser, beside the JSON and the picture of the same run.
Needs EDGEWISE and EDGEWISE_DATA, graphviz and chromium (script/setup)."""

import json
import math
import pathlib
import signal
import subprocess
import time
import unittest

import numpy as np
from browser import Browser
from running import COMMAND, Running, corner_of_mr_head

VIEW = ["--rotate", "20,30,0", "--size", "96x80"]
# Red, green, blue and alpha of a picture of the page, or of a data URI.
PIXELS = """(async () => { const i = new Image(); i.src = %s; await i.decode(); const c = document.createElement('canvas');
 c.width = i.width; c.height = i.height; const t = c.getContext('2d'); t.drawImage(i, 0, 0);
 return [i.width, i.height, [...t.getImageData(0, 0, i.width, i.height).data]]; })()"""


def setUpModule():
    """One browser for all classes, since it takes long to start."""
    Report.browser = Browser()
    unittest.addModuleCleanup(Report.browser.close)


class Report(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.request = ["render", corner_of_mr_head(cls.folder), *VIEW]

    def made(self, *words, name="r.html", env=None):
        """The JSON of a run whose page is opened."""
        self.page = self.folder / name
        done = self.run_it(*words, "--report", self.page, "--json", "-", "--quiet", env=env)
        self.browser.errors.clear()
        self.browser.open("about:blank")
        self.browser.open(f"file://{self.page}")
        self.assertEqual(self.browser.errors, [])
        return json.loads(done.stdout)

    def pixels(self, uri):
        width, height, values = self.browser.value(PIXELS % uri)
        return np.array(values, float).reshape(height, width, 4)

    def picture(self, name="picture"):
        return self.pixels(f"document.querySelector('#{name} img').src")

    def png(self, file):
        import base64
        return self.pixels(json.dumps("data:image/png;base64," + base64.b64encode(file.read_bytes()).decode()))

    def values_of(self, selector):
        """What the cells of a table's rows hold: a number, or the text that stands for none."""
        return self.browser.value(
            f"[...document.querySelectorAll({selector!r})].map(r => [...r.querySelectorAll('td')].map(c => "
            "c.querySelector('data') ? Number(c.querySelector('data').value) : c.textContent))")

    def text(self, selector="body"):
        return self.browser.value(f"document.querySelector({selector!r}).textContent")


class Page(Report):
    def test_numbers_are_those_of_the_json(self):
        report = self.made(*self.request, "-o", "null:", "--verify=512", "--repeat", "3")
        plan, measured = report["plan"], report["measured"]
        rows = self.values_of("#steps .step")
        self.assertEqual(len(rows), len(plan["steps"]))
        for row, step, took in zip(rows, plan["steps"], measured["steps"]):
            self.assertEqual(row[0:2], [step["predicted"]["seconds"], took["seconds"]])
            self.assertEqual([row[3], row[6]], [step["predicted"]["bytes"], step["predicted"]["error"]])
        total = self.values_of("#steps .total")[0]
        self.assertEqual([total[0], total[3], total[6]], [plan["predicted"][key] for key in ("seconds", "bytes", "error")])
        self.assertEqual(total[1], sorted(measured["seconds"])[1])
        self.assertEqual([total[4], total[7]], [measured["bytes"], measured["error"]["nrmse"]])
        for place in (0, 3, 6):
            self.assertAlmostEqual(float(total[place + 2]), total[place + 1] / total[place], delta=0.0051)
        front = self.values_of("#front tbody tr")
        self.assertEqual([row[:3] for row in front], [[p["predicted"][k] for k in ("seconds", "bytes", "error")] for p in report["front"]])
        self.assertEqual([row[3] for row in front].count("chosen"), 1)
        self.assertTrue(all(row[3] for row in front))
        refused = self.browser.value("[...document.querySelectorAll('#refused tbody tr')].map(r => [r.cells[0].textContent, r.cells[1].textContent])")
        self.assertEqual(refused, [[r["transition"], r["reason"]] for r in report["refused"]])
        self.assertEqual(json.loads(self.text("#data")), report)

    def test_what_was_not_verified_has_no_measured_error(self):
        self.made(*self.request, "-o", "null:")
        self.assertEqual(self.values_of("#steps .total")[0][7], "not verified")

    def test_the_chosen_path_is_bold(self):
        report = self.made(*self.request, "-o", "null:", "--mode", "xray")
        bold = self.browser.value("[...document.querySelectorAll('.graph .edge')].filter(e => [...e.querySelectorAll('path')]"
                                  ".some(p => p.getAttribute('stroke-width') === '3.2')).map(e => e.textContent)")
        steps = [step["transition"] for step in report["plan"]["steps"]]
        self.assertEqual(len(bold), len(steps))
        for step in steps:
            self.assertEqual(sum(step in text for text in bold), 1, step)
        self.assertIn("spectrum", self.text(".graph"))

    def test_the_command_line_and_the_machine(self):
        report = self.made(*self.request, "-o", "null:", "--max-error", "40dB", "--verify=64", "--strict")
        # A shell takes it apart again.
        words = subprocess.run(["bash", "-c", f"printf '%s\\n' {self.text('#command')}"], capture_output=True, text=True, check=True).stdout.split("\n")[:-1]
        self.assertEqual(words, ["edgewise", *map(str, self.request), "-o", "null:", "--max-error", "40dB", "--verify=64", "--strict",
                                 "--report", str(self.page), "--json", "-", "--quiet"])
        machine = self.text("#machine")
        for word in (f"edgewise {report['version']}", report["planning"]["machine"], f"{report['request']['threads']} of"):
            self.assertIn(word, machine)
        for word in ("mr_corner.nii: volume (NIfTI)", "96x80", "mm", "error 0.01;"):
            self.assertIn(word, self.text("#request"))

    def test_warnings_are_shown(self):
        report = self.made("warp", "phantom:noise:20", "--rotate", "1,2,3", "-o", "null:", "--via", "warp.backward/filter=zoh")
        self.assertTrue(report["warnings"])
        self.assertEqual(self.browser.value("[...document.querySelectorAll('#warnings li')].map(e => e.textContent)"), report["warnings"])

    def test_light_dark_print_and_no_network(self):
        self.made(*self.request, "-o", "null:")
        back = "getComputedStyle(document.body).backgroundColor"
        self.browser.colours("light")
        self.assertEqual(self.browser.value(back), "rgb(255, 255, 255)")
        self.browser.colours("dark")
        self.assertNotEqual(self.browser.value(back), "rgb(255, 255, 255)")
        self.browser.call("Emulation.setEmulatedMedia", media="print")
        self.assertEqual(self.browser.value(back), "rgb(255, 255, 255)")
        self.assertGreater(len(self.browser.pdf()), 20000)
        self.browser.call("Emulation.setEmulatedMedia", media="screen")
        self.assertEqual(self.browser.errors, [])
        self.assertEqual(self.browser.value("performance.getEntriesByType('resource').filter(e => !e.name.startsWith('data:')).length"), 0)
        self.assertEqual(self.browser.value("[...document.querySelectorAll('[src], [href]')].filter(e => "
                                            "!(e.getAttribute('src') || e.getAttribute('href')).startsWith('data:')).length"), 0)

    def test_the_same_request_makes_the_same_page(self):
        pages = []
        for threads in (1, 1, 2):
            self.made(*self.request, "-o", "null:", "--threads", threads)
            # Times are measured; predicted memory begins with what the process holds, which the system says.
            pages.append(self.browser.value(
                "(() => { for (const e of document.querySelectorAll('#steps td, #machine dd, #data, #command, #front td:nth-child(3)')) e.remove();"
                " return document.documentElement.outerHTML; })()"))
        self.assertEqual(pages[0], pages[1])
        pictures = [[page[page.index(f'id="{name}"'):][:3000] for name in ("picture", "difference")] for page in pages]
        self.assertEqual(pictures[0], pictures[2])


class Pictures(Report):
    def test_the_picture_is_the_one_that_is_written(self):
        zone = self.folder / "zone.png"
        self.run_it("warp", "phantom:zone-plate:90", "-o", zone, "--quiet")
        rows = {
            "mip": [*self.request, "--window", "1%,99%"],
            "composite": [*self.request, "--mode", "composite", "--background", "0.2,0.3,0.4"],
            "turntable": [*self.request, "--turntable", "3", "--mode", "xray"],
            "photograph": ["warp", zone, "--rotate", "10"],
        }
        for name, words in rows.items():
            with self.subTest(name):
                out = self.folder / (f"{name}_%d.png" if name == "turntable" else f"{name}.png")
                self.made(*words, "-o", out)
                np.testing.assert_array_equal(self.picture(), self.png(pathlib.Path(str(out).replace("%d", "0"))))

    def test_values_are_shown_through_a_window(self):
        # By one path: a page asks for errors, and the preview that tells them may choose another one.
        picture, request = self.folder / "v.png", [*self.request, "--via", "project.ray_cast/filter=foh/step=1"]
        self.run_it(*request, "-o", picture, "--quiet")
        for out in ("null:", self.folder / "v.nrrd"):
            self.made(*request, "-o", out)
            np.testing.assert_array_equal(self.picture(), self.png(picture))

    def test_large_pictures_are_thinned_out(self):
        out = self.folder / "l.png"
        self.made("warp", "phantom:zone-plate:700", "--rotate", "3", "-o", out)
        picture, whole = self.picture(), self.png(out)
        self.assertEqual(picture.shape[:2], (512, 512))
        places = ((np.arange(512) + 0.5) * 700 / 512).astype(int)
        np.testing.assert_array_equal(picture, whole[np.ix_(places, places)])
        self.assertEqual(self.picture("difference").shape[:2], (256, 256))

    def test_a_volume_shows_its_middle_slice(self):
        self.made("warp", "phantom:sphere:21", "--rotate", "10,20,30", "-o", self.folder / "s.nii")
        self.assertIn("slice 10 of 21", self.text("#picture figcaption"))
        self.assertEqual(self.picture().shape[:2], (21, 21))

    def test_the_error_map_is_of_the_reference(self):
        """A phantom's formula is the reference: the error of every pixel is known without the program."""
        n, angle = 64, 9
        out = self.folder / "z.nrrd"
        self.made("warp", f"phantom:zone-plate:{n}", "--rotate", angle, "-o", out, "--via", "warp.backward/filter=foh", "--verify=all")
        data = json.loads(self.text("#data"))
        text = self.text("#difference figcaption")
        # All pixels are shown, so the map's RMS over its range is the verified error.
        rms, share = float(text.split("RMS ")[1].split(" ")[0]), float(text.split("[value], ")[1].split(" ")[0])
        error = data["measured"]["error"]
        self.assertAlmostEqual(share / error["nrmse"], 1, delta=0.005)
        self.assertAlmostEqual(rms / (error["nrmse"] * error["range"]), 1, delta=0.001)
        self.assertIn(f"over its {error['samples']} pixels", text)
        shown = self.picture("difference")
        scale = max(abs(float(word)) for word in (text.split("from ")[1].split(" ")[0], text.split(" to ")[1].split(".  ")[0].split(". ")[0]))
        self.assertAlmostEqual(scale / error["max"], 1, delta=0.001)
        sizes = (shown[..., 3] / 255) ** 2 * scale
        # Alpha is rounded to 1 / 255: of the root by 1 / 510, of the size by its double and a little.
        self.assertAlmostEqual(math.sqrt((sizes**2).sum() / error["samples"]) / rms, 1, delta=0.02)
        ticks = self.browser.value("[...document.querySelectorAll('.legend .ticks span')].map(e => e.textContent)")
        self.assertEqual(len(ticks), 5)
        self.assertAlmostEqual(float(ticks[4]) / scale, 1, delta=0.006)
        self.assertAlmostEqual(float(ticks[3]) / scale, 0.25, delta=0.006)


class Requests(Report):
    def test_refused_before_any_work(self):
        out = self.folder / "o.png"
        self.assertIn(b".html", self.run_it(*self.request, "-o", out, "--report", self.folder / "r.txt", code=2).stderr)
        self.assertIn(b"folder", self.run_it(*self.request, "-o", out, "--report", self.folder / "no/r.html", code=2).stderr)
        self.assertFalse(out.exists())
        for verb in (["plan"], ["graph"], ["advise"]):
            refused = self.run_it(*verb, *self.request, "--report", self.folder / "r.html", code=2)
            self.assertIn(b"--report", refused.stderr)
        self.assertFalse((self.folder / "r.html").exists())

    def test_without_graphviz_the_page_says_so(self):
        self.made(*self.request, "-o", "null:", env={**self.env, "PATH": str(self.folder)})
        self.assertIn("graphviz", self.text())
        self.assertFalse(self.browser.value("Boolean(document.querySelector('.graph'))"))
        self.assertTrue(self.browser.value("Boolean(document.querySelector('#difference'))"))

    def test_a_run_that_fails_leaves_no_page(self):
        page = self.folder / "f.html"
        self.run_it(*self.request, "-o", "null:", "--report", page, "--max-error", "1e-12", code=3)
        self.run_it(*self.request, "-o", "null:", "--report", page, "--max-time", "1us", "--via", "project.ray_cast", "--strict", code=3)
        self.run_it("warp", self.folder / "missing.nii", "-o", "null:", "--report", page, code=4)
        self.assertEqual(list(self.folder.glob("*f.html*")), [])

    def test_an_interrupted_run_leaves_no_page(self):
        out = self.folder / "i.html"
        words = [*self.request, "-o", "null:", "--report", out, "--repeat", "100000", "--quiet"]
        process = subprocess.Popen([COMMAND, *map(str, words)], env=self.env, stderr=subprocess.DEVNULL)
        time.sleep(2)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(20), 130)
        self.assertEqual(list(self.folder.glob("*i.html*")), [])


if __name__ == "__main__":
    unittest.main()
