// NIfTI-1 and NIfTI-2, single files and pairs, plain or gzip. Field names are those of nifti1.h and
// nifti2.h. NIfTI's frame is RAS [mm]; a Header's is LPS.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>

#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

struct Code {
    int code;
    Type type;
    int channels, bits;
    Wide wide = Wide::no;
};
constexpr Code kTypes[] = {{2, Type::u8, 1, 8},
                           {256, Type::i8, 1, 8},
                           {4, Type::i16, 1, 16},
                           {512, Type::u16, 1, 16},
                           {8, Type::i32, 1, 32},
                           {768, Type::u32, 1, 32},
                           {16, Type::f32, 1, 32},
                           {64, Type::f64, 1, 64},
                           {128, Type::u8, 3, 24},
                           {2304, Type::u8, 4, 32},
                           {1024, Type::f64, 1, 64, Wide::with_sign},
                           {1280, Type::f64, 1, 64, Wide::without_sign}};
constexpr std::pair<int, const char*> kRefused[] = {{1, "samples of one bit"},
                                                    {32, "complex samples"},
                                                    {1536, "floats of 128 bits"},
                                                    {1792, "complex samples"},
                                                    {2048, "complex samples"}};
constexpr int kLabelIntent = 1002;  // NIFTI_INTENT_LABEL
constexpr double kSameSpacing = 1e-3;
constexpr std::size_t kHeader1 = 348, kHeader2 = 540;

/// The fields of both versions, in one byte order and one width.
struct Fields {
    bool two = false, big = false, pair = false;
    std::int64_t dim[8] = {};
    int datatype = 0, bitpix = 0, intent = 0, units = 0;
    int qform = 0, sform = 0;
    double pixdim[8] = {}, offset = 0, slope = 1, inter = 0;
    double quaternion[3] = {}, shift[3] = {}, rows[3][4] = {};
};

class Parser {
 public:
    Parser(const std::string& file, const Bytes& bytes) : file_(file), bytes_(bytes) {}

    Fields run() {
        if (bytes_.size() < kHeader1)
            refuse(file_, fmt::format("too short for a NIfTI header: {} bytes, expected {}",
                                      bytes_.size(), kHeader1));
        order();
        return fields_.two ? second() : first();
    }

 private:
    template <class T>
    T at(std::size_t offset) const {
        T value;
        std::byte raw[sizeof(T)];
        std::memcpy(raw, bytes_.data() + offset, sizeof raw);
        if (fields_.big) std::reverse(raw, raw + sizeof raw);
        std::memcpy(&value, raw, sizeof value);
        return value;
    }
    void order() {
        for (bool big : {false, true}) {
            fields_.big = big;
            const auto size = at<std::int32_t>(0);
            fields_.two = size == kHeader2;
            if (fields_.two && bytes_.size() < kHeader2)
                refuse(file_, "too short for a NIfTI-2 header");
            if (size == kHeader1 || size == kHeader2) return;
        }
        refuse(file_, "not NIfTI: sizeof_hdr is neither 348 nor 540 in either byte order");
    }
    void magic(std::size_t offset, char version) {
        const char* text = reinterpret_cast<const char*>(bytes_.data()) + offset;
        const bool single = text[1] == '+', pair = text[1] == 'i';
        if (text[0] != 'n' || (!single && !pair) || text[2] != version || text[3] != 0)
            refuse(file_, fmt::format("not NIfTI: field 'magic' is '{}'", shown({text, 4})));
        fields_.pair = pair;
    }
    Fields first() {
        magic(344, '1');
        for (std::size_t i = 0; i < 8; ++i) {
            fields_.dim[i] = at<std::int16_t>(40 + 2 * i);
            fields_.pixdim[i] = at<float>(76 + 4 * i);
        }
        fields_.intent = at<std::int16_t>(68);
        fields_.datatype = at<std::int16_t>(70);
        fields_.bitpix = at<std::int16_t>(72);
        fields_.offset = at<float>(108);
        fields_.slope = at<float>(112);
        fields_.inter = at<float>(116);
        fields_.units = std::to_integer<int>(bytes_[123]);
        fields_.qform = at<std::int16_t>(252);
        fields_.sform = at<std::int16_t>(254);
        for (std::size_t i = 0; i < 3; ++i) {
            fields_.quaternion[i] = at<float>(256 + 4 * i);
            fields_.shift[i] = at<float>(268 + 4 * i);
            for (std::size_t j = 0; j < 4; ++j)
                fields_.rows[i][j] = at<float>(280 + 16 * i + 4 * j);
        }
        return fields_;
    }
    Fields second() {
        magic(4, '2');
        for (std::size_t i = 0; i < 8; ++i) {
            fields_.dim[i] = at<std::int64_t>(16 + 8 * i);
            fields_.pixdim[i] = at<double>(104 + 8 * i);
        }
        fields_.datatype = at<std::int16_t>(12);
        fields_.bitpix = at<std::int16_t>(14);
        fields_.offset = static_cast<double>(at<std::int64_t>(168));
        fields_.slope = at<double>(176);
        fields_.inter = at<double>(184);
        fields_.qform = at<std::int32_t>(344);
        fields_.sform = at<std::int32_t>(348);
        for (std::size_t i = 0; i < 3; ++i) {
            fields_.quaternion[i] = at<double>(352 + 8 * i);
            fields_.shift[i] = at<double>(376 + 8 * i);
            for (std::size_t j = 0; j < 4; ++j)
                fields_.rows[i][j] = at<double>(400 + 32 * i + 8 * j);
        }
        fields_.units = at<std::int32_t>(500);
        fields_.intent = at<std::int32_t>(504);
        return fields_;
    }

    const std::string& file_;
    const Bytes& bytes_;
    Fields fields_;
};

std::vector<Axis> axes_of(const std::string& file, const Fields& f, int channels) {
    if (f.dim[0] < 1 || f.dim[0] > 7)
        refuse(file, fmt::format("field 'dim[0]' is {}, expected 1 to 7", f.dim[0]));
    std::vector<Axis> axes;
    if (channels > 1) axes.push_back({Axis::channel, channels});
    constexpr Axis::Kind kKinds[] = {Axis::x, Axis::y, Axis::z, Axis::time, Axis::channel};
    std::int64_t samples = 1;
    for (int i = 1; i <= f.dim[0]; ++i) {
        if (f.dim[i] < 1)
            refuse(file, fmt::format("field 'dim[{}]' is {}, expected 1 or more", i, f.dim[i]));
        samples = product(file, samples, f.dim[i]);
        if (i <= 5)
            axes.push_back({kKinds[i - 1], f.dim[i]});
        else if (f.dim[i] > 1)
            refuse(file, fmt::format("field 'dim[{}]' is {}: more than 5 axes are not supported", i,
                                     f.dim[i]));
    }
    if (channels > 1 && f.dim[0] >= 5 && f.dim[5] > 1)
        refuse(file, "colour samples with a fifth axis are not supported");
    return axes;
}

const Code& code_of(const std::string& file, const Fields& f) {
    for (const Code& row : kTypes) {
        if (row.code != f.datatype) continue;
        if (row.bits != f.bitpix)
            refuse(file, fmt::format("field 'bitpix' is {}, but datatype {} has {} bits", f.bitpix,
                                     f.datatype, row.bits));
        return row;
    }
    for (const auto& [code, what] : kRefused)
        if (code == f.datatype)
            refuse(file, fmt::format("field 'datatype' is {}: {} are not supported", code, what));
    refuse(file, fmt::format("field 'datatype' is {}: not known", f.datatype));
}

/// Steps of the qform (nifti1.h, method 2).
std::array<Vector, 3> quaternion_steps(Header& header, const Fields& f) {
    double b = f.quaternion[0], c = f.quaternion[1], d = f.quaternion[2];
    const double rest = 1 - (b * b + c * c + d * d);
    if (!std::isfinite(rest)) refuse(header.file, "field 'quatern' is not finite");
    // f32 quaternions of half turns miss length 1 by a few units in the last place.
    if (rest < -1e-5)
        refuse(header.file,
               fmt::format("field 'quatern': b^2 + c^2 + d^2 is {:.4g}, more than 1", 1 - rest));
    // As nifti1_io.c: so close to a half turn the root of a difference of f32 numbers is noise.
    double a = 0;
    if (rest < 1e-7) {
        const double size = std::sqrt(1 - rest);
        b /= size, c /= size, d /= size;
    } else {
        a = std::sqrt(rest);
    }
    const double rotation[3][3] = {
        {a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
        {2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)},
        {2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c}};
    std::array<Vector, 3> steps;
    for (int axis = 0; axis < 3; ++axis)
        for (int row = 0; row < 3; ++row)
            steps[axis][row] = rotation[row][axis] * header.spacing[axis] *
                               (axis == 2 && f.pixdim[0] < 0 ? -1 : 1);
    return steps;
}

/// Of one plane nobody needs to know the distance to the next, so many files do not say it.
double one_plane(Header& header) {
    header.warnings.push_back(header.file +
                              ": does not say how thick its one plane is; taken as 1");
    return 1;
}

void take_pixdim(Header& header, const Fields& f) {
    for (int axis = 0; axis < std::min<std::int64_t>(3, f.dim[0]); ++axis) {
        double step = f.pixdim[axis + 1];
        if (step == 0 && header.extent[axis] == 1) step = one_plane(header);
        if (step < 0 && std::isfinite(step))
            header.warnings.push_back(fmt::format("{}: field 'pixdim[{}]' is {}; taken as positive",
                                                  header.file, axis + 1, step));
        header.spacing[axis] = without_noise(std::abs(step));
    }
    check_spacing(header, "pixdim");
}

void take_geometry(Header& header, const Fields& f) {
    header.anatomical = f.sform > 0 || f.qform > 0;
    if (f.sform > 0) {
        std::array<Vector, 3> steps;
        for (int row = 0; row < 3; ++row) {
            for (int axis = 0; axis < 3; ++axis) steps[axis][row] = f.rows[row][axis];
            header.origin[row] = f.rows[row][3];
        }
        if (complete_steps(steps, header.extent) && header.volume) one_plane(header);
        take_steps(header, steps, "srow");
        for (int axis = 0; axis < std::min<std::int64_t>(3, f.dim[0]); ++axis)
            if (header.extent[axis] > 1 &&
                std::abs(f.pixdim[axis + 1] / header.spacing[axis] - 1) > kSameSpacing)
                header.warnings.push_back(fmt::format(
                    "{}: field 'pixdim[{}]' is {}, but the sform says {:.6g}, which is used",
                    header.file, axis + 1, f.pixdim[axis + 1], header.spacing[axis]));
    } else {
        take_pixdim(header, f);
        if (f.qform > 0) {
            take_steps(header, quaternion_steps(header, f), "quatern");
            std::copy(f.shift, f.shift + 3, header.origin.begin());
        }
    }
    check_spacing(header, f.sform > 0 ? "srow" : "qoffset");
    if (header.anatomical) flip_xy(header);
    const int unit = f.units & 7;  // nifti1.h: 1 metre, 2 mm, 3 micrometre
    if (unit == 1 || unit == 3) to_millimetres(header, unit == 1 ? 1e3 : 1e-3);
    if (unit == 2 || header.anatomical) header.unit = "mm";
}

bool is_zipped(const File& file) { return starts_gzip(file.head(3)); }

Bytes header_bytes(const std::shared_ptr<const File>& file, bool zipped) {
    if (!zipped) return file->head(kHeader2);
    Bytes bytes(kHeader2);
    const auto stream = open_stream(file, 0, file->size(), Wrapping::gzip);
    const std::size_t got = stream->read(std::span(bytes).first(kHeader1));
    bytes.resize(got < kHeader1 ? got
                                : kHeader1 + stream->read(std::span(bytes).subspan(kHeader1)));
    return bytes;
}

/// "a.hdr" <-> "a.img", with or without ".gz", whichever is there.
std::string partner(const std::string& path, const char* ending) {
    std::string stem = path;
    if (lower(stem).ends_with(".gz")) stem.resize(stem.size() - 3);
    stem.resize(stem.size() - 4);
    for (const std::string& candidate : {stem + ending, stem + ending + ".gz"})
        if (std::filesystem::exists(candidate)) return candidate;
    refuse(path, fmt::format("its other half '{}{}' does not exist", stem, ending));
}

std::uint64_t data_offset(const std::string& file, const Fields& f) {
    const double least = f.pair ? 0 : f.two ? 544 : 352;
    double offset = f.offset;
    if (offset == 0) offset = least;
    if (!(offset >= least && offset < 0x1p62))
        refuse(file, fmt::format("field 'vox_offset' is {}, expected {} or more within the file",
                                 f.offset, least));
    if (offset != std::floor(offset))
        refuse(file, fmt::format("field 'vox_offset' is {}, not an integer", f.offset));
    return static_cast<std::uint64_t>(offset);
}

}  // namespace

Header inspect_nifti(const std::string& path) {
    const bool given_data = ends_with_any(path, {".img", ".img.gz"});
    const std::string head = given_data ? partner(path, ".hdr") : path;
    const auto file = std::make_shared<const File>(head);
    const bool zipped = is_zipped(*file);
    const Fields f = Parser(path, header_bytes(file, zipped)).run();
    Header header;
    header.file = path;
    header.format = "NIfTI";
    const Code& code = code_of(path, f);
    Stored stored;
    stored.type = code.type;
    stored.wide = code.wide;
    stored.big_endian = f.big;
    stored.axes = axes_of(path, f, code.channels);
    const std::string data = f.pair ? (given_data ? path : partner(path, ".img")) : head;
    const bool data_zipped = f.pair ? is_zipped(File(data)) : zipped;
    const std::uint64_t offset = data_offset(path, f);
    stored.pieces = {{data, data_zipped ? 0 : offset}};
    stored.encoding = data_zipped ? Stored::Encoding::gzip : Stored::Encoding::raw;
    stored.skip = data_zipped ? offset : 0;
    take_axes(header, stored);
    header.volume = f.dim[0] >= 3;
    take_geometry(header, f);
    // A slope of 0 or one that is not finite means that nothing is scaled.
    if (std::isfinite(f.slope) && f.slope != 0 && std::isfinite(f.inter) && code.channels == 1)
        header.values = {f.slope, f.inter};
    header.labels = f.intent == kLabelIntent;
    header.colour = code.channels > 1;
    if (code.channels == 4) header.alpha = Alpha::straight;
    take_reader(header, std::move(stored));
    return header;
}

}  // namespace edgewise::store
