#include "engine/shown.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <new>

#include "engine/run.hpp"
#include "graph/errors.hpp"
#include "reference/job_reference.hpp"

namespace edgewise {
namespace {

constexpr double kLargeSide = 512;                          // pixels
constexpr double kMostLarge = 4 * kLargeSide * kLargeSide;  // values of up to four channels
constexpr int kMostChannels = 4;

/// The samples of a result that a picture shows, as a result of their own.
std::shared_ptr<const Data> sampled(const Data& result, const PictureTaker& taker,
                                    std::pmr::memory_resource* memory) {
    Representation what = result.what;
    what.extent = {taker.width(), taker.height(), 1};
    Data picture = Data::make(what, memory);
    const Extent& n = result.what.extent;
    const std::size_t each = static_cast<std::size_t>(what.channels) * bytes_of(result.what.type);
    std::byte* to = picture.as<std::byte>();
    for (const OutputSample& at : taker.pixels()) {
        const auto sample = static_cast<std::size_t>(at.x + n.x * (at.y + n.y * at.z));
        std::memcpy(to, result.as<std::byte>() + sample * each, each);
        to += each;
    }
    return std::make_shared<const Data>(std::move(picture));
}

/// As a picture is written; what is written as values is shown through a window.
Tail tail_of(const Looked& looked) {
    Tail tail = looked.written.tail;
    const bool written = looked.outputs && !looked.outputs->none();
    if (written && tail.type == Type::u8 && !looked.written.header.volume) return tail;
    tail.view = true;
    tail.type = Type::u8;
    tail.values = {};
    if (looked.want.job->samples && looked.input.premultiplied() &&
        tail.channels == looked.input.channels())
        tail.alpha = store::Alpha::straight;
    return tail;
}

std::string value_text(double value) { return fmt::format("{:.4g}", value); }

}  // namespace

ShownResult::ShownResult(const Looked& looked, Shown& shown, Listener& messages)
    : looked_(looked),
      shown_(shown),
      messages_(messages),
      large_(looked, kLargeSide * kLargeSide * PictureTaker(looked).channels()),
      small_(looked) {}

charts::ReportPicture ShownResult::picture_of(const Data& result, const Shades& levels) const {
    const Tail tail = tail_of(looked_);
    const std::shared_ptr<const Data> shown[] = {sampled(result, large_, looked_.memory.get())};
    const store::Header& header = looked_.input.header;
    Shades used = levels;
    if (tail.view && !looked_.written.tail.view) {
        const bool photograph = !header.volume && !is_integer(header.type);
        used =
            photograph && !looked_.window ? Shades{0, 1} : shades_of(shown, looked_.window, tail);
    }
    const Array samples = finished(*shown[0], tail, used, looked_.memory.get());
    const auto* bytes = static_cast<const unsigned char*>(samples.data());
    const std::size_t count = static_cast<std::size_t>(large_.width()) *
                              static_cast<std::size_t>(large_.height()) *
                              static_cast<std::size_t>(tail.channels);
    charts::ReportPicture picture{
        charts::png_uri({bytes, bytes + count}, large_.width(), large_.height(), tail.channels),
        large_.width(), large_.height(), large_.shown()};
    if (tail.view)
        picture.text += fmt::format(": {} is black, {} is white", value_text(used.black),
                                    value_text(used.white));
    return picture;
}

void ShownResult::take(const Data& result, const Shades& levels) {
    if (shown_.picture) return;
    shown_.picture = picture_of(result, levels);
    taken_ = small_.taken(result);
}

void ShownResult::compare(const Data& samples) {
    if (taken_.values.empty()) return;
    charts::Raster unseen = taken_;
    std::fill(unseen.values.begin(), unseen.values.end(), NAN);
    try {
        const ReferenceField field(samples, looked_.want.field,
                                   looked_.input.phantom ? &*looked_.input.phantom : nullptr);
        const auto reference =
            small_.reference(field, looked_.memory.get(), unseen, [&](double share) {
                messages_.progress(share, "error map");
                return !messages_.stop();
            });
        messages_.end_progress();
        if (!reference) throw Cancelled();
        const auto own = job_reference(looked_.want, field);
        show_difference(*reference, own ? own->range() : std::nullopt);
    } catch (const std::bad_alloc&) {
        shown_.no_difference = "There was no memory left for an error map.";
    }
}

/// Of several channels the largest difference; pixels that do not see the input have none.
void ShownResult::show_difference(const charts::Raster& reference, std::optional<double> range) {
    const auto channels = static_cast<std::size_t>(reference.channels);
    std::vector<double> differences(reference.values.size() / channels);
    for (std::size_t i = 0; i < reference.values.size(); ++i) {
        if (!std::isfinite(reference.values[i])) continue;
        const double d = double(taken_.values[i]) - double(reference.values[i]);
        double& most = differences[i / channels];
        if (!std::isfinite(d) || std::abs(d) > std::abs(most)) most = std::isnan(most) ? most : d;
    }
    const charts::SignedPicture picture =
        charts::signed_picture(differences, reference.width, reference.height);
    shown_.difference = {picture.uri, reference.width, reference.height,
                         difference_text(reference, range)};
    shown_.difference_scale = picture.scale;
}

std::string ShownResult::difference_text(const charts::Raster& reference,
                                         std::optional<double> own_range) const {
    const Request& want = looked_.want;
    double squares = 0, low = INFINITY, high = -INFINITY, least = 0, most = 0;
    std::size_t count = 0, differ = 0;
    for (std::size_t i = 0; i < reference.values.size(); ++i) {
        const double there = reference.values[i];
        if (!std::isfinite(there)) continue;
        const double d = taken_.values[i] - there;
        squares += d * d;
        low = std::min(low, there), high = std::max(high, there);
        least = std::min(least, d), most = std::max(most, d);
        differ += d != 0;
        ++count;
    }
    std::string text = fmt::format("Error map. {}, minus the reference. ", small_.shown());
    if (count == 0) return text + "No pixel of it sees the input.";
    const double range = own_range ? *own_range : range_of(want, low, high);
    const double rms = std::sqrt(squares / double(count));
    const std::size_t pixels = count / static_cast<std::size_t>(reference.channels);
    if (want.job->of_points() && want.field == Field::nearest)
        return text +
               fmt::format("{:.3g} % of its {} pixels that see the input have another label.",
                           100 * double(differ) / double(count), pixels);
    return text + fmt::format(
                      "RMS {:.4g} [value], {:.3g} of the range {:.4g}, over its {} pixels that see "
                      "the input; from {:.4g} to {:+.4g}. Colours go with the root of the size.",
                      rms, rms / range, range, pixels, least, most);
}

double shown_bytes(const Looked& looked) {
    if (!looked.as.shows) return 0;
    const Extent n = looked.want.output();
    const double values = std::min(kMostLarge, double(n.x) * double(n.y) * kMostChannels);
    // A copy in the result's type, its 8 bits, the PNG and its text; the small one.
    return values * (sizeof(float) + 4) + 2 * values / 16 * sizeof(float);
}

double showing_bytes(const Looked& looked) {
    if (!looked.as.shows || !looked.input.data->samples.data()) return 0;
    const ReferenceField field(*looked.input.data, looked.want.field,
                               looked.input.phantom ? &*looked.input.phantom : nullptr);
    const Reference reference(looked.want, field, std::pmr::null_memory_resource());
    const PictureTaker taker(looked);
    const double pixels = double(taker.width()) * taker.height();
    constexpr double kRows = 8, kPage = 6 << 20;  // rows at a time; texts, the graph among them
    const double places = pixels * 2 * sizeof(OutputSample) + pixels * 12 * sizeof(double);
    return std::max(kPage, places + reference.bytes(kRows * taker.width(), looked.want.threads));
}

}  // namespace edgewise
