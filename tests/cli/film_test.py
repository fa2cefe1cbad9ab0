"""`-o turn.mp4`: frames go to the program ffmpeg. A stand-in of that name on a PATH of its own keeps its arguments and what it is fed; the
real one is asked where it is there. Needs EDGEWISE."""

import json
import os
import shutil
import signal
import stat
import subprocess
import sys
import time
import unittest

import files
import numpy as np
from running import COMMAND, Running

SOURCE = "phantom:gaussians:24"
TURNED = ("--turntable", "5", "--window", "0,1", "--quiet")

STAND_IN = """#!{python}
import json, os, sys, time
with open({log!r} + ".args", "w") as f:
    json.dump(sys.argv, f)
mode = open({log!r} + ".mode").read()
if mode == "bad":
    sys.stdin.buffer.read(10)
    sys.stderr.write("first line\\nUnknown encoder 'libx264'\\n")
    sys.exit(3)
if mode == "talks":  # more than a pipe holds
    sys.stderr.write("x" * 1000000)
    sys.stderr.flush()
if mode == "hangs":
    open({log!r} + ".pid", "w").write(str(os.getpid()))
    time.sleep(600)
data = sys.stdin.buffer.read()
with open({log!r} + ".data", "wb") as f:
    f.write(data)
if mode == "late":
    open({log!r} + ".pid", "w").write(str(os.getpid()))
    time.sleep(600)
if mode != "nothing":
    with open(sys.argv[-1].removeprefix("file:"), "wb") as f:
        f.write(b"a film")
"""


class Film(Running):
    def setUp(self):
        self.bin = self.folder / "bin"
        self.bin.mkdir(exist_ok=True)
        self.log = self.folder / "log"
        program = self.bin / "ffmpeg"
        program.write_text(STAND_IN.format(python=sys.executable, log=str(self.log)))
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        self.stand_in = {**self.env, "PATH": str(self.bin)}
        self.behaves("well")

    def behaves(self, mode):
        for old in self.folder.glob("log.*"):
            old.unlink()
        (self.folder / "log.mode").write_text(mode)

    def leftovers(self):
        return [p.name for p in self.folder.iterdir() if ".part" in p.name]

    def render(self, name, *words, code=0, env=None):
        return self.run_it("render", SOURCE, "-o", self.folder / name, *words, *TURNED, code=code, env=env or self.stand_in)

    def fed(self, width, height):
        return np.frombuffer((self.folder / "log.data").read_bytes(), "u1").reshape(-1, height, width, 3)

    def test_frames_are_what_single_pictures_are(self):
        for mode, size in (("mip", "24x18"), ("composite", "24x18"), ("mip", "23x17"), ("mean", "1x1")):
            with self.subTest(mode=mode, size=size):
                self.behaves("well")
                words = ("--mode", mode, "--size", size)
                report = json.loads(self.render("turn.mp4", *words, "--json", "-").stdout)
                self.assertEqual(report["outputs"], [str(self.folder / "turn.mp4")])
                self.assertEqual((self.folder / "turn.mp4").read_bytes(), b"a film")
                self.run_it("render", SOURCE, "-o", self.folder / "f_%d.png", *words, *TURNED)
                expected = np.stack([files.read(self.folder / f"f_{i}.png")[0] for i in range(5)])
                expected = np.broadcast_to(expected, (*expected.shape[:3], 3))
                # Odd sides become even by their last column and row once more.
                height, width = expected.shape[1:3]
                expected = np.pad(expected, ((0, 0), (0, height % 2), (0, width % 2), (0, 0)), mode="edge")
                got = self.fed(width + width % 2, height + height % 2)
                np.testing.assert_array_equal(got, expected)
        self.assertEqual(self.leftovers(), [])

    def test_arguments(self):
        self.render("turn.mp4", "--size", "23x18", "--fps", "12.5")
        words = json.loads((self.folder / "log.args").read_text())
        self.assertEqual(words[0], str(self.bin / "ffmpeg"))

        def value(option):
            return words[words.index(option) + 1]
        before = words[:words.index("-i")]
        self.assertIn("rawvideo", before)
        self.assertEqual((value("-video_size"), value("-framerate"), value("-pixel_format")), ("24x18", "12.5", "rgb24"))
        self.assertEqual((value("-i"), value("-c:v")), ("pipe:0", "libx264"))
        self.assertIn("format=yuv420p", value("-vf"))
        self.assertTrue(words[-1].startswith("file:") and words[-1].endswith(".part"), words[-1])
        self.render("turn.mp4", "--size", "8x8")
        self.assertEqual(json.loads((self.folder / "log.args").read_text())[words.index("-framerate") + 1], "15")

    def test_names_are_no_options_and_no_shell_reads_them(self):
        name = "./-y $(touch evil);'\".mp4"
        done = subprocess.run([COMMAND, "render", SOURCE, "-o", name, "--size", "8x8", *TURNED], cwd=self.folder, env=self.stand_in,
                              capture_output=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.folder / name).read_bytes(), b"a film")
        self.assertFalse((self.folder / "evil").exists())

    def test_without_the_program_nothing_is_rendered(self):
        empty = {**self.env, "PATH": str(self.folder / "nowhere")}
        report = json.loads(self.render("none.mp4", "--json", "-", env=empty, code=2).stdout)
        for word in ("ffmpeg", ".gif", ".apng"):
            self.assertIn(word, report["error"]["message"])
        self.assertIsNone(report["plan"])
        # Even where the input is not there: it is never looked at.
        done = self.run_it("render", self.folder / "missing.nrrd", "-o", self.folder / "none.mp4", *TURNED, env=empty, code=2)
        self.assertIn(b"ffmpeg", done.stderr)
        (self.bin / "ffmpeg").chmod(0o644)
        self.render("none.mp4", code=2)

    def test_a_program_that_fails_leaves_no_file(self):
        (self.folder / "old.mp4").write_bytes(b"older")
        for mode, text in (("bad", b"Unknown encoder 'libx264'"), ("nothing", b"nothing")):
            self.behaves(mode)
            done = self.render("old.mp4", "--size", "400x400", code=1)
            self.assertIn(b"ffmpeg", done.stderr)
            self.assertIn(text, done.stderr)
            self.assertEqual((self.folder / "old.mp4").read_bytes(), b"older")
            self.assertEqual(self.leftovers(), [])
        self.behaves("talks")
        self.render("loud.mp4")
        self.assertTrue((self.folder / "loud.mp4").exists())

    def test_cancelling_ends_it(self):
        for mode in ("hangs", "late"):
            self.behaves(mode)
            run = subprocess.Popen([COMMAND, "render", SOURCE, "-o", self.folder / "cut.mp4", "--size", "400x400", *TURNED], env=self.stand_in,
                                   stderr=subprocess.PIPE)
            pid = self.folder / "log.pid"
            for _ in range(600):
                if pid.exists() and pid.read_text():
                    break
                time.sleep(0.05)
            child = int(pid.read_text())
            run.send_signal(signal.SIGTERM)
            run.communicate(timeout=10)
            self.assertEqual(run.returncode, 143)
            with self.assertRaises(ProcessLookupError):
                os.kill(child, 0)
            self.assertEqual(self.leftovers(), [])
            self.assertFalse((self.folder / "cut.mp4").exists())

    def test_one_picture_is_no_film(self):
        for words in (("-o", self.folder / "one.mp4"), ("-o", self.folder / "n_%d.mp4", "--turntable", "3")):
            done = self.run_it("render", SOURCE, *words, env=self.stand_in, code=2)
            self.assertIn(b"several", done.stderr)
        files.write_png(self.folder / "flat.png", np.zeros((4, 5, 3), "u1"))
        self.run_it("warp", self.folder / "flat.png", "-o", self.folder / "one.mp4", env=self.stand_in, code=2)
        self.assertIn(b"16384", self.render("wide.mp4", "--size", "20000x2", code=2).stderr)
        self.render("wide.mp4", "--bits", "16", code=2)

    def test_channels_in_colours(self):
        volume = np.zeros((6, 7, 8, 2), "u1")
        volume[2, 3, 2, 0] = volume[3, 3, 5, 1] = 200
        files.write_nrrd(self.folder / "two.nrrd", volume)
        words = ("--channel", "0=red,1=#0000ff", "--size", "16x14", *TURNED)
        self.run_it("render", self.folder / "two.nrrd", "-o", self.folder / "two.mp4", *words, env=self.stand_in)
        self.run_it("render", self.folder / "two.nrrd", "-o", self.folder / "c_%d.png", *words)
        np.testing.assert_array_equal(self.fed(16, 14), np.stack([files.read(self.folder / f"c_{i}.png")[0] for i in range(5)]))

    def test_the_real_program(self):
        if not shutil.which("ffmpeg") or not shutil.which("ffprobe"):
            self.skipTest("no ffmpeg here")
        files_made = []
        for threads in ("1", "7"):
            self.run_it("render", SOURCE, "-o", self.folder / "real.mp4", "--mode", "composite", "--size", "63x48", "--fps", "10", "--threads", threads,
                        "--max-memory", "400MiB", *TURNED)
            files_made.append((self.folder / "real.mp4").read_bytes())
        self.assertEqual(files_made[0], files_made[1])
        probed = json.loads(subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", self.folder / "real.mp4"],
                                           capture_output=True, check=True).stdout)["streams"][0]
        self.assertEqual((probed["codec_name"], probed["pix_fmt"], probed["width"], probed["height"], probed["nb_read_frames"], probed["r_frame_rate"]),
                         ("h264", "yuv420p", 64, 48, "5", "10/1"))
        self.assertEqual((probed["color_space"], probed["color_range"]), ("bt709", "tv"))
        # What comes out is what went in, but for losses that nobody sees.
        raw = subprocess.run(["ffmpeg", "-v", "error", "-i", self.folder / "real.mp4", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True,
                             check=True).stdout
        self.run_it("render", SOURCE, "-o", self.folder / "r_%d.png", "--mode", "composite", "--size", "63x48", *TURNED)
        expected = np.stack([files.read(self.folder / f"r_{i}.png")[0] for i in range(5)]).astype(float)
        got = np.frombuffer(raw, "u1").reshape(5, 48, 64, 3)[:, :, :63].astype(float)
        self.assertLess(np.sqrt(np.mean((got - expected) ** 2)), 5)


if __name__ == "__main__":
    unittest.main()
