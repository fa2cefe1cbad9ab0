#include "transitions/composite/over_edge.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fmt/format.h>

#include "graph/spread.hpp"
#include "transitions/composite/groupings.hpp"
#include "transitions/kernels/classified.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

using kernels::kClassified;

constexpr std::int64_t kTileWidth = 256, kTileHeight = 8;
constexpr std::ptrdiff_t kRowFloats = kClassified * kTileWidth;

/// Rows of pixels as parts of rays, see Grouping. Transparency is the fourth number of a sample, in
/// the same vector as light: it is updated always, as the picture's opacity asks for it.
class RowAlgebra {
 public:
    using Part = const float*;

    /// @param first   the row in the slice in front; @param slice  floats from one to the next
    /// @param prefix  takes the place of slice prefix_at; may be null
    RowAlgebra(const float* first, std::ptrdiff_t slice, std::int64_t pixels, float* buffers,
               int count, const float* prefix, int prefix_at)
        : first_(first),
          slice_(slice),
          pixels_(pixels),
          buffers_(buffers),
          count_(count),
          prefix_(prefix),
          prefix_at_(prefix ? prefix_at : -1),
          free_((std::uint64_t{1} << count) - 1) {}

    Part leaf(int i) const { return i == prefix_at_ ? prefix_ : first_ + i * slice_; }
    Part over(Part front, Part behind, bool /*updates*/) {
        float* into = joined(front, behind);
        kernels::over_row(front, behind, into, pixels_);
        return into;
    }
    Part attenuated(Part front, int i, bool /*updates*/) {
        float* into = take();
        kernels::attenuate_row(front, leaf(i), into, pixels_);
        return into;
    }
    Part sum(Part front, Part behind) {
        float* into = joined(front, behind);
        kernels::add_row(front, behind, into, pixels_);
        return into;
    }

    /// Buffers that a grouping needs: one for each tree that waits, and the one that joins it.
    static int buffers(std::int64_t samples) {
        return std::bit_width(static_cast<std::uint64_t>(samples)) + 2;
    }

 private:
    /// The buffer of a part; of samples that lie in the volume, or of the prefix, -1.
    int buffer_of(Part part) const {
        for (int i = 0; i < count_; ++i)
            if (part == buffers_ + i * kRowFloats) return i;
        return -1;
    }
    float* take() {
        const int i = std::countr_zero(free_);
        free_ &= free_ - 1;
        return buffers_ + i * kRowFloats;
    }
    /// Where the composite of two goes, neither of which is needed any more.
    float* joined(Part front, Part behind) {
        const int a = buffer_of(front), b = buffer_of(behind);
        if (a < 0 && b < 0) return take();
        if (a >= 0 && b >= 0) free_ |= std::uint64_t{1} << b;
        return buffers_ + (a >= 0 ? a : b) * kRowFloats;
    }

    const float* first_;
    std::ptrdiff_t slice_;
    std::int64_t pixels_;
    float* buffers_;
    int count_;
    const float* prefix_;
    int prefix_at_;
    std::uint64_t free_;  // a bit a buffer
};

std::size_t buffer_bytes(std::int64_t depth) {
    return static_cast<std::size_t>(RowAlgebra::buffers(depth) * kRowFloats) * sizeof(float);
}

/// What was composited of a row becomes pixels: opacity in place of transparency.
void finish_row(const float* row, std::int64_t pixels, float* out) {
    for (std::int64_t i = 0; i < kClassified * pixels; i += kClassified) {
        for (int c = 0; c < 3; ++c) out[i + c] = row[i + c];
        out[i + 3] = 1 - row[i + 3];
    }
}

/// Classified samples, one stretch of slices after another.
struct Slices {
    Compositing how;
    const Data& in;
    int depth;

    /// Slices [begin, end) behind what `front` holds of those before; null: there are none.
    /// @return a row in `buffers`, in the samples, or `front`
    const float* row(std::int64_t x, std::int64_t y, std::int64_t pixels, int begin, int end,
                     const float* front, float* buffers) const {
        RowAlgebra algebra(in.at<float>(x, y, 0), in.row() * in.held().extent().y, pixels, buffers,
                           RowAlgebra::buffers(depth), front, begin - 1);
        Grouping<RowAlgebra> grouping(algebra, depth);
        if (!front) return grouping.composite(how, begin, end);
        // One after another it goes on where it stopped, so that the bytes are those without a
        // stop.
        if (how == Compositing::front_to_back) return grouping.composite(how, begin - 1, end);
        return algebra.over(front, grouping.composite(how, begin, end), end != depth);
    }
};

void run_at_once(const Slices& slices, Data& out, const Region& region, Context& context) {
    for_tiles(region, kTileWidth, kTileHeight, context, [&](const Region& tile) {
        Array buffers(buffer_bytes(slices.depth), context.memory);
        const std::int64_t x = tile.begin[0], width = tile.extent().x;
        for (std::int64_t y = tile.begin[1]; y < tile.end[1]; ++y) {
            if (context.stopped()) return;
            finish_row(slices.row(x, y, width, 0, slices.depth, nullptr,
                                  static_cast<float*>(buffers.data())),
                       width, out.at<float>(x, y, 0));
        }
    });
}

/// Stops at each depth: then `out` is the picture of the slices in front of it, and stays so where
/// the watch does not go on.
void run_by_depths(const Slices& slices, const std::vector<std::int64_t>& depths, Data& out,
                   const FrontWatch& watch, Context& context) {
    // Transparency, which is exact, cannot be had back from opacity.
    Data fronts = Data::make(out.what, context.memory);
    int begin = 0;
    for (const std::int64_t depth : depths) {
        const int end = static_cast<int>(depth);
        for_tiles(Region::all(out.what.extent), kTileWidth, kTileHeight, context,
                  [&](const Region& tile) {
                      Array buffers(buffer_bytes(slices.depth), context.memory);
                      const std::int64_t x = tile.begin[0], width = tile.extent().x;
                      for (std::int64_t y = tile.begin[1]; y < tile.end[1]; ++y) {
                          float* front = fronts.at<float>(x, y, 0);
                          const float* row =
                              slices.row(x, y, width, begin, end, begin > 0 ? front : nullptr,
                                         static_cast<float*>(buffers.data()));
                          if (row != front)
                              std::memcpy(
                                  front, row,
                                  static_cast<std::size_t>(kClassified * width) * sizeof(float));
                          finish_row(front, width, out.at<float>(x, y, 0));
                      }
                  });
        // Tiles end early where the run is cancelled: then this is no picture.
        if (context.stopped()) return;
        if (watch && !watch({context.view, end, slices.depth, out})) return;
        begin = end;
    }
}

/// Composites that lie on one another, as far as rounding adds up.
double longest_chain(Compositing how, std::int64_t depth) {
    const auto last = static_cast<std::uint64_t>(std::max<std::int64_t>(depth - 1, 0));
    const bool tree = how == Compositing::tree_from_back || how == Compositing::tree_from_front;
    return tree ? std::bit_width(last) : static_cast<double>(last);
}

}  // namespace

std::string no_compositing(const Representation& from, const Ask& ask) {
    if (!ask.want.job->of_rays()) return "the result is a volume, not a picture";
    if (ask.want.mode->combine != Combine::over)
        return fmt::format("{}: nobody reads light and transparency of samples",
                           ask.want.mode->name);
    if (from.channels != kClassified || from.type != Type::f32)
        return fmt::format("{} channels of {}; classified samples have {} of f32", from.channels,
                           name_of(from.type), kClassified);
    if (!is_whole(from)) return "needs all samples in memory, row by row";
    return {};
}

Transition over_edge(Compositing how, FrontDepths depths, FrontWatch watch) {
    const auto stops = [depths](const Offer& offer) {
        return depths ? depths(offer.with, offer.from.extent.z) : std::vector<std::int64_t>();
    };
    Transition edge;
    edge.joins = {{"screen/classified", "screen/picture"}};
    edge.on_demand = true;  // project.combine does the same, and moves fewer bytes
    edge.offer = [](const Representation& from, const Ask& ask, const Parameters& with) {
        if (std::string reason = no_compositing(from, ask); !reason.empty())
            return Offer::no(std::move(reason));
        return Offer{.from = from, .to = screen_picture(from, ask.want), .with = with};
    };
    edge.work = [how, stops](const Offer& offer, const Ask&, int) {
        const auto depth = static_cast<int>(offer.from.extent.z);
        const double pictures = static_cast<double>(std::max<std::size_t>(1, stops(offer).size()));
        const double each = counts_of(how, depth, kColors).sum() -
                            initial_counts(depth, kColors).sum() + opacity_counts(how, depth).sum();
        Work work{.operations = each * static_cast<double>(offer.to.samples()),
                  .streamed = offer.from.bytes() + pictures * offer.to.bytes(),
                  .scratch = static_cast<double>(buffer_bytes(depth) + kArraySlack)};
        if (!stops(offer).empty()) {
            work.streamed += 2 * pictures * offer.to.bytes();
            work.workspace = offer.to.bytes();
        }
        return work;
    };
    edge.error = [how](const Offer& offer, const Ask& ask) {
        Error error = combined_error(ask);
        // Half of 2^-23 of light of 1, as variances add up where roundings are independent.
        error.noise =
            std::hypot(error.noise, 0x1p-24 * std::sqrt(longest_chain(how, offer.from.extent.z)));
        return error;
    };
    edge.parts = [stops](const Offer& offer, const Ask&) {
        const Extent& to = offer.to.extent;
        if (!stops(offer).empty()) return Partition{};  // all of a picture stops at one depth
        return Partition{.kind = Partition::output,
                         .leaf = {to.x, std::min<std::int64_t>(to.y, 4 * kTileHeight), 1},
                         .reads = [depth = offer.from.extent.z](const Region& out, int) {
                             Region in = out;
                             in.begin[2] = 0;
                             in.end[2] = depth;
                             return in;
                         }};
    };
    edge.run = [how, stops, watch](const Offer& offer, const Ask&, const Data& in, Data& out,
                                   const Region& region, Context& context) {
        const Slices slices{how, in, static_cast<int>(in.what.extent.z)};
        const std::vector<std::int64_t> pictures = stops(offer);
        if (pictures.empty())
            run_at_once(slices, out, region, context);
        else
            run_by_depths(slices, pictures, out, watch, context);
    };
    return edge;
}

}  // namespace edgewise
