// FreeSurfer's .mgh, and .mgz, the same packed by gzip: 284 bytes of big-endian header, then
// samples (surfer.nmr.mgh.harvard.edu/fswiki/FsTutorial/MghFormat). Its frame is RAS [mm]; a
// Header's is LPS. Scan parameters and tags behind the samples are left alone.

#include <algorithm>
#include <bit>
#include <cmath>
#include <fmt/format.h>
#include <type_traits>

#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kMghHeader = 284;

/// What of the header is used.
struct MghFields {
    std::int32_t version, size[3], frames, type;
    std::int16_t good;     // 0: nothing of what follows is said
    double spacing[3];     // [mm]
    double columns[3][3];  // where x, y and z point
    double centre[3];      // of the sample of index extent / 2
};

class MghParser {
 public:
    explicit MghParser(const Bytes& bytes) : bytes_(bytes) {}

    MghFields run() {
        MghFields f{};
        f.version = number<std::int32_t>();
        for (std::int32_t& size : f.size) size = number<std::int32_t>();
        f.frames = number<std::int32_t>();
        f.type = number<std::int32_t>();
        number<std::int32_t>();  // degrees of freedom, of statistics
        f.good = number<std::int16_t>();
        for (double& step : f.spacing) step = static_cast<double>(number<float>());
        for (auto& column : f.columns)
            for (double& entry : column) entry = static_cast<double>(number<float>());
        for (double& entry : f.centre) entry = static_cast<double>(number<float>());
        return f;
    }

 private:
    template <class T>
    T number() {
        using Bits = std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint32_t>;
        Bits bits = 0;
        for (std::size_t i = 0; i < sizeof(T); ++i)
            bits = static_cast<Bits>(bits << 8 | std::to_integer<Bits>(bytes_[at_++]));
        return std::bit_cast<T>(bits);
    }

    const Bytes& bytes_;
    std::size_t at_ = 0;
};

Bytes mgh_header(const FilePointer& file, bool zipped) {
    Bytes bytes(kMghHeader);
    const auto stream =
        open_stream(file, 0, file->size(), zipped ? Wrapping::gzip : Wrapping::none);
    bytes.resize(stream->read(bytes));
    if (bytes.size() < kMghHeader)
        refuse(file->path(), fmt::format("too short for an MGH header: {} bytes, expected {}",
                                         bytes.size(), kMghHeader));
    return bytes;
}

Type mgh_type(const std::string& file, std::int32_t code) {
    switch (code) {
        case 0:
            return Type::u8;
        case 1:
            return Type::i32;
        case 3:
            return Type::f32;
        case 4:
            return Type::i16;
        case 10:
            return Type::u16;
        default:
            refuse(file, fmt::format("field 'type' is {}, expected 0 (u8), 1 (i32), 3 (f32), 4 "
                                     "(i16) or 10 (u16)",
                                     code));
    }
}

/// As FreeSurfer: a coronal head around 0, of cubes of 1 mm.
void coronal(MghFields& f) {
    constexpr double kColumns[3][3] = {{-1, 0, 0}, {0, 0, -1}, {0, 1, 0}};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        f.spacing[axis] = 1;
        f.centre[axis] = 0;
        std::copy_n(kColumns[axis], 3, f.columns[axis]);
    }
}

void mgh_geometry(Header& header, MghFields f) {
    if (f.good == 0) {
        coronal(f);
        header.warnings.push_back(header.file +
                                  ": does not say how it lies; taken as FreeSurfer takes it, a "
                                  "coronal scan of 1 mm around 0");
    }
    std::array<Vector, 3> steps;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        header.spacing[axis] = without_noise(f.spacing[axis]);
        for (std::size_t row = 0; row < 3; ++row)
            steps[axis][row] = f.columns[axis][row] * header.spacing[axis];
    }
    check_spacing(header, "spacing");
    for (std::size_t row = 0; row < 3; ++row) {
        header.origin[row] = f.centre[row];
        for (std::size_t axis = 0; axis < 3; ++axis)
            header.origin[row] -= steps[axis][row] * 0.5 * f.size[axis];
    }
    const Vector said = header.spacing;
    take_steps(header, steps, "x_ras");
    // Directions are unit vectors but for the rounding of f32, which is no spacing.
    constexpr double kRounding = 1e-5;
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (std::abs(header.spacing[axis] / said[axis] - 1) < kRounding)
            header.spacing[axis] = said[axis];
    check_spacing(header, "c_ras");
    header.anatomical = true;
    header.unit = "mm";
    flip_xy(header);
}

}  // namespace

Header inspect_mgh(const std::string& path) {
    const auto file = std::make_shared<const File>(path);
    const bool zipped = starts_gzip(file->head(3));
    const MghFields f = MghParser(mgh_header(file, zipped)).run();
    // Above the version newer files say what they are meant as.
    constexpr std::int32_t kVersion = 1;
    if ((f.version & 0xff) != kVersion || f.version < 0)
        refuse(path,
               fmt::format("not MGH: field 'version' is {}, expected {}", f.version, kVersion));
    Header header;
    header.file = path;
    header.format = "MGH";
    Stored stored;
    stored.type = mgh_type(path, f.type);
    stored.big_endian = true;
    stored.axes = {
        {Axis::x, f.size[0]}, {Axis::y, f.size[1]}, {Axis::z, f.size[2]}, {Axis::time, f.frames}};
    stored.pieces = {{path, zipped ? 0 : kMghHeader}};
    stored.encoding = zipped ? Stored::Encoding::gzip : Stored::Encoding::raw;
    stored.skip = zipped ? kMghHeader : 0;
    take_axes(header, stored);
    mgh_geometry(header, f);
    take_reader(header, std::move(stored));
    return header;
}

}  // namespace edgewise::store
