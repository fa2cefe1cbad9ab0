#include "transitions/project/combine_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "graph/picture_facts.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

/// The length that sample k of a span stands for [samples].
double share_of(std::int64_t k, double low, double high) {
    const auto z = static_cast<double>(k);
    return (z + 1 > high ? high : z + 0.5) - (z - 1 < low ? low : z - 0.5);
}

/// A volume warped to the screen and combined there: samples at whole t, each for the cell around
/// it; what of the ray no sample's cell covers belongs to the nearest one (kernels/combine.hpp).
class CombinedRay final : public RayModel {
 public:
    CombinedRay(const RaySpan& ray, const ModelSetting& setting)
        : ray_(inwards(ray)),
          setting_(setting),
          next_(static_cast<std::int64_t>(std::ceil(ray_.low))),
          pictures_(setting.warps.size(), Stretch::empty(setting.want.mode)) {}

    void trace(const PreviewBlock& block, double end) override {
        const auto more = [&] {
            return static_cast<double>(next_) < end && static_cast<double>(next_) <= ray_.high;
        };
        while (more()) {
            Places places;
            std::array<double, Places::kMost> lengths, values;
            std::array<std::uint64_t, Places::kMost> alike;
            for (; more() && places.count < Places::kMost; ++next_) {
                const auto t = static_cast<double>(next_);
                // Roundings of a shear by 0.27 (of a turn by 30 degrees) repeat after some four
                // samples: neighbours on a ray are displaced alike, so that less averages out.
                constexpr double kAlike = 2;
                const double group = std::floor(t / kAlike);
                alike[places.count] =
                    static_cast<std::uint64_t>(std::abs(1e3 * (group + ray_.origin.sum())));
                lengths[places.count] = share_of(next_, ray_.low, ray_.high);
                places.add(ray_.origin + t * ray_.direction);
            }
            for (std::size_t i = 0; i < pictures_.size(); ++i) {
                setting_.warps[i].second->make(block, places, {alike.data(), places.count},
                                               values.data());
                pictures_[i].add({values.data(), places.count}, lengths.data(), setting_.want);
            }
        }
    }
    void finish(const RayAnswer& answer, RaySquares& squares) override {
        for (std::size_t i = 0; i < pictures_.size(); ++i) {
            const double square = answer.square(pictures_[i]);
            squares.add(i, square, answer.fourth(square));
        }
    }

 private:
    static RaySpan inwards(RaySpan ray) {
        const CombinedSpan span = combined_span(ray.low, ray.high);
        ray.low = span.low;
        ray.high = span.high;
        return ray;
    }

    RaySpan ray_;
    const ModelSetting& setting_;
    std::int64_t next_;
    std::vector<Stretch> pictures_;  // by warp
};

class CombineModel final : public Model {
 public:
    explicit CombineModel(const ModelSetting& setting) : setting_(setting) {
        for (const auto& [name, warp] : setting.warps)
            facts_.push_back({.name = kScreenError(name),
                              .like = warp->takes_samples() ? RayLook::kZoh1 : RayLook::kFoh1});
    }
    std::unique_ptr<RayModel> follow(const RaySpan& ray, const OutputSample&) const override {
        return std::make_unique<CombinedRay>(ray, setting_);
    }
    void derive(FactMaps& facts) const override {
        split(facts.upper);
        split(facts.likely);
    }

 private:
    /// Combining adds its error on exact samples (on the best ones, of a formula), which is
    /// independent of the errors of the samples. The rest of each picture's error is
    /// theirs. As errors may count more or less in a picture than their RMS tells (a blur hardly
    /// changes an integral, a random displacement averages out), kCombinedError is the error that,
    /// times the gain of linear interpolation, gives the picture's.
    void split(std::map<std::string, double>& facts) const {
        const auto picture = [&](const std::string& warp) { return facts.at(kScreenError(warp)); };
        const std::string& nearest = field_filter(Field::nearest).name;
        const std::string& linear = field_filter(Field::linear).name;
        // Where no sample is finite there is no field.
        if (!facts.contains(kScreenError(nearest)) || !facts.contains(kFieldError(linear))) return;
        const Field field = setting_.field.kind();
        double added = picture(field_filter(field).name);
        if (field == Field::formula)
            for (const auto& [name, warp] : setting_.warps) added = std::min(added, picture(name));
        const auto rest = [&](const std::string& warp) {
            return std::sqrt(std::max(0.0, picture(warp) * picture(warp) - added * added));
        };
        const double blur = facts.at(kFieldError(linear));
        const double gain = blur > 0 && rest(linear) > 0 ? rest(linear) / blur : 1;
        for (const auto& [name, warp] : setting_.warps)
            facts[kCombinedError(name)] = rest(name) / gain;
        // The real rule of an assignment repeats, and so does what it displaces: a pattern of it
        // need not average out as random displacements do, but not worse than noise of two samples
        // alike.
        const auto noise = facts.find(kNoiseGain(nearest)),
                   moved = facts.find(kCombinedError("me"));
        if (noise != facts.end() && moved != facts.end())
            moved->second = std::max(moved->second, std::numbers::sqrt2 * noise->second *
                                                        facts.at(kFieldError("me")) / gain);
        facts[kBlurGain] = gain;
        facts[kCombiningError] = added;
    }

    const ModelSetting& setting_;
};

}  // namespace

std::shared_ptr<const Model> combine_model(const ModelSetting& setting) {
    const Request& want = setting.want;
    const bool refused = want.eye || !no_slices(want).empty();
    if (!want.job->of_rays() || refused) return nullptr;
    return std::make_shared<CombineModel>(setting);
}

void add_combined_from(std::set<std::string>& wanted) {
    std::set<std::string> from;
    for (const std::string& fact : wanted)
        if (kCombinedError.has(fact))
            from.insert(kFieldError(fact.substr(kCombinedError.stem.size() + 1)));
    if (from.empty() && !wanted.contains(kBlurGain) && !wanted.contains(kCombiningError)) return;
    for (const Field field : {Field::nearest, Field::linear}) {
        const std::string& name = field_filter(field).name;
        from.insert(kFieldError(name));
        from.insert(kScreenError(name));
    }
    from.insert(kNoiseGain(field_filter(Field::nearest).name));
    wanted.merge(from);
}

}  // namespace edgewise
