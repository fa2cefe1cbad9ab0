#include "engine/request/look_spec.hpp"

#include <fmt/format.h>

#include "engine/request/spec.hpp"
#include "graph/errors.hpp"

namespace edgewise {

void expect_look(const RequestSpec& spec) {
    const LookSpec& look = spec.look;
    if (look.empty()) return;
    const Message option = !look.colormap.empty() ? setting("colormap")
                           : look.legend          ? setting("legend")
                           : look.depth_colour    ? setting("depth_colour")
                           : look.scale_bar       ? setting("scale_bar")
                                                  : setting("montage");
    if (spec.job != Job::render && spec.job != Job::warp)
        throw RequestError(message("{}: of render and warp", option));
    if (spec.bits && *spec.bits != 8)
        throw RequestError(
            message("{}: makes pictures of 8 bits; leave out @bits({})", option, *spec.bits));
    if (look.depth_colour && (spec.job != Job::render || spec.mode->extreme != 1))
        throw RequestError(
            message("@depth_colour: of `@command(render) @mode(mip)`, whose values have a depth"));
    if (spec.job == Job::render && look.colours() &&
        (spec.mode->channels != 1 || spec.mode->over_background))
        throw RequestError(
            message("{}: @mode({}) has colours of its own (@preset, @transfer); of modes that show "
                    "values, as mip, xray and mean",
                    option, spec.mode->name));
    if (!look.montage) return;
    constexpr int kMost = 1000;
    for (const int count : *look.montage)
        if (count < 1 || count > kMost)
            throw RequestError(message("@montage: {} is not from 1 to {} pictures", count, kMost));
    if (spec.fps) throw RequestError(message("@fps: a montage is one picture"));
}

}  // namespace edgewise
