#include "scene/model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <variant>

#include "graph/label_surface.hpp"
#include "graph/transform_graph.hpp"
#include "reference/sobel.hpp"
#include "reference/written.hpp"
#include "scene/scene.hpp"

namespace edgewise {

double PointMade::square(std::span<const double> got) const noexcept {
    double square = 0;
    for (std::size_t c = 0; c < expected.size(); ++c) {
        const double d = got[c] - expected[c];
        if (labels)
            square = std::max(square, d != 0 ? 1.0 : 0.0);
        else
            square += std::isfinite(d) ? d * d / static_cast<double>(expected.size()) : 0;
    }
    return square;
}

bool RayPiece::take(double end, double front, double step, std::int64_t& next) {
    cells_.take(end, front, step, ray_, next);
    places_.count = 0;
    for (std::size_t i = 0; i < cells_.count; ++i)
        places_.add(ray_.origin + cells_.middle[i] * ray_.direction);
    std::fill(known_.begin(), known_.end(), 0);
    return cells_.count > 0;
}

std::span<const double> RayPiece::held(const Filter& filter) {
    const auto place = static_cast<std::size_t>(1 + (&filter - filters().data()));
    if (!known_[place]) block_.read(filter, places_, values_[place].data());
    known_[place] = 1;
    return {values_[place].data(), cells_.count};
}

std::span<const double> RayPiece::reference() {
    if (!known_[0]) block_.reference(places_, values_[0].data());
    known_[0] = 1;
    return {values_[0].data(), cells_.count};
}

namespace {

/// Apart from each other, in a block of f32, so that neither rounding nor curvature counts.
constexpr double kDerivativeStep = 1.0 / 32;

}  // namespace

/// Calls each(t, value, length) at the cells' middles and, with length 0, where the ray enters and
/// leaves.
template <class ValueAt, class Each>
void RayPiece::in_order(std::span<const double> values, ValueAt&& value_at, Each&& each) const {
    constexpr double kSame = 1e-9;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const double half = cells_.length[i] / 2;
        if (cells_.middle[i] - half <= ray_.low + kSame) each(ray_.low, value_at(ray_.low), 0.0);
        each(cells_.middle[i], values[i], cells_.length[i]);
        if (cells_.middle[i] + half >= ray_.high - kSame) each(ray_.high, value_at(ray_.high), 0.0);
    }
}

double RayPiece::value_at(const Vec3& p, const Read& read) const {
    if (!block_.reaches(p)) return std::numeric_limits<double>::quiet_NaN();
    Places one;
    one.add(p);
    Values value;
    read(one, value.data());
    return value[0];
}

void RayPiece::each_in_order(const Filter& filter,
                             const std::function<void(double, double)>& each) {
    const auto read = [&](const Places& at, double* values) { block_.read(filter, at, values); };
    in_order(
        held(filter), [&](double t) { return value_at(ray_.origin + t * ray_.direction, read); },
        [&](double t, double value, double) { each(t, value); });
}

/// @param steps  of differences that make a gradient
/// @param read   the field whose values these are
void RayPiece::add_seen(std::span<const double> values, const Vec3& steps, const Read& read,
                        Stretch& to, const Request& want, const ArrivingAt& arriving) const {
    if (want.mode->first_hit) return follow(values, steps, read, to, want);
    add_lit(values, steps, read, to, want, arriving ? arriving : arriving_);
}

/// 1 or -1 where a smooth field ends at a face less than a step below or above; 0: at neither.
int RayPiece::inwards_at(const Vec3& p, int axis, double step, const Request& want) const {
    if (step >= 1 || want.field == Field::formula) return 0;
    const auto last = static_cast<double>(block_.field().extent()[axis] - 1);
    return (p[axis] < step ? 1 : 0) - (p[axis] + step > last ? 1 : 0);
}

/// That of the parabola through three places inside.
double RayPiece::slope_at_face(const Vec3& p, int axis, double step, double here,
                               const Read& read) const {
    const Vec3 aside = step * Vec3::Unit(axis);
    return (4 * value_at(p + aside, read) - value_at(p + 2 * aside, read) - 3 * here) / (2 * step);
}

/// By finite differences of the field that `read` knows.
Vec3 RayPiece::gradient_at(double t, const Vec3& steps, const Read& read,
                           const Request& want) const {
    const Vec3 place = ray_.origin + t * ray_.direction;
    const Vec3 p = want.field == Field::formula ? place : block_.field().clamped(place);
    const double here = value_at(p, read);
    if (want.smooths_gradients())
        return sobel_gradient(p, here, [&](const Vec3& at) { return value_at(at, read); });
    Vec3 gradient;
    for (int axis = 0; axis < 3; ++axis) {
        if (const int inwards = inwards_at(p, axis, steps[axis], want)) {
            gradient[axis] = slope_at_face(p, axis, inwards * steps[axis], here, read);
            continue;
        }
        const Vec3 aside = steps[axis] * Vec3::Unit(axis);
        const double below = value_at(p - aside, read), above = value_at(p + aside, read);
        gradient[axis] =
            ((std::isfinite(above) ? above : here) - (std::isfinite(below) ? below : here)) /
            (2 * steps[axis]);
    }
    return gradient;
}

void RayPiece::follow(std::span<const double> values, const Vec3& steps, const Read& read,
                      Stretch& to, const Request& want) const {
    const auto value = [&](double t) { return value_at(ray_.origin + t * ray_.direction, read); };
    const AlongRay along{.value = value, .lit = [&](double t) {
                             return frame_->at(want.needs_gradients()
                                                   ? gradient_at(t, steps, read, want)
                                                   : Vec3(Vec3::Zero()),
                                               t, want);
                         }};
    in_order(values, value, [&](double t, double here, double length) {
        to.follow(t, here, length, along, want);
    });
}

void RayPiece::add_lit(std::span<const double> values, const Vec3& steps, const Read& read,
                       Stretch& to, const Request& want, const ArrivingAt& arriving) const {
    std::array<std::size_t, Places::kMost> seen;
    std::size_t count = 0;
    // Beyond the outermost samples it is as at the outermost; a formula goes on.
    const auto at = [&](std::size_t i) {
        return want.field == Field::formula ? places_[i] : block_.field().clamped(places_[i]);
    };
    for (std::size_t i = 0; i < values.size(); ++i)
        if (std::isfinite(values[i]) &&
            (!want.mode->is_seen || want.mode->is_seen(values[i], want)))
            seen[count++] = i;
    const bool needs = want.needs_gradients(), smooth = want.smooths_gradients();
    std::array<Vec3, Places::kMost> gradients;
    Places beside;
    Values side[2];
    if (count > 0 && smooth) {
        std::fill_n(gradients.begin(), count, Vec3::Zero());
        for_sobel_taps([&](const SobelTap& tap) {
            beside.count = 0;
            for (std::size_t i = 0; i < count; ++i) beside.add(at(seen[i]) + tap.offset);
            read(beside, side[0].data());
            for (std::size_t i = 0; i < count; ++i)
                gradients[i] +=
                    (std::isfinite(side[0][i]) ? side[0][i] : values[seen[i]]) * tap.weight;
        });
    }
    for (int axis = 0; axis < 3 && count > 0 && needs && !smooth; ++axis) {
        for (int s = 0; s < 2; ++s) {
            beside.count = 0;
            for (std::size_t i = 0; i < count; ++i)
                beside.add(at(seen[i]) + (s == 0 ? -1 : 1) * steps[axis] * Vec3::Unit(axis));
            read(beside, side[s].data());
        }
        for (std::size_t i = 0; i < count; ++i) {
            const double here = values[seen[i]];
            const double below = std::isfinite(side[0][i]) ? side[0][i] : here;
            const double above = std::isfinite(side[1][i]) ? side[1][i] : here;
            gradients[i][axis] = (above - below) / (2 * steps[axis]);
            if (const int inwards = inwards_at(at(seen[i]), axis, steps[axis], want))
                gradients[i][axis] =
                    slope_at_face(at(seen[i]), axis, inwards * steps[axis], here, read);
        }
    }
    std::size_t next = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const bool is_seen = next < count && seen[next] == i;
        const Vec3* const gradient = is_seen ? &gradients[next++] : nullptr;
        const double t = cells_.middle[i];
        const auto lit = [&] {
            return frame_->at(needs && gradient ? *gradient : Vec3::Zero(), t, want,
                              arriving ? arriving(t) : Arriving{});
        };
        to.add_lit(values[i], cells_.length[i], lit, want);
    }
}

void RayPiece::add_held(const Filter& filter, Stretch& to, const Request& want,
                        const ArrivingAt& arriving) {
    if (!frame_) return add(held(filter), to, want);
    const auto read = [&](const Places& at, double* values) { block_.read(filter, at, values); };
    add_seen(held(filter), Vec3::Constant(filter.taps <= 2 ? 1 : kDerivativeStep), read, to, want,
             arriving);
}

void RayPiece::add_read(std::span<const double> values, const Vec3& steps, const Read& read,
                        Stretch& to, const Request& want, const ArrivingAt& arriving) {
    if (!frame_) return add(values, to, want);
    add_seen(values, steps, read, to, want, arriving);
}

// Beyond the outermost samples a formula goes on, and samples do as these.
void RayPiece::read_reference(const Places& at, double* values, const Request& want) const {
    Places held;
    held.count = 0;
    for (std::size_t i = 0; i < at.count; ++i)
        held.add(want.field == Field::formula ? at[i] : block_.field().clamped(at[i]));
    block_.reference(held, values);
}

Vec3 RayPiece::reference_steps(const Request& want) {
    const bool smooth = want.field == Field::spline || want.field == Field::formula;
    return Vec3::Constant(smooth ? kDerivativeStep : 1);
}

LightAbout RayPiece::light_about_hit(double before, double behind, const Request& want) const {
    LightAbout about;
    const Vec3 steps = reference_steps(want);
    const auto read = [&](const Places& at, double* values) { read_reference(at, values, want); };
    const auto is_above = [&](double at) {
        return value_at(ray_.origin + at * ray_.direction, read) >= want.level();
    };
    constexpr int kHalvings = 24;  // of an eighth: to 1e-8
    const bool above = is_above(behind);
    for (int i = 0; i < kHalvings; ++i) {
        const double middle = (before + behind) / 2;
        (is_above(middle) == above ? behind : before) = middle;
    }
    const auto gradient_of = [&](double at) { return gradient_at(at, steps, read, want); };
    about.gradient = gradient_of(behind);
    if (!about.gradient.allFinite()) return {};
    about.slope = std::abs(about.gradient.dot(ray_.direction));
    if (!frame_) return about;
    const auto light = [&](const Vec3& gradient) {
        const Lit lit = frame_->at(gradient, behind, want);
        return lit.diffuse + lit.specular;
    };
    const double step = 1e-3 * about.gradient.norm();
    for (int axis = 0; axis < 3 && step > 0; ++axis) {
        const Vec3 aside = step * Vec3::Unit(axis);
        about.by_gradient[axis] =
            (light(about.gradient + aside) - light(about.gradient - aside)) / (2 * step);
    }
    constexpr double kStep = 1.0 / 32;  // as far as differences of a block of f32 tell
    const Vec3 turn = gradient_of(behind + kStep) - gradient_of(behind - kStep);
    if (turn.allFinite()) about.along = about.by_gradient.dot(turn) / (2 * kStep);
    return about;
}

void RayPiece::add_reference(Stretch& to, const Request& want, double after) {
    Values behind;
    std::span<const double> seen = reference();
    if (count() > 0 && cells_.middle[0] <= after) {
        std::copy(seen.begin(), seen.end(), behind.begin());
        for (std::size_t i = 0; i < count() && cells_.middle[i] <= after; ++i)
            behind[i] = std::numeric_limits<double>::quiet_NaN();
        seen = {behind.data(), count()};
    }
    if (!frame_) return add(seen, to, want);
    const auto read = [&](const Places& at, double* values) { read_reference(at, values, want); };
    add_seen(seen, reference_steps(want), read, to, want, {});
}

RayAnswer::RayAnswer(const Stretch& reference, const Request& want, const Nearby& nearby)
    : want_(want),
      reference_(reference),
      nearby_(nearby),
      channels_(written_channels(want, want.mode->channels)),
      expected_(written(reference)),
      transparency_(want.mode->left ? want.mode->left(reference) : 1) {}

PixelValues RayAnswer::written(const Stretch& got) const noexcept {
    PixelValues values{};
    got.result(want_, values.data());
    as_written(want_, values.data());
    return values;
}

double RayAnswer::between(const Stretch& a, const Stretch& b) const noexcept {
    const PixelValues values = written(a);
    const Threshold* const threshold = want_.mode->threshold;
    if (!threshold || !threshold->flip) return between(values, written(b));
    Stretch flipped = a;
    threshold->flip(flipped);
    return between(values, written(flipped)) *
           share_between(threshold->margin(a, want_), threshold->margin(b, want_), nearby_);
}

double RayAnswer::fourth(double square) const noexcept {
    const Threshold* const threshold = want_.mode->threshold;
    if (!(nearby_.within > 0) || !threshold || !threshold->flip) return 0;
    Stretch flipped = reference_;
    threshold->flip(flipped);
    return square * between(written(flipped), expected_);
}

double RayAnswer::between(const PixelValues& a, const PixelValues& b) const noexcept {
    return mean_square(a.data(), b.data(), channels_);
}

namespace {

/// The boxes of the input that paths read samples of, the whole first.
std::vector<Region> boxes_of(const TransformGraph& spanned, const Request& want) {
    std::vector<Region> boxes = {Region::all(want.input)};
    for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph))) {
        const Representation& from = spanned.graph[arc].offer.from;
        if (from.space != "object" || from.content != "scalar" || from.placed.one_a_view())
            continue;
        Region box;
        for (int axis = 0; axis < 3; ++axis) {
            box.begin[axis] = std::llround(-from.placed.at(0).matrix()(axis, 3));
            box.end[axis] = box.begin[axis] + from.extent[axis];
        }
        if (std::find(boxes.begin(), boxes.end(), box) == boxes.end()) boxes.push_back(box);
    }
    return boxes;
}

/// Those that edges try or that are asked for, in the order of filters().
std::vector<const Filter*> filters_of(const Catalogue& catalogue, const Demands& asked) {
    std::set<std::string> names;
    const auto add = [&](const Value& value) {
        if (const auto* word = std::get_if<std::string>(&value)) names.insert(*word);
    };
    for (const Transition& edge : catalogue) {
        const auto found = edge.parameters.find("filter");
        if (found == edge.parameters.end()) continue;
        for (const Value& value : found->second.tried) add(value);
    }
    for (const Demand& demand : asked.via) {
        const auto found = demand.with.all().find("filter");
        if (found != demand.with.all().end()) add(found->second);
    }
    std::vector<const Filter*> used;
    for (const Filter& filter : filters())
        if (names.contains(filter.name)) used.push_back(&filter);
    return used;
}

}  // namespace

std::vector<std::shared_ptr<const Model>> models_of(const Catalogue& catalogue,
                                                    const Representation& input,
                                                    const PreviewOf& of, ModelSetting& setting) {
    if (of.spanned) {
        setting.boxes = boxes_of(*of.spanned, setting.want);
    } else {
        const Scene scene = unseen_scene(setting.statistics);
        setting.boxes = boxes_of(expand(catalogue, {setting.want, scene}, {{input}}), setting.want);
    }
    setting.filters = filters_of(catalogue, of.asked);
    setting.asked = &of.asked;
    if (of.wanted) {
        setting.wanted = *of.wanted;
        for (const Transition& edge : catalogue)
            if (edge.derives) edge.derives(*setting.wanted);
    }
    std::vector<std::shared_ptr<const Model>> models;
    const auto add = [&](bool warps) {
        for (const Transition& edge : catalogue) {
            const bool makes_screen =
                std::any_of(edge.joins.begin(), edge.joins.end(),
                            [](const auto& join) { return join.second == "screen/scalar"; });
            if (!edge.model || makes_screen != warps) continue;
            if (!edge.views_refused(setting.want).empty()) continue;
            auto model = edge.model(setting);
            if (!model || std::ranges::none_of(model->facts(), [&](const ModelFact& fact) {
                    return setting.wants(fact.name);
                }))
                continue;
            for (const auto& made : model->makes()) setting.warps.push_back(made);
            models.push_back(std::move(model));
        }
    };
    add(true);
    add(false);
    return models;
}

}  // namespace edgewise
