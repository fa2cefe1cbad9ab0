#pragma once

#include <optional>
#include <vector>

#include "graph/clip.hpp"
#include "graph/request.hpp"

namespace edgewise {

/// One value (of all channels) of one result.
struct OutputSample {
    int view = 0;
    std::int64_t x = 0, y = 0, z = 0;
};

/// A view ray within the box that the input fills: origin + t direction, low < t < high.
struct RaySpan {
    Vec3 origin, direction;  // input index; direction for one unit of length
    double low = 0, high = 0;
    double step = 0.125;  // of the reference's cells [t], see reference_step()

    /// Cuts it to the box of an input, or to a part of it; false where nothing is left.
    bool clip(const Extent& input) noexcept;
    bool clip(const Clip& part) noexcept;
};

/// How gradients of the input are seen along one ray.
struct LitFrame {
    Eigen::Matrix3d to_screen;  // of a gradient by input index; there all steps are as long
    Vec3 to_eye;                // unit length

    Lit at(const Vec3& gradient, const Shading& shading) const noexcept {
        return shading.at(to_screen * gradient, to_eye);
    }
};

/// Where the samples of results lie in the input, straight from the request's transforms.
///
/// Orthographic rays are the lines of constant screen x and y, and t is screen z. Perspective rays
/// start at the eye (t = 0) and pass pixel (x, y) at (x, y, plane); t is a length in units of
/// screen space, whatever the matrix: screen x and y count output samples, of which the request
/// says how many units wide and high they are.
class ViewGeometry {
 public:
    /// @throws RequestError for a job that no reference knows, and for views that bend rays
    explicit ViewGeometry(const Request& want);

    /// The input index that a warp's output sample shows; none where a homography has no such
    /// point.
    std::optional<Vec3> point(const OutputSample& at) const;
    /// The part of a pixel's ray inside the box; none where it misses.
    std::optional<RaySpan> ray(const OutputSample& at) const { return ray(at.view, at.x, at.y); }
    std::optional<RaySpan> ray(int view, double x, double y) const;
    /// Of a pixel.
    LitFrame frame(const OutputSample& at) const;

 private:
    const Request& want_;
    std::vector<Transform> to_input_;  // one a view
};

}  // namespace edgewise
