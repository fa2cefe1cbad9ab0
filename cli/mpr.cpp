#include "cli/mpr.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/job_words.hpp"
#include "cli/request/messages.hpp"
#include "cli/session/explain.hpp"
#include "cli/session/report.hpp"
#include "cli/session/typed_request.hpp"
#include "cli/verbs/verbs.hpp"
#include "engine/mpr.hpp"
#include "engine/rivals.hpp"
#include "graph/errors.hpp"
#include "measure/machine.hpp"
#include "request/numbers.hpp"
#include "request/outputs.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

std::array<double, 3> place_of_planes(const std::string& text) {
    const std::vector<double> n = numbers_of(setting("mpr"), text);
    if (n.size() != 3)
        throw RequestError(fmt::format("--mpr: '{}' given; expected X,Y,Z, a sample", text));
    return {n[0], n[1], n[2]};
}

Query planes_spec(const JobOptions& options, Messages& messages) {
    configure(messages, options);
    return spec_of(options, catalogue());
}

struct TypedPlanes {
    explicit TypedPlanes(const JobOptions& options)
        : planes(planes_spec(options, messages), place_of_planes(options.mpr.value()),
                 engine_of(options, planes_spec(options, messages), true, messages), messages) {}

    double startup_seconds = process_seconds();
    Messages messages;
    Planes planes;
};

std::string heading_of(const Planned& planned) {
    return fmt::format("plane {}\n", *planned.query.geometry.view);
}

/// What each plane's report is, and what was written.
nlohmann::ordered_json report_of_planes(const TypedPlanes& typed) {
    nlohmann::ordered_json report{{"schema", 1}, {"planes", nlohmann::ordered_json::array()}};
    for (const Reached& one : typed.planes.requests)
        report["planes"].push_back(report_of(one, typed.messages, typed.startup_seconds, true, {}));
    report["outputs"] = typed.planes.files;
    return report;
}

}  // namespace

int do_planes(const JobOptions& options, bool runs) {
    std::optional<TypedPlanes> typed;
    return guarded(
        [&] {
            if (!runs)
                throw RequestError("--mpr: has three plans; `edgewise plan warp` makes one of one");
            for (const auto& [option, given] : {std::pair{"--trace", &options.trace},
                                                {"--flow", &options.flow},
                                                {"--report", &options.report}})
                if (*given)
                    throw RequestError(fmt::format(
                        "{}: is about one plan, and --mpr has three; --json has all of them",
                        option));
            check_outputs(options);
            typed.emplace(options);
            Planes& planes = typed->planes;
            planes.explained = options.explain;
            const auto explain_plan = [&](Planned& planned) {
                if (!options.explain) return;
                weigh(planned);
                explain(options,
                        heading_of(planned) + explanation_of(planned, options.explain_all) + "\n");
            };
            perform(planes, explain_plan);
            double seconds = 0;
            for (const Reached& each : planes.requests) {
                for (const double one : each.run->measured.seconds) seconds += one;
                if (options.explain || (options.has("verify") && options.json != "-"))
                    explain(options,
                            heading_of(*each.planned()) +
                                measurement_of(*each.planned(), *each.run, options.explain));
            }
            typed->messages.result(
                fmt::format("{}, three planes through {}, {:.2f} ms",
                            planes.files.empty()
                                ? "nothing written"
                                : fmt::format("{}, {}", planes.files[0], text_of(planes.extent, 2)),
                            *options.mpr, 1e3 * seconds));
            if (options.json) write_text(*options.json, text_of(report_of_planes(*typed)));
            return 0;
        },
        [&](int code, const std::string& message) {
            if (typed) typed->messages.end_progress();
            if (options.json) write_text(*options.json, text_of(failure_of(code, message)));
        });
}

}  // namespace edgewise::cli
