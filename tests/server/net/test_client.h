// SPDX-License-Identifier: Apache-2.0
// A client that shares no code with the server: a plain blocking socket, with HTTP and WebSocket written by
// hand, so that it can also send what no library would. Every wait ends after kPatience and then fails the
// test.
#pragma once
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <thread>

namespace scolopax::net {

inline constexpr std::chrono::seconds kPatience{20};

/// Waits until `condition` is true; false if it is still false after kPatience.
inline bool eventually(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

struct Answer {
  int status = 0;                              ///< 0: the connection ended instead
  std::map<std::string, std::string> headers;  ///< lower-case names
  std::string body;
};

struct Message {
  int opcode = -1;  ///< 1 text, 2 binary, 8 close, 9 ping, 10 pong; -1: the connection ended
  std::string data;
  int closeCode() const {
    return opcode == 8 && data.size() >= 2
               ? static_cast<unsigned char>(data[0]) << 8 | static_cast<unsigned char>(data[1])
               : 0;
  }
};

class TestClient {
 public:
  /// `from`: the client's own address, of 127.0.0.0/8.
  explicit TestClient(std::uint16_t port, int receiveBuffer = 0, const char* from = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receiveBuffer > 0) setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receiveBuffer, sizeof receiveBuffer);
    const timeval patience{kPatience.count(), 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    inet_pton(AF_INET, from, &address.sin_addr);
    ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~TestClient() { ::close(socket_); }
  TestClient(const TestClient&) = delete;
  TestClient& operator=(const TestClient&) = delete;

  bool connected() const { return connected_; }

  /// False if the server has closed the connection.
  bool send(std::string_view data) {
    while (!data.empty()) {
      const ssize_t count = ::send(socket_, data.data(), data.size(), MSG_NOSIGNAL);
      if (count <= 0) return false;
      data.remove_prefix(static_cast<std::size_t>(count));
    }
    return true;
  }

  /// Closes the sending side only.
  void finishSending() { ::shutdown(socket_, SHUT_WR); }

  /// Closes the connection with a reset instead of an orderly shutdown.
  void reset() {
    const linger hard{1, 0};
    setsockopt(socket_, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
  }

  /// The next answer; 1xx answers are returned like any other. `toHead`: no body follows.
  Answer answer(bool toHead = false) {
    Answer out;
    std::size_t end = 0;
    while ((end = received_.find("\r\n\r\n")) == std::string::npos) {
      if (!receive()) return out;
    }
    const std::string head = received_.substr(0, end + 2);
    received_.erase(0, end + 4);
    out.status = std::stoi(head.substr(9, 3));
    for (std::size_t line = head.find("\r\n") + 2; line < head.size();) {
      const std::size_t stop = head.find("\r\n", line);
      const std::size_t colon = head.find(':', line);
      std::string name = head.substr(line, colon - line);
      for (char& c : name) c = static_cast<char>(std::tolower(c));
      out.headers[name] = head.substr(colon + 2, stop - colon - 2);
      line = stop + 2;
    }
    const auto length = out.headers.find("content-length");
    const std::size_t size = toHead || length == out.headers.end() ? 0 : std::stoul(length->second);
    while (received_.size() < size) {
      if (!receive()) return {};
    }
    out.body = received_.substr(0, size);
    received_.erase(0, size);
    return out;
  }

  Answer request(const std::string& head, const std::string& body = "") {
    send(head + "\r\nHost: localhost\r\n" +
         (body.empty() ? "" : "Content-Length: " + std::to_string(body.size()) + "\r\n") + "\r\n" + body);
    return answer(head.rfind("HEAD", 0) == 0);
  }

  /// Reads at most so many bytes and discards them. Returns their number; 0 if the connection has ended.
  std::size_t receiveSome(std::size_t most) {
    std::string bytes(most, 0);
    return static_cast<std::size_t>(std::max<ssize_t>(0, ::recv(socket_, bytes.data(), most, 0)));
  }

  /// Whether the server ends the connection, now or soon, without sending anything more.
  bool ended() { return received_.empty() && !receive(); }

  Answer upgrade(const std::string& path, const std::string& more = "") {
    send("GET " + path +
         " HTTP/1.1\r\nHost: localhost\r\nConnection: keep-alive, Upgrade\r\nUpgrade: websocket\r\n"
         "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
         more + "\r\n");
    return answer();
  }

  static std::string frame(int opcode, const std::string& data) {
    std::string out(1, static_cast<char>(0x80 | opcode));
    const std::size_t size = data.size();
    if (size < 126) {
      out += static_cast<char>(0x80 | size);
    } else if (size < 65536) {
      out += {static_cast<char>(0x80 | 126), static_cast<char>(size >> 8), static_cast<char>(size & 255)};
    } else {
      out += static_cast<char>(0x80 | 127);
      for (int shift = 56; shift >= 0; shift -= 8) out += static_cast<char>(size >> shift & 255);
    }
    const char mask[4] = {'\x12', '\x34', '\x56', '\x78'};
    out.append(mask, 4);
    for (std::size_t i = 0; i < size; ++i) out += static_cast<char>(data[i] ^ mask[i % 4]);
    return out;
  }
  bool sendText(const std::string& text) { return send(frame(1, text)); }

  /// The next message, including pings.
  Message message() {
    if (!receiveAtLeast(2)) return {};
    Message out;
    const auto byte = [this](std::size_t i) {
      return static_cast<std::size_t>(static_cast<unsigned char>(received_[i]));
    };
    out.opcode = static_cast<int>(byte(0) & 15);
    EXPECT_EQ(byte(0) & 0xF0, 0x80U) << "neither fragmented nor compressed";
    std::size_t size = byte(1);
    std::size_t at = 2;
    const std::size_t extra = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (extra > 0) {
      if (!receiveAtLeast(2 + extra)) return {};
      for (size = 0; at < 2 + extra; ++at) size = size << 8 | byte(at);
    }
    if (!receiveAtLeast(at + size)) return {};
    out.data = received_.substr(at, size);
    received_.erase(0, at + size);
    return out;
  }

  /// The code of the close message, whatever comes before it; 0 if the connection ends without one.
  int closeCode() {
    for (;;) {
      const Message next = message();
      if (next.opcode == -1) return 0;
      if (next.opcode == 8) return next.closeCode();
    }
  }

 private:
  bool receiveAtLeast(std::size_t size) {
    while (received_.size() < size) {
      if (!receive()) return false;
    }
    return true;
  }
  bool receive() {
    char chunk[65536];
    const ssize_t count = ::recv(socket_, chunk, sizeof chunk, 0);
    if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) ADD_FAILURE() << "nothing came";
    if (count <= 0) return false;
    received_.append(chunk, static_cast<std::size_t>(count));
    return true;
  }

  int socket_;
  bool connected_ = false;
  std::string received_;
};

}  // namespace scolopax::net
