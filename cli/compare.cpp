#include <CLI/CLI.hpp>
#include <cmath>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/request/errors.hpp"
#include "cli/request/request_options.hpp"
#include "cli/session/report.hpp"
#include "cli/verbs/verbs.hpp"
#include "graph/errors.hpp"
#include "graph/range.hpp"
#include "graph/with_type.hpp"
#include "measure/machine.hpp"
#include "request/input.hpp"
#include "request/numbers.hpp"
#include "request/outputs.hpp"
#include "request/quantities.hpp"
#include "runtime/memory_budget.hpp"
#include "settings/readers.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

struct CompareOptions {
    std::string a, b;
    std::optional<std::string> max_error, range, json;
    bool quiet = false;
};

struct Comparison {
    double nrmse = 0, max = 0, low = 0, high = 0;
};

/// All stored numbers of an input as values, one after another.
template <class Body>
void with_values(const Data& data, Body&& body) {
    with_type(data.what.type, [&](auto zero) {
        const auto* stored = data.as<decltype(zero)>();
        const ValueMap& values = data.what.values;
        body([stored, &values](std::int64_t i) { return values(static_cast<double>(stored[i])); });
    });
}

/// A number that only one side has makes the difference infinite; one that is finite on neither
/// side (NaN and NaN, infinity and the same infinity) is no difference.
double difference_of(double a, double b) noexcept {
    if (a == b || (std::isnan(a) && std::isnan(b))) return 0;
    const double difference = std::abs(a - b);
    return std::isfinite(difference) ? difference : INFINITY;
}

Comparison compared(const Data& a, const Data& b, std::optional<double> wide) {
    Comparison result{0, 0, INFINITY, -INFINITY};
    double squares = 0;
    const std::int64_t count = a.what.samples() * a.what.channels;
    with_values(a, [&](auto value_a) {
        with_values(b, [&](auto value_b) {
            for (std::int64_t i = 0; i < count; ++i) {
                const double v = value_a(i), difference = difference_of(v, value_b(i));
                if (std::isfinite(v)) {
                    result.low = std::min(result.low, v);
                    result.high = std::max(result.high, v);
                }
                result.max = std::max(result.max, difference);
                squares += difference * difference;
            }
        });
    });
    if (!(result.low <= result.high)) result.low = result.high = 0;
    const double range = wide ? *wide : range_between(result.low, result.high);
    if (wide) result.high = result.low + *wide;
    result.nrmse = std::sqrt(squares / static_cast<double>(count)) / range;
    return result;
}

void expect_alike(const Input& a, const Input& b) {
    const auto text = [](const Input& input) {
        return fmt::format("{} is {} with {} channel{}", input.name,
                           text_of(input.header.extent, input.header.extent.z > 1 ? 3 : 2),
                           input.channels(), input.channels() > 1 ? "s" : "");
    };
    if (a.header.extent != b.header.extent || a.channels() != b.channels())
        throw RequestError(fmt::format("compare: {}, {}", text(a), text(b)));
}

int do_compare(const CompareOptions& options) {
    return guarded_with_json(options.json, [&] {
        if (options.json && *options.json != "-") expect_writable("--json", *options.json);
        std::optional<double> most, range;
        if (options.max_error) most = error_budget(*options.max_error);
        if (options.range)
            range = reads::expect_within(
                Limits::above(0), number_of(setting("range"), *options.range), setting("range"));
        MemoryBudget memory(static_cast<std::size_t>(free_memory()));
        Input a = inspected(options.a, {}), b = inspected(options.b, {});
        expect_alike(a, b);
        // Stored numbers are compared, so colour is not to be multiplied by alpha.
        take_keep(a, Keep::bits);
        take_keep(b, Keep::bits);
        read_data(a, &memory);
        read_data(b, &memory);
        const Comparison c = compared(*a.data, *b.data, range);
        const double psnr = -20 * std::log10(c.nrmse);
        if (options.json)
            write_text(*options.json, text_of(Json{{"schema", 1},
                                                   {"nrmse", c.nrmse},
                                                   {"psnr", psnr},
                                                   {"max", c.max},
                                                   {"range", {c.low, c.high}}}));
        if (options.json != "-")
            write_text("-", fmt::format("NRMSE {:.6g}, PSNR {:.2f} dB, largest difference {:.6g}, "
                                        "range {:.6g} to {:.6g}\n",
                                        c.nrmse, psnr, c.max, c.low, c.high));
        return static_cast<int>(most && !(c.nrmse <= *most) ? kFailed : kDone);
    });
}

}  // namespace

Verb add_compare(CLI::App& main) {
    CLI::App* app = main.add_subcommand("compare", "how much two images or volumes differ");
    auto options = std::make_shared<CompareOptions>();
    app->add_option("A", options->a, "its range counts as 1")->required();
    app->add_option("B", options->b, "what is compared with it")->required();
    add_text(*app, "--max-error", options->max_error, "exit 1 where B differs by more");
    add_text(*app, "--range", options->range, "difference that counts as 1");
    add_text(*app, "--json", options->json, "report, to FILE or - for standard output");
    app->add_flag("--quiet", options->quiet, "errors only; the numbers are the output, and stay");
    return {app, [options] { return do_compare(*options); }};
}

}  // namespace edgewise::cli
