#include "reference/job_reference.hpp"

#include "reference/backprojected.hpp"
#include "reference/filtered.hpp"
#include "reference/lines.hpp"

namespace edgewise {

bool has_reference(Job job) noexcept {
    return job->values != JobTraits::Values::other || job->samples || job == radon_job();
}

std::shared_ptr<const JobReference> job_reference(const Request& want,
                                                  const ReferenceField& field) {
    if (const auto* filtering = want.setting.as<Filtering>())
        return std::make_shared<const FilteredReference>(*filtering, field);
    const auto* setting = want.setting.as<RadonSetting>();
    if (setting && setting->to == RadonSetting::To::image)
        return std::make_shared<const BackprojectedReference>(want, *setting, field);
    if (setting) return std::make_shared<const LineReference>(want, *setting, field);
    return nullptr;
}

}  // namespace edgewise
