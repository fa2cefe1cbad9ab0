#include "presentation/colormap.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

#include "graph/errors.hpp"
#include "graph/words.hpp"
#include "io/file.hpp"
#include "io/text.hpp"
#include "transfer/load.hpp"

namespace edgewise {
namespace {

#include "presentation/colormap_tables.inc"

using Colour = Colormap::Colour;

/// Points of one colour part: shares and values, linear between.
using Part = std::vector<std::array<double, 2>>;

double part_at(const Part& part, double share) noexcept {
    for (std::size_t i = 1; i < part.size(); ++i)
        if (share <= part[i][0] && part[i - 1][0] < part[i][0])
            return part[i - 1][1] + (share - part[i - 1][0]) / (part[i][0] - part[i - 1][0]) *
                                        (part[i][1] - part[i - 1][1]);
    return part.back()[1];
}

/// @param parts  red, green, blue
std::vector<Colour> rows_of(const std::array<Part, 3>& parts) {
    constexpr int kRows = 256;
    std::vector<Colour> rows(kRows);
    for (int i = 0; i < kRows; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            rows[static_cast<std::size_t>(i)][c] = part_at(parts[c], double(i) / (kRows - 1));
    return rows;
}

std::vector<Colour> rows_of(std::string_view digits) {
    const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
    std::vector<Colour> rows(digits.size() / 6);
    for (std::size_t i = 0; i < rows.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const std::size_t at = 6 * i + 2 * c;
            rows[i][c] = (16 * digit(digits[at]) + digit(digits[at + 1])) / 255.0;
        }
    return rows;
}

struct Named {
    const char* name;
    std::vector<Colour> (*rows)();
};

// hot and jet: matplotlib's segments (_cm.py), which are those of MATLAB.
constexpr Named kNamed[] = {
    {"grey",
     [] {
         return std::vector<Colour>{{0, 0, 0}, {1, 1, 1}};
     }},
    {"viridis", [] { return rows_of(kViridis); }},
    {"magma", [] { return rows_of(kMagma); }},
    {"inferno", [] { return rows_of(kInferno); }},
    {"plasma", [] { return rows_of(kPlasma); }},
    {"hot",
     [] {
         return rows_of({Part{{0, 0.0416}, {0.365079, 1}, {1, 1}},
                         {{0, 0}, {0.365079, 0}, {0.746032, 1}, {1, 1}},
                         {{0, 0}, {0.746032, 0}, {1, 1}}});
     }},
    {"jet",
     [] {
         return rows_of({Part{{0, 0}, {0.35, 0}, {0.66, 1}, {0.89, 1}, {1, 0.5}},
                         {{0, 0}, {0.125, 0}, {0.375, 1}, {0.64, 1}, {0.91, 0}, {1, 0}},
                         {{0, 0.5}, {0.11, 1}, {0.34, 1}, {0.65, 0}, {1, 0}}});
     }},
    {"hue",
     [] {
         return std::vector<Colour>{{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}};
     }},
};

[[noreturn]] void refuse(const std::string& file, const std::string& why) {
    throw RequestError(message("@colormap({}): {}", file, why));
}

constexpr std::size_t kMostRows = 1 << 16;

/// Rows as they are read: all from 0 to 1, or from 0 to 255.
std::vector<Colour> scaled(std::vector<Colour> rows, const std::string& file) {
    if (rows.size() < 2) refuse(file, fmt::format("{} rows; expected at least 2", rows.size()));
    double most = 0;
    for (const Colour& row : rows)
        for (const double part : row) {
            if (!(part >= 0 && part <= 255))
                refuse(file, fmt::format("{} is not from 0 to 1, or from 0 to 255", part));
            most = std::max(most, part);
        }
    if (most > 1)
        for (Colour& row : rows)
            for (double& part : row) part /= 255;
    return rows;
}

std::vector<Colour> lines_of(const std::string& text, const std::string& file) {
    std::vector<Colour> rows;
    std::size_t line_number = 0;
    for (std::string_view rest = text; !rest.empty();) {
        const std::size_t end = rest.find('\n');
        std::string line(rest.substr(0, end));
        rest = end == rest.npos ? std::string_view() : rest.substr(end + 1);
        ++line_number;
        std::replace_if(
            line.begin(), line.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
        if (const std::size_t comment = line.find('#'); comment != line.npos) line.resize(comment);
        std::vector<double> numbers;
        bool words = false;
        for (const std::string_view word : store::words(line)) {
            const auto number = store::to_double(word);
            words |= !number;
            numbers.push_back(number.value_or(0));
        }
        if (numbers.empty()) continue;
        if (words && rows.empty() && line_number <= 2) continue;  // names of columns
        if (words || numbers.size() < 3 || numbers.size() > 4)
            refuse(file, fmt::format("line {}: expected red, green and blue", line_number));
        const std::size_t first = numbers.size() - 3;
        rows.push_back({numbers[first], numbers[first + 1], numbers[first + 2]});
        if (rows.size() > kMostRows) refuse(file, fmt::format("more than {} rows", kMostRows));
    }
    return scaled(std::move(rows), file);
}

/// A list of rows; nothing where the JSON is another thing.
std::vector<Colour> list_of(const std::string& text, const std::string& file) {
    const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
    if (json.is_discarded()) refuse(file, "is not JSON");
    if (!json.is_array() || json.empty() || !json[0].is_array()) return {};
    if (json.size() > kMostRows) refuse(file, fmt::format("more than {} rows", kMostRows));
    std::vector<Colour> rows;
    for (const nlohmann::json& row : json) {
        if (!row.is_array() || row.size() != 3 ||
            !std::all_of(row.begin(), row.end(), [](const auto& part) { return part.is_number(); }))
            refuse(file, fmt::format("row {}: expected three numbers", rows.size()));
        rows.push_back({row[0].get<double>(), row[1].get<double>(), row[2].get<double>()});
    }
    return scaled(std::move(rows), file);
}

/// Of a transfer function its colours, between the first point and the last.
std::vector<Colour> colours_of_transfer(const std::string& file) {
    const TransferSpec spec = load_transfer(file, "colormap");
    const auto& points = spec.transfer.points;
    if (points.size() < 2) refuse(file, "its transfer function has fewer than two points");
    const double first = points.front().value, length = points.back().value - first;
    if (!(length > 0)) refuse(file, "its transfer function has no range");
    std::array<Part, 3> parts;
    for (const auto& point : points)
        for (std::size_t c = 0; c < 3; ++c)
            parts[c].push_back({(point.value - first) / length, point.color[c]});
    return rows_of(parts);
}

/// ImageJ's: all reds, all greens, all blues.
std::vector<Colour> planes_of(const std::string& bytes) {
    std::vector<Colour> rows(256);
    for (std::size_t i = 0; i < rows.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
            rows[i][c] = static_cast<unsigned char>(bytes[256 * c + i]) / 255.0;
    return rows;
}

Colormap colormap_in(const std::string& file) {
    constexpr std::uint64_t kMostBytes = 16 << 20;
    std::string text;
    try {
        const store::File in(file);
        if (in.size() > kMostBytes) refuse(file, "is larger than any colour map");
        text.resize(static_cast<std::size_t>(in.size()));
        in.read(0, std::as_writable_bytes(std::span(text)), "rows");
    } catch (const InputError& error) {
        throw RequestError(message("@colormap: {}", error.message()));
    }
    constexpr std::size_t kPlanes = 768, kHead = 32;
    if (text.size() == kPlanes && text.find('\0') != text.npos) return Colormap(planes_of(text));
    if (text.size() == kPlanes + kHead && text.starts_with("ICOL"))
        return Colormap(planes_of(text.substr(kHead)));
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    if (first != text.npos && (text[first] == '[' || text[first] == '{')) {
        std::vector<Colour> rows = text[first] == '[' ? list_of(text, file) : std::vector<Colour>();
        return Colormap(rows.empty() ? colours_of_transfer(file) : std::move(rows));
    }
    return Colormap(lines_of(text, file));
}

}  // namespace

Colour Colormap::at(double share) const noexcept {
    const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(rows_.size() - 1);
    const std::size_t row = std::min(static_cast<std::size_t>(place), rows_.size() - 2);
    const double between = place - static_cast<double>(row);
    Colour colour;
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = rows_[row][c] + between * (rows_[row + 1][c] - rows_[row][c]);
    return colour;
}

std::array<std::uint8_t, 3> Colormap::bytes_at(double share) const noexcept {
    const Colour colour = at(share);
    std::array<std::uint8_t, 3> bytes;
    for (std::size_t c = 0; c < 3; ++c)
        bytes[c] = static_cast<std::uint8_t>(std::lround(255 * colour[c]));
    return bytes;
}

const std::vector<std::string>& colormap_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const Named& named : kNamed) all.emplace_back(named.name);
        return all;
    }();
    return names;
}

Colormap colormap_of(const std::string& name) {
    for (const Named& named : kNamed)
        if (same_word(name, named.name)) return Colormap(named.rows());
    if (same_word(name, "gray")) return Colormap();
    std::error_code none;
    if (std::filesystem::is_regular_file(name, none)) return colormap_in(name);
    throw RequestError(
        message("@colormap: '{}' is no colour map and no file; {}", name,
                instead_of(name, colormap_names(),
                           fmt::format("known are {}", fmt::join(colormap_names(), ", ")))));
}

}  // namespace edgewise
