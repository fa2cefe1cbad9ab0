#pragma once

#include <memory>
#include <typeinfo>
#include <utility>

#include "graph/fingerprint.hpp"

namespace edgewise {

/// The part of a request that only one job has, such as the kernel of a filter: a value of a type
/// of the job's own, which the job's edges know. Copies share it; it never changes. What is
/// measured for it is kept from run to run where the type has visit_fields()
/// (graph/fingerprint.hpp).
class JobSetting {
 public:
    JobSetting() = default;
    template <class T>
    static JobSetting of(T value) {
        JobSetting made;
        made.value_ = std::make_shared<const T>(std::move(value));
        made.type_ = &typeid(T);
        made.add_ = [](Fingerprint& to, const void* setting) {
            if constexpr (HasFields<T>)
                to.add(*static_cast<const T*>(setting));
            else
                to.cannot_tell();
        };
        return made;
    }
    /// Null where it is of another type, or nothing.
    template <class T>
    const T* as() const noexcept {
        return type_ && *type_ == typeid(T) ? static_cast<const T*>(value_.get()) : nullptr;
    }
    friend void add_to(Fingerprint& to, const JobSetting& setting) {
        to.add(setting.value_ != nullptr);
        if (!setting.value_) return;
        to.add(setting.type_->name());
        setting.add_(to, setting.value_.get());
    }

 private:
    std::shared_ptr<const void> value_;
    const std::type_info* type_ = nullptr;
    void (*add_)(Fingerprint& to, const void* setting) = nullptr;
};

}  // namespace edgewise
