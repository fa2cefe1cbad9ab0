#include "planner/profile.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "graph/errors.hpp"

namespace edgewise {
namespace {

struct Field {
    const char* name;
    double Profile::*member;
    double low, high;
};

constexpr Field kFields[] = {
    {"operation", &Profile::operation, 0, 1}, {"streamed", &Profile::streamed, 0, 1},
    {"gather", &Profile::gather, 0, 1},       {"local", &Profile::local, 0, 1},
    {"global", &Profile::global, 0, 1},       {"start", &Profile::start, 0, 1},
    {"serial", &Profile::serial, 0, 1},
};

/// What `edgewise calibrate` measured on one core of a server with AVX-512, rounded.
const std::map<std::string, double> kDefaultFactors = {
    {"filter.prefilter", 0.7},
    {"project.combine", 1.2},
    {"project.ray_cast", 1.5},
    {"project.ray_cast/filter=bspline3", 1.2},
    {"project.ray_cast/filter=foh", 1.1},
    {"project.ray_cast/filter=zoh", 2.4},
    {"project.shear_warp", 1.4},
    {"project.shear_warp/filter=foh", 1.3},
    {"project.shear_warp/filter=zoh", 1.4},
    {"spectrum.forward", 1.4},
    {"spectrum.inverse", 5},
    {"spectrum.slice", 1.2},
    {"spectrum.slice/band=picture", 1.1},
    {"store.precision", 4},
    {"warp.axis_permutation", 1},
    {"warp.backward", 0.9},
    {"warp.backward/filter=bspline3", 0.55},
    {"warp.backward/filter=zoh", 1.3},
    {"warp.permutation", 1.2},
    {"warp.shear", 1.6},
};

[[noreturn]] void reject(const std::string& file, const std::string& field,
                         const std::string& why) {
    throw InputError("machine profile " + file + ": " + field + ": " + why);
}

double number_in(const nlohmann::json& json, const std::string& file, const std::string& field,
                 double low, double high) {
    if (!json.is_number()) reject(file, field, "expected a number");
    const double value = json.get<double>();
    if (!(value >= low && value <= high))
        reject(file, field,
               "is " + std::to_string(value) + ", expected " + std::to_string(low) + " to " +
                   std::to_string(high));
    return value;
}

}  // namespace

double Profile::counted(const Work& work) const noexcept {
    return work.operations * operation + work.streamed * streamed + work.gathers * gather +
           work.local * local + work.global * global;
}

double Profile::factor(const std::string& edge) const {
    for (std::string known = edge;; known.resize(known.rfind('/'))) {
        const auto found = factors.find(known);
        if (found != factors.end()) return found->second;
        if (known.find('/') == std::string::npos) return 1;
    }
}

double Profile::seconds(const std::string& edge, const Work& work, int threads) const {
    const int sharing = std::max(1, threads);
    return start + counted(work) * factor(edge) * (serial + (1 - serial) / sharing);
}

Profile default_profile() {
    Profile profile;
    profile.factors = kDefaultFactors;
    profile.processors = std::max(1u, std::thread::hardware_concurrency());
    return profile;
}

Profile load_profile(const std::string& file) {
    std::ifstream stream(file);
    if (!stream) throw InputError("machine profile " + file + ": cannot be opened");
    const nlohmann::json json = nlohmann::json::parse(stream, nullptr, false);
    if (!json.is_object()) reject(file, "(whole file)", "not a JSON object");
    if (json.value("schema", nlohmann::json()) != 1) reject(file, "schema", "expected 1");
    Profile profile;
    const auto word = [&](const char* field) {
        const nlohmann::json value = json.value(field, nlohmann::json(""));
        if (!value.is_string()) reject(file, field, "expected text");
        return value.get<std::string>();
    };
    profile.name = word("name");
    profile.cpu = word("cpu");
    for (const Field& field : kFields)
        if (json.contains(field.name))
            profile.*field.member =
                number_in(json[field.name], file, field.name, field.low, field.high);
    if (json.contains("processors"))
        profile.processors =
            static_cast<int>(number_in(json["processors"], file, "processors", 1, 1 << 20));
    const nlohmann::json factors = json.value("factors", nlohmann::json::object());
    if (!factors.is_object()) reject(file, "factors", "expected an object");
    for (const auto& [edge, value] : factors.items())
        profile.factors[edge] = number_in(value, file, "factors." + edge, 1e-6, 1e6);
    return profile;
}

nlohmann::json to_json(const Profile& profile) {
    nlohmann::json json = {{"schema", 1},
                           {"name", profile.name},
                           {"cpu", profile.cpu},
                           {"processors", profile.processors},
                           {"factors", profile.factors}};
    for (const Field& field : kFields) json[field.name] = profile.*field.member;
    return json;
}

}  // namespace edgewise
