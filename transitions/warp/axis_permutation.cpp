#include "transitions/warp/axis_permutation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <optional>
#include <tbb/parallel_for.h>

#include "graph/small_objects.hpp"
#include "transitions/kernels/axis_permutation.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/trials/trials.hpp"
#include "transitions/warp/outside.hpp"

namespace edgewise {
namespace {

using kernels::AxisPermutation;

bool to_screen(const Parameters& with) { return with.word("to") == "screen"; }

Mat4 matrix_of(const AxisPermutation& permutation) {
    const kernels::Affine map = kernels::affine_of(permutation);
    Mat4 matrix = Mat4::Identity();
    for (int i = 0; i < 12; ++i) matrix(i / 4, i % 4) = map[i];
    return matrix;
}

// ---- what stands outside
// -------------------------------------------------------------------------

using Stored = std::array<std::byte, 8>;

template <class T>
std::optional<Stored> stored_exactly(double value) {
    if (!(value >= double(std::numeric_limits<T>::lowest()) &&
          value <= double(std::numeric_limits<T>::max())) ||
        double(static_cast<T>(value)) != value)
        return {};
    const T sample = static_cast<T>(value);
    Stored bytes{};
    std::memcpy(bytes.data(), &sample, sizeof sample);
    return bytes;
}

std::optional<Stored> stored_half(double value) {
    for (std::uint32_t code = 0; code < 0x10000; ++code) {
        const auto half = static_cast<std::uint16_t>(code);
        if (double(kernels::float_of_half(half)) != value) continue;
        Stored bytes{};
        std::memcpy(bytes.data(), &half, sizeof half);
        return bytes;
    }
    return {};
}

/// The stored number that means the value, if there is one.
std::optional<Stored> stored(const Representation& as, double value) {
    value = (value - as.values.offset) / as.values.slope;
    switch (as.type) {
        case Type::u8:
            return stored_exactly<std::uint8_t>(value);
        case Type::i8:
            return stored_exactly<std::int8_t>(value);
        case Type::u16:
            return stored_exactly<std::uint16_t>(value);
        case Type::i16:
            return stored_exactly<std::int16_t>(value);
        case Type::u32:
            return stored_exactly<std::uint32_t>(value);
        case Type::i32:
            return stored_exactly<std::int32_t>(value);
        case Type::f16:
            return stored_half(value);
        case Type::f32:
            return stored_exactly<float>(double(static_cast<float>(value)));
        case Type::f64:
            return stored_exactly<double>(value);
        case Type::c64:
            return {};
    }
    return {};
}

bool covers(const AxisPermutation& permutation, const Extent& input, const Extent& screen) {
    for (int i = 0; i < 3; ++i) {
        const std::int64_t n = input[permutation.from[i]];
        const std::int64_t first =
            permutation.sign[i] > 0 ? permutation.shift[i] : permutation.shift[i] - n + 1;
        if (first > 0 || first + n < screen[i]) return false;
    }
    return true;
}

// ---- to the screen
// ---------------------------------------------------------------------------------

std::optional<AxisPermutation> permutation_to_screen(const Representation& from,
                                                     const Request& want, int view) {
    const Mat4 map = residual(from, want, view);
    if (map.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return {};
    return kernels::axis_permutation(kernels::affine_of(map));
}

/// Why the samples cannot be copied to the screen, or "".
std::string no_copy(const Representation& from, const Request& want, double outside) {
    bool covered = true;
    for (int variant = 0; variant < want.views.different(); ++variant) {
        const int view = want.views.first_view(variant);
        const auto permutation = permutation_to_screen(from, want, view);
        if (!permutation)
            return fmt::format(
                "view {}: its map is no signed permutation of the axes with a whole shift", view);
        covered = covered && covers(*permutation, from.extent, want.screen);
    }
    if (!covered && !stored(from, outside))
        return fmt::format("the value {} outside the input cannot be stored as {}", outside,
                           name_of(from.type));
    return {};
}

Offer offer_screen(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_copy(from, ask.want, outside_of(ask)); !reason.empty())
        return Offer::no(std::move(reason));
    Representation to = screen_scalar(from, ask.want);
    to.type = from.type;
    to.values = from.values;
    return {.from = from, .to = std::move(to), .with = with};
}

// ---- aligned with the rays
// -------------------------------------------------------------------------

/// The signed permutation that makes the input axis along which a ray advances fastest (in samples)
/// z; so no slice is crossed by less than 45 degrees, in samples, and the image's shear is at
/// most 1.
AxisPermutation permutation_to_rays(const Representation& from, const Request& want, int view) {
    const Mat4 map = residual(from, want, view);
    const Vec3 along = map.topLeftCorner<3, 3>().inverse() * Vec3::UnitZ();
    const int axis = kernels::fastest_axis(along);
    AxisPermutation permutation;
    permutation.from = {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2, axis};
    permutation.sign = {1, 1, along[axis] < 0 ? -1 : 1};
    return kernels::into_place(permutation, from.extent);
}

Offer offer_aligned(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!ask.want.job->of_rays()) return Offer::no("only pictures are made of aligned slices");
    if (ask.want.eye)
        return Offer::no("the eye is at a finite distance: no one axis fits all rays");
    if (from.axes != 3) return Offer::no("an image has no slices");
    const Placement& views = ask.want.views;
    Representation to = from;
    to.space = "aligned";
    to.drop_facets();
    to.extent = {1, 1, 1};
    std::vector<Mat4> maps;
    for (int view = 0; view < ask.want.frames; ++view) {
        const Mat4 map = residual(from, ask.want, view);
        if (!(std::abs(map.determinant()) > 1e-12))
            return Offer::no(
                fmt::format("view {}: determinant {:.3g}, no inverse", view, map.determinant()));
        const AxisPermutation permutation = permutation_to_rays(from, ask.want, view);
        const Extent extent = kernels::permuted_extent(permutation, from.extent);
        for (int i = 0; i < 3; ++i) to.extent[i] = std::max(to.extent[i], extent[i]);
        maps.push_back(matrix_of(permutation) * from.placed.at(view).matrix());
    }
    to.placed = views.one_a_view() ? Placement::each(std::move(maps)) : Placement(maps.at(0));
    return {.from = from, .to = std::move(to), .with = with};
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (from.type == Type::c64) return Offer::no("complex samples are not moved");
    if (from.layout != Layout::linear || from.place != Place::memory)
        return Offer::no("needs all samples in memory, row by row");
    return to_screen(with) ? offer_screen(from, ask, with) : offer_aligned(from, ask, with);
}

/// Rows that stay rows are copied, one after the other as they lie or each from another slice;
/// those that become columns are read sample by sample, in blocks that a cache holds: their lines
/// are what is streamed.
Work work(const Offer& offer, const Ask& ask, int view) {
    Work work{.streamed = offer.from.bytes() + offer.to.bytes()};
    const kernels::AxisPermutation permutation =
        to_screen(offer.with) ? permutation_to_screen(offer.from, ask.want, view).value()
                              : permutation_to_rays(offer.from, ask.want, view);
    if (permutation.from[0] != 0) {
        work.gathers = static_cast<double>(offer.from.samples());
        work.variant = "transposed";
    } else if (permutation.from[1] != 1) {
        work.variant = "exchanged";
    }
    return work;
}

/// The box of the input that a box of the screen is copied from.
Region reads(const AxisPermutation& permutation, const Extent& input, const Region& out) {
    Region in;
    for (int i = 0; i < 3; ++i) {
        const auto axis = static_cast<std::size_t>(permutation.from[i]);
        const std::int64_t a = permutation.sign[i] * (out.begin[i] - permutation.shift[i]);
        const std::int64_t b = permutation.sign[i] * (out.end[i] - 1 - permutation.shift[i]);
        const std::int64_t n = input[permutation.from[i]];
        in.begin[axis] = std::clamp<std::int64_t>(std::min(a, b), 0, n);
        in.end[axis] = std::clamp<std::int64_t>(std::max(a, b) + 1, 0, n);
    }
    return in;
}

Partition parts(const Offer& offer, const Ask& ask) {
    // Slices across the rays differ in extent from view to view.
    if (!to_screen(offer.with)) return {};
    return {.kind = Partition::output,
            .leaf = offer.to.extent,
            .reads = [from = offer.from, want = ask.want](const Region& out, int view) {
                return reads(permutation_to_screen(from, want, view).value(), from.extent, out);
            }};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    AxisPermutation permutation;
    Stored outside{};
    if (to_screen(offer.with)) {
        permutation = permutation_to_screen(offer.from, ask.want, context.view).value();
        outside = stored(offer.from, outside_of(ask)).value_or(Stored{});
    } else {
        permutation = permutation_to_rays(offer.from, ask.want, context.view);
        out.what.extent = kernels::permuted_extent(permutation, in.what.extent);
    }
    const std::size_t bytes = bytes_of(in.what.type);
    SmallVector<std::byte> beyond(bytes * in.what.channels);
    for (int c = 0; c < in.what.channels; ++c)
        std::memcpy(beyond.data() + c * bytes, outside.data(), bytes);
    // Blocks along the output axis that the input's rows become: whole lines of the input are read.
    const Region box = to_screen(offer.with) ? region : Region::all(out.what.extent);
    const Extent to = box.extent();
    const kernels::Grid grid = kernels::grid_of(in);
    constexpr std::int64_t kRows = 64;
    const int along = permutation.from[2] == 0 ? 2 : 1, other = 3 - along;
    const std::int64_t blocks = (to[along] + kRows - 1) / kRows;
    tbb::parallel_for(std::int64_t{0}, blocks * to[other], [&](std::int64_t i) {
        if (context.stopped()) return;
        Region part = box;
        part.begin[along] += i % blocks * kRows;
        part.end[along] = std::min(part.begin[along] + kRows, box.end[along]);
        part.begin[other] += i / blocks;
        part.end[other] = part.begin[other] + 1;
        kernels::copy_permuted(grid, beyond.size(), permutation, beyond.data(), out.samples.data(),
                               out.held(), part);
    });
    context.poll();
}

/// In the order of the samples, rows of each slice from all slices, and columns.
std::vector<Trial> trials() {
    std::vector<Trial> all = warp_trials();
    const auto copies = [&](const std::vector<double>& turn, const std::vector<int>& sizes) {
        for (const int size : sizes)
            for (const Type type : {Type::u8, Type::i16, Type::f32})
                all.push_back(copy_trial(fmt::format("phantom:gaussians:{}", size), type, turn));
    };
    copies({20, -15, 10}, {144, 190});
    copies({70, 10, 5}, {112, 144, 190});
    copies({10, 70, -25}, {144});
    return all;
}

}  // namespace

Transition axis_permutation_warp() {
    Transition edge;
    edge.name = "warp.axis_permutation";
    edge.source = "Wittenbrink 1993, 3.6.5; principal axis: Lacroute, Levoy 1994";
    edge.joins = {{"object/scalar", "screen/scalar"}, {"object/scalar", "aligned/scalar"}};
    edge.parameters = {
        {"to", one_of({"screen", "aligned"}, "the screen itself, or slices across the rays")}};
    edge.laws = {Law::identity, Law::constant, Law::linear, Law::whole_shift, Law::quarter_turn};
    edge.offer = offer;
    edge.work = work;
    edge.error = [](const Offer&, const Ask&) -> Error { return {.copies = true}; };
    edge.parts = parts;
    edge.run = run;
    edge.trials = trials;
    edge.factors = {{"", 0.93}};
    return edge;
}

}  // namespace edgewise
