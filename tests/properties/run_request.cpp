#include "tests/properties/run_request.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "planner/priced_graph.hpp"
#include "reference/verify.hpp"
#include "runtime/runtime.hpp"
#include "scene/scene.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

double exact_cosine(double degrees) {
    const double quarters = degrees / 90;
    if (quarters == std::round(quarters)) {
        const int turn = ((static_cast<int>(quarters) % 4) + 4) % 4;
        return turn == 0 ? 1 : turn == 2 ? -1 : 0;
    }
    return std::cos(degrees * std::numbers::pi / 180);
}

Mat4 about_axis(int axis, double degrees) {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    const double c = exact_cosine(degrees), s = exact_cosine(degrees - 90);
    Mat4 turn = Mat4::Identity();
    turn(i, i) = turn(j, j) = c;
    turn(i, j) = -s;
    turn(j, i) = s;
    return turn;
}

Mat4 shift(const Vec3& by) {
    Mat4 map = Mat4::Identity();
    map.block<3, 1>(0, 3) = by;
    return map;
}

Vec3 centre(const Extent& extent) { return Vec3(extent.x - 1, extent.y - 1, extent.z - 1) / 2; }

template <class T>
void append_values(const Data& data, std::vector<float>& values) {
    const auto count = static_cast<std::size_t>(data.what.samples() * data.what.channels);
    for (std::size_t i = 0; i < count; ++i)
        values.push_back(static_cast<float>(data.what.values(data.as<T>()[i])));
}

}  // namespace

Mat4 rotation(double x, double y, double z) {
    return about_axis(2, z) * about_axis(1, y) * about_axis(0, x);
}

Request request_of(Job job, Mode mode, const Representation& input,
                   const std::vector<Mat4>& turns) {
    Request want;
    want.job = job;
    want.mode = mode;
    if (mode->takes_level) want.surface = SurfaceOf{0.5};
    want.axes = input.axes;
    want.input = input.extent;
    want.frames = static_cast<int>(turns.size());
    want.screen = input.extent;
    if (job == Job::render) {
        const auto longest = static_cast<std::int64_t>(
            std::ceil(std::hypot(input.extent.x, input.extent.y, input.extent.z)));
        want.screen = {longest, longest, longest};
    }
    std::vector<Mat4> maps;
    for (const Mat4& turn : turns)
        maps.push_back(shift(centre(want.screen)) * turn * shift(-centre(input.extent)));
    want.views = Placement::each(maps);
    want.transfer.points = {{0, 0, {0, 0, 0}}, {1, 0.1, {1, 1, 1}}};
    return want;
}

Scene scene_of(const Data& input, const Request& want, MemoryBudget& memory,
               const Phantom* formula) {
    return measure_scene(catalogue(), input, statistics_of(input, &memory), want, formula, &memory);
}

std::vector<std::shared_ptr<const Data>> results_of(const Plan& plan, const Ask& ask,
                                                    std::shared_ptr<const Data> input, int threads,
                                                    MemoryBudget& memory) {
    std::vector<std::shared_ptr<const Data>> results(ask.want.frames);
    RunOptions options;
    options.threads = threads;
    options.memory = &memory;
    run(
        plan, ask, std::move(input),
        [&](int frame, std::shared_ptr<const Data> result) { results[frame] = std::move(result); },
        options);
    return results;
}

std::vector<Plan> paths_of(const Catalogue& catalogue, const Ask& ask, const Representation& input,
                           std::size_t limit, const Demands& demands) {
    const PlanOptions options{.demands = demands};
    const PricedGraph graph(catalogue, ask, {{input}}, default_profile(catalogue), options);
    return all_paths(graph.real(), catalogue, ask, options, limit);
}

std::vector<float> values_of(const Data& data) {
    std::vector<float> values;
    switch (data.what.type) {
        case Type::u8:
            append_values<std::uint8_t>(data, values);
            break;
        case Type::i16:
            append_values<std::int16_t>(data, values);
            break;
        case Type::u16:
            append_values<std::uint16_t>(data, values);
            break;
        default:
            append_values<float>(data, values);
    }
    return values;
}

Expected::Expected(const Request& want, const ReferenceField& field,
                   std::pmr::memory_resource* memory) {
    const Reference reference(want, field, memory);
    channels_ = static_cast<std::size_t>(reference.channels());
    const Extent n = want.output();
    std::vector<OutputSample> samples;
    for (int frame = 0; frame < want.frames; ++frame)
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x) samples.push_back({frame, x, y, z});
    values_ = reference.values(samples);
    if (want.job == Job::render && want.mode->over_background) {
        // What is written over black is the premultiplied colour; opacity is not written.
        if (want.background != std::array<double, 3>{0, 0, 0})
            throw std::invalid_argument("over black alone");
        for (std::size_t i = 3; i < values_.size(); i += 4)
            values_[i] = std::numeric_limits<double>::quiet_NaN();
    }
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (double value : values_) {
        if (std::isnan(value)) continue;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    range_ = range_between(low, high);
}

double Expected::error_of(const std::vector<std::shared_ptr<const Data>>& results) const {
    double sum = 0, count = 0;
    std::size_t at = 0;
    for (const auto& frame : results)
        for (float value : values_of(*frame)) {
            const double difference = value - values_[at++];
            if (std::isnan(difference)) continue;
            sum += difference * difference;
            ++count;
        }
    return count > 0 ? std::sqrt(sum / count) / range_ : 0;
}

double rms_difference(const std::vector<std::shared_ptr<const Data>>& a,
                      const std::vector<std::shared_ptr<const Data>>& b) {
    double sum = 0, count = 0;
    for (std::size_t frame = 0; frame < a.size(); ++frame) {
        const std::vector<float> x = values_of(*a[frame]), y = values_of(*b[frame]);
        for (std::size_t i = 0; i < x.size(); ++i) sum += std::pow(double(x[i]) - y[i], 2);
        count += static_cast<double>(x.size());
    }
    return std::sqrt(sum / count);
}

}  // namespace edgewise
