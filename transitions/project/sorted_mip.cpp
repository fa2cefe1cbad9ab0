#include "transitions/project/sorted_mip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <memory>
#include <optional>
#include <span>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <vector>

#include "graph/lines_touched.hpp"
#include "transitions/filters/read_by.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/sorted_bricks.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kTile = kernels::kSortedTile;
constexpr std::int64_t kChunk = 4096;  // bricks that are laid out together

const Filter& filter_that_reads(const Parameters& with) {
    return filter_named(with.word("filter"));
}

Offer offer_sorted(const Representation& from, const Ask& ask, const Parameters& with) {
    const Filter& filter = filter_that_reads(with);
    if (std::string reason =
            not_read_by(filter, {.coefficients = from.content == kSortedCoefficients,
                                 .labels = ask.want.field == Field::nearest,
                                 .non_finite = ask.scene.non_finite});
        !reason.empty())
        return Offer::no(std::move(reason));
    if (std::string reason = no_sorting(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (const std::string facet = sorted_facet_of(ask.want, from.values);
        !from.facets.contains(facet))
        return Offer::no(fmt::format("bricks are sorted the other way round, not {}", facet));
    return {.from = from, .to = screen_picture(from, ask.want), .with = with};
}

/// Bricks meet so many tiles of a picture in the mean.
double tiles_of_brick(const Offer& offer, const Ask& ask, int view) {
    const Mat4 map = residual(offer.from, ask.want, view);
    double tiles = 1;
    for (int axis = 0; axis < 2; ++axis) {
        const double side =
            map.row(axis).head<3>().cwiseAbs().sum() * (kernels::SortedBricks::kSide + 1);
        tiles *= 1 + side / static_cast<double>(kTile);
    }
    return tiles;
}

/// Voxels from a sample to its neighbours to the right, below and behind.
Eigen::Matrix3d lattice_of_view(const Offer& offer, const Ask& ask, int view) {
    const kernels::Rays rays = rays_of(offer.from, ask.want, view);
    Eigen::Matrix3d lattice;
    for (int row = 0; row < 3; ++row) {
        const auto a = static_cast<std::size_t>(row);
        lattice.row(row) << rays.origin.x[a], rays.origin.y[a],
            rays.direction.base[a] * offer.with.number("step");
    }
    return lattice;
}

/// Cells that packets sample. Large packets beside small bricks sample more than single rays need,
/// because all rays of a packet return for one of them. Fitted to counts in five data sets, with
/// pixels of one sample and of a third: within a fifth.
double cells_sampled(const Offer& offer, const Ask& ask, int view, const Eigen::Matrix3d& lattice) {
    constexpr double kUnknown = 0.2, kSide = kernels::SortedBricks::kSide + 1, kOnce = 0.7;
    const double pixels = static_cast<double>(offer.to.samples());
    const double step = offer.with.number("step");
    const double all = pixels * mean_length(offer.from, ask.want, view) / step;
    const double wide = kernels::kPacketSide - 1, high = 1;
    const double again = 0.9 * (1 + wide * lattice.col(0).norm() / kSide) *
                         (1 + high * lattice.col(1).norm() / kSide);
    return share_needed(ask.scene).value_or(kUnknown) * again * all + kOnce * pixels / step;
}

Work work_sorted(const Offer& offer, const Ask& ask, int view) {
    const Filter& filter = filter_that_reads(offer.with);
    const double taps = filter.taps, reads = taps * taps * taps;
    const double operations = filter.taps == 1   ? 0
                              : filter.taps == 2 ? 21
                                                 : filter.operations_of(3);
    const double bytes = static_cast<double>(bytes_of(offer.from.type));
    const double pixels = static_cast<double>(offer.to.samples());
    const double bricks =
        static_cast<double>(kernels::sorted_bricks_in(offer.from.extent).samples());
    const double laid = bricks * tiles_of_brick(offer, ask, view);
    const Eigen::Matrix3d lattice = lattice_of_view(offer, ask, view);
    const double cells = cells_sampled(offer, ask, view, lattice);
    const RaysMet met = rays_met(offer.from, ask.want, view, kernels::kPacketSide);
    const double lines = cells * lines_touched(lattice, bytes, Vec3::Constant(taps));
    const double tiles = std::max(1.0, pixels / static_cast<double>(kTile * kTile));
    // A brick's place on the screen takes 20, each of its tiles 40 more, twice; to find that a
    // packet has seen as much 3, of some 24 packets.
    return {.operations = cells * (9 + operations + ask.want.mode->operations) + 120 * met.packets +
                          20 * bricks + 150 * laid,
            .streamed = offer.to.bytes() + 128 * met.packets + 16 * bricks + 12 * laid,
            .gathers = cells * reads + 20 * met.packets,
            .lines = {lines, std::min(offer.from.bytes(),
                                      kLineBytes * lines * ask.want.views.different())},
            .other_lines = {cells * lines_swept(lattice, kernels::kPacketSide, bytes,
                                                Vec3::Constant(taps)),
                            kLineBytes * lines / tiles},
            .scratch = static_cast<double>(kernels::sorted_room()),
            .workspace = 8 * bricks + 4 * laid + 8 * tiles * (1 + bricks / kChunk)};
}

Error error_sorted(const Offer& offer, const Ask& ask) {
    return cast_error(filter_that_reads(offer.with), offer.with.number("step"), ask);
}

/// Which bricks the tiles of a region of a picture may see, in order.
class LaidOut {
 public:
    LaidOut(const kernels::SortedBricks& bricks, const Mat4& map, const Region& region,
            std::pmr::memory_resource* memory)
        : bricks_(bricks),
          region_(region),
          across_((region.extent().x + kTile - 1) / kTile),
          down_((region.extent().y + kTile - 1) / kTile),
          chunks_((static_cast<std::int64_t>(bricks.bricks.size()) + kChunk - 1) / kChunk),
          middles_(bricks.bricks.size(), memory),
          starts_(static_cast<std::size_t>(chunks_ * tiles() + 1), memory),
          order_(memory) {
        constexpr double kRounding = 0.01;  // of f32 pixels
        const double half = half_of_brick(bricks);
        half_[0] = static_cast<float>(half * map.row(0).head<3>().cwiseAbs().sum() + kRounding);
        half_[1] = static_cast<float>(half * map.row(1).head<3>().cwiseAbs().sum() + kRounding);
        // Counted, then put in place, by chunks of bricks: so threads change nothing of the order.
        tbb::parallel_for(std::int64_t{0}, chunks_, [&](std::int64_t chunk) {
            each_of(chunk, [&](std::int64_t i) {
                const kernels::BrickBox box(bricks, bricks.bricks[index(i)].place);
                const Vec3 middle(box.middle(0), box.middle(1), box.middle(2));
                for (int axis = 0; axis < 2; ++axis)
                    middles_[index(i)][index(axis)] =
                        static_cast<float>(map.row(axis).head<3>().dot(middle) + map(axis, 3));
                each_tile(i, [&](std::int64_t tile) { ++start(tile, chunk); });
            });
        });
        std::int64_t sum = 0;
        for (std::int64_t& start : starts_) {
            const std::int64_t here = start;
            start = sum;
            sum += here;
        }
        order_.resize(index(sum));
        // Each start moves to the end of its chunk, which is the start of the next.
        tbb::parallel_for(std::int64_t{0}, chunks_, [&](std::int64_t chunk) {
            each_of(chunk, [&](std::int64_t i) {
                each_tile(i, [&](std::int64_t tile) {
                    order_[index(start(tile, chunk)++)] = static_cast<std::int32_t>(i);
                });
            });
        });
    }
    kernels::ShownBricks shown() const { return {middles_, half_[0], half_[1]}; }
    /// Those of the tile at a pixel, in descending order of bounds.
    std::span<const std::int32_t> of(std::int64_t x, std::int64_t y) const {
        const std::int64_t tile =
            (y - region_.begin[1]) / kTile * across_ + (x - region_.begin[0]) / kTile;
        if (chunks_ == 0) return {};
        const std::int64_t first = tile * chunks_;
        const std::int64_t begin = first == 0 ? 0 : starts_[index(first - 1)];
        return {order_.data() + begin, index(starts_[index(first + chunks_ - 1)] - begin)};
    }

 private:
    static std::size_t index(std::int64_t i) { return static_cast<std::size_t>(i); }
    std::int64_t tiles() const { return across_ * down_; }
    std::int64_t& start(std::int64_t tile, std::int64_t chunk) {
        return starts_[index(tile * chunks_ + chunk)];
    }
    template <class Use>
    void each_of(std::int64_t chunk, const Use& use) const {
        const auto count = static_cast<std::int64_t>(bricks_.bricks.size());
        for (std::int64_t i = chunk * kChunk; i < std::min((chunk + 1) * kChunk, count); ++i)
            use(i);
    }
    template <class Use>
    void each_tile(std::int64_t i, const Use& use) const {
        const auto along = [&](std::size_t axis, std::int64_t count) {
            const float pixel = middles_[index(i)][axis] - static_cast<float>(region_.begin[axis]);
            const auto width = static_cast<float>(kTile), top = static_cast<float>(count - 1);
            const float first = std::floor(std::ceil(pixel - half_[axis]) / width),
                        last = std::floor(std::floor(pixel + half_[axis]) / width);
            return std::array{static_cast<std::int64_t>(std::clamp(first, 0.0f, top + 1)),
                              static_cast<std::int64_t>(std::clamp(last, -1.0f, top))};
        };
        const auto [left, right] = along(0, across_);
        const auto [above, below] = along(1, down_);
        for (std::int64_t y = above; y <= below; ++y)
            for (std::int64_t x = left; x <= right; ++x) use(y * across_ + x);
    }

    const kernels::SortedBricks& bricks_;
    Region region_;
    std::int64_t across_, down_, chunks_;
    std::array<float, 2> half_{};
    std::pmr::vector<std::array<float, 2>> middles_;
    std::pmr::vector<std::int64_t> starts_;  // of chunks in tiles, one after another
    std::pmr::vector<std::int32_t> order_;
};

void run_sorted(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
                Context& context) {
    const Request& want = ask.want;
    const auto beside = sorted_bricks_of(in, sorted_facet_of(want, in.what.values));
    const std::optional<kernels::Kept> kept = kept_of(in.what, want, context.view);
    // Cells begin where those of the caster do.
    const kernels::RayCast cast{.volume = rule_grid(in, want),
                                .hold = kernels::hold_of(filter_that_reads(offer.with)),
                                .rays = rays_of(in.what, want, context.view, -0.5),
                                .kept = kept ? &*kept : nullptr,
                                .step = offer.with.number("step"),
                                .unit = want.unit,
                                .miss = rule_miss(want)};
    const LaidOut laid(beside->sorted, residual(in.what, want, context.view), region,
                       context.memory);
    context.poll();
    const kernels::ShownBricks shown = laid.shown();
    // One room a thread, not a tile: fresh memory takes longer to touch than to fill.
    using Room = kernels::Block<std::byte>;
    tbb::enumerable_thread_specific<std::unique_ptr<Room>> rooms(
        [&] { return std::make_unique<Room>(kernels::sorted_room(), context.memory); });
    const std::int64_t row = out.row();
    for_tiles(region, kTile, kTile, context, [&](const Region& tile) {
        const Extent size = tile.extent();
        float* const first = out.at<float>(tile.begin[0], tile.begin[1], 0);
        kernels::sorted_mip(cast, beside->sorted, shown, laid.of(tile.begin[0], tile.begin[1]),
                            tile.begin[0], tile.begin[1], size.x, size.y, first, row,
                            rooms.local()->data());
        give_sign(want, first, size.x, size.y, row);
    });
}

}  // namespace

Transition sorted_mip() {
    Transition edge;
    edge.name = "project.sorted_mip";
    edge.source = "Mroz, Hauser, Groeller 2000; samples as project.ray_cast";
    for (const char* samples : {kSortedSamples, kSortedCoefficients})
        for (const char* facet : kSortedFacets)
            edge.joins.emplace_back(fmt::format("object/{}+{}", samples, facet), "screen/picture");
    edge.parameters = {
        {"filter", one_of({"zoh", "foh", "bspline3"}, "what reads the values")},
        {"step", number(0.01, 4, {1, 0.5}, "distance of samples, in the smallest spacing")}};
    edge.offer = offer_sorted;
    edge.work = work_sorted;
    edge.shared_counts = {measure_casting};
    edge.error = error_sorted;
    edge.parts = [](const Offer& offer, const Ask&) {
        return Partition{.kind = Partition::output,
                         .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
    };
    edge.run = run_sorted;
    edge.trials = [] { return picture_trials(Combine::max); };
    edge.factors = {{"", 0.53}};  // a guess: as project.ray_cast, whose samples it shares
    return edge;
}

}  // namespace edgewise
