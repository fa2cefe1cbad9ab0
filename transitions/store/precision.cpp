#include "transitions/store/precision.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "graph/filtering.hpp"
#include "graph/with_type.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

/// Whether every stored number of a range is an integer that the type holds.
bool holds(Type type, double low, double high) {
    const std::array<double, 2> limits = limits_of(type);
    return low >= limits[0] && high <= limits[1];
}

/// What the stored numbers of the new type mean.
ValueMap map_for(const Representation& from, const Scene& scene, Type type) {
    if (type == Type::f32) return from.values;
    const std::array<double, 2> limits = limits_of(type);
    const ValueMap& had = from.values;
    if (is_integer(from.type)) {  // kept, perhaps shifted by a whole number
        const double a = (scene.low - had.offset) / had.slope;
        const double b = (scene.high - had.offset) / had.slope;
        const double low = std::round(std::min(a, b)), high = std::round(std::max(a, b));
        if (holds(type, low, high)) return had;
        if (high - low <= limits[1] - limits[0])
            return {had.slope, had.offset + had.slope * (low - limits[0])};
    }
    const double range = scene.high - scene.low;
    if (!(range > 0)) return {1, scene.low};
    // One step fewer than there are, so that a grid through the commonest value still covers both
    // ends; where that value is an end all steps serve.
    const bool at_an_end = scene.commonest == scene.low;
    const double step = range / (limits[1] - limits[0] - (at_an_end ? 0 : 1));
    const double below = std::ceil((scene.commonest - scene.low) / step - 1e-9);
    return {step, scene.commonest - step * (below + limits[0])};
}

bool is_kept(const Offer& offer) {
    return is_integer(offer.from.type) && offer.to.type != Type::f32 &&
           offer.from.values.slope == offer.to.values.slope;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    const Type type = type_named(with.word("type"));
    if (type == from.type) return Offer::no(fmt::format("samples are {} already", name_of(type)));
    if (from.layout != Layout::linear || from.place != Place::memory)
        return Offer::no("needs samples in memory, row by row");
    if (from.type == Type::c64 || from.type == Type::f16)
        return Offer::no(fmt::format("{} samples are not converted", name_of(from.type)));
    // Among 32-bit types f32 is the one that kernels have vector lanes for.
    if (bytes_of(type) + (type == Type::f32 ? 0 : 1) > bytes_of(from.type))
        return Offer::no(
            fmt::format("{} is no smaller than {}", name_of(type), name_of(from.type)));
    if (type != Type::f32 && ask.scene.non_finite > 0)
        return Offer::no(fmt::format("{} values are not finite, which {} cannot hold",
                                     ask.scene.non_finite, name_of(type)));
    Offer made{.from = from, .to = from, .with = with};
    made.to.type = type;
    made.to.values = map_for(from, ask.scene, type);
    const bool kept =
        type == Type::f32 ? ask.scene.fits_f32(from.type, from.values) : is_kept(made);
    if (ask.want.field == Field::nearest && !kept)
        return Offer::no(fmt::format("{} cannot hold the labels as they are", name_of(type)));
    // Rounded before, they would not come out as exactly as they are written.
    if (!kept && ask.want.setting.as<Filtering>() && is_integer(from.type))
        return Offer::no(
            fmt::format("{} rounds integers, and filters give integers", name_of(type)));
    // What is 0 decides what belongs to a mask.
    const Filtering* filtering = ask.want.setting.as<Filtering>();
    if (!kept && filtering && is_binary(filtering->op))
        return Offer::no(
            fmt::format("{} rounds values, and small ones of a mask may become 0", name_of(type)));
    // The length of a gradient is nowhere negative, so what rounding makes of it does not cancel.
    if (!kept && ask.want.job->of_rays() && ask.want.shading.of_sums())
        return Offer::no(
            fmt::format("{} rounds values, and lengths of gradients add up", name_of(type)));
    return made;
}

/// RMS of the rounding error of samples [value].
double rounding(const Offer& offer, const Ask& ask) {
    if (offer.to.type != Type::f32) return std::abs(offer.to.values.slope) / std::sqrt(12.0);
    const double largest = std::max(std::abs(ask.scene.low), std::abs(ask.scene.high));
    return largest * 0x1p-24 / std::sqrt(3.0);
}

Error error(const Offer& offer, const Ask& ask) {
    if (is_kept(offer) ||
        (offer.to.type == Type::f32 && ask.scene.fits_f32(offer.from.type, offer.from.values)))
        return {.copies = true};
    const double noise = rounding(offer, ask);
    if (!ask.want.job->of_rays() || !ask.want.mode->threshold) return {.noise = noise};
    const double measured = kMeasuredNoise * (ask.scene.high - ask.scene.low);
    return {.noise = std::sqrt(noise * std::max(noise, measured))};
}

template <class To, class From>
void convert(const From* from, To* to, std::int64_t count, double scale, double shift) {
    if constexpr (std::is_floating_point_v<To>) {
        for (std::int64_t i = 0; i < count; ++i)
            to[i] = static_cast<To>(scale * static_cast<double>(from[i]) + shift);
    } else {
        constexpr double low = std::numeric_limits<To>::min(),
                         high = std::numeric_limits<To>::max();
        for (std::int64_t i = 0; i < count; ++i) {
            // Half up: floor is one instruction in a vector, halves to even is not.
            const double level = std::floor(scale * static_cast<double>(from[i]) + shift + 0.5);
            to[i] = static_cast<To>(static_cast<std::int32_t>(std::clamp(level, low, high)));
        }
    }
}

void run(const Offer& offer, const Ask&, const Data& in, Data& out, const Region& region,
         Context& context) {
    const ValueMap &had = offer.from.values, &map = offer.to.values;
    const double scale = had.slope / map.slope, shift = (had.offset - map.offset) / map.slope;
    const std::int64_t count = out.what.channels * region.extent().x;
    with_type(in.what.type, [&](auto source) {
        with_type(out.what.type, [&](auto target) {
            for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z)
                for (std::int64_t y = region.begin[1]; y < region.end[1]; ++y) {
                    context.poll();
                    const std::int64_t x = region.begin[0];
                    convert(in.at<decltype(source)>(x, y, z), out.at<decltype(target)>(x, y, z),
                            count, scale, shift);
                }
        });
    });
}

}  // namespace

Transition precision() {
    return {
        .name = "store.precision",
        .source =
            "Bennett, Spectra of quantized signals, Bell Syst. Tech. J. 27, 1948: step^2 / 12",
        .joins = {{"object/scalar", "object/scalar"}},
        // What is converted stays in memory, so 16 bits in place of 32 save no peak, and little
        // time.
        .parameters = {{"type", one_of({"u8", "i16", "u16", "f32"}, {"u8", "f32"},
                                       "how samples are written")}},
        .any_transform = true,
        .offer = offer,
        .work = [](const Offer& made, const Ask&, int) -> Work {
            return {.operations = 6.0 * static_cast<double>(made.to.samples()) * made.to.channels,
                    .streamed = made.from.bytes() + made.to.bytes()};
        },
        .error = error,
        .parts = [](const Offer& made, const Ask&) -> Partition {
            const Extent n = made.to.extent;
            return {.kind = Partition::output,
                    .leaf = {n.x, n.y, std::max<std::int64_t>(1, (1 << 20) / (n.x * n.y))},
                    .reads = [](const Region& region, int) { return region; }};
        },
        .run = run,
        .trials = []() -> std::vector<Trial> {
            const std::vector<double> turn{20, -15, 10};
            return {copy_trial("phantom:gaussians:144", Type::i16, turn),
                    copy_trial("phantom:gaussians:144", Type::f32, turn)};
        },
        .factors = {{"", 6.6}},
    };
}

}  // namespace edgewise
