#include "charts/words.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace edgewise::charts {
namespace {

/// A control character would end the line, and with it the command.
std::string plain(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 32; }, ' ');
    return text;
}

bool begins_character(char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }

}  // namespace

std::string quoted(const std::string& text) {
    std::string safe = "'";
    for (const char c : plain(text)) {
        if (c == '\'') safe += '\'';
        safe += c;
    }
    return safe + "'";
}

std::string double_quoted(const std::string& text) {
    std::string safe = "\"";
    for (const char c : plain(text)) {
        if (c == '"') continue;
        if (c == '\\') safe += '\\';
        safe += c;
    }
    return safe + "\"";
}

std::string shortened(const std::string& text, std::size_t most) {
    std::vector<std::size_t> begins;
    for (std::size_t i = 0; i < text.size(); ++i)
        if (begins_character(text[i])) begins.push_back(i);
    if (begins.size() <= most) return text;
    const std::size_t head = most * 2 / 3, tail = most - head - 1;
    return text.substr(0, begins[head]) + "…" + text.substr(begins[begins.size() - tail]);
}

std::string head_of(Picture picture, int width, int height) {
    const char* font = "DejaVu Sans,12";
    std::string text = "set encoding utf8\n";
    if (picture == Picture::svg)
        text += fmt::format("set terminal svg size {},{} font '{}' background '#ffffff'\n", width,
                            height, font);
    else
        text += fmt::format("set terminal pngcairo size {},{} font '{}' background '#ffffff'\n",
                            width, height, font);
    return text +
           "set border 3 lc rgb '#444444'\nset grid lc rgb '#e4e4e4' lt 1 lw 0.5\n"
           "set style textbox opaque noborder margins 0.3,0.2 fillcolor rgb '#ffffff'\n"
           "set tics nomirror\n";
}

}  // namespace edgewise::charts
