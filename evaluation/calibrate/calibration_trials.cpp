#include "evaluation/calibrate/calibration_trials.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "graph/with_type.hpp"
#include "request/input.hpp"

namespace edgewise {
namespace {

/// The same values, rounded, in another type.
std::shared_ptr<Data> retyped(const Data& from, Type type, MemoryBudget* memory) {
    Representation what = from.what;
    what.type = type;
    const double top = type == Type::f32 ? 1 : type == Type::u8 ? 255 : 4095;
    what.values = {1 / top, 0};
    auto to = std::make_shared<Data>(Data::make(what, memory));
    with_type(type, [&]<class T>(T) {
        for (std::int64_t i = 0; i < what.samples(); ++i) {
            const double value = top * double(from.as<float>()[i]);
            to->as<T>()[i] = static_cast<T>(is_integer(type) ? std::round(value) : value);
        }
    });
    return to;
}

/// The same in the middle of its box, half as wide; 0 around it.
std::shared_ptr<Data> framed(const Data& from, MemoryBudget* memory) {
    auto to = std::make_shared<Data>(Data::make(from.what, memory));
    const Extent n = from.what.extent;
    const auto middle = [](std::int64_t at, std::int64_t all) {
        return all == 1 || (at >= all / 4 && at < all - all / 4);
    };
    with_type(from.what.type, [&]<class T>(T) {
        std::int64_t i = 0;
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x, ++i)
                    to->as<T>()[i] =
                        middle(x, n.x) && middle(y, n.y) && middle(z, n.z) ? from.as<T>()[i] : T{};
    });
    return to;
}

FilterSpec filter_of(const Trial::Neighbourhood& neighbourhood) {
    using Kind = KernelSpec::Kind;
    FilterSpec spec;
    spec.op = neighbourhood.op;
    spec.kernel.size = neighbourhood.size;
    switch (neighbourhood.shape) {
        case Stencil::Shape::gauss:
            spec.kernel.kind = Kind::gauss;
            break;
        case Stencil::Shape::ball:
            spec.kernel.kind = Kind::sphere;
            break;
        case Stencil::Shape::cross:
            spec.kernel.kind = Kind::cross;
            break;
        default:
            spec.kernel.kind = Kind::box;
    }
    return spec;
}

}  // namespace

std::vector<EdgeTrial> trials_of(const Catalogue& edges, Trial::Part part) {
    std::vector<EdgeTrial> all;
    for (const Transition& edge : edges) {
        if (!edge.trials) continue;
        for (Trial& trial : edge.trials()) {
            if (trial.part != part) continue;
            EdgeTrial each{std::move(trial), {}};
            if (each.trial.alone) each.edge = edge.name;
            if (std::find(all.begin(), all.end(), each) == all.end())
                all.push_back(std::move(each));
        }
    }
    std::stable_sort(all.begin(), all.end(), [](const EdgeTrial& a, const EdgeTrial& b) {
        return a.trial.order < b.trial.order;
    });
    return all;
}

Query spec_of(const Trial& trial) {
    using Kind = GeometryStep::Kind;
    Query query;
    query.job = trial.job;
    query.input = trial.input;
    if (trial.filter) query.filter = filter_of(*trial.filter);
    query.radon = trial.radon;
    query.isovalue = trial.isovalue;
    query.labels = trial.labels;
    if (!trial.turn.empty()) query.geometry.steps = {{Kind::rotate, trial.turn}};
    if (trial.mode) query.mode = *trial.mode;
    if (trial.job->of_rays()) query.geometry.size = OutputSize{.native = true};
    if (trial.size) query.geometry.size = OutputSize{.sides = {trial.size, trial.size}};
    if (trial.frames) query.geometry.steps.push_back({Kind::turntable, {double(trial.frames)}});
    if (trial.lit) query.shade = Shade::phong;
    if (trial.perspective > 0) query.geometry.perspective = trial.perspective;
    query.threads = 1;
    return query;
}

std::shared_ptr<const Data> Phantoms::of(const Trial& trial) {
    if (trial.empty_around) return framed(*whole(trial), &memory_);
    if (trial.labels) {
        const std::shared_ptr<const Data> of = whole(trial);
        Representation numbers = of->what;
        numbers.values = {};
        return std::make_shared<const Data>(Data::sharing(*of, numbers));
    }
    return whole(trial);
}

std::shared_ptr<const Data> Phantoms::whole(const Trial& trial) {
    std::shared_ptr<const Data>& data = made_[{trial.input, trial.type}];
    if (!data)
        data = trial.type == Type::f32 ? formula(trial.input)
                                       : retyped(*formula(trial.input), trial.type, &memory_);
    return data;
}

std::shared_ptr<const Data> Phantoms::formula(const std::string& name) {
    std::shared_ptr<const Data>& data = made_[{name, Type::f32}];
    if (!data) {
        Input input = inspected(name, {});
        read_data(input, &memory_);
        data = input.data;
    }
    return data;
}

}  // namespace edgewise
