// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/vtk_chars.h"

#include <algorithm>
#include <cstring>

namespace scolopax::io {
namespace {

constexpr std::size_t kVtkBuffer = 1 << 16, kLongestVtkWord = 1024, kLongestVtkLine = 1 << 16;

}  // namespace

VtkChars::VtkChars(const std::filesystem::path& path, std::uint64_t begin, std::uint64_t end,
                   ByteStream::Encoding encoding)
    : begin_(begin), stream_(path, encoding, begin), buffer_(kVtkBuffer) {
  limit_ = std::min(end - std::min(begin, end), stream_.largestSize());
}

bool VtkChars::fill() {
  const std::uint64_t rest = limit_ - std::min(limit_, stream_.position());
  at_ = 0;
  size_ = stream_.readSome(std::as_writable_bytes(
      std::span(buffer_).first(std::size_t(std::min<std::uint64_t>(rest, buffer_.size())))));
  return size_ > 0;
}

std::string_view VtkChars::buffered() {
  peek();
  return {buffer_.data() + at_, size_ - at_};
}

std::uint64_t VtkChars::left() const { return limit_ - std::min(limit_, stream_.position()) + (size_ - at_); }

std::size_t VtkChars::readSome(std::span<std::byte> bytes) {
  std::size_t done = std::min(bytes.size(), size_ - at_);
  std::memcpy(bytes.data(), buffer_.data() + at_, done);
  at_ += done;
  const std::uint64_t rest = limit_ - std::min(limit_, stream_.position());
  const auto more = std::size_t(std::min<std::uint64_t>(bytes.size() - done, rest));
  return done + stream_.readSome(bytes.subspan(done, more));
}

bool VtkChars::skip(std::uint64_t count) {
  if (count > left()) return false;
  const auto inBuffer = std::size_t(std::min<std::uint64_t>(count, size_ - at_));
  at_ += inBuffer;
  if (count > inBuffer) stream_.skip(count - inBuffer);
  return true;
}

std::string_view VtkChars::word() {
  while (isVtkBlank(peek())) ++at_;
  word_.clear();
  for (int c = peek(); c >= 0 && !isVtkBlank(c) && word_.size() < kLongestVtkWord; c = peek()) {
    word_ += char(c);
    ++at_;
  }
  return word_;
}

std::string VtkChars::line() {
  std::string line;
  for (int c = get(); c >= 0 && c != '\n'; c = get()) {
    if (line.size() < kLongestVtkLine) line += char(c);
  }
  if (line.ends_with('\r')) line.pop_back();
  return line;
}

}  // namespace scolopax::io
