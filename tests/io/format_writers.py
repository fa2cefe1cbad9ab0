"""Writes small files of the formats that the command reads, from numpy arrays and from the formats'
descriptions alone: nothing here is shared with the readers that are tested by it."""

import base64
import bz2
import gzip
import struct
import zlib

import numpy as np


def ramp(*shape, dtype="<i2", first=0):
    """Sample i is (7 i + first) mod 1000, the last axis fastest."""
    return ((np.arange(np.prod(shape)).reshape(shape) * 7 + first) % 1000).astype(dtype)


# NIfTI --------------------------------------------------------------------------------------------
NIFTI = {"uint8": 2, "int16": 4, "int32": 8, "float32": 16, "float64": 64, "int8": 256, "uint16": 512, "uint32": 768,
         "int64": 1024, "uint64": 1280}


def nifti(volume, spacing=(1, 1, 1), sform=None, units=2, intent=0, code=None, bits=None, order="<", axes=None):
    """volume: slowest axis first. axes: how many axes the header counts; the last may be of one sample."""
    sizes = list(reversed(volume.shape))
    sizes += [1] * ((axes or len(sizes)) - len(sizes))
    h = bytearray(352)
    struct.pack_into(order + "i", h, 0, 348)
    struct.pack_into(order + "8h", h, 40, len(sizes), *(sizes + [1] * (7 - len(sizes))))
    struct.pack_into(order + "3h", h, 68, intent, code or NIFTI[volume.dtype.name], bits or 8 * volume.dtype.itemsize)
    struct.pack_into(order + "8f", h, 76, 1, *(list(spacing) + [1] * (7 - len(spacing))))
    struct.pack_into(order + "3f", h, 108, 352, 0, 0)
    h[123] = units
    struct.pack_into(order + "2h", h, 252, 0, 0 if sform is None else 1)
    if sform is not None:
        struct.pack_into(order + "12f", h, 280, *np.asarray(sform, float).ravel())
    h[344:348] = b"n+1\0"
    return bytes(h) + volume.astype(volume.dtype.newbyteorder(order)).tobytes()


# NRRD ---------------------------------------------------------------------------------------------
NRRD = {"int8": "signed char", "uint8": "uchar", "int16": "short", "uint16": "ushort", "int32": "int", "uint32": "uint",
        "int64": "longlong", "uint64": "unsigned long long int", "float32": "float", "float64": "double"}


def encoded(data, encoding):
    raw = data.tobytes()
    if encoding in ("ascii", "txt", "text"):
        return "\n".join(map(str, data.ravel().tolist())).encode()
    if encoding == "hex":
        return b"\n".join(raw.hex().encode()[i:i + 70] for i in range(0, 2 * len(raw), 70))
    if encoding in ("gz", "gzip"):
        return gzip.compress(raw, mtime=0)
    if encoding in ("bz2", "bzip2"):  # two streams, as programs that work in parallel write
        half = len(raw) // 2
        return bz2.compress(raw[:half]) + bz2.compress(raw[half:])
    return raw


def nrrd(volume, *fields, encoding="raw", order="<", detached=None):
    data = volume.astype(volume.dtype.newbyteorder(order))
    lines = ["NRRD0005", "type: " + NRRD[volume.dtype.name], f"dimension: {volume.ndim}",
             "sizes: " + " ".join(map(str, reversed(volume.shape))), "endian: " + ("little" if order == "<" else "big"),
             "encoding: " + encoding, *fields]
    if detached:
        return ("\n".join(lines + ["data file: " + detached]) + "\n").encode(), encoded(data, encoding)
    return ("\n".join(lines) + "\n\n").encode() + encoded(data, encoding)


# MetaImage ----------------------------------------------------------------------------------------
META = {"int8": "MET_CHAR", "uint8": "MET_UCHAR", "int16": "MET_SHORT", "uint16": "MET_USHORT", "int32": "MET_INT",
        "uint32": "MET_UINT", "int64": "MET_LONG_LONG", "uint64": "MET_ULONG_LONG", "float32": "MET_FLOAT", "float64": "MET_DOUBLE"}


def metaimage(volume, *fields, channels=1, packed=False, text=False):
    sizes = volume.shape[:-1] if channels > 1 else volume.shape
    lines = ["ObjectType = Image", f"NDims = {len(sizes)}", "DimSize = " + " ".join(map(str, reversed(sizes))),
             "ElementType = " + META[volume.dtype.name], f"ElementNumberOfChannels = {channels}",
             f"CompressedData = {packed}", f"BinaryData = {not text}", *fields, "ElementDataFile = LOCAL"]
    data = volume.tobytes()
    if text:
        data = " ".join(map(str, volume.ravel().tolist())).encode()
    return ("\n".join(lines) + "\n").encode() + (zlib.compress(data) if packed else data)


# VTK ----------------------------------------------------------------------------------------------
VTK = {"int8": "char", "uint8": "unsigned_char", "int16": "short", "uint16": "unsigned_short", "int32": "int", "uint32": "unsigned_int",
       "int64": "vtktypeint64", "uint64": "unsigned_long", "float32": "float", "float64": "double"}


def vtk_numbers(values, binary):
    return values.astype(values.dtype.newbyteorder(">")).tobytes() if binary else " ".join(map(str, values.ravel().tolist())).encode()


def vtk_array(kind, name, values, binary=True):
    """SCALARS, VECTORS ... ; the last axis of four is components."""
    components = values.shape[-1] if values.ndim == 4 else 1
    head = f"{kind} {name} {VTK[values.dtype.name]}"
    if kind == "SCALARS":
        head += f" {components}\nLOOKUP_TABLE default"
    return head.encode() + b"\n" + vtk_numbers(values, binary) + b"\n"


def vtk_field(arrays, binary=True, meta=False):
    """arrays: name -> values of one shape. meta: with the blocks that VTK 5 writes behind arrays."""
    out = f"FIELD FieldData {len(arrays)}\n".encode()
    for name, values in arrays.items():
        components = values.shape[-1] if values.ndim == 4 else 1
        out += f"{name} {components} {values.size // components} {VTK[values.dtype.name]}\n".encode() + vtk_numbers(values, binary) + b"\n"
        if meta:
            out += b"METADATA\nINFORMATION 0\n\n"
    return out


def vtk(shape, parts, spacing=(1, 1, 1), origin=(0, 0, 0), binary=True):
    """shape: of the points, slowest first. parts: "POINT_DATA 60" lines (str) and blocks (bytes)."""
    z, y, x = shape
    head = (f"# vtk DataFile Version 5.1\nmade up\n{'BINARY' if binary else 'ASCII'}\nDATASET STRUCTURED_POINTS\n"
            f"DIMENSIONS {x} {y} {z}\nSPACING {spacing[0]} {spacing[1]} {spacing[2]}\nORIGIN {origin[0]} {origin[1]} {origin[2]}\n").encode()
    return head + b"".join(p if isinstance(p, bytes) else p.encode() + b"\n" for p in parts)


VTI = {"int8": "Int8", "uint8": "UInt8", "int16": "Int16", "uint16": "UInt16", "int32": "Int32", "uint32": "UInt32",
       "int64": "Int64", "uint64": "UInt64", "float32": "Float32", "float64": "Float64"}


def vti(shape, points=None, cells=None, form="ascii", order="<", packed=False, spacing="1 1 1", origin="0 0 0", wide=False):
    """points, cells: arrays. form: ascii, binary, or raw and base64, which are appended."""
    word = "Q" if wide else "I"
    appended = bytearray()

    def block(values):
        raw = values.astype(values.dtype.newbyteorder(order)).tobytes()
        if not packed:
            head, body = struct.pack(order + word, len(raw)), raw
        else:
            body = zlib.compress(raw)
            head = struct.pack(order + "4" + word, 1, len(raw), 0, len(body))
        return head, body

    def array(values):
        tag = f'<DataArray type="{VTI[values.dtype.name]}" Name="a" NumberOfComponents="{values.shape[-1] if values.ndim == 4 else 1}" '
        if form == "ascii":
            return tag + 'format="ascii">' + " ".join(map(str, values.ravel().tolist())) + "</DataArray>"
        head, body = block(values)
        # A compressed array is encoded in two parts, one that is not in one.
        text = base64.b64encode(head) + base64.b64encode(body) if packed else base64.b64encode(head + body)
        if form == "binary":
            return tag + 'format="binary">' + text.decode() + "</DataArray>"
        place = len(appended)
        appended.extend(head + body if form == "raw" else text)
        return tag + f'format="appended" offset="{place}"/>'

    z, y, x = (n - 1 for n in shape)
    out = (f'<?xml version="1.0"?>\n<VTKFile type="ImageData" version="1.0" byte_order="{"LittleEndian" if order == "<" else "BigEndian"}" '
           f'header_type="{"UInt64" if wide else "UInt32"}"{" compressor=" + chr(34) + "vtkZLibDataCompressor" + chr(34) if packed else ""}>\n'
           f'<ImageData WholeExtent="0 {x} 0 {y} 0 {z}" Origin="{origin}" Spacing="{spacing}"><Piece Extent="0 {x} 0 {y} 0 {z}">')
    out += "<PointData>" + (array(points) if points is not None else "") + "</PointData>"
    out += "<CellData>" + (array(cells) if cells is not None else "") + "</CellData></Piece></ImageData>"
    out = out.encode()
    if appended:
        out += f'<AppendedData encoding="{form}">_'.encode() + bytes(appended) + b"</AppendedData>"
    return out + b"</VTKFile>"


# MRC ----------------------------------------------------------------------------------------------
def mrc(samples, mode, cell=None, intervals=None, axes=(1, 2, 3), order="<", stamp=True, extended=b"", start=(0, 0, 0), origin=(0, 0, 0),
        group=1, imod=None, largest=None, angles=(90, 90, 90)):
    """samples: sections, rows, columns. cell [angstrom] and intervals are along X, Y and Z."""
    z, y, x = samples.shape[:3]
    h = bytearray(1024)
    struct.pack_into(order + "10i", h, 0, x, y, z, mode, *start, *(intervals or (x, y, z)))
    struct.pack_into(order + "6f", h, 40, *(cell or (x, y, z)), *angles)
    struct.pack_into(order + "3i", h, 64, *axes)
    struct.pack_into(order + "3f", h, 76, 0, float(samples.max()) if largest is None else largest, 0)
    struct.pack_into(order + "2i", h, 88, group, len(extended))
    if imod is not None:
        struct.pack_into(order + "2i", h, 152, 1146047817, imod)
    struct.pack_into(order + "3f", h, 196, *origin)
    h[208:212] = b"MAP "
    if stamp:
        h[212:216] = b"\x44\x44\0\0" if order == "<" else b"\x11\x11\0\0"
    return bytes(h) + extended + samples.astype(samples.dtype.newbyteorder(order)).tobytes()


# TIFF ---------------------------------------------------------------------------------------------
WIDTH = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 16: 8}
LETTER = {1: "B", 3: "H", 4: "I", 16: "Q"}


def packed_bits(page, bits):
    """Rows of numbers of a few bits, the highest first, each row from a new byte."""
    rows = []
    for row in page.reshape(page.shape[0], -1):
        text = "".join(format(int(v), f"0{bits}b") for v in row)
        text += "0" * (-len(text) % 8)
        rows.append(int(text, 2).to_bytes(len(text) // 8, "big"))
    return b"".join(rows)


def predicted(page, order):
    """Horizontal differences of integers, as predictor 2 stores them."""
    d = page.copy()
    d[:, 1:] -= page[:, :-1]
    return d.astype(d.dtype.newbyteorder(order))


def tiff_page(pixels, order="<", bits=None, photometric=None, planar=1, tile=None, rows=None, packed=False, predictor=1, colours=None,
              extra=(), more=None):
    """Tags of a page: tag -> (type, values); "data" are its strips or tiles. pixels: (y, x) or (y, x, samples)."""
    height, width = pixels.shape[:2]
    samples = pixels.shape[2] if pixels.ndim == 3 else 1
    depth = bits or 8 * pixels.dtype.itemsize
    tags = {256: (4, [width]), 257: (4, [height]), 258: (3, [depth] * samples), 259: (3, [8 if packed else 1]),
            262: (3, [photometric if photometric is not None else 2 if samples >= 3 else 1]), 277: (3, [samples]), 284: (3, [planar]),
            339: (3, [{"u": 1, "i": 2, "f": 3}[pixels.dtype.kind]] * samples)}
    if predictor != 1:
        tags[317] = (3, [predictor])
    if colours is not None:
        tags[320] = (3, [int(v) for v in np.asarray(colours).T.ravel()])
    if extra:
        tags[338] = (3, list(extra))
    planes = [pixels[..., s] for s in range(samples)] if planar == 2 else [pixels]
    parts = []
    if tile:
        tags[322], tags[323] = (4, [tile]), (4, [tile])
    else:
        tags[278] = (4, [rows or height])
    for plane in planes:
        if tile:
            for top in range(0, height, tile):
                for left in range(0, width, tile):
                    part = np.zeros((tile, tile) + plane.shape[2:], plane.dtype)
                    piece = plane[top:top + tile, left:left + tile]
                    part[:piece.shape[0], :piece.shape[1]] = piece
                    parts.append(part)
        else:
            parts += [plane[top:top + (rows or height)] for top in range(0, height, rows or height)]
    data = []
    for part in parts:
        if predictor == 2:
            part = predicted(part, order)
        raw = packed_bits(part, depth) if depth % 8 else part.astype(part.dtype.newbyteorder(order)).tobytes()
        data.append(zlib.compress(raw) if packed else raw)
    tags["data"] = data
    tags.update(more or {})
    return tags


def tiff(pages, order="<", big=False, tail=b""):
    """tail: bytes behind the samples of the last page."""
    room, word = (8, "Q") if big else (4, "I")
    out = bytearray(b"II" if order == "<" else b"MM")
    out += struct.pack(order + "HHHQ", 43, 8, 0, 16) if big else struct.pack(order + "HI", 42, 8)

    def text(kind, values):
        if kind == 2:
            return values if isinstance(values, bytes) else values.encode() + b"\0"
        if kind == 5:
            return b"".join(struct.pack(order + "II", *v) for v in values)
        return struct.pack(order + f"{len(values)}{LETTER[kind]}", *values)

    for number, tags in enumerate(pages):
        tags = dict(tags)
        data = tags.pop("data")
        place, count = (324, 325) if 322 in tags else (273, 279)
        tags[place], tags[count] = (16 if big else 4, [0] * len(data)), (16 if big else 4, [len(d) for d in data])
        fixed = (8 if big else 2) + (20 if big else 12) * len(tags) + room
        far = sum(len(t) + len(t) % 2 for t in (text(*v) for v in tags.values()) if len(t) > room)
        at, places = len(out) + fixed + far, []
        for d in data:
            places.append(at)
            at += len(d) + len(d) % 2
        tags[place] = (16 if big else 4, places)
        body, behind = bytearray(struct.pack(order + ("Q" if big else "H"), len(tags))), bytearray()
        for tag in sorted(tags):
            kind, values = tags[tag]
            t = text(kind, values)
            body += struct.pack(order + "HH" + word, tag, kind, len(t) // WIDTH[kind])
            if len(t) > room:
                body += struct.pack(order + word, len(out) + fixed + len(behind))
                behind += t + b"\0" * (len(t) % 2)
            else:
                body += t + b"\0" * (room - len(t))
        body += struct.pack(order + word, at if number + 1 < len(pages) else 0)
        out += body + behind
        for d in data:
            out += d + b"\0" * (len(d) % 2)
    return bytes(out + tail)


def described(text):
    return {270: (2, text)}


def resolution(x, y, unit):
    """Pixels a unit, as pairs of numerator and denominator; unit: 1 none, 2 inch, 3 centimetre."""
    return {282: (5, [x]), 283: (5, [y]), 296: (3, [unit])}


def ome(pixels, images=1, data="", channels="", names=None):
    """pixels: attributes of Pixels as text."""
    body = "".join(f'<Image ID="Image:{i}" Name="{names[i] if names else i}"><Pixels ID="Pixels:{i}" {pixels}>{channels}{data}</Pixels></Image>'
                   for i in range(images))
    return ('<?xml version="1.0" encoding="UTF-8"?><!-- Warning: this comment is part of > every "file" --><OME '
            f'xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06">{body}</OME>').encode() + b"\0"
