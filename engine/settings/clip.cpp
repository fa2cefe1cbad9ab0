#include <array>

#include "engine/settings/jobs.hpp"
#include "engine/settings/readers.hpp"

namespace edgewise {
namespace {

constexpr const char* kClipping = "Clipping";

/// Lists of four numbers.
template <typename Member>
Reader fours(const char* expected, Member member) {
    return reads::list(
        [expected](const SettingValue& value, const Message& called) {
            return reads::exactly<4>(value, called, expected);
        },
        [](const std::array<double, 4>& one) { return SettingValue::of(one); }, &Query::clip,
        member);
}

}  // namespace

Rows clip_settings() {
    static const std::array rows{
        QuerySetting{
            .name = "box",
            .option = "clip",
            .group = kClipping,
            .value = "X0,Y0,Z0,X1,Y1,Z1",
            .help = "keeps the box of these samples of FILE, ends included",
            .of = has::render,
            .reads = reads::so_many_numbers<6>("X0,Y0,Z0,X1,Y1,Z1", &Query::clip, &ClipSpec::box)},
        QuerySetting{.name = "planes",
                     .option = "clip-plane",
                     .group = kClipping,
                     .value = "A,B,C,D",
                     .help = "keeps Ax+By+Cz+D >= 0, in samples of FILE; several add up",
                     .of = has::render,
                     .reads = fours("A,B,C,D", &ClipSpec::planes)},
        QuerySetting{.name = "balls",
                     .option = "clip-ball",
                     .group = kClipping,
                     .value = "X,Y,Z,R",
                     .help = "keeps the ball around sample X,Y,Z of FILE, radius in the file's "
                             "unit; of several what they share",
                     .of = has::render,
                     .reads = fours("X,Y,Z,R", &ClipSpec::balls)},
        QuerySetting{.name = "slab",
                     .group = kClipping,
                     .value = "T",
                     .help = message("keeps so much of each view about its middle plane, or from "
                                     "@eye on, in the file's unit"),
                     .of = has::render,
                     .reads = reads::number(&Query::clip, &ClipSpec::slab)},
    };
    return rows;
}

}  // namespace edgewise
