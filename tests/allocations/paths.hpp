#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "graph/data.hpp"
#include "graph/transfer_table.hpp"
#include "settings/settings.hpp"
#include "transitions/catalogue.hpp"

/// Paths whose second run is counted: by tests, and by the benchmark of the door.
namespace edgewise {

/// A path by its query.
struct CountedPath {
    std::string name;
    Query query;
    std::shared_ptr<const Data> samples;
};

inline Representation samples_of(const Extent& extent, Type type) {
    Representation what;
    what.type = type;
    what.axes = extent.z > 1 ? 3 : 2;
    what.extent = extent;
    what.space = "object";
    what.content = "scalar";
    return what;
}

/// Noise from 0 to 255.
inline std::shared_ptr<const Data> counted_noise(const Extent& extent, Type type) {
    Data data = Data::make(samples_of(extent, type), std::pmr::get_default_resource());
    std::mt19937 bits(3);
    for (std::int64_t i = 0; i < data.what.samples(); ++i) {
        const auto value = static_cast<std::uint8_t>(bits() & 255);
        if (type == Type::f32)
            data.as<float>()[i] = value;
        else
            data.as<std::uint8_t>()[i] = value;
    }
    return std::make_shared<const Data>(std::move(data));
}

/// A ball whose values fall from 200 in the middle to 0 at a face of the volume.
inline std::shared_ptr<const Data> counted_ball(const Extent& extent, Type type) {
    Data data = Data::make(samples_of(extent, type), std::pmr::get_default_resource());
    std::int64_t i = 0;
    for (std::int64_t z = 0; z < extent.z; ++z)
        for (std::int64_t y = 0; y < extent.y; ++y)
            for (std::int64_t x = 0; x < extent.x; ++x, ++i) {
                double square = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    const double middle = 0.5 * double(extent[axis] - 1);
                    const double at = double(axis == 0 ? x : axis == 1 ? y : z);
                    square += (at - middle) * (at - middle) / (middle * middle);
                }
                const double value = square < 1 ? 200 * (1 - square) : 0;
                if (type == Type::f32)
                    data.as<float>()[i] = static_cast<float>(value);
                else
                    data.as<std::uint8_t>()[i] = static_cast<std::uint8_t>(value);
            }
    return std::make_shared<const Data>(std::move(data));
}

/// The same samples as a caller holds them, with nothing to be read behind them.
inline std::shared_ptr<const Data> held_by_caller(const std::shared_ptr<const Data>& data) {
    Data around;
    around.what = data->what;
    around.samples =
        Array::around(const_cast<float*>(data->as<float>()), data->samples.bytes(), data);
    return std::make_shared<const Data>(std::move(around));
}

/// Opacities of three values and three gradients.
inline TransferSpec by_value_and_gradient() {
    TransferTable table;
    table.values = {0, 90, 200};
    table.gradients = {0, 4, 20};
    table.opacity = {0, 0, 0.1, 0, 0.3, 0.1, 0, 0.8, 0.4};
    TransferSpec made;
    made.transfer.points = {{0, 0, {0, 0, 0}}, {90, 0.8, {1, 0.5, 0}}, {200, 0.4, {1, 1, 1}}};
    made.transfer.table = std::make_shared<const TransferTable>(std::move(table));
    return made;
}

/// Pictures, warps and filters by many edges, of an image and of volumes, of bytes and of f32.
inline std::vector<CountedPath> counted_paths() {
    static const Catalogue edges = catalogue();
    const auto noise = counted_noise({40, 36, 32}, Type::f32);
    const auto bytes = counted_noise({40, 36, 32}, Type::u8);
    const auto ball = counted_ball({40, 36, 32}, Type::f32);
    const auto ball_of_bytes = counted_ball({40, 36, 32}, Type::u8);
    const auto image = counted_noise({90, 70, 1}, Type::f32);
    const auto image_of_bytes = counted_noise({90, 70, 1}, Type::u8);
    std::vector<CountedPath> paths;
    const auto add = [&](std::string name, Job job, std::vector<Given> given, const auto& samples) {
        paths.push_back({std::move(name), query_of(job, given, edges), samples});
    };
    const auto seen = [&](std::string name, std::vector<Given> more, const auto& samples) {
        std::vector<Given> given = {{"rotate", "20,10,0"}, {"size", "64x48"}};
        given.insert(given.end(), more.begin(), more.end());
        add(std::move(name), Job::render, std::move(given), samples);
    };
    const Given cast{"via", "project.ray_cast"};
    const Given frames{"turntable", "5"};
    seen("mip", {{"mode", "mip"}, cast}, noise);
    seen("mip of bytes", {{"mode", "mip"}, cast}, bytes);
    seen("mip of a caller's samples", {{"mode", "mip"}, cast}, held_by_caller(noise));
    seen("mip, five frames", {{"mode", "mip"}, cast, frames}, noise);
    seen("mip of a spline", {{"mode", "mip"}, {"via", "filter.prefilter"}}, noise);
    seen("mip of warped samples", {{"mode", "mip"}, {"via", "project.combine"}}, noise);
    seen("mip by shears", {{"mode", "mip"}, {"via", "project.shear_warp"}, frames}, noise);
    seen("mean", {{"mode", "mean"}, cast}, noise);
    seen("xray", {{"mode", "xray"}, cast, frames}, noise);
    const Given composite{"mode", "composite"}, bone{"preset", "ct-bone"};
    seen("composite", {composite, cast}, ball);
    seen("composite of bytes", {composite, cast}, ball_of_bytes);
    seen("composite, several ramps", {composite, bone, cast}, ball);
    seen("composite, shear-warp", {composite, bone, {"via", "project.shear_warp"}, frames}, ball);
    seen("composite, warped", {composite, bone, {"via", "project.combine"}}, ball);
    seen("lit", {composite, bone, {"shade", "phong"}, cast}, ball);
    seen("lit, by Sobel", {composite, {"shade", "phong"}, {"gradient", "sobel"}, cast}, ball);
    seen("lit by two lights",
         {composite,
          {"shade", "torrance-sparrow"},
          {"lights", SettingValue::List{"0,0,-1", "-1,0,-1,0.5"}}},
         ball);
    seen("surface", {{"mode", "surface"}, {"isovalue", "100"}, cast}, ball);
    seen("surface of bytes", {{"mode", "surface"}, {"isovalue", "100"}, frames}, ball_of_bytes);
    seen("binary", {{"mode", "binary"}, {"isovalue", "100"}}, ball);
    seen("importance", {composite, bone, {"via", "project.importance_cast"}}, ball);
    seen("preintegrated", {composite, bone, {"via", "project.preintegrated_cast"}}, ball);
    seen("preintegrated, second order",
         {composite, bone, {"via", "project.preintegrated_quadratic_cast"}}, ball);
    seen("with shadows", {composite, bone, {"shade", "phong"}, {"shadows", true}, cast}, ball);
    seen("with ambient occlusion", {composite, bone, {"shade", "phong"}, {"occlusion", 4.0}, cast},
         ball);
    seen("clipped by a plane", {composite, bone, {"planes", SettingValue::List{"1,1,1,-40"}}, cast},
         ball);
    seen("clipped by a box", {{"mode", "mip"}, {"box", "4,5,6,30,31,25"}, cast}, noise);
    seen("clipped by a ball", {{"mode", "xray"}, {"balls", SettingValue::List{"20,18,16,9"}}, cast},
         noise);
    seen("darker with depth", {composite, bone, {"cue", "0.3"}, cast}, ball);
    seen("a slab", {{"mode", "mean"}, {"slab", 7.0}, cast}, noise);
    seen("from an eye", {{"mode", "mip"}, {"perspective", 40.0}, cast}, noise);
    seen("by trapezoids", {composite, bone, {"via", "project.trapezoid_cast"}}, ball);
    seen("by value and gradient", {composite, cast}, ball);
    paths.back().query.transfer = by_value_and_gradient();
    add("warp of a volume", Job::warp, {{"rotate", "20,10,0"}}, noise);
    add("warp of an image", Job::warp, {{"rotate", "20"}}, image);

    struct Filter {
        const char *name, *op, *kernel, *via;
        double allowed = 0;
    };
    constexpr Filter kFilters[] = {
        {"gauss", "convolve", "gauss:2", ""},
        {"gauss by products", "convolve", "gauss:2", "separable"},
        {"gauss, recursive", "convolve", "gauss:2", "recursive", 0.5},
        {"gauss by transforms", "convolve", "gauss:2", "fourier"},
        {"box", "convolve", "box:2", ""},
        {"box, running", "convolve", "box:2", "running"},
        {"box by places", "convolve", "box:2", "backward"},
        {"box by samples", "convolve", "box:2", "forward"},
        {"median", "median", "box:1", ""},
        {"median of a cross", "median", "cross:2", "median"},
        {"dilate", "dilate", "box:2", ""},
        {"dilate by runs", "dilate", "sphere:3", "runs"},
        {"dilate by lines", "dilate", "box:2", "van_herk"},
        {"dilate by a sequence", "dilate", "sphere:3", "ball_sequence/differs=1", 0.5},
        {"erode by samples", "erode", "sphere:2", "forward"},
        {"a large kernel", "convolve", "gauss:4.5", "backward"},
        {"opening", "open", "sphere:2", ""},
        {"top hat", "tophat", "box:2", ""},
        {"sobel", "sobel", "", ""},
        {"gradient", "gradient", "", ""}};
    for (const Filter& filter : kFilters)
        for (const auto& samples : {noise, bytes, image, image_of_bytes}) {
            std::vector<Given> given = {{"op", filter.op}};
            if (*filter.kernel) given.push_back({"kernel", filter.kernel});
            if (*filter.via) given.push_back({"via", std::string("filter.") + filter.via});
            // Those that are no more than near to what is asked.
            if (filter.allowed > 0) given.push_back({"max_error", filter.allowed});
            const std::string name = std::string(filter.name) +
                                     (samples->what.axes == 3 ? ", 3D, " : ", 2D, ") +
                                     std::string(name_of(samples->what.type));
            add(name, Job::filter, std::move(given), samples);
        }
    return paths;
}

}  // namespace edgewise
