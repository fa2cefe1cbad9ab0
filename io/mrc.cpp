// MRC2014 and CCP4 maps (Cheng et al., J. Struct. Biol. 192, 146-150, 2015): one header of 1024
// bytes, an extended one that is passed over, samples. Lengths are in angstrom.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <utility>

#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kHeader = 1024;
constexpr double kAngstrom = 1e-7;               // [mm]
constexpr std::int32_t kImodStamp = 1146047817;  // "IMOD"
constexpr double kPi = 3.14159265358979323846;

/// The header's words in one byte order; names are those of the format's table.
class Words {
 public:
    Words(const Bytes& bytes, bool big) : bytes_(bytes), big_(big) {}
    std::int32_t whole(std::size_t at) const { return value<std::int32_t>(at); }
    double real(std::size_t at) const { return value<float>(at); }
    bool big() const noexcept { return big_; }

 private:
    template <class T>
    T value(std::size_t at) const {
        std::byte raw[sizeof(T)];
        std::memcpy(raw, bytes_.data() + at, sizeof raw);
        if (big_) std::reverse(raw, raw + sizeof raw);
        T result;
        std::memcpy(&result, raw, sizeof result);
        return result;
    }
    const Bytes& bytes_;
    bool big_;
};

/// The machine stamp says the byte order; where it is missing, the one that makes sense.
bool is_big(const std::string& file, const Bytes& head) {
    const int stamp = std::to_integer<int>(head[212]);
    if (stamp == 0x44) return false;
    if (stamp == 0x11) return true;
    for (const bool big : {false, true}) {
        const Words words(head, big);
        const auto sensible = [&](std::size_t at) {
            return words.whole(at) > 0 && words.whole(at) < (1 << 24);
        };
        if (sensible(0) && sensible(4) && sensible(8) && words.whole(12) >= 0 &&
            words.whole(12) <= 101)
            return big;
    }
    refuse(file, "not MRC: field 'MACHST' and the sizes say no byte order");
}

void take_mode(Header& header, Stored& stored, const Words& words) {
    switch (const std::int32_t mode = words.whole(12); mode) {
        case 0: {
            // Bytes are signed since 2014; IMOD says which, older files only by their maximum.
            const bool imod = words.whole(152) == kImodStamp;
            const bool large = words.real(80) > 127 && words.real(76) >= 0;
            stored.type = (imod ? (words.whole(156) & 1) == 0 : large) ? Type::u8 : Type::i8;
            if (!imod && large)
                header.warnings.push_back(fmt::format(
                    "{}: bytes, signed by the format, but field 'DMAX' is {}: read as unsigned",
                    header.file, words.real(80)));
            return;
        }
        case 1:
            stored.type = Type::i16;
            return;
        case 2:
            stored.type = Type::f32;
            return;
        case 6:
            stored.type = Type::u16;
            return;
        case 12:
            stored.type = Type::f16;
            return;
        case 16:
            stored.type = Type::u8;
            stored.axes.push_back({Axis::channel, 3});
            return;
        case 3:
        case 4:
            refuse(header.file,
                   fmt::format("field 'MODE' is {}: complex samples are not supported", mode));
        case 101:
            refuse(header.file, "field 'MODE' is 101: samples of four bits are not supported");
        default:
            refuse(header.file,
                   fmt::format("field 'MODE' is {}, expected 0, 1, 2, 6, 12 or 16", mode));
    }
}

void take_sizes(Header& header, Stored& stored, const Words& words) {
    constexpr const char* kNames[] = {"NX", "NY", "NZ"};
    std::int64_t size[3];
    for (std::size_t i = 0; i < 3; ++i) {
        size[i] = words.whole(4 * i);
        if (size[i] < 1)
            refuse(header.file,
                   fmt::format("field '{}' is {}, expected 1 or more", kNames[i], size[i]));
    }
    const std::int32_t group = words.whole(88), sections = words.whole(36);
    std::int64_t volumes = 1;
    // Space groups from 401 mean a stack of volumes, of MZ sections each.
    if (group >= 401 && group <= 630) {
        if (sections < 1 || size[2] % sections != 0)
            refuse(header.file, fmt::format("field 'MZ' is {}, which does not divide NZ = {} into "
                                            "volumes",
                                            sections, size[2]));
        volumes = size[2] / sections;
        size[2] = sections;
    }
    constexpr Axis::Kind kKinds[] = {Axis::x, Axis::y, Axis::z};
    for (std::size_t i = 0; i < 3; ++i) stored.axes.push_back({kKinds[i], size[i]});
    if (volumes > 1) stored.axes.push_back({Axis::time, volumes});
    // Space group 0 means images: one of them is an image, several are a volume.
    header.volume = !(group == 0 && size[2] == 1);
}

/// Directions of the cell's edges a, b and c, as crystallography places them.
std::array<Vector, 3> edges(const std::string& file, const Words& words) {
    double cosine[3];
    for (std::size_t i = 0; i < 3; ++i) {
        const double angle = words.real(52 + 4 * i);
        // Many programs leave zeros, and mean right angles.
        cosine[i] = angle == 0 || angle == 90 ? 0 : std::cos(angle * kPi / 180);
        if (!std::isfinite(angle) || angle < 0 || angle >= 180)
            refuse(file, fmt::format("field 'CELLB' holds an angle of {} degrees", angle));
    }
    const double sine = std::sqrt(1 - cosine[2] * cosine[2]);
    const double across = (cosine[0] - cosine[1] * cosine[2]) / sine;
    const double rest = 1 - cosine[1] * cosine[1] - across * across;
    return {Vector{1, 0, 0}, Vector{cosine[2], sine, 0},
            Vector{cosine[1], across, std::sqrt(std::max(rest, 0.0))}};
}

/// Columns, rows and sections keep their order; which edge of the cell they follow is in the
/// directions.
void take_geometry(Header& header, const Words& words) {
    std::array<std::size_t, 3> edge{};
    bool used[3] = {};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::int32_t named = words.whole(64 + 4 * i);
        edge[i] = named >= 1 && named <= 3 ? static_cast<std::size_t>(named - 1) : 3;
    }
    const bool silent = words.whole(64) == 0 && words.whole(68) == 0 && words.whole(72) == 0;
    if (silent) edge = {0, 1, 2};
    for (const std::size_t axis : edge)
        if (axis > 2 || std::exchange(used[axis], true))
            refuse(header.file,
                   fmt::format("fields 'MAPC', 'MAPR', 'MAPS' are {}, {}, {}: no order "
                               "of 1, 2, 3",
                               words.whole(64), words.whole(68), words.whole(72)));
    const auto directions = edges(header.file, words);
    double step[3], origin[3];
    bool known = true, placed = false;
    for (std::size_t i = 0; i < 3; ++i) {
        const double cell = words.real(40 + 4 * i);
        const std::int32_t parts = words.whole(28 + 4 * i);
        step[i] = cell / parts;
        known = known && parts > 0 && std::isfinite(cell) && cell > 0;
        origin[i] = words.real(196 + 4 * i);
        if (!std::isfinite(origin[i])) origin[i] = 0;
        placed = placed || origin[i] != 0;
    }
    if (!known) {
        header.warnings.push_back(header.file +
                                  ": fields 'CELLA' and 'MX', 'MY', 'MZ' say no size of samples; "
                                  "taken as 1, without a unit");
        std::fill(step, step + 3, 1.0);
    }
    std::array<Vector, 3> steps;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t row = 0; row < 3; ++row)
            steps[i][row] = directions[edge[i]][row] * step[edge[i]];
    take_steps(header, steps, "CELLB");
    for (std::size_t row = 0; row < 3; ++row) {
        header.origin[row] = placed ? origin[row] : 0;
        // Without an origin the first column, row and section count from the cell's corner.
        for (std::size_t i = 0; i < 3 && !placed; ++i)
            header.origin[row] += words.whole(16 + 4 * i) * steps[i][row];
    }
    if (known) to_millimetres(header, kAngstrom);
}

}  // namespace

bool is_mrc(std::span<const std::byte> head) noexcept {
    return head.size() >= 212 && std::memcmp(head.data() + 208, "MAP ", 4) == 0;
}

Header inspect_mrc(const std::string& path) {
    const File file(path);
    Header header;
    header.file = path;
    header.format = "MRC";
    const Bytes head = file.head(kHeader);
    if (head.size() < kHeader)
        refuse(path, fmt::format("too short for an MRC header: {} bytes, expected {}", head.size(),
                                 kHeader));
    const Words words(head, is_big(path, head));
    const std::int32_t extended = words.whole(92);
    if (extended < 0 || static_cast<std::uint64_t>(extended) > file.size() - kHeader)
        refuse(path, fmt::format("field 'NSYMBT' is {}: an extended header beyond the end of the "
                                 "file",
                                 extended));
    Stored stored;
    stored.big_endian = words.big();
    take_mode(header, stored, words);
    take_sizes(header, stored, words);
    take_axes(header, stored);
    take_geometry(header, words);
    stored.pieces = {{path, kHeader + static_cast<std::uint64_t>(extended)}};
    take_reader(header, std::move(stored));
    return header;
}

}  // namespace edgewise::store
