#pragma once

#include <concepts>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "graph/samples.hpp"
#include "graph/transform.hpp"

namespace edgewise {

/// Where samples lie: a transform from input indices (centres at integers) to indices here, one for
/// all views or one a view. Shared and never changed, so a representation copies a pointer.
class Placement {
 public:
    /// Every view sees the same samples in the same place.
    Placement(const Transform& map = {});                      // NOLINT: a transform is a placement
    Placement(const Mat4& map) : Placement(Transform(map)) {}  // NOLINT
    /// One transform a view. Views whose matrices agree to 1e-9 share one vertex of the data.
    static Placement each(std::vector<Transform> maps);
    template <std::same_as<Mat4> Matrix>
    static Placement each(const std::vector<Matrix>& maps) {
        return each(std::vector<Transform>(maps.begin(), maps.end()));
    }

    const Transform& at(int view) const noexcept;
    /// How many different transforms there are: so often a vertex placed like this is made.
    int different() const noexcept;
    /// Which of the different transforms a view has, 0 <= variant < different().
    int variant(int view) const noexcept;
    /// The first view that has the given variant.
    int first_view(int variant) const noexcept;
    bool one_a_view() const noexcept;

 private:
    struct State {
        std::vector<Transform> maps;
        std::vector<int> variants, first_views;  // empty when there is one for all views
    };
    explicit Placement(std::shared_ptr<const State> state) : state_(std::move(state)) {}
    std::shared_ptr<const State> state_;
};

/// How samples follow one another: row by row, or in bricks; and where they are spread over ranks,
/// how the box is cut (virtualization, [W93] 3.8 and FIGURE 41): columns give each rank all of z,
/// slice and dice cuts every axis.
enum class Layout : std::uint8_t { linear, bricked, columns, diced };
enum class Place : std::uint8_t { memory, disk, ranks };

/// A vertex: all that a later edge, a cost model and the memory count must know of data, no more.
/// Content, space and facets are open sets: an edge may introduce its own.
struct Representation {
    std::string space =
        "object";  // the rule that placed the samples: object, aligned, screen, slice
    std::string content = "scalar";  // what a sample is: scalar, coefficients, spectrum, picture
    std::set<std::string> facets;    // what lies beside it: minmax, gradient ...
    double facet_bytes = 0;          // of all of these
    bool shares = false;             // its samples are those that a path began with
    int axes = 3;                    // 2 for an image, 3 for a volume
    Extent extent;                   // where it differs from view to view, the largest
    int channels = 1;
    Type type = Type::f32;
    ValueMap values;
    Layout layout = Layout::linear;
    Place place = Place::memory;
    Placement placed;

    std::int64_t samples() const noexcept { return extent.samples(); }
    /// Nothing lies beside the samples any more.
    void drop_facets() noexcept {
        facets.clear();
        facet_bytes = 0;
    }
    /// Bytes of one copy (of one view where these differ).
    double bytes() const noexcept;
    /// Bytes in addition to its input: samples that it does not share, and facets.
    double own_bytes() const noexcept { return (shares ? 0 : bytes()) + facet_bytes; }
    /// Bytes of the samples of a box.
    double bytes(const Region& box) const noexcept;
    /// How many copies all views of a request need.
    int runs() const noexcept { return placed.different(); }
    /// Equal keys are one vertex. Bytes, not text; one map a view is told apart by the space's
    /// name.
    std::string key() const;
    /// "object/scalar/u8/linear/256x256x109", as in the JSON.
    std::string text() const;
    /// "object/scalar+minmax", as in Transition::joins.
    std::string kind() const;
};

std::string text_of(const Extent& extent, int axes);

/// Whether an edge that reads a kind ("object/scalar+minmax") takes another: the same space and
/// content with at least these facets.
bool takes_kind(std::string_view join, std::string_view kind);
/// The facets that a kind names.
std::set<std::string> facets_of(std::string_view kind);

}  // namespace edgewise
