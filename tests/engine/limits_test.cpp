// Limits of settings: what a row declares is what its errors tell, and where values begin to be
// taken.
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <optional>
#include <set>

#include "request/numbers.hpp"
#include "settings/readers.hpp"
#include "settings/settings.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

const Catalogue& all_edges() {
    static const Catalogue all = catalogue();
    return all;
}

/// What a setting of a job says of a value; nothing: it takes it.
std::optional<OutOfLimits> refused(const QuerySetting& row, Job job, const SettingValue& value) {
    Query query = query_for(job);
    // What it may depend on, as far as one setting can.
    if (row.name.name == "size" && job == radon_job()) set(query, "inverse", true, all_edges());
    try {
        set(query, row.name.name, value, all_edges());
    } catch (const OutOfLimits& error) {
        return error;
    }
    return {};
}

/// A number as the settings of lists of numbers take it.
SettingValue shaped(const QuerySetting& row, double number) {
    const std::string_view name = row.name.name;
    if (name == "background") return SettingValue::List{number, number, number};
    if (name == "montage") return SettingValue::List{number, number};
    return number;
}

void expect_told(const QuerySetting& row, Job job, const SettingValue& value) {
    const std::optional<OutOfLimits> error = refused(row, job, value);
    ASSERT_TRUE(error) << row.name.name << "=" << value.text();
    EXPECT_EQ(error->field(), row.name.name);
    EXPECT_EQ(error->limits().least, row.limits().least) << row.name.name;
    EXPECT_EQ(error->limits().greatest, row.limits().greatest) << row.name.name;
    if (!row.limits().least) {
        EXPECT_EQ(error->limits().allowed, row.limits().allowed) << row.name.name;
    }
}

/// The next number beyond an end: the next whole one of those that are counted.
double beyond(const QuerySetting& row, double end, double towards) {
    static const std::set<std::string_view> kReal = {
        "perspective", "zoom",       "slab",          "background", "phase",        "occlusion",
        "smooth",      "exposure",   "fps",           "decimate",   "range",        "max_error",
        "max_time",    "max_memory", "planning_time", "spacing",    "input_spacing"};
    return kReal.contains(row.name.name) ? std::nextafter(end, towards)
                                         : end + (towards > end ? 1 : -1);
}

TEST(Limits, OfEachRowAreTold) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    std::set<std::string_view> seen;
    for (const Job job : jobs())
        for (const QuerySetting* row : settings_of(job)) {
            const Limits& limits = row->limits();
            if (limits.none()) continue;
            seen.insert(row->name.name);
            if (limits.least) {
                const double least = *limits.least;
                const double wrong = limits.open_below ? least : beyond(*row, least, -kInfinity);
                expect_told(*row, job, shaped(*row, wrong));
                const double right = limits.open_below ? beyond(*row, least, kInfinity) : least;
                EXPECT_FALSE(refused(*row, job, shaped(*row, right))) << row->name.name;
            }
            // Whole numbers beyond 2^53 are no f64.
            if (limits.greatest && *limits.greatest < 0x1p53) {
                const double most = *limits.greatest;
                const double wrong = limits.open_above ? most : beyond(*row, most, kInfinity);
                expect_told(*row, job, shaped(*row, wrong));
                const double right = limits.open_above ? beyond(*row, most, -kInfinity) : most;
                EXPECT_FALSE(refused(*row, job, shaped(*row, right))) << row->name.name;
            }
            for (const std::string& word : limits.allowed)
                EXPECT_FALSE(refused(*row, job, word)) << word;
            // Channels have names.
            if (row->name.name != "channel") expect_told(*row, job, "no such word");
        }
    EXPECT_GT(seen.size(), 35u);
}

/// What a query that is filled in field by field is refused for.
template <typename Fill>
std::string refused_field(Job job, Fill fill) {
    Query query = query_for(job);
    fill(query);
    try {
        expect_limits(query, all_edges());
    } catch (const OutOfLimits& error) {
        EXPECT_FALSE(error.limits().none());
        return error.field();
    }
    return "";
}

TEST(Limits, AreThoseOfFieldsToo) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double wrong : {0.0, -1.0, nan}) {
        EXPECT_EQ(refused_field(Job::render, [&](Query& q) { q.geometry.zoom = wrong; }), "zoom");
        EXPECT_EQ(refused_field(Job::warp,
                                [&](Query& q) {
                                    q.geometry.spacing = {1, wrong};
                                }),
                  "spacing");
        EXPECT_EQ(refused_field(Job::render, [&](Query& q) { q.clip.slab = wrong; }), "slab");
    }
    EXPECT_EQ(refused_field(Job::render, [](Query& q) { q.geometry.perspective = 180; }),
              "perspective");
    EXPECT_EQ(refused_field(Job::render, [](Query& q) { q.threads = 0; }), "threads");
    EXPECT_EQ(refused_field(Job::mesh, [](Query& q) { q.finish.decimate = 2; }), "decimate");
    EXPECT_EQ(refused_field(Job::warp, [](Query& q) { q.selection.spacing = {-1}; }),
              "input_spacing");
    EXPECT_EQ(refused_field(Job::render,
                            [](Query& q) {
                                q.geometry.zoom = 2;
                                q.geometry.spacing = {0.5};
                                q.geometry.perspective = 30;
                                q.threads = 3;
                                q.max_error = 0.01;
                            }),
              "");
}

TEST(Limits, OfWordsAreAllThatAreKnown) {
    const auto allowed = [](Job job, std::string_view name) {
        return setting_named(name, job)->limits().allowed;
    };
    EXPECT_EQ(allowed(Job::render, "mode").size(), modes().size() + 1);
    EXPECT_EQ(allowed(Job::filter, "op").size(), filter_ops().size());
    EXPECT_EQ(allowed(Job::filter, "border"),
              (std::vector<std::string>{"zero", "clamp", "mirror", "wrap"}));
    EXPECT_EQ(allowed(Job::warp, "bits"), (std::vector<std::string>{"8", "16", "32"}));
}

TEST(Limits, OfWholeNumbersAreTheirEnds) {
    for (const char* text : {"0", "11", "x", "2.5", "", "99999999999999999999"}) try {
            whole_of(setting("quality"), text, 1, 10);
            FAIL() << text;
        } catch (const OutOfLimits& error) {
            EXPECT_EQ(error.field(), "quality");
            EXPECT_EQ(error.limits().least, 1);
            EXPECT_EQ(error.limits().greatest, 10);
        }
    EXPECT_EQ(whole_of(setting("quality"), "10", 1, 10), 10);
}

TEST(Limits, AreSaid) {
    const auto said = [](const Limits& limits, double number) -> std::string {
        try {
            reads::expect_within(limits, number, setting("zoom"));
        } catch (const OutOfLimits& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_EQ(said(Limits::above(0), 0), "zoom: 0 is not greater than 0");
    EXPECT_EQ(said(Limits::from(0), -1), "zoom: -1 is less than 0");
    EXPECT_EQ(said(Limits::between(0, 1), 1.5), "zoom: 1.5 is not from 0 to 1");
    EXPECT_EQ(said(Limits::within(-1, 1), 1), "zoom: 1 is not between -1 and 1");
    EXPECT_EQ(said({.greatest = 4}, 5), "zoom: 5 is greater than 4");
    EXPECT_EQ(said(Limits::between(0, 1), 1), "");
}

}  // namespace
}  // namespace edgewise
