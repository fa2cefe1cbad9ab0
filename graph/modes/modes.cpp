#include <algorithm>
#include <cmath>
#include <limits>

#include "graph/errors.hpp"
#include "graph/mode.hpp"
#include "graph/modes/binary.hpp"
#include "graph/modes/composite.hpp"
#include "graph/modes/drr.hpp"
#include "graph/modes/mean.hpp"
#include "graph/modes/minip.hpp"
#include "graph/modes/mip.hpp"
#include "graph/modes/stddev.hpp"
#include "graph/modes/surface.hpp"
#include "graph/modes/top2.hpp"
#include "graph/modes/xray.hpp"
#include "graph/request.hpp"
#include "graph/words.hpp"

namespace edgewise {

const std::vector<Mode>& modes() {
    static const std::vector<Mode> all = {
        Mode(mip_mode),    Mode(xray_mode),   Mode(mean_mode), Mode(composite_mode),
        Mode(minip_mode),  Mode(stddev_mode), Mode(top2_mode), Mode(surface_mode),
        Mode(binary_mode), Mode(drr_mode),
    };
    return all;
}

constinit const Mode Mode::mip(mip_mode);
constinit const Mode Mode::xray(xray_mode);
constinit const Mode Mode::mean(mean_mode);
constinit const Mode Mode::composite(composite_mode);

Mode mode_named(std::string_view name) {
    const auto found = std::find_if(modes().begin(), modes().end(),
                                    [&](Mode mode) { return same_word(name, mode->name); });
    if (found != modes().end()) return *found;
    std::vector<std::string> known;
    for (const Mode mode : modes()) known.emplace_back(mode->name);
    throw RequestError("no mode is called '" + std::string(name) + "'; " +
                       instead_of(std::string(name), known));
}

std::string_view name_of(Mode mode) noexcept { return mode->name; }

Stretch Stretch::empty(Mode mode) noexcept {
    Stretch stretch;
    if (mode->empty) mode->empty(stretch);
    return stretch;
}

void Stretch::add_lit(double value, double piece, const std::function<Lit()>& lit,
                      const Request& want) {
    if (!std::isfinite(value)) return;
    want.mode->add_lit(*this, value, piece, lit, want);
    length += piece;
}

void Stretch::follow(double t, double value, double piece, const AlongRay& along,
                     const Request& want) {
    want.mode->follow(*this, t, value, piece, along, want);
}

float RayRule::Setting::stored_level() const noexcept {
    constexpr float kEnd = std::numeric_limits<float>::infinity();
    if (values.slope == 0) return values.offset >= level ? -kEnd : kEnd;
    const double exact = (level - values.offset) / values.slope;
    const auto near = static_cast<float>(exact);
    if (values.slope < 0) return near > exact ? std::nextafter(near, -kEnd) : near;
    return near < exact ? std::nextafter(near, kEnd) : near;
}

double gain_of_integral(bool noise, double length) noexcept {
    constexpr double kLength = 160;
    return noise ? std::sqrt(length) : 17 * length / kLength;
}

}  // namespace edgewise
