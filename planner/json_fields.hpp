#pragma once

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <string>

#include "graph/errors.hpp"

namespace edgewise {

/// Reads fields of a profile, and says which one is wrong.
class JsonFields {
 public:
    explicit JsonFields(std::string file) : file_(std::move(file)) {}

    /// @throws InputError always
    [[noreturn]] void reject(const std::string& field, const std::string& why) const {
        throw InputError("machine profile " + file_ + ": " + field + ": " + why);
    }
    /// A JSON object.
    nlohmann::json parsed(const std::string& text) const {
        try {
            const nlohmann::json json = nlohmann::json::parse(text);
            if (json.is_object()) return json;
        } catch (const nlohmann::json::exception& error) {
            reject("(whole file)", std::string("not JSON: ") + error.what());
        }
        reject("(whole file)", "not a JSON object: {...}");
    }
    double number(const nlohmann::json& json, const std::string& field, double low,
                  double high) const {
        if (!json.is_number())
            reject(field, fmt::format("is {}, expected a number from {:g} to {:g}", json.dump(),
                                      low, high));
        const double value = json.get<double>();
        if (!(value >= low && value <= high))
            reject(field, fmt::format("is {:g}, expected {:g} to {:g}", value, low, high));
        return value;
    }
    std::string text(const nlohmann::json& json, const std::string& field) const {
        if (!json.is_string())
            reject(field, fmt::format("is {}, expected text in quotes", json.dump()));
        return json.get<std::string>();
    }

 private:
    std::string file_;
};

}  // namespace edgewise
