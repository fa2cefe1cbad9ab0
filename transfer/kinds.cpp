#include "transfer/kinds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "graph/words.hpp"
#include "reference/preview_block.hpp"
#include "reference/stored.hpp"
#include "transfer/suited.hpp"

namespace edgewise {
namespace {

/// Calls each(before, value) for the neighbours along x.
template <class Each>
void for_pairs(const Drawn& drawn, Each&& each) {
    for (std::size_t i = 0; i < drawn.runs(); ++i) {
        const auto run = drawn.run(i);
        for (std::size_t k = 1; k < run.size(); ++k) each(run[k - 1], run[k]);
    }
}

/// Few different whole numbers. Most neighbours away from the commonest are equal, and those that
/// differ mostly are no neighbours among the numbers either, as those of pictures are.
bool is_like_labels(const Drawn& drawn, double commonest) {
    constexpr std::size_t kMask = 4, kMost = 256;
    constexpr double kEqual = 0.6, kSteps = 0.7;
    double pairs = 0, equal = 0;
    for_pairs(drawn, [&](float before, float value) {
        if (value != commonest) ++pairs, equal += value == before;
    });
    if (!(equal >= kEqual * pairs)) return false;
    std::set<float> found;
    float last = NAN;
    for (const float value : drawn.values()) {
        if (value == last) continue;
        last = value;
        if (found.insert(value).second && found.size() > kMost) return false;
    }
    if (found.size() <= kMask) return found.size() > 1;
    const std::vector<float> sorted(found.begin(), found.end());
    const auto rank = [&](float value) {
        return std::lower_bound(sorted.begin(), sorted.end(), value) - sorted.begin();
    };
    double unlike = 0, steps = 0;
    for_pairs(drawn, [&](float before, float value) {
        if (value == before) return;
        ++unlike;
        steps += std::abs(rank(value) - rank(before)) == 1;
    });
    return steps < kSteps * unlike;
}

/// The share of single samples of a box that are at least some value.
double share_of(const Data& data, const Region& box, int draws, double least) {
    if (box.empty()) return 0;
    const Extent& n = data.what.extent;
    const Extent size = box.extent();
    int found = 0;
    with_stored_type(data.what.type, [&](auto zero) {
        const auto* stored = data.as<decltype(zero)>();
        for (int i = 0; i < draws; ++i) {
            std::array<std::int64_t, 3> at;
            const std::array<std::int64_t, 3> sides{size.x, size.y, size.z};
            for (std::size_t k = 0; k < 3; ++k)
                at[k] = box.begin[k] +
                        static_cast<std::int64_t>(hashed(static_cast<std::uint64_t>(3 * i) + k) *
                                                  static_cast<double>(sides[k]));
            const std::int64_t index = data.what.channels * (at[0] + n.x * (at[1] + n.y * at[2]));
            found += data.what.values(as_double(stored[index])) >= least;
        }
    });
    return static_cast<double>(found) / draws;
}

/// How the body lies in the volume.
void take_shape(Look& look, const Data& data, double least) {
    constexpr int kOfFace = 192, kOfCentre = 512;
    constexpr double kTouched = 0.25;
    Region centre = Region::all(data.what.extent);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t n = centre.end[axis];
        for (const bool far : {false, true}) {
            Region face = Region::all(data.what.extent);
            (far ? face.begin : face.end)[axis] = far ? n - 1 : 1;
            look.open_faces += share_of(data, face, kOfFace, least) < kTouched;
        }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t n = centre.end[axis];
        centre.begin[axis] = n / 3;
        centre.end[axis] = std::max(n / 3 + 1, n - n / 3);
    }
    look.centre = share_of(data, centre, kOfCentre, least);
}

/// The share of samples that are above both neighbours along x, or below both.
double turns_of(const Drawn& drawn) {
    double triples = 0, turns = 0;
    for (std::size_t i = 0; i < drawn.runs(); ++i) {
        const auto run = drawn.run(i);
        for (std::size_t k = 2; k < run.size(); ++k) {
            ++triples;
            const float middle = run[k - 1];
            turns += (middle > run[k - 2] && middle > run[k]) ||
                     (middle < run[k - 2] && middle < run[k]);
        }
    }
    return triples > 0 ? turns / triples : 0;
}

/// How values of the body are distributed.
void take_values(Look& look, const Glance& glance, double least) {
    const double height = look.window.high - look.window.low;
    if (!(height > 0)) return;
    std::vector<float> body;
    double finite = 0, body_of_all = 0, bright = 0;
    for (const float value : glance.everywhere.values()) {
        finite += std::isfinite(value);
        body_of_all += value >= least;
        bright += value >= look.window.at(0.4);
    }
    if (finite == 0) return;
    look.body = body_of_all / finite;
    look.bright = bright / finite;
    const double lit = look.window.at(0.4);
    double of_bright = 0, beside = 0;
    for_pairs(glance.inside, [&](float before, float value) {
        of_bright += value >= lit;
        beside += (value >= lit) != (before >= lit);
    });
    if (of_bright > 0) look.thin = beside / of_bright;
    look.turns = turns_of(glance.inside);
    // Every second run is enough for quartiles; of few runs all are taken.
    constexpr std::size_t kFewRuns = 512;
    const std::size_t each = glance.inside.runs() > kFewRuns ? 2 : 1;
    for (std::size_t i = 0; i < glance.inside.runs(); i += each)
        for (const float value : glance.inside.run(i))
            if (value >= least) body.push_back(value);
    if (body.empty()) return;
    const double lower = quantile_of(body, 0.25), upper = quantile_of(body, 0.75);
    look.middle = (quantile_of(body, 0.5) - look.window.low) / height;
    look.spread = (upper - lower) / height;
}

// --- the kinds

bool may_be(const Look& look, const char* modality) {
    return look.file.modality.empty() || look.file.modality == modality;
}
/// Objects far smaller than a patient.
bool is_small(const Look& look) {
    return look.file.millimetres > 0 && size_share(look.extent, look.spacing) < 1;
}
bool is_of_patient(const Look& look) {
    return look.file.millimetres > 0 && !is_small(look) && look.longest() >= 60;
}
/// The same where lengths without a unit are taken for mm, as most programs do. What has no noise
/// was computed, not scanned.
bool may_be_of_patient(const Look& look) {
    if (look.file.millimetres > 0) return is_of_patient(look);
    constexpr double kScanned = 0.1;
    Look in_mm = look;
    in_mm.file.millimetres = 1;
    return look.turns > kScanned && is_of_patient(in_mm);
}
/// Most of the volume is dark, and most of the rest is dim.
bool glows(const Look& look) {
    return look.bright < 0.03 || (look.bright < 0.15 && look.middle < 0.4);
}
/// A few samples are far brighter than all others, and in thin structures.
bool is_sparse_and_bright(const Look& look) { return look.bright < 0.04 && look.thin > 0.06; }

bool are_labels(const Look& look) { return look.file.labels; }
bool are_like_labels(const Look& look) { return look.like_labels; }
bool is_ct(const Look& look) {
    if (!may_be(look, "CT")) return false;
    if (look.hounsfield) return look.hounsfield == 0;
    return look.file.modality == "CT" && !is_small(look);
}
bool is_shifted_ct(const Look& look) { return may_be(look, "CT") && look.hounsfield; }
bool is_fluorescence(const Look& look) {
    const std::string& modality = look.file.modality;
    if (modality == "SM" || modality == "GM") return true;
    if (!modality.empty()) return false;
    // Waves of light are 0.5 um long; no X-ray scanner of 2 um has samples as close to each other.
    constexpr double kOfLight = 2e-3;  // [mm]
    const bool glows_here = glows(look);
    if (look.file.millimetres > 0)
        return is_small(look) && (look.spacing.minCoeff() < kOfLight || look.file.channels > 1 ||
                                  (glows_here && look.longest() < 20));
    const std::string& format = look.file.format;
    return glows_here && (format == "TIFF" || format == "OME-Zarr");
}
bool is_micro_ct(const Look& look) { return may_be(look, "CT") && is_small(look); }
bool is_angiogram(const Look& look) {
    constexpr double kFine = 1.6;  // [mm]
    return may_be(look, "MR") && may_be_of_patient(look) && look.spacing.minCoeff() <= kFine &&
           is_sparse_and_bright(look);
}
/// As wide as a head along all axes, free on all sides but that of the neck, full in the middle, of
/// many tissues.
bool is_head(const Look& look) {
    constexpr double kLeast = 90, kMost = 330;  // [mm]
    return may_be(look, "MR") && is_of_patient(look) && look.shortest() >= kLeast &&
           look.longest() <= kMost && look.open_faces >= 5 && look.centre > 0.75 &&
           look.spread > 0.12;
}
bool is_any(const Look&) { return true; }

constexpr Kind kKinds[] = {
    {"labels", "labels", "labels", WindowRule::own, are_labels},
    {"like labels", "whole numbers that look like labels", "general", WindowRule::robust,
     are_like_labels, true},
    {"ct", "a CT in Hounsfield units", "ct-bone", WindowRule::own, is_ct},
    {"ct+1024", "a CT in Hounsfield units plus 1024", "ct-bone", WindowRule::own, is_shifted_ct},
    {"fluorescence", "what glows under a microscope", "microscopy", WindowRule::robust,
     is_fluorescence},
    {"micro-ct", "a CT of something small", "micro-ct", WindowRule::robust, is_micro_ct},
    {"mr-angio", "an angiogram: few samples are bright", "mr-angio", WindowRule::robust,
     is_angiogram},
    {"mr-head", "an MR of a head", "mr-head", WindowRule::robust, is_head},
    {"any", "data of no known kind", "general", WindowRule::robust, is_any},
};

}  // namespace

double Look::side(int axis) const noexcept {
    return file.millimetres > 0 ? static_cast<double>(extent[axis]) * spacing[axis] : 0;
}
double Look::shortest() const noexcept { return std::min({side(0), side(1), side(2)}); }
double Look::longest() const noexcept { return std::max({side(0), side(1), side(2)}); }

Look look_of(const Data& data, const Statistics& statistics, const Vec3& spacing,
             const FileFacts& file, const Glance& glance) {
    Look look;
    look.file = file;
    look.extent = data.what.extent;
    look.spacing = file.millimetres > 0 ? Vec3(spacing * file.millimetres) : spacing;
    look.window = glance.window;
    look.hounsfield = glance.hounsfield;
    if (!data.samples.data()) return look;
    look.like_labels = file.integers && data.what.channels == 1 &&
                       is_like_labels(glance.inside, statistics.commonest);
    const double least = look.window.at(kBody);
    take_values(look, glance, least);
    take_shape(look, data, least);
    return look;
}

std::span<const Kind> kinds() { return kKinds; }

const Kind& kind_of(const Look& look) {
    return *std::find_if(std::begin(kKinds), std::end(kKinds),
                         [&](const Kind& kind) { return kind.is(look); });
}

bool is_mr_of_tissue(const Kind& kind, const FileFacts& file) {
    return kind.is == is_head || (kind.is == is_any && file.modality == "MR");
}

}  // namespace edgewise
