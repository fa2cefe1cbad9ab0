#pragma once

#include <cstddef>
#include <memory_resource>

namespace edgewise::kernels {

/// Uninitialised scratch for n values of T, aligned to 64 bytes, given back at the end of its
/// scope.
template <class T>
class Block {
 public:
    Block(std::size_t n, std::pmr::memory_resource* memory)
        : memory_(memory), bytes_(n * sizeof(T)) {
        data_ = static_cast<T*>(memory_->allocate(bytes_, 64));
    }
    ~Block() { memory_->deallocate(data_, bytes_, 64); }
    Block(const Block&) = delete;
    Block& operator=(const Block&) = delete;

    T* data() noexcept { return data_; }
    T& operator[](std::size_t i) noexcept { return data_[i]; }

 private:
    std::pmr::memory_resource* memory_;
    std::size_t bytes_;
    T* data_;
};

}  // namespace edgewise::kernels
