#include "graph/data.hpp"

#include <cstring>
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

Data Data::make(const Representation& what, const Region& box, std::pmr::memory_resource* from) {
    Data data;
    data.what = what;
    data.box = box;
    data.samples = Array(static_cast<std::size_t>(what.bytes(box)), from);
    return data;
}

void copy_box(const Data& from, Data& to) noexcept {
    const Region box = from.held();
    const std::size_t bytes = static_cast<std::size_t>(from.row()) * bytes_of(from.what.type);
    for (std::int64_t z = box.begin[2]; z < box.end[2]; ++z)
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            std::memcpy(to.row_at(box.begin[0], y, z), from.row_at(box.begin[0], y, z), bytes);
}

}  // namespace edgewise
