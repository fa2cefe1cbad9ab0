#include "settings/geometry_steps.hpp"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <fstream>
#include <utility>

#include "graph/words.hpp"
#include "settings/readers.hpp"

namespace edgewise::reads {
namespace {

using Kind = GeometryStep::Kind;

constexpr std::int64_t kMostViews = 100000;

/// "xy=0.2,xz=-1": threes of the axis that moves, the axis that moves it, and by how much.
std::vector<double> shears_of(const std::string& value) {
    std::vector<double> numbers;
    const auto axis = [](char letter) {
        return letter >= 'x' && letter <= 'z' ? letter - 'x' : -1;
    };
    for (const std::string& pair : split(lower(value), ',')) {
        const int to = pair.size() > 3 ? axis(pair[0]) : -1;
        const int by = pair.size() > 3 ? axis(pair[1]) : -1;
        if (to < 0 || by < 0 || to == by || pair[2] != '=')
            throw RequestError(message(
                "@shear: '{}' is no shear; expected two different axes and a number, as xy=0.2",
                pair));
        numbers.insert(numbers.end(),
                       {double(to), double(by), number_of(setting("shear"), pair.substr(3))});
    }
    return numbers;
}

/// The beginning of a text file. @throws RequestError where it cannot be read
std::string text_of_file(const std::string& name, std::size_t most, const Message& otherwise) {
    std::ifstream file(name, std::ios::binary);
    if (!file) throw RequestError(otherwise);
    std::string text;
    std::array<char, 65536> piece;
    while (file && text.size() < most) {
        file.read(piece.data(), std::min(piece.size(), most - text.size()));
        text.append(piece.data(), static_cast<std::size_t>(file.gcount()));
    }
    return text;
}

/// Numbers between blanks or commas, up to a comment. @param called  what messages call them
std::vector<double> numbers_in_line(const Message& called, const std::string& line) {
    const std::string words = line.substr(0, line.find('#'));
    std::vector<double> values;
    for (std::size_t at = 0; (at = words.find_first_not_of(", \t\r", at)) != std::string::npos;) {
        const std::size_t end = std::min(words.find_first_of(", \t\r", at), words.size());
        values.push_back(number_of(called, words.substr(at, end - at)));
        at = end;
    }
    return values;
}

std::vector<double> numbers_in_file(const std::string& name) {
    const std::string text = text_of_file(
        name, 65536,
        message("@matrix: '{}' is neither a list of 4, 6, 9, 12 or 16 numbers nor a file", name));
    std::vector<double> values;
    for (const std::string& line : split(text, '\n'))
        for (const double value : numbers_in_line(setting("matrix", name), line))
            values.push_back(value);
    return values;
}

std::vector<double> matrix_of(const std::string& value) {
    const bool list = value.find_first_not_of("0123456789+-.,eEinfaINFA ") == std::string::npos &&
                      value.find(',') != std::string::npos;
    return list ? numbers_of(setting("matrix"), value) : numbers_in_file(value);
}

/// The matrices of a path's file: one a line, or one between blank lines.
class PathFile {
 public:
    explicit PathFile(const std::string& name) : name_(name) {
        constexpr std::size_t kMost = 64 << 20;
        const std::string text =
            text_of_file(name, kMost, message("@path({}): cannot be read", name));
        if (text.size() == kMost)
            throw RequestError(
                message("@path({}): is {} bytes long or longer; a path is shorter", name, kMost));
        std::size_t number = 0;
        for (const std::string& line : split(text, '\n')) {
            const Message called = message("@path({}): line {}", name, ++number);
            if (line.find_first_not_of(" \t\r") == std::string::npos) {
                end_block();
                continue;
            }
            const std::vector<double> values = numbers_in_line(called, line);
            if (values.empty()) continue;  // a comment
            if (rows_.empty()) first_line_ = number;
            if (is_matrix(values.size())) {
                end_block();
                add(values);
            } else {
                rows_.insert(rows_.end(), values.begin(), values.end());
            }
        }
        end_block();
        if (numbers_.empty()) throw RequestError(message("@path({}): has no matrix", name));
    }

    /// Sixteen a view.
    std::vector<double> take() && { return std::move(numbers_); }

 private:
    static bool is_matrix(std::size_t count) { return count == 9 || count == 12 || count == 16; }

    void end_block() {
        if (rows_.empty()) return;
        if (!is_matrix(rows_.size()))
            throw RequestError(
                message("@path({}): {} numbers from line {} on; expected a matrix of 3x3, 3x4 or "
                        "4x4 in a line or between blank lines",
                        name_, rows_.size(), first_line_));
        add(rows_);
        rows_.clear();
    }

    void add(const std::vector<double>& values) {
        const std::size_t columns = values.size() == 9 ? 3 : 4;
        std::array<double, 16> matrix{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        for (std::size_t i = 0; i < values.size(); ++i)
            matrix[i / columns * 4 + i % columns] = values[i];
        numbers_.insert(numbers_.end(), matrix.begin(), matrix.end());
    }

    std::string name_;
    std::vector<double> rows_, numbers_;  // rows: of the block so far
    std::size_t first_line_ = 0;
};

std::vector<double> turntable_of(const std::string& value) {
    const std::vector<std::string> words = split(value, ',');
    if (words.size() > 2)
        throw RequestError(message("@turntable: '{}' given; expected N or N,ARC", value));
    std::vector<double> numbers{double(whole_of(setting("turntable"), words[0], 1, kMostViews))};
    if (words.size() == 2) numbers.push_back(number_of(setting("turntable"), words[1]));
    return numbers;
}

/// A program's own numbers, so many at a time.
std::vector<double> in_groups(const SettingValue& value, const Message& called, std::size_t of) {
    std::vector<double> all = numbers(value, called);
    if (all.empty() || all.size() % of != 0)
        throw RequestError(
            message("{}: {} numbers given; expected {} of each", called, all.size(), of));
    return all;
}

std::vector<double> numbers_of_step(Kind kind, const SettingValue& value, const Message& called) {
    switch (kind) {
        case Kind::turntable:
            return turntable_of(value.text());
        case Kind::shear:
            return value.is_text() ? shears_of(value.text()) : in_groups(value, called, 3);
        case Kind::path:
            return value.is_list() ? in_groups(value, called, 16) : PathFile(value.text()).take();
        case Kind::matrix:
            return value.is_list() ? numbers(value, called) : matrix_of(value.text());
        default:
            return numbers(value, called);
    }
}

}  // namespace

Reader step(GeometryStep::Kind kind) {
    Reader reader;
    reader.kind = Reader::Kind::step;
    reader.take = [kind](Query& query, const SettingValue& value, const Reading& reading) {
        query.geometry.steps.push_back({kind, numbers_of_step(kind, value, reading.called())});
    };
    return reader;
}

}  // namespace edgewise::reads
