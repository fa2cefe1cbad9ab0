#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "graph/front_watch.hpp"
#include "graph/shading.hpp"

namespace edgewise {

/// How much a picture of what lies in front may still change. A pixel changes by no more than its
/// transparency times the most light that a sample sends, in each colour and in opacity.
struct FrontBound {
    double most = 0, mean = 0;  // over pixels
};
/// @param picture  [ny, nx, 4] f32: premultiplied red, green, blue, opacity
/// @param light    as most_light_of()
FrontBound front_bound_of(const Data& picture, double light = 1);
/// No sample of a colour of at most 1 sends more light than this in any channel; at least 1.
double most_light_of(const Shading& shading);

/// A picture on the way.
struct FrontSeen {
    int view = 0;
    std::int64_t slices = 0, depth = 0;
    double seconds = 0;  // since the run began
    FrontBound bound;    // 0 for all slices
};

/// Pictures on the way to a composite, and when to be content with one of them. The edges that make
/// them call watch(); whoever runs them takes the pictures.
class Refinement {
 public:
    /// @param writes      each picture on the way takes the result's place in its file
    /// @param stop_after  a run composites no further than at this time [s]; the first picture is
    ///                    always made
    explicit Refinement(bool writes, std::optional<double> stop_after = {});

    bool writes() const noexcept { return writes_; }
    std::optional<double> stop_after() const noexcept { return stop_after_; }
    /// For the edges of a catalogue (see watched()). It may outlive this. While nobody takes the
    /// pictures, it goes on.
    FrontWatch watch() const;
    /// Who takes the pictures of a run; nobody where empty.
    void give_to(FrontWatch taker);

 private:
    const bool writes_;
    const std::optional<double> stop_after_;
    std::shared_ptr<FrontWatch> taker_;
};

/// What came of it in a run.
struct Refined {
    std::vector<FrontSeen> pictures;  // in the order in which they were there
    bool stopped = false;             // some result is of fewer slices than there are
};

}  // namespace edgewise
