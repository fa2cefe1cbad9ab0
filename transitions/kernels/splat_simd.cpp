// Whole footprints added to a picture.
#include "transitions/kernels/splat.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/splat_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/splat-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

constexpr int kCellBits = 5;
static_assert(Footprints::Shape{}.cells == 1 << kCellBits);

/// The samples of a row between the first and the last that are not empty.
template <class T>
SplatSpan span_of(const T* row, std::int64_t n, float empty) {
    const hn::ScalableTag<T> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    const auto one = static_cast<T>(empty);
    const auto nothing = hn::Set(d, one);
    const auto is_empty = [&](std::int64_t i) {
        return hn::AllTrue(d, hn::Eq(hn::LoadU(d, row + i), nothing));
    };
    std::int64_t begin = 0, end = n;
    while (begin + lanes <= n && is_empty(begin)) begin += lanes;
    while (begin < n && row[begin] == one) ++begin;
    while (end - lanes >= begin && is_empty(end - lanes)) end -= lanes;
    while (end > begin && row[end - 1] == one) --end;
    return {static_cast<std::int32_t>(begin), static_cast<std::int32_t>(end)};
}

void spans_on(const Splat& splat, std::int64_t begin, std::int64_t end, SplatSpan* spans) {
    const Grid& volume = splat.volume;
    const auto by = [&](const auto& of_row) {
        for (std::int64_t z = begin; z < end; ++z)
            for (std::int64_t y = 0; y < volume.extent.y; ++y)
                spans[z * volume.extent.y + y] =
                    of_row(z * volume.slice_step() + y * volume.row_step());
    };
    const auto typed = [&](auto sample) {
        using T = decltype(sample);
        const std::array<double, 2> range = limits_of(volume.type);
        const bool holds = splat.empty >= range[0] && splat.empty <= range[1] &&
                           static_cast<float>(static_cast<T>(splat.empty)) == splat.empty;
        const std::int64_t n = volume.extent.x;
        by([&](std::int64_t first) {
            // Of a type that cannot hold what is empty, no sample is.
            return holds ? span_of(volume.as<T>() + first, n, splat.empty)
                         : SplatSpan{0, static_cast<std::int32_t>(n)};
        });
    };
    switch (volume.type) {
        case Type::u8:
            return typed(std::uint8_t{});
        case Type::i8:
            return typed(std::int8_t{});
        case Type::u16:
            return typed(std::uint16_t{});
        case Type::i16:
            return typed(std::int16_t{});
        case Type::f32:
            return typed(float{});
        default: {
            const ScalarLoad load = scalar_load(volume.type);
            by([&](std::int64_t first) {
                SplatSpan span{0, static_cast<std::int32_t>(volume.extent.x)};
                const auto is_empty = [&](std::int32_t x) {
                    return load(volume.samples, first + x) == splat.empty;
                };
                while (span.begin < span.end && is_empty(span.begin)) ++span.begin;
                while (span.begin < span.end && is_empty(span.end - 1)) --span.end;
                return span;
            });
        }
    }
}

/// The footprints of rows of voxels.
template <class Read, bool kShort>
class RowsOfVoxels {
 public:
    RowsOfVoxels(const Splat& splat, const SplatSums& sums)
        : splat_(splat), sums_(sums), lookup_(splat) {}

    void add(const Splatted* list, std::int64_t count, std::int64_t y, std::int64_t z) const {
        const Extent& n = splat_.volume.extent;
        const float* inner = nullptr;
        for (std::int64_t k = 0; k < count; ++k) {
            const auto [x, value] = list[k];
            const Patch patch(splat_, double(x), double(y), double(z));
            if (!patch.meets(splat_, sums_)) continue;
            const bool inside = x > 0 && x < n.x - 1;
            if (inside && !inner) inner = table_of(splat_, x, y, z);
            const float* table = inside ? inner : table_of(splat_, x, y, z);
            const auto left = static_cast<std::int32_t>(patch.left);
            const auto top = static_cast<std::int32_t>(patch.top);
            std::array<std::uint32_t, 2> at;
            for (std::size_t i = 0; i < 2; ++i)
                at[i] = splat_.across[i].of(x, y, z) + splat_.across[i].right(left) +
                        splat_.across[i].down(top);
            add_patch(table, value, at,
                      sums_.first + (top - sums_.begin[1]) * sums_.pitch + left - sums_.begin[0]);
        }
    }

 private:
    HWY_INLINE void add_patch(const float* table, float value,
                              const std::array<std::uint32_t, 2>& at, float* first) const {
        using To = Vectors<kShort>;
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(table);
        const VF scale = hn::Set(Floats(), value);
        const auto& [a, b] = splat_.across;
        for (int j = 0; j < splat_.patch[1]; j += To::kRows)
            for (int i = 0; i < splat_.patch[0]; i += To::kColumns) {
                const VW place =
                    lookup_.places(at[0] + a.right(i) + a.down(j), at[1] + b.right(i) + b.down(j));
                const VF footprint =
                    gather_one<Read>(bytes, hn::BitCast(Ints(), hn::ShiftLeft<2>(place)));
                To::add(hn::Mul(footprint, scale), first + j * sums_.pitch + i, sums_.pitch);
            }
    }

    const Splat& splat_;
    const SplatSums& sums_;
    Lookup<kShort, kCellBits> lookup_;
};

struct Slices {
    const Splat& splat;
    std::int64_t begin, end;
    const SplatSums& sums;
    Splatted* row;

    template <class Read, bool kShort>
    void run() const {
        const RowsOfVoxels<Read, kShort> voxels(splat, sums);
        each_row(splat, begin, end, sums, row,
                 [&](const Splatted* list, std::int64_t count, std::int64_t y, std::int64_t z) {
                     voxels.add(list, count, y, z);
                 });
    }
    template <class Read>
    void run_by() const {
        if constexpr (kMost >= kNarrow)
            if (splat.patch[0] <= kNarrow) return run<Read, true>();
        run<Read, false>();
    }
};

void splat_on(const Splat& splat, std::int64_t begin, std::int64_t end, const SplatSums& sums,
              Splatted* row) {
    const Slices slices{splat, begin, end, sums, row};
#if EDGEWISE_LOADS
    if (gathers_are_slow()) return slices.run_by<Reads<float, true>>();
#endif
    slices.run_by<Reads<float, false>>();
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(spans_on);
HWY_EXPORT(splat_on);

void find_spans(const Splat& splat, std::int64_t begin, std::int64_t end, SplatSpan* spans) {
    HWY_DYNAMIC_DISPATCH(spans_on)(splat, begin, end, spans);
}

void splat(const Splat& splat, std::int64_t begin, std::int64_t end, const SplatSums& sums,
           Splatted* row) {
    HWY_DYNAMIC_DISPATCH(splat_on)(splat, begin, end, sums, row);
}

}  // namespace edgewise::kernels
#endif
