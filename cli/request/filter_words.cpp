#include "cli/request/filter_words.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fmt/format.h>
#include <limits>
#include <string_view>
#include <utility>

#include "cli/request/request_options.hpp"
#include "engine/request/numbers.hpp"
#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise::cli {
namespace {

using KernelKind = KernelSpec::Kind;

/// A name of a kernel with a size, ours or another program's.
struct KernelName {
    std::string_view name;
    KernelKind kind;
    bool flat = false;
};
constexpr std::array<KernelName, 10> kKernelNames = {{{"box", KernelKind::box},
                                                      {"gauss", KernelKind::gauss},
                                                      {"sphere", KernelKind::sphere},
                                                      {"cross", KernelKind::cross},
                                                      {"cube", KernelKind::box},
                                                      {"square", KernelKind::box, true},
                                                      {"gaussian", KernelKind::gauss},
                                                      {"ball", KernelKind::sphere},
                                                      {"disk", KernelKind::sphere, true},
                                                      {"disc", KernelKind::sphere, true}}};

/// An operation that other programs have by its own name, and we by a kernel.
struct NamedSum {
    std::string_view name;
    KernelKind kind;
};
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

const NamedSum* named_sum(const std::string& word) {
    const std::string plain = plain_op_name(word);
    const auto found = std::find_if(kNamedSums.begin(), kNamedSums.end(),
                                    [&](const NamedSum& sum) { return sum.name == plain; });
    return found == kNamedSums.end() ? nullptr : &*found;
}

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
        kernel.sizes.push_back(number_of("--kernel", word));
    }
    const double last = units.back();  // holds for those that say none
    kernel.lengths = last > 0;
    for (std::size_t i = 0; i < units.size(); ++i) {
        if (units[i] > 0 && last == 0)
            throw RequestError(fmt::format(
                "--kernel: '{}': lengths and numbers of samples; expected one or the other", text));
        if (kernel.lengths) kernel.sizes[i] *= units[i] > 0 ? units[i] : last;
    }
    if (words.size() > 3)
        throw RequestError(fmt::format("--kernel: '{}': expected one size, or one an axis", text));
}

KernelSpec sized(const KernelName& name, const std::optional<std::string>& size,
                 const std::string& typed) {
    if (!size || size->empty())
        throw RequestError(fmt::format("--kernel: '{}' given; expected {}:{}, in samples, or as {}",
                                       typed, name.name, name.kind == KernelKind::gauss ? "S" : "R",
                                       fmt::format("{}:2mm", name.name)));
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
            fmt::format("--kernel sobel: '{}' is not known; expected one of x, y, z", *axis));
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
            fmt::format("--kernel: '{}' is not known, and no file; did you mean {}?", text, near));
}

/// "box:R", "gauss:S", "sphere:R", "cross:R", "sobel:x", "laplace", or a file.
KernelSpec kernel_of(const std::string& text) {
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
        throw RequestError(fmt::format(
            "--kernel: '{}' is a size; of what? Expected box:{}, sphere:{}, cross:{} or "
            "gauss:{}",
            text, text, text, text, text));
    expect_file(text, name);
    kernel.kind = KernelKind::file;
    kernel.file = text;
    return kernel;
}

/// Of an operation that says which kernel it takes: its size alone, or the kernel.
KernelSpec kernel_of(const NamedSum& sum, const std::optional<std::string>& text) {
    KernelSpec kernel;
    kernel.kind = sum.kind;
    kernel.axis = -1;
    if (sum.kind == KernelKind::laplace && !text) return kernel;
    if (sum.kind == KernelKind::sobel)
        return !text || text->find(':') != std::string::npos || same_word(*text, "sobel")
                   ? kernel_of(text.value_or("sobel"))
                   : sobel_of(text);
    const bool gauss = sum.kind == KernelKind::gauss;
    if (!text)
        throw RequestError(fmt::format(
            "--op {}: how wide? Expected --op convolve --kernel {}", sum.name,
            gauss ? "gauss:S, S in samples or as 2mm" : "box:R, R in samples or as 2mm"));
    const bool is_size = !text->empty() && std::string_view("0123456789.").find(text->front()) !=
                                               std::string_view::npos;
    if (is_size) return sized({gauss ? "gauss" : "box", sum.kind}, text, *text);
    kernel = kernel_of(*text);
    if (sum.name.starts_with("gauss") && kernel.kind != KernelKind::gauss)
        throw RequestError(
            fmt::format("--op {} --kernel {}: no Gaussian; expected gauss:S, or --op convolve "
                        "--kernel {}",
                        sum.name, *text, *text));
    return kernel;
}

}  // namespace

std::string filter_op_words() {
    std::vector<std::string_view> names;
    for (const FilterOp op : filter_ops()) names.push_back(name_of(op));
    return fmt::format("{}", fmt::join(names, ", "));
}

void add_filter(CLI::App& app, JobOptions& o) {
    add_text(app, "--op", o.op, filter_op_words())->type_name("OP");
    add_text(app, "--kernel", o.kernel,
             "box:R, gauss:S, sphere:R, cross:R (in samples, or as 2mm; one or one an axis), "
             "sobel:x, laplace, or a file of weights, heights or a mask")
        ->type_name("KERNEL");
    add_text(app, "--border", o.border,
             "what stands beyond the samples: zero, clamp, mirror (c b a b c; default) or wrap")
        ->type_name("BORDER");
    app.add_flag("--slices", o.slices, "a volume slice by slice, each as an image");
    add_text(app, "--window", o.window,
             "what is black and white, values or percentiles; HI,LO inverts")
        ->type_name("LO,HI");
}

namespace {

/// A mistyped name may be one of other programs.
void expect_op(const std::string& word, const std::optional<std::string>& size) {
    const std::string plain = plain_op_name(word);
    if (plain == "threshold" || plain == "binarize" || plain == "binarise") {
        // Whoever gave a level gave it as the kernel.
        std::string from = "T", below = "T-1";
        int level = 0;
        if (size) {
            const auto [end, error] =
                std::from_chars(size->data(), size->data() + size->size(), level);
            if (error == std::errc() && end == size->data() + size->size() &&
                level > std::numeric_limits<int>::min()) {
                from = std::to_string(level);
                below = std::to_string(level - 1);
            }
        }
        throw RequestError(fmt::format(
            "--op: '{}' is no filter: a window does it. `edgewise warp FILE -o OUT --bits 8 "
            "--window {},{}` makes whole numbers from {} on white and all others black",
            word, below, from, from));
    }
    std::vector<std::string> names;
    for (const NamedSum& sum : kNamedSums) names.emplace_back(sum.name);
    const std::string near = nearest_name(word, names);
    std::vector<std::string> ours;
    for (const FilterOp op : filter_ops()) ours.emplace_back(name_of(op));
    const bool is_known = std::any_of(ours.begin(), ours.end(), [&](const std::string& name) {
        return name == plain_op_name(word);
    });
    if (!is_known && !near.empty() && nearest_name(word, ours).empty())
        throw RequestError(fmt::format("--op: '{}' is not known; did you mean {}?", word, near));
}

}  // namespace

FilterSpec filter_of(const JobOptions& o) {
    FilterSpec filter;
    if (!o.op) throw RequestError("--op: which one? Expected " + filter_op_words());
    if (o.border) filter.border = border_named(*o.border);
    filter.slices = o.slices;
    if (const NamedSum* sum = named_sum(*o.op)) {
        filter.kernel = kernel_of(*sum, o.kernel);
        // Derivatives are positive where values rise.
        filter.op = filter.kernel.kind != KernelKind::sobel ? FilterOp::convolve
                    : filter.kernel.axis < 0                ? FilterOp::gradient
                                                            : FilterOp::correlate;
        return filter;
    }
    expect_op(*o.op, o.kernel);
    filter.op = filter_op_named(*o.op);
    if (o.kernel) {
        filter.kernel = kernel_of(*o.kernel);
    } else if (filter.op == FilterOp::gradient) {
        filter.kernel.kind = KernelKind::difference;
    } else {
        throw RequestError(
            "--kernel: which one? Expected box:R, gauss:S, sphere:R, cross:R, sobel:x, laplace or "
            "a file");
    }
    return filter;
}

std::string meant_by_filter_option(const std::string& option, const std::string& value) {
    const std::string name = option.substr(std::min(option.size(), option.find_first_not_of('-')));
    const bool is_size = !value.empty() && std::string_view("0123456789.").find(value.front()) !=
                                               std::string_view::npos;
    const std::string plain = plain_op_name(name);
    const auto size = [&](const char* otherwise) { return is_size ? value : otherwise; };
    if (plain == "sigma") return fmt::format("--op convolve --kernel gauss:{}", size("S"));
    if (plain == "radius" || plain == "size") return fmt::format("--kernel box:{}", size("R"));
    if (plain == "laplace" || plain == "laplacian") return "--op convolve --kernel laplace";
    if (plain == "sobel") return "--op correlate --kernel sobel:x";
    if (const NamedSum* sum = named_sum(name))
        return fmt::format("--op convolve --kernel {}", sum->kind == KernelKind::gauss
                                                            ? "gauss:" + size("S")
                                                            : "box:" + size("R"));
    for (const KernelName& known : kKernelNames)
        if (plain == known.name) return fmt::format("--kernel {}:{}", known.name, size("R"));
    for (const FilterOp op : filter_ops()) {
        if (plain != name_of(op)) continue;
        if (op == FilterOp::gradient)
            return fmt::format("--op gradient --kernel gauss:{}", size("S"));
        if (is_linear(op)) return fmt::format("--op {} --kernel KERNEL", plain);
        return fmt::format("--op {} --kernel {}:{}", plain,
                           op == FilterOp::median ? "box" : "sphere", size("R"));
    }
    return {};
}

}  // namespace edgewise::cli
