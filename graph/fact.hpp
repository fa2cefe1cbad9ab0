#pragma once

#include <fmt/format.h>
#include <string>
#include <string_view>
#include <utility>

namespace edgewise {

/// A number that is measured of the data of a request, by its name in a scene (Scene::facts). The
/// header of the code that measures it declares it, and all who read it go through that, so that no
/// name is written twice.
struct Fact {
    std::string_view name;

    explicit constexpr Fact(std::string_view called) noexcept : name(called) {}
    operator std::string() const { return std::string(name); }
};

/// The name of a fact: of a Fact, or of one that a FactFamily made.
class FactName {
 public:
    FactName() = default;
    FactName(const Fact& fact) : text_(fact.name) {}  // NOLINT: a fact has a name
    explicit FactName(std::string text) : text_(std::move(text)) {}

    const std::string& text() const noexcept { return text_; }
    operator const std::string&() const noexcept { return text_; }
    friend bool operator==(const FactName& a, const FactName& b) = default;

 private:
    std::string text_;
};

/// Facts that what they are of tells apart: kPictureError("foh", 0.5) is "picture/foh/0.5".
struct FactFamily {
    std::string_view stem;

    explicit constexpr FactFamily(std::string_view called) noexcept : stem(called) {}

    template <class... Of>
    FactName operator()(const Of&... of) const {
        std::string name(stem);
        (name.append("/").append(fmt::format("{}", of)), ...);
        return FactName(std::move(name));
    }
    /// Whether a name is of one of them.
    constexpr bool has(std::string_view name) const noexcept {
        return name.size() > stem.size() && name.starts_with(stem) && name[stem.size()] == '/';
    }
};

}  // namespace edgewise
