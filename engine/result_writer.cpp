#include "engine/result_writer.hpp"

#include <algorithm>
#include <cstddef>
#include <fmt/format.h>

#include "graph/errors.hpp"

namespace edgewise {
namespace {

store::Pace pace_of(const Query& query, int frames) {
    store::Pace pace{.frames = frames};
    if (query.fps) pace.fps = *query.fps;
    return pace;
}

/// Slices that a montage shows, where there are more than it has room for: equally far apart.
std::vector<std::int64_t> shown_slices(const LookSpec& look, std::int64_t slices) {
    std::vector<std::int64_t> shown;
    std::int64_t count = slices;
    if (look.montage)
        count =
            std::min<std::int64_t>(slices, std::int64_t{(*look.montage)[0]} * (*look.montage)[1]);
    for (std::int64_t k = 0; k < count; ++k) shown.push_back((2 * k + 1) * slices / (2 * count));
    return shown;
}

}  // namespace

ResultWriter::ResultWriter(const Outputs& outputs, const Written& written, const Query& query,
                           int frames, const std::atomic<bool>& stop)
    : outputs_(outputs),
      written_(written),
      query_(query),
      pictures_(written.slices > 1
                    ? static_cast<int>(shown_slices(query.look, written.slices).size())
                    : frames),
      files_(sheets_of(query.look, pictures_)),
      stop_(stop) {
    if (!query.look.empty()) sheet_.emplace(query.look, written.header, pictures_);
}

std::vector<std::string> ResultWriter::write(int frame, const void* samples, const Shades& levels) {
    std::vector<std::string> files;
    const store::Header& header = written_.header;
    if (sheet_ && query_.look.legend && written_.colours)
        sheet_->explain(
            depth_ ? depth_legend(*written_.colours, *depth_, header.unit)
                   : Legend{*written_.colours, levels.black, levels.white, written_.value_unit});
    if (sheet_ && query_.look.montage) sheet_->surround(nothing_written(levels));
    if (written_.slices == 1) {
        write_picture(frame, header, samples, files);
        return files;
    }
    const auto bytes =
        static_cast<std::size_t>(header.extent.samples() * header.channels) * bytes_of(header.type);
    store::Header slice = header;
    int number = 0;
    for (const std::int64_t k : shown_slices(query_.look, written_.slices)) {
        if (stop_) throw Cancelled();
        for (std::size_t row = 0; row < 3; ++row)
            slice.origin[row] = header.origin[row] + static_cast<double>(k) * header.spacing[2] *
                                                         header.direction[2][row];
        write_picture(number++, slice,
                      static_cast<const std::byte*>(samples) + static_cast<std::size_t>(k) * bytes,
                      files);
    }
    return files;
}

std::vector<std::uint8_t> ResultWriter::nothing_written(const Shades& levels) const {
    const Tail& tail = written_.tail;
    const int written = written_.header.channels;
    // Values as they are have no black; hues of depths stand for no value.
    if (!tail.view || tail.table || depth_)
        return std::vector<std::uint8_t>(static_cast<std::size_t>(written));
    Representation what;
    what.type = Type::f32;
    what.extent = {1, 1, 1};
    what.channels = tail.over_background ? 4 : tail.channels;
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
    Data nothing = Data::make(what, memory);
    const double value =
        what.channels > 1 ? 0 : nothing_.value_or(std::min(levels.black, levels.white));
    for (int c = 0; c < what.channels; ++c) nothing.as<float>()[c] = static_cast<float>(value);
    const Array bytes = written_samples(nothing, written_, levels, memory);
    const auto* first = static_cast<const std::uint8_t*>(bytes.data());
    return {first, first + written};
}

void ResultWriter::write_picture(int number, const store::Header& header, const void* samples,
                                 std::vector<std::string>& files) {
    if (!sheet_)
        write_file(number, header, samples, files);
    else if (sheet_->add(number, samples))
        write_file(files_ == 1 ? 0 : number, sheet_->header(), sheet_->samples(), files);
}

void ResultWriter::write_file(int number, const store::Header& header, const void* samples,
                              std::vector<std::string>& files) {
    std::string file = outputs_.file(number);
    if (written_.slices > 1 || !outputs_.animates(files_)) {
        store::write(file, header, samples, {query_.quality});
        files.push_back(std::move(file));
        return;
    }
    if (!animation_)
        animation_.emplace(file, header, pace_of(query_, files_), outputs_.encoder(), &stop_);
    animation_->add(samples);
    if (number + 1 < files_) return;
    animation_->commit();
    animation_.reset();
    files.push_back(std::move(file));
}

Message expect_frames(const Query& query, const std::optional<Outputs>& outputs, int frames) {
    frames = sheets_of(query.look, frames);
    if (!outputs) return {};
    outputs->expect_frames(frames);
    if (query.fps && !outputs->none() && !outputs->animates(frames))
        throw RequestError(message(
            "@fps: of an animation only: several frames in one .gif, .apng or .mp4, without %d"));
    if (!outputs->animates(frames)) return {};
    const std::string file = outputs->file(0);
    const int left_out = store::frames_left_out(file, pace_of(query, frames));
    if (left_out == 0) return {};
    return message(
        "{}: {} of {} frames are left out, as viewers show pictures of a GIF for 0.02 s at least; "
        "@fps(50) keeps all of them, .apng and .mp4 at {:g} a second too",
        file, left_out, frames, pace_of(query, frames).fps);
}

}  // namespace edgewise
