#include "graph/data.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "graph/small_objects.hpp"

namespace edgewise {
namespace {
constexpr std::size_t kAlignment = 64;  // a cache line, and the widest vector

template <class T>
std::pmr::polymorphic_allocator<T> small() {
    return small_objects();
}

}  // namespace

Array::Block::Block(std::size_t size, std::pmr::memory_resource* resource)
    : data(resource->allocate(size + kArraySlack, kAlignment)), bytes(size), from(resource) {}

Array::Block::Block(void* held, std::size_t size, std::shared_ptr<const void> holder)
    : data(held), bytes(size), owner(std::move(holder)) {}

Array::Block::~Block() {
    if (from) from->deallocate(data, bytes + kArraySlack, kAlignment);
}

Array::Array(std::size_t bytes, std::pmr::memory_resource* from)
    : block_(std::allocate_shared<Block>(small<Block>(), bytes, from)) {}

Array Array::around(void* data, std::size_t bytes, std::shared_ptr<const void> owner) {
    return Array(std::allocate_shared<Block>(small<Block>(), data, bytes, std::move(owner)));
}

void WorkedOut::keep(const char* kind, std::shared_ptr<const void> thing) {
    constexpr std::size_t kMost = 4;
    const std::lock_guard lock(mutex_);
    if (things_.size() < kMost) things_.emplace_back(kind, std::move(thing));
}

Data Data::sharing(const Data& other, const Representation& what) {
    return {what,        other.samples.shared(), other.box,       other.tail.shared(),
            other.other, other.facets,           other.worked_out};
}

Data Data::make(const Representation& what, std::pmr::memory_resource* from) {
    return make(what, {}, from);
}

Data Data::make(const Representation& what, const Region& box, std::pmr::memory_resource* from) {
    const double bytes = box.empty() ? what.bytes() : what.bytes(box);
    return {what, Array(static_cast<std::size_t>(bytes), from), box, {}, {}, {}, {}};
}

Data with_slack(const Data& data, std::pmr::memory_resource* from) {
    Data with = Data::sharing(data, data.what);
    const std::size_t bytes = data.samples.bytes();
    if (bytes == 0 || data.samples.has_slack() || data.tail.bytes() > 0) return with;
    const auto row = static_cast<std::size_t>(data.row()) * bytes_of(data.what.type);
    // A vector that begins in a row ends at most kArraySlack bytes behind it.
    const std::size_t rows = (kArraySlack + row - 1) / row;
    const bool in_rows = data.what.layout == Layout::linear;
    const std::size_t last = in_rows ? std::min(rows * row, bytes) : bytes;
    Array& copy = last == bytes ? with.samples : with.tail;
    copy = Array(last, from);
    std::memcpy(copy.data(), data.as<char>() + (bytes - last), last);
    return with;
}

void copy_box(const Data& from, Data& to) noexcept {
    const Region box = from.held();
    const std::size_t bytes = static_cast<std::size_t>(from.row()) * bytes_of(from.what.type);
    for (std::int64_t z = box.begin[2]; z < box.end[2]; ++z)
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            std::memcpy(to.row_at(box.begin[0], y, z), from.row_at(box.begin[0], y, z), bytes);
}

}  // namespace edgewise
