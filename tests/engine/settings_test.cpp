#include "settings/settings.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "settings/told.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

const Catalogue& edges() {
    static const Catalogue all = catalogue();
    return all;
}

std::string why(Job job, const std::vector<Given>& given) {
    try {
        query_of(job, given, edges());
    } catch (const RequestError& error) {
        return error.what();
    }
    return "";
}

TEST(Settings, HaveOneNameAndOneOptionOfAJob) {
    for (const Job job : jobs()) {
        std::set<std::string> names, options;
        for (const QuerySetting* row : settings_of(job)) {
            EXPECT_TRUE(names.emplace(row->name.name).second) << row->name.name;
            EXPECT_TRUE(options.insert(row->typed()).second) << row->typed();
            EXPECT_FALSE(row->help(job).empty()) << row->name.name;
            EXPECT_TRUE(row->reads.take) << row->name.name;
        }
    }
}

TEST(Settings, AreAllThatMessagesName) {
    std::set<std::string_view> rows{"machine", "mpr"};  // of the command
    for (const QuerySetting* row : settings()) rows.insert(row->name.name);
    EXPECT_EQ(rows, std::set<std::string_view>(kSettings.begin(), kSettings.end()));
}

TEST(Settings, TakeNumbersAndListsAsTheirTexts) {
    Query text = query_for(Job::render), typed = text;
    for (const auto& [name, word, value] :
         std::vector<std::tuple<const char*, const char*, SettingValue>>{
             {"max_error", "0.1", 0.1},
             {"zoom", "1e-3", 1e-3},
             {"eye", "1,2.5,-3", SettingValue::List{1, 2.5, -3}},
             {"size", "64x48", SettingValue::List{64, 48}},
             {"threads", "4", 4.0},
             {"shadows", "", true},
             {"labels", "-7,9007199254740993", SettingValue::List{-7, 9007199254740993}},
             {"window", "1%,250", SettingValue::List{"1%", 250}},
             {"cue", "0.25,linear", SettingValue::List{0.25, "linear"}},
             {"rotate", "10,20,30", SettingValue::List{10, 20, 30}},
             {"shear", "xy=0.5", SettingValue::List{0, 1, 0.5}},
             {"turntable", "7,90", SettingValue::List{7, 90}}}) {
        set(text, name, word, edges());
        set(typed, name, value, edges());
    }
    text.notation = {};  // programs have none
    EXPECT_EQ(json_of(text), json_of(typed));
    EXPECT_EQ(typed.only_labels, (std::vector<std::int64_t>{-7, 9007199254740993}));
    EXPECT_EQ(typed.geometry.size->sides, (std::vector<std::int64_t>{64, 48}));
    EXPECT_EQ(typed.geometry.steps[1].numbers, (std::vector<double>{0, 1, 0.5}));
    EXPECT_EQ(typed.max_error, 0.1);
}

TEST(Settings, OfOneTheLastCountsAndStepsKeepTheirOrder) {
    const Query query = query_of(Job::render,
                                 {{"turntable", "5"},
                                  {"zoom", "nonsense"},
                                  {"planes", "1,0,0,-1"},
                                  {"rotate", "1,2,3"},
                                  {"zoom", "2"},
                                  {"planes", "0,1,0,-2"},
                                  {"turntable", "7"}},
                                 edges());
    EXPECT_EQ(query.geometry.zoom, 2);
    EXPECT_EQ(query.clip.planes.size(), 2u);
    ASSERT_EQ(query.geometry.steps.size(), 3u);
    EXPECT_EQ(query.geometry.steps[0].kind, GeometryStep::Kind::turntable);
    EXPECT_EQ(query.geometry.steps[1].kind, GeometryStep::Kind::rotate);
    EXPECT_EQ(query.geometry.steps[2].numbers[0], 7);
}

TEST(Settings, DoNotHangOnTheOrderOfOthers) {
    const auto both = [](Job job, const Given& a, const Given& b) {
        const Query first = query_of(job, {a, b}, edges()), second = query_of(job, {b, a}, edges());
        EXPECT_EQ(json_of(first), json_of(second)) << a.name << " " << b.name;
        return first;
    };
    EXPECT_EQ(both(Job::render, {"shade", "none"}, {"mode", "shaded"}).shade, Shade::none);
    EXPECT_FALSE(both(Job::render, {"mode", "shaded"}, {"preset", "ct-bone"}).suiting_preset);
    EXPECT_EQ(both(Job::mesh, {"smooth", 0.5}, {"labels", true}).smooth, 0.5);
    EXPECT_EQ(both(Job::mesh, {"smooth", 0.5}, {"isovalue", 3}).finish.smooth, 0.5);
    EXPECT_EQ(both(Job::filter, {"kernel", 2}, {"op", "gaussian"}).filter->kernel.sizes[0], 2);
    EXPECT_EQ(both(radon_job(), {"angles", 90}, {"inverse", true}).radon->angles, 90);
}

TEST(Settings, SayWhatIsWrong) {
    EXPECT_EQ(why(Job::warp, {{"zoom", 2}}), "zoom means nothing for warp");
    EXPECT_NE(why(Job::render, {{"rotat", 2}}).find("did you mean rotate?"), std::string::npos);
    EXPECT_EQ(why(Job::render, {{"zoom", "x"}}), "zoom: 'x' is not a finite number");
    EXPECT_EQ(why(Job::render, {{"minimize", "tme"}}),
              "minimize: 'tme' is not known; did you mean time?");
    EXPECT_EQ(why(Job::filter, {{"op", "gaussian"}}),
              "op=gaussian: how wide? Expected op=convolve kernel=gauss:S, S in samples or as 2mm");
    EXPECT_EQ(why(radon_job(), {{"angles", 3}, {"threshold", 1}}), "threshold: of to=hough only");
    for (const auto& [name, value] : std::vector<Given>{{"zoom", SettingValue::List{1, 2}},
                                                        {"mode", SettingValue::List{"mip"}},
                                                        {"shadows", "maybe"},
                                                        {"no_such", 1}}) {
        Query query = query_for(Job::render);
        EXPECT_THROW(set(query, name, value, edges()), SettingError) << name;
    }
}

/// A value that a setting may have.
SettingValue drawn(const QuerySetting& row, std::mt19937& random) {
    const auto number = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto numbers = [&](int count) {
        SettingValue::List list;
        for (int i = 0; i < count; ++i) list.emplace_back(number(0.01, 1));
        return SettingValue(list);
    };
    const auto one_of = [&](std::vector<SettingValue> values) {
        return values[std::uniform_int_distribution<std::size_t>(0, values.size() - 1)(random)];
    };
    const std::string name(row.name.name);
    if (row.kind() == Reader::Kind::flag) return true;
    if (name == "mode") return one_of({"xray", "composite", "shaded", "surface"});
    if (name == "grid_moves") return one_of({"grid", false});
    if (name == "view") return one_of({"front", "x", "axial"});
    if (name == "level") return one_of({2, "auto"});
    if (name == "channel") return one_of({1, "DAPI"});
    if (name == "orient") return "LPS";
    if (name == "input_unit") return "um";
    if (name == "series") return one_of({"1.2.3", "0"});
    if (name == "background") return one_of({"none", numbers(3)});
    if (name == "preset") return "ct-bone";
    if (name == "shade") return one_of({"none", "phong", "torrance-sparrow"});
    if (name == "gradient") return one_of({"central", "sobel"});
    if (name == "lights") return SettingValue::List{numbers(4), numbers(4)};
    if (name == "cue") return SettingValue::List{number(0, 1), one_of({"exp", "linear"})};
    if (name == "labels") return one_of({true, SettingValue::List{3, -5}});
    if (name == "window") return one_of({"lung", "1%,99.5%", numbers(2), "W400L40"});
    if (name == "colormap") return "viridis";
    if (name == "montage") return SettingValue::List{4, 3};
    if (name == "max_error") return one_of({"40dB", number(0, 1), "linear", "1%"});
    if (name == "max_time") return one_of({"50ms", number(0, 9)});
    if (name == "max_memory") return one_of({"2GiB", 1e9 + 0.5});
    if (name == "reference") return one_of({"spline", "linear", "nearest"});
    if (name == "minimize") return one_of({"time", "error", "memory"});
    if (name == "planner") return one_of({"pilot", "exhaustive"});
    if (name == "via" || name == "without")
        return one_of({SettingValue::List{"project.ray_cast/filter=foh"},
                       SettingValue::List{"project", "warp"}});
    if (name == "op") return one_of({"convolve", "median", "binary_open"});
    if (name == "kernel")
        return one_of(
            {"box:2", "gauss:1.5mm", "disk:2,3,1", "sobel:y", "laplace", "cross:1",
             SettingValue::List{numbers(3), numbers(3)},
             SettingValue::List{SettingValue::List{numbers(2)}, SettingValue::List{numbers(2)}}});
    if (name == "border") return one_of({"zero", "wrap"});
    if (name == "angles") return one_of({7, numbers(5)});
    if (name == "size" && row.of(radon_job())) return SettingValue::List{7, 9};
    if (name == "size") return one_of({"fit", "native", 64, SettingValue::List{64, 32}});
    if (name == "to") return "sinogram";
    if (name == "bits") return one_of({8, 16, 32});
    if (name == "verify") return one_of({true, "all", 77});
    if (name == "out") return "a.png";
    if (name == "turntable") return SettingValue::List{5, number(1, 360)};
    if (name == "shear") return SettingValue::List{0, 1, number(-1, 1)};
    if (name == "path") {
        SettingValue::List all;
        for (int view = 0; view < 2; ++view)
            for (int i = 0; i < 16; ++i) all.emplace_back(number(-1, 1));
        return all;
    }
    for (const char* whole : {"threads", "ranks", "quality", "seed", "repeat", "time"})
        if (name == whole) return std::uniform_int_distribution<int>(2, 90)(random);
    if (row.kind() == Reader::Kind::list) return SettingValue::List{numbers(4), numbers(4)};
    if (name == "box" || name == "crop") return numbers(6);
    if (name == "matrix") return numbers(12);
    if (name == "material") return numbers(4);
    for (const char* three :
         {"eye", "look_at", "about", "spacing", "input_spacing", "rotate", "scale", "translate"})
        if (name == three) return numbers(3);
    return number(0.01, 1);
}

TEST(Settings, ATextOfAQueryMakesTheSameQuery) {
    std::mt19937 random(3);
    std::set<std::string> seen;
    for (int round = 0; round < 400; ++round) {
        const Job job = jobs()[static_cast<std::size_t>(round) % jobs().size()];
        std::vector<Given> given;
        for (const QuerySetting* row : settings_of(job)) {
            const std::string name(row->name.name);
            const bool needed = name == "op" || name == "kernel" || name == "angles";
            // A threshold needs another job of radon; of two transfer functions one is left out.
            const bool of_radon = name == "threshold" || name == "to";
            if (of_radon || name == "transfer" || (name == "size" && job == radon_job())) continue;
            if (!needed && random() % 3) continue;
            given.push_back({name, drawn(*row, random)});
            if (row->kind() == Reader::Kind::step && random() % 2)
                given.push_back({name, drawn(*row, random)});
            seen.insert(name);
        }
        std::shuffle(given.begin(), given.end(), random);
        Query query = query_of(job, given, edges());
        query.input = "a file";
        const std::string text = json_of(query).dump();
        const Query again = query_of(nlohmann::ordered_json::parse(text), edges());
        EXPECT_EQ(json_of(again).dump(), text);
        // Nothing that was given is lost.
        for (const Given& one : given)
            EXPECT_NE(text.find('"' + one.name + '"'), std::string::npos) << one.name << text;
        EXPECT_EQ(again.geometry.steps.size(), query.geometry.steps.size());
        EXPECT_EQ(again.max_error, query.max_error);
        EXPECT_EQ(again.notation.error, query.notation.error);
        EXPECT_EQ(again.only_labels, query.only_labels);
        EXPECT_EQ(again.seed, query.seed);
        EXPECT_EQ(again.demands.via.size(), query.demands.via.size());
        if (query.filter) {
            EXPECT_EQ(again.filter->op, query.filter->op);
            EXPECT_EQ(again.filter->kernel.sizes, query.filter->kernel.sizes);
            EXPECT_EQ(again.filter->kernel.given.weights, query.filter->kernel.given.weights);
        }
        for (std::size_t i = 0; i < query.geometry.steps.size(); ++i) {
            EXPECT_EQ(again.geometry.steps[i].kind, query.geometry.steps[i].kind);
            EXPECT_EQ(again.geometry.steps[i].numbers, query.geometry.steps[i].numbers);
        }
    }
    EXPECT_GT(seen.size(), 70u);
}

TEST(Settings, OfJsonAreChecked) {
    const auto why_of = [](const char* text) -> std::string {
        try {
            query_of(nlohmann::ordered_json::parse(text), edges());
        } catch (const SettingError& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_NE(why_of("[]").find("job"), std::string::npos);
    EXPECT_NE(why_of(R"({"job": "rendr"})").find("did you mean render?"), std::string::npos);
    EXPECT_NE(why_of(R"({"job": "render", "zoom": {"x": 1}})").find("zoom"), std::string::npos);
    EXPECT_NE(why_of(R"({"job": "render", "steps": [1]})").find("steps"), std::string::npos);
    EXPECT_NE(why_of(R"({"job": "warp", "mode": "mip"})").find("mode"), std::string::npos);
    EXPECT_EQ(why_of(R"({"job": "render", "zoom": null, "mode": "mip"})"), "");
}

}  // namespace
}  // namespace edgewise
