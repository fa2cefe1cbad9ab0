"""Which preset `--mode shaded` takes for data of each kind, made by formula, and for neighbours that are none of it. Needs EDGEWISE and
EDGEWISE_DATA."""

import json
import pathlib
import struct
import sys
import unittest

import files
import numpy as np
from running import DATA, Running

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "io"))
import dicom_writing as dw  # noqa: E402
import format_writers as writers  # noqa: E402

MM, UM, SILENT = 2, 3, None
N = 56


def grid(n=N):
    return np.mgrid[-1:1:n * 1j, -1:1:n * 1j, -1:1:n * 1j]


def noise(shape, deviation, seed=1):
    return np.random.default_rng(seed).normal(0, deviation, shape)


def tubes(n=N, count=5, radius=.05):
    """How near each place is to the nearest of some curved lines: 1 on it, 0 far away."""
    z, y, x = grid(n)
    near = np.zeros_like(x)
    for i in range(count):
        a, b, c = np.sin(1.7 * i), np.cos(2.3 * i), np.sin(3.1 * i + 1)
        away = np.sqrt((x - .5 * a - .2 * np.sin(3 * z + i)) ** 2 + (y - .5 * b - .2 * np.cos(2 * z * c + i)) ** 2)
        near = np.maximum(near, np.clip(1.5 - away / radius, 0, 1))
    return near


# --- CT

def ct(deviation=15, shape=N):
    """Lungs, fat, muscles and bone in air."""
    z, y, x = grid(shape)
    r = np.hypot(x / .85, y / .65)
    a = np.full(x.shape, -1000.0)
    a[r < 1] = -95
    a[r < .93] = 45
    a[(np.hypot(np.abs(x) - .4, y / 1.3) < .28) & (np.abs(z) < .7)] = -860
    a[np.hypot(x, y - .45) < .12] = 600
    return np.round(a + noise(a.shape, deviation)).clip(-1024, 3071).astype("<i2")


# --- MR

def head(rician=.02, top=900, brain_only=False, cut=.95):
    """Skin and fat, dark bone, brain with folds of two tissues and dark water, seen in a box that the neck leaves below."""
    z, y, x = grid()
    r = np.sqrt((x / .78) ** 2 + (y / .9) ** 2 + ((z - .05) / .85) ** 2)
    neck = np.hypot(x, y + .1) < .45
    folds = np.sin(14 * x + 5 * np.sin(7 * y)) * np.sin(13 * z + 4 * np.sin(6 * x)) > 0
    a = np.zeros_like(x)
    if not brain_only:
        a[(r < 1) | (neck & (z < 0))] = .8
        a[r < cut] = .35
        a[r < .9] = .05
    a[r < .84] = .2
    a[r < .8] = .5
    a[(r < .8) & folds] = .65
    a[r < .55] = .7
    a[np.hypot(np.abs(x) - .12, y) + np.abs(z) < .2] = .18
    both = np.hypot(a + noise(a.shape, rician, 2), noise(a.shape, rician, 3))
    return both * top


def angiogram(tissue=0.0):
    a = np.maximum(tubes(radius=.045), 0) * .9
    body = np.sqrt(sum(c * c for c in grid())) < .95
    a = np.maximum(a, tissue * body)
    return np.abs(a + noise(a.shape, .02 if tissue else 0, 4))


def trabecula():
    z, y, x = grid()
    w = np.sin(11 * x) * np.cos(11 * y) + np.sin(11 * y) * np.cos(11 * z) + np.sin(11 * z) * np.cos(11 * x)
    return (w > .35) & (np.hypot(x, y) < .9)


def labels(dtype="u1"):
    z, y, x = grid()
    a = np.zeros(x.shape, int)
    for i in range(1, 19):
        c = .6 * np.array((np.sin(2.1 * i), np.cos(1.3 * i), np.sin(4.7 * i)))
        a[np.sqrt((x - c[0]) ** 2 + (y - c[1]) ** 2 + (z - c[2]) ** 2) < .25] = (i * 7) % 23 + 1
    return a.astype(dtype)


def cells():
    """Filaments and spots, in haze that falls with depth, with the noise of counted light."""
    z, y, x = grid()
    light = 40 * tubes(count=8, radius=.04) + 4 * np.exp(-2 * (x * x + y * y)) * (1 - z) / 2
    return np.random.default_rng(6).poisson(light * 20 + 3).clip(0, 4095).astype("<u2")


class Kinds(Running):
    def nifti(self, a, side, unit=MM, intent=0):
        """@param side  of the whole [unit]"""
        self.count = getattr(self, "count", 0) + 1
        if unit is None:  # NRRD that says neither unit nor spacing
            path = self.folder / f"a{self.count}.nrrd"
            files.write_nrrd(path, a.astype("<f4") if a.dtype == float else a)
            return path
        path = self.folder / f"a{self.count}.nii"
        if a.dtype == float:
            a = a.astype("<f4")
        files.write_nifti(path, a, intent=intent, spacing=[side / a.shape[0]] * 3)
        data = bytearray(path.read_bytes())
        struct.pack_into("<b", data, 123, unit)
        path.write_bytes(bytes(data))
        return path

    def dicom(self, a, side, modality):
        folder = self.folder / f"dicom{len(list(self.folder.iterdir()))}"
        folder.mkdir()
        step = side / a.shape[0]
        for k, plane in enumerate(a.astype("<i2")):
            e = dw.picture(plane, kind="MR" if modality == "MR" else "CT", modality=modality, position=(0, 0, k * step), number=k + 1,
                           spacing=(side / a.shape[1], side / a.shape[2]))
            (folder / f"{k}.dcm").write_bytes(dw.file_of(e))
        return folder

    def taken(self, path, *words, mode="shaded"):
        done = self.run_it("render", path, "-o", "null:", "--mode", mode, "--size", "32", *words, "--json", "-")
        self.report = json.loads(done.stdout)
        self.said = done.stderr.decode()
        return self.report["request"]["preset"]

    def expect(self, preset, path, *words):
        self.assertEqual(self.taken(path, *words), preset)
        low, high = self.report["request"]["preset_window"]
        self.assertLess(low, high)
        self.assertIn(f"preset {preset} over {low:.5g} to {high:.5g}", self.said.strip().split("\n")[-1])

    # --- the kinds, each with what lies near it

    def test_ct_in_hounsfield_units(self):
        self.expect("ct-bone", self.nifti(ct(), 400))
        self.expect("ct-bone", self.nifti(ct(60).astype("<f4"), 380))
        self.expect("ct-bone", self.dicom(ct(), 400, "CT"))
        self.expect("ct-bone", self.nifti(ct(), 400, SILENT))
        body = ct()[14:42, 14:42, 14:42]  # without the air around it
        body[body < -500] = 30
        self.expect("ct-bone", self.dicom(body, 150, "CT"))
        # Values of both signs without air and water.
        waves = noise((N, N, N), 1000, 7).clip(-5000, 5000)
        self.expect("general", self.nifti(waves, 2000))
        turns = np.random.default_rng(8).integers(-4096, 4096, (N, N, N)).astype("<i2")
        self.expect("general", self.nifti(turns, 220))
        self.expect("general", self.dicom(ct(), 400, "PT"))

    def test_ct_in_hounsfield_units_and_1024(self):
        shifted = (ct().astype(int) + 1024).astype("<u2")
        self.expect("ct-bone", self.nifti(shifted, 400))
        self.assertIn("Hounsfield units plus 1024", self.said)
        self.expect("ct-bone", self.nifti(shifted.astype("<i2"), 400, SILENT))
        # An MR whose tissues are as bright as that.
        self.expect("mr-head", self.nifti(head(top=1500), 230))
        self.assertNotIn("Hounsfield", self.said)

    def test_mr_of_a_head(self):
        for a, side in ((head(), 230), (head(.05, 255).clip(0, 255).astype("u1"), 210), (head(.01, 3000).astype("<i2"), 256), (head(brain_only=True), 190)):
            self.expect("mr-head", self.nifti(a, side))
        self.expect("mr-head", self.dicom(head(top=1200), 240, "MR"))
        self.expect("mr-head", self.nifti(head(), 230, 0))  # NIfTI that leaves its unit out means mm
        # Heads of no modality that shows them so; what is no head; a head that is as small as a mouse's, or whose size nobody says.
        self.expect("general", self.dicom(head(top=1200), 240, "NM"))
        z, y, x = grid()
        leg = np.where(np.hypot(x, y) < .7, .4 + .3 * (np.sin(9 * x) > 0), 0) * 800 + np.abs(noise(x.shape, 15))
        self.expect("general", self.nifti(leg, 170))
        self.expect("general", self.nifti(head(), 480))
        self.expect("general", self.nifti(head(), 230, SILENT))
        self.assertNotEqual(self.taken(self.nifti(head(), 12)), "mr-head")
        block = (np.abs(x) < .6) & (np.abs(y) < .6) & (np.abs(z) < .7) & (np.hypot(x, z) > .3)
        self.expect("general", self.nifti((block * 140 + np.abs(noise(x.shape, 3))).astype("u1"), 256))

    def test_mr_angiogram(self):
        self.expect("mr-angio", self.nifti((angiogram() * 250).astype("u1"), 80))
        self.expect("mr-angio", self.nifti(angiogram(.16) * 2500, 85))
        self.expect("mr-angio", self.dicom(angiogram(.1) * 1500, 85, "MR"))
        self.expect("general", self.dicom(angiogram(.1) * 1500, 85, "PT"))
        self.expect("general", self.nifti(angiogram(), 1, SILENT))  # a simulation
        self.assertNotEqual(self.taken(self.nifti(angiogram(.16), 400)), "mr-angio")  # samples of 7 mm hold no vessels

    def vtk(self, a, spacing):
        """A file that says lengths and no unit."""
        path = self.folder / f"a{len(list(self.folder.iterdir()))}.vtk"
        n = a.shape[::-1]
        kind = {"u1": "unsigned_char", "i2": "short", "f4": "float"}[a.dtype.str[1:]]
        text = (f"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS {n[0]} {n[1]} {n[2]}\nSPACING {spacing} {spacing} {spacing}\n"
                f"ORIGIN 0 0 0\nPOINT_DATA {a.size}\nSCALARS v {kind} 1\nLOOKUP_TABLE default\n")
        path.write_bytes(text.encode() + a.astype(a.dtype.newbyteorder(">")).tobytes())
        return path

    def test_an_angiogram_without_a_unit(self):
        # Lengths are taken for mm.
        self.expect("mr-angio", self.vtk((angiogram(.12) * 250).astype("u1"), 1.4))
        self.expect("mr-angio", self.vtk((angiogram(.16) * 2500).astype("<i2"), 1.2))
        self.expect("mr-angio", self.vtk((angiogram(.1) * 1.5).astype("<f4")[:50, :, :54], 1.3))
        self.expect("mr-angio", DATA / "carotid" / "carotid.vtk")
        # Smaller than any patient's vessels, samples too coarse for them, much that is bright, and simulations, which have no noise.
        for spacing in (0.01, 0.9, 5):
            self.assertNotEqual(self.taken(self.vtk((angiogram(.12) * 250).astype("u1"), spacing)), "mr-angio")
        for a in ((angiogram() * 250).astype("u1"), (angiogram() + 0.1 * np.cos(3 * grid()[0]) + 0.1).astype("<f4")):
            self.assertNotEqual(self.taken(self.vtk(a, 1.4)), "mr-angio")
        self.assertNotEqual(self.taken(self.vtk((angiogram(.6) * 250).clip(0, 255).astype("u1"), 1.4)), "mr-angio")

    def test_micro_ct(self):
        grey = 60 + 120 * trabecula() + noise((N, N, N), 6, 9)
        for side, unit in ((.6, MM), (600, UM), (1.1, MM)):
            self.expect("micro-ct", self.nifti(grey.astype("u1"), side, unit))
        self.expect("micro-ct", self.nifti(grey * 100, .6))
        # A CT in its units stays one, opaque by its size.
        bone = np.where(trabecula(), 1100, -985) + noise((N, N, N), 20, 9)
        bone[:, :8][bone[:, :8] < 0] += 1000  # water below it
        self.expect("ct-bone", self.nifti(bone.astype("<i2"), .6))
        self.assertIn("opacities are for", self.said)
        self.expect("general", self.nifti(grey.astype("u1"), 300))

    def test_fluorescence(self):
        self.expect("microscopy", self.nifti(cells(), 17, UM))
        self.expect("microscopy", self.nifti((cells() // 16).astype("u1"), 300, UM))
        spots = (255 * tubes(count=3, radius=.03)).astype("u1")
        stack = self.folder / "stack.tif"
        for a in (spots, cells()):
            stack.write_bytes(writers.tiff([writers.tiff_page(page) for page in a]))
            self.expect("microscopy", stack)
        # Slices of something solid are no light.
        stack.write_bytes(writers.tiff([writers.tiff_page(page) for page in (60 + 120 * trabecula() + noise((N, N, N), 6, 9)).astype("u1")]))
        self.expect("general", stack)

    def test_labels(self):
        self.expect("general", self.nifti(labels(), 300))
        self.assertIn("--labels", self.said)
        self.taken(self.nifti((labels() > 0).astype("<i2"), 300))
        self.assertIn("--labels", self.said)
        self.taken(self.nifti(labels("<i4") * 1000, 300))
        self.assertIn("--labels", self.said)
        for path, words in ((self.nifti(labels(), 300, intent=1002), ()), (self.nifti(labels(), 300), ("--labels",))):
            self.expect("labels", path, *words)
            self.assertNotIn("may hold labels", self.said)
        # Few values that are no labels: of four bits, a mask's distance, floating ones.
        z, y, x = grid()
        for a in ((head(.03, 15)).clip(0, 15).astype("u1"), (10 * np.sqrt(x * x + y * y + z * z)).astype("u1"), (head(.03, 12)).clip(0, 12).astype("u1") * 17,
                  labels().astype("<f4"), ct()):
            self.taken(self.nifti(a, 300))
            self.assertNotIn("may hold labels", self.said)

    # --- what is said of it

    def test_bundled_data(self):
        for path, preset in ((DATA / "mr_brain" / "MR.nii.gz", "mr-head"), (DATA / "ct_chest" / "chest.nrrd", "ct-bone"),
                             (DATA / "ct_head" / "quarter.nhdr", "ct-bone"), (DATA / "neuron" / "neuron.tif", "microscopy"),
                             (DATA / "engine" / "engine.nii.gz", "general"), (DATA / "hydrogen" / "hydrogen.vti", "general")):
            self.expect(preset, path)

    def test_a_named_preset_is_named(self):
        path = self.nifti(head(), 230)
        for name, words in (("mr-angio", ("--preset", "mr-angio")), ("general", ("--preset", "General"))):
            self.expect(name, path, *words)
            self.assertIsNone(self.report["request"]["preset_for"])
        self.taken(path)
        self.assertIn("head", self.report["request"]["preset_for"])
        # A window of somebody's own is where it goes.
        self.expect("mr-head", path, "--window", "100,700")
        self.assertEqual(self.report["request"]["preset_window"], [100, 700])
        self.run_it("render", path, "-o", "null:", "--mode", "composite", "--json", self.folder / "r.json")
        self.assertNotIn("preset", json.loads((self.folder / "r.json").read_text())["request"])

    def test_explain_and_the_page_name_it(self):
        path = self.nifti(head(), 230)
        done = self.run_it("render", path, "-o", "null:", "--mode", "shaded", "--explain", "--report", self.folder / "r.html")
        self.assertRegex(done.stdout.decode(), r"preset mr-head over .* to .*, as it seems to be an MR of a head")
        self.assertIn("preset mr-head over", (self.folder / "r.html").read_text())

    def test_it_is_part_of_planning_and_the_same_for_any_threads(self):
        path = self.nifti(head(), 230)
        windows = set()
        for threads in (1, 2, 5):
            self.taken(path, "--threads", threads)
            planning = self.report["planning"]
            self.assertAlmostEqual(planning["seconds"], sum(planning["parts"].values()), delta=1e-9)
            self.assertGreater(planning["parts"]["preset"], 0)
            windows.add(tuple(self.report["request"]["preset_window"]))
        self.assertEqual(len(windows), 1)
        self.run_it("render", path, "-o", "null:", "--mode", "mip", "--json", self.folder / "m.json")
        self.assertEqual(json.loads((self.folder / "m.json").read_text())["planning"]["parts"]["preset"], 0)


if __name__ == "__main__":
    unittest.main()
