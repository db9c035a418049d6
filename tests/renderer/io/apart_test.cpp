// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/apart.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <thread>

#include "renderer/core/sanitizers.h"
#include "tests/renderer/io/io_test_support.h"

namespace scolopax::io {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using Work = std::function<void(const Sender&)>;

/// What a child does, as text: every message, or the error.
struct ApartResult {
  std::vector<std::string> messages, warnings;
  std::string error;
  ErrorCode code = ErrorCode::io;
};

ApartResult runAndTell(const Work& work, const ApartLimits& limits = {}, const std::stop_token& stop = {}) {
  ApartResult result;
  const auto message = [&](std::span<const std::byte> bytes) {
    result.messages.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const auto warn = [&](const std::string& line) { result.warnings.push_back(line); };
  try {
    runApart("a.h5", limits, stop, work, {message, warn});
  } catch (const Error& error) {
    result.error = error.what();
    result.code = error.code();
  }
  // No child may be left, ended or not.
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
  return result;
}

std::span<const std::byte> asBytes(std::string_view text) { return std::as_bytes(std::span(text)); }

TEST(Apart, MessagesAndWarningsArriveInOrder) {
  const auto result = runAndTell([](const Sender& sender) {
    sender.send({asBytes("one"), asBytes(" two")});
    sender.warn("careful");
    sender.send({});
    sender.send({asBytes(std::string(3 << 20, 'x'))});  // more than a pipe holds
  });
  EXPECT_EQ(result.error, "");
  EXPECT_THAT(result.messages, ElementsAre("one two", "", std::string(3 << 20, 'x')));
  EXPECT_THAT(result.warnings, ElementsAre("careful"));
}

TEST(Apart, AnErrorKeepsItsCodeAndMessage) {
  const auto result = runAndTell([](const Sender& sender) {
    sender.send({asBytes("before")});
    throw Error(ErrorCode::unsupported, "a.h5: expected this, found that");
  });
  EXPECT_EQ(result.error, "a.h5: expected this, found that");
  EXPECT_EQ(result.code, ErrorCode::unsupported);
  EXPECT_THAT(result.messages, ElementsAre("before"));
  const auto other = runAndTell([](const Sender&) { throw std::runtime_error("odd"); });
  EXPECT_EQ(other.error, "a.h5: cannot be read: odd");
}

TEST(Apart, ACrashIsADamagedFile) {
  for (const Work& crash :
       {Work([](const Sender&) { std::raise(SIGSEGV); }), Work([](const Sender&) { std::abort(); }),
        Work([](const Sender&) { ::_exit(0); }),  // without a word
        Work([](const Sender& sender) {
          sender.send({asBytes("half of it")});
          std::raise(SIGBUS);
        })}) {
    const auto result = runAndTell(crash);
    EXPECT_EQ(result.error, "a.h5: is damaged (its library crashed)");
    EXPECT_EQ(result.code, ErrorCode::badInput);
  }
}

TEST(Apart, AMessageBeyondTheLimitIsADamagedFile) {
  const auto result =
      runAndTell([](const Sender& sender) { sender.send({asBytes("12345")}); }, {.messageBytes = 4});
  EXPECT_EQ(result.error, "a.h5: is damaged (its library crashed)");
  EXPECT_TRUE(result.messages.empty());
}

TEST(Apart, AnEndlessLoopEnds) {
  const auto result = runAndTell(
      [](const Sender&) {
        for (volatile bool on = true; on;) {
        }
      },
      {.computing = std::chrono::seconds(1)});
  EXPECT_EQ(result.error, "a.h5: takes too long to read");
}

TEST(Apart, AnEndlessWaitEnds) {
  const auto result =
      runAndTell([](const Sender&) { ::pause(); }, {.silence = std::chrono::milliseconds(100)});
  EXPECT_EQ(result.error, "a.h5: takes too long to read");
}

TEST(Apart, TooMuchMemoryIsRefused) {
  if (SCOLOPAX_SANITIZED) GTEST_SKIP() << "the sanitizer's allocator ends the process";
  const auto result = runAndTell(
      [](const Sender& sender) {
        std::vector<char> fits(16 << 20, 'x');
        sender.send({std::as_bytes(std::span(fits).first(1))});
        std::vector<char> bytes(std::size_t(256) << 20, 'x');
        sender.send({std::as_bytes(std::span(bytes).first(1))});
      },
      {.memoryBytes = 64 << 20});
  EXPECT_EQ(result.error, "a.h5: needs more memory than is allowed");
  EXPECT_EQ(result.code, ErrorCode::tooLarge);
  EXPECT_THAT(result.messages, ElementsAre("x"));
}

TEST(Apart, CancellingEndsTheChild) {
  std::stop_source stop;
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stop.request_stop();
  });
  const auto begin = std::chrono::steady_clock::now();
  const auto result = runAndTell([](const Sender&) { ::pause(); }, {}, stop.get_token());
  EXPECT_EQ(result.code, ErrorCode::cancelled);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST(Apart, AThrowingReceiverEndsTheChild) {
  const auto work = [](const Sender& sender) {
    for (;;) sender.send({asBytes("more")});
  };
  const auto message = [](std::span<const std::byte>) { throw Error(ErrorCode::badInput, "enough"); };
  EXPECT_EQ(errorOf([&] { runApart("a.h5", {}, {}, work, {message, {}}); }), "enough");
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
}

TEST(Apart, TheChildHasNoOtherOpenFilesAndPrintsNothing) {
  const TempDir folder;
  const int file = ::open(writeBytes(folder / "a", "secret").c_str(), O_RDONLY);
  testing::internal::CaptureStdout();
  const auto result = runAndTell([&](const Sender& sender) {
    std::printf("printed");
    std::fflush(stdout);
    int others = 0;
    for (int fd = 3; fd < 1000; ++fd) others += ::fcntl(fd, F_GETFD) != -1;
    sender.send({asBytes(std::to_string(others))});
    char byte = 0;
    sender.send({asBytes(::read(file, &byte, 1) == -1 ? "closed" : "open")});
  });
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_THAT(result.messages, ElementsAre("1", "closed")) << "the pipe is the only one";
  ::close(file);
}

TEST(Apart, AChildCanForgoOpeningFiles) {
  if (SCOLOPAX_SANITIZED) GTEST_SKIP() << "sanitizers must open pipes";
  const TempDir folder;
  const fs::path path = writeBytes(folder / "a", "secret");
  const auto result = runAndTell([&](const Sender& sender) {
    const int before = ::open(path.c_str(), O_RDONLY);
    forbidOpening();
    char byte = 0;
    sender.send({asBytes(::read(before, &byte, 1) == 1 ? "read" : "not read")});
    sender.send({asBytes(::open(path.c_str(), O_RDONLY) == -1 ? "refused" : "opened")});
  });
  EXPECT_THAT(result.messages, ElementsAre("read", "refused"));
}

TEST(Apart, SeveralThreadsMayRunChildrenAtOnce) {
  std::vector<std::string> found(4);
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < found.size(); ++i)
      threads.emplace_back([&found, i] {
        for (int round = 0; round < 20; ++round)
          runApart("a.h5", {}, {}, [i](const Sender& sender) { sender.send({asBytes(std::to_string(i))}); },
                   {[&](std::span<const std::byte> bytes) {
                      found[i].append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
                    },
                    {}});
      });
  }
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], std::string(20, char('0' + i)));
}

}  // namespace
}  // namespace scolopax::io
