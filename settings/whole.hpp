#pragma once

#include <string_view>
#include <vector>

#include "settings/setting.hpp"

namespace edgewise {

/// The last value that is given for a setting, or null.
const SettingValue* value_in(const std::vector<Given>& given, std::string_view name);

/// What these jobs need to be given. @throws RequestError
void expect_whole_filter(const Query& query, const std::vector<Given>& given);
void expect_whole_radon(const Query& query, const std::vector<Given>& given);

}  // namespace edgewise
