// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/apart.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/core/sanitizers.h"

namespace scolopax::io {
namespace {

/// Begins every message. Kinds of ApartHeader: the child ends with done or failed.
enum class ApartKind : std::uint32_t { message, warning, failed, done };
struct ApartHeader {
  ApartKind kind;
  std::uint32_t code;  ///< of the Error, if failed
  std::uint64_t bytes;
};

void writeFully(int pipe, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(pipe, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) ::_exit(1);
    bytes = bytes.subspan(std::size_t(written));
  }
}

void sendParts(int pipe, ApartKind kind, ErrorCode code,
               std::initializer_list<std::span<const std::byte>> parts) {
  ApartHeader header{kind, std::uint32_t(code), 0};
  for (const auto& part : parts) header.bytes += part.size();
  writeFully(pipe, std::as_bytes(std::span(&header, 1)));
  for (const auto& part : parts) writeFully(pipe, part);
}

void sendText(int pipe, ApartKind kind, ErrorCode code, std::string_view text) {
  sendParts(pipe, kind, code, {std::as_bytes(std::span(text))});
}

/// Address space of this process; 0 if unknown.
std::uint64_t addressSpaceBytes() {
  const int file = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  std::array<char, 64> text{};
  const ssize_t got = file < 0 ? 0 : ::read(file, text.data(), text.size() - 1);
  if (file >= 0) ::close(file);
  unsigned long long pages = 0;
  if (got <= 0 || std::sscanf(text.data(), "%llu", &pages) != 1) return 0;
  return pages * std::uint64_t(::sysconf(_SC_PAGESIZE));
}

void limitTo(int resource, std::uint64_t soft, std::uint64_t hard) {
  rlimit now{};
  if (::getrlimit(__rlimit_resource_t(resource), &now) != 0) return;
  const rlimit limit{std::min<rlim_t>(soft, now.rlim_max), std::min<rlim_t>(hard, now.rlim_max)};
  ::setrlimit(__rlimit_resource_t(resource), &limit);
}

/// Leaves the child with nothing of its parent but memory and the pipe.
void isolate(int pipe, const ApartLimits& limits) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (int signal = 1; signal < NSIG; ++signal) std::signal(signal, SIG_DFL);
  std::signal(SIGPIPE, SIG_IGN);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  const int nothing = ::open("/dev/null", O_RDWR);
  for (int standard = 0; standard <= 2; ++standard) ::dup2(nothing, standard);
  if (pipe > 3) ::close_range(3, unsigned(pipe - 1), 0);
  ::close_range(unsigned(std::max(pipe + 1, 3)), ~0U, 0);
  limitTo(RLIMIT_CORE, 0, 0);
  const auto seconds = std::uint64_t(limits.computing.count());
  limitTo(RLIMIT_CPU, seconds, seconds + 1);
  if (const std::uint64_t now = addressSpaceBytes(); now > 0)
    limitTo(RLIMIT_AS, now + limits.memoryBytes, now + limits.memoryBytes);
}

[[noreturn]] void runChild(int pipe, const ApartLimits& limits, const std::string& what,
                           const std::function<void(const Sender&)>& work) {
  pipe = ::fcntl(pipe, F_DUPFD, 3);  // it may have been a standard one, if the parent had closed that
  isolate(pipe, limits);
  try {
    work(Sender(pipe));
    sendParts(pipe, ApartKind::done, ErrorCode::badInput, {});
  } catch (const Error& error) {
    sendText(pipe, ApartKind::failed, error.code(), error.what());
  } catch (const std::bad_alloc&) {
    sendText(pipe, ApartKind::failed, ErrorCode::tooLarge, what + ": needs more memory than is allowed");
  } catch (const std::exception& error) {
    sendText(pipe, ApartKind::failed, ErrorCode::badInput, what + ": cannot be read: " + error.what());
  }
  ::_exit(0);
}

/// The child, as its parent sees it.
class ApartChild {
 public:
  ApartChild(pid_t pid, int pipe) : pid_(pid), pipe_(pipe) {}
  ~ApartChild() {
    ::close(pipe_);
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      wait();
    }
  }
  ApartChild(const ApartChild&) = delete;
  ApartChild& operator=(const ApartChild&) = delete;

  /// Fills `bytes`; false if the child ended before.
  bool read(std::span<std::byte> bytes, const std::string& what, const ApartLimits& limits,
            const std::stop_token& stop) const;
  /// Waits for the end; returns the status of waitpid.
  int wait() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

 private:
  pid_t pid_;
  int pipe_;
};

bool ApartChild::read(std::span<std::byte> bytes, const std::string& what, const ApartLimits& limits,
                      const std::stop_token& stop) const {
  using Clock = std::chrono::steady_clock;
  constexpr int kPollMs = 20;
  auto last = Clock::now();
  while (!bytes.empty()) {
    if (stop.stop_requested()) throw Error(ErrorCode::cancelled, "loading was cancelled");
    pollfd waiting{pipe_, POLLIN, 0};
    if (::poll(&waiting, 1, kPollMs) <= 0) {
      if (Clock::now() - last > limits.silence)
        throw Error(ErrorCode::badInput, what + ": takes too long to read");
      continue;
    }
    const ssize_t got = ::read(pipe_, bytes.data(), bytes.size());
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (got <= 0) return false;
    bytes = bytes.subspan(std::size_t(got));
    last = Clock::now();
  }
  return true;
}

[[noreturn]] void failEnded(const std::string& what, int status) {
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGXCPU) throw Error(ErrorCode::badInput, what + ": takes too long to read");
  if (signal == SIGKILL)  // by the system
    throw Error(ErrorCode::tooLarge, what + ": needs more memory than there is");
  throw Error(ErrorCode::badInput, what + ": is damaged (its library crashed)");
}

void receiveAll(ApartChild& child, const std::string& what, const ApartLimits& limits,
                const std::stop_token& stop, const Receiver& receiver) {
  std::vector<std::byte> bytes;
  for (;;) {
    ApartHeader header{};
    if (!child.read(std::as_writable_bytes(std::span(&header, 1)), what, limits, stop))
      failEnded(what, child.wait());
    // The library may have overwritten anything in the child.
    if (header.bytes > limits.messageBytes)
      throw Error(ErrorCode::badInput, what + ": is damaged (its library crashed)");
    bytes.resize(header.bytes);
    if (!child.read(bytes, what, limits, stop)) failEnded(what, child.wait());
    const std::string text(reinterpret_cast<const char*>(bytes.data()),
                           header.kind == ApartKind::message ? 0 : bytes.size());
    if (header.kind == ApartKind::message)
      receiver.message(bytes);
    else if (header.kind == ApartKind::warning)
      receiver.warn(text);
    else if (header.kind == ApartKind::failed)
      throw Error(
          header.code <= std::uint32_t(ErrorCode::cancelled) ? ErrorCode(header.code) : ErrorCode::badInput,
          text);
    else
      return;
  }
}

}  // namespace

void Sender::send(std::initializer_list<std::span<const std::byte>> parts) const {
  sendParts(pipe_, ApartKind::message, ErrorCode::badInput, parts);
}

void Sender::warn(const std::string& line) const {
  sendText(pipe_, ApartKind::warning, ErrorCode::badInput, line);
}

void forbidOpening() {
  // Sanitizers open pipes to find out whether memory can be read.
  if (!SCOLOPAX_SANITIZED) limitTo(RLIMIT_NOFILE, 0, 0);
}

void runApart(const std::string& what, const ApartLimits& limits, const std::stop_token& stop,
              const std::function<void(const Sender&)>& work, const Receiver& receiver) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0)
    throw Error(ErrorCode::busy, what + ": no pipe for reading it: too many open files");
  const pid_t pid = ::fork();
  if (pid < 0) {
    ::close(ends[0]);
    ::close(ends[1]);
    throw Error(ErrorCode::busy,
                what + ": no process for reading it: too little memory, or too many processes");
  }
  if (pid == 0) runChild(ends[1], limits, what, work);
  ::close(ends[1]);
  ::fcntl(ends[0], F_SETPIPE_SZ, 1 << 20);  // fewer switches between the processes; may fail
  ApartChild child(pid, ends[0]);
  receiveAll(child, what, limits, stop, receiver);
}

}  // namespace scolopax::io
