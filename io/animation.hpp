#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <string_view>

#include "io/store.hpp"

namespace edgewise::store {

/// How the pictures of an animation follow one another. It starts again at its end, for ever.
struct Pace {
    int frames = 1;
    double fps = 15;  // pictures a second, 0.01 to 100
};

/// How many of the frames a file of this name leaves out so that none is shown for less than
/// viewers keep: in a GIF 0.02 s. Else 0.
int frames_left_out(std::string_view path, const Pace& pace);

/// One file of several pictures, of a format with Format::frames. Pictures are written as they
/// come, and the file is there when all of them are.
class Animation {
 public:
    /// @param what     each of the pictures
    /// @param encoder  file of the program ffmpeg, which makes films; "": there is none
    /// @param stop     set by whoever wants the work to end: what waits for another program then
    ///                 throws Cancelled. Null: nobody does
    /// @throws RequestError a format that cannot hold this
    /// @throws RunError     a folder that cannot be written
    Animation(const std::string& path, const Header& what, const Pace& pace,
              const std::string& encoder = {}, const std::atomic<bool>* stop = nullptr);
    Animation(const Animation&) = delete;
    Animation& operator=(const Animation&) = delete;
    ~Animation();

    /// The next picture, as store::write takes it. @throws RunError
    void add(const void* samples);
    /// After Pace::frames pictures. @throws RunError
    void commit();

 private:
    struct Content;
    std::unique_ptr<Content> content_;
};

/// Why a file of this name cannot hold several pictures like this one, or "".
std::string cannot_animate(std::string_view path, const Header& what, const std::string& encoder);
/// Why no file of this name can be made here whatever it would hold: the program that makes films
/// is not there. Else "".
std::string no_encoder(std::string_view path, const std::string& encoder);

}  // namespace edgewise::store
