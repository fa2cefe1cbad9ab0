#pragma once

#include <memory>
#include <string>

#include "io/store.hpp"

namespace edgewise::store {

/// How the pictures of an animation follow one another. It starts again at its end, for ever.
struct Pace {
    int frames = 1;
    double fps = 15;  // pictures a second, 0.01 to 100
};

/// One file of several pictures, of a format with Format::frames. Pictures are written as they
/// come, and the file is there when all of them are.
class Animation {
 public:
    /// @param what  each of the pictures
    /// @throws RequestError a format that cannot hold this
    /// @throws RunError     a folder that cannot be written
    Animation(const std::string& path, const Header& what, const Pace& pace);
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

}  // namespace edgewise::store
