#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>

#include "graph/data.hpp"
#include "io/store.hpp"

namespace edgewise {

struct Input;

/// How samples lie in the world.
struct Grid {
    std::array<double, 3> spacing{1, 1, 1};  // along x, y and z [unit]
    std::array<double, 3> origin{0, 0, 0};   // centre of the first sample [unit]
    /// Columns: where x, y and z point, unit vectors; in LPS where it is anatomical.
    std::array<std::array<double, 3>, 3> direction{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    std::string unit = "mm";
    bool anatomical = false;
};

/// Samples and what is known of them: of a file, or of the caller's memory. A cheap handle that
/// never changes; threads share it.
class Volume {
 public:
    /// Reads a header: of a file, of a folder, or of what else `edgewise info` takes.
    /// @throws InputError, RequestError
    static Volume read(const std::string& source, const store::Selection& selection = {});
    /// Samples of the caller, without a copy: x fastest, then y, then z, channels of one sample
    /// together. They must not change while a plan has them.
    /// @param axes   2 (an image; extent.z is 1) or 3
    /// @param owner  lives as long as anything that reads them
    /// @throws RequestError
    static Volume around(const void* first, const Extent& extent, int axes, int channels, Type type,
                         std::shared_ptr<const void> owner, const Grid& grid = {});

    /// The same of samples that do not lie side by side: every second row, a box of a larger
    /// volume, an array that runs backwards. Kernels read rows without gaps, so that the samples
    /// are copied once, now; the caller's memory is not needed afterwards.
    /// @param strides  from a sample to the next along x, y and z [byte]; channels lie side by side
    static Volume copied(const void* first, const std::array<std::ptrdiff_t, 3>& strides,
                         const Extent& extent, int axes, int channels, Type type,
                         const Grid& grid = {});

    /// One channel of several, from 0. That of a file is read when samples are needed; that of
    /// memory is copied, once and now.
    /// @throws OutOfLimits where there is none of this number
    Volume channel(int number) const;
    /// The same by the name that the file gives it, in any case. @throws RequestError, InputError
    Volume channel(const std::string& name) const;

    /// The same with its samples in memory: those of a file are read now, once for all plans that
    /// are made of it, and what is known of the file counts for them. A plan that needs more digits
    /// than f32 has (labels, integers that only move) still reads the file.
    /// @throws InputError, std::bad_alloc
    Volume loaded() const;

    /// As a request sees it: its name, what the header says, what of it is selected.
    const Input& input() const noexcept { return *input_; }
    const store::Header& header() const noexcept;
    bool in_memory() const noexcept { return data_ != nullptr; }
    /// Of the caller's memory; null: of a file.
    const std::shared_ptr<const Data>& data() const noexcept { return data_; }
    /// A file as it was read; null: each request reads it, or there is none.
    const std::shared_ptr<const Input>& read_input() const noexcept { return loaded_; }
    /// The samples: those of a file are read now. What f32 cannot hold is rounded to it.
    /// @throws InputError, std::bad_alloc
    std::shared_ptr<const Data> samples() const;

 private:
    std::shared_ptr<const Input> input_;
    std::shared_ptr<const Data> data_;
    std::shared_ptr<const Input> loaded_;
};

}  // namespace edgewise
