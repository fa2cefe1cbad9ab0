#include "io/apart.hpp"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <new>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <type_traits>
#include <unistd.h>

namespace edgewise::store {
namespace {

/// Memory of this process and of its copy.
class Shared {
 public:
    explicit Shared(std::size_t bytes)
        : size_(bytes),
          data_(::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {
        if (data_ == MAP_FAILED) throw std::bad_alloc();
    }
    Shared(const Shared&) = delete;
    Shared& operator=(const Shared&) = delete;
    ~Shared() { ::munmap(data_, size_); }
    std::byte* data() const { return static_cast<std::byte*>(data_); }

 private:
    std::size_t size_;
    void* data_;
};

void limit(decltype(RLIMIT_AS) what, rlim_t most) {
    const rlimit both{most, most};
    ::setrlimit(what, &both);
}

/// Address space in use, which a limit counts too.
std::size_t memory_in_use() {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    return pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

void set_limits(const Allowance& allowance, std::size_t in_use) {
    // Signals to end are for the process that waits; it must not take them for damaged data.
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) ::signal(number, SIG_IGN);
    for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGXCPU, SIGALRM})
        ::signal(number, SIG_DFL);
    sigset_t none;
    ::sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_CPU, allowance.seconds);
    ::alarm(20 * allowance.seconds);  // a lock that nobody releases takes no time of the processor
    if (allowance.memory > 0) limit(RLIMIT_AS, in_use + allowance.memory);
    // What libraries print about their own failures.
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
}

}  // namespace

std::mutex& at_work() {
    static std::mutex mutex;
    return mutex;
}

Apart apart(const ModuleImage& image, std::span<std::byte> into, const Allowance& allowance,
            const std::function<bool(ModuleImage&, void* into, char* error)>& call) {
    constexpr std::size_t kPage = 4096;
    static_assert(sizeof(Apart) <= kPage && std::is_trivially_copyable_v<Apart>);
    const Shared shared(kPage + into.size());
    Apart& answer = *new (shared.data()) Apart;
    answer.image = image;
    const std::size_t in_use = memory_in_use();
    pid_t child = -1;
    {
        const std::lock_guard lock(at_work());
        child = ::fork();
    }
    if (child < 0) throw std::bad_alloc();
    if (child == 0) {
        set_limits(allowance, in_use);
        answer.done = call(answer.image, shared.data() + kPage, answer.error);
        answer.whole = true;
        ::_exit(0);
    }
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
    if (answer.whole && answer.done && !into.empty())
        std::memcpy(into.data(), shared.data() + kPage, into.size());
    return answer;
}

}  // namespace edgewise::store
