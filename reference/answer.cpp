#include "reference/answer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory_resource>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "graph/label_surface.hpp"
#include "reference/label_light.hpp"
#include "reference/ray_cells.hpp"
#include "reference/written.hpp"

namespace edgewise {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kRaysAtOnce = 8192;  // bounds what is remembered of stretches
constexpr std::size_t kTogether = 64;      // visits of one task

/// Something to do in one tile of the input: one point, or cells first ... last of a ray.
struct Visit {
    std::int64_t tile = 0;
    std::size_t sample = 0;
    std::int64_t first = 0, last = 0;
};
using Visits = std::pmr::vector<Visit>;

/// Where the visits of each tile begin, and the end. Visits are sorted by tile, else in order.
std::vector<std::size_t> sort_by_tile(Visits& visits) {
    std::stable_sort(visits.begin(), visits.end(),
                     [](const Visit& a, const Visit& b) { return a.tile < b.tile; });
    std::vector<std::size_t> begins;
    for (std::size_t i = 0; i < visits.size(); ++i)
        if (i == 0 || visits[i].tile != visits[i - 1].tile) begins.push_back(i);
    begins.push_back(visits.size());
    return begins;
}

/// Calls body(group, share_out) for each group of visits, in any order and side by side. In it
/// share_out(take) calls take(part) for parts of the group's visits, likewise. A thread that waits
/// for the parts of one group begins no other, so no more groups are open than there are threads.
template <class Body>
void for_groups(const std::vector<std::size_t>& begins, const Body& body) {
    tbb::parallel_for(std::size_t{0}, begins.size() - 1, [&](std::size_t group) {
        body(group, [&](const auto& take) {
            tbb::this_task_arena::isolate([&] {
                tbb::parallel_for(
                    tbb::blocked_range<std::size_t>(begins[group], begins[group + 1], kTogether),
                    take);
            });
        });
    });
}

/// Cell k of a ray: the middle and the length of the part inside.
struct Cell {
    double middle, length;
};
Cell cell_of(const RaySpan& ray, std::int64_t k) {
    const double begin = ray.front + static_cast<double>(k) * ray.step;
    const double low = std::max(ray.low, begin);
    const double high = std::min(ray.high, begin + ray.step);
    return {0.5 * (low + high), high - low};
}
struct Cells {
    std::int64_t first, last;
};
Cells cells_along(const RaySpan& ray) {
    const double least = least_piece(ray, ray.step);
    const auto first =
        static_cast<std::int64_t>(std::floor((ray.low + least - ray.front) / ray.step));
    const auto last =
        static_cast<std::int64_t>(std::ceil((ray.high - least - ray.front) / ray.step)) - 1;
    return {first, std::max(first, last)};
}

}  // namespace

Reference::Reference(const Request& want, const ReferenceField& field,
                     std::pmr::memory_resource* memory)
    : want_(want),
      field_(field),
      geometry_(want),
      arriving_(want, field),
      own_(job_reference(want, field)),
      memory_(memory) {}

double Reference::range(double low, double high) const {
    const std::optional<double> own = own_ ? own_->range() : std::nullopt;
    return own ? *own : range_of(want_, low, high);
}

void Reference::expect_affordable(double samples) const {
    if (own_) own_->expect_affordable(samples);
}

int Reference::channels() const noexcept {
    if (!want_.job->of_rays()) return field_.channels();
    return want_.mode->channels;
}

bool Reference::sees_input(const OutputSample& at) const {
    if (want_.job->of_rays()) return geometry_.ray(at).has_value();
    if (!is_near_field()) return true;
    const std::optional<Vec3> p = geometry_.point(at);
    return p && field_.inside(*p);
}

std::int64_t Reference::tile_of(const Vec3& p) const {
    const Vec3 q = field_.clamped(p);
    const std::int64_t side = tile_side();
    const Extent& n = field_.extent();
    std::int64_t tile = 0;
    for (int axis = 2; axis >= 0; --axis)
        tile = tile * ((n[axis] + side - 1) / side) + static_cast<std::int64_t>(q[axis]) / side;
    return tile;
}

Region Reference::cells_of(std::int64_t tile) const {
    const std::int64_t side = tile_side();
    Region cells;
    for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t n = field_.extent()[axis], count = (n + side - 1) / side;
        cells.begin[axis] = tile % count * side;
        cells.end[axis] = std::min(n, cells.begin[axis] + side);
        tile /= count;
    }
    return cells;
}

double Reference::bytes(double samples, int threads) const noexcept {
    if (own_) return own_->bytes(threads);
    const bool tiled = field_.kind() == Field::spline;
    const std::int64_t side = tile_side();
    double visits = samples;
    if (want_.job->of_rays()) {
        visits = std::min(samples, static_cast<double>(kRaysAtOnce));
        // A straight line crosses at most as many tiles as there are faces between them, and one.
        std::int64_t tiles = 1;
        for (int axis = 0; tiled && axis < 3; ++axis) tiles += (field_.extent()[axis] - 1) / side;
        visits *= static_cast<double>(tiles);
    }
    // A vector that grows holds up to twice its size, and sorting takes half of it once more.
    const double each = 2.5 * sizeof(Visit) + sizeof(Stretch) + sizeof(std::size_t);
    // Where samples may not be finite, a second block holds the shares of the finite ones.
    const double blocks = field_.may_have_gaps() ? 2 : 1;
    const double block =
        tiled ? blocks * SplineBlock<double>::bytes({side, side, side}, field_.extent(),
                                                    FieldPiece::kMargin, field_.channels())
              : 0;
    return visits * each + threads * block;
}

std::vector<double> Reference::values(std::span<const OutputSample> samples) const {
    if (own_) return own_->values(samples);
    if (want_.job->of_points()) return warped(samples);
    std::vector<double> values(samples.size() * static_cast<std::size_t>(channels()), kNone);
    for (std::size_t begin = 0; begin < samples.size(); begin += kRaysAtOnce)
        render(samples.subspan(begin, std::min(kRaysAtOnce, samples.size() - begin)),
               values.data() + begin * static_cast<std::size_t>(channels()));
    return values;
}

std::vector<double> Reference::warped(std::span<const OutputSample> samples) const {
    const auto channels = static_cast<std::size_t>(this->channels());
    std::vector<double> values(samples.size() * channels, kNone);
    Visits visits(memory_);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const std::optional<Vec3> p = geometry_.point(samples[i]);
        if (p && field_.inside(*p)) visits.push_back({.tile = tile_of(*p), .sample = i});
    }
    const std::vector<std::size_t> begins = sort_by_tile(visits);
    // Prefiltering a tile costs as much as this many single samples (measured: 24 in a volume).
    constexpr std::size_t kWorthATile = 24;
    for_groups(begins, [&](std::size_t group, const auto& share_out) {
        std::optional<FieldPiece> piece;
        if (begins[group + 1] - begins[group] >= kWorthATile)
            piece.emplace(field_, cells_of(visits[begins[group]].tile), memory_);
        share_out([&](const tbb::blocked_range<std::size_t>& part) {
            for (std::size_t i = part.begin(); i < part.end(); ++i) {
                double* value = values.data() + visits[i].sample * channels;
                const Vec3 p = *geometry_.point(samples[visits[i].sample]);
                const bool present = piece ? piece->at(p, value) : field_.at(p, {value, channels});
                if (!present) std::fill_n(value, channels, kNone);
            }
        });
    });
    return values;
}

void Reference::render(std::span<const OutputSample> samples, double* values) const {
    Visits visits(memory_);
    const bool tiled = field_.kind() == Field::spline;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const std::optional<RaySpan> ray = geometry_.ray(samples[i]);
        if (!ray) continue;
        const auto [first, last] = cells_along(*ray);
        if (!tiled) {
            visits.push_back({static_cast<std::int64_t>(i / kTogether), i, first, last});
            continue;
        }
        for (std::int64_t k = first; k <= last; ++k) {
            const std::int64_t tile =
                tile_of(ray->origin + cell_of(*ray, k).middle * ray->direction);
            if (k > first && visits.back().tile == tile)
                visits.back().last = k;
            else
                visits.push_back({tile, i, k, k});
        }
    }
    const std::vector<std::size_t> begins = sort_by_tile(visits);
    std::pmr::vector<Stretch> stretches(visits.size(), Stretch::empty(want_.mode), memory_);
    // Of a small input all rays meet one tile, so those of a tile are shared out as well.
    const auto take = [&](const FieldPiece& piece, const tbb::blocked_range<std::size_t>& part) {
        std::vector<double> value(static_cast<std::size_t>(field_.channels()));
        const auto value_at = [&](const Vec3& p) {
            return piece.at(p, value.data()) ? value[0] : kNone;
        };
        const auto lit_at = [&](const Vec3& p, double t, const LitFrame& frame,
                                ArrivingAlong* arriving) {
            const Vec3 gradient =
                want_.needs_gradients() ? piece.gradient(p, want_.gradient) : Vec3(Vec3::Zero());
            return frame.at(gradient, t, want_, arriving ? arriving->at(t) : Arriving{});
        };
        const auto add = [&](Stretch& to, const RaySpan& ray, const Cell& cell,
                             const LitFrame* frame, ArrivingAlong* arriving) {
            const Vec3 p = ray.origin + cell.middle * ray.direction;
            const double here = value_at(p);
            if (!std::isfinite(here)) return;
            if (!frame) return to.add(here, cell.length, want_);
            to.add_lit(
                here, cell.length, [&] { return lit_at(p, cell.middle, *frame, arriving); }, want_);
        };
        const auto follow = [&](Stretch& to, const RaySpan& ray, const Visit& visit,
                                const LitFrame& frame) {
            const auto place = [&](double t) -> Vec3 { return ray.origin + t * ray.direction; };
            const AlongRay along{.value = [&](double t) { return value_at(place(t)); },
                                 .lit =
                                     [&](double t) {
                                         return shows_labels(want_)
                                                    ? label_light(field_, value_at(place(t)), ray,
                                                                  t, frame, want_)
                                                    : lit_at(place(t), t, frame, nullptr);
                                     }};
            const auto at = [&](double t, double length) {
                to.follow(t, along.value(t), length, along, want_);
            };
            const auto [first, last] = cells_along(ray);
            // Each part of a ray begins with the last sample of the one before it.
            at(visit.first == first ? ray.low : cell_of(ray, visit.first - 1).middle, 0);
            for (std::int64_t k = visit.first; k <= visit.last; ++k)
                if (const Cell cell = cell_of(ray, k); cell.length > 0)
                    at(cell.middle, cell.length);
            if (visit.last == last) at(ray.high, 0);
        };
        for (std::size_t i = part.begin(); i < part.end(); ++i) {
            const OutputSample& pixel = samples[visits[i].sample];
            const RaySpan ray = *geometry_.ray(pixel);
            std::optional<LitFrame> frame;
            if (needs_frame(want_)) frame = geometry_.frame(pixel);
            if (want_.mode->first_hit) {
                follow(stretches[i], ray, visits[i], *frame);
                continue;
            }
            std::optional<ArrivingAlong> arriving;
            if (arriving_.any()) arriving.emplace(arriving_, ray, pixel.view);
            for (std::int64_t k = visits[i].first; k <= visits[i].last; ++k) {
                const Cell cell = cell_of(ray, k);
                if (cell.length > 0)
                    add(stretches[i], ray, cell, frame ? &*frame : nullptr,
                        arriving ? &*arriving : nullptr);
            }
        }
    };
    for_groups(begins, [&](std::size_t group, const auto& share_out) {
        const Region cells = tiled ? cells_of(visits[begins[group]].tile) : Region{};
        const FieldPiece piece(field_, cells, memory_);
        share_out([&](const tbb::blocked_range<std::size_t>& part) { take(piece, part); });
    });

    std::pmr::vector<std::size_t> order(visits.size(), memory_);
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return std::pair(visits[a].sample, visits[a].first) <
               std::pair(visits[b].sample, visits[b].first);
    });
    for (std::size_t i = 0; i < order.size();) {
        const std::size_t sample = visits[order[i]].sample;
        Stretch whole = Stretch::empty(want_.mode);
        for (; i < order.size() && visits[order[i]].sample == sample; ++i)
            whole.append(stretches[order[i]], want_.mode);
        whole.result(want_, values + sample * static_cast<std::size_t>(channels()));
    }
}

}  // namespace edgewise
