#include "settings/kernel.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "graph/words.hpp"
#include "settings/readers.hpp"

namespace edgewise {
namespace {

using KernelKind = KernelSpec::Kind;

constexpr std::array<NamedSum, 13> kNamedSums = {{{"gaussian", KernelKind::gauss},
                                                  {"gauss", KernelKind::gauss},
                                                  {"gaussian_blur", KernelKind::gauss},
                                                  {"blur", KernelKind::gauss},
                                                  {"smooth", KernelKind::gauss},
                                                  {"mean", KernelKind::box},
                                                  {"average", KernelKind::box},
                                                  {"uniform", KernelKind::box},
                                                  {"box", KernelKind::box},
                                                  {"box_blur", KernelKind::box},
                                                  {"sobel", KernelKind::sobel},
                                                  {"laplace", KernelKind::laplace},
                                                  {"laplacian", KernelKind::laplace}}};

/// Millimetres in a unit that a size ends in; 0: it ends in none. The unit is taken away.
double take_unit(std::string& text) {
    constexpr std::array<std::pair<std::string_view, double>, 5> kUnits = {
        {{"mm", 1}, {"um", 1e-3}, {"\xC2\xB5m", 1e-3}, {"nm", 1e-6}, {"cm", 10}}};
    for (const auto& [unit, length] : kUnits)
        if (lower(text).ends_with(unit)) {
            text.erase(text.size() - unit.size());
            return length;
        }
    return 0;
}

/// "2", "2mm", "2,2,1", "2,2,4mm" or "2mm,2mm,4mm".
void take_sizes(KernelSpec& kernel, const std::string& text) {
    std::vector<std::string> words = split(text, ',');
    std::vector<double> units;
    for (std::string& word : words) {
        units.push_back(take_unit(word));
        kernel.sizes.push_back(number_of(setting("kernel"), word));
    }
    const double last = units.back();  // holds for those that say none
    kernel.lengths = last > 0;
    for (std::size_t i = 0; i < units.size(); ++i) {
        if (units[i] > 0 && last == 0)
            throw RequestError(message(
                "@kernel: '{}': lengths and numbers of samples; expected one or the other", text));
        if (kernel.lengths) kernel.sizes[i] *= units[i] > 0 ? units[i] : last;
    }
    if (words.size() > 3)
        throw RequestError(message("@kernel: '{}': expected one size, or one an axis", text));
}

KernelSpec sized(const KernelName& name, const std::optional<std::string>& size,
                 const std::string& typed) {
    if (!size || size->empty())
        throw RequestError(message("@kernel: '{}' given; expected {}:{}, in samples, or as {}:2mm",
                                   typed, name.name, name.kind == KernelKind::gauss ? "S" : "R",
                                   name.name));
    KernelSpec kernel;
    kernel.kind = name.kind;
    kernel.flat = name.flat;
    take_sizes(kernel, *size);
    return kernel;
}

KernelSpec sobel_of(const std::optional<std::string>& axis) {
    KernelSpec kernel;
    kernel.kind = KernelKind::sobel;
    kernel.axis = -1;
    if (!axis) return kernel;
    const std::string word = lower(*axis);
    for (int k = 0; k < 3; ++k)
        if (word == std::string(1, "xyz"[k])) kernel.axis = k;
    if (kernel.axis < 0)
        throw RequestError(
            message("@kernel(sobel): '{}' is not known; expected one of x, y, z", *axis));
    return kernel;
}

/// What is neither a kernel nor a file may be a mistyped name.
/// @param name  what stands before a colon
void expect_file(const std::string& text, const std::string& name) {
    std::error_code none;
    if (std::filesystem::exists(text, none)) return;
    std::vector<std::string> names{"sobel", "laplace"};
    for (const KernelName& known : kKernelNames) names.emplace_back(known.name);
    const std::string near = nearest_name(name, names);
    if (!near.empty())
        throw RequestError(
            message("@kernel: '{}' is not known, and no file; did you mean {}?", text, near));
}

KernelSpec named_kernel(const std::string& text) {
    const std::size_t colon = text.find(':');
    const std::string name = text.substr(0, colon);
    const std::optional<std::string> rest =
        colon == std::string::npos ? std::nullopt : std::optional(text.substr(colon + 1));
    for (const KernelName& known : kKernelNames)
        if (same_word(name, known.name)) return sized(known, rest, text);
    if (same_word(name, "sobel")) return sobel_of(rest);
    KernelSpec kernel;
    if (same_word(text, "laplace") || same_word(text, "laplacian")) {
        kernel.kind = KernelKind::laplace;
        return kernel;
    }
    if (!text.empty() && text.find_first_not_of("0123456789.,mun") == std::string::npos &&
        text.find_first_of("0123456789") == 0)
        throw RequestError(message(
            "@kernel: '{}' is a size; of what? Expected box:{}, sphere:{}, cross:{} or gauss:{}",
            text, text, text, text, text));
    expect_file(text, name);
    kernel.kind = KernelKind::file;
    kernel.file = text;
    return kernel;
}

/// How many values there are on each level of lists, the outermost first; all alike on a level.
void take_extents(const SettingValue& value, std::size_t level,
                  std::vector<std::int64_t>& extents) {
    if (!value.is_list()) {
        if (level != extents.size())
            throw SettingError(message("@kernel: its rows are not equally long"));
        return;
    }
    const SettingValue::List all = value.values();
    const auto count = static_cast<std::int64_t>(all.size());
    if (level == extents.size()) extents.push_back(count);
    if (extents[level] != count)
        throw SettingError(message("@kernel: its rows are not equally long"));
    for (const SettingValue& one : all) take_extents(one, level + 1, extents);
}

/// The first value decides how deep lists are.
std::size_t depth_of(const SettingValue& value) {
    if (!value.is_list()) return 0;
    const SettingValue::List all = value.values();
    return 1 + (all.empty() ? 0 : depth_of(all.front()));
}

void add_weights(const SettingValue& value, std::vector<double>& weights) {
    if (value.is_list()) {
        for (const SettingValue& one : value.values()) add_weights(one, weights);
        return;
    }
    const double* number = nullptr;
    double whole = 0;
    value.visit([&](const auto& held) {
        using Held = std::remove_cvref_t<decltype(held)>;
        if constexpr (std::is_same_v<Held, double>) number = &held;
        // JSON has no NaN, which is a hole: null stands for it.
        if constexpr (std::is_same_v<Held, std::monostate>)
            number = &(whole = std::numeric_limits<double>::quiet_NaN());
        if constexpr (std::is_same_v<Held, std::int64_t> || std::is_same_v<Held, bool>)
            number = &(whole = static_cast<double>(held));
    });
    if (!number) throw SettingError(message("@kernel: '{}' is no number", value.text()));
    weights.push_back(*number);
}

KernelSpec kernel_of_array(const SettingValue& value) {
    const std::size_t axes = depth_of(value);
    if (axes < 2 || axes > 3)
        throw RequestError(
            message("@kernel: an array of {} axes given; expected one of 2 or 3, or a name with "
                    "its size, as gauss:2",
                    axes));
    std::vector<std::int64_t> extents;
    take_extents(value, 0, extents);
    std::reverse(extents.begin(), extents.end());
    extents.resize(3, 1);
    if (std::find(extents.begin(), extents.end(), 0) != extents.end())
        throw RequestError(message("@kernel: the array has no numbers"));
    KernelSpec kernel;
    kernel.kind = KernelKind::given;
    kernel.given.extent = {extents[0], extents[1], extents[2]};
    kernel.given.weights.clear();
    add_weights(value, kernel.given.weights);
    kernel.given.name = "array";
    return kernel;
}

SettingValue array_told(const Stencil& stencil) {
    SettingValue::List slices;
    for (std::int64_t z = 0; z < stencil.extent.z; ++z) {
        SettingValue::List rows;
        for (std::int64_t y = 0; y < stencil.extent.y; ++y) {
            SettingValue::List row;
            for (std::int64_t x = 0; x < stencil.extent.x; ++x)
                row.emplace_back(stencil.at(x, y, z));
            rows.emplace_back(std::move(row));
        }
        slices.emplace_back(std::move(rows));
    }
    return slices.size() == 1 ? slices.front() : SettingValue(std::move(slices));
}

}  // namespace

const NamedSum* named_sum(const std::string& word) {
    const std::string plain = plain_op_name(word);
    const auto found = std::find_if(kNamedSums.begin(), kNamedSums.end(),
                                    [&](const NamedSum& sum) { return sum.name == plain; });
    return found == kNamedSums.end() ? nullptr : &*found;
}

std::string nearest_sum(const std::string& word) {
    std::vector<std::string> names;
    for (const NamedSum& sum : kNamedSums) names.emplace_back(sum.name);
    return nearest_name(word, names);
}

KernelSpec kernel_of(const SettingValue& value) {
    return value.is_list() ? kernel_of_array(value) : named_kernel(value.text());
}

KernelSpec kernel_of(const NamedSum& sum, const SettingValue* value) {
    if (value && value->is_list())
        throw RequestError(
            message("@op({}): has a kernel of its own; expected @op(convolve)", sum.name));
    const std::optional<std::string> text = value ? std::optional(value->text()) : std::nullopt;
    KernelSpec kernel;
    kernel.kind = sum.kind;
    kernel.axis = -1;
    if (sum.kind == KernelKind::laplace && !text) return kernel;
    if (sum.kind == KernelKind::sobel)
        return !text || text->find(':') != std::string::npos || same_word(*text, "sobel")
                   ? named_kernel(text.value_or("sobel"))
                   : sobel_of(text);
    const bool gauss = sum.kind == KernelKind::gauss;
    if (!text)
        throw RequestError(message(
            "@op({}): how wide? Expected @op(convolve) @kernel({}:{}), {} in samples or as 2mm",
            sum.name, gauss ? "gauss" : "box", gauss ? "S" : "R", gauss ? "S" : "R"));
    const bool is_size = !text->empty() && std::string_view("0123456789.").find(text->front()) !=
                                               std::string_view::npos;
    if (is_size) return sized({gauss ? "gauss" : "box", sum.kind}, text, *text);
    kernel = named_kernel(*text);
    if (sum.name.starts_with("gauss") && kernel.kind != KernelKind::gauss)
        throw RequestError(message(
            "@op({}) @kernel({}): no Gaussian; expected gauss:S, or @op(convolve) @kernel({})",
            sum.name, *text, *text));
    return kernel;
}

SettingValue kernel_told(const KernelSpec& kernel) {
    switch (kernel.kind) {
        case KernelKind::given:
            return array_told(kernel.given);
        case KernelKind::file:
            return kernel.file;
        case KernelKind::difference:
            return {};
        case KernelKind::laplace:
            return "laplace";
        case KernelKind::sobel:
            return kernel.axis < 0 ? std::string("sobel")
                                   : fmt::format("sobel:{}", "xyz"[kernel.axis]);
        default:
            break;
    }
    const auto name = std::find_if(kKernelNames.begin(), kKernelNames.end(), [&](const auto& one) {
        return one.kind == kernel.kind && one.flat == kernel.flat;
    });
    const std::vector<double> sizes =
        kernel.sizes.empty() ? std::vector<double>{kernel.size} : kernel.sizes;
    return fmt::format("{}:{}{}", name->name, fmt::join(sizes, ","), kernel.lengths ? "mm" : "");
}

}  // namespace edgewise
