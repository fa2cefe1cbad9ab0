#include "edgewise/volume.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "graph/errors.hpp"
#include "io/channel_colours.hpp"
#include "request/errors.hpp"
#include "request/input.hpp"
#include "runtime/memory_budget.hpp"

namespace edgewise {
namespace {

/// @throws RequestError
void expect_grid(const Grid& grid) {
    constexpr double kLeast = 1e-9, kMost = 1e9, kOff = 1e-3;
    for (const double spacing : grid.spacing)
        if (!(spacing >= kLeast && spacing <= kMost))
            throw RequestError(message("spacing: {} given; expected from 1e-9 to 1e9", spacing));
    for (const double origin : grid.origin)
        if (!std::isfinite(origin)) throw RequestError("origin: a number is not finite");
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            double product = 0;
            for (std::size_t k = 0; k < 3; ++k)
                product += grid.direction[i][k] * grid.direction[j][k];
            if (!(std::abs(product - (i == j ? 1 : 0)) <= kOff))
                throw RequestError(
                    "direction: its columns are not perpendicular to each other and of length 1");
        }
}

}  // namespace

const store::Header& Volume::header() const noexcept { return input_->header; }

Volume Volume::read(const std::string& source, const store::Selection& selection) {
    Volume volume;
    volume.input_ = std::make_shared<const Input>(inspected(source, selection));
    return volume;
}

Volume Volume::around(const void* first, const Extent& extent, int axes, int channels, Type type,
                      std::shared_ptr<const void> owner, const Grid& grid) {
    auto data = std::make_shared<Data>();
    data->what.axes = axes;
    data->what.extent = extent;
    data->what.channels = channels;
    data->what.type = type;
    // Nobody writes into the samples of an input.
    data->samples = Array::around(const_cast<void*>(first),
                                  static_cast<std::size_t>(data->what.bytes()), std::move(owner));
    expect_grid(grid);
    Input input = given_input(*data, {});
    store::Header& header = input.header;
    for (std::size_t k = 0; k < 3; ++k) {
        header.spacing[k] = grid.spacing[k];
        header.origin[k] = grid.origin[k];
        for (std::size_t row = 0; row < 3; ++row) header.direction[k][row] = grid.direction[k][row];
    }
    header.unit = grid.unit;
    header.anatomical = grid.anatomical;
    Volume volume;
    volume.input_ = std::make_shared<const Input>(std::move(input));
    volume.data_ = std::move(data);
    return volume;
}

Volume Volume::copied(const void* first, const std::array<std::ptrdiff_t, 3>& strides,
                      const Extent& extent, int axes, int channels, Type type, const Grid& grid) {
    const std::size_t sample = bytes_of(type) * static_cast<std::size_t>(std::max(channels, 1));
    Representation what;
    what.extent = extent;
    // What is no extent is refused as that of other samples is.
    if (extent.x < 1 || extent.y < 1 || extent.z < 1)
        return around(first, extent, axes, channels, type, nullptr, grid);
    const auto copy =
        std::make_shared<std::vector<std::byte>>(sample * static_cast<std::size_t>(what.samples()));
    std::byte* to = copy->data();
    const auto* const from = static_cast<const std::byte*>(first);
    for (std::int64_t z = 0; z < extent.z; ++z)
        for (std::int64_t y = 0; y < extent.y; ++y)
            for (std::int64_t x = 0; x < extent.x; ++x, to += sample)
                std::memcpy(to, from + x * strides[0] + y * strides[1] + z * strides[2], sample);
    return around(copy->data(), extent, axes, channels, type, copy, grid);
}

Volume Volume::channel(int number) const {
    const int channels = data_ ? data_->what.channels : header().channels;
    if (number < 0 || number >= channels)
        throw OutOfLimits(message("@channel({}): {} channel{} in {}, counted from 0", number,
                                  channels, channels > 1 ? "s" : "", input_->name),
                          Limits::between(0, channels - 1));
    if (!data_) {
        store::Selection selection = input_->selection;
        selection.channel = number;
        return read(input_->name, selection);
    }
    if (channels == 1) return *this;
    const Representation& what = data_->what;
    const auto each = static_cast<std::ptrdiff_t>(bytes_of(what.type)), sample = each * channels,
               row = sample * what.extent.x;
    Volume one = copied(static_cast<const std::byte*>(data_->samples.data()) + each * number,
                        {sample, row, row * what.extent.y}, what.extent, what.axes, 1, what.type);
    Input input = *one.input_;
    input.header.spacing = header().spacing;
    input.header.origin = header().origin;
    input.header.direction = header().direction;
    input.header.unit = header().unit;
    input.header.anatomical = header().anatomical;
    one.input_ = std::make_shared<const Input>(std::move(input));
    return one;
}

Volume Volume::channel(const std::string& name) const {
    if (data_)
        throw RequestError(
            message("@channel({}): samples in memory have no names; expected a "
                    "number, from 0",
                    name));
    return channel(store::channel_named(name, input_->name, input_->selection));
}

Volume Volume::loaded() const {
    if (data_ || loaded_) return *this;
    // The samples keep what counts them.
    struct Held {
        MemoryBudget memory{std::numeric_limits<std::size_t>::max() / 2};
        std::shared_ptr<const Data> data;
    };
    const auto held = std::make_shared<Held>();
    Input input = *input_;
    read_data(input, &held->memory);
    held->data = std::move(input.data);
    input.data = {held, held->data.get()};
    if (!input.identity) input.identity = identity_of_samples(input);
    Volume volume = *this;
    volume.loaded_ = std::make_shared<const Input>(std::move(input));
    return volume;
}

std::shared_ptr<const Data> Volume::samples() const {
    return data_ ? data_ : loaded().loaded_->data;
}

}  // namespace edgewise
