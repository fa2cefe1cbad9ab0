#include "cli/session/written.hpp"

#include <cmath>
#include <fmt/format.h>

#include "graph/errors.hpp"

namespace edgewise::cli {
namespace {

/// The description of an output, without type and channels.
store::Header described(const Request& want, const Geometry& geometry, const Input& input) {
    store::Header header = input.header;
    header.reader.reset();
    header.warnings.clear();
    header.times = 1;
    header.extent = want.output();
    const ScreenGrid& grid = geometry.grid;
    if (want.job == Job::render) {
        header = {};
        header.volume = false;
        header.unit = input.header.unit;
        header.extent = want.output();
    }
    for (int k = 0; k < 3; ++k) header.spacing[static_cast<std::size_t>(k)] = grid.spacing[k];
    if (want.job == Job::render) return header;
    // The grid keeps its directions; its first sample moves so that its centre stays, since the
    // geometry holds about the centre.
    for (int k = 0; k < want.axes; ++k) {
        const auto at = static_cast<std::size_t>(k);
        const double moved = grid.centre[k] +
                             (double(input.header.extent[k]) - 1) / 2 * input.header.spacing[at] -
                             (double(grid.extent[k]) - 1) / 2 * grid.spacing[k];
        for (std::size_t row = 0; row < 3; ++row)
            header.origin[row] += moved * input.header.direction[at][row];
    }
    return header;
}

/// Whether the header's type and channels fit into the format.
bool fits(const Outputs& outputs, const store::Header& header) {
    return store::cannot_write(outputs.file(0), header).empty() &&
           (header.values.identity() || outputs.format().values);
}

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

Tail values_tail(const store::Header& header, const Input& input) {
    Tail tail;
    tail.type = header.type;
    tail.values = header.values;
    tail.channels = header.channels;
    if (input.premultiplied()) {
        tail.alpha = store::Alpha::straight;
        tail.alpha_unit = input.opaque();
    }
    return tail;
}

Tail view_tail(Type type, int channels, const Input& input, Job job) {
    Tail tail;
    tail.view = true;
    tail.type = type;
    tail.channels = channels;
    if (job == Job::warp && input.premultiplied()) tail.alpha = store::Alpha::straight;
    return tail;
}

[[noreturn]] void refuse(const Outputs& outputs, const std::string& why) {
    throw RequestError(fmt::format("-o {}: {}", outputs.file(0), why));
}

/// Values of a warp in the input's type, or nothing where the format cannot hold it.
bool take_input_type(Written& written, const Input& input, const Outputs& outputs, double low,
                     double high) {
    store::Header& header = written.header;
    header.type = input.header.type;
    header.channels = input.channels();
    if (fits(outputs, header)) return true;
    if (!header.values.identity()) {
        header.type = plain_type(header, low, high);
        header.values = {};
        if (fits(outputs, header)) return true;
        header.values = input.header.values;
        header.type = input.header.type;
    }
    return false;
}

}  // namespace

Written written_of(const Wish& wish, const Geometry& geometry, const Input& input,
                   const Outputs& outputs, double low, double high) {
    const Request& want = wish.want;
    Written written;
    written.header = described(want, geometry, input);
    store::Header& header = written.header;
    const bool composite = want.job == Job::render && want.mode == Mode::composite;
    const int channels = composite ? 3 : want.job == Job::render ? 1 : input.channels();
    const auto finish = [&]() -> Written& {
        written.tail.over_background = composite;
        written.tail.background = want.background;
        header.alpha = written.tail.alpha;
        return written;
    };
    if (outputs.none()) {
        written.tail.channels = channels;
        return finish();
    }
    if (!wish.bits && want.job == Job::warp &&
        take_input_type(written, input, outputs, low, high)) {
        written.tail = values_tail(header, input);
        return finish();
    }
    header.values = {};
    header.channels = channels;
    if ((!wish.bits && want.job == Job::render) || wish.bits == 32) {
        header.type = Type::f32;
        if (fits(outputs, header)) {
            written.tail = values_tail(header, input);
            written.tail.alpha_unit = 1;
            return finish();
        }
        if (wish.bits) refuse(outputs, store::cannot_write(outputs.file(0), header));
    }
    header.type = wish.bits == 16 ? Type::u16 : Type::u8;
    if (!fits(outputs, header) && input.premultiplied() && want.job == Job::warp) {
        written.warnings.push_back(fmt::format("{} keeps no alpha: transparent parts become black",
                                               outputs.format().name));
        header.channels = channels - 1;
    }
    if (!fits(outputs, header)) refuse(outputs, store::cannot_write(outputs.file(0), header));
    written.tail = view_tail(header.type, header.channels, input, want.job);
    if (header.channels < channels) written.tail.alpha = store::Alpha::none;
    return finish();
}

}  // namespace edgewise::cli
