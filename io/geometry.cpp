#include "io/geometry.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {
// A direction matrix of unit columns spans at least this: axes 0.06 degrees from a common plane are
// a mistake, not a geometry.
constexpr double kLeastDeterminant = 1e-3;
constexpr double kOneAxis = 1e-6;
// What a spacing may be off by when it comes from f32: an entry of a column is rounded by 2^-24 of
// itself where it is stored, so is the length of the column, and entries that were products of a
// rotation and a spacing in f32 have been rounded three times more.
constexpr double kNoise = 4 * 0x1p-24;

bool alike(double a, double b) { return std::abs(a - b) <= 2 * kNoise * std::max(a, b); }
}  // namespace

double without_noise(double length) noexcept {
    if (!(length > 0) || !std::isfinite(length)) return length;
    // The digits that f32 keeps of any decimal number (FLT_DIG).
    const double decimal = std::strtod(fmt::format("{:.6g}", length).c_str(), nullptr);
    return std::abs(decimal - length) <= kNoise * length ? decimal : length;
}

double dot(const Vector& a, const Vector& b) noexcept {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
double length(const Vector& v) noexcept { return std::sqrt(dot(v, v)); }
Vector cross(const Vector& a, const Vector& b) noexcept {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double determinant(const std::array<Vector, 3>& columns) noexcept {
    return dot(cross(columns[0], columns[1]), columns[2]);
}

void check_spacing(const Header& header, const std::string& field) {
    for (double step : header.spacing)
        if (!(std::isfinite(step) && step > 0))
            refuse(header.file,
                   fmt::format("field '{}': spacing {} is not a positive number", field, step));
    for (double at : header.origin)
        if (!std::isfinite(at))
            refuse(header.file, fmt::format("field '{}': origin {} is not finite", field, at));
}

void take_steps(Header& header, const std::array<Vector, 3>& steps, const std::string& field) {
    for (int axis = 0; axis < 3; ++axis) {
        for (double entry : steps[axis])
            if (!std::isfinite(entry))
                refuse(header.file, fmt::format("field '{}' holds {}", field, entry));
        header.spacing[axis] = length(steps[axis]);
        if (!(header.spacing[axis] > 0) || !std::isfinite(header.spacing[axis]))
            refuse(header.file, fmt::format("field '{}': axis {} has length {}", field, axis,
                                            header.spacing[axis]));
        for (int row = 0; row < 3; ++row)
            header.direction[axis][row] = steps[axis][row] / header.spacing[axis];
    }
    // What f32 cannot tell apart is one spacing: else a turn by 90 degrees is no copy of samples,
    // and lengths need a sample more.
    for (int axis = 0; axis < 3; ++axis) {
        header.spacing[axis] = without_noise(header.spacing[axis]);
        for (int other = axis - 1; other >= 0; --other)
            if (alike(header.spacing[axis], header.spacing[other]))
                header.spacing[axis] = header.spacing[other];
    }
    if (std::abs(determinant(header.direction)) < kLeastDeterminant)
        refuse(header.file,
               fmt::format("field '{}': the axes lie in one plane (determinant {:.3g})", field,
                           determinant(header.direction)));
}

void flip_xy(Header& header) noexcept {
    for (int row = 0; row < 2; ++row) {
        header.origin[row] = 0 - header.origin[row];
        for (Vector& column : header.direction) column[row] = 0 - column[row];
    }
}

bool is_identity(const std::array<Vector, 3>& direction) noexcept {
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            if (std::abs(direction[column][row] - (row == column)) > kOneAxis) return false;
    return true;
}

std::string letters_of(const std::array<Vector, 3>& direction) {
    // Each anatomical axis is used once, the clearest match first, so oblique scans get three
    // letters.
    std::string letters = "???";
    bool column_done[3] = {}, row_done[3] = {};
    for (int round = 0; round < 3; ++round) {
        int column = -1, row = -1;
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r)
                if (!column_done[c] && !row_done[r] &&
                    (column < 0 ||
                     std::abs(direction[c][r]) > std::abs(direction[column][row]) + kOneAxis))
                    column = c, row = r;
        column_done[column] = row_done[row] = true;
        letters[static_cast<std::size_t>(column)] =
            (direction[column][row] > 0 ? "LPS" : "RAI")[row];
    }
    return letters;
}

std::optional<std::array<Vector, 3>> direction_of(const std::string& letters) {
    if (letters.size() != 3) return std::nullopt;
    std::array<Vector, 3> direction{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const char letter =
            static_cast<char>(std::toupper(static_cast<unsigned char>(letters[axis])));
        const auto plus = std::string_view("LPS").find(letter);
        const auto minus = std::string_view("RAI").find(letter);
        if (plus == std::string_view::npos && minus == std::string_view::npos) return std::nullopt;
        direction[axis][std::min(plus, minus)] = plus < 3 ? 1 : -1;
    }
    if (std::abs(determinant(direction)) < 0.5) return std::nullopt;
    return direction;
}

bool complete_steps(std::array<Vector, 3>& steps, const Extent& extent) noexcept {
    bool missing = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (extent[static_cast<int>(axis)] > 1 || dot(steps[axis], steps[axis]) != 0) continue;
        missing = true;
        const Vector& a = steps[(axis + 1) % 3];
        const Vector& b = steps[(axis + 2) % 3];
        Vector normal = cross(a, b);
        // Two axes are missing: any direction across the third.
        if (length(normal) == 0) {
            const Vector& there = length(a) > 0 ? a : b;
            std::size_t least = 0;
            for (std::size_t i = 1; i < 3; ++i)
                if (std::abs(there[i]) < std::abs(there[least])) least = i;
            Vector across{0, 0, 0};
            across[least] = 1;
            normal = length(there) > 0 ? cross(there, across) : across;
        }
        const double size = length(normal);
        for (std::size_t i = 0; i < 3; ++i) steps[axis][i] = normal[i] / size;
    }
    return missing;
}

double millimetres(std::string_view unit) {
    struct Row {
        std::string_view name;
        double factor;
    };
    // Signs of micro: U+00B5, U+03BC, Latin-1, and as ImageJ escapes the first.
    constexpr Row kUnits[] = {{"mm", 1},
                              {"millimeter", 1},
                              {"millimetre", 1},
                              {"um", 1e-3},
                              {"\xc2\xb5m", 1e-3},
                              {"\xce\xbcm", 1e-3},
                              {"\xb5m", 1e-3},
                              {"\\u00b5m", 1e-3},
                              {"micron", 1e-3},
                              {"micrometer", 1e-3},
                              {"micrometre", 1e-3},
                              {"cm", 10},
                              {"centimeter", 10},
                              {"centimetre", 10},
                              {"m", 1000},
                              {"meter", 1000},
                              {"metre", 1000},
                              {"nm", 1e-6},
                              {"nanometer", 1e-6},
                              {"nanometre", 1e-6},
                              {"picometer", 1e-9},
                              {"picometre", 1e-9},
                              {"decimeter", 100},
                              {"kilometer", 1e6},
                              {"\xc3\x85", 1e-7},
                              {"\xe2\x84\xab", 1e-7},
                              {"angstrom", 1e-7},
                              {"inch", 25.4},
                              {"inche", 25.4},
                              {"in", 25.4}};
    std::string name(trim(unit));
    if (name == "A") return 1e-7;
    // "Mm" is a million metres, and nobody's voxel.
    name = lower(name);
    if (name.size() > 3 && name.ends_with('s')) name.pop_back();
    for (const Row& row : kUnits)
        if (row.name == name) return row.factor;
    return 0;
}

void to_millimetres(Header& header, double factor) noexcept {
    header.unit = "mm";
    header.file_unit = factor;
    for (double& step : header.spacing) step *= factor;
    for (double& at : header.origin) at *= factor;
}

void override_spacing(Header& header, const Selection& pick) {
    if (!pick.unit.empty()) {
        const double factor = millimetres(pick.unit);
        if (factor == 0)
            throw RequestError(
                message("@input_unit {}: expected mm, um or nm (or cm, m, inch, angstrom)",
                        in_quotes(pick.unit)));
        to_millimetres(header, factor / header.file_unit);
        header.file_unit = factor;
    }
    if (pick.spacing.empty()) return;
    const std::size_t axes = header.volume ? 3 : 2, count = pick.spacing.size();
    if (count != 1 && count != axes)
        throw RequestError(message("@input_spacing: {} numbers for {} of {} axes; expected 1 or {}",
                                   count, header.volume ? "a volume" : "an image", axes, axes));
    const double factor = pick.unit.empty() ? 1 : header.file_unit;
    for (std::size_t axis = 0; axis < axes; ++axis) {
        const double step = pick.spacing[count == 1 ? 0 : axis] * factor;
        if (!(std::isfinite(step) && step > 0))
            throw RequestError(message("@input_spacing({}): expected a positive number",
                                       pick.spacing[count == 1 ? 0 : axis]));
        header.spacing[axis] = step;
    }
}

}  // namespace edgewise::store
