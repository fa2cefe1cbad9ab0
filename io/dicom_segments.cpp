#include "io/dicom_segments.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise::store {
namespace {

/// Text as UTF-8: Latin-1 is converted; of other sets only ASCII is kept.
std::string utf8_of(const std::string& text, const std::string& characters) {
    if (characters == "ISO_IR 192") return text;
    std::string out;
    for (const char each : text) {
        const auto byte = static_cast<unsigned char>(each);
        if (byte < 0x80) {
            out += each;
        } else if (characters == "ISO_IR 100") {
            out += static_cast<char>(0xc0 | byte >> 6);
            out += static_cast<char>(0x80 | (byte & 0x3f));
        } else {
            out += '?';
        }
    }
    return out;
}

}  // namespace

std::array<double, 3> srgb_of_dicom_lab(const std::array<double, 3>& stored) {
    constexpr double kMost = 65535;
    const double lightness = stored[0] / kMost * 100, a = stored[1] / kMost * 255 - 128,
                 b = stored[2] / kMost * 255 - 128;
    // CIE 15: the inverse of L*a*b*, with 6/29 where the cube root meets the line.
    const double y = (lightness + 16) / 116;
    const auto linear = [](double f) {
        constexpr double kJoin = 6.0 / 29;
        return f > kJoin ? f * f * f : 3 * kJoin * kJoin * (f - 4.0 / 29);
    };
    const double X = 0.9642 * linear(y + a / 500), Y = linear(y), Z = 0.8249 * linear(y - b / 200);
    // From D50 to D65 by Bradford, then to linear sRGB (IEC 61966-2-1).
    const double rgb[] = {3.1338561 * X - 1.6168667 * Y - 0.4906146 * Z,
                          -0.9787684 * X + 1.9161415 * Y + 0.0334540 * Z,
                          0.0719453 * X - 0.2289914 * Y + 1.4052427 * Z};
    std::array<double, 3> out{};
    for (std::size_t i = 0; i < 3; ++i) {
        const double light = std::clamp(rgb[i], 0.0, 1.0);
        out[i] = light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
    }
    return out;
}

std::vector<Segment> dicom_segments(const DicomFile& file) {
    std::vector<Segment> segments;
    for (const DicomSegment& from : file.segments) {
        if (from.number < 1) continue;
        Segment to{from.number, utf8_of(from.label, file.characters), {}, {}};
        if (from.lab.size() == 3)
            to.color = srgb_of_dicom_lab({from.lab[0], from.lab[1], from.lab[2]});
        segments.push_back(std::move(to));
    }
    return segments;
}

}  // namespace edgewise::store
