#pragma once

#include <sstream>
#include <string>
#include <vector>

/// Of a list with commas, as arguments have it.
inline std::vector<double> numbers_of(const std::string& list) {
    std::istringstream words(list);
    std::vector<double> numbers;
    for (std::string word; std::getline(words, word, ',');) numbers.push_back(std::stod(word));
    return numbers;
}
