#include "request/outputs.hpp"

#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <span>
#include <unistd.h>
#include <vector>

#include "graph/errors.hpp"
#include "graph/kinds.hpp"
#include "graph/words.hpp"
#include "io/animation.hpp"
#include "io/file.hpp"
#include "io/surface_file.hpp"
#include "request/numbers.hpp"

namespace edgewise {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const Message& where, const Message& what) {
    throw RequestError(message("{}: {}", where, what));
}

std::string writable_endings() {
    std::vector<std::string> endings;
    for (const store::Format& format : store::formats())
        if (format.writes)
            endings.insert(endings.end(), format.endings.begin(), format.endings.end());
    return fmt::format("{}", fmt::join(endings, " "));
}

/// @param where  what messages call the file
void expect_place(const Message& where, const std::string& file) {
    std::error_code none;
    fs::path folder = fs::path(file).parent_path();
    if (folder.empty()) folder = ".";
    if (!fs::is_directory(folder, none))
        refuse(where, fmt::format("there is no folder '{}'", folder.string()));
    if (::access(folder.c_str(), W_OK | X_OK) != 0)
        refuse(where, fmt::format("the folder '{}' cannot be written", folder.string()));
    if (fs::is_directory(file, none)) refuse(where, "is a folder; expected a file");
}

}  // namespace

void expect_writable(const Message& option, const std::string& file) {
    expect_place(message("{} {}", option, file), file);
}

Outputs::Outputs(const std::string& pattern, Holds holds, const std::string& encoder)
    : pattern_(pattern), encoder_(encoder) {
    none_ = lower(pattern) == "null:";
    if (none_) return;
    if (pattern == "-" && holds == Holds::surface)
        refuse(setting("out", pattern),
               "standard output takes pictures; expected .ply, .obj or .stl");
    if (pattern == "-") {
        before_ = pattern;
        format_ = store::format_of(pattern);
        return;
    }
    std::string* part = &before_;
    for (std::size_t i = 0; i < pattern.size(); ++i) {
        if (pattern[i] != '%') {
            *part += pattern[i];
            continue;
        }
        std::size_t end = i + 1;
        while (end < pattern.size() && pattern[end] >= '0' && pattern[end] <= '9') ++end;
        const std::string width = pattern.substr(i + 1, end - i - 1);
        const char kind = end < pattern.size() ? pattern[end] : '\0';
        if (kind == '%' && width.empty()) {
            *part += '%';
        } else if (kind == 'd' && !numbered_ && width.size() <= 3) {
            numbered_ = true;
            part = &after_;
            fill_ = width.starts_with('0') ? '0' : ' ';
            digits_ = width.empty() ? 0 : std::stoi(width);
        } else {
            refuse(setting("out", pattern),
                   "one %d or %04d may stand for the frame number; %% is a percent "
                   "sign");
        }
        i = end;
    }
    if (holds == Holds::surface) {
        if (!store::surface_format_of(file(0)))
            refuse(setting("out", pattern), "surfaces are written as .ply, .obj or .stl");
        expect_place(setting("out", file(0)), file(0));
        return;
    }
    format_ = store::format_of(file(0));
    if (!format_ && store::surface_format_of(file(0)))
        refuse(setting("out", pattern), message("holds surfaces; `@command(mesh)` writes them"));
    if (!format_ || !format_->writes)
        refuse(setting("out", pattern),
               fmt::format("{}; known endings: {}",
                           format_ ? format_->name + " is only read, not written"
                                   : std::string("no format has this ending"),
                           writable_endings()));
    if (const std::string why = store::no_encoder(file(0), encoder_); !why.empty())
        refuse(setting("out", pattern), why);
    expect_place(setting("out", file(0)), file(0));
}

std::string Outputs::file(int frame) const {
    if (!numbered_) return before_;
    std::string number = std::to_string(frame);
    if (number.size() < static_cast<std::size_t>(digits_))
        number.insert(0, static_cast<std::size_t>(digits_) - number.size(), fill_);
    return before_ + number + after_;
}

void Outputs::expect_frames(int frames) const {
    if (frames > 1 && pattern_ == "-")
        refuse(setting("out", pattern_),
               "standard output takes one picture, and there are several frames");
    if (frames > 1 && !none() && !numbered_ && !animates(frames))
        refuse(
            setting("out", pattern_),
            fmt::format("{} frames need a number in the name, as {}_%03d{}, or an animation, "
                        "{}.gif, .apng or .mp4",
                        frames, fs::path(before_).stem().string(),
                        fs::path(before_).extension().string(), fs::path(before_).stem().string()));
}

std::optional<Outputs> outputs_of(const Query& query) {
    if (!query.out) return {};
    const auto holds = makes_surface(query.job) ? Outputs::Holds::surface : Outputs::Holds::samples;
    return Outputs(*query.out, holds, query.film_encoder);
}

void write_text(const std::string& file, const std::string& text) {
    if (file == "-") {
        const bool whole = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
        if (std::fflush(stdout) != 0 || !whole) throw RunError("standard output cannot be written");
        return;
    }
    store::Replacement replacement(file);
    replacement.write(std::as_bytes(std::span(text)));
    replacement.commit();
}

}  // namespace edgewise
