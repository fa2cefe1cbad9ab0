#include "request/input.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <tbb/parallel_for.h>

#include "graph/errors.hpp"
#include "graph/with_type.hpp"
#include "request/numbers.hpp"
#include "transitions/kernels/kspace.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kLargestSide = 100000;

/// "phantom:NAME:N".
Phantom phantom_of(const std::string& name) {
    const auto words = split(name, ':');
    if (words.size() != 3)
        throw RequestError(fmt::format("{}: expected phantom:NAME:N with a name of {}", name,
                                       fmt::join(phantom_names(), ", ")));
    return phantom_named(words[1], whole_of(name, words[2], 1, kLargestSide));
}

/// "kspace:FILE:WxHxD[:little|big][:offset]" -> samples of twice the width. FILE may hold colons.
std::string pairs_of(const std::string& name) {
    const std::string_view text = std::string_view(name).substr(std::string_view("kspace:").size());
    const auto words = split(text, ':');
    std::size_t at = words.size();
    for (std::size_t i = words.size(); i-- > 1 && at == words.size();) {
        const std::string word(words[i]);
        const bool digits = word.find_first_not_of("0123456789xX") == std::string::npos;
        if (digits && word.find_first_of("xX") != std::string::npos) at = i;
    }
    const auto refuse = [&](const std::string& why) {
        throw RequestError(fmt::format(
            "{}: {}; expected kspace:FILE:WxH[xD][:little|big][:offset], of complex samples of two "
            "f32",
            name, why));
    };
    if (at == words.size()) refuse("no extent");
    const std::string size(words[at]);
    const std::size_t cross = size.find_first_of("xX");
    const std::int64_t width = cross == 0 || cross > 9 ? 0 : std::stoll(size.substr(0, cross));
    if (width < 1) refuse(fmt::format("'{}' is no extent", size));
    std::string pairs = "raw";
    for (std::size_t i = 0; i < at; ++i) pairs += fmt::format(":{}", words[i]);
    pairs += fmt::format(":{}{}:f32", 2 * width, size.substr(cross));
    for (std::size_t i = at + 1; i < words.size(); ++i) pairs += fmt::format(":{}", words[i]);
    return pairs;
}

/// The header of the volume that k-space is of.
store::Header volume_of(const std::string& name, store::Header pairs) {
    pairs.file = name;
    pairs.format = "k-space";
    pairs.extent.x /= 2;
    return pairs;
}

store::Header header_of(const std::string& name, const Phantom& phantom) {
    store::Header header;
    header.file = name;
    header.format = "phantom";
    header.volume = phantom.axes == 3;
    header.extent = {phantom.side, phantom.side, phantom.axes == 3 ? phantom.side : 1};
    header.type = Type::f32;
    return header;
}

template <class T>
void premultiply(const T* in, int channels, std::size_t samples, double opaque, float* out) {
    const int last = channels - 1;
    tbb::parallel_for(std::size_t{0}, (samples + 65535) / 65536, [&](std::size_t block) {
        const std::size_t end = std::min(samples, (block + 1) * 65536);
        for (std::size_t i = block * 65536; i < end; ++i) {
            const T* sample = in + i * static_cast<std::size_t>(channels);
            float* to = out + i * static_cast<std::size_t>(channels);
            const double alpha = static_cast<double>(sample[last]) / opaque;
            for (int c = 0; c < last; ++c)
                to[c] = static_cast<float>(static_cast<double>(sample[c]) * alpha);
            to[last] = static_cast<float>(alpha);
        }
    });
}

std::shared_ptr<const Data> premultiplied_data(const Data& straight, double opaque,
                                               std::pmr::memory_resource* memory) {
    Representation what = straight.what;
    what.type = Type::f32;
    auto data = std::make_shared<Data>(Data::make(what, memory));
    const auto samples = static_cast<std::size_t>(what.samples());
    with_type(straight.what.type, [&](auto zero) {
        premultiply(straight.as<decltype(zero)>(), what.channels, samples, opaque,
                    data->as<float>());
    });
    return data;
}

/// One channel of straight colour, multiplied by its alpha.
template <class T>
void multiply_channel(const T* colour, const T* alpha, std::size_t samples, double opaque,
                      float* out) {
    tbb::parallel_for(std::size_t{0}, (samples + 65535) / 65536, [&](std::size_t block) {
        const std::size_t end = std::min(samples, (block + 1) * 65536);
        for (std::size_t i = block * 65536; i < end; ++i)
            out[i] = static_cast<float>(static_cast<double>(colour[i]) *
                                        static_cast<double>(alpha[i]) / opaque);
    });
}

Type loaded_type(const Input& input) noexcept {
    if (input.by_alpha()) return Type::f32;
    return store::loaded_type(input.header.type, input.selection.as_stored);
}

}  // namespace

bool Input::premultiplied() const noexcept {
    return keep == Keep::values && header.alpha == store::Alpha::straight && channels() > 1;
}

bool Input::by_alpha() const noexcept {
    return selection.by_alpha && selection.channel && header.alpha == store::Alpha::straight;
}

double Input::opaque() const noexcept {
    return is_integer(header.type) ? limits_of(header.type)[1] : 1;
}

double Input::bytes() const {
    if (data && data->samples.data()) return static_cast<double>(data->samples.bytes());
    if (phantom) return static_cast<double>(header.extent.samples()) * sizeof(float);
    // The pairs, as many to work in, and the volume.
    if (pairs) return 2.5 * static_cast<double>(store::loaded_bytes(*pairs, selection));
    const auto stored = static_cast<double>(store::loaded_bytes(header, selection));
    // Colour and alpha as they are stored, and their product.
    if (by_alpha())
        return 2 * stored + static_cast<double>(header.extent.samples()) * sizeof(float);
    if (!premultiplied()) return stored;
    return stored / static_cast<double>(bytes_of(loaded_type(*this))) * sizeof(float);
}

Segments::Segments(const Input& input) : table_(input.table.get()) {
    for (const store::Segment& segment : input.header.segments)
        if (!segment.channel || segment.channel == input.selection.channel)
            by_label_.emplace(segment.label, &segment);
}

const store::Segment* Segments::of(double value) const {
    if (by_label_.empty()) return nullptr;
    std::optional<std::int64_t> label;
    if (table_)
        label = table_->integer(static_cast<std::size_t>(value));
    else if (value == std::floor(value) && std::abs(value) < 0x1p63)
        label = static_cast<std::int64_t>(value);
    const auto found = label ? by_label_.find(*label) : by_label_.end();
    return found == by_label_.end() ? nullptr : found->second;
}

Input inspected(const std::string& name, const store::Selection& selection) {
    const bool file = !name.starts_with("phantom:") && !name.starts_with("describe:");
    if (!file && (!selection.spacing.empty() || !selection.unit.empty()))
        throw RequestError(
            message("{}: @input_spacing and @input_unit are about files{}", name,
                    name.starts_with("describe:") ? "; here spacing=X,Y,Z says it" : ""));
    if (!file && selection.level) throw RequestError(message("{}: @level is about files", name));
    Input input;
    input.inspected_at = std::chrono::system_clock::now();
    input.name = name;
    input.selection = selection;
    if (name.starts_with("phantom:")) {
        input.phantom = phantom_of(name);
        input.header = header_of(name, *input.phantom);
    } else if (name.starts_with("describe:")) {
        input.described = described_by(name);
        input.header = header_of(name, *input.described);
    } else if (name.starts_with("kspace:")) {
        input.pairs = store::inspect(pairs_of(name), selection);
        input.header = volume_of(name, *input.pairs);
    } else {
        input.header = store::inspect(name, selection);
        take_keep(input, Keep::values);
    }
    const int channels = input.header.channels;
    if (selection.channel && *selection.channel >= channels)
        throw RequestError(message("@channel({}): {} has {} channel{}, counted from 0",
                                   *selection.channel, name, channels, channels > 1 ? "s" : ""));
    return input;
}

namespace {

/// @throws RequestError what is no image and no volume, or not all of it
void expect_samples(const Data& data) {
    const Representation& what = data.what;
    const Extent& n = what.extent;
    const auto refuse = [](const std::string& why) {
        throw RequestError("samples in memory: " + why);
    };
    if ((what.axes != 2 && what.axes != 3) || std::min({n.x, n.y, n.z}) < 1 ||
        (what.axes == 2 && n.z != 1))
        refuse(fmt::format("{} axes and an extent of {}x{}x{} are neither an image nor a volume",
                           what.axes, n.x, n.y, n.z));
    if (what.channels < 1) refuse(fmt::format("{} channels", what.channels));
    if (!data.box.empty() && data.held().extent() != n) refuse("a part of the whole");
    if (!data.samples.data() || double(data.samples.bytes()) < what.bytes())
        refuse(fmt::format("{:.0f} bytes are described, {} are there", what.bytes(),
                           data.samples.data() ? data.samples.bytes() : 0));
}

}  // namespace

Input given_input(const Data& data, const store::Selection& selection) {
    expect_samples(data);
    if (selection.series || selection.time || selection.channel || selection.level ||
        !selection.orient.empty())
        throw RequestError(message(
            "samples in memory: @series, @time, @channel, @level and @orient are about files"));
    const Representation& what = data.what;
    const auto axes = static_cast<std::size_t>(what.axes);
    Input input;
    input.name = "samples in memory";
    input.selection = selection;
    store::Header& header = input.header;
    header.file = input.name;
    header.format = "memory";
    header.volume = what.axes == 3;
    header.extent = what.extent;
    header.type = what.type;
    header.values = what.values;
    header.channels = what.channels;
    const std::vector<double>& spacing = selection.spacing;
    if (!spacing.empty() && spacing.size() != 1 && spacing.size() != axes)
        throw RequestError(
            message("@input_spacing: {} numbers given; expected 1 or {}", spacing.size(), axes));
    for (std::size_t k = 0; k < axes && !spacing.empty(); ++k)
        header.spacing[k] = spacing[spacing.size() == 1 ? 0 : k];
    if (!selection.unit.empty()) header.unit = selection.unit;
    return input;
}

void expect_given(const Data& data, const Input& input) {
    expect_samples(data);
    const Representation &is = data.what, named = described_data(input)->what;
    if (input.described || is.axes != named.axes || is.extent != named.extent ||
        is.channels != named.channels)
        throw RequestError(fmt::format(
            "{}: the samples in memory are {}x{}x{} in {} channels, and not what it describes",
            input.name, is.extent.x, is.extent.y, is.extent.z, is.channels));
}

namespace {

Representation loaded_as(const Input& input) {
    const store::Header& header = input.header;
    Representation what;
    what.axes = header.volume ? 3 : 2;
    what.extent = header.extent;
    what.channels = input.channels();
    what.type = loaded_type(input);
    what.values = header.values;
    return what;
}

/// Brings what was read as it is stored to f32, which kernels are written for, where that keeps
/// what has to be kept.
void narrow(Input& input, Data& data, std::pmr::memory_resource* memory,
            std::vector<Message>& warnings) {
    const Type type = data.what.type;
    if (input.keep == Keep::bits || !input.selection.as_stored || bytes_of(type) < 4) return;
    if (type == Type::f32) return;
    if (input.selection.bits64) {
        input.table = code_labels(data, input.outside, memory, input.header.integers);
        return;
    }
    const std::int64_t rounded = rounded_by_f32(data);
    if (rounded == 0) return to_f32(data, memory);
    if (input.keep == Keep::labels) {
        input.table = code_labels(data, input.outside, memory);
        return;
    }
    warnings.push_back(
        fmt::format("{}: {} values of type {} are rounded where they are computed "
                    "in f32",
                    input.name, rounded, name_of(type)));
}

}  // namespace

Representation stored_as(const Input& input) {
    Representation what = loaded_as(input);
    what.type = store::loaded_type(input.header.type, true);
    return what;
}

void take_keep(Input& input, Keep keep) {
    input.keep = keep;
    // 32-bit integers take no more memory as they are; f64 does.
    input.selection.as_stored = keep != Keep::values || input.header.type != Type::f64;
    input.selection.bits64 = keep == Keep::labels && input.header.integers != store::Wide::no &&
                             input.header.values.identity();
}

std::shared_ptr<const Data> described_data(const Input& input) {
    auto data = std::make_shared<Data>();
    data->what = loaded_as(input);
    return data;
}

namespace {

/// The magnitudes of the volume whose spectrum was measured.
std::shared_ptr<const Data> volume_of_kspace(const Input& input, std::pmr::memory_resource* memory,
                                             std::vector<Message>& warnings) {
    const store::Header& pairs = *input.pairs;
    store::loaded_bytes(pairs, input.selection);
    Representation what = loaded_as(input);
    what.extent = pairs.extent;
    Data read = Data::make(what, memory);
    for (Message& warning :
         store::read_samples(pairs, input.selection, read.samples.data(), read.samples.bytes()))
        warnings.push_back(std::move(warning));
    const float* numbers = read.as<float>();
    for (std::int64_t i = 0; i < what.samples(); ++i)
        if (!std::isfinite(numbers[i]))
            throw InputError(
                fmt::format("{}: sample {} is not finite, a transform would spread it "
                            "everywhere",
                            input.name, i / 2));
    auto data = std::make_shared<Data>(Data::make(loaded_as(input), memory));
    kernels::volume_of_kspace(reinterpret_cast<const kernels::Complex*>(numbers), data->what.extent,
                              true, data->as<float>(), memory, {});
    return data;
}

/// @throws InputError, RequestError, std::bad_alloc
std::shared_ptr<const Data> channel_by_alpha(const Input& input, std::pmr::memory_resource* memory,
                                             std::vector<Message>& warnings) {
    store::Selection pick = input.selection;
    Representation what = loaded_as(input);
    what.type = store::loaded_type(input.header.type, pick.as_stored);
    std::array<Data, 2> read;
    for (Data& channel : read) {
        channel = Data::make(what, memory);
        for (Message& warning : store::read_samples(input.header, pick, channel.samples.data(),
                                                    channel.samples.bytes()))
            warnings.push_back(std::move(warning));
        pick.channel = input.header.channels - 1;
    }
    auto data = std::make_shared<Data>(Data::make(loaded_as(input), memory));
    with_type(what.type, [&](auto zero) {
        using T = decltype(zero);
        multiply_channel(read[0].as<T>(), read[1].as<T>(), static_cast<std::size_t>(what.samples()),
                         input.opaque(), data->as<float>());
    });
    return data;
}

/// Whether labels that were read as bits must stay so, since no type of 32 bits holds them all;
/// else they become doubles.
bool keeps_bits(Input& input, Data& data) {
    if (!input.selection.bits64) return false;
    const bool with_sign = input.header.integers == store::Wide::with_sign;
    const std::size_t count = data.samples.bytes() / sizeof(std::uint64_t);
    auto* bits = static_cast<std::uint64_t*>(data.samples.data());
    const auto is_small = [&](std::uint64_t number) {
        const auto value = static_cast<std::int64_t>(number);
        constexpr std::int64_t kLeast = -(std::int64_t{1} << 31),
                               kMost = (std::int64_t{1} << 32) - 1;
        return value <= kMost && value >= (with_sign ? kLeast : 0);
    };
    if (!std::all_of(bits, bits + count, is_small)) return true;
    input.selection.bits64 = false;
    for (std::size_t i = 0; i < count; ++i) {
        const auto value = static_cast<double>(static_cast<std::int64_t>(bits[i]));
        std::memcpy(bits + i, &value, sizeof value);
    }
    return false;
}

}  // namespace

std::vector<Message> read_data(Input& input, std::pmr::memory_resource* memory) {
    const auto identity = identity_of(input);
    const auto begin = std::chrono::steady_clock::now();
    std::vector<Message> warnings = input.header.warnings;
    Type type = input.header.type;
    if (input.phantom) {
        input.data =
            std::make_shared<Data>(make_phantom(input.phantom->name, input.phantom->side, memory));
    } else if (input.pairs) {
        input.data = volume_of_kspace(input, memory, warnings);
    } else {
        const store::Header& header = input.header;
        // Beyond the selection's limit: told with its size, before anything is allocated.
        store::loaded_bytes(header, input.selection);
        if (input.by_alpha()) {
            input.data = channel_by_alpha(input, memory, warnings);
        } else {
            auto data = std::make_shared<Data>(Data::make(loaded_as(input), memory));
            for (Message& warning : store::read_samples(
                     header, input.selection, data->samples.data(), data->samples.bytes()))
                warnings.push_back(std::move(warning));
            if (header.integers != store::Wide::no && !keeps_bits(input, *data))
                type = store::narrow_wide(header, data->what.type, data->samples, memory, warnings);
            narrow(input, *data, memory, warnings);
            input.data = std::move(data);
            if (input.premultiplied())
                input.data = premultiplied_data(*input.data, input.opaque(), memory);
        }
    }
    input.read_seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    input.identity.reset();
    if (identity && identity_of(input) == identity) input.identity = identity;
    input.header.type = type;
    if (!input.selection.bits64) input.header.integers = store::Wide::no;
    return warnings;
}

InputGrid grid_of(const Input& input) {
    const store::Header& header = input.header;
    InputGrid grid;
    grid.axes = header.volume ? 3 : 2;
    grid.extent = header.extent;
    grid.spacing = Vec3(header.spacing.data());
    grid.anatomical = header.anatomical;
    if (grid.axes == 2) grid.spacing.z() = 1;
    Mat3 points;
    for (int k = 0; k < 3; ++k)
        points.col(k) = Vec3(header.direction[static_cast<std::size_t>(k)].data());
    take_axes(grid, points);
    // What does not say how it lies in the body is taken as LPS.
    if (!header.anatomical) grid.direction.setIdentity();
    return grid;
}

}  // namespace edgewise
