#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <concepts>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "graph/hash.hpp"
#include "graph/samples.hpp"

namespace edgewise {

/// Of what visit_fields() has an overload: it calls a function with the name and the value of each
/// member, in order.
template <class T>
concept HasFields = requires(const T& value) {
    visit_fields(value, [](std::string_view, const auto&) {});
};

/// T or const T: what an overload of visit_fields() takes.
template <class T, class U>
concept Either = std::same_as<std::remove_const_t<T>, U>;

template <Either<Extent> T, class F>
void visit_fields(T& extent, F&& f) {
    auto& [x, y, z] = extent;
    f("x", x), f("y", y), f("z", z);
}

template <Either<ValueMap> T, class F>
void visit_fields(T& map, F&& f) {
    auto& [slope, offset] = map;
    f("slope", slope), f("offset", offset);
}

class Fingerprint;

/// Vectors and matrices, which are no lists.
template <class T>
concept OfEigen = requires {
    T::RowsAtCompileTime;
};
template <class T>
concept NumberOrWord = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <class T>
concept ListOrMap =
    !OfEigen<T> && !std::convertible_to<T, std::string_view> && requires(const T& all) {
    all.begin(), all.end(), all.size(), all.empty();
};
template <class T>
concept Told = !OfEigen<T> &&
               (HasFields<T> || requires(Fingerprint & to, const T& value) { add_to(to, value); });

/// 128 bits that tell values from others: by chance two differ in 2^64 pairs. Equal values give
/// equal bits, in any process and on any machine of one byte order. What nothing is known of makes
/// it uncertain, and nothing may be looked up by it.
class Fingerprint {
 public:
    bool certain() const noexcept { return certain_; }
    void cannot_tell() noexcept { certain_ = false; }
    /// 32 hexadecimal digits.
    std::string text() const;

    void bytes(const void* first, std::size_t count) noexcept;
    Fingerprint& add(std::string_view text) noexcept {
        bytes(text.data(), text.size());
        return *this;
    }
    Fingerprint& add(const std::string& text) noexcept { return add(std::string_view(text)); }
    Fingerprint& add(const char* text) noexcept { return add(std::string_view(text)); }
    template <NumberOrWord T>
    Fingerprint& add(T number) noexcept {
        if constexpr (std::is_floating_point_v<T>)
            word(std::bit_cast<std::uint64_t>(static_cast<double>(number)));
        else
            word(static_cast<std::uint64_t>(number));
        return *this;
    }
    template <class Derived>
    Fingerprint& add(const Eigen::MatrixBase<Derived>& matrix) noexcept {
        for (Eigen::Index j = 0; j < matrix.cols(); ++j)
            for (Eigen::Index i = 0; i < matrix.rows(); ++i) add(double(matrix(i, j)));
        return *this;
    }
    template <class T>
    Fingerprint& add(const std::optional<T>& value) {
        add(value.has_value());
        return value ? add(*value) : *this;
    }
    template <class T>
    Fingerprint& add(const std::shared_ptr<T>& value) {
        add(value != nullptr);
        return value ? add(*value) : *this;
    }
    template <class A, class B>
    Fingerprint& add(const std::pair<A, B>& both) {
        return add(both.first).add(both.second);
    }
    template <ListOrMap T>
    Fingerprint& add(const T& all) {
        add(all.size());
        for (const auto& each : all) add(each);
        return *this;
    }
    /// What has its own overload of add_to(), else member by member.
    template <Told T>
    Fingerprint& add(const T& value) {
        if constexpr (requires { add_to(*this, value); })
            add_to(*this, value);
        else
            visit_fields(value,
                         [this](std::string_view, const auto& member) { this->add(member); });
        return *this;
    }

 private:
    void word(std::uint64_t bits) noexcept { bytes(&bits, sizeof bits); }

    Hash first_{1}, second_{2};
    bool certain_ = true;
};

}  // namespace edgewise
