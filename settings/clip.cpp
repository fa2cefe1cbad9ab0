#include <array>

#include "settings/jobs.hpp"
#include "settings/readers.hpp"

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
    static const std::vector<QuerySetting> rows = grouped(
        kClipping,
        {QuerySetting{"box", "X0,Y0,Z0,X1,Y1,Z1",
                      "keeps the box of these samples of FILE, ends included", has::render,
                      reads::so_many_numbers<6>("X0,Y0,Z0,X1,Y1,Z1", &Query::clip, &ClipSpec::box)}
             .typed_as("clip"),
         QuerySetting{"planes", "A,B,C,D",
                      "keeps Ax+By+Cz+D >= 0, in samples of FILE; several add up", has::render,
                      fours("A,B,C,D", &ClipSpec::planes)}
             .typed_as("clip-plane"),
         QuerySetting{"balls", "X,Y,Z,R",
                      "keeps the ball around sample X,Y,Z of FILE, radius in the file's unit; of "
                      "several what they share",
                      has::render, fours("X,Y,Z,R", &ClipSpec::balls)}
             .typed_as("clip-ball"),
         {"slab", "T",
          message("keeps so much of each view about its middle plane, or from @eye on, in the "
                  "file's unit"),
          has::render, reads::number_in(Limits::above(0), &Query::clip, &ClipSpec::slab)}});
    return rows;
}

}  // namespace edgewise
