#include "cli/request/geometry_words.hpp"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <fstream>
#include <utility>

#include "engine/request/numbers.hpp"
#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise::cli {
namespace {

constexpr std::int64_t kMostViews = 100000, kMostSamplesAnAxis = 2147483647;

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
            throw RequestError(fmt::format(
                "--shear: '{}' is no shear; expected two different axes and a number, as xy=0.2",
                pair));
        numbers.insert(numbers.end(),
                       {double(to), double(by), number_of("--shear", pair.substr(3))});
    }
    return numbers;
}

/// The beginning of a text file. @throws RequestError where it cannot be read
std::string text_of_file(const std::string& name, std::size_t most, const std::string& otherwise) {
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

/// Numbers between blanks or commas, up to a comment. @param option  what messages call them
std::vector<double> numbers_in_line(const std::string& option, const std::string& line) {
    const std::string words = line.substr(0, line.find('#'));
    std::vector<double> values;
    for (std::size_t at = 0; (at = words.find_first_not_of(", \t\r", at)) != std::string::npos;) {
        const std::size_t end = std::min(words.find_first_of(", \t\r", at), words.size());
        values.push_back(number_of(option, words.substr(at, end - at)));
        at = end;
    }
    return values;
}

std::vector<double> numbers_in_file(const std::string& name) {
    const std::string text = text_of_file(
        name, 65536,
        fmt::format("--matrix: '{}' is neither a list of 4, 6, 9, 12 or 16 numbers nor a file",
                    name));
    std::vector<double> values;
    for (const std::string& line : split(text, '\n'))
        for (const double value : numbers_in_line("--matrix " + name, line))
            values.push_back(value);
    return values;
}

std::vector<double> matrix_of(const std::string& value) {
    const bool list = value.find_first_not_of("0123456789+-.,eEinfaINFA ") == std::string::npos &&
                      value.find(',') != std::string::npos;
    return list ? numbers_of("--matrix", value) : numbers_in_file(value);
}

/// The matrices of --path: one a line, or one between blank lines.
class PathFile {
 public:
    explicit PathFile(const std::string& name) : name_(name) {
        constexpr std::size_t kMost = 64 << 20;
        const std::string text =
            text_of_file(name, kMost, fmt::format("--path {}: cannot be read", name));
        if (text.size() == kMost)
            throw RequestError(fmt::format(
                "--path {}: is {} bytes long or longer; a path is shorter", name, kMost));
        std::size_t number = 0;
        for (const std::string& line : split(text, '\n')) {
            const std::string option = fmt::format("--path {}: line {}", name, ++number);
            if (line.find_first_not_of(" \t\r") == std::string::npos) {
                end_block();
                continue;
            }
            const std::vector<double> values = numbers_in_line(option, line);
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
        if (numbers_.empty()) throw RequestError(fmt::format("--path {}: has no matrix", name));
    }

    /// Sixteen a view.
    std::vector<double> take() && { return std::move(numbers_); }

 private:
    static bool is_matrix(std::size_t count) { return count == 9 || count == 12 || count == 16; }

    void end_block() {
        if (rows_.empty()) return;
        if (!is_matrix(rows_.size()))
            throw RequestError(fmt::format(
                "--path {}: {} numbers from line {} on; expected a matrix of 3x3, 3x4 or 4x4 in a "
                "line or between blank lines",
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
        throw RequestError(fmt::format("--turntable: '{}' given; expected N or N,ARC", value));
    std::vector<double> numbers{double(whole_of("--turntable", words[0], 1, kMostViews))};
    if (words.size() == 2) numbers.push_back(number_of("--turntable", words[1]));
    return numbers;
}

GeometryStep step_of(const std::string& name, const std::string& value) {
    using Kind = GeometryStep::Kind;
    if (name == "rotate") return {Kind::rotate, numbers_of("--rotate", value)};
    if (name == "matrix") return {Kind::matrix, matrix_of(value)};
    if (name == "scale") return {Kind::scale, numbers_of("--scale", value)};
    if (name == "translate") return {Kind::translate, numbers_of("--translate", value)};
    if (name == "shear") return {Kind::shear, shears_of(value)};
    if (name == "turntable") return {Kind::turntable, turntable_of(value)};
    if (name == "path") return {Kind::path, PathFile(value).take()};
    throw RequestError(fmt::format("--{}: is no step of the geometry", name));
}

OutputSize size_of(const std::string& text) {
    if (same_word(text, "fit")) return {.fit = true};
    if (same_word(text, "native")) return {.native = true};
    OutputSize size;
    for (const std::string& word : split(lower(text), 'x'))
        size.sides.push_back(whole_of("--size", word, 1, kMostSamplesAnAxis));
    return size;
}

/// So many numbers, as `expected` says.
template <std::size_t count>
std::array<double, count> exactly(const std::string& option, const std::string& text,
                                  const char* expected) {
    const std::vector<double> numbers = numbers_of(option, text);
    if (numbers.size() != count)
        throw RequestError(fmt::format("{}: '{}' given; expected {}", option, text, expected));
    std::array<double, count> values;
    std::copy(numbers.begin(), numbers.end(), values.begin());
    return values;
}

bool moves_grid(const std::string& word) {
    if (!same_word(word, "grid") && !same_word(word, "content"))
        throw RequestError(fmt::format("--move: '{}' is neither content nor grid", word));
    return same_word(word, "grid");
}

}  // namespace

GeometrySpec geometry_spec(const GeometryWords& words) {
    GeometrySpec spec;
    spec.view = words.view;
    if (words.about) spec.about = numbers_of("--about", *words.about);
    for (const auto& [name, value] : words.steps) spec.steps.push_back(step_of(name, value));
    if (words.perspective) spec.perspective = number_of("--perspective", *words.perspective);
    if (words.eye) spec.eye = exactly<3>("--eye", *words.eye, "X,Y,Z");
    if (words.look_at) spec.look_at = exactly<3>("--look-at", *words.look_at, "X,Y,Z");
    if (words.zoom) spec.zoom = number_of("--zoom", *words.zoom);
    if (words.move) spec.grid_moves = moves_grid(*words.move);
    if (words.spacing) spec.spacing = numbers_of("--spacing", *words.spacing);
    if (words.size) spec.size = size_of(*words.size);
    return spec;
}

ClipSpec clip_spec(const GeometryWords& words) {
    ClipSpec clip;
    if (words.clip) clip.box = exactly<6>("--clip", *words.clip, "X0,Y0,Z0,X1,Y1,Z1");
    for (const std::string& text : words.clip_planes)
        clip.planes.push_back(exactly<4>("--clip-plane", text, "A,B,C,D"));
    for (const std::string& text : words.clip_balls)
        clip.balls.push_back(exactly<4>("--clip-ball", text, "X,Y,Z,R"));
    if (words.slab) clip.slab = number_of("--slab", *words.slab);
    return clip;
}

}  // namespace edgewise::cli
