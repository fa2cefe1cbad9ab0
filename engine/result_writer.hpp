#pragma once

#include <atomic>
#include <optional>
#include <string>

#include "engine/request/outputs.hpp"
#include "engine/request/spec.hpp"
#include "io/animation.hpp"

namespace edgewise {

/// Writes the results of a request: a file for each frame, or one that shows them one after
/// another.
class ResultWriter {
 public:
    /// All but the numbers outlive it.
    /// @param header  of each result
    /// @param stop    ends what waits for another program
    ResultWriter(const Outputs& outputs, const store::Header& header, const RequestSpec& spec,
                 int frames, const std::atomic<bool>& stop);

    /// @param samples  of a frame, as store::write takes them; frames of an animation come in order
    /// @return the file that is there now; nothing before an animation is whole
    /// @throws RunError, Cancelled
    std::optional<std::string> write(int frame, const void* samples);

 private:
    const Outputs& outputs_;
    const store::Header& header_;
    const RequestSpec& spec_;
    const int frames_;
    const std::atomic<bool>& stop_;
    std::optional<store::Animation> animation_;
};

/// @throws RequestError several frames and no place for their number; --fps of what is no animation
/// @return  a warning where the file leaves out some of the frames, or ""
std::string expect_frames(const RequestSpec& spec, const std::optional<Outputs>& outputs,
                          int frames);

}  // namespace edgewise
