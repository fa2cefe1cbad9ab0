#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "graph/filtering.hpp"
#include "graph/radon.hpp"
#include "graph/request.hpp"
#include "graph/transform_graph.hpp"
#include "io/store.hpp"
#include "request/look_spec.hpp"
#include "transfer/transfer_spec.hpp"

namespace edgewise {

/// One end of a window: a value, or a share of the samples.
struct WindowEnd {
    double at = 0;
    bool percentile = false;  // then `at` is in percent
};
/// What is shown black (`low`) and what white: a black that is more than white inverts.
struct Window {
    WindowEnd low, high;
    std::string name = {};  // of a window in Hounsfield units, see window_named()

    bool values() const noexcept { return !low.percentile && !high.percentile; }
};

/// One of the maps that make up a view.
struct GeometryStep {
    enum class Kind {
        rotate,     // [degree]: an image takes one angle, a volume those about x, y and z
        matrix,     // row by row: an image 2x2, 2x3 or 3x3, a volume 3x3, 3x4 or 4x4
        scale,      // one factor, or one an axis
        translate,  // [file unit], one an axis
        shear,      // threes of: axis that moves (0 is x), axis that moves it, by how much
        turntable,  // number of views, about screen y; how far all of them turn [degree], else 360
        path,       // sixteen for each view: its 4x4, row by row
    };
    Kind kind;
    std::vector<double> numbers;
};
const char* name_of(GeometryStep::Kind kind) noexcept;
/// What messages call it.
Message setting_of(GeometryStep::Kind kind);

/// How many samples the output has: as many as show all (`fit`), one for each smallest spacing of
/// the volume (`native`), those of the longer side (one number), or those of each axis.
struct OutputSize {
    bool fit = false;
    std::vector<std::int64_t> sides = {};
    bool native = false;

    std::string text() const;
};

/// How the output lies in the input. What is absent is chosen so that all of the input is seen.
struct GeometrySpec {
    std::optional<std::string> view;           // front, left, axial, x, ...: see view_of
    std::optional<std::vector<double>> about;  // sample that is held fixed; else the centre
    std::vector<GeometryStep> steps;           // applied in this order
    std::optional<double> perspective;         // render: vertical angle of the view [degree]
    std::optional<double> zoom;                // render
    std::optional<bool> grid_moves;            // warp: the steps turn the grid, not the content
    /// warp: the samples of the input's grid that are kept, ends included: x0, y0, z0, x1, y1, z1,
    /// or of an image x0, y0, x1, y1.
    std::optional<std::vector<double>> crop;
    std::optional<std::vector<double>> spacing;  // of output samples [file unit]
    std::optional<OutputSize> size;
    /// The output cannot say that its axes lean, so they are made perpendicular.
    bool upright = false;
    /// Where the eye of a perspective is, and what lies in the middle of its view, in place of
    /// `view`'s direction [sample of the input]; else it is outside, where it sees everything.
    std::optional<std::array<double, 3>> eye, look_at;
};

/// What rays see of the input: what all of these keep.
struct ClipSpec {
    /// First and last sample along x, y and z (x0, y0, z0, x1, y1, z1), with half a voxel around.
    std::optional<std::array<double, 6>> box;
    std::vector<std::array<double, 4>> planes;  // A, B, C, D: A x + B y + C z + D >= 0 [sample]
    std::vector<std::array<double, 4>> balls;   // X, Y, Z [sample], radius [file unit]
    std::optional<double> slab;                 // about the middle plane of each view [file unit]

    bool empty() const noexcept { return !box && planes.empty() && balls.empty() && !slab; }
    /// Those that are given, as messages call them.
    Message settings() const;
};

/// A kernel: of a shape and size, of a file, or a program's own.
struct KernelSpec {
    /// difference: of neighbours, of gradients alone.
    enum class Kind { box, gauss, sphere, cross, sobel, laplace, difference, file, given };
    Kind kind = Kind::box;
    double size = 1;  // radius, or standard deviation of gauss [sample]
    /// In place of `size`: one along each axis, or one for all.
    std::vector<double> sizes = {};
    bool lengths = false;  // sizes are in millimetres
    bool flat = false;     // a disc or square in each plane, also of a volume
    int axis = 0;          // of sobel; -1: all, of gradients
    std::string file;      // of file
    Stencil given = {};    // of given
};

/// What a filter job does.
struct FilterSpec {
    FilterOp op = FilterOp::convolve;
    KernelSpec kernel;
    Border border = Border::mirror;
    bool slices = false;  // each slice of a volume is an image
};

/// What becomes of a mesh before it is written.
struct SurfaceFinish {
    bool lids = false;               // closes an isosurface at the volume's faces
    bool largest = false;            // keeps the connected part of the largest area
    std::optional<double> decimate;  // keeps this share of the triangles
    std::optional<double> smooth;    // 0 to 1, of an isosurface
};

/// How costs are found: from models alone, by running the contenders, or all paths.
enum class Planner { estimate, pilot, exhaustive };
const char* name_of(Planner planner) noexcept;

/// How budgets were typed, so that messages speak of them in the same units: "60dB", "50ms",
/// "512MiB". Empty: nobody typed one.
struct Notation {
    std::string error, seconds, bytes;
};

/// What somebody asks for: which file, how it is seen, how good, how fast. What is absent
/// is worked out from the data. Errors call a member by its name (graph/settings.hpp).
struct Query {
    Job job = Job::render;
    std::string input;  // file, folder, phantom:NAME:N, raw:..., or, for plans, describe:...
    store::Selection selection;
    /// Of several resolutions the coarsest that is as fine as the result's samples.
    bool level_by_result = false;
    std::optional<std::string> out;  // file, %d is the frame; "-": standard output; "null:": none
    GeometrySpec geometry;
    ClipSpec clip;                      // render
    std::optional<FilterSpec> filter;   // of filter jobs, which need it
    std::optional<RadonSetting> radon;  // of radon jobs, likewise
    Mode mode = Mode::mip;
    std::optional<double> isovalue;       // mesh (absent: of labels), and modes with a level
    std::optional<double> zero, outside;  // value that adds nothing (X-ray); beyond the input
    std::optional<std::array<double, 3>> background;  // composite, each 0..1
    bool keeps_alpha = false;                         // composite: no background, alpha is written
    std::optional<TransferSpec> transfer;             // composite
    /// Composite, where `transfer` is absent: the preset that suits the data, over the window where
    /// there is one. Else a grey ramp.
    bool suiting_preset = false;
    std::optional<Shade> shade;  // else the mode's own
    /// Else sobel where the data are noisy and the preset that suits them says so, and central.
    std::optional<GradientScheme> gradient;
    std::vector<Light> lights;  // else one over the viewer's left shoulder
    /// Else that of the transfer function, or 0.2, 0.9, 0.2 and 20: what is white and faces the eye
    /// is nearly white. With shadows more of ambient light then, which throws none.
    std::optional<Material> material;
    std::optional<double> phase;  // of particles: Henyey and Greenstein's g
    bool shadows = false;
    std::optional<double> occlusion;  // radius of what keeps ambient light away [file unit]
    std::optional<DepthCue> cue;
    std::optional<Window> window;
    std::optional<double> exposure;         // of modes that show light; values stay
    std::optional<Field> reference;         // what the samples mean
    bool labels = false;                    // no new value appears, all come out bit for bit
    std::vector<std::int64_t> only_labels;  // with `labels`: all others count as background
    std::optional<double> smooth;           // of labels' surfaces: 0 to 1 of half a sample
    LookSpec look;                          // of pictures
    SurfaceFinish finish;                   // mesh
    /// The name of a channel, in place of selection.channel.
    std::string channel_name;

    std::optional<double> max_error;   // NRMSE
    bool like_linear = false;          // as good as linear interpolation
    std::optional<double> range;       // the difference in values that counts as an error of 1
    std::optional<double> max_time;    // [s]
    std::optional<double> max_memory;  // [byte], peak of the process
    Notation notation;                 // of these three
    std::optional<Minimize> minimize;
    std::optional<int> threads, ranks;  // else the cores of this process; the machine's
    Planner planner = Planner::estimate;
    std::optional<double> planning_time;  // [s], of pilot and exhaustive
    Demands demands;                      // edges that must be on the path, or must not

    /// Pictures a second of an animation (a GIF or APNG of several frames); else 15.
    std::optional<double> fps;
    /// File of the program ffmpeg, which makes films (.mp4); "": there is none, and they are
    /// refused. The library looks for no program by itself.
    std::string film_encoder;
    std::optional<int> bits, quality;   // 8, 16: a view, 32: values; 1..100 of JPEG and others
    std::optional<std::size_t> verify;  // samples to measure the error on, 0: all
    std::uint64_t seed = 1;             // of these samples
    int repeat = 1;
    bool strict = false;  // a measured budget that is broken is a failure, and nothing is written
    /// Facts of the data and what pilots measured are kept in the user's cache folder, and found
    /// there again.
    bool remembers = true;
};

}  // namespace edgewise
