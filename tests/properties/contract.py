"""What the command's contract says is the right answer to a warp or a render, worked out in f64.

Written from the contract's text alone: nothing here is taken from the program, so that the two can disagree. Frames:
    object  [sample]  centre of the first sample at 0, x first
    body    [mm]      the file's unit, origin at the centre (n-1)/2 of the volume, axes of the file
    screen  [mm]      x right, y down, z away from the eye; origin where the centre of the volume is without any geometry
    output  [sample]  screen = spacing (j - (N-1)/2)
"""

import dataclasses
import itertools
import math

import numpy as np
from scipy import ndimage

# Where each anatomical view has its right, its down and its away from the eye, in LPS.
VIEWS = {
    "front": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "back": ((-1, 0, 0), (0, 0, -1), (0, -1, 0)),
    "left": ((0, 1, 0), (0, 0, -1), (-1, 0, 0)),
    "right": ((0, -1, 0), (0, 0, -1), (1, 0, 0)),
    "top": ((-1, 0, 0), (0, 1, 0), (0, 0, -1)),
    "bottom": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
}
# Along an axis of the file, slices as stored: right, down and away as axes of the file.
FILE_VIEWS = {
    "x": ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
    "y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
}
NEAR = 1e-4  # [sample] two right programs may differ on which side of a border a position lies that is this close to it


@dataclasses.dataclass
class Volume:
    values: np.ndarray  # [z, y, x], or [y, x]: as the file means them, f64
    spacing: np.ndarray  # [mm] x first
    direction: np.ndarray  # columns: the axes of the file in LPS
    origin: np.ndarray  # [mm] centre of the first sample, LPS
    anatomical: bool

    @property
    def extent(self):
        return np.array(self.values.shape[::-1])

    def world(self, body):
        """LPS [mm] of positions in the body's frame, [..., 3]."""
        return self.origin + (body + self.spacing * (self.extent - 1) / 2) @ self.direction.T


# Geometry


def rotation(degrees):
    """About x first, then y, then z; a positive turn about z takes x (right) to y (down)."""
    turns = []
    for axis, angle in enumerate(np.radians(degrees)):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[u, u] = turn[v, v] = math.cos(angle)
        turn[v, u], turn[u, v] = math.sin(angle), -math.sin(angle)
        turns.append(turn)
    return turns[2] @ turns[1] @ turns[0]


def affine(linear, shift=(0, 0, 0)):
    full = np.eye(4)
    full[:3, :3], full[:3, 3] = linear, shift
    return full


def view_matrix(view, volume):
    """Body -> screen: signed and to the nearest axis, so that an oblique scan stays as acquired."""
    if view in FILE_VIEWS:
        return np.array(FILE_VIEWS[view], float)
    nearest = max(itertools.permutations(range(3)),
                  key=lambda of: sum(abs(volume.direction[axis, of[axis]]) for axis in range(3)))
    matrix = np.zeros((3, 3))
    for row, towards in enumerate(VIEWS[view]):
        axis = int(np.argmax(np.abs(towards)))
        column = nearest[axis]
        matrix[row, column] = np.sign(volume.direction[axis, column]) * towards[axis]
    return matrix


def placements(volume, steps, view, about=None):
    """Body -> screen, one matrix a frame. Each step is a 4x4 matrix or ("turntable", N)."""
    first = affine(view_matrix(view, volume)) if volume.values.ndim == 3 else np.eye(4)
    dims = volume.values.ndim
    fixed = np.zeros(3)
    if about is not None:
        fixed[:dims] = volume.spacing * (np.array(about) - (volume.extent - 1) / 2)
    fixed = first[:3, :3] @ fixed
    frames = [first]
    for step in steps:
        if isinstance(step, tuple):  # a turntable stands in the middle of the screen
            turns = [affine(rotation((0, 360 * k / step[1], 0))) for k in range(step[1])]
            frames = [turn @ frame for frame in frames for turn in turns]
        else:
            frames = [affine(np.eye(3), fixed) @ step @ affine(np.eye(3), -fixed) @ frame for frame in frames]
    return frames


def corners(volume, placed):
    """Screen positions of the volume's eight corners, half a spacing beyond the outermost centres."""
    half = volume.spacing * volume.extent / 2
    body = np.array(list(itertools.product((-1, 1), repeat=3))) * half
    return body @ placed[:3, :3].T + placed[:3, 3]


def to_object(volume, placed):
    """(A, b): object = A screen + b."""
    back = np.linalg.inv(placed)
    scale = np.diag(1 / volume.spacing)
    return scale @ back[:3, :3], scale @ back[:3, 3] + (volume.extent - 1) / 2


def grid(size, spacing):
    """Screen positions of output samples, [..., y, x, dims]."""
    axes = [s * (np.arange(n) - (n - 1) / 2) for n, s in zip(size, spacing)]
    return np.stack(np.meshgrid(*axes[::-1], indexing="ij")[::-1], axis=-1)


# Fields: what the samples mean


class Field:
    """Value at object positions [..., dims], where the nearest sample continues outside the outermost centres."""

    def __init__(self, values, reference):
        self.reference = reference
        self.finite = np.isfinite(values)
        self.holes = not self.finite.all()
        filled = np.where(self.finite, values, 0.0)
        self.last = np.array(values.shape) - 1
        self.samples = filled
        self.order = {"spline": 3, "linear": 1, "nearest": 0}[reference]
        if self.order == 3:
            self.samples = ndimage.spline_filter(filled, 3, output=np.float64, mode="mirror")

    def __call__(self, positions):
        at = np.moveaxis(np.clip(positions[..., ::-1], 0, self.last), -1, 0)
        if self.order == 0:
            index = tuple(np.floor(at + 0.5).astype(int))
            return np.where(self.finite[index], self.samples[index], np.nan)
        # Whole-sample symmetry is the continuation under which the coefficients were found.
        value = ndimage.map_coordinates(self.samples, at, order=self.order, mode="mirror", prefilter=False)
        if self.holes:
            # In the voxel of a sample that is not finite there is nothing; elsewhere the weights of the others add up to 1. (Of a
            # spline that is a guess: the program says what its field is beside them.)
            index = tuple(np.floor(at + 0.5).astype(int))
            share = ndimage.map_coordinates(self.finite.astype(float), at, order=1, mode="nearest")
            value = np.where(self.finite[index], value / np.maximum(share, 1e-9) if self.order == 1 else value, np.nan)
        return value

    def beside_holes(self, positions):
        """Where a filter of two samples reads one that is not finite: a result of a warp need not be finite there."""
        at = np.moveaxis(np.clip(positions[..., ::-1], 0, self.last), -1, 0)
        return ndimage.map_coordinates(self.finite.astype(float), at, order=1, mode="nearest") < 1 - 1e-12

    def unsure(self, positions):
        """Where the nearest sample is anybody's guess: half-way between two."""
        if self.order and not self.holes:
            return np.zeros(positions.shape[:-1], bool)
        last = self.last[::-1]
        fraction = positions - np.floor(positions)
        return ((np.abs(fraction - 0.5) < NEAR) & (positions > 0) & (positions < last)).any(-1)


@dataclasses.dataclass
class Answer:
    values: np.ndarray  # [frame, y, x] or [frame, y, x, 3] of a render, [z, y, x] or [y, x] of a warp
    seen: np.ndarray  # of the same shape without the colours: the sample sees the input
    missed: np.ndarray  # it surely does not; neither: on the border, or not defined
    miss: object  # the value there
    edge: np.ndarray = None  # rays that run in a face of the volume: they may be counted as seeing it


def warp(volume, placed, size, spacing, reference, outside):
    dims = volume.values.ndim
    if dims == 2:  # an image is a plane: its third axis is never left
        keep = np.ix_([0, 1, 3], [0, 1, 3])
        back = np.linalg.inv(placed[keep])
        linear = back[:2, :2] / volume.spacing[:, None]
        shift = back[:2, 2] / volume.spacing + (volume.extent - 1) / 2
    else:
        linear, shift = to_object(volume, placed)
    at = grid(size, spacing) @ linear.T + shift
    field = Field(volume.values, reference)
    beyond = np.maximum(-0.5 - at, at - (volume.extent - 0.5)).max(-1)
    values = np.where(beyond < 0, field(at), outside)
    unsure = field.unsure(at) | ~np.isfinite(values)
    if field.holes:
        unsure |= field.beside_holes(at)
    return Answer(values, (beyond < -NEAR) & ~unsure, beyond > NEAR, outside)


# Rays


def eye_distance(volume, frames, angle, aspect):
    """Distance of the eye from the plane z = 0: as near as it can be with every corner inside the picture."""
    slope = math.tan(math.radians(angle) / 2)
    need = []
    for placed in frames:
        for x, y, z in corners(volume, placed):
            need.append(abs(y) / slope - z)
            if aspect:
                need.append(abs(x) / (slope * aspect) - z)
    return max(need)


@dataclasses.dataclass
class Clip:
    """What rays see of the volume: half spaces a x + b y + c z + d >= 0 of samples, so much about the screen's z = 0 [mm], and
    balls about samples (x, y, z) of a radius [mm]."""
    planes: tuple = ()
    slab: object = None
    balls: tuple = ()

    def half_spaces(self, volume, placed):
        yield from (np.array(plane, float) for plane in self.planes)
        if self.slab is not None:
            normal = placed[2, :3] * volume.spacing
            depth = placed[2, 3] - normal @ (volume.extent - 1) / 2
            for sign in (1, -1):
                yield np.append(sign * normal, sign * depth + self.slab / 2)


def clipped(start, along, extent, grow, half_spaces=(), balls=(), spacing=None):
    """First and last parameter of each ray within the volume, or within a part of it, grown by `grow` samples."""
    low, high = -0.5 - grow, extent - 0.5 + grow
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = (low - start) / along, (high - start) / along
    parallel = np.abs(along) < 1e-12
    within = (start > low) & (start < high)
    near = np.where(parallel, np.where(within, -np.inf, np.inf), np.minimum(one, two)).max(-1)
    far = np.where(parallel, np.where(within, np.inf, -np.inf), np.maximum(one, two)).min(-1)
    for plane in half_spaces:
        plane = plane / np.linalg.norm(plane[:3])
        base, slope = start @ plane[:3] + plane[3] + grow, along @ plane[:3]
        with np.errstate(divide="ignore", invalid="ignore"):
            at = -base / slope
        still = np.abs(slope) < 1e-12
        near = np.where(still, np.where(base > 0, near, np.inf), np.where(slope > 0, np.maximum(near, at), near))
        far = np.where(still, np.where(base > 0, far, -np.inf), np.where(slope < 0, np.minimum(far, at), far))
    for *centre, radius in balls:
        away, step = (start - centre) * spacing, along * spacing
        a, b = (step * step).sum(-1), (away * step).sum(-1)
        root = b * b - a * ((away * away).sum(-1) - (radius + grow * spacing.min()) ** 2)
        half = np.sqrt(np.maximum(0, root))
        near = np.where(root > 0, np.maximum(near, (-b - half) / a), np.inf)
        far = np.where(root > 0, np.minimum(far, (-b + half) / a), -np.inf)
    return near, far


@dataclasses.dataclass
class Look:
    """What a mode needs to know."""
    mode: str
    zero: float = 0.0
    points: tuple = ()  # (value, opacity, (r, g, b)), ascending
    unit: float = 1.0
    background: tuple = (0.0, 0.0, 0.0)


def default_look(volume, mode, zero=None, points=None, unit=None, background=(0, 0, 0)):
    data = volume.values[np.isfinite(volume.values)]
    low, high = (data.min(), data.max()) if data.size else (0.0, 0.0)
    if zero is None:
        zero = min(0.0, low)
    if points is None:
        points = ((low, 0.0, (0, 0, 0)), (high, 0.05, (1, 1, 1)))
        # Sparse data: for a half to a 16th of the spacing, so that the mean is a 16th of the ramp.
        share, part = (data.mean() - low) / (high - low) if high > low else 1, 1
        while part < 16 and share * part < 1 / 16:
            part *= 2
        unit = volume.spacing.min() / part
    return Look(mode, zero, tuple(points), unit or volume.spacing.min(), tuple(background))


def miss_value(volume, look):
    data = volume.values[np.isfinite(volume.values)]
    if look.mode == "mip":
        return data.min() if data.size else 0.0
    if look.mode == "minip":
        return data.max() if data.size else 0.0
    if look.mode == "composite":
        return np.array(look.background)
    return 1.0 if look.mode == "drr" else 0.0


def along_rays(values, length, counts, starts, look, volume):
    """One result a ray from its samples; `length` is that which each sample stands for. NaN is outside."""
    finite = np.isfinite(values)
    value = np.where(finite, values, 0)
    weight = np.where(finite, length, 0)

    def total(x):
        return np.add.reduceat(x, starts)

    inside = total(weight)
    with np.errstate(divide="ignore", invalid="ignore"):
        if look.mode == "mip":
            return np.maximum.reduceat(np.where(finite, values, -np.inf), starts), inside
        if look.mode == "minip":
            return np.minimum.reduceat(np.where(finite, values, np.inf), starts), inside
        if look.mode == "xray":
            return total((value - look.zero) * weight), inside
        if look.mode == "drr":
            return np.exp(-total(0.0206 * np.maximum(0, 1 + value / 1000) * weight)), inside
        mean = total(value * weight) / inside
        if look.mode == "mean":
            return mean, inside
        if look.mode == "stddev":
            apart = value - np.repeat(mean, counts)
            return np.sqrt(total(apart * apart * weight) / inside), inside
    # Composite: front to back.
    at = [point[0] for point in look.points]
    opacity = np.interp(value, at, [point[1] for point in look.points])
    light = np.log1p(-np.minimum(opacity, 1 - 1e-15)) * weight / look.unit  # logarithm of what a sample lets through
    running = np.cumsum(light)
    before = running - light
    before -= np.repeat(before[starts], counts)
    through = np.exp(before)
    shown = through * -np.expm1(light)
    left = np.exp(total(light))
    colours = []
    for channel in range(3):
        colour = np.interp(value, at, [point[2][channel] for point in look.points])
        colours.append(total(shown * colour) + left * look.background[channel])
    return np.stack(colours, -1), inside


@dataclasses.dataclass
class Eye:
    distance: float  # [mm] before the plane z = 0 of the screen
    plane: float  # [mm] from the eye to where pixels are `spacing` apart


def eye_of(volume, frames, angle, size, spacing):
    """The picture spans the angle from top to bottom, whatever its spacing is, which only gives it its proportions."""
    height = size[1] * spacing[1]
    return Eye(eye_distance(volume, frames, angle, size[0] * spacing[0] / height),
               height / 2 / math.tan(math.radians(angle) / 2))


def render(volume, frames, size, spacing, look, reference, eye=None, finer=1, phase=None, clip=Clip()):
    """`finer` divides the step of 1/8 of the smallest spacing.

    Where the first step begins is free: rays are cut into equal steps, or, with a phase, into whole ones of which the first
    begins that part of a step before the volume.
    """
    field = Field(volume.values, reference)
    miss = miss_value(volume, look)
    plane = grid(size, spacing)
    pixels = np.concatenate([plane, np.zeros(plane.shape[:2] + (1,))], -1).reshape(-1, 3)
    if eye is None:
        origin, heading = pixels, np.broadcast_to([0.0, 0.0, 1.0], pixels.shape)
    else:
        origin = np.broadcast_to([0.0, 0.0, -eye.distance], pixels.shape)
        heading = pixels + [0.0, 0.0, eye.plane]
        heading = heading / np.linalg.norm(heading, axis=-1, keepdims=True)
    step = volume.spacing.min() / 8 / finer
    pictures, seen, missed, edges = [], [], [], []
    for placed in frames:
        linear, shift = to_object(volume, placed)
        start, along = origin @ linear.T + shift, heading @ linear.T
        planes = list(clip.half_spaces(volume, placed))
        near, far = clipped(start, along, volume.extent, 0, planes, clip.balls, volume.spacing)
        least, most = (clipped(start, along, volume.extent, grow, planes, clip.balls, volume.spacing) for grow in (-NEAR, NEAR))
        hit = least[1] > least[0]
        missing = most[1] <= most[0]
        result = np.empty((len(pixels),) + np.shape(miss))
        result[...] = miss
        body_speed = np.linalg.norm(along * volume.spacing, axis=-1)  # body [mm] a screen [mm]
        edge = ~hit & (most[1] - most[0] > 2 * NEAR)
        near, far = np.where(edge, most[0] + NEAR, near), np.where(edge, most[1] - NEAR, far)
        drawn = np.flatnonzero(hit | edge)
        early = phase or 0.0
        counts = np.maximum(1, np.ceil((far - near)[drawn] * body_speed[drawn] / step + early)).astype(int)
        unsure = np.zeros(len(pixels), bool)
        begin = 0
        while begin < len(drawn):
            end = max(begin + 1, int(np.searchsorted(np.cumsum(counts[begin:]), 400_000)) + begin)
            ray, count = drawn[begin:end], counts[begin:end]
            starts = np.concatenate([[0], np.cumsum(count)[:-1]])
            within = np.arange(count.sum()) - np.repeat(starts, count)
            of = np.repeat(ray, count)
            each = np.repeat((far - near)[ray] / count if phase is None else step / body_speed[ray], count)
            low = np.maximum(near[of], near[of] + (within - early) * each)
            high = np.minimum(far[of], near[of] + (within + 1 - early) * each)
            t, length = 0.5 * (low + high), np.maximum(high - low, 0)
            values = field(start[of] + t[:, None] * along[of])
            answer, inside = along_rays(values, length, count, starts, look, volume)
            empty = inside <= 0  # nothing but samples that are not finite
            answer[empty] = miss
            unsure[ray[empty]] = True
            result[ray] = answer
            if reference == "nearest":  # a ray that runs between two samples all the way
                still = np.abs(along[ray]) < 1e-9
                apart = np.abs(start[ray] - np.floor(start[ray]) - 0.5) < NEAR
                unsure[ray] |= (still & apart & (start[ray] > 0) & (start[ray] < volume.extent - 1)).any(-1)
                # A corner of a voxel that is shorter than a step is met or missed by where samples begin, which the
                # contract leaves open.
                for shift in (np.arange(1, 8) / 8 if look.mode in ("mip", "minip") else ()):
                    other = field(start[of] + (t + shift * length)[:, None] * along[of])
                    other = along_rays(other, length, count, starts, look, volume)[0]
                    unsure[ray] |= other != answer
            begin = end
        shape = plane.shape[:2]
        pictures.append(result.reshape(shape + np.shape(miss)))
        seen.append((hit & ~unsure).reshape(shape))
        missed.append(missing.reshape(shape))
        edges.append((edge & ~unsure).reshape(shape))
    return Answer(np.stack(pictures), np.stack(seen), np.stack(missed), miss, np.stack(edges))


# Errors


def nrmse(output, answer, wanted_range=None, scale=0.0, edges=False):
    """As the contract defines it: over what sees the input, range of the right answer there.

    `scale`: of the numbers that the answer is made of; f64 leaves 1e-12 of them in what is zero or constant.
    `edges`: rays that run in a face count as well.
    """
    seen = answer.seen | answer.edge if edges and answer.edge is not None else answer.seen
    right, given = answer.values[seen], output[seen]
    if right.size == 0:
        return 0.0, 1.0
    width = right.max() - right.min()
    magnitude = np.abs(right).max()
    # A file of f32 holds no difference below 2^-24 of its values, and sums along a ray round some 64 times.
    if width <= max(64 * 2.0 ** -24 * magnitude, 1e-9 * scale):
        width = magnitude if magnitude > 1e-9 * scale else 1.0
    if wanted_range:
        width = wanted_range
    return float(np.sqrt(np.mean((given.astype(float) - right) ** 2)) / width), float(width)
