#include "cli/request/radon_words.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "cli/request/request_options.hpp"
#include "engine/request/numbers.hpp"
#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise::cli {

void add_radon(CLI::App& app, JobOptions& o) {
    add_text(app, "--angles", o.angles, "rows: angles k 180/N degrees, k from 0 to N - 1")
        ->type_name("N");
    add_text(
        app, "--to", o.to,
        "sinogram: integrals along lines (default); hough: how many samples lie nearest to each")
        ->type_name("sinogram|hough");
    add_text(app, "--threshold", o.threshold, "hough: samples of at least T vote")->type_name("T");
    add_text(app, "--window", o.window, "what is black and white, values or percentiles")
        ->type_name("LO,HI");
}

RadonSetting radon_of(const JobOptions& o) {
    constexpr int kMost = RadonSetting::kMostAngles;
    if (!o.angles)
        throw RequestError(
            fmt::format("--angles: how many? Expected a number from 1 to {}", kMost));
    RadonSetting setting;
    setting.angles = static_cast<int>(whole_of("--angles", *o.angles, 1, kMost));
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
