// SPDX-License-Identifier: Apache-2.0
// The text messages of a session's WebSocket: parses the client's messages and writes the server's.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "protocol/json_text.h"
#include "protocol/problem.h"

namespace scolopax::protocol {

struct PatchMessage {
  std::uint32_t id = 0;  ///< chosen by the client, from 1 and increasing; frames and errors refer to it
  nlohmann::json patch;  ///< an object; applyPatch checks what it contains
};
struct AckMessage {
  std::uint32_t frame = 0;  ///< this frame and all before it have arrived
};
struct PingMessage {
  std::uint32_t id = 0;  ///< returned in the pong
};
/// The client's limits for pictures. Each of these messages replaces the previous one.
struct ViewMessage {
  bool visible = true;  ///< false: no frames
  std::optional<std::uint32_t> maxWidth, maxHeight;
  std::optional<double> maxFps;
};
struct ResumeMessage {
  std::string token;
};
/// A position in the session's picture, in pixels from its top left corner. With x2 and y2, one corner of a
/// rectangle and the opposite one.
struct PickMessage {
  std::uint32_t id = 0;  ///< returned in the answer
  double x = 0, y = 0;
  std::optional<double> x2, y2;
};

using ClientMessage =
    std::variant<PatchMessage, AckMessage, PingMessage, ViewMessage, ResumeMessage, PickMessage>;

/// Throws ProtocolError: 400 and 413 as parseJson, 422 for an unknown type or a bad field.
ClientMessage parseClientMessage(std::string_view text, const Limits& limits = {});

std::string helloText(const nlohmann::json& capabilities, std::string_view session, std::string_view token);
/// For the viewers that did not send the edit. `patch`, as JSON text, turns the resolved scene before the
/// edit into the scene after it.
std::string sceneText(std::uint32_t revision, std::string_view patch);
/// `patchId`: id of the refused patch; 0 if the error is about something else.
std::string errorText(const ProtocolError& error, std::uint32_t patchId = 0);
std::string noticeText(std::string_view text);
std::string pongText(std::uint32_t id);
/// `found`: the members of the answer, the same as for GET .../pick.
std::string pickedText(std::uint32_t id, const nlohmann::json& found);
std::string pickedText(std::uint32_t id, const ProtocolError& error);

}  // namespace scolopax::protocol
