// SPDX-License-Identifier: Apache-2.0
#include "server/net/static_files.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "server/net/server.h"

namespace scolopax::net {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<std::string_view, std::string_view>, 16> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".mjs", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".webmanifest", "application/manifest+json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".jpg", "image/jpeg"},
    {".webp", "image/webp"},
    {".ico", "image/x-icon"},
    {".woff2", "font/woff2"},
    {".wasm", "application/wasm"},
    {".txt", "text/plain; charset=utf-8"},
    {".md", "text/plain; charset=utf-8"},
}};

std::string_view typeOf(const fs::path& file) {
  const std::string extension = file.extension().string();
  const auto* found =
      std::find_if(kTypes.begin(), kTypes.end(), [&](const auto& entry) { return entry.first == extension; });
  return found == kTypes.end() ? "application/octet-stream" : found->second;
}

}  // namespace

StaticFiles::StaticFiles(const std::string& root) {
  if (root.empty()) return;
  std::error_code error;
  root_ = fs::canonical(root, error);
  if (error || !fs::is_directory(root_)) throw NetError("page folder " + root + ": not a folder");
}

std::optional<fs::path> StaticFiles::find(const std::string& path) const {
  if (root_.empty() || path.find('\\') != std::string::npos) return std::nullopt;
  fs::path relative = fs::path(path).relative_path();
  if (path.back() == '/') relative /= "index.html";
  for (const fs::path& part : relative) {
    if (part.empty() || part.native().front() == '.') return std::nullopt;
  }
  std::error_code error;
  const fs::path file = fs::canonical(root_ / relative, error);
  if (error || !fs::is_regular_file(file, error)) return std::nullopt;
  const auto [end, ignored] = std::mismatch(root_.begin(), root_.end(), file.begin(), file.end());
  return end == root_.end() ? std::optional(file) : std::nullopt;
}

Response StaticFiles::respond(const fs::path& file, const Request& request) const {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw NetError("cannot read " + file.string());
  const auto size = fs::file_size(file);
  const auto time = fs::last_write_time(file).time_since_epoch().count();
  std::string tag(1, '"');
  tag.append(std::to_string(size)).append("-").append(std::to_string(time)).append("\"");
  const bool hashed = file.parent_path().filename() == "assets";

  Response response;
  response.headers = {
      {"ETag", tag},
      {"Cache-Control", hashed ? "private, max-age=31536000, immutable" : "private, no-cache"}};
  const std::string* known = request.header("If-None-Match");
  if (known && known->find(tag) != std::string::npos) {
    response.status = 304;
    return response;
  }
  response.contentType = typeOf(file);
  response.body.resize(size);
  in.read(response.body.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uintmax_t>(in.gcount()) != size) throw NetError("cannot read all of " + file.string());
  return response;
}

}  // namespace scolopax::net
