#include "engine/chart_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/looked.hpp"
#include "measure/quantiles.hpp"
#include "reference/stored.hpp"

namespace edgewise {
namespace {

constexpr int kRows = 8;  // of the reference, between two checks whether to go on

int result_channels(const Looked& looked) {
    const Request& want = looked.want;
    if (want.job->of_rays()) return want.mode->channels;
    return looked.input.channels();
}

/// The middle of a picture's pixel among the samples of the output.
std::int64_t place(int pixel, int pixels, std::int64_t samples) {
    return static_cast<std::int64_t>((pixel + 0.5) * double(samples) / pixels);
}

}  // namespace

PictureTaker::PictureTaker(const Looked& looked, double most_values)
    : looked_(looked), output_(looked.want.output()) {
    channels_ = result_channels(looked) >= 3 ? 3 : 1;
    const double side = std::floor(std::sqrt(most_values / channels_));
    const double shrink = std::max({1.0, double(output_.x) / side, double(output_.y) / side});
    width_ = std::max(1, static_cast<int>(double(output_.x) / shrink));
    height_ = std::max(1, static_cast<int>(double(output_.y) / shrink));
}

std::vector<OutputSample> PictureTaker::pixels() const {
    std::vector<OutputSample> pixels;
    for (int y = 0; y < height_; ++y)
        for (int x = 0; x < width_; ++x)
            pixels.push_back(
                {0, place(x, width_, output_.x), place(y, height_, output_.y), output_.z / 2});
    return pixels;
}

/// Colours as they would be shown: a composite over its background, others without their alpha.
void PictureTaker::put(const double* values, int channels, float* out) const {
    const Request& want = looked_.want;
    const bool composite = want.job->of_rays() && want.mode->over_background;
    for (int c = 0; c < channels_; ++c) {
        const double under =
            composite ? (1 - values[3]) * want.background[static_cast<std::size_t>(c)] : 0;
        out[c] = static_cast<float>(values[std::min(c, channels - 1)] + under);
    }
}

charts::Raster PictureTaker::taken(const Data& result) const {
    charts::Raster raster{width_, height_, channels_, {}};
    const int channels = result.what.channels;
    const Extent& n = result.what.extent;
    std::vector<double> values(static_cast<std::size_t>(channels));
    for (const OutputSample& at : pixels()) {
        const std::int64_t sample = at.x + n.x * (at.y + n.y * at.z);
        for (int c = 0; c < channels; ++c)
            values[static_cast<std::size_t>(c)] = value_at(result, sample * channels + c);
        raster.values.resize(raster.values.size() + static_cast<std::size_t>(channels_));
        put(values.data(), channels, &*raster.values.end() - channels_);
    }
    return raster;
}

std::optional<charts::Raster> PictureTaker::reference(
    const ReferenceField& field, std::pmr::memory_resource* memory, const charts::Raster& elsewhere,
    const std::function<bool(double)>& go_on) const {
    const Reference reference(looked_.want, field, memory);
    const std::vector<OutputSample> all = pixels();
    charts::Raster raster = elsewhere;
    const auto channels = static_cast<std::size_t>(reference.channels());
    const std::size_t step = static_cast<std::size_t>(kRows) * static_cast<std::size_t>(width_);
    for (std::size_t begin = 0; begin < all.size(); begin += step) {
        if (!go_on(double(begin) / double(all.size()))) return std::nullopt;
        const std::size_t count = std::min(step, all.size() - begin);
        const std::vector<double> values = reference.values(std::span(all).subspan(begin, count));
        for (std::size_t i = 0; i < count; ++i)
            if (std::isfinite(values[i * channels]))
                put(&values[i * channels], reference.channels(),
                    &raster.values[(begin + i) * static_cast<std::size_t>(channels_)]);
    }
    return raster;
}

void PictureTaker::set_window(charts::Pictures& pictures) const {
    std::vector<double> values;
    for (const float value : pictures.base.values)
        if (std::isfinite(value)) values.push_back(value);
    if (values.empty()) return;
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    pictures.black = *low;
    pictures.white = *high;
    const store::Header& header = looked_.input.header;
    const Request& want = looked_.want;
    const double exposure = looked_.query.exposure.value_or(1);
    if (want.job->of_rays() && want.mode->over_background) {
        pictures.black = 0;
        pictures.white = 1 / exposure;
    } else if (!header.volume && (header.type == Type::u8 || !is_integer(header.type))) {
        pictures.black = 0;  // photographs are not stretched
        pictures.white = header.type == Type::u8 ? 255 : 1;
    }
    if (const auto& window = looked_.window) {
        const auto end = [&](const WindowEnd& at) {
            return at.percentile ? quantile(values, at.at / 100) : at.at / exposure;
        };
        pictures.black = end(window->low);
        pictures.white = end(window->high);
    }
    if (pictures.black == pictures.white) pictures.white = pictures.black + 1;
}

std::string PictureTaker::shown() const {
    std::string text = looked_.want.frames > 1 ? "Frame 0" : "The result";
    if (output_.z > 1) text += fmt::format(", slice {} of {}", output_.z / 2, output_.z);
    if (width_ < output_.x || height_ < output_.y)
        text +=
            fmt::format(", {} x {} of its {} x {} samples", width_, height_, output_.x, output_.y);
    return text;
}

std::string PictureTaker::note() const {
    return shown() + ". Differences are of the values, before any window.";
}

}  // namespace edgewise
