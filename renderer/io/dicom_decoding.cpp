// SPDX-License-Identifier: Apache-2.0
// GDCM trusts lengths in files and crashes on some damaged ones: it runs in child processes.
#include "renderer/io/dicom_decoding.h"

#if SCOLOPAX_HAS_GDCM
#include <algorithm>
#include <cstring>

#include "renderer/io/apart.h"
#include "renderer/io/dicom_message.h"
#include "renderer/io/text.h"

namespace scolopax::io {
namespace {

constexpr std::uint64_t kDicomMiB = std::uint64_t(1) << 20;

/// Begins the message about one file.
struct DicomHeaderMessage {
  std::uint32_t failed = 0;  ///< the text of an Error follows; otherwise a packed DicomFile
  std::uint32_t code = 0;
};

/// Begins a frame.
struct DicomFrameMessage {
  std::uint64_t wanted = 0, frame = 0, planar = 0;
};

template <class T>
std::span<const std::byte> bytesOfDicomMessage(const T& object) {
  return std::as_bytes(std::span(&object, 1));
}

/// Splits a message into its beginning and the rest.
template <class T>
std::pair<T, std::span<const std::byte>> splitDicomMessage(std::span<const std::byte> bytes) {
  T beginning;
  if (bytes.size() < sizeof beginning) throw Error(ErrorCode::badInput, ": is damaged (its library crashed)");
  std::memcpy(&beginning, bytes.data(), sizeof beginning);
  return {beginning, bytes.subspan(sizeof beginning)};
}

/// Messages about the child itself begin with ": ", as it gets no name: the file that it was at is named.
Error withDicomName(const Error& error, const std::filesystem::path& path) {
  const std::string text = error.what();
  return text.starts_with(": ") ? Error(error.code(), shown(path) + text) : error;
}

void sendDicomHeader(const Sender& sender, const std::filesystem::path& path) {
  try {
    const std::vector<std::byte> packed = packDicomFile(readDicomFile(path));
    sender.send({bytesOfDicomMessage(DicomHeaderMessage{}), packed});
  } catch (const Error& error) {
    const std::string_view text = error.what();
    sender.send({bytesOfDicomMessage(DicomHeaderMessage{1, std::uint32_t(error.code())}),
                 std::as_bytes(std::span(text))});
  }
}

Error dicomErrorFrom(const DicomHeaderMessage& message, std::span<const std::byte> text) {
  const bool known = message.code <= std::uint32_t(ErrorCode::cancelled);
  return Error(known ? ErrorCode(message.code) : ErrorCode::badInput,
               std::string(reinterpret_cast<const char*>(text.data()), text.size()));
}

/// Memory and time for the files [first, last) of `wanted`.
ApartLimits dicomDecodingLimits(std::span<const DicomFrames> wanted) {
  constexpr std::uint64_t kSlowestBytesPerSecond = kDicomMiB;
  ApartLimits limits;
  std::uint64_t largest = 0, decoded = 0, frame = 0;
  for (const DicomFrames& one : wanted) {
    largest = std::max(largest, decodingBytes(*one.file));
    frame = std::max<std::uint64_t>(frame, one.file->frameBytes());
    decoded = saturatingSum(decoded, saturatingProduct(one.file->frameBytes(), one.file->frames.size()));
  }
  limits.memoryBytes = saturatingSum(largest, 256 * kDicomMiB);
  limits.messageBytes = frame + sizeof(DicomFrameMessage);
  limits.computing += std::chrono::seconds(decoded / kSlowestBytesPerSecond);
  limits.silence = std::chrono::duration_cast<std::chrono::milliseconds>(limits.computing) * 2;
  return limits;
}

void decodeDicomInChild(std::span<const DicomFrames> wanted, std::size_t offset, Loading& loading,
                        const std::function<void(const DecodedFrame&)>& take) {
  std::size_t at = 0, sent = 0;
  const auto work = [&](const Sender& sender) {
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const DicomFile& file = *wanted[i].file;
      const DicomPixels pixels = decodeDicomFile(file);
      for (const std::size_t frame : wanted[i].frames)
        sender.send({bytesOfDicomMessage(DicomFrameMessage{i, frame, pixels.planar}),
                     std::span(pixels.bytes).subspan(frame * file.frameBytes(), file.frameBytes())});
    }
  };
  const auto receive = [&](std::span<const std::byte> bytes) {
    const auto [message, pixels] = splitDicomMessage<DicomFrameMessage>(bytes);
    const bool expected = at < wanted.size() && message.wanted == at &&
                          message.frame == wanted[at].frames[sent] &&
                          pixels.size() == wanted[at].file->frameBytes();
    if (!expected) throw Error(ErrorCode::badInput, ": is damaged (its library crashed)");
    take({offset + at, wanted[at].frames[sent], pixels, message.planar != 0});
    if (++sent == wanted[at].frames.size()) ++at, sent = 0;
  };
  const auto current = [&]() -> const std::filesystem::path& {
    return wanted[std::min(at, wanted.size() - 1)].file->path;
  };
  try {
    runApart("", dicomDecodingLimits(wanted), loading.stop(), work,
             {receive, [&](const std::string& line) { loading.warn(line); }});
    if (at < wanted.size()) throw Error(ErrorCode::badInput, ": is damaged (its library crashed)");
  } catch (const Error& error) {
    throw withDicomName(error, current());
  }
}

}  // namespace

void readDicomHeaders(const std::vector<std::filesystem::path>& paths, const std::stop_token& stop,
                      const std::function<void(DicomFile)>& take,
                      const std::function<void(const Error&)>& fail) {
  constexpr std::size_t kFilesPerChild = 1000;
  constexpr ApartLimits kLimits{.memoryBytes = 512 * kDicomMiB, .messageBytes = 256 * kDicomMiB};
  for (std::size_t next = 0; next < paths.size();) {
    const std::size_t end = std::min(next + kFilesPerChild, paths.size());
    const std::size_t first = next;
    bool refused = false;  // by the caller
    const auto work = [&](const Sender& sender) {
      for (std::size_t i = first; i < end; ++i) sendDicomHeader(sender, paths[i]);
    };
    const auto receive = [&](std::span<const std::byte> bytes) {
      if (next == end) throw Error(ErrorCode::badInput, ": is damaged (its library crashed)");
      const auto [message, rest] = splitDicomMessage<DicomHeaderMessage>(bytes);
      if (message.failed != 0) return ++next, fail(dicomErrorFrom(message, rest));
      DicomFile file = unpackDicomFile(rest, paths[next]);
      ++next;
      refused = true;
      take(std::move(file));
      refused = false;
    };
    try {
      runApart("", kLimits, stop, work, {receive, [](const std::string&) {}});
      if (next < end) throw Error(ErrorCode::badInput, ": is damaged (its library crashed)");
    } catch (const Error& error) {
      const bool here = error.code() == ErrorCode::cancelled || error.code() == ErrorCode::busy;
      if (refused || here || next == end) throw withDicomName(error, paths[std::min(next, end - 1)]);
      fail(withDicomName(error, paths[next]));
      ++next;
    }
  }
}

void decodeDicomFrames(const std::vector<DicomFrames>& wanted, Loading& loading,
                       const std::function<void(const DecodedFrame&)>& take) {
  constexpr std::size_t kFilesPerChild = 1000;
  for (const DicomFrames& one : wanted)
    loading.checkMemory(shown(one.file->path) + ": its pixels", decodingBytes(*one.file));
  for (std::size_t first = 0; first < wanted.size(); first += kFilesPerChild)
    decodeDicomInChild(std::span(wanted).subspan(first, std::min(kFilesPerChild, wanted.size() - first)),
                       first, loading, take);
}

}  // namespace scolopax::io
#endif
