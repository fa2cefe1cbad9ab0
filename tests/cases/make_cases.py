"""Small files that are legal and easy to get wrong, with what they mean: make_cases.py FOLDER writes them all.

Every case is a function of a folder that writes its file or files there and returns a dictionary of right answers: `path`,
and what the file means (`values`, slowest axis first, `spacing`, `extent`, `origin`, ...).
"""

import base64
import gzip
import pathlib
import struct
import sys
import zlib

import numpy as np


def ladder(shape, dtype="<i2", step=13, modulo=887, first=3):
    """Values that name their place: sample i, x fastest, is (step i + first) mod modulo."""
    return ((np.arange(np.prod(shape)) * step + first) % modulo).reshape(shape).astype(dtype)


# DICOM


EXPLICIT, RLE = "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.5"
STORAGE = "1.2.840.10008.5.1.4.1.1."
LONG = ("OB", "OW", "OF", "OD", "SQ", "UN", "UT")
ENDLESS = 0xFFFFFFFF


def element(tag, vr, value, endless=False):
    """One element in explicit VR, little endian. Lists of numbers become decimal strings where the VR holds text."""
    if vr == "US":
        value = struct.pack("<H", value)
    elif vr == "UL":
        value = struct.pack("<I", value)
    elif vr == "SS":
        value = struct.pack("<h", value)
    elif not isinstance(value, bytes):
        if not isinstance(value, str):
            value = "\\".join(f"{v:.10g}" for v in np.ravel(value))
        value = value.encode()
        value += (b"\0" if vr == "UI" else b" ") * (len(value) % 2)
    head = struct.pack("<HH", tag >> 16, tag & 0xFFFF) + vr.encode()
    length = ENDLESS if endless else len(value)
    return head + (struct.pack("<HI", 0, length) if vr in LONG else struct.pack("<H", length)) + value


def item(body):
    return struct.pack("<HHI", 0xFFFE, 0xE000, len(body)) + body


def sequence(tag, *bodies):
    return element(tag, "SQ", b"".join(item(body) for body in bodies))


def encapsulated(frames):
    """Compressed frames behind an empty offset table."""
    body = item(b"") + b"".join(item(frame + b"\0" * (len(frame) % 2)) for frame in frames)
    return element(0x7FE00010, "OB", body + struct.pack("<HHI", 0xFFFE, 0xE0DD, 0), endless=True)


def run_lengths(frame):
    """PS3.5 annex G of literal runs: the most significant byte of every sample, then the next."""
    planes = frame.astype(frame.dtype.newbyteorder(">")).view(np.uint8).reshape(-1, frame.dtype.itemsize).T
    segments = []
    for plane in planes:
        runs = b"".join(bytes([len(part) - 1]) + part for part in (plane.tobytes()[i:i + 128] for i in range(0, plane.size, 128)))
        segments.append(runs + b"\0" * (len(runs) % 2))
    starts = np.cumsum([64] + [len(s) for s in segments[:-1]])
    return struct.pack("<16I", len(segments), *starts, *[0] * (15 - len(segments))) + b"".join(segments)


def dicom(path, pixels, elements, storage="2", syntax=EXPLICIT, pixel_element=None, frames=None, modality="CT", drop=()):
    """`elements`: tag -> (vr, value) or the encoded element; these win over what is written for every image."""
    own = {
        0x00080016: ("UI", STORAGE + storage), 0x00080018: ("UI", f"1.2.77.{zlib.crc32(str(path).encode())}"),
        0x00080060: ("CS", modality), 0x0020000D: ("UI", "1.2.77.1"), 0x0020000E: ("UI", "1.2.77.2"),
        0x00200013: ("IS", "1"), 0x00200037: ("DS", [1, 0, 0, 0, 1, 0]), 0x00280030: ("DS", [1, 1]),
    }
    if pixels is not None:
        bits = 8 * pixels.dtype.itemsize
        colours = 3 if pixels.ndim == 3 and frames is None else 1
        rows, columns = pixels.shape[-2:] if colours == 1 else pixels.shape[:2]
        own.update({
            0x00280002: ("US", colours), 0x00280004: ("CS", "MONOCHROME2"), 0x00280010: ("US", rows), 0x00280011: ("US", columns),
            0x00280100: ("US", bits), 0x00280101: ("US", bits), 0x00280102: ("US", bits - 1),
            0x00280103: ("US", int(pixels.dtype.kind == "i")),
        })
        if frames:
            own[0x00280008] = ("IS", str(frames))
        if colours == 3:
            own[0x00280006] = ("US", 0)
        own[0x7FE00010] = pixel_element or ("OB" if bits == 8 else "OW", pixels.tobytes() + b"\0" * (pixels.nbytes % 2))
    own.update(elements)
    for tag in drop:
        own.pop(tag)
    body = b"".join(e if isinstance(e, bytes) else element(tag, *e) for tag, e in sorted(own.items()))
    meta = element(0x00020001, "OB", b"\0\1") + element(0x00020002, "UI", STORAGE + storage)
    meta += element(0x00020003, "UI", "1.2.77.3") + element(0x00020010, "UI", syntax) + element(0x00020012, "UI", "1.2.77")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(bytes(128) + b"DICM" + element(0x00020000, "UL", len(meta)) + meta + body)


def place(*position):
    return {0x00200032: ("DS", position)}


def enhanced_geometry(folder):
    """PS3.3 C.7.6.16: geometry in the functional groups, frames out of order, a SliceThickness that is no distance."""
    path, values, order = folder / "enhanced.dcm", ladder((5, 4, 7)), [4, 1, 0, 3, 2]
    shared = sequence(0x00209116, element(0x00200037, "DS", [1, 0, 0, 0, 1, 0]))
    shared += sequence(0x00289110, element(0x00180050, "DS", "4") + element(0x00280030, "DS", [0.8, 0.6]))
    frames = [sequence(0x00209113, element(0x00200032, "DS", [7, -3, 11 + 1.5 * k])) for k in order]
    dicom(path, values[order], {0x52009229: sequence(0x52009229, shared), 0x52009230: sequence(0x52009230, *frames)},
          storage="2.1", frames=5, drop=(0x00200037, 0x00280030))
    return {"path": path, "values": values, "spacing": [0.6, 0.8, 1.5], "origin": [7, -3, 11]}


def private_sequence(folder):
    """PS3.5 6.2.2: UN of undefined length is a sequence in implicit VR, whatever the file's syntax."""
    path, values = folder / "private.dcm", ladder((4, 7))
    text = b"edgewise"
    inside = item(struct.pack("<HHI", 0x0031, 0x1001, len(text)) + text) + struct.pack("<HHI", 0xFFFE, 0xE0DD, 0)
    dicom(path, values, {**place(0, 0, 0), 0x00310010: ("LO", "MADE UP"), 0x00311000: element(0x00311000, "UN", inside, endless=True)})
    return {"path": path, "values": values}


def beside_structures(folder):
    """What has no pixels (structures, plans, reports) is no image and no reason to refuse the images."""
    path, values = folder / "structures", ladder((4, 3, 6))
    for k, plane in enumerate(values):
        dicom(path / f"{k}.dcm", plane, {**place(0, 0, 2.5 * k), 0x00200013: ("IS", str(k + 1))})
    dicom(path / "plan.dcm", None, {0x0020000E: ("UI", "1.2.77.9")}, storage="481.3", modality="RTSTRUCT",
          drop=(0x00200037, 0x00280030))
    return {"path": path, "series": "1.2.77.2", "values": values, "spacing": [1, 1, 2.5]}


def dose_spacing(folder):
    """PS3.3 C.8.8.3.2: planes of a dose lie at GridFrameOffsetVector."""
    path, values = folder / "dose.dcm", ladder((3, 4, 6), "<u4")
    dicom(path, values, {**place(-1, -2, -3), 0x00280030: ("DS", [2, 2]), 0x3004000C: ("DS", [0, 2.5, 5])}, storage="481.2",
          frames=3, modality="RTDOSE")
    return {"path": path, "values": values, "spacing": [2, 2, 2.5]}


def padding(folder):
    """PS3.3 C.7.5.1.1.2: PixelPaddingValue is no measurement, so air (-1000) stays what adds nothing."""
    path, stored = folder / "padding", np.full((5, 6, 9), 24, "<i2")
    stored[:, 0], stored[:, 3, 2:6] = -3000, 1124
    for k, plane in enumerate(stored):
        dicom(path / f"{k}.dcm", plane, {**place(0, 0, 2 * k), 0x00200013: ("IS", str(k + 1)), 0x00280120: ("SS", -3000),
                                         0x00281052: ("DS", "-1024"), 0x00281053: ("DS", "1")})
    picture = np.zeros((6, 9))
    picture[3, 2:6] = 10 * (100 + 1000)
    return {"path": path, "xray": picture}


def stopped_scan(folder):
    """A dynamic scan that was stopped: slices that repeat at every place are times, the third one unfinished."""
    path, times = folder / "stopped", [ladder((4, 3, 5), first=t) for t in range(3)]
    for n in range(9):
        dicom(path / f"{n}.dcm", times[n // 4][n % 4], {**place(0, 0, 3 * (n % 4)), 0x00200013: ("IS", str(n + 1))})
    return {"path": path, "times": 2, "values": times[:2]}


def float_pixels(folder):
    """PS3.3 C.7.6.24: Float Pixel Data stands for Pixel Data."""
    path, values = folder / "float.dcm", (ladder((3, 8), "<f4") / 16)
    dicom(path, values, {**place(0, 0, 0), 0x7FE00008: ("OF", values.tobytes())}, drop=(0x7FE00010, 0x00280101, 0x00280102, 0x00280103))
    return {"path": path, "values": values}


def slopes_in_runs(folder):
    """PET has a slope for each slice; run length encoding changes nothing about that."""
    path, stored, slopes = folder / "runs", ladder((4, 5, 6)), [0.5, 2, 1, 3.25]
    for k, (plane, slope) in enumerate(zip(stored, slopes)):
        dicom(path / f"{k}.dcm", plane, {**place(0, 0, 4 * k), 0x00200013: ("IS", str(k + 1)), 0x00281052: ("DS", "0"),
                                         0x00281053: ("DS", slope)}, storage="128", syntax=RLE, modality="PT",
              pixel_element=encapsulated([run_lengths(plane)]))
    return {"path": path, "values": stored * np.array(slopes)[:, None, None]}


def mosaic(folder):
    """Tiles of one picture are slices; a private element says how many."""
    path, tiles = folder / "mosaic.dcm", ladder((7, 5, 5))
    picture = np.zeros((15, 15), "<i2")
    for k, tile in enumerate(tiles):
        row, column = divmod(k, 3)
        picture[5 * row:5 * row + 5, 5 * column:5 * column + 5] = tile
    dicom(path, picture, {**place(0, 0, 0), 0x00080008: ("CS", "ORIGINAL\\PRIMARY\\M\\ND\\MOSAIC"), 0x00180050: ("DS", "3"),
                          0x00180088: ("DS", "3"), 0x00190010: ("LO", "SIEMENS MR HEADER"), 0x0019100A: ("US", 7)},
          storage="4", modality="MR")
    return {"path": path, "values": tiles}


def luminance(folder):
    """PS3.3 C.7.6.3.1.2, full range: Y 29, Cb 255, Cr 107 is blue."""
    path = folder / "ybr.dcm"
    pixels = np.broadcast_to(np.array([29, 255, 107], "u1"), (5, 4, 3)).copy()
    dicom(path, pixels, {**place(0, 0, 0), 0x00280004: ("CS", "YBR_FULL")}, storage="7")
    return {"path": path, "values": np.broadcast_to([0, 0, 254], (5, 4, 3)), "tolerance": 2}


# NIfTI


def nifti(values, code, spacing=(1, 1, 1), rows=None):
    head = bytearray(352)
    shape = list(values.shape[::-1])
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, len(shape), *shape, *[1] * (7 - len(shape)))
    struct.pack_into("<2h", head, 70, code, 8 * values.dtype.itemsize)
    struct.pack_into("<8f", head, 76, 1, *spacing, *[1] * (7 - len(spacing)))
    struct.pack_into("<f", head, 108, 352)
    head[123] = 2
    if rows is not None:
        struct.pack_into("<h12f", head, 254, 1, 0, *[0] * 11)
        struct.pack_into("<12f", head, 280, *np.ravel(rows))
    head[344:348] = b"n+1\0"
    return bytes(head) + values.tobytes()


def sheared_ball(folder):
    """A ball on a grid whose third axis leans: pictures in millimetres must not."""
    path, radius = folder / "sheared.nii.gz", 7.0
    rows = np.array([[1, 0, 0.4, 0], [0, 1, 0, 0], [0, 0, 1, 0]])
    k, j, i = np.indices((32, 30, 44))
    at = np.stack([i, j, k], -1) @ rows[:, :3].T
    ball = np.clip(radius + .5 - np.linalg.norm(at - [28, 15, 16], axis=-1), 0, 1) * 250
    path.write_bytes(gzip.compress(nifti(ball.astype("u1"), 2, (1, 1, np.hypot(1, .4)), rows), mtime=0))
    return {"path": path, "radius": radius}


def wide_integers(folder):
    """Datatype 1024 is what Python writes for labels if nobody says otherwise."""
    path, values = folder / "wide.nii", ladder((4, 5, 6), "<i8")
    path.write_bytes(nifti(values, 1024))
    return {"path": path, "values": values}


def large_labels(folder):
    """Labels of atlases need up to 30 bits, f32 has 24: no new value ever appears."""
    path, values = folder / "labels.nii", np.zeros((4, 6, 8), "<i4")
    for number, label in enumerate((33554433, 987654321, 16777219, 536870913)):
        values[:, number // 2 * 3:number // 2 * 3 + 2, number % 2 * 4:number % 2 * 4 + 3] = label
    path.write_bytes(nifti(values, 8))
    return {"path": path, "values": values}


def anisotropic_pixels(folder):
    """Pixels of 1 x 4 mm: each pass of a multipass warp must keep what the next one brings back."""
    path, rng = folder / "flat.nii", np.random.default_rng(8)
    values = rng.random((20, 60)).astype("<f4")
    for axis in (0, 1):
        for _ in range(2):
            values = (np.roll(values, 1, axis) + 2 * values + np.roll(values, -1, axis)) / 4
    path.write_bytes(nifti(values.astype("<f4"), 16, (1, 4)))
    return {"path": path, "values": values}


# NRRD


def nrrd(path, lines, data):
    path.write_bytes("\n".join(["NRRD0004", *lines, "", ""]).encode() + data)


def microns(folder):
    """"microns" is what microscopy programs write."""
    path, values = folder / "microns.nrrd", ladder((3, 4, 5), "u1", modulo=251)
    nrrd(path, ["type: uint8", "dimension: 3", "space dimension: 3", "sizes: 5 4 3", 'space units: "microns" "microns" "microns"',
                "space directions: (0.65,0,0) (0,0.65,0) (0,0,2)", "space origin: (0,0,0)", "encoding: raw"], values.tobytes())
    return {"path": path, "values": values, "micrometres": [0.65, 0.65, 2]}


def units_by_axis(folder):
    """`units` has an entry for each axis, an empty one for colours."""
    path, values = folder / "units.nrrd", ladder((3, 4, 5, 3), "u1", modulo=251)
    nrrd(path, ["type: uint8", "dimension: 4", "sizes: 3 5 4 3", "spacings: nan 0.3 0.3 0.7", 'units: "" "mm" "mm" "mm"',
                "kinds: RGB-color domain domain domain", "encoding: raw"], values.tobytes())
    return {"path": path, "values": values, "micrometres": [300, 300, 700]}


def hexadecimal(folder):
    """The format knows raw, ascii, hex, gzip, bzip2."""
    path, values = folder / "hex.nrrd", ladder((3, 5, 4), ">u2")
    text = values.tobytes().hex()
    lines = "\n".join(text[i:i + 70] for i in range(0, len(text), 70))
    nrrd(path, ["type: ushort", "dimension: 3", "sizes: 4 5 3", "endian: big", "encoding: hex"], lines.encode() + b"\n")
    return {"path": path, "values": values}


# MRC, VTK


def half_floats(folder):
    """Mode 12 of MRC2014 is f16."""
    path, values = folder / "half.mrc", (ladder((3, 6, 4), "<f4") / 8).astype("<f2")
    z, y, x = values.shape
    head = bytearray(1024)
    struct.pack_into("<10i", head, 0, x, y, z, 12, 0, 0, 0, x, y, z)
    struct.pack_into("<6f3i", head, 40, x, y, z, 90, 90, 90, 1, 2, 3)
    struct.pack_into("<3f", head, 76, values.min(), values.max(), values.mean())
    struct.pack_into("<i", head, 108, 20140)
    head[208:216] = b"MAP DD\0\0"
    path.write_bytes(bytes(head) + values.tobytes())
    return {"path": path, "values": values}


def field_array(folder):
    """ParaView writes arrays that are not the active scalars as FIELD."""
    path, values = folder / "field.vtk", ladder((4, 3, 5), ">i2")
    head = ("# vtk DataFile Version 3.0\nmade up\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 5 3 4\nSPACING 2 1 0.5\n"
            "ORIGIN 0 0 0\nPOINT_DATA 60\nFIELD FieldData 1\ndensity 1 60 short\n")
    path.write_bytes(head.encode() + values.tobytes() + b"\n")
    return {"path": path, "values": values, "spacing": [2, 1, 0.5]}


def wide_points(folder):
    """Int64 is VTK's type of ids and labels."""
    path, values = folder / "wide.vti", ladder((4, 3, 5), "<i8")
    data = base64.b64encode(struct.pack("<I", values.nbytes) + values.tobytes()).decode()
    path.write_text('<?xml version="1.0"?>\n<VTKFile type="ImageData" version="0.1" byte_order="LittleEndian" header_type="UInt32">\n'
                    '<ImageData WholeExtent="0 4 0 2 0 3" Origin="0 0 0" Spacing="1 3 2">\n<Piece Extent="0 4 0 2 0 3">\n'
                    '<PointData Scalars="ids">\n<DataArray type="Int64" Name="ids" format="binary">\n'
                    f"{data}\n</DataArray>\n</PointData>\n</Piece>\n</ImageData>\n</VTKFile>\n")
    return {"path": path, "values": values, "spacing": [1, 3, 2]}


# TIFF


def tiff(path, pages, bits, extra=None):
    """One strip a page, little endian. `pages`: (width, height, bytes); `extra` tags of the first page: tag -> (type, values)."""
    out, previous = bytearray(struct.pack("<2sHI", b"II", 42, 0)), 4
    for number, (width, height, data) in enumerate(pages):
        tags = {256: (4, [width]), 257: (4, [height]), 258: (3, [bits]), 259: (3, [1]), 262: (3, [1]), 273: (4, [len(out)]),
                277: (3, [1]), 278: (4, [height]), 279: (4, [len(data)])}
        if number == 0:
            tags.update(extra or {})
        out += data + b"\0" * (len(data) % 2)
        entries = b""
        for tag, (kind, values) in sorted(tags.items()):
            if kind == 2:
                data, count = values, len(values)
            elif kind == 5:
                data, count = b"".join(struct.pack("<2I", *v) for v in values), len(values)
            else:
                data, count = struct.pack(f"<{len(values)}{'H' if kind == 3 else 'I'}", *values), len(values)
            if len(data) > 4:
                at = len(out)
                out += data + b"\0" * (len(data) % 2)
                data = struct.pack("<I", at)
            entries += struct.pack("<HHI", tag, kind, count) + data.ljust(4, b"\0")
        struct.pack_into("<I", out, previous, len(out))
        out += struct.pack("<H", len(tags)) + entries
        previous = len(out)
        out += bytes(4)
    path.write_bytes(out)


def hyperstack(folder):
    """ImageJ: channels run fastest, then slices, then frames."""
    path, pages = folder / "hyperstack.tif", ladder((12, 3, 5), "<u2")
    text = b"ImageJ=1.54f\nimages=12\nchannels=3\nslices=4\nhyperstack=true\nmode=grayscale\nloop=false\n\0"
    tiff(path, [(5, 3, page.tobytes()) for page in pages], 16, {270: (2, text)})
    return {"path": path, "channels": 3, "values": [pages[c::3] for c in range(3)]}


def voxel_size(folder):
    """ImageJ: XResolution is pixels a `unit`, `spacing` lies between slices."""
    path, pages = folder / "voxels.tif", ladder((4, 3, 5), "u1", modulo=251)
    text = b"ImageJ=1.54f\nimages=4\nslices=4\nunit=micron\nspacing=1.25\nloop=false\n\0"
    tiff(path, [(5, 3, page.tobytes()) for page in pages], 8,
         {270: (2, text), 282: (5, [(4, 1)]), 283: (5, [(4, 1)]), 296: (3, [1])})
    return {"path": path, "values": pages, "micrometres": [0.25, 0.25, 1.25]}


def bits_stack(folder):
    """1 bit a sample is baseline TIFF, in a stack as in one page."""
    path, values = folder / "bits.tif", ladder((4, 5, 11), "<i2") > 500
    tiff(path, [(11, 5, np.packbits(page, axis=-1).tobytes()) for page in values], 1)
    return {"path": path, "values": values}


CASES = [enhanced_geometry, private_sequence, beside_structures, dose_spacing, padding, stopped_scan, float_pixels, slopes_in_runs,
         mosaic, luminance, sheared_ball, wide_integers, large_labels, anisotropic_pixels, microns, units_by_axis, hexadecimal,
         half_floats, field_array, wide_points, hyperstack, voxel_size, bits_stack]


if __name__ == "__main__":
    target = pathlib.Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    for case in CASES:
        print(case(target)["path"])
