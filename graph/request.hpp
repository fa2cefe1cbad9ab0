#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "graph/clip.hpp"
#include "graph/job.hpp"
#include "graph/job_setting.hpp"
#include "graph/mode.hpp"
#include "graph/representation.hpp"
#include "graph/written.hpp"

namespace edgewise {

/// What the samples stand for, and so what an answer without error is: the cubic B-spline through
/// them, the trilinear field, labels (nearest; no new value appears), or a phantom's own formula.
enum class Field { spline, linear, nearest, formula };
enum class Minimize { time, error, memory };

std::string_view name_of(Minimize what) noexcept;

struct TransferTable;  // graph/transfer_table.hpp

/// Opacity and colour as piecewise linear functions of the value, constant beyond the end points.
struct Transfer {
    struct Point {
        double value = 0, opacity = 0;         // opacity per `unit` of length, 0..1
        std::array<double, 3> color{0, 0, 0};  // 0..1, not premultiplied
    };
    std::vector<Point> points;  // ascending values, at least one; with a table see completed()
    double unit = 1;            // length that the opacities refer to [file unit]
    /// What opacities are times, by the length of the gradient; none: 1 (Levoy 1988).
    struct Edge {
        double magnitude = 0, opacity = 1;  // [value per file unit], 0..1
    };
    std::vector<Edge> edges = {};  // ascending magnitudes
    /// Opacity and colour by value and gradient, in place of points and edges; null: none.
    std::shared_ptr<const TransferTable> table = {};

    /// Whether gradients of the samples decide about opacities.
    bool needs_gradients() const noexcept { return table || !edges.empty(); }
    /// Opacity (in [3]) and colour at a value.
    std::array<double, 4> at(double value) const noexcept;
    /// The factor at a magnitude.
    double edge_at(double magnitude) const noexcept;
};

/// The eye of a perspective view, in screen space. Pixel (x, y) is the point (x, y, plane).
struct Eye {
    Vec3 at = Vec3::Zero();
    double plane = 0;
    /// One step along screen x and y, in steps along screen z: lengths of slanted rays need both,
    /// and no matrix tells a wide pixel from an object that is squeezed.
    double width = 1, height = 1;
};

/// A wish in place of a limit of the error: a result as good as a filter makes of the same data,
/// whatever its error is there. What it is compared with is the plain path (Transition::plain).
struct Like {
    std::string name = "linear";  // what it is called
    std::string filter = {};
    /// Filters that a path must not read by, however small its error: what a root mean square does
    /// not tell of them is seen.
    std::set<std::string> barred = {};
    double times = 1.05;  // as much likely error at most, on the same draws; infinite: any error
    /// The longest distance of samples along rays, and that of the plain path, where that is longer
    /// [smallest spacing]. Infinite: any.
    double step = std::numeric_limits<double>::infinity();
};

/// Upper limits; absent: none.
struct Budget {
    std::optional<double> error = {};    // NRMSE
    std::optional<double> seconds = {};  // all frames, from samples in memory to results in memory
    std::optional<double> bytes = {};    // peak resident memory of the process
    std::optional<Like> like = {};       // where no plan has it, the most accurate one does
    bool copied = false;                 // samples are moved and never computed (Error::copies)
    /// `error` is nobody's demand: where no plan keeps it, the most accurate one does.
    bool error_yields = false;
};

/// Which surface a job or a mode makes of the samples.
struct SurfaceOf {
    std::optional<double> isovalue = {};  // absent: one around each label
};

/// What someone wants: a job, its views, size and mode, and what it may cost.
///
/// Screen space: x right, y down [output samples], z away from the eye, in output samples of a warp
/// and in units of the smallest input spacing for a picture; centres at integers.
struct Request {
    Job job = Job::render;
    int axes = 3;                 // of the input
    Extent input;                 // of the input [samples]
    Vec3 spacing = Vec3::Ones();  // of the input [file unit]
    Placement views;              // input index -> screen index, one transform a view
    int frames = 1;               // number of views
    Extent screen;                // warp: the output; render: width, height, depth of all views
    double unit = 1;              // one step in screen z of a picture [file unit]
    std::optional<Eye> eye;       // absent: orthographic
    /// What rays see of the input, one for all views or one a view; none: all of it.
    std::vector<Clip> clips;
    Mode mode = Mode::mip;
    Transfer transfer;  // of composite
    Shading shading;    // of modes that take light
    /// For light and opacities.
    GradientScheme gradient = GradientScheme::central;
    /// Width and height of a picture's pixel, in steps along screen z.
    std::array<double, 2> pixel{1, 1};
    std::optional<SurfaceOf> surface = {};  // absent: none is asked for
    JobSetting setting = {};                // of jobs that have one: of filter a Filtering
    std::optional<DepthCue> cue = {};       // of modes that take one
    double zero = 0;                        // of xray: the value that adds nothing
    std::array<double, 3> background{0, 0, 0};
    bool keeps_alpha = false;  // of composite: no background, and alpha is part of the result
    double outside = 0;        // warp: value beyond the input; surfaces of labels: what is no label
    double magnitude = 0;      // of the input's values, the largest: what rounding is relative to
    double miss = 0;           // value of a ray that meets nothing, see ModeTraits::miss
    Field field = Field::spline;
    std::optional<double> range;  // --range
    /// How a warp is stored, where that changes values: the error is that of the file. Absent: as
    /// it comes.
    std::optional<WrittenAs> written;
    Budget budget;
    Minimize minimize = Minimize::time;
    int threads = 1;
    int ranks =
        1;  // processors with memory of their own that samples may be spread over (plans only)

    /// Extent of one result: the warped samples, or one picture.
    Extent output() const noexcept {
        return job->of_rays() ? Extent{screen.x, screen.y, 1} : screen;
    }
    bool projective() const noexcept;  // some view has a last row other than 0 0 0 1
    /// Whether gradients of the samples tell anything.
    bool needs_gradients() const noexcept {
        return shading.has_normals() || transfer.needs_gradients();
    }
    /// Whether these are smoothed ones.
    bool smooths_gradients() const noexcept {
        return gradient == GradientScheme::sobel && needs_gradients();
    }
    /// The value at which the surface lies; 0 where there is none.
    double level() const noexcept { return surface && surface->isovalue ? *surface->isovalue : 0; }
    /// What rays of a view see of the input; null: all of it.
    const Clip* clip(int view) const noexcept {
        if (clips.empty()) return nullptr;
        return &clips[clips.size() == 1 ? 0 : static_cast<std::size_t>(view)];
    }
    /// The first view that is no matrix.
    std::optional<int> deformed() const noexcept;
};

/// Screen z of the corner of the input's box that is nearest to the eye.
double nearest_corner(const Request& want, int view);

/// What is still to be done to bring samples placed like `from` to the screen: a map from their
/// indices to screen indices.
Transform residual_transform(const Representation& from, const Request& want, int view);
/// The same as a matrix (4x4; the last row differs from 0 0 0 1 only for 2D homographies). For
/// edges that take matrices alone, which are asked about no other transform.
Mat4 residual(const Representation& from, const Request& want, int view);

/// Samples of the input's kind in screen space, f32: what a warp leads to.
Representation screen_scalar(const Representation& from, const Request& want);
/// One f32 picture a view: of a mode's channels.
Representation screen_picture(const Representation& from, const Request& want);
/// Whether a vertex is what the request asks for.
bool is_target(const Representation& here, const Request& want);

}  // namespace edgewise
