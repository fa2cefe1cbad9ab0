"""Where a warp's header says that its samples lie: results laid over inputs, sample by sample, as a viewer would.

Headers are read and written here by code of its own (NRRD, NIfTI, MetaImage), in LPS. The field is linear in space, so that
linear interpolation gives it without error, and whole steps, turns, croppings and formats are checked by its values alone.
"""

import gzip
import pathlib
import re
import struct
import unittest

import numpy as np

from running import Running, png


def turn_of(x, y, z):
    """EQ 37: about x, then y, then z [degree]."""
    a, b, c = np.radians([x, y, z])
    rx = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    ry = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    rz = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return rz @ ry @ rx


class Grid:
    """Samples [x, y, z] at origin + steps @ index, in LPS."""

    def __init__(self, values, steps, origin):
        self.values, self.steps, self.origin = values, np.asarray(steps, float), np.asarray(origin, float)

    def places(self):
        index = np.stack(np.meshgrid(*map(np.arange, self.values.shape), indexing="ij"), -1)
        return index @ self.steps.T + self.origin

    def index(self, places):
        return (places - self.origin) @ np.linalg.inv(self.steps).T

    def middle(self):
        return self.steps @ ((np.array(self.values.shape) - 1) / 2) + self.origin

    def own_axes(self):
        """Perpendicular axes of which the first is x and the second lies in the plane of x and y."""
        q, r = np.linalg.qr(self.steps)
        return q * np.sign(np.diag(r))


def write_nrrd(path, grid):
    steps = " ".join("(" + ",".join(map(repr, map(float, column))) + ")" for column in grid.steps.T)
    origin = ",".join(map(repr, map(float, grid.origin)))
    head = (f"NRRD0004\ntype: float\ndimension: 3\nspace: left-posterior-superior\n"
            f"sizes: {' '.join(map(str, grid.values.shape))}\nspace directions: {steps}\nspace origin: ({origin})\n"
            "endian: little\nencoding: raw\n\n")
    pathlib.Path(path).write_bytes(head.encode() + grid.values.astype("<f4").tobytes(order="F"))


def write_nifti(path, grid):
    flip = np.diag([-1, -1, 1])
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *grid.values.shape, 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 16, 32)
    struct.pack_into("<8f", head, 76, 1, *np.linalg.norm(grid.steps, axis=0), 0, 0, 0, 0)
    struct.pack_into("<f", head, 108, 352)
    head[123] = 2
    struct.pack_into("<2h", head, 252, 0, 1)
    rows = np.hstack([flip @ grid.steps, (flip @ grid.origin)[:, None]])
    struct.pack_into("<12f", head, 280, *rows.ravel())
    head[344:348] = b"n+1\0"
    data = bytes(head) + grid.values.astype("<f4").tobytes(order="F")
    pathlib.Path(path).write_bytes(gzip.compress(data) if str(path).endswith(".gz") else data)


def write_metaimage(path, grid):
    spacing = np.linalg.norm(grid.steps, axis=0)
    text = lambda numbers: " ".join(repr(float(n)) for n in numbers)
    head = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
            f"TransformMatrix = {text((grid.steps / spacing).T.ravel())}\nOffset = {text(grid.origin)}\n"
            f"ElementSpacing = {text(spacing)}\nDimSize = {' '.join(map(str, grid.values.shape))}\n"
            "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n")
    pathlib.Path(path).write_bytes(head.encode() + grid.values.astype("<f4").tobytes(order="F"))


def read_nrrd(data):
    head, samples = data.split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines()[1:] if ": " in line)
    shape = [int(size) for size in fields["sizes"].split()]
    vectors = [np.array([float(n) for n in v.split(",")]) for v in re.findall(r"\(([^)]*)\)", fields["space directions"])]
    origin = [float(n) for n in fields["space origin"].strip("()").split(",")]
    return shape, samples, np.array(vectors).T, origin


def read_nifti(data):
    shape = list(struct.unpack_from("<3h", data, 42))
    assert struct.unpack_from("<h", data, 254)[0] > 0, "no sform"
    rows = np.array(struct.unpack_from("<12f", data, 280)).reshape(3, 4)
    flip = np.diag([-1, -1, 1])
    return shape, data[352:], flip @ rows[:, :3], flip @ rows[:, 3]


def read_metaimage(data):
    head, samples = data.split(b"ElementDataFile = LOCAL\n", 1)
    fields = dict(line.split(" = ", 1) for line in head.decode().splitlines())
    numbers = lambda name: np.array([float(n) for n in fields[name].split()])
    # ITK: the rows of the text are where x, y and z point.
    return [int(n) for n in fields["DimSize"].split()], samples, \
        numbers("TransformMatrix").reshape(3, 3).T * numbers("ElementSpacing"), numbers("Offset")


def read(path):
    data = pathlib.Path(path).read_bytes()
    name = str(path)
    if name.endswith(".gz"):
        data = gzip.decompress(data)
    reader = read_nrrd if name.endswith(".nrrd") else read_metaimage if name.endswith(".mha") else read_nifti
    shape, samples, steps, origin = reader(data)
    values = np.frombuffer(samples, "<f4", np.prod(shape)).reshape(shape, order="F")
    return Grid(values, steps, origin)


WRITERS = {".nrrd": write_nrrd, ".nii": write_nifti, ".nii.gz": write_nifti, ".mha": write_metaimage}
FIELD = np.array([1.0, -2.0, 0.5])  # per mm, over 100


def random_grid(seed, lean=0.0):
    random = np.random.default_rng(seed)
    shape = random.integers(7, 15, 3)
    q, _ = np.linalg.qr(random.normal(size=(3, 3)))
    if seed % 2:
        q[:, 0] *= -1  # left-handed too
    shear = np.eye(3)
    shear[1, 2], shear[0, 1] = lean, lean / 2
    steps = q @ shear * random.uniform(0.5, 3, 3)
    grid = Grid(np.zeros(shape), steps, random.uniform(-50, 50, 3))
    grid.values = 100 + grid.places() @ FIELD
    return grid


class Overlays(Running):
    def warped(self, grid, input_ending, output_ending, *words):
        name, out = self.folder / ("in" + input_ending), self.folder / ("out" + output_ending)
        WRITERS[input_ending](name, grid)
        self.run_it("warp", name, "-o", out, "--via", "warp.backward/filter=foh", "--max-error", "9", *words)
        return read(out)

    def expect_over(self, grid, out, what, turn=np.eye(3), least=20):
        """Each output sample has the value of the place where it lies, moved back."""
        back = np.linalg.inv(turn)
        places = (out.places() - grid.middle()) @ back.T + grid.middle()
        index = grid.index(places)
        inside = np.all((index >= 0) & (index <= np.array(grid.values.shape) - 1), -1)
        self.assertGreaterEqual(inside.sum(), least, what)
        right = 100 + places @ FIELD
        # Headers of NIfTI are f32: 2^-24 of 100 mm and as much of each of 30 steps of 3 mm, times the field's slope and the
        # fourfold sum of axes; samples are f32 of up to 400.
        self.assertLess(np.abs(out.values - right)[inside].max(), 4e-4, what)

    def test_what_turns_the_grid_lies_over_the_input(self):
        seed = 0
        for view in ("x", "y", "front", "back", "Left", "right", "top", "axial"):
            for sizes in ([], ["--spacing", "0.9,1.1,1.3"], ["--size", "12x11x10", "--spacing", "0.8"], ["--size", "9"],
                          ["--size", "fit", "--spacing", "1.1"]):
                seed += 1
                input_ending = list(WRITERS)[seed % 4]
                output_ending = list(WRITERS)[(seed // 4 + view.count("t")) % 4]
                grid = random_grid(seed, lean=0.4 * (seed % 3 == 0))
                out = self.warped(grid, input_ending, output_ending, "--view", view, *sizes)
                self.expect_over(grid, out, (seed, view, sizes))

    def test_move_grid_is_an_oblique_plane_that_lies_over_the_input(self):
        for seed in range(100, 112):
            angles = np.random.default_rng(seed).uniform(-80, 80, 3)
            steps = ["--rotate", ",".join(map(str, angles)), "--translate", "0.5,1,-0.7"]
            steps += ["--scale", "1.5,1.2,0.8"] if seed % 2 else ["--view", "y"]
            size = ["--size", "16x15x1", "--spacing", "0.7"] if seed % 3 == 0 else []
            grid = random_grid(seed, lean=0.3 * (seed % 4 == 0))
            out = self.warped(grid, list(WRITERS)[seed % 4], list(WRITERS)[(seed + seed // 4) % 4], "--move", "grid",
                              *steps, *size)
            self.expect_over(grid, out, seed)

    def test_all_else_moves_the_content_and_leaves_the_grid(self):
        for seed in range(200, 212):
            angles = np.random.default_rng(seed).uniform(-50, 50, 3)
            sizes = [[], ["--size", "fit"], ["--size", "12x14x9", "--spacing", "1"], ["--spacing", "1.2"]][seed % 4]
            grid = random_grid(seed, lean=0.3 * (seed % 3 == 0))
            out = self.warped(grid, list(WRITERS)[seed % 4], list(WRITERS)[(seed // 4) % 4], "--rotate",
                              ",".join(map(str, angles)), *sizes)
            axes = grid.own_axes()
            self.expect_over(grid, out, seed, axes @ turn_of(*angles) @ axes.T)
            cosines = out.steps / np.linalg.norm(out.steps, axis=0) - grid.steps / np.linalg.norm(grid.steps, axis=0)
            self.assertLess(np.abs(cosines).max(), 3e-7, seed)  # f32
            if not sizes:
                self.assertEqual(out.values.shape, grid.values.shape)
                self.assertLess(np.abs(out.origin - grid.origin).max(), 1e-5, seed)

    def test_a_view_is_a_copy_and_no_geometry_keeps_everything(self):
        grid = random_grid(7, lean=0.4)
        write_nrrd(self.folder / "in.nrrd", grid)
        self.run_it("warp", self.folder / "in.nrrd", "-o", self.folder / "same.nrrd")
        same = read(self.folder / "same.nrrd")
        self.assertTrue(np.array_equal(same.values, grid.values.astype("f4")))
        self.assertLess(np.abs(same.steps - grid.steps).max(), 1e-6)
        self.assertTrue(np.array_equal(same.origin, grid.origin))
        self.run_it("warp", self.folder / "in.nrrd", "-o", self.folder / "view.nrrd", "--view", "x")
        view = read(self.folder / "view.nrrd")
        self.assertTrue(np.array_equal(view.values, np.transpose(grid.values.astype("f4"), (1, 2, 0))))

    def test_depth_that_is_cut_off_is_said(self):
        write_nrrd(self.folder / "deep.nrrd", random_grid(8))
        base = ["warp", self.folder / "deep.nrrd", "-o", self.folder / "o.nrrd"]
        for words, said in ((["--rotate", "90,0,0", "--size", "20x20x2", "--spacing", "1"], True), (["--view", "x"], False),
                            (["--rotate", "20,10,0", "--size", "fit"], False), (["--size", "9x9x1"], True)):
            self.assertEqual(b"cut off" in self.run_it(*base, *words).stderr, said, words)

    def test_a_format_that_cannot_say_that_axes_lean_refuses(self):
        write_nrrd(self.folder / "lean.nrrd", random_grid(9, lean=0.4))
        done = self.run_it("warp", self.folder / "lean.nrrd", "-o", self.folder / "o.tif", code=2)
        self.assertIn(b"lean", done.stderr)


class SpacingsOfF32(Running):
    def test_quarter_turns_have_the_extents_of_the_input(self):
        for seed in range(40):
            q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
            for step in (1.0, 0.48828125, 0.7):
                grid = Grid(np.random.default_rng(seed).normal(size=(14, 12, 10)), q * step, [1, 2, 3])
                write_nifti(self.folder / "q.nii", grid)
                self.run_it("warp", self.folder / "q.nii", "-o", self.folder / "t.nii", "--rotate", "0,0,90", "--size", "fit")
                turned = read(self.folder / "t.nii")
                self.assertEqual(turned.values.shape, (12, 14, 10), (seed, step))
                # Right comes to lie below: a copy of samples.
                right = np.transpose(grid.values.astype("f4"), (1, 0, 2))[::-1]
                self.assertTrue(np.array_equal(turned.values, right), (seed, step))
                if step == 1:
                    self.run_it("render", self.folder / "q.nii", "--view", "z", "--size", "native", "-o", self.folder / "p.nii")
                    data = (self.folder / "p.nii").read_bytes()
                    self.assertEqual(struct.unpack_from("<2h", data, 42), (14, 12))


class Leaning(Running):
    """A grid whose axes are not perpendicular, as that of a tilted gantry."""

    def ball(self, lean):
        shape = np.array([48, 40, 36])
        spacing = np.array([0.5, 0.8, 0.9])
        shear = np.eye(3)
        shear[1, 2], shear[0, 2], shear[0, 1] = lean
        steps = turn_of(5, 4, 3) @ shear * spacing
        grid = Grid(np.zeros(shape), steps, [0, 0, 0])
        far = np.linalg.norm(grid.places() - grid.middle(), axis=-1)
        grid.values = np.clip(8 - far, 0, 1)
        return grid

    def test_pictures_of_a_ball_are_discs_from_everywhere(self):
        for lean in ((0.5, 0, 0), (-0.4, 0.3, 0.2)):
            write_nifti(self.folder / "ball.nii.gz", self.ball(lean))
            for view in ("front", "left", "top", "x", "y", "z"):
                for mode in ("mip", "xray"):
                    out = self.folder / "disc.nrrd"
                    self.run_it("render", self.folder / "ball.nii.gz", "-o", out, "--view", view, "--mode", mode,
                                "--size", "native", "--max-error", "0.05")
                    head, data = out.read_bytes().split(b"\n\n", 1)
                    sizes = [int(n) for n in re.search(rb"sizes: (\d+) (\d+)", head).groups()]
                    disc = np.frombuffer(data, "<f4").reshape(sizes[::-1])
                    y, x = np.nonzero(disc > 0.5)
                    long, short = np.sqrt(np.linalg.eigvalsh(np.cov(x, y))[::-1])
                    # Between slices a rim is uncertain by half their distance of 0.9 mm, at both ends of 15 mm. Without
                    # its lean the grid would show 1.2 and more.
                    self.assertLess(long / short, 1.06, (lean, view, mode))
                    self.assertAlmostEqual(np.sqrt(len(x) / np.pi) * 0.5, 7.6, delta=0.3)
                    if mode == "xray":
                        # Along the middle of the ball: 7 mm of ones and two rims of a half, either way.
                        middle = disc[int(y.mean()), int(x.mean())]
                        self.assertAlmostEqual(middle, 15, delta=0.4)

    def test_a_plane_through_it_is_a_picture_that_does_not_lean(self):
        write_nifti(self.folder / "ball.nii.gz", self.ball((0.5, 0.2, 0)))
        out = self.folder / "plane.png"
        for size in (["--size", "90x90x1", "--spacing", "0.4"], ["--size", "90x70x1"]):  # alone: its pixels are square
            done = self.run_it("warp", self.folder / "ball.nii.gz", "-o", out, "--rotate", "90,0,0", *size)
            self.assertNotIn(b"square", done.stderr)
            y, x = np.nonzero(png(out.read_bytes()) > 127)
            long, short = np.sqrt(np.linalg.eigvalsh(np.cov(x, y))[::-1])
            self.assertLess(long / short, 1.06, size)


class Pictures(Running):
    def test_one_plane_is_a_picture_in_a_file_or_on_standard_output(self):
        words = ["warp", "phantom:gaussians:40", "--rotate", "20,30,40", "--size", "50x30x1"]
        self.run_it(*words, "-o", self.folder / "mpr.png")
        file = (self.folder / "mpr.png").read_bytes()
        self.assertEqual(png(file).shape, (30, 50))
        for extra in ([], ["--explain"], ["--verify"], ["--json", self.folder / "r.json"]):
            self.assertEqual(self.run_it(*words, "-o", "-", *extra).stdout, file, extra)
        picture = self.run_it("render", "phantom:gaussians:20", "--size", "native", "-o", "-").stdout
        self.assertEqual(png(picture).shape, (20, 20))
        self.run_it(*words, "-o", "-", "--json", "-", code=2)
        self.run_it("render", "phantom:gaussians:20", "-o", "-", "--turntable", "3", code=2)
        self.run_it("warp", "phantom:gaussians:20", "-o", "-", code=2)  # twenty planes are no picture

    def test_pixels_that_are_not_square_are_said(self):
        write_nrrd(self.folder / "flat.nrrd", Grid(np.zeros((9, 8, 7)), np.diag([1, 1, 3]), [0, 0, 0]))
        base = ["warp", self.folder / "flat.nrrd", "-o", self.folder / "p.png", "--view", "x"]
        self.assertIn(b"square", self.run_it(*base, "--size", "8x7x1", "--spacing", "1,3,1").stderr)
        self.assertNotIn(b"square", self.run_it(*base, "--size", "8x21x1", "--spacing", "1").stderr)


if __name__ == "__main__":
    unittest.main()
