#include "cli/request/geometry_words.hpp"

#include <fmt/format.h>
#include <fstream>

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

std::vector<double> numbers_in_file(const std::string& name) {
    std::ifstream file(name, std::ios::binary);
    if (!file)
        throw RequestError(fmt::format(
            "--matrix: '{}' is neither a list of 4, 6, 9, 12 or 16 numbers nor a file", name));
    std::string text(65536, ' '), words;
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    for (const std::string& line : split(text, '\n')) words += line.substr(0, line.find('#')) + ' ';
    std::vector<double> values;
    for (std::size_t at = 0; (at = words.find_first_not_of(", \t\r\n", at)) != std::string::npos;) {
        const std::size_t end = std::min(words.find_first_of(", \t\r\n", at), words.size());
        values.push_back(number_of("--matrix " + name, words.substr(at, end - at)));
        at = end;
    }
    return values;
}

std::vector<double> matrix_of(const std::string& value) {
    const bool list = value.find_first_not_of("0123456789+-.,eEinfaINFA ") == std::string::npos &&
                      value.find(',') != std::string::npos;
    return list ? numbers_of("--matrix", value) : numbers_in_file(value);
}

GeometryStep step_of(const std::string& name, const std::string& value) {
    using Kind = GeometryStep::Kind;
    if (name == "rotate") return {Kind::rotate, numbers_of("--rotate", value)};
    if (name == "matrix") return {Kind::matrix, matrix_of(value)};
    if (name == "scale") return {Kind::scale, numbers_of("--scale", value)};
    if (name == "translate") return {Kind::translate, numbers_of("--translate", value)};
    if (name == "shear") return {Kind::shear, shears_of(value)};
    if (name == "turntable")
        return {Kind::turntable, {double(whole_of("--turntable", value, 1, kMostViews))}};
    throw RequestError(fmt::format("--{}: is no step of the geometry", name));
}

OutputSize size_of(const std::string& text) {
    if (same_word(text, "fit")) return {.fit = true, .sides = {}};
    OutputSize size;
    for (const std::string& word : split(lower(text), 'x'))
        size.sides.push_back(whole_of("--size", word, 1, kMostSamplesAnAxis));
    return size;
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
    if (words.zoom) spec.zoom = number_of("--zoom", *words.zoom);
    if (words.move) spec.grid_moves = moves_grid(*words.move);
    if (words.spacing) spec.spacing = numbers_of("--spacing", *words.spacing);
    if (words.size) spec.size = size_of(*words.size);
    return spec;
}

}  // namespace edgewise::cli
