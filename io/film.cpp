// Films: raw pictures go to the program ffmpeg, which compresses them as H.264 and puts them into
// an MP4. Links no library: whoever has no ffmpeg still has all else.

#include <array>
#include <cstdint>
#include <fmt/format.h>
#include <sys/stat.h>
#include <vector>

#include "graph/errors.hpp"
#include "io/child.hpp"
#include "io/frames.hpp"

namespace edgewise::store {
namespace {

constexpr const char* kProgram = "ffmpeg";

std::int64_t even(std::int64_t side) noexcept { return side + side % 2; }

/// No shell reads these, and the name of the file is marked as one, so nothing in it is an option
/// or another protocol.
std::vector<std::string> words_of(const std::string& program, const std::string& file,
                                  const Header& what, const Pace& pace) {
    const std::string size = fmt::format("{}x{}", even(what.extent.x), even(what.extent.y));
    return {program, "-hide_banner", "-loglevel", "error", "-nostdin", "-y",
            // What comes.
            "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", size, "-framerate",
            fmt::format("{}", pace.fps), "-i", "pipe:0",
            // The matrix of high definition, and the words that say so: players guess otherwise.
            "-vf",
            "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_inp,"
            "format=yuv420p",
            "-color_range", "tv", "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc",
            "bt709",
            // A fixed number of threads, and no dates or versions: equal pictures, equal bytes.
            "-an", "-c:v", "libx264", "-preset", "medium", "-crf", "18", "-threads", "4",
            "-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-movflags",
            "+faststart", "-f", "mp4", "file:" + file};
}

class FilmFrames final : public FrameWriter {
 public:
    FilmFrames(Replacement& out, const Header& what, const Pace& pace, const std::string& program,
               const std::atomic<bool>* stop)
        : out_(out),
          width_(static_cast<std::size_t>(what.extent.x)),
          height_(static_cast<std::size_t>(what.extent.y)),
          channels_(static_cast<std::size_t>(what.channels)),
          row_(3 * static_cast<std::size_t>(even(what.extent.x))),
          encoder_(words_of(program, out.temporary(), what, pace),
                   fmt::format("{}: {}", out.path(), kProgram), stop) {}

    void add(const void* samples) override {
        const auto* row = static_cast<const std::uint8_t*>(samples);
        picture_.clear();
        for (std::size_t y = 0; y < height_; ++y, row += width_ * channels_) append(row);
        if (height_ % 2 == 1) append(row - width_ * channels_);
        encoder_.write(std::as_bytes(std::span(picture_)));
    }

    void finish() override {
        encoder_.finish();
        struct stat status {};
        if (::stat(out_.temporary().c_str(), &status) != 0 || status.st_size == 0)
            throw RunError(fmt::format("{}: {} has written nothing", out_.path(), kProgram));
    }

 private:
    void append(const std::uint8_t* pixels) {
        for (std::size_t x = 0; x < width_; ++x)
            for (std::size_t c = 0; c < 3; ++c)
                row_[3 * x + c] = pixels[channels_ * x + (channels_ == 3 ? c : 0)];
        if (width_ % 2 == 1)
            for (std::size_t c = 0; c < 3; ++c) row_[3 * width_ + c] = row_[3 * width_ - 3 + c];
        picture_.insert(picture_.end(), row_.begin(), row_.end());
    }

    Replacement& out_;
    const std::size_t width_, height_, channels_;
    std::vector<std::uint8_t> row_, picture_;
    Child encoder_;
};

}  // namespace

std::string no_film(const std::string& encoder) {
    if (!encoder.empty()) return {};
    return "films are made by the program ffmpeg, which was not found; .gif and .apng are "
           "animations that need no other program";
}

std::unique_ptr<FrameWriter> film_frames(Replacement& out, const Header& what, const Pace& pace,
                                         const std::string& encoder,
                                         const std::atomic<bool>* stop) {
    return std::make_unique<FilmFrames>(out, what, pace, encoder, stop);
}

}  // namespace edgewise::store
