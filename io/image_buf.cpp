// Without our fmt: OpenImageIO brings one of its own.
#include "io/image_buf.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory_resource>
#include <string>
#include <utility>

#include "graph/errors.hpp"

namespace edgewise::store {
namespace {

constexpr int kMostChannels = 4;

[[noreturn]] void refuse(const std::string& why) {
    throw InputError("the image cannot be shared: " + why);
}

struct Pair {
    Type type;
    OIIO::TypeDesc::BASETYPE base;
    bool computed;  // kernels take it as it is
};
constexpr Pair kTypes[] = {
    {Type::u8, OIIO::TypeDesc::UINT8, true},    {Type::i8, OIIO::TypeDesc::INT8, true},
    {Type::u16, OIIO::TypeDesc::UINT16, true},  {Type::i16, OIIO::TypeDesc::INT16, true},
    {Type::u32, OIIO::TypeDesc::UINT32, false}, {Type::i32, OIIO::TypeDesc::INT32, false},
    {Type::f16, OIIO::TypeDesc::HALF, false},   {Type::f32, OIIO::TypeDesc::FLOAT, true},
    {Type::f64, OIIO::TypeDesc::DOUBLE, false},
};

Type type_of(const OIIO::ImageSpec& spec) {
    for (const OIIO::TypeDesc& format : spec.channelformats)
        if (format != spec.format) refuse("its channels have types of their own");
    for (const Pair& pair : kTypes)
        if (pair.computed && spec.format == OIIO::TypeDesc(pair.base)) return pair.type;
    refuse(std::string("its samples are ") + spec.format.c_str() +
           "; uint8, int8, uint16, int16 and float can be");
}

OIIO::TypeDesc description_of(Type type) {
    for (const Pair& pair : kTypes)
        if (pair.type == type) return pair.base;
    refuse("OpenImageIO has no type for " + std::string(name_of(type)));
}

void check_shape(const OIIO::ImageBuf& image) {
    if (image.deep()) refuse("it is deep");
    const OIIO::ImageSpec& spec = image.spec();
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) refuse("it has no pixels");
    if (spec.nchannels > kMostChannels)
        refuse("it has " + std::to_string(spec.nchannels) + " channels, and " +
               std::to_string(kMostChannels) + " at most can be");
}

/// ImageBuf::contiguous is false of all buffers that wrap memory (2.4.7).
bool is_contiguous(const OIIO::ImageBuf& image) {
    const OIIO::ImageSpec& spec = image.spec();
    const auto pixel = static_cast<OIIO::stride_t>(spec.pixel_bytes());
    const OIIO::stride_t row = pixel * spec.width, plane = row * spec.height;
    return image.pixel_stride() == pixel && (spec.height < 2 || image.scanline_stride() == row) &&
           (spec.depth < 2 || image.z_stride() == plane);
}

const void* pixels_of(const OIIO::ImageBuf& image) {
    const void* const pixels = image.localpixels();
    if (image.has_error()) refuse(image.geterror());
    if (!pixels) refuse("its pixels are in a cache; read it with force = true");
    return pixels;
}

/// Pixels that do not lie side by side, row by row, or not at addresses of their type.
Array copied(const OIIO::ImageBuf& image, const Representation& what) {
    Array copy(static_cast<std::size_t>(what.bytes()), std::pmr::new_delete_resource());
    const auto pixel = static_cast<std::size_t>(image.spec().pixel_bytes());
    const auto* const from = static_cast<const char*>(image.localpixels());
    auto* to = static_cast<char*>(copy.data());
    for (std::int64_t z = 0; z < what.extent.z; ++z)
        for (std::int64_t y = 0; y < what.extent.y; ++y)
            for (std::int64_t x = 0; x < what.extent.x; ++x, to += pixel)
                std::memcpy(to,
                            from + x * image.pixel_stride() + y * image.scanline_stride() +
                                z * image.z_stride(),
                            pixel);
    return copy;
}

/// A buffer and what it wraps: they live and go together.
struct Wrapped {
    std::shared_ptr<const Data> data;
    OIIO::ImageBuf image;
};

OIIO::ImageSpec spec_of(const Data& data) {
    const Representation& what = data.what;
    if (what.layout != Layout::linear || what.place != Place::memory || !data.samples.data())
        refuse("its samples do not lie row by row in memory");
    const Region box = data.held();
    const Extent n = box.extent();
    OIIO::ImageSpec spec(static_cast<int>(n.x), static_cast<int>(n.y), what.channels,
                         description_of(what.type));
    spec.x = static_cast<int>(box.begin[0]);
    spec.y = static_cast<int>(box.begin[1]);
    spec.z = static_cast<int>(box.begin[2]);
    spec.depth = static_cast<int>(n.z);
    spec.full_width = static_cast<int>(what.extent.x);
    spec.full_height = static_cast<int>(what.extent.y);
    spec.full_depth = static_cast<int>(what.extent.z);
    return spec;
}

std::shared_ptr<OIIO::ImageBuf> wrapped(std::shared_ptr<const Data> data, void* samples) {
    const OIIO::ImageSpec spec = spec_of(*data);
    auto both = std::make_shared<Wrapped>(Wrapped{std::move(data), OIIO::ImageBuf(spec, samples)});
    OIIO::ImageBuf* const image = &both->image;
    return {std::move(both), image};
}

}  // namespace

std::shared_ptr<const Data> data_of(std::shared_ptr<const OIIO::ImageBuf> image) {
    if (!image) refuse("there is none");
    check_shape(*image);
    const void* const pixels = pixels_of(*image);
    const OIIO::ImageSpec& spec = image->spec();
    auto data = std::make_shared<Data>();
    Representation& what = data->what;
    what.type = type_of(spec);
    what.extent = {spec.width, spec.height, std::max(spec.depth, 1)};
    what.axes = what.extent.z > 1 ? 3 : 2;
    what.channels = spec.nchannels;
    const bool aligned = reinterpret_cast<std::uintptr_t>(pixels) % bytes_of(what.type) == 0;
    if (!is_contiguous(*image) || !aligned) {
        data->samples = copied(*image, what);
        return data;
    }
    const auto bytes = static_cast<std::size_t>(what.bytes());
    // Nobody writes samples that are const.
    data->samples = Array::around(const_cast<void*>(pixels), bytes, std::move(image));
    return data;
}

std::shared_ptr<const OIIO::ImageBuf> image_buf_of(std::shared_ptr<const Data> data) {
    void* const samples = const_cast<void*>(data->samples.data());
    return wrapped(std::move(data), samples);
}

std::shared_ptr<OIIO::ImageBuf> image_buf_of(std::shared_ptr<Data> data) {
    void* const samples = data->samples.data();
    return wrapped(std::move(data), samples);
}

}  // namespace edgewise::store
