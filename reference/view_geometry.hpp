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
    double front = 0;     // where the first of them begins [t]

    /// Cuts it to the box of an input, or to a part of it; false where nothing is left.
    bool clip(const Extent& input) noexcept;
    bool clip(const Clip& part) noexcept;
};

/// How light reaches the eye along one ray.
struct LitFrame {
    Eigen::Matrix3d to_screen;       // of a gradient by input index; there all steps are as long
    Vec3 to_eye;                     // unit length
    Vec3 per_length = Vec3::Ones();  // samples in a file unit
    /// Depth of the ray's point t behind the plane through the volume's nearest corner: near +
    /// t deeper [file unit].
    double near = 0, deeper = 0;

    /// @param gradient  by input index
    /// @param t         where on the ray
    Lit at(const Vec3& gradient, double t, const Request& want,
           const Arriving& arriving = {}) const noexcept {
        Lit lit = want.shading.at(to_screen * gradient, to_eye, arriving);
        const double left = this->left(t, want);
        lit.diffuse *= left;
        lit.specular *= left;
        lit.gradient = gradient.cwiseProduct(per_length).norm();
        lit.opacity = want.transfer.edge_at(lit.gradient);
        return lit;
    }
    /// The share of light that the depth leaves; 1 without a cue.
    double left(double t, const Request& want) const noexcept {
        return want.cue ? want.cue->left(near + t * deeper) : 1;
    }
};
/// Whether anything along rays depends on where it is.
bool needs_frame(const Request& want) noexcept;

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
    std::optional<RaySpan> ray(const OutputSample& at) const {
        return ray(at.view, static_cast<double>(at.x), static_cast<double>(at.y));
    }
    std::optional<RaySpan> ray(int view, double x, double y) const;
    /// Of a pixel.
    LitFrame frame(const OutputSample& at) const;

 private:
    const Request& want_;
    std::vector<Transform> to_input_;  // one a view
    std::vector<double> nearest_;      // screen z of the volume's nearest corner, likewise
};

}  // namespace edgewise
