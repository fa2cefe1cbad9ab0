"""Reads and writes the plain files that the fuzzer exchanges with the command: raw NRRD, and NIfTI for values with a slope."""

import pathlib
import struct
import zlib

import numpy as np

NRRD_TYPES = {"u1": "uint8", "i1": "int8", "u2": "uint16", "i2": "int16", "u4": "uint32", "i4": "int32", "f4": "float", "f8": "double"}
NRRD_NAMES = {"uint8": "u1", "unsigned char": "u1", "uchar": "u1", "uint8_t": "u1", "int8": "i1", "signed char": "i1",
              "ushort": "u2", "unsigned short": "u2", "uint16": "u2", "short": "i2", "signed short": "i2", "int16": "i2",
              "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "double": "f8"}
NIFTI_TYPES = {"u1": 2, "i2": 4, "i4": 8, "f4": 16, "f8": 64, "i1": 256, "u2": 512, "u4": 768}


def kind_of(array):
    return array.dtype.kind + str(array.dtype.itemsize)


def write_nrrd(path, stored, spacing, direction=None, origin=None):
    """`direction`: columns in LPS; None: a file that does not say where it lies."""
    head = [f"NRRD0004", f"type: {NRRD_TYPES[kind_of(stored)]}", f"dimension: {stored.ndim}"]
    if direction is not None:
        head.append("space: left-posterior-superior")
    head.append("sizes: " + " ".join(map(str, stored.shape[::-1])))
    if direction is not None:
        vectors = [",".join(repr(float(x)) for x in direction[:, a] * spacing[a]) for a in range(3)]
        head.append("space directions: " + " ".join(f"({v})" for v in vectors))
        head.append("space origin: (" + ",".join(repr(float(x)) for x in origin) + ")")
    else:
        head.append("spacings: " + " ".join(repr(float(s)) for s in spacing))
    head += ["endian: little", "encoding: raw", "", ""]
    pathlib.Path(path).write_bytes("\n".join(head).encode() + stored.astype("<" + kind_of(stored)).tobytes())


def read_nrrd(path):
    """(samples with the slowest axis first, spacing, direction or None, origin or None); an axis of colours comes last."""
    head, data = pathlib.Path(path).read_bytes().split(b"\n\n", 1)
    fields = {}
    for line in head.decode().splitlines()[1:]:
        if ":" in line and not line.startswith("#"):
            key, value = line.split(":", 1)
            fields[key.strip()] = value.strip().lstrip("=").strip()
    if fields["encoding"] in ("gzip", "gz"):
        data = zlib.decompress(data, 47)
    order = ">" if fields.get("endian", "little") == "big" else "<"
    sizes = [int(n) for n in fields["sizes"].split()]
    samples = np.frombuffer(data, order + NRRD_NAMES[fields["type"]], int(np.prod(sizes))).reshape(sizes[::-1])
    spacing = direction = origin = None
    if "spacings" in fields:
        spacing = np.array([float(s) for s in fields["spacings"].split()])
        spacing = spacing[np.isfinite(spacing)]
    if "space directions" in fields:
        words = fields["space directions"].replace("none", "").split(")")
        columns = np.array([[float(x) for x in word.split("(")[1].split(",")] for word in words if "(" in word]).T
        spacing = np.linalg.norm(columns, axis=0)
        direction = columns / np.where(spacing > 0, spacing, 1)
    if "space origin" in fields:
        origin = np.array([float(x) for x in fields["space origin"].strip("()").split(",")])
    return samples, spacing, direction, origin


def write_nifti(path, stored, spacing, direction, origin, slope=1.0, intercept=0.0, coded=True):
    """`direction`, `origin` in LPS. Returns both as the f32 of the header has them."""
    flip = np.diag([-1.0, -1.0, 1.0])  # LPS and RAS
    matrix = np.float32(flip @ (direction * spacing))
    corner = np.float32(flip @ origin)
    head = bytearray(348)
    struct.pack_into("<i", head, 0, 348)
    shape = list(stored.shape[::-1]) + [1] * 4
    struct.pack_into("<8h", head, 40, 3, *shape[:7])
    struct.pack_into("<h", head, 70, NIFTI_TYPES[kind_of(stored)])
    struct.pack_into("<h", head, 72, stored.dtype.itemsize * 8)
    struct.pack_into("<8f", head, 76, 1, *spacing, 0, 0, 0, 0)
    struct.pack_into("<f", head, 108, 352)
    struct.pack_into("<2f", head, 112, slope, intercept)
    head[123] = 2  # millimetres
    if coded:
        struct.pack_into("<2h", head, 252, 0, 1)
        for row in range(3):
            struct.pack_into("<4f", head, 280 + 16 * row, *matrix[row], corner[row])
    head[344:348] = b"n+1\0"
    pathlib.Path(path).write_bytes(bytes(head) + bytes(4) + stored.astype("<" + kind_of(stored)).tobytes())
    return flip @ matrix.astype(float), flip @ corner.astype(float)


def read_nifti(path):
    data = pathlib.Path(path).read_bytes()
    if data[:2] == b"\x1f\x8b":
        data = zlib.decompress(data, 47)
    rank, *shape = struct.unpack_from("<8h", data, 40)
    code, = struct.unpack_from("<h", data, 70)
    offset, slope, intercept = struct.unpack_from("<3f", data, 108)
    name = {code: name for name, code in NIFTI_TYPES.items()}[code]
    shape = shape[:max(rank, 3)]
    stored = np.frombuffer(data, "<" + name, int(np.prod(shape)), int(offset)).reshape(shape[::-1])
    stored = stored.reshape(stored.shape[-3:]) if stored.ndim > 3 else stored
    spacing = np.array(struct.unpack_from("<3f", data, 80), float)
    direction = origin = None
    flip = np.diag([-1.0, -1.0, 1.0])
    if struct.unpack_from("<h", data, 254)[0]:
        rows = np.array([struct.unpack_from("<4f", data, 280 + 16 * row) for row in range(3)], float)
        matrix = flip @ rows[:, :3]
        spacing = np.linalg.norm(matrix, axis=0)
        direction, origin = matrix / spacing, flip @ rows[:, 3]
    values = stored.astype(float)
    if slope not in (0, 1) or intercept:
        values = values * slope + intercept
    return values, spacing, direction, origin
