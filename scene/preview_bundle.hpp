#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "reference/preview_short.hpp"
#include "reference/ray_look.hpp"
#include "scene/model.hpp"

namespace edgewise {

/// What a preview of pictures measures with.
struct RaySetting {
    const Request& want;
    const ReferenceField& field;
    std::vector<std::shared_ptr<const Model>> models;
    std::vector<double> steps = {};                     // of all models
    std::vector<std::vector<std::size_t>> takers = {};  // by step: the models that take its cells
    std::vector<ModelFact> facts = {};                  // of all models, one after another
    std::vector<std::size_t> first = {};                // by model: its first fact
    ArrivingLight arriving;
    Nearby nearby = {};

    RaySetting(const Request& want, const ReferenceField& field,
               std::vector<std::shared_ptr<const Model>> models);
};

/// One ray with all that models make of it.
struct Traced {
    RaySpan ray;
    OutputSample at;
    std::optional<LitFrame> frame = {};  // where light falls
    ArrivingAt arriving = {};            // of it; empty: all
    RayLook look = {};
    Stretch reference;
    std::vector<std::unique_ptr<RayModel>> models;  // null: that one has nothing to say
    std::vector<std::int64_t> next;                 // cell, of the fine step and the others
    double low = 0, high = 0;  // part of the ray that any of the models needs [t]
    /// Squared errors by fact; absent: not measured, or another ray's stand for this one's.
    std::vector<std::optional<double>> squares;
    std::vector<double> fourths = {};  // by fact, see RaySquares; of modes with a threshold
    double stands_for = 1;  // rays of the bundle, for facts of models that stand for neighbours
};

/// Neighbouring pixels, so that their rays share blocks of the input.
struct Bundle {
    struct Points {
        double squares = 0, points = 0;
    };
    std::vector<Traced> rays;
    std::vector<Points> points;  // by fact: of those of points, sums over the rays
};

/// Whether a ray is of one of the classes of ShortRays.
bool is_short(const RaySpan& ray, const Request& want);

/// @param side   pixels along x and y
/// @param whole  with the short rays too, where they are drawn by themselves
Bundle bundle_at(const RaySetting& setting, const ViewGeometry& geometry,
                 const OutputSample& corner, int side, bool whole);

/// @param whole  of all the input, or null: one is prepared for each stretch
void measure(Bundle& bundle, const RaySetting& setting, const PreviewBlock* whole,
             std::pmr::memory_resource* memory);

}  // namespace edgewise
