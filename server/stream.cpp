// SPDX-License-Identifier: Apache-2.0
#include "server/stream.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <exception>
#include <nlohmann/json.hpp>
#include <utility>

#include "protocol/frame_header.h"
#include "protocol/messages.h"
#include "protocol/problem.h"
#include "server/api.h"
#include "server/edit_queue.h"

namespace scolopax::server {

using protocol::ProtocolError;

/// Text messages arrive one at a time, on any thread; frames come only from the encoder thread.
class Stream : public ViewerSink, public std::enable_shared_from_this<Stream> {
 public:
  Stream(SessionStore& store, Background& background, const StreamHub::Options& options,
         const std::shared_ptr<net::WebSocket>& socket)
      : store_(store), background_(background), options_(options), socket_(socket) {}

  void join(std::shared_ptr<Session> session) {
    sendText(protocol::helloText(options_.capabilities, session->id(), session->token()));
    session_ = std::move(session);
    edits_ = std::make_shared<EditQueue>(background_, session_->id());
    viewer_ = session_->addViewer(shared_from_this());
  }

  void leave() {
    if (edits_) edits_->end();
    edits_.reset();
    if (session_) session_->removeViewer(viewer_);
    if (const auto socket = socket_.lock()) socket->withdrawFrame();
    session_.reset();
  }

  void receive(const std::string& text) {
    received_ = &text;
    try {
      std::visit([this](const auto& message) { handle(message); },
                 protocol::parseClientMessage(text, options_.limits));
    } catch (const ProtocolError& error) {
      sendText(protocol::errorText(error));
    }
  }

  /// Frames sent and replaced since the last call.
  std::pair<std::uint64_t, std::uint64_t> newFrames() {
    const auto socket = socket_.lock();
    if (!socket) return {0, 0};
    const net::WebSocketStats stats = socket->stats();
    const std::lock_guard lock(countMutex_);
    return {stats.framesSent - std::exchange(countedSent_, stats.framesSent),
            stats.framesReplaced - std::exchange(countedReplaced_, stats.framesReplaced)};
  }

  void offerFrame(const EncodedFrame& frame, std::uint32_t patch) override {
    orEnd([&] { sendFrame(frame, patch); });
  }
  void sceneChanged(const std::shared_ptr<const std::string>& message) override {
    orEnd([&] {
      if (const auto socket = socket_.lock()) socket->sendText(message);
    });
  }
  void renderFailed(const Error& error) override {
    orEnd([&] { sendText(protocol::errorText(problemOf(error))); });
  }
  void sessionClosed(const std::string& reason) override { end(1001, reason); }

  void end(std::uint16_t code, const std::string& reason) {
    if (const auto socket = socket_.lock()) socket->close(code, reason);
  }

 private:
  void sendFrame(const EncodedFrame& frame, std::uint32_t patch) {
    protocol::FrameHeader header;
    header.codec = protocol::Codec::jpeg;
    header.flags = std::uint8_t((frame.info.interactive ? protocol::kFlagInteractive : 0) |
                                (frame.info.final ? protocol::kFlagFinal : 0));
    header.width = std::uint16_t(frame.width);
    header.height = std::uint16_t(frame.height);
    header.method = std::uint8_t(1 + int(frame.info.method));
    header.frame = ++frameNumber_;
    header.revision = frame.info.revision;
    header.patch = patch;
    header.samples = frame.info.samples;
    header.error = frame.info.error;
    header.rebuildUs = frame.info.rebuildUs;
    header.renderUs = frame.info.renderUs;
    header.encodeUs = frame.info.encodeUs;
    const auto bytes = protocol::encodeFrameHeader(header);
    net::Frame out;
    out.number = header.frame;
    out.header.resize(bytes.size());
    std::memcpy(out.header.data(), bytes.data(), bytes.size());
    out.payload = frame.jpeg;
    if (const auto socket = socket_.lock()) socket->offerFrame(std::move(out));
  }

  void handle(const protocol::PatchMessage& message) {
    const EditOrigin origin{viewer_, message.id, std::nullopt};
    EditQueue::Edit edit;
    // Stored as text, because a parsed patch would take many times the memory while it waits.
    edit.apply = [session = session_, text = *received_, origin, &limits = options_.limits] {
      session->patch(std::get<protocol::PatchMessage>(protocol::parseClientMessage(text, limits)).patch,
                     origin);
    };
    edit.failed = [stream = weak_from_this(), id = message.id](const std::exception_ptr& failure) {
      if (const auto self = stream.lock()) self->refuse(id, failure);
    };
    edit.bytes = received_->size();
    try {
      edits_->push(std::move(edit));
    } catch (const ProtocolError& error) {
      sendText(protocol::errorText(error, message.id));
    }
  }
  void handle(const protocol::AckMessage& message) {
    if (const auto socket = socket_.lock()) socket->acknowledge(message.frame);
  }
  /// Answered in order with the edits, so that a pong shows that all earlier edits have been applied or
  /// refused. Number 0 only asks whether the server responds.
  void handle(const protocol::PingMessage& message) {
    if (message.id == 0) return sendText(protocol::pongText(0));
    const auto answer = [stream = weak_from_this(), id = message.id] {
      if (const auto self = stream.lock()) self->sendText(protocol::pongText(id));
    };
    edits_->push({answer, [answer](const std::exception_ptr&) { answer(); }, received_->size()});
  }
  void handle(const protocol::ViewMessage& message) {
    session_->setView(viewer_, message.visible, message.maxFps.value_or(0));
    if ((message.maxWidth || message.maxHeight) && !std::exchange(sizeNoticeSent_, true))
      sendText(protocol::noticeText("maxWidth and maxHeight are not used; set image.width and image.height"));
  }
  void handle(const protocol::PickMessage& message) {
    const auto answered = [stream = weak_from_this(), id = message.id](const PickAnswer& answer) {
      if (const auto self = stream.lock()) self->sendPicked(id, answer);
    };
    try {
      session_->pick({message.x, message.y, message.x2, message.y2}, answered, viewer_);
    } catch (...) {
      sendPicked(message.id, {{}, std::current_exception()});
    }
  }
  void handle(const protocol::ResumeMessage& message) {
    auto session = store_.findByToken(message.token);
    if (!session)
      throw ProtocolError(404, "/token", "there is no session with this token; it may have ended");
    if (session == session_) return;  // the stream's address has already joined it
    leave();
    join(std::move(session));
  }

  /// Reports why an edit was refused.
  void refuse(std::uint32_t id, const std::exception_ptr& failure) {
    orEnd([&] { sendText(protocol::errorText(problemOf(failure), id)); });
  }

  void sendPicked(std::uint32_t id, const PickAnswer& answer) {
    orEnd([&] {
      sendText(answer.failure ? protocol::pickedText(id, problemOf(answer.failure))
                              : protocol::pickedText(id, answer.found));
    });
  }

  /// Calls `send`. If it throws, logs the cause, which the client must not see, and ends the stream. The
  /// exception must not escape, because the calling thread serves other clients as well.
  template <class Send>
  void orEnd(Send&& send) {
    try {
      send();
    } catch (const std::exception& error) {
      if (options_.log) options_.log(std::string("stream: ") + error.what());
      end(1011, "the server failed");
    }
  }

  void sendText(std::string text) {
    if (const auto socket = socket_.lock()) socket->sendText(std::move(text));
  }

  SessionStore& store_;
  Background& background_;
  const StreamHub::Options& options_;
  const std::weak_ptr<net::WebSocket> socket_;
  std::shared_ptr<Session> session_;
  ViewerId viewer_ = 0;
  std::shared_ptr<EditQueue> edits_;       ///< for edits to session_
  const std::string* received_ = nullptr;  ///< the message being handled
  bool sizeNoticeSent_ = false;
  std::atomic<std::uint32_t> frameNumber_{0};

  std::mutex countMutex_;
  std::uint64_t countedSent_ = 0, countedReplaced_ = 0;
};

StreamHub::StreamHub(SessionStore& store, Background& background, Metrics& metrics, Options options)
    : store_(store),
      background_(background),
      metrics_(metrics),
      options_(std::move(options)),
      places_(options_.maxClients, options_.now) {}

StreamHub::~StreamHub() = default;

net::WebSocketEvents StreamHub::join(const std::shared_ptr<Session>& session,
                                     const std::shared_ptr<net::WebSocket>& socket,
                                     const std::string& client) {
  FairPlaces::Place place = places_.take(client);
  if (!place) {
    // The place that becomes free is kept for this client, which will try again.
    if (const auto other = places_.hasTooMany(client)) closeNewestOf(*other);
    throw protocol::limitReached(503, options_.maxClients, "streams");
  }
  auto stream = std::make_shared<Stream>(store_, background_, options_, socket);
  {
    const std::lock_guard lock(mutex_);
    streams_.push_back({stream, client, std::move(place)});
  }
  try {
    stream->join(session);
  } catch (...) {
    left(stream.get());
    throw;
  }
  return {[stream](const std::string& text) { stream->receive(text); },
          [this, stream] {
            stream->leave();
            left(stream.get());
          }};
}

void StreamHub::closeNewestOf(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto newest = std::find_if(streams_.rbegin(), streams_.rend(),
                                   [&](const Entry& entry) { return entry.client == client; });
  if (newest != streams_.rend()) newest->stream->end(1013, "another client asked for one of the streams");
}

void StreamHub::left(const Stream* stream) {
  countFrames();
  const std::lock_guard lock(mutex_);
  std::erase_if(streams_, [&](const Entry& entry) { return entry.stream.get() == stream; });
}

void StreamHub::countFrames() {
  const std::lock_guard lock(mutex_);
  for (const Entry& entry : streams_) {
    const auto [sent, replaced] = entry.stream->newFrames();
    metrics_.framesSent(sent, replaced);
  }
}

std::size_t StreamHub::count() const {
  const std::lock_guard lock(mutex_);
  return streams_.size();
}

}  // namespace scolopax::server
