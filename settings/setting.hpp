#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "graph/message.hpp"
#include "graph/transition.hpp"
#include "request/errors.hpp"
#include "request/query.hpp"
#include "settings/value.hpp"

namespace edgewise {

/// A value for a setting.
struct Given {
    std::string name;
    SettingValue value;
};

/// What a value is read with beside the query.
struct Reading {
    SettingName name;
    const Catalogue& edges;
    /// Everything that is set of the query together; null: this setting is set by itself.
    const std::vector<Given>* all = nullptr;

    /// What messages call the setting.
    Message called(std::string_view value = {}) const { return setting(name, value); }
    /// The value of another setting that is set together with this one; null: none is.
    const SettingValue* other(std::string_view setting) const;
};

/// How a setting gets into a query, and out of it again.
struct Reader {
    enum class Kind {
        value,
        flag,  // true or false; a text that is empty is true
        bare,  // a value that may be left out
        list,  // of values, each typed for itself
        step   // of the geometry, which apply in the order given
    };
    /// @throws RequestError
    std::function<void(Query&, const SettingValue&, const Reading&)> take;
    /// What take() would make the same of; nothing where nobody set it. Steps tell nothing.
    std::function<SettingValue(const Query&)> tell = [](const Query&) { return SettingValue(); };
    Kind kind = Kind::value;
    /// Numbers and words that it takes, where they have limits: errors of the setting tell them.
    Limits limits = {};
};

/// A text that may depend on the job.
class OfJob {
 public:
    OfJob(const char* text) : text_([text](Job) { return Message(text); }) {}  // NOLINT
    OfJob(Message text)                                                        // NOLINT
        : text_([text = std::move(text)](Job) { return text; }) {}
    OfJob(Message (*text)(Job)) : text_(text) {}  // NOLINT

    Message operator()(Job job) const { return text_(job); }

 private:
    std::function<Message(Job)> text_;
};

/// A field of a query and all that is said of it: the command's option and its help, the keyword of
/// Python and the key of JSON are made of this row.
struct QuerySetting {
    /// On what it acts: which samples of the input are meant, the result, or only what is written
    /// and reported of it.
    enum class Acts { input, result, output };

    SettingName name;           // the field: "max_error"
    OfJob value = "";           // what stands for a value in the help: "E"
    OfJob help = "";            // in the help
    bool (*of)(Job) = nullptr;  // whether a job has it
    Reader reads = {};
    const char* group = "";        // of the help
    std::string_view option = {};  // the command's name without dashes, where it is another one
    Acts acts = Acts::result;
    bool per_axis = false;  // its numbers belong to the axes x, y and z, in this order

    Reader::Kind kind() const noexcept { return reads.kind; }
    const Limits& limits() const noexcept { return reads.limits; }
    /// Reads a value. @throws SettingError; OutOfLimits where the setting has limits, else
    /// RequestError
    void take(Query& query, const SettingValue& given, const Reading& reading) const;
    /// "--max-error", "-o"
    std::string typed() const;

    /// The same, with one of the last three.
    QuerySetting typed_as(std::string_view word) const;
    QuerySetting of_output() const;
    QuerySetting along_axes() const;
};
/// Rows that stand together in the help.
std::vector<QuerySetting> grouped(const char* group, std::vector<QuerySetting> rows);
std::vector<QuerySetting> grouped(const char* group, std::vector<QuerySetting> rows,
                                  QuerySetting::Acts acts);

/// The rows of one subject, in the order of the help. One name stands in several rows where jobs
/// mean different things by it; of a job it stands in one.
using Rows = std::span<const QuerySetting>;
Rows selection_settings();
Rows geometry_settings();
Rows clip_settings();
Rows light_settings();
Rows look_settings();
Rows filter_settings();
Rows radon_settings();
Rows surface_settings();
Rows budget_settings();
Rows output_settings();

}  // namespace edgewise
