#include "cli/request/messages.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fmt/format.h>
#include <unistd.h>

#include "cli/request/spoken.hpp"
#include "cli/request/told_once.hpp"
#include "cli/request/user_folders.hpp"
#include "cli/signals/signals.hpp"
#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise::cli {
namespace {

constexpr int kBarWidth = 30;
constexpr std::chrono::milliseconds kBarPause{100};

template <std::size_t N>
int index_of(const char* option, const std::string& word, const char* const (&names)[N]) {
    for (std::size_t i = 0; i < N; ++i)
        if (same_word(word, names[i])) return static_cast<int>(i);
    throw RequestError(fmt::format("{}: '{}' is not known; {}", option, word,
                                   instead_of(word, {std::begin(names), std::end(names)})));
}

}  // namespace

void Messages::configure(const std::string& log, const std::string& progress, bool quiet) {
    constexpr const char* kLogs[] = {"error", "warning", "info", "debug"};
    constexpr const char* kProgress[] = {"auto", "always", "never"};
    log_ = static_cast<Log>(index_of("--log", log, kLogs));
    progress_ = static_cast<Progress>(index_of("--progress", progress, kProgress));
    quiet_ = quiet;
    if (quiet) log_ = Log::error;
}

void Messages::say(const char* kind, const std::string& text) {
    end_progress();
    fmt::print(stderr, "edgewise: {}{}\n", kind, text);
}

void Messages::on_warning(const Message& text) {
    if (log_ >= Log::warning) say("warning: ", spoken(text));
}

void Messages::file_warnings(const Input& file, const std::vector<Message>& found) {
    if (log_ != Log::warning) return Listener::file_warnings(file, found);
    if (found.empty()) return;
    const std::string folder = cache_folder();
    const auto sorted = ToldOnce(folder.empty() ? folder : folder + "/told").sort(file, found);
    for (const Message& text : sorted.told) counts(text);
    for (const Message& text : sorted.untold) warning(text);
    if (sorted.first)
        notice(message("later commands leave out what is said of {}; `@command(info)` lists it",
                       file.name));
}

bool Messages::shows_bar() const noexcept {
    if (quiet_ || progress_ == Progress::never) return false;
    return progress_ == Progress::always || isatty(STDERR_FILENO);
}

void Messages::progress(double share, const std::string& step) {
    if (!shows_bar()) return;
    const auto now = std::chrono::steady_clock::now();
    if (share < 1 && now - drawn_ < kBarPause) return;
    drawn_ = now;
    const int full = static_cast<int>(std::clamp(share, 0.0, 1.0) * kBarWidth);
    fmt::print(stderr, "\r[{:<{}}] {:3.0f} % {:<32.32}", std::string(full, '='), kBarWidth,
               share * 100, step);
    std::fflush(stderr);
    bar_ = true;
}

void Messages::step_done(const std::string& step, double seconds) {
    if (quiet_ || progress_ == Progress::never || shows_bar()) return;
    fmt::print(stderr, "edgewise: {}: {:.3g} s\n", step, seconds);
}

void Messages::step_begun(const std::string& step) {
    if (quiet_ || progress_ == Progress::never) return;
    fmt::print(stderr, "edgewise: {} ...\n", step);
}

void Messages::result(const std::string& text) {
    if (log_ > Log::error) say("", text);
}

void Messages::notice(const Message& text) {
    if (log_ >= Log::warning) say("", spoken(text));
}

void Messages::end_progress() {
    if (!bar_) return;
    bar_ = false;
    fmt::print(stderr, "\r{:78}\r", "");
}

const std::atomic<bool>& Messages::stop() const noexcept { return stop_flag(); }

void Messages::memory_opened(double bytes) { fence_memory(bytes); }

void Messages::begins(State state) {
    if (state == State::planning && announces_)
        planning_ = std::make_unique<Announced>(*this, "planning");
    if (state == State::unobserved) begin_unobserved();
    if (state == State::collecting) begin_collecting();
}

void Messages::ends(State state) {
    if (state == State::planning) planning_.reset();
    if (state == State::unobserved) end_unobserved();
    if (state == State::collecting) end_collecting();
}

bool colourful() {
    const char* no_color = std::getenv("NO_COLOR");
    return isatty(STDOUT_FILENO) && !(no_color && *no_color);
}

}  // namespace edgewise::cli
