#pragma once

#include <atomic>
#include <memory>
#include <optional>
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

/// When pictures of a GIF begin, in whole hundredths of a second. Browsers show a delay of one
/// hundredth, or none, for ten. So pictures last for two at least: of more than 50 a second some
/// are left out, evenly, and the film lasts as long as asked.
class GifPace {
 public:
    explicit GifPace(const Pace& pace) noexcept;

    int shown() const noexcept { return shown_; }
    /// The place of a frame among those that are shown, or nothing where it is left out.
    std::optional<int> place_of(int frame) const noexcept;
    /// From a shown picture to the next [0.01 s].
    int delay(int place) const noexcept;

 private:
    int frames_, shown_;
    double lasts_, places_;  // so many hundredths of a second for so many places
};

/// GIF 89a. Grey levels and up to 256 colours of a picture are kept; more are quantised.
/// @param what  u8, 1 or 3 channels; a side has at most 65535 pixels
std::unique_ptr<FrameWriter> gif_frames(Replacement& out, const Header& what, const Pace& pace);
/// PNG with the chunks of APNG (PNG, third edition, 11.3.6).
std::unique_ptr<FrameWriter> apng_frames(Replacement& out, const Header& what, const Pace& pace);
/// A film: H.264 in MP4, made by the program ffmpeg. Odd sides become even by the last column or
/// row once more.
/// @param what  u8, 1 or 3 channels
/// @param encoder, stop  see Animation
std::unique_ptr<FrameWriter> film_frames(Replacement& out, const Header& what, const Pace& pace,
                                         const std::string& encoder, const std::atomic<bool>* stop);
/// Why there can be no film, or "".
std::string no_film(const std::string& encoder);

}  // namespace edgewise::store
