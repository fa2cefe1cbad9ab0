
#include "graph/words.hpp"
#include "settings/jobs.hpp"
#include "settings/light.hpp"
#include "settings/readers.hpp"
#include "settings/whole.hpp"

namespace edgewise {
namespace {

using To = RadonSetting::To;

constexpr int kMostAngles = RadonSetting::kMostAngles;
constexpr std::int64_t kMostSide = 1 << 20;

RadonSetting& radon_in(Query& query) { return query.radon ? *query.radon : query.radon.emplace(); }

/// A number of them, or degrees.
void take_angles(Query& query, const SettingValue& value, const Reading&) {
    RadonSetting& radon = radon_in(query);
    const std::string text = value.text();
    radon.degrees.clear();
    if (text.find(',') == std::string::npos) {
        radon.angles = static_cast<int>(whole_of(setting("angles"), text, 1, kMostAngles));
        return;
    }
    radon.degrees = numbers_of(setting("angles"), text);
    if (radon.degrees.size() > static_cast<std::size_t>(kMostAngles))
        throw RequestError(
            message("@angles: {} of them; expected at most {}", radon.degrees.size(), kMostAngles));
    radon.angles = static_cast<int>(radon.degrees.size());
}

SettingValue angles_of(const Query& query) {
    if (!query.radon || query.radon->angles == 0) return {};
    return query.radon->degrees.empty() ? SettingValue(query.radon->angles)
                                        : SettingValue::of(query.radon->degrees);
}

/// The way back: as many angles as the sinogram has rows, where nobody says more.
void take_inverse(Query& query, const SettingValue& value, const Reading& reading) {
    RadonSetting& radon = radon_in(query);
    if (!reads::truth(value, reading.called())) {
        if (radon.to == To::image) radon = {};
        return;
    }
    radon.to = To::image;
    radon.angles = 0;
    radon.degrees.clear();
}

void expect_forward(const RadonSetting& radon) {
    if (radon.to == To::image)
        throw RequestError(message("@inverse: makes an image; leave out @to and @threshold"));
}

void take_size_of_image(Query& query, const SettingValue& value, const Reading&) {
    RadonSetting& radon = radon_in(query);
    if (radon.to != To::image) throw RequestError(message("@size: of @inverse only"));
    const std::string text = value.text('x');
    const std::size_t cross = text.find_first_of("xX");
    const Message called = setting("size");
    radon.size[0] = whole_of(called, text.substr(0, cross), 1, kMostSide);
    radon.size[1] = cross == std::string::npos
                        ? radon.size[0]
                        : whole_of(called, text.substr(cross + 1), 1, kMostSide);
}

SettingValue size_of_image(const Query& query) {
    if (!query.radon || query.radon->size[0] == 0) return {};
    return SettingValue::of(query.radon->size);
}

std::vector<std::string> to_words() { return {"sinogram", "hough"}; }

void take_to(Query& query, const SettingValue& value, const Reading& reading) {
    RadonSetting& radon = radon_in(query);
    expect_forward(radon);
    radon.to = static_cast<To>(
        reads::place_of(reads::word(value, reading.called()), reading.called(), to_words()));
}

SettingValue to_of(const Query& query) {
    return query.radon && query.radon->to == To::hough ? SettingValue("hough") : SettingValue();
}

void take_threshold(Query& query, const SettingValue& value, const Reading& reading) {
    RadonSetting& radon = radon_in(query);
    expect_forward(radon);
    radon.threshold = number_of(reading.called(), reads::word(value, reading.called()));
}

SettingValue threshold_of(const Query& query) {
    return query.radon && query.radon->to == To::hough ? SettingValue(query.radon->threshold)
                                                       : SettingValue();
}

}  // namespace

void expect_whole_radon(const Query& query, const std::vector<Given>& given) {
    if (query.radon->to == To::image) return;
    if (!value_in(given, "angles"))
        throw RequestError(
            message("@angles: how many? Expected a number from 1 to {}, or degrees as 0,30,60",
                    kMostAngles));
    const bool votes = query.radon->to == To::hough, level = value_in(given, "threshold");
    if (votes && !level)
        throw RequestError(
            message("@threshold: from which value on does a sample vote? Expected T"));
    if (!votes && level) throw RequestError(message("@threshold: of @to(hough) only"));
}

Rows radon_settings() {
    static const std::vector<QuerySetting> rows = grouped(
        "",
        {{"angles", "N|A,B,...",
          "rows: angles k 180/N degrees, k from 0 to N - 1; or these degrees, as 0,30,60",
          has::radon,
          reads::with_limits(Limits::between(1, kMostAngles), {take_angles, angles_of})},
         {"inverse",
          "",
          "FILE is a sinogram: the image of it, by filtered backprojection",
          has::radon,
          {take_inverse,
           [](const Query& query) {
               return SettingValue(query.radon && query.radon->to == To::image);
           },
           Reader::Kind::flag}},
         QuerySetting{
             "size", "WxH|N",
             message("@inverse: samples of the image; default: a square that has as many offsets"),
             has::radon,
             reads::with_limits(Limits::between(1, double(kMostSide)),
                                {take_size_of_image, size_of_image})}
             .along_axes(),
         {"to", "sinogram|hough",
          "sinogram: integrals along lines (default); hough: how many samples lie nearest to each",
          has::radon, reads::with_limits(Limits::words(to_words()), {take_to, to_of})},
         {"threshold",
          "T",
          "hough: samples of at least T vote",
          has::radon,
          {take_threshold, threshold_of}},
         QuerySetting{"window", "LO,HI",
                      "what is black and white, values or percentiles; HI,LO inverts", has::radon,
                      reads::window()}
             .of_output()});
    return rows;
}

}  // namespace edgewise
