// Writing NIfTI-1 and -2, NRRD, MetaImage and MGH. Their data are plain samples behind a header.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <zlib.h>

#include "graph/errors.hpp"
#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr int kLevel = 4;  // of deflate: 3 times as fast as 9 for 2 % more bytes on CT
constexpr bool kBig = std::endian::native == std::endian::big;

/// Plain or gzip, into the file.
class Sink {
 public:
    Sink(Replacement& out, bool zips) : out_(out), zips_(zips) {
        // 16: gzip, whose header zlib leaves without date and name.
        if (zips_ && deflateInit2(&z_, kLevel, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
            throw std::bad_alloc();
    }
    Sink(const Sink&) = delete;
    Sink& operator=(const Sink&) = delete;
    ~Sink() {
        if (zips_) deflateEnd(&z_);
    }
    void write(std::span<const std::byte> bytes) {
        if (!zips_) return out_.write(bytes);
        while (!bytes.empty()) {
            const auto part = bytes.first(std::min<std::size_t>(bytes.size(), 1 << 30));
            z_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(part.data()));
            z_.avail_in = static_cast<uInt>(part.size());
            run(Z_NO_FLUSH);
            bytes = bytes.subspan(part.size());
        }
    }
    void finish() {
        if (zips_) run(Z_FINISH);
    }

 private:
    void run(int flush) {
        int status = Z_OK;
        do {
            z_.next_out = reinterpret_cast<Bytef*>(buffer_.data());
            z_.avail_out = static_cast<uInt>(buffer_.size());
            status = deflate(&z_, flush);
            out_.write(std::span(buffer_).first(buffer_.size() - z_.avail_out));
        } while (z_.avail_out == 0 || (flush == Z_FINISH && status != Z_STREAM_END));
    }
    Replacement& out_;
    bool zips_;
    z_stream z_{};
    Bytes buffer_ = Bytes(1 << 16);
};

/// Fields of a NIfTI header at their offsets, in the machine's byte order.
class Fields {
 public:
    explicit Fields(std::size_t bytes) : bytes_(bytes) {}
    template <class T>
    void put(std::size_t at, T value) {
        std::memcpy(bytes_.data() + at, &value, sizeof value);
    }
    void text(std::size_t at, std::string_view value) {
        std::memcpy(bytes_.data() + at, value.data(), value.size());
    }
    const Bytes& bytes() const { return bytes_; }

 private:
    Bytes bytes_;
};

int nifti_code(const Header& what) {
    if (is_nifti_colour(what)) return what.channels == 3 ? 128 : 2304;
    if (what.integers != Wide::no) return what.integers == Wide::with_sign ? 1024 : 1280;
    switch (what.type) {
        case Type::u8:
            return 2;
        case Type::i8:
            return 256;
        case Type::u16:
            return 512;
        case Type::i16:
            return 4;
        case Type::u32:
            return 768;
        case Type::i32:
            return 8;
        case Type::f64:
            return 64;
        default:
            return 16;
    }
}

/// b, c, d of a rotation's quaternion and qfac (nifti1_io.c, nifti_mat44_to_quatern).
struct Quaternion {
    double b = 0, c = 0, d = 0, qfac = 1;
};
Quaternion quaternion_of(std::array<Vector, 3> columns) {
    Quaternion q;
    if (determinant(columns) < 0) {
        q.qfac = -1;
        for (double& entry : columns[2]) entry = -entry;
    }
    const auto r = [&](int row, int column) { return columns[column][row]; };
    const double trace = r(0, 0) + r(1, 1) + r(2, 2) + 1;
    double a = 0;
    if (trace > 0.5) {
        a = 0.5 * std::sqrt(trace);
        q.b = 0.25 * (r(2, 1) - r(1, 2)) / a;
        q.c = 0.25 * (r(0, 2) - r(2, 0)) / a;
        q.d = 0.25 * (r(1, 0) - r(0, 1)) / a;
        return q;
    }
    const double xd = 1 + r(0, 0) - r(1, 1) - r(2, 2), yd = 1 + r(1, 1) - r(0, 0) - r(2, 2);
    const double zd = 1 + r(2, 2) - r(0, 0) - r(1, 1);
    if (xd > 1) {
        q.b = 0.5 * std::sqrt(xd);
        q.c = 0.25 * (r(0, 1) + r(1, 0)) / q.b;
        q.d = 0.25 * (r(0, 2) + r(2, 0)) / q.b;
        a = 0.25 * (r(2, 1) - r(1, 2)) / q.b;
    } else if (yd > 1) {
        q.c = 0.5 * std::sqrt(yd);
        q.b = 0.25 * (r(0, 1) + r(1, 0)) / q.c;
        q.d = 0.25 * (r(1, 2) + r(2, 1)) / q.c;
        a = 0.25 * (r(0, 2) - r(2, 0)) / q.c;
    } else {
        q.d = 0.5 * std::sqrt(zd);
        q.b = 0.25 * (r(0, 2) + r(2, 0)) / q.d;
        q.c = 0.25 * (r(1, 2) + r(2, 1)) / q.d;
        a = 0.25 * (r(1, 0) - r(0, 1)) / q.d;
    }
    if (a < 0) q.b = -q.b, q.c = -q.c, q.d = -q.d;
    return q;
}

bool is_orthogonal(const Header& what) {
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < a; ++b)
            if (std::abs(dot(what.direction[a], what.direction[b])) > 1e-5) return false;
    return true;
}

/// Offsets of the same fields in both versions; R is how they store real numbers.
template <class R>
void nifti_fields(Fields& f, const Header& ras, bool two) {
    const std::size_t wide = sizeof(R);
    const std::size_t pixdim = two ? 104 : 76, slope = two ? 176 : 112,
                      quaternion = two ? 352 : 256;
    const std::size_t rows = two ? 400 : 280;
    const bool planar = ras.channels > 1 && !is_nifti_colour(ras);
    const std::int64_t axes = planar ? 5 : ras.times > 1 ? 4 : ras.volume ? 3 : 2;
    const std::int64_t dims[8] = {
        axes, ras.extent.x, ras.extent.y, ras.extent.z, ras.times, planar ? ras.channels : 1, 1, 1};
    for (std::size_t i = 0; i < 8; ++i) {
        if (two)
            f.put(16 + 8 * i, dims[i]);
        else
            f.put(40 + 2 * i, static_cast<std::int16_t>(dims[i]));
    }
    const Quaternion q = quaternion_of(ras.direction);
    f.put(pixdim, static_cast<R>(q.qfac));
    for (std::size_t i = 0; i < 3; ++i)
        f.put(pixdim + (i + 1) * wide, static_cast<R>(ras.spacing[i]));
    f.put(slope, static_cast<R>(ras.values.slope));
    f.put(slope + wide, static_cast<R>(ras.values.offset));
    f.put(quaternion, static_cast<R>(q.b));
    f.put(quaternion + wide, static_cast<R>(q.c));
    f.put(quaternion + 2 * wide, static_cast<R>(q.d));
    for (std::size_t row = 0; row < 3; ++row) {
        f.put(quaternion + (3 + row) * wide, static_cast<R>(ras.origin[row]));
        for (std::size_t axis = 0; axis < 3; ++axis)
            f.put(rows + (4 * row + axis) * wide,
                  static_cast<R>(ras.direction[axis][row] * ras.spacing[axis]));
        f.put(rows + (4 * row + 3) * wide, static_cast<R>(ras.origin[row]));
    }
}

/// Space directions where they say more than spacings do.
bool needs_directions(const Header& what) {
    return what.anatomical || !is_identity(what.direction) || what.origin != Vector{0, 0, 0};
}

Fields nifti_header(const Header& what) {
    const bool two = std::max({what.extent.x, what.extent.y, what.extent.z}) > 32767;
    Header ras = what;
    // Where a grid lies is said in NIfTI by the patient's axes or not at all; what does not name
    // its axes is taken as LPS, as everywhere.
    const bool placed = needs_directions(what);
    if (placed) flip_xy(ras);
    Fields f(two ? 544 : 352);
    const int code = nifti_code(what), intent = what.labels ? 1002 : 0;
    const int bits = static_cast<int>(8 * bytes_of(what.type)) * (code == 128    ? 3
                                                                  : code == 2304 ? 4
                                                                                 : 1);
    constexpr int kScanner = 1, kAligned = 2;  // NIFTI_XFORM
    const int sform = what.anatomical ? kScanner : placed ? kAligned : 0;
    const int qform = is_orthogonal(what) ? sform : 0;
    const int units = what.unit == "mm" ? 2 : 0;
    f.put(0, std::int32_t{two ? 540 : 348});
    f.put(two ? 12 : 70, static_cast<std::int16_t>(code));
    f.put(two ? 14 : 72, static_cast<std::int16_t>(bits));
    if (two) {
        f.text(4, std::string_view("n+2\0\r\n\032\n", 8));
        f.put(168, std::int64_t{544});
        f.put(344, std::int32_t{qform});
        f.put(348, std::int32_t{sform});
        f.put(500, std::int32_t{units});
        f.put(504, std::int32_t{intent});
        nifti_fields<double>(f, ras, true);
    } else {
        f.text(344, std::string_view("n+1\0", 4));
        f.put(38, 'r');
        f.put(68, static_cast<std::int16_t>(intent));
        f.put(108, 352.0f);
        f.put(123, static_cast<char>(units));
        f.put(252, static_cast<std::int16_t>(qform));
        f.put(254, static_cast<std::int16_t>(sform));
        nifti_fields<float>(f, ras, false);
    }
    return f;
}

std::string_view nrrd_type(const Header& what) {
    if (what.integers != Wide::no) return what.integers == Wide::with_sign ? "int64" : "uint64";
    switch (what.type) {
        case Type::u8:
            return "uint8";
        case Type::i8:
            return "int8";
        case Type::u16:
            return "uint16";
        case Type::i16:
            return "int16";
        case Type::u32:
            return "uint32";
        case Type::i32:
            return "int32";
        case Type::f64:
            return "double";
        default:
            return "float";
    }
}

std::string_view metaimage_type(const Header& what) {
    if (what.integers != Wide::no)
        return what.integers == Wide::with_sign ? "MET_LONG_LONG" : "MET_ULONG_LONG";
    switch (what.type) {
        case Type::u8:
            return "MET_UCHAR";
        case Type::i8:
            return "MET_CHAR";
        case Type::u16:
            return "MET_USHORT";
        case Type::i16:
            return "MET_SHORT";
        case Type::u32:
            return "MET_UINT";
        case Type::i32:
            return "MET_INT";
        case Type::f64:
            return "MET_DOUBLE";
        default:
            return "MET_FLOAT";
    }
}

/// Axes of space; a series has three, so that its time is no third one of them.
int nrrd_axes(const Header& what) { return what.volume || what.times > 1 ? 3 : 2; }

std::string nrrd_geometry(const Header& what) {
    const int axes = nrrd_axes(what);
    const bool series = what.times > 1;
    std::string text;
    if (!needs_directions(what)) {
        text = what.channels > 1 ? "spacings: nan" : "spacings:";
        for (int axis = 0; axis < axes; ++axis) text += fmt::format(" {}", what.spacing[axis]);
        if (series) text += " nan";
        if (what.unit.empty()) return text + "\n";
        text += what.channels > 1 ? "\nunits: \"\"" : "\nunits:";
        for (int axis = 0; axis < axes; ++axis) text += " \"" + what.unit + "\"";
        return text + (series ? " \"\"\n" : "\n");
    }
    text = what.anatomical ? "space: left-posterior-superior\n" : "space dimension: 3\n";
    text += what.channels > 1 ? "space directions: none" : "space directions:";
    for (int axis = 0; axis < axes; ++axis) {
        text += " (";
        for (int row = 0; row < 3; ++row)
            text +=
                fmt::format("{}{}", row ? "," : "", what.direction[axis][row] * what.spacing[axis]);
        text += ")";
    }
    if (series) text += " none";
    if (!what.unit.empty())
        text += fmt::format("\nspace units: \"{0}\" \"{0}\" \"{0}\"", what.unit);
    return text + fmt::format("\nspace origin: ({},{},{})\n", what.origin[0], what.origin[1],
                              what.origin[2]);
}

std::string nrrd_header(const Header& what) {
    constexpr const char* kColours[] = {"RGB-color ", "RGBA-color "};
    const bool channels = what.channels > 1, series = what.times > 1;
    const std::string kind = !channels            ? ""
                             : is_colour(what)    ? kColours[what.channels - 3]
                             : what.channels <= 4 ? fmt::format("{}-vector ", what.channels)
                                                  : "vector ";
    std::string text = fmt::format("NRRD0004\ntype: {}\ndimension: {}\nsizes:", nrrd_type(what),
                                   nrrd_axes(what) + channels + series);
    if (channels) text += fmt::format(" {}", what.channels);
    text += fmt::format(" {} {}", what.extent.x, what.extent.y);
    if (nrrd_axes(what) == 3) text += fmt::format(" {}", what.extent.z);
    if (series) text += fmt::format(" {}", what.times);
    (text += "\n") += nrrd_geometry(what);
    if (channels || series)
        text += fmt::format("kinds: {}{}{}\n", kind,
                            nrrd_axes(what) == 3 ? "domain domain domain" : "domain domain",
                            series ? " time" : "");
    return text + fmt::format("endian: {}\nencoding: raw\n\n", kBig ? "big" : "little");
}

std::string metaimage_header(const Header& what) {
    const int axes = what.volume ? 3 : 2;
    std::string matrix, origin, spacing, sizes;
    for (int axis = 0; axis < axes; ++axis) {
        for (int row = 0; row < axes; ++row)
            matrix += fmt::format(" {}", what.direction[axis][row]);
        origin += fmt::format(" {}", what.origin[axis]);
        spacing += fmt::format(" {}", what.spacing[axis]);
        sizes += fmt::format(" {}", what.extent[axis]);
    }
    std::string text = fmt::format(
        "ObjectType = Image\nNDims = {}\nBinaryData = True\nBinaryDataByteOrderMSB = {}\n"
        "CompressedData = False\nTransformMatrix ={}\nOffset ={}\n",
        axes, kBig ? "True" : "False", matrix, origin);
    if (what.anatomical && axes == 3) {
        std::string from = letters_of(what.direction);  // MetaIO names where axes come from
        for (char& c : from) c = "RLAPIS"[std::string_view("LRPASI").find(c)];
        text += "AnatomicalOrientation = " + from + "\n";
    }
    text += fmt::format("ElementSpacing ={}\nDimSize ={}\n", spacing, sizes);
    if (what.channels > 1) text += fmt::format("ElementNumberOfChannels = {}\n", what.channels);
    return text + fmt::format("ElementType = {}\nElementDataFile = LOCAL\n", metaimage_type(what));
}

/// The first 284 bytes, big-endian; what is not used is 0.
Bytes mgh_header_of(const Header& what) {
    Header ras = what;
    flip_xy(ras);
    Bytes bytes;
    const auto put = [&](std::uint32_t bits, int width) {
        for (int i = width - 1; i >= 0; --i)
            bytes.push_back(static_cast<std::byte>(bits >> 8 * i & 0xff));
    };
    const auto real = [&](double value) {
        put(std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4);
    };
    const std::uint32_t type = what.type == Type::u8    ? 0
                               : what.type == Type::i32 ? 1
                               : what.type == Type::i16 ? 4
                                                        : 3;
    put(1, 4);
    for (int axis = 0; axis < 3; ++axis) put(static_cast<std::uint32_t>(what.extent[axis]), 4);
    put(1, 4);
    put(type, 4);
    put(0, 4);
    put(1, 2);  // what follows is said
    for (const double step : ras.spacing) real(step);
    for (const Vector& column : ras.direction)
        for (const double entry : column) real(entry);
    for (std::size_t row = 0; row < 3; ++row) {
        double centre = ras.origin[row];
        for (std::size_t axis = 0; axis < 3; ++axis)
            centre += ras.direction[axis][row] * ras.spacing[axis] * 0.5 *
                      static_cast<double>(what.extent[static_cast<int>(axis)]);
        real(centre);
    }
    bytes.resize(284);
    return bytes;
}

}  // namespace

void write_nifti(Replacement& out, const Header& what, const void* samples) {
    Sink sink(out, lower(out.path()).ends_with(".gz"));
    sink.write(nifti_header(what).bytes());
    const auto all = samples_of(what, samples);
    const auto channels = static_cast<std::size_t>(what.channels);
    if (channels == 1 || is_nifti_colour(what)) {
        sink.write(all);
    } else {  // the fifth axis is the slowest: one channel after another
        const std::size_t width = bytes_of(what.type), step = width * channels;
        Bytes row(static_cast<std::size_t>(what.extent.x) * width);
        for (std::size_t channel = 0; channel < channels; ++channel)
            for (std::size_t from = channel * width; from < all.size();
                 from += row.size() * channels) {
                for (std::size_t i = 0; i < row.size() / width; ++i)
                    std::memcpy(row.data() + i * width, all.data() + from + i * step, width);
                sink.write(row);
            }
    }
    sink.finish();
}

void write_nrrd(Replacement& out, const Header& what, const void* samples) {
    const std::string header = nrrd_header(what);
    out.write(std::as_bytes(std::span(header)));
    out.write(samples_of(what, samples));
}

void write_mgh(Replacement& out, const Header& what, const void* samples) {
    Sink sink(out, !lower(out.path()).ends_with(".mgh"));
    sink.write(mgh_header_of(what));
    std::span<const std::byte> left = samples_of(what, samples);
    const std::size_t width = bytes_of(what.type);
    Bytes chunk;
    while (!left.empty()) {
        const auto part = left.first(std::min<std::size_t>(left.size(), width << 16));
        chunk.assign(part.begin(), part.end());
        if (!kBig && width > 1)
            swap_bytes(chunk.data(), width, static_cast<std::int64_t>(chunk.size() / width));
        sink.write(chunk);
        left = left.subspan(part.size());
    }
    sink.finish();
}

void write_metaimage(Replacement& out, const Header& what, const void* samples) {
    const std::string header = metaimage_header(what);
    out.write(std::as_bytes(std::span(header)));
    out.write(samples_of(what, samples));
}

}  // namespace edgewise::store
