#include "graph/data.hpp"

#include <utility>

namespace edgewise {
namespace {
constexpr std::size_t kAlignment = 64;  // a cache line, and the widest vector
}

Array::Array(std::size_t bytes, std::pmr::memory_resource* from)
    : data_(from->allocate(bytes + kArraySlack, kAlignment)), bytes_(bytes), from_(from) {}

Array::~Array() {
    if (data_) from_->deallocate(data_, bytes_ + kArraySlack, kAlignment);
}

void Array::swap(Array& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    std::swap(from_, other.from_);
}

Data Data::make(const Representation& what, std::pmr::memory_resource* from) {
    Data data;
    data.what = what;
    data.samples = Array(static_cast<std::size_t>(what.bytes()), from);
    return data;
}

}  // namespace edgewise
