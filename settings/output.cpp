#include "settings/output.hpp"

#include <array>
#include <cstdint>

#include "graph/words.hpp"
#include "reference/job_reference.hpp"
#include "settings/jobs.hpp"
#include "settings/readers.hpp"

namespace edgewise {
namespace {

constexpr const char* kOutput = "Output";
constexpr auto kActsOnFiles = QuerySetting::Acts::output;
constexpr std::size_t kUsualSamples = 2048;

int bits_of(const std::string& text, const Message& called) {
    constexpr std::array kBits{8, 16, 32};
    return kBits[static_cast<std::size_t>(reads::place_of(text, called, {"8", "16", "32"}))];
}

/// True: a usual number of samples.
void take_verify(Query& query, const SettingValue& value, const Reading& reading) {
    const std::string text = reads::word(value, reading.called());
    query.verify.reset();
    if (text == "false") return;
    query.verify = verify_count(text);
}

SettingValue verify_told(const Query& query) {
    return query.verify == 0u ? SettingValue("all") : reads::told(query.verify);
}

Message help_of_out(Job job) {
    return has::mesh(job) ? "file that ends in .ply, .obj or .stl; null:"
                          : "file, by its ending; %d is the frame; - (PNG); null:";
}

}  // namespace

std::size_t verify_count(const std::string& text) {
    if (text.empty() || text == "true") return kUsualSamples;
    if (same_word(text, "all")) return 0;
    return static_cast<std::size_t>(whole_of(setting("verify"), text, 1, 1'000'000'000));
}

Rows output_settings() {
    static const std::vector<QuerySetting> rows = grouped(
        kOutput,
        {QuerySetting{"out", "OUT", help_of_out, has::any, reads::text(&Query::out)}.typed_as("o"),
         {"bits", "8|16|32", "8, 16: a view; 32: values", has::neither_mesh,
          reads::with_limits(Limits::words({"8", "16", "32"}),
                             reads::parsed(bits_of, &Query::bits))},
         {"quality", "Q",
          "1 to 100: of JPEG, default 95; WebP and JPEG 2000 keep every value without it",
          has::neither_mesh, reads::whole(1, 100, &Query::quality)},
         {"fps", "F",
          "pictures a second of a .gif (at most 50), .apng or .mp4 of several; default 15",
          has::render, reads::number_in(Limits::between(0.01, 100), &Query::fps)},
         {"verify", "",
          message("measure the error on N random samples (@verify(N); default 2048) or all"),
          has_reference,
          reads::with_limits({.least = 1, .greatest = 1e9, .allowed = {"all"}},
                             {take_verify, verify_told, Reader::Kind::bare})},
         {"seed", "S", "of these samples; default 1", has_reference,
          reads::whole(0, INT64_MAX, &Query::seed)},
         {"repeat", "N", "run N times", has::any, reads::whole(1, 1'000'000, &Query::repeat)}},
        kActsOnFiles);
    return rows;
}

}  // namespace edgewise
