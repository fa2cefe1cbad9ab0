#include "io/data_list.hpp"

#include <fmt/format.h>

#include "io/file.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::int64_t kMostFiles = 1 << 20;
constexpr std::int64_t kWidest = 20;
constexpr std::uint64_t kLongestHeader = 16 << 20;

struct Pattern {
    std::string before, after;
    int width = 0;
};

Pattern pattern_of(const std::string& header, std::string_view text) {
    const auto percent = text.find('%');
    const auto end =
        percent == text.npos ? text.npos : text.find_first_not_of("0123456789", percent + 1);
    const bool one = end != text.npos && text[end] == 'd' && text.find('%', end) == text.npos;
    const std::string_view digits = one ? text.substr(percent + 1, end - percent - 1) : "";
    const auto width = digits.empty() ? 0 : to_integer(digits).value_or(kWidest + 1);
    if (!one || width > kWidest || (width > 0 && digits[0] != '0'))
        refuse(header, "its data files '" + shown(text) + "' need exactly one %d or %0Nd");
    return {std::string(text.substr(0, percent)), std::string(text.substr(end + 1)),
            static_cast<int>(width)};
}

}  // namespace

std::vector<std::string> numbered_files(const std::string& header, std::string_view text,
                                        std::int64_t first, std::int64_t last, std::int64_t step) {
    const Pattern pattern = pattern_of(header, text);
    if (step == 0 || first < 0 || last < 0 || (last - first) / step < 0 ||
        (last - first) / step >= kMostFiles)
        refuse(header,
               fmt::format("its data files are numbered {} to {} by {}", first, last, step));
    std::vector<std::string> files;
    for (std::int64_t i = 0; i <= (last - first) / step; ++i)
        files.push_back(beside(header, fmt::format("{}{:0{}}{}", pattern.before, first + i * step,
                                                   pattern.width, pattern.after)));
    return files;
}

HeaderText header_text(const File& file, std::string_view last) {
    HeaderText text;
    std::string line;
    Bytes chunk(1 << 16);
    for (std::uint64_t at = 0; at < file.size();) {
        if (at > kLongestHeader)
            refuse(file.path(), fmt::format("header longer than {} bytes", kLongestHeader));
        const std::size_t got = file.read_some(at, chunk);
        if (got == 0) break;
        for (std::size_t i = 0; i < got; ++i) {
            const char c = static_cast<char>(chunk[i]);
            if (c != '\n') {
                line += c;
                continue;
            }
            if (line.ends_with('\r')) line.pop_back();
            text.end = at + i + 1;
            text.terminated = last.empty() ? line.empty() : trim(line).starts_with(last);
            if (text.terminated && last.empty()) return text;
            text.lines.push_back(std::move(line));
            line.clear();
            if (text.terminated) return text;
        }
        at += got;
    }
    text.end = file.size();
    if (!line.empty()) {
        text.terminated = !last.empty() && trim(line).starts_with(last);
        text.lines.push_back(std::move(line));
    }
    return text;
}

}  // namespace edgewise::store
