#include "graph/job.hpp"

namespace edgewise {
namespace {

constexpr JobTraits kWarp{.name = "warp",
                          .target = "screen/scalar",
                          .values = JobTraits::Values::points,
                          .samples = true};
constexpr JobTraits kRender{
    .name = "render", .target = "screen/picture", .values = JobTraits::Values::rays};
constexpr JobTraits kMesh{.name = "mesh", .target = "object/mesh"};
constexpr JobTraits kFilter{.name = "filter", .target = "object/filtered", .samples = true};

}  // namespace

constinit const Job Job::warp{kWarp}, Job::render{kRender}, Job::mesh{kMesh}, Job::filter{kFilter};

const std::vector<Job>& jobs() {
    static const std::vector<Job> all{Job::warp, Job::render, Job::mesh, Job::filter};
    return all;
}

std::string_view name_of(Job job) noexcept { return job->name; }

}  // namespace edgewise
