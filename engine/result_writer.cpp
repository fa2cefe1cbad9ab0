#include "engine/result_writer.hpp"

#include "graph/errors.hpp"

namespace edgewise {

ResultWriter::ResultWriter(const Outputs& outputs, const store::Header& header,
                           const RequestSpec& spec, int frames, const std::atomic<bool>& stop)
    : outputs_(outputs), header_(header), spec_(spec), frames_(frames), stop_(stop) {}

std::optional<std::string> ResultWriter::write(int frame, const void* samples) {
    const std::string file = outputs_.file(frame);
    if (!outputs_.animates(frames_)) {
        store::write(file, header_, samples, {spec_.quality});
        return file;
    }
    if (!animation_) {
        store::Pace pace{.frames = frames_};
        if (spec_.fps) pace.fps = *spec_.fps;
        animation_.emplace(file, header_, pace, &stop_);
    }
    animation_->add(samples);
    if (frame + 1 < frames_) return std::nullopt;
    animation_->commit();
    animation_.reset();
    return file;
}

void expect_frames(const RequestSpec& spec, const std::optional<Outputs>& outputs, int frames) {
    if (!outputs) return;
    outputs->expect_frames(frames);
    if (spec.fps && !outputs->none() && !outputs->animates(frames))
        throw RequestError(
            "--fps: of an animation only: several frames in one .gif, .apng or .mp4, without %d");
}

}  // namespace edgewise
