#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace edgewise {

/// What messages cost from one size on. Networks send short and long ones by different protocols
/// (eager, rendezvous, in packets), so seconds by size have break points.
struct MessageCost {
    double bytes = 0;    // of the shortest message that this holds for
    double latency = 0;  // [s] once a message
    double byte = 0;     // [s/byte]
};

/// Sorted by size.
using MessageCosts = std::vector<MessageCost>;

/// Seconds of so many messages of one size, one after another.
/// @param below  for messages shorter than all in the list; its `bytes` do not matter
double message_seconds(const MessageCosts& costs, const MessageCost& below, double messages,
                       double sent) noexcept;

nlohmann::json to_json(const MessageCosts& costs);
/// @throws InputError naming the field; `file` is what messages call the text
MessageCosts message_costs_of(const nlohmann::json& json, const std::string& file);

}  // namespace edgewise
