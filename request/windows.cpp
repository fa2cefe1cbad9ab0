#include "request/windows.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

#include "graph/mode.hpp"
#include "graph/words.hpp"
#include "transfer/robust_window.hpp"

namespace edgewise {
namespace {

/// Whether a volume is an MR. Only DICOM says so. Of others in a patient's space, values that are
/// never negative and no CT's are taken for one.
bool is_mr(const store::Header& header, const Data& data, const Statistics& statistics) {
    if (!header.modality.empty()) return header.modality == "MR";
    return header.anatomical && !header.labels && !header.colour && statistics.low >= 0 &&
           data.samples.data() && !glance_at(data, statistics).hounsfield;
}

}  // namespace

const std::vector<NamedWindow>& named_windows() {
    static const std::vector<NamedWindow> windows = {
        {"lung", 1500, -600}, {"bone", 1800, 400}, {"soft", 400, 40},
        {"brain", 80, 40},    {"angio", 600, 300},
    };
    return windows;
}

Window window_around(double level, double width) {
    return {{level - width / 2, false}, {level + width / 2, false}};
}

std::optional<Window> window_named(std::string_view name) {
    for (const NamedWindow& named : named_windows()) {
        if (!same_word(name, named.name)) continue;
        Window window = window_around(named.level, named.width);
        window.name = named.name;
        return window;
    }
    return std::nullopt;
}

Message take_hounsfield(Window& window, const store::Header& header, const Data& data,
                        const Statistics& statistics) {
    if (window.name.empty() || !data.samples.data()) return {};
    const std::optional<double> shift = glance_at(data, statistics).hounsfield;
    const std::string name = std::exchange(window.name, {});
    if (shift && *shift != 0) {
        window.low.at -= *shift;
        window.high.at -= *shift;
        return message(
            "@window({}): the values look like Hounsfield units plus {:g}, and are taken for that",
            name, -*shift);
    }
    if (shift || header.modality == "CT") return {};
    return message(
        "@window({}): is for Hounsfield units, and the values ({:.6g} to {:.6g}) do not look like "
        "these",
        name, statistics.low, statistics.high);
}

bool is_radiograph(const Request& want) noexcept {
    return want.job == Job::render && want.mode->light_left;
}

std::optional<Window> usual_window(const Request& want, const store::Header& header,
                                   const Data& data, const Statistics& statistics) {
    if (want.job != Job::render) return std::nullopt;
    if (is_radiograph(want)) return Window{{99.5, true}, {1, true}};
    if (want.mode->extreme > 0 && is_mr(header, data, statistics))
        return Window{{1, true}, {99.9, true}};
    return std::nullopt;
}

}  // namespace edgewise
