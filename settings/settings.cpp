#include "settings/settings.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <ranges>

#include "graph/words.hpp"
#include "settings/jobs.hpp"
#include "settings/whole.hpp"

namespace edgewise {
namespace {

using Kind = Reader::Kind;

bool is_first(const QuerySetting& row) {
    return row.kind() == Kind::flag || row.kind() == Kind::bare;
}

/// @throws SettingError
const QuerySetting& known(std::string_view name, Job job) {
    if (const QuerySetting* row = setting_named(name, job)) return *row;
    for (const QuerySetting* row : settings())
        if (row->name.name == name)
            throw SettingError(
                message("{} means nothing for {}", setting(row->name), name_of(job)));
    std::vector<std::string> names;
    for (const QuerySetting* row : settings_of(job)) names.emplace_back(row->name.name);
    throw SettingError(
        message("there is no setting '{}' of {}; {}", name, name_of(job), instead_of(name, names)));
}

/// Values that are given for one setting, together.
void add(SettingValue& gathered, const SettingValue& more) {
    SettingValue::List all = gathered.none() ? SettingValue::List() : gathered.values();
    std::ranges::copy(more.values(), std::back_inserter(all));
    gathered = SettingValue(std::move(all));
}

}  // namespace

std::string QuerySetting::typed() const {
    std::string word(option.empty() ? name.name : option);
    std::replace(word.begin(), word.end(), '_', '-');
    return (word.size() == 1 ? "-" : "--") + word;
}

void QuerySetting::take(Query& query, const SettingValue& given, const Reading& reading) const {
    try {
        reads.take(query, given, reading);
    } catch (const SettingError&) {
        throw;  // no value of its kind
    } catch (const OutOfLimits&) {
        throw;
    } catch (const RequestError& wrong) {
        if (limits().none() || wrong.field() != name.name) throw;
        throw OutOfLimits(wrong.message(), limits());
    }
}

QuerySetting QuerySetting::typed_as(std::string_view word) const {
    QuerySetting row = *this;
    row.option = word;
    return row;
}

QuerySetting QuerySetting::of_output() const {
    QuerySetting row = *this;
    row.acts = Acts::output;
    return row;
}

QuerySetting QuerySetting::along_axes() const {
    QuerySetting row = *this;
    row.per_axis = true;
    return row;
}

std::vector<QuerySetting> grouped(const char* group, std::vector<QuerySetting> rows) {
    for (QuerySetting& row : rows) row.group = group;
    return rows;
}

std::vector<QuerySetting> grouped(const char* group, std::vector<QuerySetting> rows,
                                  QuerySetting::Acts acts) {
    for (QuerySetting& row : rows) row.acts = acts;
    return grouped(group, std::move(rows));
}

const SettingValue* Reading::other(std::string_view setting) const {
    return all ? value_in(*all, setting) : nullptr;
}

const SettingValue* value_in(const std::vector<Given>& given, std::string_view name) {
    const auto last = std::find_if(given.rbegin(), given.rend(),
                                   [&](const Given& one) { return one.name == name; });
    return last == given.rend() ? nullptr : &last->value;
}

const std::vector<const QuerySetting*>& settings() {
    static const std::vector<const QuerySetting*> all = [] {
        std::vector<const QuerySetting*> rows;
        for (const Rows subject :
             {selection_settings(), geometry_settings(), clip_settings(), light_settings(),
              look_settings(), filter_settings(), radon_settings(), surface_settings(),
              budget_settings(), output_settings()})
            for (const QuerySetting& row : subject) rows.push_back(&row);
        return rows;
    }();
    return all;
}

std::vector<const QuerySetting*> settings_of(Job job) {
    std::vector<const QuerySetting*> rows;
    std::ranges::copy_if(settings(), std::back_inserter(rows),
                         [&](const QuerySetting* row) { return row->of(job); });
    return rows;
}

const QuerySetting* setting_named(std::string_view name, Job job) {
    const auto found = std::ranges::find_if(settings(), [&](const QuerySetting* row) {
        return row->name.name == name && row->of(job);
    });
    return found == settings().end() ? nullptr : *found;
}

Query query_for(Job job) {
    Query query;
    query.job = job;
    if (has::filter(job)) query.filter.emplace();
    if (has::radon(job)) query.radon.emplace();
    return query;
}

Query query_of(Job job, const std::vector<Given>& given, const Catalogue& edges) {
    Query query = query_for(job);
    std::map<const QuerySetting*, SettingValue> values;
    std::vector<std::pair<const QuerySetting*, const SettingValue*>> steps;
    for (const Given& one : given) {
        const QuerySetting& row = known(one.name, job);
        if (row.kind() == Kind::step)
            steps.emplace_back(&row, &one.value);
        else if (row.kind() == Kind::list)
            add(values[&row], one.value);
        else
            values[&row] = one.value;
    }
    const auto take = [&](const QuerySetting& row, const SettingValue& value) {
        row.take(query, value, {row.name, edges, &given});
    };
    // What a value means may hang on a flag.
    for (const bool first : {true, false})
        for (const QuerySetting* row : settings())
            if (const auto found = values.find(row);
                found != values.end() && is_first(*row) == first)
                take(*row, found->second);
    for (const auto& [row, value] : steps) take(*row, *value);
    if (has::filter(job)) expect_whole_filter(query, given);
    if (has::radon(job)) expect_whole_radon(query, given);
    return query;
}

void set(Query& query, std::string_view name, const SettingValue& value, const Catalogue& edges) {
    const QuerySetting& row = known(name, query.job);
    row.take(query, value, {row.name, edges});
}

void expect_limits(const Query& query, const Catalogue& edges) {
    const Query nothing = query_for(query.job);
    for (const QuerySetting* row : settings_of(query.job)) {
        if (row->limits().none()) continue;
        const SettingValue value = row->reads.tell(query);
        if (value.none() || value == row->reads.tell(nothing)) continue;
        Query copy = query;
        row->take(copy, value, {row->name, edges});
    }
}

}  // namespace edgewise
