#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "io/animation.hpp"
#include "io/file.hpp"
#include "io/store.hpp"

namespace edgewise::store {

/// Writes pictures one after another into a file.
class FrameWriter {
 public:
    virtual ~FrameWriter() = default;
    virtual void add(const void* samples) = 0;
    virtual void finish() = 0;
};

/// GIF 89a. Grey levels and up to 256 colours of a picture are kept; more are quantised.
/// @param what  u8, 1 or 3 channels; a side has at most 65535 pixels
std::unique_ptr<FrameWriter> gif_frames(Replacement& out, const Header& what, const Pace& pace);
/// PNG with the chunks of APNG (PNG, third edition, 11.3.6).
std::unique_ptr<FrameWriter> apng_frames(Replacement& out, const Header& what, const Pace& pace);
/// A film: H.264 in MP4, made by the program ffmpeg. Odd sides become even by the last column or
/// row once more.
/// @param what  u8, 1 or 3 channels
/// @param stop  ends it where it is set, see Animation
std::unique_ptr<FrameWriter> film_frames(Replacement& out, const Header& what, const Pace& pace,
                                         const std::atomic<bool>* stop);
/// Why there can be no film, or "".
std::string no_film();

}  // namespace edgewise::store
