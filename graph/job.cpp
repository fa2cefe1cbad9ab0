#include "graph/job.hpp"

#include "graph/radon.hpp"

namespace edgewise {
namespace {

constexpr JobTraits kWarp{.name = "warp",
                          .help = "resample an image (2D) or a volume (3D)",
                          .target = "screen/scalar",
                          .values = JobTraits::Values::points,
                          .samples = true};
constexpr JobTraits kRender{.name = "render",
                            .help = "make pictures of a volume",
                            .target = "screen/picture",
                            .values = JobTraits::Values::rays};
constexpr JobTraits kMesh{
    .name = "mesh", .help = "make a surface of triangles", .target = "object/mesh"};
constexpr JobTraits kFilter{.name = "filter",
                            .help = "convolve, correlate, dilate, erode, ... by a kernel",
                            .target = "object/filtered",
                            .samples = true};

}  // namespace

constinit const Job Job::warp{kWarp}, Job::render{kRender}, Job::mesh{kMesh}, Job::filter{kFilter};

const std::vector<Job>& jobs() {
    static const std::vector<Job> all{Job::warp, Job::render, Job::mesh, Job::filter, radon_job()};
    return all;
}

std::string_view name_of(Job job) noexcept { return job->name; }

}  // namespace edgewise
