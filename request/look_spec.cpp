#include "request/look_spec.hpp"

#include <fmt/format.h>

#include "graph/errors.hpp"
#include "request/query.hpp"

namespace edgewise {

void expect_look(const Query& query) {
    const LookSpec& look = query.look;
    if (look.empty()) return;
    const Message option = !look.colormap.empty() ? setting("colormap")
                           : look.legend          ? setting("legend")
                           : look.depth_colour    ? setting("depth_colour")
                           : look.scale_bar       ? setting("scale_bar")
                                                  : setting("montage");
    if (query.job != Job::render && query.job != Job::warp)
        throw RequestError(message("{}: of render and warp", option));
    if (query.bits && *query.bits != 8)
        throw RequestError(
            message("{}: makes pictures of 8 bits; leave out @bits({})", option, *query.bits));
    if (look.depth_colour && (query.job != Job::render || query.mode->extreme != 1))
        throw RequestError(
            message("@depth_colour: of `@command(render) @mode(mip)`, whose values have a depth"));
    if (query.job == Job::render && look.colours() &&
        (query.mode->channels != 1 || query.mode->over_background))
        throw RequestError(
            message("{}: @mode({}) has colours of its own (@preset, @transfer); of modes that show "
                    "values, as mip, xray and mean",
                    option, query.mode->name));
    if (!look.montage) return;
    constexpr int kMost = 1000;
    for (const int count : *look.montage)
        if (count < 1 || count > kMost)
            throw RequestError(message("@montage: {} is not from 1 to {} pictures", count, kMost));
    if (query.fps) throw RequestError(message("@fps: a montage is one picture"));
}

}  // namespace edgewise
