"""Files as numpy arrays, written and read from the formats' specifications alone: for tests that look at what the command wrote.

Arrays are [z, y, x, channel], images have z = 1. What the command never writes (compression, other byte orders, planes) is not read."""

import struct
import zlib

import numpy as np

NIFTI = {2: "u1", 256: "i1", 4: "<i2", 512: "<u2", 8: "<i4", 768: "<u4", 16: "<f4", 64: "<f8"}
NRRD = {"uint8": "u1", "int8": "i1", "int16": "<i2", "uint16": "<u2", "int32": "<i4", "uint32": "<u4", "float": "<f4", "double": "<f8"}
META = {"MET_UCHAR": "u1", "MET_CHAR": "i1", "MET_SHORT": "<i2", "MET_USHORT": "<u2", "MET_INT": "<i4", "MET_UINT": "<u4",
        "MET_FLOAT": "<f4", "MET_DOUBLE": "<f8"}


def write_nifti(path, a, intent=0, slope=1, inter=0, spacing=(1, 1, 1)):
    """A volume of one channel [z, y, x]."""
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *a.shape[::-1], 1, 1, 1, 1)
    code = next(k for k, v in NIFTI.items() if np.dtype(v) == a.dtype)
    struct.pack_into("<3h", head, 68, intent, code, 8 * a.dtype.itemsize)
    struct.pack_into("<4f", head, 76, 1, *spacing)
    struct.pack_into("<3f", head, 108, 352, slope, inter)
    struct.pack_into("<b", head, 123, 2)
    head[344:348] = b"n+1\0"
    path.write_bytes(bytes(head) + a.tobytes())


def write_nrrd(path, a, image=False):
    """[z, y, x] or [z, y, x, c]."""
    a = a[..., None] if a.ndim == 3 else a
    sizes = ([a.shape[3]] if a.shape[3] > 1 else []) + [a.shape[2], a.shape[1]] + ([] if image else [a.shape[0]])
    kinds = "" if a.shape[3] == 1 else "kinds: vector" + " domain" * (len(sizes) - 1) + "\n"
    name = next(k for k, v in NRRD.items() if np.dtype(v) == a.dtype)
    head = f"NRRD0004\ntype: {name}\ndimension: {len(sizes)}\nsizes: {' '.join(map(str, sizes))}\n{kinds}endian: little\nencoding: raw\n\n"
    path.write_bytes(head.encode() + a.tobytes())


def write_png(path, a):
    """[y, x, c] of u8 or u16."""
    rows = b"".join(b"\0" + row.astype(">u2" if a.dtype.itemsize == 2 else "u1").tobytes() for row in a)
    colour = {1: 0, 2: 4, 3: 2, 4: 6}[a.shape[2]]

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", a.shape[1], a.shape[0], 8 * a.dtype.itemsize, colour, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def write_exr(path, a):
    """[y, x, c] of f16 or f32, not compressed."""
    names = {1: "Y", 2: "AY", 3: "BGR", 4: "ABGR"}[a.shape[2]]
    place = {"Y": 0, "R": 0, "G": 1, "B": 2, "A": a.shape[2] - 1}
    box = struct.pack("<4i", 0, 0, a.shape[1] - 1, a.shape[0] - 1)
    kind = 1 if a.dtype.itemsize == 2 else 2
    channels = b"".join(n.encode() + b"\0" + struct.pack("<4i", kind, 0, 1, 1) for n in names) + b"\0"
    head = struct.pack("<2I", 20000630, 2)
    for name, of, value in (("channels", "chlist", channels), ("compression", "compression", b"\0"), ("dataWindow", "box2i", box),
                            ("displayWindow", "box2i", box), ("lineOrder", "lineOrder", b"\0"), ("pixelAspectRatio", "float", struct.pack("<f", 1)),
                            ("screenWindowCenter", "v2f", bytes(8)), ("screenWindowWidth", "float", struct.pack("<f", 1))):
        head += name.encode() + b"\0" + of.encode() + b"\0" + struct.pack("<i", len(value)) + value
    head += b"\0"
    body, offsets, at = b"", b"", len(head) + 8 * a.shape[0]
    for y, row in enumerate(a):
        data = b"".join(row[:, place[n]].tobytes() for n in names)
        offsets += struct.pack("<Q", at + len(body))
        body += struct.pack("<2i", y, len(data)) + data
    path.write_bytes(head + offsets + body)


def read_nifti(data):
    dims = struct.unpack_from("<8h", data, 40)
    code, = struct.unpack_from("<h", data, 70)
    slope, inter = struct.unpack_from("<2f", data, 112)
    x, y, z = dims[1], dims[2], dims[3] if dims[0] > 2 else 1
    if code in (128, 2304):
        return np.frombuffer(data, "u1", offset=352).reshape(z, y, x, 3 if code == 128 else 4)
    channels = dims[5] if dims[0] > 4 else 1
    a = np.moveaxis(np.frombuffer(data, NIFTI[code], offset=352).reshape(channels, z, y, x), 0, -1)
    return a if slope in (0, 1) and inter == 0 else a * np.float64(slope) + inter


def read_nrrd(data):
    head, body = data.split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    sizes = [int(n) for n in fields["sizes"].split()]
    kinds = fields.get("kinds", " ".join(["domain"] * len(sizes))).split()
    channels = 1 if kinds[0] == "domain" else sizes.pop(0)
    return np.frombuffer(body, NRRD[fields["type"]]).reshape(*([1] * (3 - len(sizes))), *sizes[::-1], channels)


def read_meta(data):
    head, body = data.split(b"ElementDataFile = LOCAL\n", 1)
    fields = dict(line.split(" = ", 1) for line in head.decode().splitlines())
    sizes = [int(n) for n in fields["DimSize"].split()]
    channels = int(fields.get("ElementNumberOfChannels", 1))
    return np.frombuffer(body, META[fields["ElementType"]]).reshape(*([1] * (3 - len(sizes))), *sizes[::-1], channels)


def read_png(data):
    at, packed = 8, b""
    while at < len(data):
        size, = struct.unpack_from(">I", data, at)
        kind, body = data[at + 4:at + 8], data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">2I2B", body[:10])
        packed += body if kind == b"IDAT" else b""
        at += 12 + size
    channels = {0: 1, 4: 2, 2: 3, 6: 4}[colour]
    pixel = channels * bits // 8
    rows = np.frombuffer(zlib.decompress(packed), "u1").reshape(height, 1 + width * pixel)
    out = np.zeros((height, width * pixel), "u1")
    for y, row in enumerate(rows):
        up = out[y - 1].astype(int) if y else np.zeros(width * pixel, int)
        line = row[1:].astype(int)
        for i in range(width * pixel if row[0] else 0):
            left = line[i - pixel] if i >= pixel else 0
            corner = up[i - pixel] if i >= pixel else 0
            guess = left + up[i] - corner
            near = min((left, up[i], corner), key=lambda v: abs(guess - v))
            line[i] = (line[i] + (0, left, up[i], (left + up[i]) // 2, near)[row[0]]) % 256
        out[y] = line
    return out.view(">u2" if bits == 16 else "u1").reshape(1, height, width, channels)


def read_tiff(data):
    at, pages = struct.unpack_from("<I", data, 4)[0], []
    while at:
        tags = {}
        for k in range(struct.unpack_from("<H", data, at)[0]):
            tag, kind, count = struct.unpack_from("<2HI", data, at + 2 + 12 * k)
            of = {1: "B", 2: "B", 3: "H", 4: "I", 5: "Q", 7: "B"}[kind]
            place = at + 10 + 12 * k
            if struct.calcsize(of) * count > 4:
                place = struct.unpack_from("<I", data, place)[0]
            tags[tag] = struct.unpack_from(f"<{count}{of}", data, place)
        kind = {1: "u", 2: "i", 3: "f"}[tags[339][0]] + str(tags[258][0] // 8)
        shape = (tags[257][0], tags[256][0], tags[277][0])
        pages.append(np.frombuffer(data, "<" + kind, count=int(np.prod(shape)), offset=tags[273][0]).reshape(shape))
        at, = struct.unpack_from("<I", data, at + 2 + 12 * struct.unpack_from("<H", data, at)[0])
    return np.stack(pages)


def read_exr(data):
    at, attributes = 8, {}
    while data[at]:
        name, rest = data[at:].split(b"\0", 1)
        of, rest = rest.split(b"\0", 1)
        size, = struct.unpack("<i", rest[:4])
        at += len(name) + len(of) + 6
        attributes[name.decode()] = data[at:at + size]
        at += size
    names, kinds, body = [], [], attributes["channels"]
    while body[0]:
        name, body = body.split(b"\0", 1)
        names.append(name.decode())
        kinds.append(struct.unpack("<i", body[:4])[0])
        body = body[16:]
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height, rows = x1 - x0 + 1, y1 - y0 + 1, 16 if attributes["compression"] == b"\3" else 1
    kind = "<f2" if kinds[0] == 1 else "<f4"
    out = np.zeros((height, len(names), width), kind)
    for offset in struct.unpack_from(f"<{-(-height // rows)}Q", data, at + 1):
        top, size = struct.unpack_from("<2i", data, offset)
        packed = data[offset + 8:offset + 8 + size]
        count = min(rows, height - top)
        whole = count * len(names) * width * np.dtype(kind).itemsize
        if size < whole:
            delta = np.frombuffer(zlib.decompress(packed), "u1").astype(int)
            delta[1:] -= 128
            parted = (np.cumsum(delta) % 256).astype("u1")
            packed = np.empty(whole, "u1")
            packed[0::2], packed[1::2] = parted[:(whole + 1) // 2], parted[(whole + 1) // 2:]
            packed = packed.tobytes()
        out[top:top + count] = np.frombuffer(packed, kind).reshape(count, len(names), width)
    order = [names.index(n) for n in ("Y", "R", "G", "B", "A") if n in names]
    return np.moveaxis(out, 1, 2)[None][..., order]


def read(path):
    """Values as the file means them; of NIfTI without slope, and of the others, in the stored type."""
    data = path.read_bytes()
    for endings, reader in (((".nii",), read_nifti), ((".nrrd",), read_nrrd), ((".mha",), read_meta), ((".png",), read_png),
                            ((".tif",), read_tiff), ((".exr",), read_exr)):
        if path.name.endswith(endings):
            return reader(data)
    raise ValueError(path.name)
