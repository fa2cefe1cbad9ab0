#include "io/animation.hpp"

#include <fmt/format.h>

#include "graph/errors.hpp"
#include "io/frames.hpp"

namespace edgewise::store {

struct Animation::Content {
    Replacement out;
    std::unique_ptr<FrameWriter> frames;
    int left;  // pictures to come

    Content(const std::string& path, const Header& what, const Pace& pace,
            const std::string& encoder, const std::atomic<bool>* stop)
        : out(path), left(pace.frames) {
        const std::string& name = format_of(path)->name;
        frames = name == "GIF"   ? gif_frames(out, what, pace)
                 : name == "MP4" ? film_frames(out, what, pace, encoder, stop)
                                 : apng_frames(out, what, pace);
    }
};

int frames_left_out(std::string_view path, const Pace& pace) {
    const Format* format = format_of(path);
    if (!format || format->name != "GIF" || pace.frames < 2) return 0;
    return pace.frames - GifPace(pace).shown();
}

Animation::Animation(const std::string& path, const Header& what, const Pace& pace,
                     const std::string& encoder, const std::atomic<bool>* stop) {
    if (const std::string why = cannot_animate(path, what, encoder); !why.empty())
        throw RequestError(path + ": " + why);
    content_ = std::make_unique<Content>(path, what, pace, encoder, stop);
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
