#include "graph/samples.hpp"

#include <limits>
#include <string>
#include <vector>

#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise {
namespace {

struct Row {
    Type type;
    std::string_view name;
    std::size_t bytes;
    bool integer;
    double low, high;
};

template <class T>
constexpr Row integer_row(Type type, std::string_view name) {
    return {type,
            name,
            sizeof(T),
            true,
            double(std::numeric_limits<T>::min()),
            double(std::numeric_limits<T>::max())};
}

constexpr double kLargestFloat = std::numeric_limits<float>::max();
constexpr double kLargestDouble = std::numeric_limits<double>::max();
constexpr double kLargestHalf = 65504;

constexpr Row kTypes[] = {
    integer_row<std::uint8_t>(Type::u8, "u8"),
    integer_row<std::int8_t>(Type::i8, "i8"),
    integer_row<std::uint16_t>(Type::u16, "u16"),
    integer_row<std::int16_t>(Type::i16, "i16"),
    integer_row<std::uint32_t>(Type::u32, "u32"),
    integer_row<std::int32_t>(Type::i32, "i32"),
    {Type::f16, "f16", 2, false, -kLargestHalf, kLargestHalf},
    {Type::f32, "f32", 4, false, -kLargestFloat, kLargestFloat},
    {Type::f64, "f64", 8, false, -kLargestDouble, kLargestDouble},
    {Type::c64, "c64", 8, false, -kLargestFloat, kLargestFloat},
};

const Row& row(Type type) noexcept { return kTypes[static_cast<std::size_t>(type)]; }

}  // namespace

std::size_t bytes_of(Type type) noexcept { return row(type).bytes; }
std::string_view name_of(Type type) noexcept { return row(type).name; }
bool is_integer(Type type) noexcept { return row(type).integer; }
std::array<double, 2> limits_of(Type type) noexcept { return {row(type).low, row(type).high}; }

Type type_named(std::string_view name) {
    std::vector<std::string> names;
    for (const Row& candidate : kTypes) {
        if (same_word(candidate.name, name)) return candidate.type;
        names.emplace_back(candidate.name);
    }
    throw RequestError("there is no sample type '" + std::string(name) + "'; " +
                       instead_of(name, names));
}

}  // namespace edgewise
