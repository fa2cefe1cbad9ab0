#include "io/zarr_codecs.hpp"

#include <algorithm>
#include <blosc.h>
#include <bzlib.h>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <lzma.h>
#include <span>
#include <utility>
#include <zlib.h>
#include <zstd.h>

#include "io/lz4.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

using Json = nlohmann::json;
using CodecKind = ZarrCodec::Kind;
using Packed = std::span<const std::byte>;

/// Blosc and zstd pack zeros a million times denser than this; noise and pictures never.
constexpr std::int64_t kDensestChunk = 1 << 16;
constexpr std::size_t kChecksum = 4;

struct CodecName {
    const char* name;
    CodecKind kind;
};
constexpr CodecName kCodecNames[] = {
    {"blosc", CodecKind::blosc},   {"zstd", CodecKind::zstd},       {"zlib", CodecKind::zlib},
    {"gzip", CodecKind::gzip},     {"bz2", CodecKind::bz2},         {"lzma", CodecKind::lzma},
    {"lz4", CodecKind::lz4},       {"shuffle", CodecKind::shuffle}, {"crc32", CodecKind::crc32},
    {"crc32c", CodecKind::crc32c}, {"adler32", CodecKind::adler32}};

const char* name_of(CodecKind kind) {
    for (const CodecName& known : kCodecNames)
        if (known.kind == kind) return known.name;
    return "";
}

/// One codec, taken off.
class Unpacking {
 public:
    Unpacking(const std::string& name, const ZarrCodec& codec, Packed packed)
        : name_(name), codec_(codec), packed_(packed) {}

    /// @param bytes  that come out
    Bytes exactly(std::size_t bytes) {
        check_density(name_, static_cast<std::int64_t>(bytes), packed_.size(), kDensestChunk);
        Bytes out(bytes);
        const std::size_t got = into(out);
        if (got != bytes) other_size(got, bytes);
        return out;
    }
    /// Where only the codec itself knows how many bytes come out.
    Bytes at_most(std::size_t bytes) {
        check_density(name_, static_cast<std::int64_t>(bytes), packed_.size(), kDensestChunk);
        Bytes out(bytes);
        out.resize(into(out));
        return out;
    }

 private:
    [[noreturn]] void damaged(const std::string& why = "") const {
        refuse(name_, fmt::format("the {} data are damaged{}{}", name_of(codec_.kind),
                                  why.empty() ? "" : ": ", why));
    }
    [[noreturn]] void other_size(std::uint64_t got, std::size_t expected) const {
        refuse(name_, fmt::format("holds {} bytes, expected {}", got, expected));
    }

    /// @return bytes that were written
    std::size_t into(std::span<std::byte> out) {
        switch (codec_.kind) {
            case CodecKind::blosc:
                return by_blosc(out);
            case CodecKind::zstd:
                return by_zstd(out);
            case CodecKind::zlib:
            case CodecKind::gzip:
                return by_zlib(out);
            case CodecKind::bz2:
                return by_bzip2(out);
            case CodecKind::lzma:
                return by_lzma(out);
            case CodecKind::lz4:
                return by_lz4(out);
            case CodecKind::shuffle:
                return by_shuffle(out);
            case CodecKind::crc32:
            case CodecKind::crc32c:
            case CodecKind::adler32:
                return by_checksum(out);
        }
        return 0;
    }

    std::size_t by_blosc(std::span<std::byte> out) {
        std::size_t size = 0;
        if (packed_.size() < BLOSC_MIN_HEADER_LENGTH ||
            blosc_cbuffer_validate(packed_.data(), packed_.size(), &size) < 0)
            damaged();
        if (size > out.size()) other_size(size, out.size());
        const int got = blosc_decompress_ctx(packed_.data(), out.data(), out.size(), 1);
        if (got < 0 || static_cast<std::size_t>(got) != size) damaged();
        return size;
    }
    std::size_t by_zstd(std::span<std::byte> out) {
        const std::size_t got =
            ZSTD_decompress(out.data(), out.size(), packed_.data(), packed_.size());
        if (ZSTD_isError(got)) damaged(ZSTD_getErrorName(got));
        return got;
    }
    /// What follows the last byte that is wanted is passed over.
    std::size_t by_zlib(std::span<std::byte> out) {
        z_stream stream{};
        const int wrapped = codec_.kind == CodecKind::gzip ? 16 : 0;
        if (inflateInit2(&stream, 15 + wrapped) != Z_OK) damaged();
        stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(packed_.data()));
        stream.avail_in = static_cast<uInt>(packed_.size());
        stream.next_out = reinterpret_cast<Bytef*>(out.data());
        stream.avail_out = static_cast<uInt>(out.size());
        int state = Z_OK;
        // A file of gzip may hold several streams.
        while ((state = inflate(&stream, Z_FINISH)) == Z_STREAM_END && wrapped != 0 &&
               stream.avail_in > 0 && stream.avail_out > 0)
            inflateReset(&stream);
        const std::size_t left = stream.avail_out;
        const bool full = left == 0 && stream.avail_in > 0 && state != Z_STREAM_END;
        inflateEnd(&stream);
        if (full) refuse(name_, fmt::format("holds more than the expected {} bytes", out.size()));
        if (state != Z_STREAM_END) damaged();
        return out.size() - left;
    }
    std::size_t by_bzip2(std::span<std::byte> out) {
        auto size = static_cast<unsigned>(out.size());
        const int state = BZ2_bzBuffToBuffDecompress(
            reinterpret_cast<char*>(out.data()), &size,
            const_cast<char*>(reinterpret_cast<const char*>(packed_.data())),
            static_cast<unsigned>(packed_.size()), 0, 0);
        if (state == BZ_OUTBUFF_FULL)
            refuse(name_, fmt::format("holds more than the expected {} bytes", out.size()));
        if (state != BZ_OK) damaged();
        return size;
    }
    std::size_t by_lzma(std::span<std::byte> out) {
        lzma_stream stream = LZMA_STREAM_INIT;
        constexpr std::uint64_t kMostMemory = 256 << 20;
        if (lzma_auto_decoder(&stream, kMostMemory, LZMA_CONCATENATED) != LZMA_OK) damaged();
        stream.next_in = reinterpret_cast<const std::uint8_t*>(packed_.data());
        stream.avail_in = packed_.size();
        stream.next_out = reinterpret_cast<std::uint8_t*>(out.data());
        stream.avail_out = out.size();
        const lzma_ret state = lzma_code(&stream, LZMA_FINISH);
        const std::size_t left = stream.avail_out;
        lzma_end(&stream);
        if (state != LZMA_STREAM_END && left == 0)
            refuse(name_, fmt::format("holds more than the expected {} bytes", out.size()));
        if (state != LZMA_STREAM_END) damaged();
        return out.size() - left;
    }
    /// numcodecs: the size in four bytes, then one block.
    std::size_t by_lz4(std::span<std::byte> out) {
        if (packed_.size() < kChecksum) damaged();
        const std::uint32_t size = word(packed_);
        if (size > out.size()) other_size(size, out.size());
        if (!unpack_lz4(packed_.subspan(kChecksum), out.first(size))) damaged();
        return size;
    }
    /// All first bytes of the numbers, then all second ones.
    std::size_t by_shuffle(std::span<std::byte> out) {
        const std::size_t width = codec_.element, count = packed_.size() / width;
        if (packed_.size() > out.size()) other_size(packed_.size(), out.size());
        if (packed_.size() % width != 0) damaged();
        for (std::size_t byte = 0; byte < width; ++byte)
            for (std::size_t i = 0; i < count; ++i)
                out[i * width + byte] = packed_[byte * count + i];
        return packed_.size();
    }
    std::size_t by_checksum(std::span<std::byte> out) {
        if (packed_.size() < kChecksum) damaged();
        const std::size_t size = packed_.size() - kChecksum;
        if (size > out.size()) other_size(size, out.size());
        const Packed data = packed_.subspan(codec_.sum_first ? kChecksum : 0, size);
        if (checksum(data) != word(packed_.subspan(codec_.sum_first ? 0 : size)))
            refuse(name_, "its checksum is wrong");
        std::copy(data.begin(), data.end(), out.begin());
        return size;
    }
    std::uint32_t checksum(Packed data) const {
        const auto* bytes = reinterpret_cast<const Bytef*>(data.data());
        if (codec_.kind == CodecKind::crc32)
            return static_cast<std::uint32_t>(crc32_z(0, bytes, data.size()));
        if (codec_.kind == CodecKind::adler32)
            return static_cast<std::uint32_t>(adler32_z(1, bytes, data.size()));
        // CRC-32 of Castagnoli.
        std::uint32_t crc = ~std::uint32_t{0};
        for (const std::byte byte : data) {
            crc ^= std::to_integer<std::uint32_t>(byte);
            for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0x82f63b78u : 0u);
        }
        return ~crc;
    }
    static std::uint32_t word(Packed bytes) {
        std::uint32_t number = 0;
        for (std::size_t i = 0; i < 4; ++i)
            number |= std::to_integer<std::uint32_t>(bytes[i]) << 8 * i;
        return number;
    }

    const std::string& name_;
    const ZarrCodec& codec_;
    Packed packed_;
};

/// Bytes before a codec is taken off, where `bytes` come out, if that is certain.
std::optional<std::size_t> bytes_before(const ZarrCodec& codec, std::size_t bytes) {
    if (codec.kind == CodecKind::shuffle) return bytes;
    if (codec.kind == CodecKind::crc32 || codec.kind == CodecKind::crc32c ||
        codec.kind == CodecKind::adler32)
        return bytes + kChecksum;
    return std::nullopt;
}

template <class F>
bool with_stored_integer(const ZarrNumber& number, F use) {
    const bool has_sign = number.kind == 'i';
    switch (number.bytes) {
        case 1:
            return has_sign ? use(std::int8_t{}) : use(std::uint8_t{});
        case 2:
            return has_sign ? use(std::int16_t{}) : use(std::uint16_t{});
        case 4:
            return has_sign ? use(std::int32_t{}) : use(std::uint32_t{});
        default:
            return has_sign ? use(std::int64_t{}) : use(std::uint64_t{});
    }
}
/// Not of f16, which no filter here takes.
template <class F>
bool with_number_of(const ZarrNumber& number, F use) {
    if (!number.is_float()) return with_stored_integer(number, use);
    return number.bytes == 4 ? use(float{}) : use(double{});
}

template <class T>
T at_place(const Bytes& bytes, std::size_t i) {
    T number;
    std::memcpy(&number, bytes.data() + i * sizeof(T), sizeof(T));
    return number;
}

/// Each is the sum of all up to it, in the type of the sums: integers wrap.
Bytes summed(const ZarrFilter& filter, const Bytes& bytes, std::size_t count) {
    Bytes out(count * filter.plain.bytes);
    with_number_of(filter.stored, [&]<class Stored>(Stored) {
        return with_number_of(filter.plain, [&]<class Plain>(Plain) {
            if constexpr (std::is_floating_point_v<Plain>) {
                Plain sum = 0;
                for (std::size_t i = 0; i < count; ++i) {
                    const auto step = static_cast<Plain>(at_place<Stored>(bytes, i));
                    sum = i == 0 ? step : sum + step;
                    std::memcpy(out.data() + i * sizeof sum, &sum, sizeof sum);
                }
            } else if constexpr (std::is_integral_v<Stored>) {
                std::uint64_t sum = 0;
                for (std::size_t i = 0; i < count; ++i) {
                    sum += static_cast<std::uint64_t>(
                        static_cast<std::int64_t>(at_place<Stored>(bytes, i)));
                    const auto low = static_cast<Plain>(sum);
                    std::memcpy(out.data() + i * sizeof low, &low, sizeof low);
                }
            }
            return true;
        });
    });
    return out;
}

/// stored / scale + offset, as numcodecs computes it: f32 stays f32, all else is f64. A conversion
/// to integers cuts towards zero.
Bytes scaled(const ZarrFilter& filter, const Bytes& bytes, std::size_t count) {
    Bytes out(count * filter.plain.bytes);
    const bool plain_cast = filter.scale == 1 && filter.offset == 0;
    with_number_of(filter.stored, [&]<class Stored>(Stored) {
        return with_number_of(filter.plain, [&]<class Plain>(Plain) {
            using Sum = std::conditional_t<std::is_same_v<Stored, float>, float, double>;
            for (std::size_t i = 0; i < count; ++i) {
                const auto stored = at_place<Stored>(bytes, i);
                Plain plain;
                if (std::is_integral_v<Stored> && std::is_integral_v<Plain> && plain_cast) {
                    plain = static_cast<Plain>(stored);
                } else {
                    const Sum value = static_cast<Sum>(stored) / static_cast<Sum>(filter.scale) +
                                      static_cast<Sum>(filter.offset);
                    if constexpr (std::is_integral_v<Plain>) {
                        using Limits = std::numeric_limits<Plain>;
                        const double cut = std::trunc(static_cast<double>(value));
                        plain = !(cut > static_cast<double>(Limits::lowest())) ? Limits::lowest()
                                : cut >= static_cast<double>(Limits::max())
                                    ? Limits::max()
                                    : static_cast<Plain>(cut);
                    } else {
                        plain = static_cast<Plain>(value);
                    }
                }
                std::memcpy(out.data() + i * sizeof plain, &plain, sizeof plain);
            }
            return true;
        });
    });
    return out;
}

/// Bits, the highest first, behind a byte that says how many of the last are none.
Bytes unpacked_bits(const Bytes& bytes, std::size_t count) {
    Bytes out(count);
    for (std::size_t i = 0; i < count; ++i) out[i] = bytes[1 + i / 8] >> (7 - i % 8) & std::byte{1};
    return out;
}

/// A chunk whose axes were put in another order, in that of the array.
Bytes put_back(const ZarrFilter& filter, const Bytes& bytes) {
    const std::size_t axes = filter.shape.size(), width = filter.plain.bytes;
    Bytes out(bytes.size());
    // Steps in the plain chunk along the axes of the stored one.
    std::vector<std::size_t> plain_step(axes), step(axes);
    std::size_t size = width;
    for (std::size_t i = axes; i-- > 0; size *= static_cast<std::size_t>(filter.shape[i]))
        plain_step[i] = size;
    std::vector<std::int64_t> side(axes), at(axes, 0);
    for (std::size_t i = 0; i < axes; ++i) {
        side[i] = filter.shape[filter.order[i]];
        step[i] = plain_step[filter.order[i]];
    }
    std::size_t to = 0;
    for (std::size_t from = 0; from < bytes.size(); from += width) {
        std::memcpy(out.data() + to, bytes.data() + from, width);
        for (std::size_t i = axes; i-- > 0;) {
            to += step[i];
            if (++at[i] < side[i]) break;
            to -= step[i] * static_cast<std::size_t>(side[i]);
            at[i] = 0;
        }
    }
    return out;
}

/// Names of numcodecs in version 3 of Zarr.
std::string plain_name(const std::string& name) {
    for (const std::string prefix : {"numcodecs.", "https://zarr.dev/numcodecs/"})
        if (name.starts_with(prefix)) return name.substr(prefix.size());
    return name;
}

}  // namespace

std::optional<ZarrNumber> zarr_number(const std::string& name) {
    constexpr std::pair<const char*, const char*> kLong[] = {
        {"bool", "b1"},  {"uint8", "u1"},   {"int8", "i1"},    {"uint16", "u2"},
        {"int16", "i2"}, {"uint32", "u4"},  {"int32", "i4"},   {"uint64", "u8"},
        {"int64", "i8"}, {"float16", "f2"}, {"float32", "f4"}, {"float64", "f8"}};
    ZarrNumber number;
    std::string brief = name;
    if (!brief.empty() && std::string_view("<>|=").find(brief[0]) != std::string_view::npos) {
        number.big_endian = brief[0] == '>';
        brief.erase(0, 1);
    }
    for (const auto& [full, of] : kLong) {
        if (name == full) brief = of;
        if (brief != of) continue;
        number.kind = brief[0];
        number.bytes = static_cast<std::size_t>(brief[1] - '0');
        return number;
    }
    return std::nullopt;
}

std::optional<ZarrCodec> zarr_codec(const std::string& name, const Json& settings,
                                    std::string& problem) {
    const std::string plain = plain_name(name);
    const auto found = std::find_if(std::begin(kCodecNames), std::end(kCodecNames),
                                    [&](const CodecName& known) { return plain == known.name; });
    if (found == std::end(kCodecNames)) return std::nullopt;
    ZarrCodec codec{found->kind};
    if (codec.kind == CodecKind::shuffle) {
        const auto element = settings.value("elementsize", std::int64_t{4});
        if (element < 1 || element > 256) {
            problem = fmt::format("an elementsize of {} is not supported", element);
            return std::nullopt;
        }
        codec.element = static_cast<std::size_t>(element);
    }
    if (codec.kind == CodecKind::lzma && settings.contains("format") && settings["format"] != 1 &&
        settings["format"] != 0 && settings["format"] != 2) {
        problem = "a raw stream is not supported";
        return std::nullopt;
    }
    const bool usually_first = codec.kind == CodecKind::crc32 || codec.kind == CodecKind::adler32;
    const Json where = settings.value("location", Json());
    codec.sum_first = where.is_string() ? where == "start" : usually_first;
    return codec;
}

std::optional<ZarrFilter> zarr_filter(const std::string& name, const Json& settings,
                                      const ZarrNumber& plain, std::string& problem) {
    const std::string known = plain_name(name);
    using FilterKind = ZarrFilter::Kind;
    const auto number = [&](const char* field, const ZarrNumber& usual) {
        const Json said = settings.value(field, Json());
        if (said.is_null()) return usual;
        const auto found = said.is_string() ? zarr_number(said.get<std::string>()) : std::nullopt;
        if (!found) problem = fmt::format("field '{}' names no known type", field);
        return found.value_or(usual);
    };
    ZarrFilter filter{FilterKind::delta, plain, plain, 1, 0, {}, {}};
    if (known == "packbits") {
        filter.kind = FilterKind::pack_bits;
        filter.stored = {'u', 1, false};
        if (plain.kind != 'b') problem = "is for bool alone";
        return problem.empty() ? std::optional(filter) : std::nullopt;
    }
    if (known == "bitround") {  // zeros in the last bits: numbers as any others
        filter.kind = FilterKind::scale;
        return filter;
    }
    const bool casts = known == "astype";
    if (!casts && known != "delta" && known != "fixedscaleoffset" && known != "quantize")
        return std::nullopt;
    const ZarrNumber decoded_as = number(casts ? "decode_dtype" : "dtype", plain);
    filter.stored = number(casts ? "encode_dtype" : "astype", decoded_as);
    if (known != "delta") filter.kind = FilterKind::scale;
    if (known == "fixedscaleoffset") {
        filter.scale = settings.value("scale", 1.0);
        filter.offset = settings.value("offset", 0.0);
        if (!(std::isfinite(filter.scale) && filter.scale != 0 && std::isfinite(filter.offset)))
            problem = "its scale is 0, or not finite";
    }
    if (decoded_as.kind != plain.kind || decoded_as.bytes != plain.bytes)
        problem = "its type is not that of the numbers it is applied to";
    const auto is_half = [](const ZarrNumber& n) { return n.is_float() && n.bytes == 2; };
    const bool copies = filter.kind == FilterKind::scale && filter.scale == 1 &&
                        filter.offset == 0 && filter.stored.kind == plain.kind &&
                        filter.stored.bytes == plain.bytes;
    if ((is_half(plain) || is_half(filter.stored)) && !copies)
        problem = "is not supported for floats of 16 bits";
    if (filter.kind == FilterKind::delta && filter.stored.is_float() && !plain.is_float())
        problem = "integers as floats are not supported";
    return problem.empty() ? std::optional(filter) : std::nullopt;
}

Bytes decoded(const std::string& name, Bytes packed, const std::vector<ZarrCodec>& codecs,
              std::size_t bytes) {
    // How many bytes there are behind each, as far as that is certain.
    std::vector<std::optional<std::size_t>> after(codecs.size());
    std::optional<std::size_t> known = bytes;
    for (std::size_t i = codecs.size(); i-- > 0;) {
        after[i] = known;
        known = known ? bytes_before(codecs[i], *known) : std::nullopt;
    }
    if (known && packed.size() != *known)
        refuse(name, fmt::format("holds {} bytes, expected {}", packed.size(), *known));
    for (std::size_t i = 0; i < codecs.size(); ++i) {
        Unpacking unpacking(name, codecs[i], packed);
        packed = after[i] ? unpacking.exactly(*after[i])
                          : unpacking.at_most(static_cast<std::size_t>(most_packed(bytes)));
    }
    return packed;
}

std::size_t filtered_bytes(const ZarrFilter& filter, std::size_t count) noexcept {
    if (filter.kind == ZarrFilter::Kind::pack_bits) return 1 + (count + 7) / 8;
    return count * filter.stored.bytes;
}

Bytes unfiltered(const std::string& name, Bytes bytes, const std::vector<ZarrFilter>& filters,
                 std::size_t count) {
    for (const ZarrFilter& filter : filters) {
        if (bytes.size() != filtered_bytes(filter, count))
            refuse(name, fmt::format("holds {} bytes, expected {}", bytes.size(),
                                     filtered_bytes(filter, count)));
        switch (filter.kind) {
            case ZarrFilter::Kind::delta:
                bytes = summed(filter, bytes, count);
                break;
            case ZarrFilter::Kind::scale:
                if (filter.scale != 1 || filter.offset != 0 ||
                    filter.stored.kind != filter.plain.kind ||
                    filter.stored.bytes != filter.plain.bytes)
                    bytes = scaled(filter, bytes, count);
                break;
            case ZarrFilter::Kind::pack_bits:
                bytes = unpacked_bits(bytes, count);
                break;
            case ZarrFilter::Kind::transpose:
                bytes = put_back(filter, bytes);
                break;
        }
    }
    return bytes;
}

}  // namespace edgewise::store
