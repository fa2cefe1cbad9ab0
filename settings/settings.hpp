#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "settings/setting.hpp"

namespace edgewise {

/// Everything that can be set of a query, each once: a new option is a field of Query and a row
/// here.
const std::vector<const QuerySetting*>& settings();
/// Those of a job, in the order of its help.
std::vector<const QuerySetting*> settings_of(Job job);
/// Null: the job has none of this name.
const QuerySetting* setting_named(std::string_view name, Job job);

/// A query of a job in which nothing is set.
Query query_for(Job job);
/// A query in which all of this is set. Of one setting the last value counts; lists are gathered,
/// and steps of the geometry apply in the order given.
/// @throws SettingError; RequestError for values that make no sense, alone or together
Query query_of(Job job, const std::vector<Given>& given, const Catalogue& edges);
/// Sets one of them. A value may mean something else with one of the flags, so these go first;
/// modes and operations go before what they take. A step is added to those that are there, all
/// else replaces what was.
/// @throws SettingError, RequestError
void set(Query& query, std::string_view name, const SettingValue& value, const Catalogue& edges);

/// Of a query that a program filled in field by field: each value that has limits is within them.
/// @throws OutOfLimits, SettingError
void expect_limits(const Query& query, const Catalogue& edges);

}  // namespace edgewise
