#include "engine/result_writer.hpp"

#include <fmt/format.h>

#include "graph/errors.hpp"

namespace edgewise {
namespace {

store::Pace pace_of(const RequestSpec& spec, int frames) {
    store::Pace pace{.frames = frames};
    if (spec.fps) pace.fps = *spec.fps;
    return pace;
}

}  // namespace

ResultWriter::ResultWriter(const Outputs& outputs, const store::Header& header,
                           const RequestSpec& spec, int frames, const std::atomic<bool>& stop)
    : outputs_(outputs), header_(header), spec_(spec), frames_(frames), stop_(stop) {}

std::optional<std::string> ResultWriter::write(int frame, const void* samples) {
    const std::string file = outputs_.file(frame);
    if (!outputs_.animates(frames_)) {
        store::write(file, header_, samples, {spec_.quality});
        return file;
    }
    if (!animation_) animation_.emplace(file, header_, pace_of(spec_, frames_), &stop_);
    animation_->add(samples);
    if (frame + 1 < frames_) return std::nullopt;
    animation_->commit();
    animation_.reset();
    return file;
}

std::string expect_frames(const RequestSpec& spec, const std::optional<Outputs>& outputs,
                          int frames) {
    if (!outputs) return {};
    outputs->expect_frames(frames);
    if (spec.fps && !outputs->none() && !outputs->animates(frames))
        throw RequestError(
            "--fps: of an animation only: several frames in one .gif, .apng or .mp4, without %d");
    if (!outputs->animates(frames)) return {};
    const std::string file = outputs->file(0);
    const int left_out = store::frames_left_out(file, pace_of(spec, frames));
    if (left_out == 0) return {};
    return fmt::format(
        "{}: {} of {} frames are left out, as viewers show pictures of a GIF for 0.02 s at least; "
        "--fps 50 keeps all of them, .apng and .mp4 at {:g} a second too",
        file, left_out, frames, pace_of(spec, frames).fps);
}

}  // namespace edgewise
