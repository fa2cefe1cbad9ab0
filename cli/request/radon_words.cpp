#include "cli/request/radon_words.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "cli/request/request_options.hpp"
#include "engine/request/numbers.hpp"
#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise::cli {

void add_radon(CLI::App& app, JobOptions& o) {
    add_text(app, "--angles", o.angles,
             "rows: angles k 180/N degrees, k from 0 to N - 1; or these degrees, as 0,30,60")
        ->type_name("N|A,B,...");
    app.add_flag("--inverse", o.inverse,
                 "FILE is a sinogram: the image of it, by filtered backprojection");
    add_text(app, "--size", o.geometry.size,
             "--inverse: samples of the image; default: a square that has as many offsets")
        ->type_name("WxH|N");
    add_text(
        app, "--to", o.to,
        "sinogram: integrals along lines (default); hough: how many samples lie nearest to each")
        ->type_name("sinogram|hough");
    add_text(app, "--threshold", o.threshold, "hough: samples of at least T vote")->type_name("T");
    add_text(app, "--window", o.window,
             "what is black and white, values or percentiles; HI,LO inverts")
        ->type_name("LO,HI");
}

namespace {

constexpr int kMost = RadonSetting::kMostAngles;

void take_angles(RadonSetting& setting, const std::string& text) {
    if (text.find(',') == std::string::npos) {
        setting.angles = static_cast<int>(whole_of("--angles", text, 1, kMost));
        return;
    }
    setting.degrees = numbers_of("--angles", text);
    if (setting.degrees.size() > static_cast<std::size_t>(kMost))
        throw RequestError(fmt::format("--angles: {} of them; expected at most {}",
                                       setting.degrees.size(), kMost));
    setting.angles = static_cast<int>(setting.degrees.size());
}

void take_size(RadonSetting& setting, const std::string& text) {
    constexpr std::int64_t kSide = 1 << 20;
    const std::size_t cross = text.find_first_of("xX");
    setting.size[0] = whole_of("--size", text.substr(0, cross), 1, kSide);
    setting.size[1] = cross == std::string::npos
                          ? setting.size[0]
                          : whole_of("--size", text.substr(cross + 1), 1, kSide);
}

/// The way back.
RadonSetting image_of(const JobOptions& o) {
    if (o.to || o.threshold)
        throw RequestError("--inverse: makes an image; leave out --to and --threshold");
    RadonSetting setting;
    setting.to = RadonSetting::To::image;
    setting.angles = 0;
    if (o.angles) take_angles(setting, *o.angles);
    if (o.geometry.size) take_size(setting, *o.geometry.size);
    return setting;
}

}  // namespace

RadonSetting radon_of(const JobOptions& o) {
    if (o.inverse) return image_of(o);
    if (o.geometry.size) throw RequestError("--size: of --inverse only");
    if (!o.angles)
        throw RequestError(fmt::format(
            "--angles: how many? Expected a number from 1 to {}, or degrees as 0,30,60", kMost));
    RadonSetting setting;
    take_angles(setting, *o.angles);
    if (o.to && same_word(*o.to, "hough"))
        setting.to = RadonSetting::To::hough;
    else if (o.to && !same_word(*o.to, "sinogram"))
        throw RequestError(fmt::format("--to: '{}' is not known; {}", *o.to,
                                       instead_of(*o.to, {"sinogram", "hough"})));
    const bool votes = setting.to == RadonSetting::To::hough;
    if (votes && !o.threshold)
        throw RequestError("--threshold: from which value on does a sample vote? Expected T");
    if (!votes && o.threshold) throw RequestError("--threshold: of --to hough only");
    if (o.threshold) setting.threshold = number_of("--threshold", *o.threshold);
    return setting;
}

}  // namespace edgewise::cli
