// SPDX-License-Identifier: Apache-2.0
#include "server/net/client_watch.h"

#include <poll.h>
#include <sys/socket.h>

#include <boost/asio/steady_timer.hpp>
#include <stop_token>

namespace scolopax::net {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::milliseconds kCancelInterval{20}, kWatchInterval{100};

}  // namespace

struct Deadline::State {
  explicit State(tcp::socket& s) : socket(s), timer(s.get_executor()) {}
  static void wait(const std::shared_ptr<State>& state, std::chrono::milliseconds time) {
    state->timer.expires_after(time);
    state->timer.async_wait([state](const error_code&) {
      if (!state->alive) return;
      state->expired = true;
      error_code ignored;
      state->socket.cancel(ignored);
      wait(state, kCancelInterval);
    });
  }
  tcp::socket& socket;
  boost::asio::steady_timer timer;
  bool alive = true;
  bool expired = false;
};

Deadline::Deadline(tcp::socket& socket, std::chrono::milliseconds time)
    : state_(std::make_shared<State>(socket)) {
  State::wait(state_, time);
}

Deadline::~Deadline() {
  state_->alive = false;
  state_->timer.cancel();
}

bool Deadline::expired() const { return state_->expired; }

struct ClientWatch::State {
  State(tcp::socket& s, bool ask) : socket(s), timer(s.get_executor()), mayAsk(ask) {}
  static void wait(const std::shared_ptr<State>& state) {
    state->timer.expires_after(kWatchInterval);
    state->timer.async_wait([state](const error_code&) {
      if (!state->alive) return;
      if (state->closed())
        state->gone.request_stop();
      else
        wait(state);
    });
  }
  bool closed() {
    if (!socket.is_open()) return true;
    pollfd polled{socket.native_handle(), POLLRDHUP, 0};
    if (poll(&polled, 1, 0) <= 0) return false;
    if (polled.revents != POLLRDHUP || !mayAsk) return true;
    // A client that has closed the connection resets it when an interim response arrives; other clients
    // ignore it.
    if (std::exchange(asked, true)) return false;
    return send(socket.native_handle(), kContinue.data(), kContinue.size(), MSG_NOSIGNAL | MSG_DONTWAIT) !=
           ssize_t(kContinue.size());
  }
  tcp::socket& socket;
  boost::asio::steady_timer timer;
  const bool mayAsk;
  bool asked = false;
  bool alive = true;
  std::stop_source gone;
};

ClientWatch::ClientWatch(tcp::socket& socket, bool mayAsk, Request& request)
    : state_(std::make_shared<State>(socket, mayAsk)) {
  request.mayWait = true;
  request.gone = state_->gone.get_token();
  State::wait(state_);
}

ClientWatch::~ClientWatch() {
  state_->alive = false;
  state_->timer.cancel();
}

}  // namespace scolopax::net
