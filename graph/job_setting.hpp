#pragma once

#include <memory>
#include <typeinfo>
#include <utility>

namespace edgewise {

/// The part of a request that only one job has, such as the kernel of a filter: a value of a type
/// of the job's own, which the job's edges know. Copies share it; it never changes.
class JobSetting {
 public:
    JobSetting() = default;
    template <class T>
    static JobSetting of(T value) {
        JobSetting made;
        made.value_ = std::make_shared<const T>(std::move(value));
        made.type_ = &typeid(T);
        return made;
    }
    /// Null where it is of another type, or nothing.
    template <class T>
    const T* as() const noexcept {
        return type_ && *type_ == typeid(T) ? static_cast<const T*>(value_.get()) : nullptr;
    }

 private:
    std::shared_ptr<const void> value_;
    const std::type_info* type_ = nullptr;
};

}  // namespace edgewise
