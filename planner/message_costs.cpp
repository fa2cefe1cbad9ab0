#include "planner/message_costs.hpp"

#include <nlohmann/json.hpp>

#include "planner/json_fields.hpp"

namespace edgewise {

double message_seconds(const MessageCosts& costs, const MessageCost& below, double messages,
                       double sent) noexcept {
    const MessageCost* holds = &below;
    for (const MessageCost& cost : costs)
        if (messages > 0 && sent >= messages * cost.bytes) holds = &cost;
    return messages * holds->latency + sent * holds->byte;
}

nlohmann::json to_json(const MessageCosts& costs) {
    nlohmann::json json = nlohmann::json::array();
    for (const MessageCost& cost : costs)
        json.push_back({{"bytes", cost.bytes}, {"latency", cost.latency}, {"byte", cost.byte}});
    return json;
}

MessageCosts message_costs_of(const nlohmann::json& json, const std::string& file) {
    const JsonFields fields(file);
    if (!json.is_array()) fields.reject("messages", "expected a list");
    MessageCosts costs;
    for (const nlohmann::json& each : json) {
        const std::string where = fmt::format("messages.{}", costs.size());
        if (!each.is_object()) fields.reject(where, "expected an object");
        const auto number = [&](const char* key, double high) {
            return fields.number(each.value(key, nlohmann::json()), where + "." + key, 0, high);
        };
        const MessageCost cost{.bytes = number("bytes", 1e18),
                               .latency = number("latency", 1),
                               .byte = number("byte", 1)};
        if (!costs.empty() && !(cost.bytes > costs.back().bytes))
            fields.reject(where + ".bytes", "expected more than the one before has");
        costs.push_back(cost);
    }
    return costs;
}

}  // namespace edgewise
