#include "sandbox.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>
#include <stdexcept>

#include "one_line_reason.h"

namespace mp2p_icp
{
namespace
{
// The child's message: one byte (1: ok), then the text up to the end of the pipe, then this, so that a
// message that was cut by a crash is not taken for a whole one.
constexpr std::string_view END_OF_MESSAGE = "\nEND.";

// ---- In the child -----------------------------------------------------------------------------------------

void limit(__rlimit_resource what, uint64_t value)
{
    rlimit r = {};
    if (getrlimit(what, &r) != 0) return;
    r.rlim_cur = std::min<rlim_t>(value, r.rlim_max);
    setrlimit(what, &r);
}

/// Both kinds of memory limit: RLIMIT_AS counts all address space (also mapped files), RLIMIT_DATA what can
/// be written.
void limit_memory(uint64_t extra_bytes)
{
    uint64_t size = 0, resident = 0, shared = 0, text = 0, lib = 0, data = 0;
    std::ifstream("/proc/self/statm") >> size >> resident >> shared >> text >> lib >> data;
    const auto page = static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
    limit(RLIMIT_AS, size * page + extra_bytes);
    limit(RLIMIT_DATA, data * page + extra_bytes);
}

void isolate(const SandboxLimits& limits)
{
    const int null = open("/dev/null", O_RDWR);
    if (null >= 0)
        for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(null, fd);
    for (const int s : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGALRM, SIGXCPU, SIGTERM, SIGPIPE})
        signal(s, SIG_DFL);
    prctl(PR_SET_DUMPABLE, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    limit(RLIMIT_CORE, 0);
    limit_memory(limits.extra_memory_bytes);
    limit(RLIMIT_CPU, static_cast<uint64_t>(limits.seconds) + 1);
    alarm(static_cast<unsigned>(limits.seconds) + 1);
}

void write_all(int fd, std::string_view text)
{
    while (!text.empty())
    {
        const ssize_t n = write(fd, text.data(), text.size());
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return;
        text.remove_prefix(static_cast<size_t>(n));
    }
}

[[noreturn]] void child(const std::function<std::string()>& task, const SandboxLimits& limits, int out)
{
    isolate(limits);
    SandboxOutcome outcome;
    try
    {
        outcome.text = task();
        outcome.ok = true;
    }
    catch (const std::bad_alloc&)
    {
        outcome.text = "needs more memory than reading may use (damaged?)";
    }
    catch (const std::exception& e)
    {
        outcome.text = one_line_reason(e);
    }
    catch (...)
    {
        outcome.text = "unknown error";
    }
    write_all(out, outcome.ok ? "1" : "0");
    write_all(out, outcome.text);
    write_all(out, END_OF_MESSAGE);
    _exit(0);
}

// ---- In the parent ----------------------------------------------------------------------------------------

struct Child
{
    pid_t pid = -1;
    int in = -1;
};

/// The lock makes sure that no other child inherits this pipe's writing end, which would keep it open.
Child start(const std::function<std::string()>& task, const SandboxLimits& limits)
{
    const std::lock_guard<std::mutex> lock(sandbox_mutex());
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        throw std::runtime_error(std::string("cannot make a pipe: ") + std::strerror(errno));
    const pid_t pid = fork();
    if (pid == 0)
    {
        close(ends[0]);
        child(task, limits, fcntl(ends[1], F_DUPFD_CLOEXEC, STDERR_FILENO + 1));  // 0 to 2 go to /dev/null
    }
    const int error = errno;
    close(ends[1]);
    if (pid < 0)
    {
        close(ends[0]);
        throw std::runtime_error(std::string("cannot start a process: ") + std::strerror(error));
    }
    return {pid, ends[0]};
}

/// Reads until the child closes its end. \return false if that takes longer than the limit.
bool receive(int fd, double seconds, std::string& message)
{
    using Clock = std::chrono::steady_clock;
    const auto deadline =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    char buffer[4096];
    while (true)
    {
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
        if (left <= 0) return false;
        pollfd p = {fd, POLLIN, 0};
        const int ready = poll(&p, 1, static_cast<int>(std::min<int64_t>(left, 1000)));
        if (ready <= 0) continue;  // time out of one second, or a signal
        const ssize_t n = read(fd, buffer, sizeof(buffer));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return true;
        message.append(buffer, static_cast<size_t>(n));
    }
}

/// Waits for the end of a child; 0 if its status is not known (a program may ignore SIGCHLD).
int wait_for(pid_t pid)
{
    int status = 0;
    while (waitpid(pid, &status, 0) < 0)
        if (errno != EINTR) return 0;
    return status;
}

std::string reason_of_death(bool in_time, int status)
{
    const int signal_number = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (!in_time || signal_number == SIGALRM || signal_number == SIGXCPU)
        return "takes too long to read (damaged?)";
    if (signal_number != 0)
        return std::string("MRPT's reader crashes on it (") + strsignal(signal_number) +
               "), so it must be damaged";
    return "MRPT's reader crashes on it, so it must be damaged";
}
}  // namespace

std::mutex& sandbox_mutex()
{
    static std::mutex mutex;
    return mutex;
}

SandboxOutcome run_in_sandbox(const std::function<std::string()>& task, const SandboxLimits& limits)
{
    const Child c = start(task, limits);
    std::string message;
    const bool in_time = receive(c.in, limits.seconds, message);
    close(c.in);
    kill(c.pid, SIGKILL);  // a child that has sent its message has nothing left to do
    const int status = wait_for(c.pid);

    const bool whole =
        message.size() > END_OF_MESSAGE.size() &&
        std::string_view(message).substr(message.size() - END_OF_MESSAGE.size()) == END_OF_MESSAGE;
    SandboxOutcome outcome;
    outcome.ok = whole && message[0] == '1';
    outcome.text = whole ? message.substr(1, message.size() - 1 - END_OF_MESSAGE.size())
                         : reason_of_death(in_time, status);
    return outcome;
}

}  // namespace mp2p_icp
