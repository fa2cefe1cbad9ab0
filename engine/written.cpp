#include "engine/written.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "engine/filter_result.hpp"
#include "graph/errors.hpp"
#include "io/animation.hpp"
#include "io/geometry.hpp"
#include "presentation/coloured.hpp"
#include "request/windows.hpp"

namespace edgewise {
namespace {

/// Lengths that differ by rounding only are one.
double told(double length, double known) {
    return std::abs(length - known) <= 1e-12 * known ? known : length;
}

/// Where the output lies: its samples are where those of the input at Geometry::lies are.
void take_place(store::Header& header, const store::Header& input, const Geometry& geometry) {
    const Mat4& lies = geometry.lies;
    for (int axis = 0; axis < (header.volume ? 3 : 2); ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        const Vec3 along = lies.col(axis).head<3>();
        store::Vector step{};
        int axes = 0, only = 0;
        for (int from = 0; from < 3; ++from) {
            if (along[from] != 0) ++axes, only = from;
            for (std::size_t row = 0; row < 3; ++row)
                step[row] += input.direction[static_cast<std::size_t>(from)][row] *
                             input.spacing[static_cast<std::size_t>(from)] * along[from];
        }
        header.spacing[k] = told(store::length(step), geometry.grid.spacing[axis]);
        for (std::size_t row = 0; row < 3; ++row)
            header.direction[k][row] = step[row] / store::length(step);
        if (axes != 1) continue;
        // Along one axis of the input it points exactly as that one does, or the other way.
        header.spacing[k] = geometry.grid.spacing[axis];
        header.direction[k] = input.direction[static_cast<std::size_t>(only)];
        if (along[only] < 0)
            for (double& entry : header.direction[k]) entry = 0 - entry;
    }
    for (std::size_t from = 0; from < 3; ++from)
        for (std::size_t row = 0; row < 3; ++row)
            header.origin[row] +=
                input.direction[from][row] * input.spacing[from] * lies(static_cast<int>(from), 3);
    if (header.anatomical) {
        Mat3 points;
        for (int k = 0; k < 3; ++k)
            points.col(k) = Vec3(header.direction[static_cast<std::size_t>(k)].data());
        header.orientation = letters_of(points);
    }
}

/// The description of an output, without type and channels.
store::Header described(const Request& want, const Geometry& geometry, const Input& input,
                        const Outputs& outputs) {
    store::Header header;
    header.volume = false;
    header.unit = input.header.unit;
    if (want.job->samples) {
        header = input.header;
        header.reader.reset();
        header.warnings.clear();
        header.integers = store::Wide::no;
        header.times = 1;
    }
    header.extent = want.output();
    if (const RadonSetting* radon = want.setting.as<RadonSetting>()) {
        header.volume = want.axes == 3;
        if (!radon->degrees.empty()) header.origin[1] = radon->degrees.front();
        if (radon->to == RadonSetting::To::image)
            header.origin[1] =
                -0.5 * static_cast<double>(header.extent.y - 1) * geometry.grid.spacing[1];
        header.origin[0] =
            -0.5 * static_cast<double>(header.extent.x - 1) * geometry.grid.spacing[0];
    }
    for (int k = 0; k < 3; ++k)
        header.spacing[static_cast<std::size_t>(k)] = geometry.grid.spacing[k];
    if (want.job->samples) take_place(header, input.header, geometry);
    // One plane may become a picture.
    if (header.extent.z == 1 && !outputs.none() && !outputs.format().volumes) header.volume = false;
    return header;
}

/// Where results go: files of their own, or one that shows them one after another.
struct Files {
    const Outputs& outputs;
    int frames;

    /// Why they cannot hold this, or "".
    std::string cannot_hold(const store::Header& header) const {
        const std::string file = outputs.file(0);
        return outputs.animates(frames) ? store::cannot_animate(file, header, outputs.encoder())
                                        : store::cannot_write(file, header);
    }
    /// Whether the header's type and channels fit into the format.
    bool fit(const store::Header& header) const {
        return cannot_hold(header).empty() && (header.values.identity() || outputs.format().values);
    }
};

/// The type that holds values as the file means them, where the format cannot say slope and offset:
/// an integer as wide as needed where all values are whole, else f32.
Type plain_type(const store::Header& header, double low, double high) {
    const ValueMap& map = header.values;
    const bool whole = is_integer(header.type) && map.slope == std::round(map.slope) &&
                       map.offset == std::round(map.offset);
    for (const Type type : {Type::u8, Type::i16, Type::u16, Type::i32}) {
        if (!whole || bytes_of(type) < bytes_of(header.type)) continue;
        const auto [least, most] = limits_of(type);
        if (low >= least && high <= most) return type;
    }
    return Type::f32;
}

/// A composite without a background.
bool keeps_alpha(const Request& want) {
    return want.job->of_rays() && want.mode->over_background && want.keeps_alpha;
}

Tail values_tail(const store::Header& header, const Input& input, const Request& want) {
    Tail tail;
    tail.type = header.type;
    tail.integers = header.integers;
    tail.values = header.values;
    tail.channels = header.channels;
    // Pictures are light, not places.
    if (want.job->samples) tail.table = input.table;
    if (keeps_alpha(want) || (want.job->samples && input.premultiplied())) {
        // What computes light keeps it multiplied; so the format has it, as memory does.
        tail.alpha = header.format == "EXR" ? store::Alpha::premultiplied : store::Alpha::straight;
        tail.alpha_unit = is_integer(header.type) ? input.opaque() : 1;
    }
    return tail;
}

Tail view_tail(Type type, int channels, const Input& input, const Request& want) {
    Tail tail;
    tail.view = true;
    tail.type = type;
    tail.channels = channels;
    // Pictures are light, not places.
    if (want.job->samples) tail.table = input.table;
    // Light that a file keeps multiplied (EXR) is divided as well: pictures of 8 bits are straight.
    const bool light = input.header.alpha == store::Alpha::premultiplied &&
                       !is_integer(input.header.type) && channels == input.header.channels;
    if (keeps_alpha(want) || (want.job->samples && (input.premultiplied() || light)))
        tail.alpha = store::Alpha::straight;
    return tail;
}

/// Endings of formats that hold this, for who asked for another.
std::string instead(store::Header header) {
    header.values = {};
    store::Header as_f32 = header;
    as_f32.type = Type::f32;
    std::vector<std::string> endings;
    for (const store::Format& format : store::formats()) {
        const std::string path = "x" + format.endings[0];
        if (format.writes && (store::cannot_write(path, header).empty() ||
                              store::cannot_write(path, as_f32).empty()))
            endings.push_back(format.endings[0]);
    }
    return endings.empty() ? "" : fmt::format("; {} can", fmt::join(endings, ", "));
}

[[noreturn]] void refuse(const Files& files, const store::Header& header) {
    const Outputs& outputs = files.outputs;
    std::string why = files.cannot_hold(header);
    if (why.empty())
        why = fmt::format("{} cannot say that values are {} x stored + {}", outputs.format().name,
                          header.values.slope, header.values.offset);
    if (header.extent.z > 1 && !outputs.numbered() && files.frames == 1)
        why += "; a number in the name, as s_%03d.png, makes a file of each slice";
    throw RequestError(message("@out({}): {}{}", outputs.file(0), why, instead(header)));
}

/// Whether f32 has fewer digits than values of this type may need.
bool f32_may_round(Type type, double low, double high) {
    constexpr double kWhole = 0x1p24;
    return type == Type::f64 ||
           (bytes_of(type) == 4 && is_integer(type) && (low < -kWhole || high > kWhole));
}

/// What becomes of a derivative of unsigned integers.
std::string sign_text(const Written& written, const Input& input, const Query& query) {
    const std::string why = fmt::format("a derivative is negative as well, which {} is not",
                                        name_of(input.header.type));
    if (!written.tail.view)
        return fmt::format("{}: it is written as {}", why, name_of(written.header.type));
    return fmt::format("{}: {} holds a view of it, {}", why, written.header.format,
                       query.window ? "through the window" : "from its least value to its largest");
}

/// Values of a warp in the input's type, where the format cannot hold that in the smallest type
/// that means the same, or else f32; or nothing where the format holds pictures alone.
bool take_value_type(Written& written, const Input& input, const FilterResult& meant,
                     const Files& files) {
    store::Header& header = written.header;
    header.type = meant.header.type;
    header.values = meant.header.values;
    header.labels = meant.header.labels;
    header.channels = input.channels();
    if (input.selection.bits64) {
        header.integers = input.header.integers;
        if (!files.fit(header)) refuse(files, header);
    }
    if (files.fit(header)) return true;
    header.values = {};
    if (!meant.header.values.identity()) {
        header.type = plain_type(meant.header, meant.low, meant.high);
        if (files.fit(header)) return true;
    }
    header.type = Type::f32;
    if (files.fit(header)) {
        if (f32_may_round(meant.header.type, meant.low, meant.high))
            written.warnings.push_back(
                fmt::format("{} cannot hold {}: values are written as f32, which rounds them",
                            files.outputs.format().name, name_of(meant.header.type)));
        return true;
    }
    header.values = input.header.values;
    header.type = input.header.type;
    return false;
}

/// Colours in place of grey, and whether the format holds the picture.
void take_look(Written& written, const LookSpec& look, const Files& files) {
    if (look.empty()) return;
    store::Header& header = written.header;
    if (header.type != Type::u8 || header.volume || header.extent.z > 1)
        throw RequestError(message(
            "@out({}): {} holds values, and this is a picture for people; .png, .jpg and .tif are",
            files.outputs.file(0), files.outputs.format().name));
    if (!look.colours()) return;
    if (header.channels != 1)
        throw RequestError(message(
            "{}: colours stand for one number, and here are {} channels; @channel N takes one",
            look.colormap.empty() ? setting("legend") : setting("colormap"), header.channels));
    std::string map = look.colormap;
    if (map.empty()) map = look.depth_colour ? "hue" : "grey";
    written.colours = std::make_shared<const Colormap>(colormap_of(map));
    header.channels = 3;
    header.colour = true;
    if (!files.fit(header)) refuse(files, header);
}

/// The unit of a request's results: that of the values, or of their integral along a length.
std::string unit_of_results(const Request& want, const store::Header& header) {
    const std::string& unit = header.value_unit;
    if (unit.empty() || want.job->samples) return unit;
    const ModeTraits& mode = *want.mode;
    if (mode.channels != 1 || mode.light_left) return "";
    if (mode.combine != Combine::sum) return unit;
    return header.unit.empty() ? "" : unit + " " + header.unit;
}

}  // namespace

Array written_samples(const Data& result, const Written& written, const Shades& levels,
                      std::pmr::memory_resource* memory) {
    if (written.colours) return coloured(result, written.tail, levels, *written.colours, memory);
    return finished(result, written.tail, levels, memory);
}

Written written_of(const Request& want, const Query& query, const Geometry& geometry,
                   const Input& input, const Outputs& outputs, double low, double high) {
    Written written;
    written.header = described(want, geometry, input, outputs);
    written.value_unit = unit_of_results(want, input.header);
    written.header.format = outputs.none() ? "" : outputs.format().name;
    store::Header& header = written.header;
    // A photograph of 8 bits that is drawn upon stays as it is.
    const bool is_view = !query.look.empty() &&
                         (!want.job->samples || input.header.type != Type::u8 || query.window ||
                          query.look.colours() || !input.header.values.identity());
    const std::optional<int> bits = is_view ? 8 : query.bits;
    const bool slices = outputs.numbered() || (query.look.montage && !outputs.none());
    if (slices && want.frames == 1 && want.job->samples && header.extent.z > 1) {
        written.slices = std::exchange(header.extent.z, 1);
        header.volume = header.volume && outputs.format().volumes;
    }
    if (!query.look.empty() && header.extent.z == 1) header.volume = false;
    const FilterResult meant = filter_result(want, input.header, low, high);
    written.warnings = meant.notes;
    const bool over_background =
        want.job->of_rays() && want.mode->over_background && !keeps_alpha(want);
    const int channels = over_background      ? 3
                         : keeps_alpha(want)  ? 4
                         : !want.job->samples ? 1
                                              : input.channels();
    const auto finish = [&]() -> Written& {
        written.tail.over_background = over_background;
        written.tail.background = want.background;
        if (want.job->of_rays() && want.mode->over_background)
            written.tail.exposure = query.exposure.value_or(1);
        written.tail.radiograph = is_radiograph(want);
        // What was not multiplied on the way in, or not divided on the way out, is as it was.
        const bool as_it_was = want.job->samples && written.tail.alpha == store::Alpha::none &&
                               header.channels == input.header.channels;
        header.alpha = as_it_was ? input.header.alpha : written.tail.alpha;
        if (meant.keeps_sign && !outputs.none())
            written.warnings.push_back(sign_text(written, input, query));
        return written;
    };
    if (outputs.none()) {
        written.tail.channels = channels;
        return finish();
    }
    const Files files{outputs, query.look.montage ? 1 : want.frames};
    if (!bits && want.job->samples) {
        if (take_value_type(written, input, meant, files)) {
            written.tail = values_tail(header, input, want);
            take_look(written, query.look, files);
            return finish();
        }
        // A view is of pictures; who asks for a format of values must not get 8 bits.
        const std::vector<Type>& types = outputs.format().types;
        if (std::find(types.begin(), types.end(), Type::f32) != types.end()) refuse(files, header);
    }
    header.values = {};
    header.channels = channels;
    if ((!bits && !want.job->samples) || bits == 32) {
        header.type = Type::f32;
        if (files.fit(header)) {
            written.tail = values_tail(header, input, want);
            return finish();
        }
        if (bits) refuse(files, header);
    }
    header.type = bits == 16 ? Type::u16 : Type::u8;
    const bool has_alpha =
        input.header.alpha != store::Alpha::none && channels == input.header.channels;
    if (!files.fit(header) && has_alpha && want.job->samples) {
        written.warnings.push_back(fmt::format("{} keeps no alpha: transparent parts become black",
                                               outputs.format().name));
        header.channels = channels - 1;
    }
    if (!files.fit(header)) refuse(files, header);
    written.tail = view_tail(header.type, header.channels, input, want);
    if (header.channels < channels) written.tail.alpha = store::Alpha::none;
    take_look(written, query.look, files);
    return finish();
}

}  // namespace edgewise
