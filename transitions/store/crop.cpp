#include "transitions/store/crop.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>

#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kMargin = 12;  // samples; see the error in the header
constexpr double kWorthACopy = 0.9;   // of the samples: above, reading them all is no dearer

/// Why the commonest value may not be left out; empty: it may.
std::string needed(const Request& want, const Scene& scene) {
    const double common = scene.commonest;
    if (want.job->of_points())
        return common == want.outside
                   ? ""
                   : message("the commonest value is {}, @outside({})", common, want.outside)
                         .marked();
    if (!want.mode->needs) return std::string(want.mode->kept);
    return want.mode->needs(want, common, scene.low, scene.high);
}

/// The samples around what clipped rays see, over all views.
Region seen(const Request& want) {
    Region box = Region::all(want.input);
    for (int axis = 0; axis < 3 && !want.clips.empty(); ++axis) {
        double low = want.clips[0].least[axis], high = want.clips[0].most[axis];
        for (const Clip& clip : want.clips) {
            low = std::min(low, clip.least[axis]);
            high = std::max(high, clip.most[axis]);
        }
        box.begin[axis] = static_cast<std::int64_t>(std::floor(low));
        box.end[axis] = static_cast<std::int64_t>(std::ceil(high)) + 1;
    }
    return box;
}

Region common_of(Region box, const Region& other) {
    for (int axis = 0; axis < 3; ++axis) {
        box.begin[axis] = std::max(box.begin[axis], other.begin[axis]);
        box.end[axis] = std::min(box.end[axis], other.end[axis]);
    }
    return box;
}

/// The box that is kept [input sample].
/// @param occupied  what is empty may be left out too
Region kept(const Request& want, const Scene& scene, bool occupied) {
    Region box = seen(want);
    if (occupied)
        if (const Region both = common_of(box, scene.occupied); !both.empty()) box = both;
    for (int axis = 0; axis < 3; ++axis) {
        box.begin[axis] = std::max<std::int64_t>(0, box.begin[axis] - kMargin);
        box.end[axis] = std::min(want.input[axis], box.end[axis] + kMargin);
    }
    return box;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (from.extent != ask.want.input || from.placed.one_a_view() ||
        from.placed.at(0).matrix() != Mat4::Identity())
        return Offer::no("the samples no longer lie where the input has them");
    if (from.layout != Layout::linear || from.place != Place::memory)
        return Offer::no("needs samples in memory, row by row");
    std::string reason = needed(ask.want, ask.scene);
    if (reason.empty() && ask.scene.occupied.empty()) reason = "all samples have one value";
    const bool clipped = !ask.want.clips.empty();
    if (!clipped && !reason.empty()) return Offer::no(std::move(reason));
    const Region box = kept(ask.want, ask.scene, reason.empty());
    const double share =
        static_cast<double>(box.extent().samples()) / static_cast<double>(from.samples());
    if (share > kWorthACopy)
        return Offer::no(fmt::format("the {} box is {:.0f} % of the input",
                                     clipped ? "visible" : "occupied", 100 * share));

    Offer offer{.from = from, .to = from, .with = with};
    offer.to.extent = box.extent();
    Mat4 shift = Mat4::Identity();
    for (int axis = 0; axis < 3; ++axis) shift(axis, 3) = -static_cast<double>(box.begin[axis]);
    offer.to.placed = shift;
    return offer;
}

/// A region here -> the samples of the input that it is copied from.
Region source_of(Region region, const Representation& here) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto shift = static_cast<std::int64_t>(here.placed.at(0).matrix()(axis, 3));
        region.begin[axis] -= shift;
        region.end[axis] -= shift;
    }
    return region;
}

void run(const Offer& offer, const Ask&, const Data& in, Data& out, const Region& region,
         Context& context) {
    const Region source = source_of(region, offer.to);
    const Extent box = region.extent();
    const auto bytes = static_cast<std::size_t>(box.x * in.what.channels) * bytes_of(in.what.type);
    for (std::int64_t z = 0; z < box.z; ++z)
        for (std::int64_t y = 0; y < box.y; ++y) {
            context.poll();
            std::memcpy(out.row_at(region.begin[0], region.begin[1] + y, region.begin[2] + z),
                        in.row_at(source.begin[0], source.begin[1] + y, source.begin[2] + z),
                        bytes);
        }
}

/// What is mostly empty is copied first: small copies cost what their pages do.
std::vector<Trial> trials() {
    std::vector<Trial> all;
    for (const int size : {64, 112, 144, 190})
        for (const Type type : {Type::u8, Type::i16, Type::f32}) {
            all.push_back(
                copy_trial(fmt::format("phantom:gaussians:{}", size), type, {20, -15, 10}));
            all.back().empty_around = true;
        }
    return all;
}

}  // namespace

Transition crop() {
    return {
        .name = "store.crop",
        .source = "edgewise: what is empty need not be touched",
        .joins = {{"object/scalar", "object/scalar"}},
        .offer = offer,
        .work = [](const Offer& made, const Ask&, int) -> Work {
            return {.streamed = 2 * made.to.bytes()};
        },
        .error = [](const Offer&, const Ask&) -> Error { return {.copies = true}; },
        .parts = [](const Offer& made, const Ask&) -> Partition {
            const Extent n = made.to.extent;
            return {.kind = Partition::output,
                    .leaf = {n.x, n.y, std::max<std::int64_t>(1, (1 << 20) / (n.x * n.y))},
                    .reads = [to = made.to](const Region& out, int) { return source_of(out, to); }};
        },
        .run = run,
        .trials = trials,
        .factors = {{"", 1.1}},
    };
}

}  // namespace edgewise
