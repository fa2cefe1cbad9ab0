#pragma once

#include <array>
#include <string>
#include <string_view>

#include "settings/setting.hpp"

namespace edgewise {

/// A name of a kernel with a size, ours or another program's.
struct KernelName {
    std::string_view name;
    KernelSpec::Kind kind;
    bool flat = false;
};
inline constexpr std::array<KernelName, 10> kKernelNames = {
    {{"box", KernelSpec::Kind::box},
     {"gauss", KernelSpec::Kind::gauss},
     {"sphere", KernelSpec::Kind::sphere},
     {"cross", KernelSpec::Kind::cross},
     {"cube", KernelSpec::Kind::box},
     {"square", KernelSpec::Kind::box, true},
     {"gaussian", KernelSpec::Kind::gauss},
     {"ball", KernelSpec::Kind::sphere},
     {"disk", KernelSpec::Kind::sphere, true},
     {"disc", KernelSpec::Kind::sphere, true}}};

/// An operation that other programs have by its own name, and we by a kernel.
struct NamedSum {
    std::string_view name;
    KernelSpec::Kind kind;
};
/// Null: the word is none of them.
const NamedSum* named_sum(const std::string& word);
/// The one that somebody may have meant, or "".
std::string nearest_sum(const std::string& word);

/// "box:R", "gauss:S", "sphere:R", "cross:R", "sobel:x", "laplace", a file, or an array: lists of
/// rows, or of slices of rows. @throws RequestError
KernelSpec kernel_of(const SettingValue& value);
/// Of an operation that says which kernel it takes: its size alone, or the kernel; null: neither.
/// @throws RequestError
KernelSpec kernel_of(const NamedSum& sum, const SettingValue* value);
/// What kernel_of() makes the same of; nothing where the operation implies it.
SettingValue kernel_told(const KernelSpec& kernel);

}  // namespace edgewise
