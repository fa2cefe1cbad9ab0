"""Real and hostile files beside the repository against the tables of their READMEs, through the
command. Needs EDGEWISE, and EDGEWISE_SHARED: without it nothing here runs."""

import json
import os
import pathlib
import re
import resource
import signal
import subprocess
import tempfile
import threading
import time
import unittest

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
SHARED = os.environ.get("EDGEWISE_SHARED")
DATA = pathlib.Path(SHARED or ".") / "data"
SECONDS, BYTES = 10, 512 << 20  # what a bad file may cost

IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
TURNED = [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]  # x to the right, y to the front, in LPS
# What the table of the README does not hold: origin, direction (where x, y, z point; both in LPS or
# in the file's own space) and letters, from its notes and from the headers, read by hand.
GEOMETRY = {
    "ct_chest_dicom/*.dcm": ([-201, -59, -679.800049], IDENTITY, "LPS"),
    "ct_headsq_nrrd/quarter.nhdr": ([0, 0, 0], IDENTITY, None),
    "ct_stent_raw/stent.json": ([0, 0, 0], IDENTITY, None),
    "ct_tooth_nrrd/tooth.nhdr": ([0, 0, 0], IDENTITY, None),
    "ct_engine_nifti/engine.nii.gz": ([127, 127, -64], TURNED, "RAS"),
    # Columns of the sform (RAS) over their lengths, x and y negated.
    "mr_angio_nifti/chris_MRA.nii.gz": (
        [46.618832, 45.199753, -42.424683],
        [[-0.997185, 0.000787, 0.074970], [0, -0.999945, 0.010501],
         [0.074974, 0.010472, 0.997131]], "RAS"),
    "mr_aorta_mha/aorta.mha": ([-156.445, -24.6094, 0], TURNED, "RAS"),
    "mr_carotid_vtk/carotid.vtk": ([100, 80, 1], IDENTITY, None),
    "mr_brain_nifti/MR.nii.gz": ([388.26001, 81.119957, 405.42099], TURNED, "RAS"),
    "mr_fetal_nrrd/template_T2.nrrd": ([-49.84375, 67.890625, -53.7109375], IDENTITY, "LPS"),
    "sim_hydrogen_vti/hydrogen.vti": ([0, 0, 0], IDENTITY, None),
    "seg_frog_mhd/frogtissue.mhd": ([0, 0, 0], IDENTITY, None),
    "mic_neuron_tiff/neuron.tif": ([0, 0, 0], IDENTITY, None),
}
TYPES = {"uint8": "u8", "int16": "i16", "uint16": "u16", "float32": "f32", "half": "f16"}


def numbers(text):
    return [float(word) for word in re.findall(r"-?\d+(?:\.\d+)?", text)]


def rows_of(readme):
    """Cells of every table row that starts with a name in back-quotes."""
    for line in readme.read_text().splitlines():
        if re.match(r"\| `", line):
            yield [cell.strip() for cell in line.strip("| ").split(" | ")]


class Done:
    """A run of `edgewise info`: its exit code, output, seconds and largest resident memory."""

    def __init__(self, path, limit=None):
        def limited():
            resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))

        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as errors:
            begin = time.monotonic()
            process = subprocess.Popen([COMMAND, "info", str(path), "--json", "-"], stdout=out,
                                       stderr=errors, preexec_fn=limited if limit else None)
            # wait4 has no timeout, and a file that hangs the command must not hang the test.
            killer = threading.Timer(60, process.send_signal, [signal.SIGKILL])
            killer.start()
            _, status, usage = os.wait4(process.pid, 0)
            killer.cancel()
            self.seconds = time.monotonic() - begin
            self.code = process.returncode = os.waitstatus_to_exitcode(status)
            self.bytes = usage.ru_maxrss * 1024
            out.seek(0), errors.seek(0)
            self.out, self.errors = out.read().decode(), errors.read().decode()


@unittest.skipUnless(SHARED and DATA.is_dir(), "EDGEWISE_SHARED is not set")
class GoodFiles(unittest.TestCase):
    def info(self, name):
        done = Done(DATA / (os.path.dirname(name) if "*" in name else name))
        self.assertEqual(done.code, 0, done.errors)
        return json.loads(done.out)

    def check_range(self, name, said, info):
        """`said`: "min / max / mean" as stored; where the file scales, a second one after it."""
        parts = [part.split("/") for part in re.split(r"stored;|;", re.sub(r"\(.*?\)", "", said))]
        low, high = (numbers(cell)[0] for cell in parts[-1][:2])
        mean = numbers(parts[-1][2])
        if len(mean) > 1:  # one a channel
            mean = [sum(mean) / len(mean)]
        # The README gives five digits or more, and four decimals of small values.
        room = max(1e-5 * high, 5e-5)
        self.assertAlmostEqual(info["range"][0], low, delta=room, msg=name)
        self.assertAlmostEqual(info["range"][1], high, delta=room, msg=name)
        if info["channels"] != 4:  # the mean of the README leaves alpha out, that of info does not
            self.assertAlmostEqual(info["mean"], mean[0], delta=1e-4 * abs(mean[0]), msg=name)

    def test_every_file_is_as_its_readme_says(self):
        seen = set()
        for cells in rows_of(DATA / "README.md"):
            name = cells[0].split("`")[1]
            with self.subTest(name):
                seen.add(name)
                info = self.info(name)
                extent = numbers(cells[2])
                self.assertEqual(info["extent"], extent)
                self.assertEqual(info["kind"], "volume" if len(extent) == 3 else "image")
                stored = re.search("|".join(TYPES), cells[4].replace("uint16, 12", "uint16"))
                self.assertEqual(info["type"], TYPES[stored[0]])
                said = cells[6]
                if name.startswith("mr_carotid"):  # its vectors are skipped
                    said = said.split(";")[0].replace("scalars", "")
                self.check_range(name, said, info)
                self.assertEqual(info["non_finite"], 0)
                if len(extent) == 3:
                    self.check_geometry(name, cells[3], info)
                else:
                    channels = 4 if "RGBA" in cells[2] else 3
                    self.assertEqual(info["channels"], channels)
        self.assertEqual(len(seen), 17)
        self.assertLess(set(GEOMETRY), seen)

    def check_geometry(self, name, cell, info):
        spacing = [1, 1, 1]
        if not cell.startswith("not known"):
            spacing = numbers(cell.split("(")[0].split(", origin")[0])
            spacing *= 3 // len(spacing)
        origin, direction, letters = GEOMETRY[name]
        for k in range(3):
            # Five digits in the README, six in the headers.
            self.assertAlmostEqual(info["spacing"][k], spacing[k], delta=1e-5 * spacing[k])
            self.assertAlmostEqual(info["origin"][k], origin[k], delta=1e-6 * abs(origin[k]))
            for row in range(3):
                self.assertAlmostEqual(info["direction"][k][row], direction[k][row], delta=1e-6)
        self.assertEqual(info["orientation"], letters)
        if letters:
            self.assertEqual(info["unit"], "mm")

    def test_a_file_for_every_row_and_a_row_for_every_folder(self):
        listed = {cells[0].split("`")[1].split("/")[0] for cells in rows_of(DATA / "README.md")}
        there = {path.name for path in DATA.iterdir() if path.is_dir()}
        self.assertEqual(listed, there - {"bad"})


@unittest.skipUnless(SHARED and DATA.is_dir(), "EDGEWISE_SHARED is not set")
class BadFiles(unittest.TestCase):
    def test_every_file_gets_its_verdict_in_time_and_memory(self):
        count = 0
        for cells in rows_of(DATA / "bad" / "README.md"):
            name, verdict = cells[0].strip("`"), cells[2]
            count += 1
            with self.subTest(name):
                done = Done(DATA / "bad" / name, BYTES)
                # A legal gigabyte: loads only where the limit allows it, else its size is said.
                loads = verdict == "LOAD" and "otherwise REJECT" not in cells[3]
                self.assertEqual(done.code, 0 if loads else 4, done.errors)
                self.assertLess(done.seconds, SECONDS)
                self.assertLess(done.bytes, BYTES)
                report = json.loads(done.out)
                if loads:
                    self.assertEqual(report["file"], str(DATA / "bad" / name))
                else:
                    self.assertIn(name, done.errors)
                    self.assertIn(name, report["error"]["message"])
                    self.assertEqual(report["error"]["code"], 4)
                if verdict == "LOAD" and not loads:
                    self.assertIn(str(1 << 30), done.errors)
        self.assertEqual(count, 88)

    def test_the_values_of_what_loads(self):
        """The ramp of its README: voxel i is (7 i) mod 1000, 16^3 of them."""
        mean = sum(7 * i % 1000 for i in range(4096)) / 4096
        for name in ("nii_big_endian.nii", "nii_slope_nan.nii", "nii_slope_zero.nii",
                     "nrrd_byte_skip_minus1.nrrd", "nii_bomb_hidden.nii.gz"):
            info = json.loads(Done(DATA / "bad" / name, BYTES).out)
            self.assertEqual(info["extent"], [16, 16, 16], name)
            self.assertEqual(info["range"], [0, 999], name)
            self.assertAlmostEqual(info["mean"], mean, delta=1e-9 * mean, msg=name)

    def test_the_warnings_of_what_is_doubtful(self):
        for name, word in (("nii_pixdim_negative.nii", "pixdim"), ("nrrd_spacing_nan.nrrd", "spacing"),
                           ("dcm_series_gap", "missing"), ("nii_bomb_hidden.nii.gz", "follow")):
            info = json.loads(Done(DATA / "bad" / name, BYTES).out)
            self.assertIn(word, " ".join(info["warnings"]), name)
        info = json.loads(Done(DATA / "bad" / "nii_nan_voxels.nii", BYTES).out)
        self.assertGreaterEqual(info["non_finite"], 3)  # NaN, +Inf, -Inf


if __name__ == "__main__":
    unittest.main()
