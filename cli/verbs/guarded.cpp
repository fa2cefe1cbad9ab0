#include <cstdio>
#include <fmt/format.h>
#include <new>
#include <nlohmann/json.hpp>

#include "cli/request/errors.hpp"
#include "cli/request/spoken.hpp"
#include "cli/session/report.hpp"
#include "cli/signals/signals.hpp"
#include "cli/verbs/verbs.hpp"
#include "graph/errors.hpp"
#include "request/outputs.hpp"

namespace edgewise::cli {
namespace {

struct Ending {
    int code = kFailed;
    std::string message;
};

/// What the exception in flight means.
Ending ending_of_current() {
    try {
        throw;
    } catch (const Cancelled&) {
        return {signal_exit_code() ? signal_exit_code() : kFailed, "interrupted"};
    } catch (const RequestError& error) {
        return {kBadRequest, spoken(error.message())};
    } catch (const NoPlan& error) {
        return {kNoPlan, spoken(error.message())};
    } catch (const InputError& error) {
        return {kBadInput, spoken(error.message())};
    } catch (const std::bad_alloc&) {
        return {kFailed,
                "out of memory, and there is no other plan; --max-memory bounds what a "
                "plan may take"};
    } catch (const Exception& error) {
        return {kFailed, spoken(error.message())};
    } catch (const std::exception& error) {
        return {kFailed, error.what()};
    }
}

}  // namespace

int ending_of(const std::function<void()>& body, std::string& message) {
    try {
        body();
        return kDone;
    } catch (...) {
        const Ending ending = ending_of_current();
        message = ending.message;
        return ending.code;
    }
}

int guarded(const std::function<int()>& body,
            const std::function<void(int, const std::string&)>& failed) {
    Ending ending;
    try {
        return body();
    } catch (...) {
        ending = ending_of_current();
    }
    try {
        failed(ending.code, ending.message);
    } catch (const Exception& error) {
        fmt::print(stderr, "edgewise: {}\n", spoken(error.message()));
    } catch (const std::exception& error) {
        fmt::print(stderr, "edgewise: {}\n", error.what());
    }
    fmt::print(stderr, "edgewise: {}\n", ending.message);
    return ending.code;
}

int guarded_with_json(const std::optional<std::string>& json, const std::function<int()>& body) {
    return guarded(body, [&](int code, const std::string& message) {
        if (json) write_text(*json, text_of(failure_of(code, message)));
    });
}

}  // namespace edgewise::cli
