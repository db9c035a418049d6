// SPDX-License-Identifier: Apache-2.0
#include "protocol/messages.h"

#include "protocol/frame_header.h"
#include "protocol/read_fields.h"

namespace scolopax::protocol {

inline constexpr double kU32Max = 4294967295.0;

void readValue(const nlohmann::json& json, const Path& path, const Traits&, ReadContext,
               nlohmann::json& out) {
  if (!json.is_object()) failExpected(path, "an object", json);
  out = json;
}

// Messages have a `type` and required fields; otherwise they are read like a scene.
template <>
struct Table<PatchMessage> {
  static constexpr std::string_view type = "patch";
  static constexpr std::string_view required[] = {"id", "patch"};
  static constexpr auto fields =
      std::tuple{field("id", &PatchMessage::id, "", {.atLeast = 1, .atMost = kU32Max}),
                 field("patch", &PatchMessage::patch, "")};
};
template <>
struct Table<AckMessage> {
  static constexpr std::string_view type = "ack";
  static constexpr std::string_view required[] = {"frame"};
  static constexpr auto fields =
      std::tuple{field("frame", &AckMessage::frame, "", {.atLeast = 1, .atMost = kU32Max})};
};
template <>
struct Table<PingMessage> {
  static constexpr std::string_view type = "ping";
  static constexpr auto fields =
      std::tuple{field("id", &PingMessage::id, "", {.atLeast = 0, .atMost = kU32Max})};
};
template <>
struct Table<ViewMessage> {
  static constexpr std::string_view type = "view";
  static constexpr auto fields =
      std::tuple{field("visible", &ViewMessage::visible, ""),
                 field("maxWidth", &ViewMessage::maxWidth, "", {.atLeast = 1, .atMost = kMaxSidePixels}),
                 field("maxHeight", &ViewMessage::maxHeight, "", {.atLeast = 1, .atMost = kMaxSidePixels}),
                 field("maxFps", &ViewMessage::maxFps, "", {.above = 0, .atMost = 1000})};
};
template <>
struct Table<ResumeMessage> {
  static constexpr std::string_view type = "resume";
  static constexpr std::string_view required[] = {"token"};
  static constexpr auto fields = std::tuple{field("token", &ResumeMessage::token, "", {.maxLength = 256})};
};
template <>
struct Table<PickMessage> {
  static constexpr std::string_view type = "pick";
  static constexpr std::string_view required[] = {"id", "x", "y"};
  static constexpr Traits pixels{.atLeast = 0, .below = kMaxSidePixels};
  static constexpr auto fields =
      std::tuple{field("id", &PickMessage::id, "", {.atLeast = 1, .atMost = kU32Max}),
                 field("x", &PickMessage::x, "", pixels), field("y", &PickMessage::y, "", pixels),
                 field("x2", &PickMessage::x2, "", pixels), field("y2", &PickMessage::y2, "", pixels)};
};

namespace {

template <class Message>
Message readMessage(nlohmann::json json) {
  json.erase("type");
  if constexpr (requires { Table<Message>::required; }) {
    for (const std::string_view name : Table<Message>::required) {
      if (!json.contains(name))
        fail(Path() / name, "missing from a message of type \"" + std::string(Table<Message>::type) + '"');
    }
  }
  static const Lists kNoLists;
  Message message;
  readStruct(json, Path(), {kNoLists}, message);
  return message;
}

/// Reads the message as the variant's alternative with this `type`.
template <class... Messages>
ClientMessage readAny(const nlohmann::json& json, const std::string& type, std::variant<Messages...>*) {
  std::optional<ClientMessage> message;
  const auto tryOne = [&]<class Message>(std::optional<Message>) {
    if (type == Table<Message>::type) message = readMessage<Message>(json);
  };
  (tryOne(std::optional<Messages>()), ...);
  if (message) return std::move(*message);
  std::string types;
  ((types += (types.empty() ? "\"" : ", \"") + std::string(Table<Messages>::type) + '"'), ...);
  failExpected(Path() / "type", "one of " + types, json.at("type"));
}

std::string written(const nlohmann::ordered_json& message) {
  return message.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

ClientMessage parseClientMessage(std::string_view text, const Limits& limits) {
  const nlohmann::json json = parseJson(text, limits);
  if (!json.is_object()) failExpected(Path(), "a message (an object with a type)", json);
  if (!json.contains("type")) fail(Path() / "type", "missing");
  if (!json["type"].is_string()) failExpected(Path() / "type", "a string", json["type"]);
  return readAny(json, json["type"].get<std::string>(), static_cast<ClientMessage*>(nullptr));
}

std::string helloText(const nlohmann::json& capabilities, std::string_view session, std::string_view token) {
  return written({{"type", "hello"},
                  {"version", kProtocolVersion},
                  {"session", session},
                  {"token", token},
                  {"capabilities", capabilities}});
}

std::string sceneText(std::uint32_t revision, std::string_view patch) {
  std::string text = R"({"type":"scene","revision":)" + std::to_string(revision) + R"(,"patch":)";
  return text.append(patch).append("}");
}

std::string errorText(const ProtocolError& error, std::uint32_t patchId) {
  nlohmann::ordered_json message{{"type", "error"}};
  if (patchId != 0) message["id"] = patchId;
  message["problem"] = nlohmann::ordered_json::parse(problemJson(error));
  return written(message);
}

std::string noticeText(std::string_view text) { return written({{"type", "notice"}, {"text", text}}); }

std::string pickedText(std::uint32_t id, const nlohmann::json& found) {
  nlohmann::ordered_json message{{"type", "picked"}, {"id", id}};
  for (const auto& [name, value] : found.items()) message[name] = value;
  return written(message);
}

std::string pickedText(std::uint32_t id, const ProtocolError& error) {
  return written(
      {{"type", "picked"}, {"id", id}, {"problem", nlohmann::ordered_json::parse(problemJson(error))}});
}

std::string pongText(std::uint32_t id) { return written({{"type", "pong"}, {"id", id}}); }

}  // namespace scolopax::protocol
