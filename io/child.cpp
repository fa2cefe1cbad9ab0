#include "io/child.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

#include "graph/errors.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr int kPause = 50;                         // [ms] until the flag is looked at again
constexpr std::size_t kMostComplaint = 16 * 1024;  // bytes that are kept

void close_once(int& descriptor) noexcept {
    if (descriptor >= 0) ::close(descriptor);
    descriptor = -1;
}

/// Two ends of one connection, closed unless they are taken.
struct Ends {
    int ours = -1, its = -1;

    Ends() {
        int both[2];
        // Not a pipe: writing into one that nobody reads any more ends a process by a signal.
        if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, both) != 0) return;
        ours = both[0], its = both[1];
        ::fcntl(ours, F_SETFL, O_NONBLOCK);
    }
    Ends(const Ends&) = delete;
    Ends& operator=(const Ends&) = delete;
    ~Ends() {
        close_once(ours);
        close_once(its);
    }
    int take() noexcept { return std::exchange(ours, -1); }
};

/// In the copy of this process: becomes the program. Other threads are not there and may hold any
/// lock, so nothing is allocated.
[[noreturn]] void become(char* const* words, int input, int said) noexcept {
    ::setpgid(0, 0);
    rlimit limit{};  // a fence around this process's memory is not the program's
    if (::getrlimit(RLIMIT_DATA, &limit) == 0) {
        limit.rlim_cur = limit.rlim_max;
        ::setrlimit(RLIMIT_DATA, &limit);
    }
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) ::signal(number, SIG_DFL);
    sigset_t none;
    ::sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    // Above the three that they become.
    input = ::fcntl(input, F_DUPFD, 3);
    said = ::fcntl(said, F_DUPFD, 3);
    const int nowhere = ::fcntl(::open("/dev/null", O_WRONLY | O_CLOEXEC), F_DUPFD, 3);
    if (input >= 0 && said >= 0 && nowhere >= 0 && ::dup2(input, STDIN_FILENO) >= 0 &&
        ::dup2(nowhere, STDOUT_FILENO) >= 0 && ::dup2(said, STDERR_FILENO) >= 0) {
        for (const int done : {input, said, nowhere}) ::close(done);
        ::execv(words[0], words);
    }
    constexpr char kNot[] = "it cannot be started";
    [[maybe_unused]] const ssize_t told = ::write(STDERR_FILENO, kNot, sizeof(kNot) - 1);
    ::_exit(127);
}

/// The last line that says something.
std::string last_line(const std::string& text) {
    std::string_view rest = trim(text);
    if (const auto at = rest.find_last_of("\n\r"); at != rest.npos) rest.remove_prefix(at + 1);
    return std::string(trim(rest));
}

}  // namespace

Child::Child(const std::vector<std::string>& words, std::string about,
             const std::atomic<bool>* stop)
    : about_(std::move(about)), stop_(stop) {
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    Ends input, said;
    if (input.ours < 0 || said.ours < 0)
        throw RunError(fmt::format("{}: {}", about_, std::strerror(errno)));
    child_ = ::fork();
    if (child_ < 0) throw RunError(fmt::format("{}: {}", about_, std::strerror(errno)));
    if (child_ == 0) become(arguments.data(), input.its, said.its);
    // Of both processes whoever comes first: else it could not be ended together with its own.
    ::setpgid(child_, child_);
    to_ = input.take();
    said_ = said.take();
}

Child::~Child() {
    if (child_ > 0) {
        ::kill(-child_, SIGKILL);
        ::kill(child_, SIGKILL);
        has_ended(true);
    }
    hang_up();
    close_once(said_);
}

void Child::hang_up() noexcept { close_once(to_); }

void Child::poll_stop() const {
    if (stop_ && *stop_) throw Cancelled();
}

/// Takes what it says, so that it does not wait for somebody to listen.
void Child::hear() {
    char part[4096];
    while (said_ >= 0) {
        const ssize_t got = ::read(said_, part, sizeof(part));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
        if (got <= 0) return close_once(said_);
        complaint_.append(part, static_cast<std::size_t>(got));
        if (complaint_.size() > kMostComplaint)
            complaint_.erase(0, complaint_.size() - kMostComplaint);
    }
}

bool Child::has_ended(bool waits) noexcept {
    while (child_ > 0) {
        const pid_t done = ::waitpid(child_, &status_, waits ? 0 : WNOHANG);
        if (done < 0 && errno == EINTR) continue;
        if (done == 0) return false;
        // Where this process has said that nobody waits for its children, none tells how it ended.
        if (done < 0) status_ = 0;
        child_ = -1;
    }
    return true;
}

void Child::write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        poll_stop();
        pollfd both[] = {{to_, POLLOUT, 0}, {said_, POLLIN, 0}};
        if (::poll(both, 2, kPause) < 0 && errno != EINTR) fail();
        if (both[1].revents != 0) hear();
        if (both[0].revents == 0) continue;
        const ssize_t done = ::send(to_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (done < 0 && (errno == EAGAIN || errno == EINTR)) continue;
        if (done < 0) fail();
        bytes = bytes.subspan(static_cast<std::size_t>(done));
    }
}

/// It reads no more.
void Child::fail() {
    hang_up();
    finish();
    throw RunError(about_ + " ended before it had read all pictures");
}

void Child::finish() {
    hang_up();
    while (said_ >= 0) {
        poll_stop();
        pollfd one{said_, POLLIN, 0};
        if (::poll(&one, 1, kPause) > 0) hear();
        if (has_ended(false)) {
            hear();
            break;
        }
    }
    while (!has_ended(false)) {
        poll_stop();
        ::poll(nullptr, 0, 5);
    }
    if (WIFEXITED(status_) && WEXITSTATUS(status_) == 0) return;
    const std::string how = WIFSIGNALED(status_)
                                ? fmt::format("ended by signal {}", WTERMSIG(status_))
                                : fmt::format("failed with {}", WEXITSTATUS(status_));
    const std::string why = last_line(complaint_);
    throw RunError(fmt::format("{} {}{}", about_, how, why.empty() ? "" : ": " + shown(why)));
}

}  // namespace edgewise::store
