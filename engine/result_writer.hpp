#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/written.hpp"
#include "io/animation.hpp"
#include "presentation/sheet.hpp"
#include "request/outputs.hpp"
#include "request/query.hpp"

namespace edgewise {

/// Writes the results of a request: a file for each frame, or one that shows them one after
/// another; each slice of a volume; a montage of either.
class ResultWriter {
 public:
    /// All but the numbers outlive it.
    /// @param written  what each result is written as
    /// @param stop     ends what waits for another program
    ResultWriter(const Outputs& outputs, const Written& written, const Query& query, int frames,
                 const std::atomic<bool>& stop);

    /// Colours stand for depths up to this [file unit], not for values; before the first picture.
    void explain_depth(double depth) { depth_ = depth; }
    /// What rays that meet nothing show is around the pictures of a montage: this value, where they
    /// have one channel; else, and where nobody says it, no light or the least value.
    void surround(double nothing) { nothing_ = nothing; }
    /// @param samples  of a frame, as store::write takes them; frames of an animation come in order
    /// @param levels   that they were made with
    /// @return the files that are there now; none before an animation, or a montage, is whole
    /// @throws RunError, Cancelled
    std::vector<std::string> write(int frame, const void* samples, const Shades& levels);

 private:
    /// A pixel of nothing.
    std::vector<std::uint8_t> nothing_written(const Shades& levels) const;
    /// One of all pictures, as it is or drawn upon.
    void write_picture(int number, const store::Header& header, const void* samples,
                       std::vector<std::string>& files);
    void write_file(int number, const store::Header& header, const void* samples,
                    std::vector<std::string>& files);

    const Outputs& outputs_;
    const Written& written_;
    const Query& query_;
    const int pictures_;  // frames, or slices of the only one
    int files_;
    std::optional<double> depth_, nothing_;
    const std::atomic<bool>& stop_;
    std::optional<Sheet> sheet_;
    std::optional<store::Animation> animation_;
};

/// @throws RequestError several frames and no place for their number; more than a montage has room
///         for; --fps of what is no animation
/// @return  a warning where the file leaves out some of the frames, or ""
Message expect_frames(const Query& query, const std::optional<Outputs>& outputs, int frames);

}  // namespace edgewise
