#pragma once

#include <bit>
#include <cctype>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "tests/thesis/tables.hpp"
#include "transitions/project/counts.hpp"

namespace edgewise::thesis {

// How TABLE 33 to 37 are read: formulas in the number of samples, a row a method.

/// A formula of TABLE 33 to 37 in W, with ceil(log2(W)) as L: sums of n, n W, L, 2^L.
inline double value_of(const std::string& formula, int samples) {
    const double levels = std::bit_width(static_cast<unsigned>(samples - 1));
    double sum = 0;
    std::string text;
    for (const char c : formula)
        if (c != ' ' && c != '<') text += c;
    for (std::size_t at = 0; at < text.size();) {
        const double sign = text[at] == '-' ? -1 : 1;
        if (text[at] == '-' || text[at] == '+') ++at;
        const auto takes = [&](const std::string& word) {
            if (text.compare(at, word.size(), word) != 0) return false;
            at += word.size();
            return true;
        };
        if (takes("2^ceil(log2(W))")) {
            sum += sign * std::pow(2, levels);
        } else if (takes("ceil(log2(W))")) {
            sum += sign * levels;
        } else {
            double number = 0;
            bool digits = false;
            for (; at < text.size() && std::isdigit(text[at]); ++at, digits = true)
                number = 10 * number + (text[at] - '0');
            if (takes("W")) number = (digits ? number : 1) * samples;
            sum += sign * number;
        }
    }
    return sum;
}

inline const std::pair<const char*, Compositing> kMethods[] = {
    {"back_to_front", Compositing::back_to_front},
    {"front_to_back", Compositing::front_to_back},
    {"binary_tree", Compositing::tree_from_back},
    {"binary_tree_front_to_back", Compositing::tree_from_front},
    {"sum_of_attenuated_emittances", Compositing::sum}};

inline Compositing method(const Row& row) {
    for (const auto& [name, how] : kMethods)
        if (row.at("method") == name) return how;
    throw std::runtime_error(row.at("method"));
}

}  // namespace edgewise::thesis
