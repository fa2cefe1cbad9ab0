#include "charts/program.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <stdexcept>
#include <string_view>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace edgewise::charts {
namespace {

enum class Way { in, out };

/// A pipe whose ends close themselves. Both close in a program that is started, unless it is given
/// them.
struct Pipe {
    explicit Pipe(Way way) {
        // What leads in is a socket: writing to a program that has ended is no signal there.
        const int failed = way == Way::in ? socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends)
                                          : pipe2(ends, O_CLOEXEC);
        if (failed) throw std::runtime_error("no pipe to another program");
    }
    ~Pipe() {
        close_end(0);
        close_end(1);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;
    void close_end(int which) {
        if (ends[which] >= 0) close(ends[which]);
        ends[which] = -1;
    }

    int ends[2] = {-1, -1};  // read, write
};

pid_t start(const std::vector<std::string>& words, Pipe& in, Pipe& out, Pipe& errors) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in.ends[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out.ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, errors.ends[1], STDERR_FILENO);
    std::vector<char*> argv;
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    pid_t child = 0;
    const int failed = posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failed) throw std::runtime_error(fmt::format("{}: {}", words[0], std::strerror(failed)));
    return child;
}

/// Writes and reads side by side: a program that answers before it has read all would else wait for
/// us while we wait for it.
void talk(Pipe& in, std::string_view input, Pipe& out, std::string& answer, Pipe& errors,
          std::string& complaint) {
    char block[1 << 14];
    while (out.ends[0] >= 0 || errors.ends[0] >= 0) {
        pollfd waits[] = {
            {in.ends[1], POLLOUT, 0}, {out.ends[0], POLLIN, 0}, {errors.ends[0], POLLIN, 0}};
        if (::poll(waits, 3, -1) < 0) {
            if (errno == EINTR) continue;
            throw std::runtime_error("waiting for another program failed");
        }
        if (waits[0].revents) {
            const ssize_t wrote =
                send(in.ends[1], input.data(), input.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
            if (wrote > 0) input.remove_prefix(static_cast<std::size_t>(wrote));
            const bool again = wrote < 0 && (errno == EAGAIN || errno == EINTR);
            if ((wrote <= 0 && !again) || input.empty()) in.close_end(1);
        }
        const auto take = [&](const pollfd& wait, Pipe& from, std::string& into) {
            if (!wait.revents) return;
            const ssize_t got = read(from.ends[0], block, sizeof block);
            if (got > 0) into.append(block, static_cast<std::size_t>(got));
            if (got == 0 || (got < 0 && errno != EINTR)) from.close_end(0);
        };
        take(waits[1], out, answer);
        take(waits[2], errors, complaint);
    }
}

}  // namespace

std::string output_of(const std::vector<std::string>& words, const std::string& input) {
    Pipe in(Way::in), out(Way::out), errors(Way::out);
    const pid_t child = start(words, in, out, errors);
    in.close_end(0);
    out.close_end(1);
    errors.close_end(1);
    std::string answer, complaint;
    talk(in, input, out, answer, errors, complaint);
    in.close_end(1);
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw std::runtime_error(fmt::format("{} failed: {}", words[0], complaint.substr(0, 500)));
    return answer;
}

}  // namespace edgewise::charts
