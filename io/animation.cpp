#include "io/animation.hpp"

#include <fmt/format.h>

#include "graph/errors.hpp"
#include "io/frames.hpp"

namespace edgewise::store {

struct Animation::Content {
    Replacement out;
    std::unique_ptr<FrameWriter> frames;
    int left;  // pictures to come

    Content(const std::string& path, const Header& what, const Pace& pace, const Format& format)
        : out(path), left(pace.frames) {
        frames = format.name == "GIF" ? gif_frames(out, what, pace) : apng_frames(out, what, pace);
    }
};

Animation::Animation(const std::string& path, const Header& what, const Pace& pace) {
    if (const std::string why = cannot_write(path, what); !why.empty())
        throw RequestError(path + ": " + why);
    const Format& format = *format_of(path);
    if (!format.frames)
        throw RequestError(fmt::format("{}: {} holds one picture", path, format.name));
    content_ = std::make_unique<Content>(path, what, pace, format);
}

Animation::~Animation() = default;

void Animation::add(const void* samples) {
    content_->frames->add(samples);
    --content_->left;
}

void Animation::commit() {
    if (content_->left != 0)
        throw RunError(fmt::format("{}: {} pictures more or fewer than announced",
                                   content_->out.path(), content_->left));
    content_->frames->finish();
    content_->out.commit();
}

}  // namespace edgewise::store
