"""Writes DICOM files for tests, byte by byte: nothing here is shared with the readers. Needs numpy.

A data set is a dict from tag to (representation, value). Values: text, numbers or lists of them, bytes, or a list of data
sets (SQ). `Raw` values are written as they are, for what a writer of DICOM should not do.
"""
import struct
import zlib

import numpy as np

IMPLICIT, EXPLICIT, BIG, DEFLATED, RLE = (
    "1.2.840.10008.1.2" + end for end in ("", ".1", ".2", ".1.99", ".5"))
JPEG = {name: "1.2.840.10008.1.2.4." + end for name, end in (
    ("baseline", "50"), ("lossless", "70"), ("ls", "80"), ("2000", "90"))}
CLASS = {name: "1.2.840.10008.5.1.4.1.1." + end for name, end in (
    ("CT", "2"), ("enhanced CT", "2.1"), ("MR", "4"), ("enhanced MR", "4.1"), ("PET", "128"), ("enhanced PET", "130"),
    ("NM", "20"), ("dose", "481.2"), ("structures", "481.3"), ("plan", "481.5"), ("report", "88.11"),
    ("segmentation", "66.4"), ("slide", "77.1.6"), ("XA", "12.1"), ("3D XA", "13.1.1"), ("secondary", "7"))}
LONG = ("OB", "OD", "OF", "OL", "OV", "OW", "SQ", "SV", "UC", "UN", "UR", "UT", "UV")
BINARY = {"US": "H", "SS": "h", "UL": "I", "SL": "i", "FL": "f", "FD": "d"}
UNDEFINED = 0xffffffff


class Raw(bytes):
    """Bytes of a whole element, head included."""


class Coding:
    """How a data set is written: byte order, representations or not, sequences with or without lengths."""

    def __init__(self, explicit=True, big=False, endless=False, unknown=False):
        self.explicit, self.order, self.endless, self.unknown = explicit, ">" if big else "<", endless, unknown

    def pack(self, form, *values):
        return struct.pack(self.order + form, *values)

    def tag(self, tag):
        return self.pack("HH", tag >> 16, tag & 0xffff)

    def value(self, vr, value):
        if isinstance(value, (bytes, bytearray)):
            return bytes(value)
        if vr in BINARY:
            values = value if isinstance(value, (list, tuple)) else [value]
            return self.pack("%d%s" % (len(values), BINARY[vr]), *values)
        if not isinstance(value, str):
            values = value if isinstance(value, (list, tuple)) else [value]
            value = "\\".join("%.12g" % v for v in values)
        return value.encode("latin-1")

    def head(self, tag, vr, length):
        if not self.explicit:
            return self.tag(tag) + self.pack("I", length)
        if vr in LONG:
            return self.tag(tag) + vr.encode() + self.pack("HI", 0, length)
        return self.tag(tag) + vr.encode() + self.pack("H", length)

    def element(self, tag, vr, value):
        if isinstance(value, Raw):
            return bytes(value)
        if vr == "SQ":
            return self.sequence(tag, value)
        raw = self.value(vr, value)
        raw += (b"\0" if vr in ("UI", "OB", "UN") else b" ") * (len(raw) % 2)
        return self.head(tag, vr, len(raw)) + raw

    def sequence(self, tag, items):
        # Inside UN everything is implicit and little-endian (PS3.5 6.2.2).
        inside = Coding(False, False, self.endless) if self.unknown else self
        body = b""
        for item in items:
            data = inside.data_set(item)
            if self.endless:
                body += inside.tag(0xfffee000) + inside.pack("I", UNDEFINED) + data
                body += inside.tag(0xfffee00d) + inside.pack("I", 0)
            else:
                body += inside.tag(0xfffee000) + inside.pack("I", len(data)) + data
        if self.endless:
            body += inside.tag(0xfffee0dd) + inside.pack("I", 0)
        vr = "UN" if self.unknown else "SQ"
        return self.head(tag, vr, UNDEFINED if self.endless else len(body)) + body

    def data_set(self, elements):
        return b"".join(self.element(tag, *elements[tag]) for tag in sorted(elements))


def file_of(elements, syntax=EXPLICIT, **coding):
    """The bytes of a file."""
    plain = Coding()
    meta = plain.data_set({0x00020001: ("OB", b"\0\1"), 0x00020002: ("UI", elements[0x00080016][1]),
                           0x00020003: ("UI", elements[0x00080018][1]), 0x00020010: ("UI", syntax),
                           0x00020012: ("UI", "1.2.3.4")})
    body = Coding(syntax != IMPLICIT, syntax == BIG, **coding).data_set(elements)
    if syntax == DEFLATED:
        packer = zlib.compressobj(9, zlib.DEFLATED, -15)
        body = packer.compress(body) + packer.flush()
        body += b"\0" * (len(body) % 2)
    return b"\0" * 128 + b"DICM" + plain.element(0x00020000, "UL", len(meta)) + meta + body


def picture(pixels, kind="CT", modality=None, position=None, orientation=(1, 0, 0, 0, 1, 0), spacing=(1, 1), number=1, series="1.2.3.9",
            photometric="MONOCHROME2", colour=False, stored=None, syntax=EXPLICIT, planar=0, more=None):
    """The elements of an image object. pixels: (rows, columns), (frames, rows, columns), and with colour a last axis of 3."""
    frames = pixels.shape[0] if pixels.ndim == (4 if colour else 3) else None
    rows, columns = (pixels.shape[:-1] if colour else pixels.shape)[-2:]
    bits = 8 * pixels.dtype.itemsize
    stored = stored or bits
    e = {0x00080016: ("UI", CLASS[kind]), 0x00080018: ("UI", "1.2.3.7.%d" % number), 0x00080060: ("CS", modality or kind[-2:]),
         0x0020000d: ("UI", "1.2.3.8"), 0x0020000e: ("UI", series), 0x00200013: ("IS", "%d" % number),
         0x00280002: ("US", 3 if colour else 1), 0x00280004: ("CS", photometric), 0x00280010: ("US", rows),
         0x00280011: ("US", columns), 0x00280100: ("US", bits), 0x00280101: ("US", stored), 0x00280102: ("US", stored - 1),
         0x00280103: ("US", int(pixels.dtype.kind == "i"))}
    if colour:
        e[0x00280006] = ("US", planar)
    if frames:
        e[0x00280008] = ("IS", "%d" % frames)
    for tag, values in ((0x00200032, position), (0x00200037, orientation), (0x00280030, spacing)):
        if values is not None:
            e[tag] = ("DS", values)
    order = ">" if syntax == BIG else "<"
    e[0x7fe00010] = ("OW" if bits > 8 else "OB", pixels.astype(pixels.dtype.newbyteorder(order)).tobytes())
    e.update(more or {})
    return e


def fragments(parts, offsets=()):
    """Compressed pixels. @param offsets of the frames, for the table in front."""
    table = struct.pack("<%dI" % len(offsets), *offsets)
    body = struct.pack("<HHI", 0xfffe, 0xe000, len(table)) + table
    for part in parts:
        part = bytes(part) + b"\0" * (len(part) % 2)
        body += struct.pack("<HHI", 0xfffe, 0xe000, len(part)) + part
    head = struct.pack("<HH", 0x7fe0, 0x0010) + b"OB" + struct.pack("<HI", 0, UNDEFINED)
    return ("OB", Raw(head + body + struct.pack("<HHI", 0xfffe, 0xe0dd, 0)))


# Encoders ---------------------------------------------------------------------------------------------------------------
def pack_bits(row):
    """Runs of equal bytes, and bytes as they are between them."""
    out, i = b"", 0
    while i < len(row):
        run = 1
        while i + run < len(row) and run < 128 and row[i + run] == row[i]:
            run += 1
        if run > 2:
            out += bytes([257 - run, row[i]])
            i += run
            continue
        start = i
        while i < len(row) and i - start < 128 and not (i + 2 < len(row) and row[i] == row[i + 1] == row[i + 2]):
            i += 1
        out += bytes([i - start - 1]) + row[start:i]
    return out


def rle(frame):
    """PS3.5 annex G: a segment for each byte of each sample, the most significant first."""
    width = frame.dtype.itemsize
    samples = frame.shape[2] if frame.ndim == 3 else 1
    planes = frame.reshape(-1, samples)
    segments = []
    for s in range(samples):
        raw = planes[:, s].astype(frame.dtype.newbyteorder(">")).tobytes()
        for k in range(width):
            packed = pack_bits(raw[k::width])
            segments.append(packed + b"\0" * (len(packed) % 2))
    starts = [64 + sum(map(len, segments[:k])) for k in range(len(segments))]
    return struct.pack("<16I", len(segments), *(starts + [0] * (15 - len(segments)))) + b"".join(segments)


class Bits:
    """Bits, the highest first."""

    def __init__(self):
        self.text = []

    def put(self, value, count):
        if count:
            self.text.append(format(value & ((1 << count) - 1), "0%db" % count))

    def stuffed(self, last="1", after_ff=8):
        """Bytes; after ff a zero byte (JPEG, after_ff 8) or one bit (JPEG-LS, 7)."""
        bits, out, at = "".join(self.text), bytearray(), 0
        while at < len(bits):
            room = 7 if after_ff == 7 and out and out[-1] == 0xff else 8
            part = bits[at:at + room]
            at += room
            part += last * (room - len(part))
            out.append(int(part, 2))
            if after_ff == 8 and out[-1] == 0xff:
                out.append(0)
        if after_ff == 7 and out and out[-1] == 0xff:
            out.append(0)
        return bytes(out)


def segment(marker, body):
    return struct.pack(">BBH", 0xff, marker, len(body) + 2) + body


def categories():
    """A Huffman table in which each category of differences, 0 to 16, has a code of 5 bits."""
    return segment(0xc4, bytes([0]) + bytes([0, 0, 0, 0, 17] + [0] * 11) + bytes(range(17)))


def jpeg_lossless(frame, bits=None):
    """Process 14, selection value 1: differences to the left neighbour, to the one above in the first column."""
    precision = bits or 8 * frame.dtype.itemsize
    samples = frame.reshape(frame.shape[0], frame.shape[1], -1).astype(np.int64) & ((1 << precision) - 1)
    rows, columns, count = samples.shape
    out = Bits()
    for y in range(rows):
        for x in range(columns):
            for c in range(count):
                before = samples[y, x - 1, c] if x else samples[y - 1, 0, c] if y else 1 << (precision - 1)
                d = (int(samples[y, x, c]) - int(before)) & 0xffff
                d -= 0x10000 if d > 0x8000 else 0
                category = abs(d).bit_length() if d != 0x8000 else 16
                out.put(category, 5)
                if category < 16:
                    out.put(d if d > 0 else d - 1, category)
    head = b"".join(bytes([c + 1, 0x11, 0]) for c in range(count))
    scan = bytes([count]) + b"".join(bytes([c + 1, 0]) for c in range(count)) + bytes([1, 0, 0])
    return (b"\xff\xd8" + segment(0xc3, struct.pack(">BHHB", precision, rows, columns, count) + head) + categories() +
            segment(0xda, scan) + out.stuffed() + b"\xff\xd9")


def jpeg_flat(blocks, sampling=((1, 1),) * 3):
    """Baseline JPEG of blocks that are flat, so that each has one coefficient and decoding is exact.

    blocks: one array for each component, a value for each block of 8 x 8 of it; sampling: factors of each component."""
    h, v = max(s[0] for s in sampling[:len(blocks)]), max(s[1] for s in sampling[:len(blocks)])
    down, across = blocks[0].shape[0] // sampling[0][1], blocks[0].shape[1] // sampling[0][0]
    # DC: a quantum of 8 makes one step of the coefficient one step of the flat value; AC: end of block at once.
    dc = segment(0xc4, bytes([0]) + bytes([0, 0, 0, 12] + [0] * 12) + bytes(range(12)))
    ac = segment(0xc4, bytes([0x10]) + bytes([1] + [0] * 15) + bytes([0]))
    out, last = Bits(), [0] * len(blocks)
    for y in range(down):
        for x in range(across):
            for c, values in enumerate(blocks):
                for j in range(sampling[c][1]):
                    for i in range(sampling[c][0]):
                        value = int(values[y * sampling[c][1] + j, x * sampling[c][0] + i]) - 128
                        d, last[c] = value - last[c], value
                        category = abs(d).bit_length()
                        out.put(category, 4)
                        out.put(d if d > 0 else d - 1, category)
                        out.put(0, 1)
    head = struct.pack(">BHHB", 8, 8 * v * down, 8 * h * across, len(blocks))
    head += b"".join(bytes([c + 1, sampling[c][0] << 4 | sampling[c][1], 0]) for c in range(len(blocks)))
    scan = bytes([len(blocks)]) + b"".join(bytes([c + 1, 0]) for c in range(len(blocks))) + bytes([0, 63, 0])
    return (b"\xff\xd8" + segment(0xdb, bytes([0] + [8] + [1] * 63)) + segment(0xc0, head) + dc + ac + segment(0xda, scan) +
            out.stuffed() + b"\xff\xd9")


# Run lengths of JPEG-LS (ISO 14495-1, A.7.1).
RUNS = [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 9, 10, 11, 12, 13, 14, 15]


def jpeg_ls(frame, bits=None):
    """Lossless JPEG-LS of one component, written from ISO 14495-1 with its default parameters."""
    precision = bits or 8 * frame.dtype.itemsize
    most = (1 << precision) - 1
    image = frame.astype(np.int64) & most
    rows, columns = image.shape
    factor = (min(most, 4095) + 128) // 256
    t = ((factor * 1 + 2, factor * 4 + 3, factor * 17 + 4) if most >= 128 else
         tuple(max(k + 2, v // (256 // (most + 1))) for k, v in ((0, 3), (1, 7), (2, 21))))
    span = most + 1
    width = (span - 1).bit_length()
    limit = 2 * (max(2, precision) + max(8, max(2, precision)))
    a = [max(2, (span + 32) // 64)] * 367
    b, c, n = [0] * 367, [0] * 367, [1] * 367
    run_n = [0, 0]
    out = Bits()
    run_index = 0

    def golomb(value, k, longest):
        high = value >> k
        if high < longest - width - 1:
            out.put(1, high + 1)
            out.put(value, k)
        else:
            out.put(1, longest - width)
            out.put(value - 1, width)

    def quantised(d):
        size = abs(d)
        q = 0 if size == 0 else 1 if size < t[0] else 2 if size < t[1] else 3 if size < t[2] else 4
        return -q if d < 0 else q

    def wrapped(error):
        error %= span
        return error - span if error >= (span + 1) // 2 else error

    def updated(q, error):
        a[q] += abs(error)
        b[q] += error
        if n[q] == 64:
            a[q] >>= 1
            b[q] >>= 1
            n[q] >>= 1
        n[q] += 1
        if b[q] <= -n[q]:
            b[q] = max(b[q] + n[q], 1 - n[q])
            c[q] = max(c[q] - 1, -128)
        elif b[q] > 0:
            b[q] = min(b[q] - n[q], 0)
            c[q] = min(c[q] + 1, 127)

    above = [0] * (columns + 2)  # with the neighbours beyond both ends
    corner = 0
    for y in range(rows):
        line = [above[1]] + [0] * columns + [0]
        above[0] = corner
        corner = line[0]
        above[columns + 1] = above[columns]
        x = 1
        while x <= columns:
            ra, rb, rc, rd = line[x - 1], above[x], above[x - 1], above[x + 1]
            q1, q2, q3 = quantised(rd - rb), quantised(rb - rc), quantised(rc - ra)
            if q1 == q2 == q3 == 0:
                run = 0
                while x + run <= columns and image[y, x + run - 1] == ra:
                    line[x + run] = ra
                    run += 1
                x += run
                left = run
                while left >= 1 << RUNS[run_index]:
                    out.put(1, 1)
                    left -= 1 << RUNS[run_index]
                    run_index = min(run_index + 1, 31)
                if x > columns:
                    if left:
                        out.put(1, 1)
                    break
                out.put(0, 1)
                out.put(left, RUNS[run_index])
                # The sample that ended the run.
                value, rb = int(image[y, x - 1]), above[x]
                kind = int(ra == rb)
                error = value - (ra if kind else rb)
                if not kind and ra > rb:
                    error = -error
                error = wrapped(error)
                q = 365 + kind
                temp = a[q] + (n[q] >> 1 if kind else 0)
                k = 0
                while n[q] << k < temp:
                    k += 1
                negatives = run_n[kind]
                if k == 0 and error > 0 and 2 * negatives < n[q]:
                    turned = 1
                elif error < 0 and (2 * negatives >= n[q] or k != 0):
                    turned = 1
                else:
                    turned = 0
                mapped = 2 * abs(error) - kind - turned
                golomb(mapped, k, limit - RUNS[run_index] - 1)
                if error < 0:
                    run_n[kind] += 1
                a[q] += (mapped + 1 - kind) >> 1
                if n[q] == 64:
                    a[q] >>= 1
                    n[q] >>= 1
                    run_n[kind] >>= 1
                n[q] += 1
                run_index = max(run_index - 1, 0)
                line[x] = value
                x += 1
                continue
            sign = 1
            number = 81 * q1 + 9 * q2 + q3
            if number < 0:
                sign, number = -1, -number
            q = number
            guess = min(ra, rb) if rc >= max(ra, rb) else max(ra, rb) if rc <= min(ra, rb) else ra + rb - rc
            guess = min(max(guess + sign * c[q], 0), most)
            value = int(image[y, x - 1])
            error = wrapped(sign * (value - guess))
            k = 0
            while n[q] << k < a[q]:
                k += 1
            if k == 0 and 2 * b[q] <= -n[q]:
                mapped = 2 * error + 1 if error >= 0 else -2 * (error + 1)
            else:
                mapped = 2 * error if error >= 0 else -2 * error - 1
            golomb(mapped, k, limit)
            updated(q, error)
            line[x] = value
            x += 1
        above = line
    head = struct.pack(">BHHB", precision, rows, columns, 1) + bytes([1, 0x11, 0])
    return (b"\xff\xd8" + segment(0xf7, head) + segment(0xda, bytes([1, 1, 0, 0, 0, 0])) + out.stuffed("0", 7) + b"\xff\xd9")
