#include <algorithm>
#include <charconv>
#include <fmt/format.h>
#include <limits>

#include "graph/words.hpp"
#include "settings/jobs.hpp"
#include "settings/kernel.hpp"
#include "settings/light.hpp"
#include "settings/readers.hpp"
#include "settings/whole.hpp"

namespace edgewise {
namespace {

FilterSpec& filter_in(Query& query) {
    return query.filter ? *query.filter : query.filter.emplace();
}

std::vector<std::string> op_words() {
    std::vector<std::string> names;
    for (const FilterOp op : filter_ops()) names.emplace_back(name_of(op));
    return names;
}

/// "convolve, correlate, ..."
std::string filter_op_words() { return fmt::format("{}", fmt::join(op_words(), ", ")); }

/// A mistyped name may be one of other programs. @param size  what is given as the kernel, or ""
void expect_op(const std::string& word, const std::string& size) {
    const std::string plain = plain_op_name(word);
    if (plain == "threshold" || plain == "binarize" || plain == "binarise") {
        // Whoever gave a level gave it as the kernel.
        std::string from = "T", below = "T-1";
        int level = 0;
        const auto [end, error] = std::from_chars(size.data(), size.data() + size.size(), level);
        if (error == std::errc() && end == size.data() + size.size() &&
            level > std::numeric_limits<int>::min()) {
            from = std::to_string(level);
            below = std::to_string(level - 1);
        }
        throw RequestError(message(
            "@op: '{}' is no filter: a window does it. `@command(warp FILE) @out(OUT) @bits(8) "
            "@window({},{})` makes whole numbers from {} on white and all others black",
            word, below, from, from));
    }
    const std::string near = nearest_sum(word);
    const std::vector<std::string> ours = op_words();
    const bool is_known = std::find(ours.begin(), ours.end(), plain) != ours.end();
    if (!is_known && !near.empty() && nearest_name(word, ours).empty())
        throw RequestError(message("@op: '{}' is not known; did you mean {}?", word, near));
    if (!is_known) reads::place_of(word, setting("op"), ours);
}

/// Also in words of other programs: op gaussian, kernel 2.
void take_op(Query& query, const SettingValue& value, const Reading& reading) {
    FilterSpec& filter = filter_in(query);
    const std::string op = reads::word(value, reading.called());
    const SettingValue* kernel = reading.other("kernel");
    if (const NamedSum* sum = named_sum(op)) {
        filter.kernel = kernel_of(*sum, kernel);
        // Derivatives are positive where values rise.
        filter.op = filter.kernel.kind != KernelSpec::Kind::sobel ? FilterOp::convolve
                    : filter.kernel.axis < 0                      ? FilterOp::gradient
                                                                  : FilterOp::correlate;
        return;
    }
    expect_op(op, kernel ? kernel->text() : "");
    filter.op = filter_op_named(op);
    if (kernel)
        filter.kernel = kernel_of(*kernel);
    else if (filter.op == FilterOp::gradient)
        filter.kernel.kind = KernelSpec::Kind::difference;
    else if (reading.all)
        throw RequestError(
            message("@kernel: which one? Expected box:R, gauss:S, sphere:R, cross:R, sobel:x, "
                    "laplace or a file"));
}

SettingValue op_of(const Query& query) {
    return query.filter ? SettingValue(std::string(name_of(query.filter->op))) : SettingValue();
}

/// Together with an operation that has read it.
void take_kernel(Query& query, const SettingValue& value, const Reading& reading) {
    if (!reading.other("op")) filter_in(query).kernel = kernel_of(value);
}

SettingValue kernel_in(const Query& query) {
    return query.filter ? kernel_told(query.filter->kernel) : SettingValue();
}

/// As the values of Border are numbered.
std::vector<std::string> border_words() {
    std::vector<std::string> words;
    for (const Border border : {Border::zero, Border::clamp, Border::mirror, Border::wrap})
        words.emplace_back(name_of(border));
    return words;
}

void take_border(Query& query, const SettingValue& value, const Reading& reading) {
    filter_in(query).border = static_cast<Border>(
        reads::place_of(reads::word(value, reading.called()), reading.called(), border_words()));
}

SettingValue border_of(const Query& query) {
    return query.filter ? SettingValue(std::string(name_of(query.filter->border))) : SettingValue();
}

void take_slices(Query& query, const SettingValue& value, const Reading& reading) {
    filter_in(query).slices = reads::truth(value, reading.called());
}

Message help_of_op(Job) { return filter_op_words(); }

}  // namespace

void expect_whole_filter(const Query&, const std::vector<Given>& given) {
    if (!value_in(given, "op"))
        throw RequestError(message("@op: which one? Expected {}", filter_op_words()));
}

Rows filter_settings() {
    static const std::vector<QuerySetting> rows = grouped(
        "",
        {{"op", "OP", help_of_op, has::filter,
          reads::with_limits(Limits::words(op_words()), {take_op, op_of})},
         {"kernel",
          "KERNEL",
          "box:R, gauss:S, sphere:R, cross:R (in samples, or as 2mm; one or one an axis), sobel:x, "
          "laplace, or a file of weights, heights or a mask",
          has::filter,
          {take_kernel, kernel_in}},
         {"border", "BORDER",
          "what stands beyond the samples: zero, clamp, mirror (c b a b c; default) or wrap",
          has::filter, reads::with_limits(Limits::words(border_words()), {take_border, border_of})},
         {"slices",
          "",
          "a volume slice by slice, each as an image",
          has::filter,
          {take_slices,
           [](const Query& query) { return SettingValue(query.filter && query.filter->slices); },
           Reader::Kind::flag}},
         QuerySetting{"window", "LO,HI",
                      "what is black and white, values or percentiles; HI,LO inverts", has::filter,
                      reads::window()}
             .of_output()});
    return rows;
}

}  // namespace edgewise
