#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/audit/audit.hpp"

namespace edgewise::cli {

/// One request of the file of an audit.
struct AuditRequest {
    std::vector<std::string> args;  // as on the command line
    std::string name;
    bool held_out = false;  // no fit has seen its like
};

/// One request of an audit: what came out, or why nothing did.
struct AuditedRequest : Audited {
    AuditRequest asked;
    int code = 0;  // of its failure
    std::string message;
};

nlohmann::ordered_json audit_entry(const AuditedRequest& request);
nlohmann::ordered_json audit_summary(const std::vector<AuditedRequest>& requests);

}  // namespace edgewise::cli
