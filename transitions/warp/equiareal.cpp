#include "transitions/warp/equiareal.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <optional>

#include "graph/picture_facts.hpp"
#include "graph/spread.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/warp/shear_chain.hpp"

namespace edgewise {
namespace {

constexpr double kEquiareal = 1e-9;  // of a determinant; what shear_chain needs

std::string samples_refused(const Representation& from, const Ask& ask) {
    if (ask.want.eye) return "the eye is at a finite distance: its rays are not parallel to z";
    if (ask.want.projective()) return "a projective map is not equiareal";
    if (from.type == Type::c64) return "complex samples have no hold";
    if (!is_whole(from) && !is_spread(from)) return "needs all samples in memory, row by row";
    return {};
}

/// A rotation or a reflection with one. Each has a chain whose points move by at most
/// (3 + sqrt 2) / 4 = 1.104 samples by shears of at most 1.06 samples a line: what holds for
/// all needs not be worked out for each of hundreds of views.
bool turns(const Mat4& map) {
    constexpr double kOrthogonal = 1e-12;
    const Eigen::Matrix3d linear = map.topLeftCorner<3, 3>();
    return (linear * linear.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <=
           kOrthogonal;
}

/// shear_chain(), which tries some 150 products: a planner asks several edges for the same views
/// one after another.
const std::optional<kernels::ShearChain>& remembered_chain(const kernels::Affine& map) {
    struct Entry {
        bool filled = false;
        kernels::Affine map{};
        std::optional<kernels::ShearChain> chain;
    };
    thread_local std::array<Entry, 64> entries;
    std::uint64_t hash = 1469598103934665603u;  // FNV-1a
    for (const double number : map)
        hash = (hash ^ std::bit_cast<std::uint64_t>(number)) * 1099511628211u;
    Entry& entry = entries[(hash >> 32) % entries.size()];
    const auto same = [](double a, double b) {  // with -0 and NaN
        return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
    };
    if (!entry.filled || !std::equal(map.begin(), map.end(), entry.map.begin(), same))
        entry = {true, map, shear_chain(map)};
    return entry.chain;
}

}  // namespace

std::string not_equiareal(
    const Representation& from, const Ask& ask,
    const std::function<std::string(int view, const kernels::ShearChain&)>& judge) {
    if (std::string reason = samples_refused(from, ask); !reason.empty()) return reason;
    const Placement& views = ask.want.views;
    for (int variant = 0; variant < views.different(); ++variant) {
        const int view = views.first_view(variant);
        const Mat4 map = residual(from, ask.want, view);
        if (turns(map)) continue;
        const double det = map.topLeftCorner<3, 3>().determinant();
        if (!(std::abs(std::abs(det) - 1) <= kEquiareal))
            return fmt::format("view {}: the determinant is {:.6g}; shears need 1 or -1", view,
                               det);
        const auto& chain = remembered_chain(kernels::affine_of(map));
        if (!chain) return fmt::format("view {}: no product of shears gives its map to 1e-9", view);
        if (std::string reason = judge(view, *chain); !reason.empty()) return reason;
    }
    return {};
}

kernels::ShearChain chain_of(const Representation& from, const Request& want, int view) {
    const auto& chain = remembered_chain(kernels::affine_of(residual(from, want, view)));
    if (!chain) throw RunError(fmt::format("view {}: no product of shears gives its map", view));
    return *chain;
}

kernels::Affine inverse_map(const Representation& from, const Request& want, int view) {
    return kernels::affine_of(residual(from, want, view).inverse());
}

int axes_between_samples(const kernels::ShearChain& chain) {
    int axes = 0;
    for (double bound : chain.displacement) axes += bound > 1e-9;
    return axes;
}

double hold_error(const std::string& filter, const Ask& ask) {
    return hold_error(filter, filter_named(filter).guess, ask);
}

double hold_error(const std::string& name, double guess, const Ask& ask) {
    const Scene& scene = ask.scene;
    if (ask.want.job->of_rays())
        if (const auto fact = scene.fact(kCombinedError(name))) return *fact;
    if (const auto fact = scene.fact(kFieldError(name))) return *fact;
    return guess * (scene.high - scene.low);
}

}  // namespace edgewise
