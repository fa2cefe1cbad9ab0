#include "engine/calibrate/calibration_trials.hpp"

#include <cmath>

#include "engine/request/input.hpp"
#include "graph/with_type.hpp"

namespace edgewise {
namespace {

using Turns = std::vector<std::vector<double>>;

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

}  // namespace

// No slice of a volume beyond the first caches is a multiple of many pages. Such slices, above all
// of powers of two, use few sets of a cache (docs/planner.md) and would have rates of their own.
std::vector<Trial> trials(bool quick) {
    std::vector<Trial> all;
    const auto volume = [&](const char* input, const std::vector<double>& turn,
                            std::vector<Type> types, bool fine = false) {
        for (const Type type : types) {
            for (const char* mode : {"mip", "xray", "composite"})
                all.push_back({.job = Job::render,
                               .input = input,
                               .type = type,
                               .turn = turn,
                               .mode = mode,
                               .fine = fine});
            all.push_back({Job::warp, input, type, turn, nullptr});
        }
    };
    const auto image = [&](const char* input, const std::vector<double>& turn,
                           std::vector<Type> types) {
        for (const Type type : types) all.push_back({Job::warp, input, type, turn, nullptr});
    };
    if (quick) {
        volume("phantom:gaussians:80", {20, -15, 10}, {Type::u8, Type::f32}, true);
        image("phantom:zone-plate:700", {20}, {Type::u8, Type::f32});
        return all;
    }
    volume("phantom:gaussians:112", {20, -15, 10}, {Type::u8, Type::i16, Type::f32}, true);
    image("phantom:zone-plate:900", {20}, {Type::u8, Type::f32});
    volume("phantom:noise:48", {10, 70, -25}, {Type::u8, Type::f32});
    // Small data: steps take as long as they start.
    for (const Type type : {Type::u8, Type::f32}) {
        all.push_back({Job::render, "phantom:shepp-logan:64", type, {10, 30, 20}, "xray"});
        all.push_back({Job::warp, "phantom:shepp-logan:64", type, {10, 30, 20}, nullptr});
    }
    volume("phantom:gaussians:190", {15, 40, -5}, {Type::u8, Type::i16, Type::f32});
    // 79 MB are written, more than caches keep.
    all.push_back({Job::warp, "phantom:gaussians:270", Type::u8, {15, 40, -5}, nullptr});
    image("phantom:zone-plate:256", {20}, {Type::u8, Type::f32});
    image("phantom:zone-plate:500", {70}, {Type::u8, Type::f32});
    image("phantom:zone-plate:1400", {-35}, {Type::u8, Type::f32});
    image("phantom:zone-plate:2000", {20}, {Type::u8, Type::f32});
    // Few pixels of large data: sparse rays, across slices, across rows or along them.
    for (const Type type : {Type::u8, Type::i16, Type::f32})
        for (const auto& turn : Turns{{15, -30, 5}, {5, 60, 10}, {-3, 84, 4}})
            for (const char* mode : {"mip", "xray", "composite"})
                all.push_back({Job::render, "phantom:gaussians:190", type, turn, mode, 112});
    for (const auto& turn : Turns{{15, -30, 5}, {5, 60, 10}})
        for (const std::int64_t size : {112, 256})
            for (const char* mode : {"mip", "xray", "composite"})
                all.push_back({Job::render, "phantom:gaussians:270", Type::u8, turn, mode, size});
    // More pixels than samples: ray casts read such data as they do what caches hold.
    for (const char* mode : {"mip", "xray", "composite"})
        all.push_back({Job::render, "phantom:gaussians:190", Type::i16, {15, 40, -5}, mode, 480});
    // Gradients and light.
    for (const Type type : {Type::u8, Type::i16, Type::f32})
        all.push_back({.job = Job::render,
                       .input = "phantom:gaussians:112",
                       .type = type,
                       .turn = {20, -15, 10},
                       .mode = "composite",
                       .lit = true});
    // Neighbourhoods: small and large sums, extremes and medians.
    using Kind = KernelSpec::Kind;
    const auto filter = [&](FilterOp op, Kind kind, double size) {
        FilterSpec spec;
        spec.op = op;
        spec.kernel.kind = kind;
        spec.kernel.size = size;
        for (const char* input : {"phantom:zone-plate:900", "phantom:gaussians:80"})
            for (const Type type : {Type::u8, Type::f32})
                all.push_back({.job = Job::filter, .input = input, .type = type, .filter = spec});
    };
    filter(FilterOp::convolve, Kind::gauss, 1);
    filter(FilterOp::convolve, Kind::sphere, 4);
    filter(FilterOp::convolve, Kind::box, 3);
    filter(FilterOp::dilate, Kind::sphere, 4);
    filter(FilterOp::dilate, Kind::box, 4);
    filter(FilterOp::median, Kind::sphere, 2);
    // Lines of an image: few angles, as all take the same. Of the plate half of the samples vote.
    for (const RadonSetting::To to : {RadonSetting::To::sinogram, RadonSetting::To::hough}) {
        const auto lines = [&](const char* input, Type type, int angles) {
            all.push_back({.job = radon_job(),
                           .input = input,
                           .type = type,
                           .radon = RadonSetting{.angles = angles, .to = to, .threshold = 0.5}});
        };
        lines("phantom:zone-plate:256", Type::f32, 30);
        lines("phantom:zone-plate:500", Type::u8, 8);
        lines("phantom:shepp-logan:64", Type::u8, 6);
    }
    // Surfaces: triangles of a level and of labels, and pictures of them.
    const auto surface = [&](const char* input, Type type, const char* edge, bool labels) {
        const bool is_picture = std::string_view(edge) != "surface.flying_edges" &&
                                std::string_view(edge) != "surface.nets";
        Trial trial{.job = is_picture ? Job::render : Job::mesh, .input = input, .type = type};
        if (is_picture) trial.turn = {20, -15, 10}, trial.mode = "surface";
        trial.edge = edge;
        trial.labels = labels;
        if (!labels) trial.isovalue = 0.4;
        all.push_back(trial);
    };
    for (const char* input : {"phantom:gaussians:64", "phantom:gaussians:112"})
        for (const Type type : {Type::u8, Type::f32})
            surface(input, type, "surface.flying_edges", false);
    surface("phantom:gaussians:112", Type::u8, "surface.draw", false);
    for (const char* input : {"phantom:shepp-logan:64", "phantom:shepp-logan:124"})
        for (const char* edge : {"surface.nets", "surface.draw", "project.label_cast"})
            surface(input, Type::u8, edge, true);
    // Many frames: threads have more to share.
    for (const Type type : {Type::u8, Type::f32})
        all.push_back({Job::render, "phantom:gaussians:112", type, {20, -15, 10}, "xray", 0, 12});
    // What is mostly empty is copied first: small copies cost what their pages do. Copies are a
    // matter of what the caches hold, so of sizes.
    const auto copy = [&](const char* input, Type type, const char* edge,
                          const std::vector<double>& turn = {20, -15, 10}) {
        all.push_back({.job = Job::render,
                       .input = input,
                       .type = type,
                       .turn = turn,
                       .mode = "xray",
                       .edge = edge,
                       .empty_around = std::string_view(edge) == "store.crop"});
    };
    for (const char* input : {"phantom:gaussians:64", "phantom:gaussians:112",
                              "phantom:gaussians:144", "phantom:gaussians:190"})
        for (const Type type : {Type::u8, Type::i16, Type::f32}) copy(input, type, "store.crop");
    for (const char* input : {"phantom:gaussians:144", "phantom:gaussians:190"})
        for (const Type type : {Type::u8, Type::i16, Type::f32})
            copy(input, type, "warp.axis_permutation");
    // Rows of each slice from all slices, and columns.
    for (const char* input :
         {"phantom:gaussians:112", "phantom:gaussians:144", "phantom:gaussians:190"})
        for (const Type type : {Type::u8, Type::i16, Type::f32})
            copy(input, type, "warp.axis_permutation", {70, 10, 5});
    for (const Type type : {Type::u8, Type::i16, Type::f32})
        copy("phantom:gaussians:144", type, "warp.axis_permutation", {10, 70, -25});
    for (const Type type : {Type::i16, Type::f32})
        copy("phantom:gaussians:144", type, "store.precision");
    for (const char* input : {"phantom:gaussians:64", "phantom:gaussians:112"})
        for (const char* mode : {"mip", "xray"})
            all.push_back({.job = Job::render,
                           .input = input,
                           .type = Type::u8,
                           .turn = {20, -15, 10},
                           .mode = mode,
                           .perspective = 30});
    all.push_back({Job::render, "phantom:gaussians:112", Type::u8, {20, -15, 10}, "mean"});
    all.push_back({Job::render, "phantom:gaussians:112", Type::f32, {20, -15, 10}, "mean"});
    all.push_back({Job::render, "phantom:shepp-logan:124", Type::u8, {10, 30, 20}, "mip"});
    all.push_back({Job::render, "phantom:shepp-logan:224", Type::u8, {10, 30, 20}, "xray"});
    all.push_back({Job::render, "phantom:shepp-logan:124", Type::f32, {10, 30, 20}, "xray"});
    all.push_back({Job::warp, "phantom:gaussians:112", Type::u8, {90, 0, 0}, nullptr});
    all.push_back({Job::warp, "phantom:gaussians:112", Type::f32, {90, 0, 90}, nullptr});
    return all;
}

std::vector<Trial> exams() {
    return {{Job::render, "phantom:marschner-lobb:80", Type::u8, {-35, 25, 60}, "mip"},
            {Job::render, "phantom:sphere:128", Type::u8, {5, -50, 15}, "xray"},
            {Job::render, "phantom:shepp-logan:96", Type::f32, {-20, 15, 40}, "composite"},
            {Job::warp, "phantom:sphere:96", Type::u8, {12, 33, -21}, nullptr},
            {Job::render, "phantom:cube:72", Type::u8, {40, 10, -20}, "mip", 80},
            {Job::warp, "phantom:checker:450", Type::f32, {-33}, nullptr}};
}

Query spec_of(const Trial& trial) {
    using Kind = GeometryStep::Kind;
    Query query;
    query.job = trial.job;
    query.input = trial.input;
    query.filter = trial.filter;
    query.radon = trial.radon;
    query.isovalue = trial.isovalue;
    query.labels = trial.labels;
    if (!trial.turn.empty()) query.geometry.steps = {{Kind::rotate, trial.turn}};
    if (trial.mode) query.mode = mode_named(trial.mode);
    if (trial.job == Job::render) query.geometry.size = OutputSize{.native = true};
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
